"""Restoration of the stress at the base of the film from a scan and a calibrated sensor."""

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import chain
from os import PathLike

import numpy as np

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers
from memscal.errors import FitError, InputError
from memscal.estimation.model_tests import axisymmetry_test, symmetry_test
from memscal.estimation.points import ScanPoints, measured_points, passes_at_load
from memscal.estimation.profile import (
    CentreError,
    ProfileEstimate,
    estimate_profile,
    point_messages,
)
from memscal.estimation.residuals import (
    FEWEST_RESIDUALS,
    chi_square_test,
    residuals_of,
    scatter_of_means,
)
from memscal.estimation.set_up import accepted_differences, file_in_words, stated_differences
from memscal.formats.files import FilePath
from memscal.formats.opened import opened_scan
from memscal.formats.reference import read_reference
from memscal.measurement.posterior import film_transfer, posterior_of, reach_of, sensor_changes
from memscal.measurement.restoration import SAME_LOAD, Expected, Restoration
from memscal.model.arrays import FloatArray
from memscal.model.checks import (
    FAILED_CALIBRATION,
    NOISE_UNSTATED,
    Message,
    QualityCheck,
    added_check,
    check,
    chi_square_limit,
    failed_check_messages,
    noise_check,
    outlier_check,
    override_messages,
    state_of_checks,
    uncertainty_unstated_messages,
)
from memscal.model.indenter import Rod
from memscal.model.measured_stress import MeasuredScan
from memscal.model.provenance import accepted_alterations
from memscal.model.records import FILM, SENSOR
from memscal.model.scan import Scan
from memscal.model.sizes import MOST_OF_CONTACT, too_large
from memscal.parallel import single_threaded
from memscal.progress import reported
from memscal.readings.mistaken_unit import require_span
from memscal.readings.noise_record import record_messages

#: What tells films apart; the modulus, too, by which a curved indenter's contact grows.
_FILM = ("young_modulus", "poisson_ratio", "thickness", "law", "mooney_rivlin_ratio", "name")
#: Lines whose loads differ by less than this are repeats of one load.
_ONE_LOAD = 0.05
#: Recorded loads of one line scatter by less than this about their median.
_SCATTER = 0.15


def single_loads(scan: Scan) -> tuple[Scan, ...]:
    """Split a scan by direction of sliding, and by load, if recorded, the smallest first."""
    directions = [scan.only_direction(word) for word in scan.directions] or [scan]
    return tuple(chain(*map(_by_load, directions)))


def _by_load(scan: Scan) -> tuple[Scan, ...]:
    # Lines whose median loads lie within 5 % of each other are repeats of one load, the median of
    # all recorded ones.  A line at several loads, or without any, raises an InputError.
    if scan.normal_load is None:
        return (scan,)
    passes = scan.passes
    if scan.kind != "repeats" and not passes.any():
        return (replace(scan, load=_line_load(scan, scan.normal_load, "")),)
    lines = range(passes.max() + 1)
    loads = np.array(
        [_line_load(scan, scan.normal_load[passes == i], f", line {i + 1}") for i in lines]
    )
    order = np.argsort(loads, kind="stable")
    starts = np.flatnonzero(np.diff(loads[order]) > _ONE_LOAD * loads[order][:-1]) + 1
    singles = []
    for group in np.split(order, starts):
        load = float(np.nanmedian(scan.normal_load[np.isin(passes, group)]))
        singles.append(passes_at_load(scan, group, load))
    return tuple(singles)


def scan_at_load(scan: Scan, load: float) -> Scan:
    """Return what a scan holds of one of its loads, in N."""
    singles = single_loads(scan)
    for single in singles:
        if abs(single.stated_load - load) <= _ONE_LOAD * load:
            return single
    held = ", ".join(f"{single.stated_load:.4g}" for single in singles)
    raise InputError(
        f"{place_of(scan)} has loads of {held} N, and none of {load:.4g} N.",
        cure="Give one of these loads, to within 5 %.",
    )


