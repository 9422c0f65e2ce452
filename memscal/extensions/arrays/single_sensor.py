"""One sensor of a calibrated array as an ordinary apparatus function."""

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.kernels import gaussian_transfer, unit_gaussian
from memscal.errors import InputError, require_names
from memscal.estimation.band import RESOLVED
from memscal.extensions.arrays.array_data import RADII, ArrayData
from memscal.model.apparatus import (
    ApparatusRadial,
    ParameterSet,
    Reconvolution,
    TransferFunction,
)
from memscal.model.arrays import TINY, Arrays, FloatArray
from memscal.model.instrument import StressSensor
from memscal.model.stress import StressProfile

_ESTIMATED = np.array(["conversion_constant", "gaussian_sigma", "centre", "centre_y", "baseline"])
#: What is that of the array.
_SAME = (
    "film",
    "indenter",
    "load",
    "process",
    "load_cell",
    "stage",
    "user",
    "start_time",
    "end_time",
)


def single_sensor(array: ArrayData, name: str) -> ApparatusFunction:
    """Return a sensor of an array, with what is known of it by all sources."""
    used = np.array(array.sensors)[array.used].tolist()
    require_names("The array does not use a sensor", [name], used)
    reference = array.reference
    if reference is None:
        raise InputError(
            f"The fields of the array are measured: {name} has no apparatus function.",
            cure="Calibrate it with kernel='common' or 'own'.",
        )
    i = array.sensors.index(name)
    parameters, rows = _parameters(array, i)
    a, sigma = parameters.values[:2]
    of_a = rows[0] / a
    kernel, changes, of_modes = array.kernel_of(i)
    of_kernel = changes.T @ of_modes
    gaussian = gaussian_transfer(array.k, sigma)
    of_modulus = np.linalg.norm(of_kernel, axis=1)
    # Resolved is what the Gaussian has of three uncertainties or more.
    lost = RESOLVED * of_modulus > gaussian
    lost[-1] = True
    resolved = float(array.k[lost.argmax()])

    r = RADII * sigma
    profiles = array.radial(np.column_stack([kernel, changes.T]), r)
    g = profiles[:, 0]
    of_g = profiles[:, 1:] @ of_modes
    errors = np.linalg.norm(of_g, axis=1)
    with_a = of_g @ of_a / np.maximum(errors * np.linalg.norm(of_a), TINY)
    kernel_changes = _by_source(array, of_g + np.outer(g, of_a))
    del kernel_changes["noise"]
    # Without what other sensors alone fail.
    checks = [
        check
        for check in array.checks
        if check.passed or name in (array.failing.get(check.name) or used)
    ]
    return ApparatusFunction(
        plane=None,
        radial_profile=ApparatusRadial(
            r, g, errors, unit_gaussian(r, sigma), of_g @ of_g.T, with_a
        ),
        transfer=TransferFunction(array.k, abs(kernel), of_modulus, np.ones_like(kernel), resolved),
        reconvolution=_reconvolution(array, i, reference * np.stack([kernel, gaussian])),
        parameters=parameters,
        checks=tuple(checks),
        sensor=StressSensor(name=name),
        reference=_stress(array, reference),
        budget={
            quantity: {source: abs(float(u)) for source, u in _by_source(array, row).items()}
            for quantity, row in zip(parameters.names, rows, strict=False)
        },
        kernel_changes=kernel_changes,
        **{field: getattr(array, field) for field in _SAME},
    )


def _stress(array: ArrayData, reference: FloatArray) -> StressProfile:
    """Return the stress of the calibration by its transform per newton."""
    radii = 8 * array.film.thickness * np.linspace(0.0, 1.0, 321)
    stress = array.load * array.radial(reference, radii)
    return StressProfile(
        r=radii, sigma_zz=stress, load=array.load, film=array.film, indenter=array.indenter
    )


def _parameters(array: ArrayData, i: int) -> tuple[ParameterSet, FloatArray]:
    """Return the numbers of a sensor, and the columns (2, c) of A and of its Gaussian's width."""
    of_a, of_x, of_y = (part[i] for part in array.split(array.columns)[:3])
    a = array.conversion_constants[i]
    values = np.array([a, array.gaussian_sigmas[i], *array.centres[i], array.baselines[i]])
    columns = np.stack([a * of_a, array.sigma_columns[i], of_x, of_y, np.zeros_like(of_a)])
    covariance = columns @ columns.T
    if array.baseline_uncertainties is not None:
        covariance[-1, -1] = array.baseline_uncertainties[i] ** 2
    # A line tells no centre across it.
    known = np.isfinite(values)
    names = tuple(_ESTIMATED[known].tolist())
    covariance = covariance[np.ix_(known, known)]
    return ParameterSet(names, values[known], covariance, reading=array.reading), columns[:2]


def _by_source(array: ArrayData, columns: FloatArray) -> Arrays:
    """Return the norm of what the scan leaves open of numbers (c,) or (m, c), and each input's."""
    opened = array.root.shape[1]
    inputs = zip(array.effects, columns.T[opened:], strict=True)
    return {"noise": np.linalg.norm(columns.T[:opened], axis=0), **dict(inputs)}


def _reconvolution(array: ArrayData, i: int, spectra: FloatArray) -> Reconvolution:
    """Return the readings of a sensor less what it reads of the others' signals."""
    readings = array.readings
    distance = array.distances(i)
    scale = array.conversion_constants[i] * readings.load
    own, gaussian = scale * array.radial(spectra.T, abs(distance)).T + readings.background[i]
    residual = readings.u[i] - readings.predicted[i]
    columns = {
        "x": readings.x if array.on_a_line else distance,
        "u_zz": own + residual,
        "u_zz_errors": np.full_like(own, np.sqrt(array.noise[i, i])),
        "u_zz_predicted": own,
        "u_zz_gaussian": gaussian,
        "residual": residual,
    }
    order = np.argsort(columns["x"], kind="stable")
    kept = order[np.isfinite(residual[order])]
    return Reconvolution(**{name: values[kept] for name, values in columns.items()})
