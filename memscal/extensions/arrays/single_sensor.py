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
    round_wavenumbers,
)
from memscal.model.arrays import TINY, Arrays, FloatArray
from memscal.model.instrument import StressSensor
from memscal.model.stress import StressProfile

_ESTIMATED = np.array(["conversion_constant", "gaussian_sigma", "centre", "centre_y", "baseline"])


def single_sensor(array: ArrayData, name: str) -> ApparatusFunction:
    """Return a sensor of an array, with what is known of it by all sources."""
    used = [one for one, works in zip(array.sensors, array.used, strict=True) if works]
    require_names("The array does not use a sensor", [name], used)
    reference = array.reference
    if reference is None:
        raise InputError(
            f"The fields of the array are measured: {name} has no apparatus function.",
            cure="Calibrate it with kernel='common' or 'own'.",
        )
    i = array.sensors.index(name)
    a = array.conversion_constants[i]
    sigma = array.gaussian_sigmas[i]
    of_a, of_x, of_y = (part[i] for part in array.split(array.columns)[:3])
    of_sigma = array.sigma_columns[i]
    values = np.array([a, sigma, *array.centres[i], array.baselines[i]])
    columns = np.stack([a * of_a, of_sigma, of_x, of_y, np.zeros_like(of_a)])
    covariance = columns @ columns.T
    if array.baseline_uncertainties is not None:
        covariance[-1, -1] = array.baseline_uncertainties[i] ** 2
    # A line tells no centre across it.
    known = np.isfinite(values)

    transfer, changes, of_modes = array.kernel_of(i)
    r = RADII * sigma
    profiles = array.radial(np.column_stack([transfer, changes.T]), r)
    g = profiles[:, 0]
    of_g = profiles[:, 1:] @ of_modes
    g_errors = np.linalg.norm(of_g, axis=1)
    with_a = of_g @ of_a / np.maximum(g_errors * np.linalg.norm(of_a), TINY)
    of_transfer = changes.T @ of_modes
    errors = np.linalg.norm(of_transfer, axis=1)
    gaussian = gaussian_transfer(array.k, sigma)
    lost = RESOLVED * errors > gaussian
    readings = array.readings
    x = np.unique(readings.x if np.ptp(readings.x) else readings.y)
    sampled = np.pi * (x.size - 1) / np.ptp(x)
    resolved = float(min(array.k[np.argmax(lost) if lost.any() else -1], sampled))
    k = round_wavenumbers(resolved)
    at_k = np.array([np.interp(k, array.k, column) for column in (transfer, *of_transfer.T)])
    of_gain = of_a + (at_k[1:] / at_k[0]).T

    kernel_changes = _by_source(array, of_g + np.outer(g, of_a))
    del kernel_changes["noise"]
    radii = 8 * array.film.thickness * np.linspace(0.0, 1.0, 321)
    failing = array.failing
    checks = [
        check
        for check in array.checks
        if check.passed or not failing.get(check.name) or name in failing[check.name]
    ]
    return ApparatusFunction(
        plane=None,
        radial_profile=ApparatusRadial(
            r, g, g_errors, unit_gaussian(r, sigma), of_g @ of_g.T, with_a
        ),
        transfer=TransferFunction(array.k, abs(transfer), errors, np.ones_like(errors), resolved),
        reconvolution=_reconvolution(array, i, reference * np.stack([transfer, gaussian])),
        parameters=ParameterSet(
            tuple(_ESTIMATED[known].tolist()),
            values[known],
            covariance[np.ix_(known, known)],
            reading=array.reading,
        ),
        checks=tuple(checks),
        film=array.film,
        indenter=array.indenter,
        sensor=StressSensor(name=name),
        load=array.load,
        reference=StressProfile(
            r=radii,
            sigma_zz=array.load * array.radial(reference, radii),
            load=array.load,
            film=array.film,
            indenter=array.indenter,
        ),
        process=array.process,
        load_cell=array.load_cell,
        stage=array.stage,
        user=array.user,
        start_time=array.start_time,
        end_time=array.end_time,
        budget={
            str(quantity): {source: abs(float(u)) for source, u in _by_source(array, row).items()}
            for quantity, row in zip(_ESTIMATED[:2], columns, strict=False)
        },
        kernel_changes=kernel_changes,
        shared_effects=_by_source(array, np.vstack([of_a, of_sigma / sigma, of_gain])),
    )


def _by_source(array: ArrayData, columns: FloatArray) -> Arrays:
    """Return the norm of what the scan leaves open of numbers (c,) or (m, c), and each input's."""
    opened = array.root.shape[1]
    inputs = zip(array.effects, columns.T[opened:], strict=True)
    return {"noise": np.linalg.norm(columns.T[:opened], axis=0), **dict(inputs)}


def _reconvolution(array: ArrayData, i: int, spectra: FloatArray) -> Reconvolution:
    """Return the readings of a sensor less what it reads of the others' signals."""
    readings = array.readings
    away = np.stack([readings.x, readings.y]) - array.places[i][:, None]
    distance = np.hypot(*away)
    signals = array.conversion_constants[i] * readings.load * array.radial(spectra.T, distance).T
    # The Gaussian has an A of its own.
    signals[1] *= (signals[0] @ signals[1]) / (signals[1] @ signals[1])
    own, gaussian = signals + readings.background[i]
    residual = readings.u[i] - readings.predicted[i]
    columns = {
        "x": readings.x if array.on_a_line else distance,
        "u_zz": own + residual,
        "u_zz_errors": np.full_like(own, np.sqrt(array.noise[i, i])),
        "u_zz_predicted": own,
        "u_zz_gaussian": gaussian,
        "residual": residual,
        "load": readings.load,
        "background": readings.background[i],
    }
    if not array.on_a_line:
        columns |= {"offset_x": away[0], "offset_y": away[1]}
    order = np.argsort(columns["x"], kind="stable")
    kept = order[np.isfinite(residual[order])]
    return Reconvolution(**{name: values[kept] for name, values in columns.items()})
