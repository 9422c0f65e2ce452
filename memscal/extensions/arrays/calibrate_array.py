"""Calibration of an array: from a rod scan of all its sensors to A, crosstalk and a shape of G."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from typing import Literal, get_args

import numpy as np

from memscal.calibration.prepare import Prepared, Reference, Request, prepare
from memscal.deconvolution.division import WhiteNoise
from memscal.errors import FitError, InputError, counted, require_names
from memscal.estimation.departures import SHAPES, Shape
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import fit_gaussian_to_points
from memscal.estimation.influences import assumed_of_film
from memscal.estimation.points import MINIMUM_POSITIONS, measured_points
from memscal.estimation.reference_spectra import (
    expected_spectra,
    reference_sensitivities,
    reference_spectra,
)
from memscal.extensions.arrays.array_checks import array_checks, array_messages
from memscal.extensions.arrays.array_data import ArrayReadings, nearest_width
from memscal.extensions.arrays.array_numbers import array_numbers, kernel_modes
from memscal.extensions.arrays.joint_fit import JointFit, fit_array, fit_shape
from memscal.extensions.arrays.joint_model import ArrayState, JointModel, Layout, Noise, taken
from memscal.extensions.arrays.presses import (
    Presses,
    Sorted,
    Waves,
    fitted_layout,
    sorted_readings,
)
from memscal.extensions.arrays.sensor_array import SensorArray
from memscal.formats.scan import read_scan
from memscal.model.arrays import (
    Arrays,
    BoolArray,
    FloatArray,
    array_record,
)
from memscal.model.checks import QualityCheck, failed_check_messages
from memscal.model.film import LINEAR, FilmLaw
from memscal.model.indenter import Rod
from memscal.model.provenance import Process
from memscal.model.quantities import MM
from memscal.model.result import Gridded, Shown
from memscal.model.scan import Scan, common_circumstances
from memscal.parallel import single_threaded

KernelModel = Literal["common", "own", "auto", "measured"]
CrosstalkModel = Literal["auto", "none", "nearest", "full"]

#: Neighbours are pairs within this multiple of the least distance.
_NEIGHBOURS = 1.3
#: Departures of a sensor's own kernel, beside its width.
_OWN_SHAPES = (SHAPES[0], SHAPES[-2])
#: Standard deviation of a reading before the noise is known, over the peak.
_AT_FIRST = 0.01
#: Rounds of a fit with own shapes; widths alone are a small change, which is linear.
_OWN_ROUNDS = 4
#: A row is even if its sensors are within this share of the pitch from even places.
_UNEVEN = 0.1
#: Readings above this share of a peak count for its place.
_HIGH = 0.4


@array_record
class ArrayCalibration(Shown, Gridded):
    """A finished calibration of an array.

    Parameters
    ----------
    array : SensorArray
        The result, ready to be saved and to locate contacts.

    Examples
    --------
    >>> import memscal
    >>> scan = memscal.simulate(array=(1, 3), pitch=2e-3, crosstalk=0.01, seed=1)
    >>> calibration = memscal.calibrate_array(scan)
    >>> calibration.array.conversion_constants.shape, calibration.passed
    ((3,), True)
    """

    array: SensorArray

    def __repr__(self) -> str:
        """Return the array, without its arrays."""
        return f"<ArrayCalibration: {self.array!r}>"

    @property
    def checks(self) -> tuple[QualityCheck, ...]:
        """The quality checks of the array."""
        return self.array.checks

    @property
    def passed(self) -> bool:
        """Whether every quality check passed."""
        return self.array.passed


@single_threaded()
def calibrate_array(
    scan: Scan | str | PathLike[str],
    *,
    kernel: KernelModel = "common",
    crosstalk: CrosstalkModel | Sequence[tuple[str, str]] = "auto",
    reference: Reference = None,
    film_law: FilmLaw | None = None,
    mooney_rivlin_ratio: float | None = None,
    rod_friction: float | None = None,
    override: bool = False,
    accept_altered: bool = False,
) -> ArrayCalibration:
    r"""Find conversion constants, crosstalk, centres and the shape of G of an array of sensors.

    All sensors are fitted at once to :math:`u_i = b_i + \sum_j C_{ij} A_j\,G_j\otimes\sigma_{zz}`
    with :math:`C_{ii} = 1`.

    Parameters
    ----------
    scan : Scan or path
        Readings of all sensors against the position of the rod (``Scan(sensors=...)``).
    kernel : str
        ``"common"``: one G of all sensors.  ``"own"``: a G of each, which a single line does not
        tell from crosstalk; ``"auto"``: own ones of a raster where the evidence prefers them.
        ``"measured"``: no G, but smooth maps of what each sensor reads, without film and pascals.
    crosstalk : str or sequence of pairs of names
        ``"auto"`` and ``"nearest"``: of pairs within 1.3 of the least distance; ``"none"``;
        ``"full"``: of all pairs; or of these, (reading sensor, read one).
    reference, film_law, mooney_rivlin_ratio, rod_friction, override, accept_altered
        As :func:`memscal.calibrate` takes them.

    Returns
    -------
    ArrayCalibration
        With ``.array``; its quality checks may have failed: see ``.passed``.

    Raises
    ------
    InputError
        If the scan is of a single sensor, or it and the reference cannot be used together.
    FitError
        If the scan does not determine the parameters.

    Examples
    --------
    >>> import memscal
    >>> scan = memscal.simulate(array=(1, 4), pitch=2e-3, crosstalk=0.01, seed=1)
    >>> array = memscal.calibrate_array(scan).array
    >>> bool(abs(array.crosstalk[0, 1] - 0.01) < 0.005)
    True
    """
    opened = _opened(scan, accept_altered=accept_altered)
    require_names("There is no kernel", [kernel], get_args(KernelModel))
    if kernel == "measured":
        from memscal.extensions.arrays.measured_array import measured_array

        return ArrayCalibration(measured_array(opened))
    request = Request(
        method=WhiteNoise(),
        reference=reference,
        alternative=None,
        film_law=film_law,
        mooney_rivlin_ratio=mooney_rivlin_ratio,
        rod_friction=rod_friction,
        channel="zz",
        centre=None,
        correlations={},
        free=(),
        seed=0,
        override=override,
        accept_altered=accept_altered,
        relative=False,
    )
    found = sorted_readings(opened)
    if not found.used.any():
        raise FitError(
            f"None of the {counted(len(opened.sensors), 'sensors')} of the array answers the rod.",
            why="Readings do not rise under the rod, are at an end of the range, or are too few "
            "near each centre.",
            cure="If they fall under it, change their sign (--u-sign -1); state the ends of the "
            "range in their unit (reading_low, reading_high, --ceiling); scan past the sensors in "
            "steps of an eighth of the film's thickness.",
        )
    prepared = _prepared(opened.of_sensor(found.largest), request)
    presses = _presses(opened, prepared, found)
    fit = fit_array(*_begun(opened, prepared, found, presses, crosstalk))
    own = kernel == "own" or (kernel == "auto" and opened.planar)
    compared = _own_fit(fit, _OWN_SHAPES if own else ())
    if kernel == "own" or (own and compared.log_evidence > fit.log_evidence):
        fit, compared = compared, fit
    array = _array(opened, prepared, found, fit)
    checks, failing = array_checks(fit, compared, array, found)
    process = Process.of_now(
        configuration={
            "kernel": kernel,
            "crosstalk": crosstalk if isinstance(crosstalk, str) else [*map(list, crosstalk)],
            "film_law": film_law,
            "mooney_rivlin_ratio": mooney_rivlin_ratio,
            "rod_friction": rod_friction,
            "override": prepared.overridden,
        },
        messages=(
            *failed_check_messages(checks),
            *array_messages(opened, prepared, found, fit, failing),
        ),
        input_scan=opened.source,
    )
    return ArrayCalibration(replace(array, checks=checks, failing=failing, process=process))


def _opened(scan: Scan | str | PathLike[str], *, accept_altered: bool) -> Scan:
    """Return the scan of an array, given itself or as a path; refuse that of a single sensor."""
    if isinstance(scan, str | PathLike):
        opened = read_scan(scan, accept_altered=accept_altered)
    else:
        opened = scan
    if not getattr(opened, "sensors", ()):
        raise InputError(
            f"The scan, {opened!r}, is that of a single sensor or of none, not of an array.",
            why="An array names its sensors (Scan(sensors=...), memscal import --u 'u_*').",
            cure="Calibrate it with memscal.calibrate.",
        )
    if opened.sensor.dynamics:
        raise InputError(
            "The scan states dynamics of the sensor (/entry/instrument/stress_sensor/dynamics).",
            why="An array is calibrated by readings that follow the stress at once.",
            cure="Scan so slowly that they do, or hold the indenter, and leave the dynamics out.",
        )
    if opened.line_offset:
        raise InputError(
            f"The line of the scan passes {opened.line_offset / MM:g} mm beside the sensors "
            "(/entry/data/line_offset).",
            why="A single line is taken to pass over all sensors of an array.",
            cure="Scan a raster, which finds both coordinates of each sensor.",
        )
    return opened


def _prepared(scan: Scan, request: Request) -> Prepared:
    """Prepare the scan of one sensor, which has the film and the rod of all."""
    prepared = prepare((scan,), request)
    first = prepared.scans[0]
    if first.film is None or not isinstance(first.indenter, Rod):
        raise InputError(
            "The scan of the array has no film and rod, or a source is given in their place.",
            why="What a contact makes at the base of the film is calculated from them.",
            cure="State them (memscal import --thickness, --radius), and give no reference, or the "
            "stress of a rod.",
        )
    return prepared


def _presses(scan: Scan, prepared: Prepared, found: Sorted) -> Presses:
    """Return the presses of all places, with the readings of the used sensors."""
    single = prepared.scans[0]
    if len(prepared.scans) > 1 and single.set_up.film.law != LINEAR:
        raise InputError(
            f"The presses have {len(prepared.scans)} loads, and the film's law is not linear.",
            why="The stress then changes its shape with the load.",
            cure="Press with one load, or state film_law='linear' (--film-law linear).",
        )

    def of_presses(stated: FloatArray | None, otherwise: float) -> FloatArray:
        return np.broadcast_to(otherwise if stated is None else stated, scan.shape).ravel()

    loads = of_presses(scan.normal_load, single.stated_load)
    keep = found.keep & np.isfinite(loads)
    place_errors = of_presses(scan.x_errors, 0.0)
    if scan.kind == "repeats" and not scan.position_errors_by_repeat:
        # An error that all repeats share is not less in their mean.
        place_errors = place_errors * np.sqrt(scan.shape[0])
    axes = (0, 1) if single.planar else ("xy".index(single.direction),)
    passes = scan.passes.ravel()
    if np.bincount(passes).min() < MINIMUM_POSITIONS:
        passes = np.zeros_like(passes)
    of_pass = passes == np.arange(passes.max() + 1)[:, None]
    # By so few readings a sensor has no baseline in a pass.
    keep &= (keep.astype(int) @ of_pass.T >= MINIMUM_POSITIONS) @ of_pass
    # Each pass has a baseline and a drift.
    along = found.places[list(axes)]
    low = along.min(axis=1, keepdims=True)
    half = np.ptp(along, axis=1, keepdims=True) / 2
    straight = np.vstack([np.ones_like(passes), (along - low) / half - 1])
    drift = np.vstack([straight * one for one in of_pass])
    stated = scan.u_zz_errors
    board = np.zeros(len(found.u)) if scan.board is None else scan.board
    return Presses(
        places=found.places,
        load=np.nan_to_num(loads),
        u=np.where(keep, found.u, 0.0),
        keep=keep,
        drift=drift.T,
        axes=axes,
        place_errors=place_errors,
        load_errors=np.nan_to_num(of_presses(scan.normal_load_errors, 0.0) / loads),
        board=np.unique(board, return_inverse=True)[1],
        stated=None if stated is None else stated.reshape(keep.shape),
        averaging=scan.averaging_length or 0.0,
    )


def _pairs(
    scan: Scan, near: BoolArray, crosstalk: CrosstalkModel | Sequence[tuple[str, str]]
) -> BoolArray:
    """Return which sensors (rows) read which others, (n, n), of which some are neighbours."""
    n = len(near)
    pairs = np.zeros((n, n), bool)
    if not isinstance(crosstalk, str):
        asked = np.array(crosstalk, dtype=object)
        if asked.size and asked.shape[1:] != (2,):
            raise InputError(
                f"The crosstalk is {crosstalk!r}.",
                why="Each pair is the reading sensor and the one that it reads of.",
                cure='Give a list of pairs of names, or "auto", "none", "nearest" or "full".',
            )
        for row, column in asked:
            require_names("There is no sensor", [row], scan.sensors)
            others = [name for name in scan.sensors if name != row]
            require_names("There is no other sensor", [column], others)
            pairs[scan.sensors.index(row), scan.sensors.index(column)] = True
        return pairs
    require_names("There is no model of crosstalk", [crosstalk], get_args(CrosstalkModel))
    if crosstalk == "none":
        return pairs
    return ~np.eye(n, dtype=bool) if crosstalk == "full" else near


def _neighbours(places: FloatArray) -> BoolArray:
    """Return which sensors are neighbours, (n, n), at places (n, 2), NaN if unknown."""
    distance = np.hypot(*(places[:, None] - places).T)
    np.fill_diagonal(distance, np.nan)
    least = np.fmin.reduce(distance, axis=None)
    return np.asarray(distance <= _NEIGHBOURS * least)


def _begun(
    scan: Scan,
    prepared: Prepared,
    found: Sorted,
    presses: Presses,
    crosstalk: CrosstalkModel | Sequence[tuple[str, str]],
) -> tuple[JointModel, ArrayState, Noise]:
    """Return the model of the used sensors, and where its fit starts."""
    points = measured_points(prepared.scans[0])
    references = expected_spectra(
        prepared.scans[:1],
        prepared.stresses[:1],
        reference_spectra(prepared.stresses[:1], [points]),
    )
    forward = ForwardModel(points, references)
    alone = fit_gaussian_to_points(forward, np.ones_like(points.u))
    straight = replace(points, curvature=np.zeros(1))
    gaussian = replace(alone, points=straight, jacobian=alone.jacobian[:, :2])
    used = found.used
    high = np.maximum(presses.u - found.baseline[:, None], 0.0) * presses.keep
    high[high < _HIGH * found.peak[:, None]] = 0.0
    total = np.where(used, high.sum(axis=1), np.nan)
    centres = high @ presses.places.T / total[:, None]
    layout = centres
    if scan.layout is None:
        _guess_dead(centres, presses.axes, used)
    else:
        layout, _ = fitted_layout(scan.layout, centres[used], used)
        # Neighbours may read what a dead sensor does not tell.
        centres = np.where(used[:, None], centres, layout)
    near = _neighbours(layout)
    pairs = _pairs(scan, near, crosstalk) & used[:, None] & np.isfinite(centres[:, 0])
    waves = Waves.of(references[0], np.hypot(*np.ptp(presses.places, axis=1)))
    scaled = used & (np.arange(used.size) != found.largest)
    parameters = Layout.of(presses, scaled, pairs, near, 0)
    none = np.zeros((forward.k.size, 0))
    model = JointModel(presses, waves, parameters, none, gaussian, forward)
    n = used.size
    drift = np.zeros((n, presses.drift.shape[1]))
    drift[:, :: 1 + len(presses.axes)] = np.where(used, found.baseline, 0.0)[:, None]
    state = ArrayState(
        np.where(used, found.peak / found.peak[found.largest], 1.0),
        np.nan_to_num(centres),
        np.eye(n),
        drift,
        model.start,
        np.zeros((n, 0)),
    )
    deviation = np.where(used, _AT_FIRST * found.peak, 1.0)
    return model, state, Noise(deviation**2, np.zeros((n, n)))


def _guess_dead(centres: FloatArray, axes: tuple[int, ...], used: BoolArray) -> None:
    """Fill in the centres of dead sensors of a row of even pitch, in the order of their names."""
    number = np.arange(used.size)
    if len(axes) > 1 or used.sum() < 3:
        return
    along = centres[:, axes[0]]
    start, pitch = np.polynomial.polynomial.polyfit(number[used], along[used], 1)
    even = start + pitch * number
    if np.max(abs(along - even)[used]) < _UNEVEN * abs(pitch):
        along[~used] = even[~used]
        centres[~used, 1 - axes[0]] = 0.0


def _own_fit(fit: JointFit, shapes: Sequence[Shape]) -> JointFit:
    """Fit a width of its own for each sensor, and departures of these shapes from it."""
    model = fit.model
    gaussian = model.gaussian
    departures = [
        shape.rings(gaussian.width, gaussian.conversion_constant).transform(model.forward.k)
        for shape in shapes
    ]
    own = np.hstack([gaussian.sigma * model.gaussian_kernels[:, 1:], *departures])
    before = model.layout
    pairs = before.crosstalk >= 0
    count = own.shape[1]
    layout = Layout.of(model.presses, before.gains >= 0, pairs, before.near, count)
    state = replace(fit.state, own=np.zeros((fit.state.gain.size, count)))
    model = replace(model, layout=layout, own_kernels=own)
    rounds = _OWN_ROUNDS if shapes else 1
    return fit_shape(model, state, fit.noise, rounds)


def _effects(prepared: Prepared, fit: JointFit) -> Arrays:
    """Return what one standard uncertainty of each stated input does to the posterior's columns."""
    scan = prepared.scans[0]
    k = fit.model.forward.k
    kernel = fit.posterior.kernel
    changes = reference_sensitivities([scan], [fit.reference])
    products = {name: change[0] * kernel for name, change in changes.items()}
    slip, shear = scan.base_slip_uncertainty, scan.shear_sensitivity_uncertainty
    for name, size in (("base_slip", slip), ("shear_sensitivity", shear)):
        if size:
            by_one, _ = assumed_of_film(scan, fit.reference)[name]
            products[name] = size * by_one * kernel
    scale = scan.position_scale_uncertainty
    if scale:
        # All distances are larger: the transform of a function of them is dilated.
        product = fit.reference.values * kernel
        products["position_scale"] = -scale * (2 * product + k * np.gradient(product, k))
    # A change of the stress acts as one of the kernel.
    stress = fit.reference.values
    seen = stress != 0
    by_kernel = fit.posterior.gain @ fit.model.waves.mix[:, seen]
    return {name: -by_kernel @ (product[seen] / stress[seen]) for name, product in products.items()}