def place_of(scan: Scan | MeasuredScan) -> str:
    """Name a scan's file, for messages."""
    return scan.source.file_name if scan.source else "The scan"


def load_of(scan: Scan) -> str:
    """Name a scan's file, load and lubrication, for messages."""
    words = (place_of(scan), f"{scan.load:.4g} N", *scan.directions, scan.lubrication)
    return ", ".join(filter(None, words))


def _line_load(scan: Scan, loads: FloatArray, line: str) -> float:
    recorded = loads[np.isfinite(loads)]
    if not recorded.size:
        raise InputError(
            f"{place_of(scan)}{line}: every load is missing (NaN in normal_load).",
            why="The stress under a curved indenter depends on its load.",
            cure="State the loads, or leave normal_load out where there is one nominal load only.",
        )
    load = float(np.median(recorded))
    if abs(recorded - load).max() > _SCATTER * load:
        raise InputError(
            f"{place_of(scan)}{line}: its loads go from {recorded.min():.4g} to "
            f"{recorded.max():.4g} N.",
            why="A line is one profile, made at one load; each load has a stress of its own.",
            cure="Store each load as a line of its own: u_zz with the axes (repeat, x), or points "
            "with a number in repeat.",
        )
    return load


_HELD = "Columns over all of them are held in memory."


def require_contact_size(scan: Scan, most: int = MOST_OF_CONTACT, why: str = _HELD) -> None:
    """Refuse a contact of more points than its stress is restored or measured from."""
    size = scan.u_zz.size
    if size > most:
        raise too_large(
            place_of(scan),
            size,
            most,
            "points of one load",
            why=why,
            cure="Average neighbouring readings, thin the raster, or leave out repeats.",
        )


def require_measurement(scan: Scan, apparatus: ApparatusFunction) -> None:
    """Refuse a scan of several loads of a curved indenter, of many points, or without cov(G)."""
    require_covariance(apparatus)
    require_contact_size(scan)
    require_span(scan)
    loads = scan.normal_load
    if loads is None or isinstance(scan.indenter, Rod):
        return
    low = np.nanmin(loads)
    high = np.nanmax(loads)
    if high - low > SAME_LOAD * scan.stated_load:
        raise InputError(
            f"The loads of the scan go from {low:.4g} to {high:.4g} N.",
            why=f"The contact of a {scan.set_up.indenter.shape} grows with its load: each has a "
            "stress of its own.",
            cure="Choose one of several loads by load (--load). Recorded loads that scatter about "
            "one are corrected for by memscal.measure_stress() (memscal apply), with a calculated "
            "contact; here leave them out of the scan.",
        )


def require_covariance(apparatus: ApparatusFunction) -> None:
    """Refuse an apparatus function without a covariance of G or an uncertainty of A."""
    radial = apparatus.radial_profile
    stated = (
        radial.g_covariance.shape == (radial.r.size, radial.r.size)
        and np.isfinite(radial.g_covariance).all()
        and np.isfinite(apparatus.parameters.uncertainty("conversion_constant"))
    )
    if not stated:
        raise InputError(
            "The apparatus function does not state the covariance of G, or the uncertainty of A.",
            why="The restored stress would have no uncertainty that means anything.",
            cure="Calibrate again with memscal calibrate.",
        )


def accept_mismatches(scan: Scan, apparatus: ApparatusFunction, *, override: bool) -> list[str]:
    """Refuse a scan of another sensor, channel or film; with ``override`` return what differs."""
    if apparatus.order:
        raise InputError(
            f"The artifact is of the tangential channel {apparatus.sensor.channel}, but "
            f"{file_in_words(scan.source, 'scan')} is to be read as normal stress.",
            why="A shear is no normal stress: this cannot be overridden.",
            cure="Give the artifact of channel zz; memscal.compare() reads the shear of measured "
            "stress.",
        )
    return accept_other_sensor(scan, apparatus, ("name", "channel"), override=override)


