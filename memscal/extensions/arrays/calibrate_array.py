"""Calibration of an array: from a rod scan of all its sensors to A, crosstalk and one shape of G."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from os import PathLike
from typing import Any, Literal, NamedTuple

import numpy as np

from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.calibration.prepare import Prepared, Reference, Request, prepare
from memscal.deconvolution.division import WhiteNoise
from memscal.errors import FitError, InputError, counted
from memscal.estimation.departures import SHAPES
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit, fit_gaussian_to_points
from memscal.estimation.points import measured_points
from memscal.estimation.reference_spectra import (
    expected_spectra,
    reference_sensitivities,
    reference_spectra,
)
from memscal.extensions.arrays.array_checks import array_checks, failing_messages
from memscal.extensions.arrays.array_data import ArrayReadings
from memscal.extensions.arrays.array_numbers import (
    array_numbers,
    input_columns,
    kernel_modes,
    of_all_sensors,
    stacked,
)
from memscal.extensions.arrays.joint_fit import JointFit, fit_array
from memscal.extensions.arrays.joint_model import ArrayState, JointModel, Layout, Noise
from memscal.extensions.arrays.presses import Presses, Sorted, Waves, sorted_readings
from memscal.extensions.arrays.sensor_array import SensorArray
from memscal.formats.opened import opened_array
from memscal.model.arrays import (
    Arrays,
    BoolArray,
    FloatArray,
    IndexArray,
    array_record,
    require_names,
)
from memscal.model.checks import Checked, Message, QualityCheck
from memscal.model.film import FilmLaw
from memscal.model.provenance import Process
from memscal.model.result import Shown
from memscal.model.scan import Scan
from memscal.parallel import single_threaded

KernelModel = Literal["common", "own", "auto", "measured"]
CrosstalkModel = Literal["auto", "none", "nearest", "full"]

#: Neighbours are pairs within this multiple of the least distance.
_NEIGHBOURS = 1.3
#: Departures of a sensor's own kernel, beside its width.
_OWN_SHAPES = (SHAPES[0], SHAPES[-2])
#: Standard deviation of a reading before the noise is known, over the peak.
_AT_FIRST = 0.01
#: Readings above this share of a peak count for its place.
_HIGH = 0.4


@array_record
class ArrayCalibration(Checked, Shown):
    """A finished calibration of an array.

    Parameters
    ----------
    array : SensorArray
        The result, ready to be saved and to locate contacts.
    fit : JointFit, optional
        The posterior that it was made of; none of measured fields.

    Examples
    --------
    >>> import memscal
    >>> scan = memscal.simulate(array=(1, 3), pitch=2e-3, crosstalk=0.01, seed=1)
    >>> calibration = memscal.calibrate_array(scan)
    >>> calibration.array.conversion_constants.shape, calibration.passed
    ((3,), True)
    """

    array: SensorArray
    fit: JointFit | None = None

    def __repr__(self) -> str:
        """Return the array, without its arrays."""
        return f"<ArrayCalibration: {self.array!r}>"

    @property
    def checks(self) -> tuple[QualityCheck, ...]:
        """The checks of the array."""
        return self.array.checks


class _Begun(NamedTuple):
    """What a fit of the used sensors starts from."""

    model: JointModel
    state: ArrayState
    noise: Noise
    gaussian: GaussianFit
    forward: ForwardModel


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
    opened = opened_array(scan, accept_altered=accept_altered)
    require_names("There is no kernel", [kernel], KernelModel.__args__)
    if kernel == "measured":
        from memscal.extensions.arrays.measured_fields import measured_array

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
    singles = [opened.of_sensor(i) for i in range(len(opened.sensors))]
    places = np.stack([values.ravel() for values in singles[0].positions])
    u = opened.u_zz.reshape(len(singles), -1)
    found = sorted_readings(opened, places, u)
    if not found.used.any():
        raise FitError(
            f"None of the {counted(len(singles), 'sensors')} of the array answers the rod.",
            cure="Look at the readings; press on the sensors.",
        )
    strongest = singles[int(np.argmax(np.where(found.used, found.peak, -np.inf)))]
    prepared = prepare((strongest,), request)
    begun = _begun(opened, prepared, found, places, u, _pairs(opened, found, places, u, crosstalk))
    fit = fit_array(*begun)
    other = _own_fit(fit, begun)
    chosen, compared = _chosen(fit, other, kernel, planar=strongest.planar)
    array = _array(opened, prepared, found, chosen, _effects(prepared, chosen))
    checks, failing = array_checks(chosen, compared, array, found)
    messages = [*failing_messages(checks, failing, array), *_messages(opened, prepared)]
    process = replace(array.process, messages=tuple(messages))
    finished = replace(array, checks=checks, failing=failing, process=process)
    return ArrayCalibration(finished, chosen)