def _array(scan: Scan, prepared: Prepared, found: Sorted, fit: JointFit) -> SensorArray:
    """Return the calibrated array, with NaN for sensors that are not used."""
    used = found.used
    inputs = _effects(prepared, fit)
    columns = np.column_stack([fit.posterior.root, *inputs.values()])
    numbers = array_numbers(fit, columns)
    modes, of_modes = kernel_modes(fit, numbers)
    layout = fit.model.layout
    near = (layout.crosstalk >= 0) & used
    of_centres = taken(columns, layout.centres)
    everything = np.vstack([numbers.of_a, *of_centres, columns[layout.crosstalk[near]], of_modes])
    count = fit.posterior.root.shape[1]
    effects = dict(zip(inputs, everything.T[count:], strict=True))
    n = used.size
    for name, share in _scalings(prepared).items():
        # What scales all readings alike scales A.
        effects[name] = np.zeros(len(everything))
        effects[name][:n] = -share
    state = fit.state
    missing = np.where(used, 0.0, np.nan)
    told = np.isin([0, 1], fit.model.presses.axes)
    k = fit.model.forward.k
    widths = [nearest_width(k, kernel, fit.model.gaussian.sigma) for kernel in numbers.kernels]
    first = prepared.scans[0]
    rod = first.set_up.indenter
    assert isinstance(rod, Rod)
    spread = scan.layout_uncertainty
    of_baselines = taken(fit.posterior.root, layout.drift[:, 0])
    return SensorArray(
        sensors=tuple(scan.sensors),
        used=used,
        conversion_constants=np.exp(numbers.log_a) + missing,
        centres=np.where(told, state.centres, np.nan) + missing[:, None],
        crosstalk=np.where(near, state.crosstalk, np.eye(n)),
        estimated=near,
        gaussian_sigmas=np.resize(widths, n) + missing,
        baselines=state.drift[:, 0] + missing,
        baseline_uncertainties=np.linalg.norm(of_baselines, axis=1) + missing,
        noise=fit.noise.covariance + missing + missing[:, None],
        k=k,
        reference=fit.reference.values,
        kernels=numbers.kernels,
        modes=modes,
        root=everything[:, :count],
        effects=effects,
        film=first.set_up.film,
        indenter=rod,
        load=first.stated_load,
        readings=_readings(fit, missing),
        kernel="own" if state.own.size else "common",
        line_y=first.line_offset,
        layout=scan.layout,
        layout_uncertainty=None if spread is None else float(np.mean(spread**2) ** 0.5),
        reading_low=scan.reading_low,
        reading_high=scan.reading_high,
        reading=prepared.reading,
        process=Process.of_now(input_scan=scan.source),
        **common_circumstances([scan]),
    )


def _readings(fit: JointFit, missing: FloatArray) -> ArrayReadings:
    """Return what was read, and what the fit predicts."""
    presses = fit.model.presses
    return ArrayReadings(
        presses.places[0],
        presses.places[1],
        presses.load,
        np.where(presses.keep, presses.u, np.nan),
        fit.model.predicted(fit.state) + missing[:, None],
        fit.state.drift @ presses.drift.T + missing[:, None],
    )


def _scalings(prepared: Prepared) -> dict[str, float]:
    """Relative standard uncertainties of what scales all readings of the scan alike."""
    scan = prepared.scans[0]
    shares = {
        "gain": scan.gain_uncertainty,
        "load": (scan.load_uncertainty or 0.0) / scan.stated_load,
        "reference_convergence": prepared.stresses[0].convergence,
    }
    return {name: share for name, share in shares.items() if share}