def accept_other_sensor(
    scan: Scan | MeasuredScan, apparatus: ApparatusFunction, names: Sequence[str], *, override: bool
) -> list[str]:
    """Refuse a scan whose sensor (its ``names``) or film is not the artifact's, or return that."""
    places = (file_in_words(scan.source, "scan"), file_in_words(apparatus.source, "artifact"))
    apparatus.require_pascals()
    unit = scan.unit or "V"
    si = apparatus.reading.si
    if unit != si:
        raise InputError(
            f"The readings of {places[0]} are in {unit}, those of the artifact in {si}.",
            cure="Give the artifact of this sensor, or correct the units of /entry/data/u_zz.",
        )
    sensors = (scan.sensor, apparatus.sensor)
    films = (scan.film, apparatus.film)
    differences = [
        *stated_differences(SENSOR, names, sensors, places),
        *stated_differences(FILM, _FILM, films, places, "film"),
    ]
    return accepted_differences(
        differences,
        override=override,
        problem="Scan and artifact do not belong together",
        why="An apparatus function holds for one channel of one sensor, as it was calibrated "
        "under its film.",
        cure="Give the artifact of this sensor and film, or correct the value that is wrong.",
    )


FORCE_LIMIT = 3.0
#: What the shapes of pressure themselves leave open of the force, however small the noise.
NEGLIGIBLE_FORCE = 0.01


def _checks(restored: Restoration) -> Iterator[QualityCheck]:
    degrees = restored.degrees
    yield check(
        "reconvolution",
        restored.chi_square / degrees,
        chi_square_limit(degrees) / degrees,
        "Reduced chi-square of the scan against the restored stress blurred again by A G. A "
        "failure means that no radial stress at the base of this film explains the scan through "
        "this apparatus function.",
    )
    load = restored.scan.stated_load
    budget = force_less_load(restored.force_budget, restored.scan.load_uncertainty)
    allowed = math.hypot(*budget.values(), NEGLIGIBLE_FORCE * load)
    yield check(
        "restored_force",
        abs(restored.force - load) / allowed,
        FORCE_LIMIT,
        f"Difference of the restored stress's total force, {restored.force:.4g} N, from the load "
        f"of {load:.4g} N, in their standard uncertainty. A failure means that gain, load or unit "
        "differ between the calibration and this scan, or that the film's Poisson's ratio, which "
        "decides how much lies beyond the scan, is wrong. It does not test A: a factor that is "
        "wrong in both, such as of one balance, changes nothing.",
    )
    yield from _noise(restored)
    yield _symmetry(restored)
    yield outlier_check(restored.posterior.estimate.outlier_weight, "the residuals")
    compared = restored.comparison
    if compared:
        yield check(
            "expected_stress",
            compared.chi_square,
            compared.limit,
            "Reduced chi-square of the scan against the expected stress blurred by A G, whose "
            "uncertainty counts, with centre and baseline fitted. The restored stress differs from "
            f"the expected one by up to {compared.difference:.1%} of the largest, and agrees "
            f"within 95 % bounds at {compared.within:.0%} of the radii. A failure means that the "
            "contact is not as it was calculated: friction, shape, film, or load.",
            compared.p_value,
        )


def force_less_load(
    force_budget: Mapping[str, float], load_uncertainty: float | None
) -> dict[str, float]:
    """Return standard uncertainties, in N, of a total force less its load, by source."""
    # A load that is larger than stated, if the rod's was on the same load cell, makes A smaller and
    # the force larger: both rise together.
    return {**force_budget, "load": force_budget.get("load", 0.0) - (load_uncertainty or 0.0)}


def _noise(restored: Restoration) -> Iterator[QualityCheck]:
    if not restored.points.noise_stated:
        return
    residuals = residuals_of(restored.posterior.estimate)
    yield noise_check(scatter_of_means(residuals, restored.posterior.found_noise))
    if residuals.degrees >= FEWEST_RESIDUALS:
        size = chi_square_test(residuals)
        yield check(
            "chi_square",
            size.value,
            size.limit,
            "What no radial pressure on the film can explain of the scan, compared with the stated "
            f"noise: reduced chi-square of {residuals.degrees} degrees. A failure means that "
            "the noise is larger than stated, the contact is not round, or the baseline is no "
            "straight line.",
            size.p_value,
        )


def _symmetry(restored: Restoration) -> QualityCheck:
    estimate = restored.posterior.estimate
    if restored.points.planar:
        name = "axisymmetry"
        uneven = axisymmetry_test(estimate)
        meaning = "elliptic columns. A failure means that the contact, or the sensor, is not round."
    else:
        name = "symmetry"
        uneven = symmetry_test(estimate)
        slid = "the friction of sliding, " if restored.scan.motion == "sliding" else ""
        meaning = (
            f"odd columns. A failure means that the left and right halves differ: {slid}a tilted "
            "indenter, an uneven film, or a drifting load."
        )
    return added_check(
        name, uneven.fall, uneven.count, f"Fall of chi-square by {uneven.count} {meaning}"
    )


def _messages(restored: Restoration, checks: Sequence[QualityCheck]) -> Iterator[Message]:
    """Yield the messages that accompany a result, warnings first."""
    yield from failed_check_messages(checks)
    yield from failed_calibration_messages(restored.apparatus)
    yield from point_messages(restored.posterior.estimate)
    yield from record_messages(restored.scan)
    if not restored.points.noise_stated:
        yield noise_unstated_message(restored.points.reading.text(restored.noise.min()))
    if not restored.apparatus.radial_profile.g_errors.any():
        yield Message(
            "uncertainty_unstated",
            "The artifact states no uncertainty of G: nothing is counted for it.",
        )
    film = restored.scan.set_up.film
    unstated = {
        "film thickness": film.thickness_uncertainty,
        "Poisson's ratio": film.poisson_ratio_uncertainty,
        "load": restored.scan.load_uncertainty,
    }
    yield from uncertainty_unstated_messages(unstated)


def failed_calibration_messages(apparatus: ApparatusFunction) -> Iterator[Message]:
    """Say that a check of the calibration had failed, if one had."""
    if not apparatus.passed:
        yield Message(
            FAILED_CALIBRATION,
            f"Quality checks of the calibration itself {state_of_checks(apparatus.checks)}.",
        )


def noise_unstated_message(noise: str) -> Message:
    """Return the message for a scan without u_zz_errors, with the estimated noise in its unit."""
    return Message(
        NOISE_UNSTATED,
        f"u_zz_errors is absent: a noise of {noise} was estimated from the scatter.",
    )


@reported
@single_threaded()
def restore(
    scan: Scan | FilePath,
    apparatus: ApparatusFunction | FilePath,
    *,
    load: float | None = None,
    direction: str | None = None,
    expected: Expected = None,
    noise_record: Scan | FilePath | None = None,
    override: bool = False,
    accept_altered: bool = False,
) -> Restoration:
    r"""Restore the stress at the base of the film from a scan with a calibrated sensor.

    Solves :math:`U_{zz} = A\,G \otimes \sigma_{zz}` for the base stress, with a known A and G: what
    presses on the film is a pressure of any radial shape, averaged by marginal likelihood, and the
    film of the scan turns it into the stress at its base.  No contact is calculated.

    Parameters
    ----------
    scan : Scan or path
        Voltage against the indenter's position, at one load; a rod's loads may differ.
    apparatus : ApparatusFunction or path
        The calibrated sensor.
    load : float, optional
        Which load of a scan of several, in N, to within 5 %.
    direction : "forth" or "back", optional
        Which direction of a scan whose indenter slid in both.
    expected : StressProfile, Contact or path, optional
        A calculated base stress to hold against the restored one: adds a check.
    noise_record : Scan or path, optional
        Readings of the sensor at rest (``memscal import --noise-record``), whose noise, in size and
        correlation, the scans' readings have at their times, in place of a stated one.
    override : bool
        Accept a scan whose sensor, channel or film is not the artifact's: a message records it.
    accept_altered : bool
        Accept files whose content does not fit their digest; recorded like what is overridden.

    Returns
    -------
    Restoration
        The stress with its uncertainty; its checks may have failed: see ``.passed``.

    Raises
    ------
    InputError
        If scan, artifact or expected stress cannot be used, or not together.
    FitError
        If the scan does not determine a stress.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1), method="bayesian").apparatus
    >>> restored = memscal.restore(memscal.simulate(seed=2), apparatus)
    >>> abs(restored.force - 1.0) < 3 * restored.force_uncertainty
    True
    """
    sensor = opened_apparatus(apparatus, accept_altered=accept_altered)
    opened = opened_scan(scan, accept_altered=accept_altered, noise_record=noise_record)
    measured = opened.only_direction(direction)
    if load is not None:
        measured = scan_at_load(measured, load)
    if isinstance(expected, str | PathLike):
        expected = read_reference(expected, accept_altered=accept_altered)
    require_measurement(measured, sensor)
    overridden = accepted_alterations(
        sensor.source, measured.source, getattr(expected, "source", None)
    )
    overridden += accept_mismatches(measured, sensor, override=override)
    restored = restore_known(measured, sensor, expected)
    return replace(restored, messages=(*override_messages(overridden), *restored.messages))


def restore_known(
    scan: Scan,
    apparatus: ApparatusFunction,
    expected: Expected = None,
    start: ProfileEstimate | None = None,
) -> Restoration:
    """Restore a stress from a scan and an apparatus function that were checked to fit together."""
    # ``start``: the pressure of nearly the same voltages.
    estimate = gaussian_pressure(scan, apparatus, start)
    posterior = posterior_of(scan, apparatus, estimate)
    nodes = posterior.nodes
    # From the axis to half the scan's width.
    r = np.linspace(0.0, reach_of(estimate.points) / 3, 161)
    matrix = posterior.wavenumbers.synthesise(np.eye(nodes), r)
    restored = Restoration(
        scan=scan,
        apparatus=apparatus,
        posterior=posterior,
        r=r,
        sigma_zz=matrix @ posterior.stress,
        covariance=matrix @ posterior.covariance[:nodes, :nodes] @ matrix.T,
    )
    if expected is not None:
        restored = replace(restored, comparison=restored.compare(expected))
    checks = tuple(_checks(restored))
    return replace(restored, checks=checks, messages=tuple(_messages(restored, checks)))


def gaussian_pressure(
    scan: Scan, apparatus: ApparatusFunction, start: ProfileEstimate | None = None
) -> ProfileEstimate:
    """Return the best Gaussian pressure on the film, with departures."""
    points = measured_points(scan)
    through = unit_force(scan, apparatus, points)
    with undetermined():
        return estimate_profile(points, through, start=start)


def unit_force(scan: Scan, apparatus: ApparatusFunction, points: ScanPoints) -> RadialSpectrum:
    """Transform of a unit force's voltages, in V m^2 / N."""
    # A film passes nothing of exp(-kh) beyond kh = 20: 2e-9 of the load.
    wavenumbers = Wavenumbers.covering(20.0 / scan.set_up.film.thickness, reach_of(points))
    transfer = apparatus.conversion_constant * sensor_changes(apparatus, wavenumbers.k)[0]
    return RadialSpectrum(wavenumbers, transfer * film_transfer(scan.set_up.expected, wavenumbers))


@contextmanager
def undetermined() -> Iterator[None]:
    """Say of a pressure that no Gaussian fits what this means."""
    try:
        yield
    except CentreError:
        raise
    except FitError as failure:
        raise FitError(
            "The scan determines no stress at the base of the film.",
            why=failure.why,
            cure="Check channel and positions; scan farther; raise the load or average repeats.",
        ) from failure
