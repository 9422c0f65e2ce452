"""One sensor of a calibrated array as an ordinary apparatus function."""

from dataclasses import replace

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.kernels import gaussian_transfer, unit_gaussian
from memscal.errors import InputError
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

#: Radii of the reference stress in thicknesses of the film.
_REACH = np.linspace(0.0, 8.0, 321)


def single_sensor(array: ArrayData, name: str) -> ApparatusFunction:
    """Return a sensor of an array, with what is known of it by all sources."""
    used = [one for one, works in zip(array.sensors, array.used, strict=True) if works]
    if name not in used or array.reference is None:
        raise InputError(
            f"There is no apparatus function of a sensor {name} of the array.",
            why="Those of the sensors that are used are known, where G was calibrated.",
            cure=f"Choose from {', '.join(used)}; calibrate with kernel='common' or 'own'.",
        )
    i = array.sensors.index(name)
    a = array.conversion_constants[i]
    sigma = array.gaussian_sigmas[i]
    transfer, changes, of_modes = array.kernel_of(i)
    of_a, of_x, of_y = (part[i] for part in array.split(array.columns)[:3])
    of_sigma = array.sigma_columns[i]
    of_transfer = changes.T @ of_modes
    gaussian = gaussian_transfer(array.k, sigma)

    r = RADII * sigma
    profiles = array.radial(np.column_stack([transfer, changes.T]), r)
    g = profiles[:, 0]
    of_g = profiles[:, 1:] @ of_modes
    g_errors = np.linalg.norm(of_g, axis=1)
    with_a = of_g @ of_a / np.maximum(g_errors * np.linalg.norm(of_a), TINY)

    errors = np.linalg.norm(of_transfer, axis=1)
    lost = RESOLVED * errors > gaussian
    x = np.unique(array.readings.x)
    sampled = np.pi * (x.size - 1) / np.ptp(x)
    resolved = float(min(array.k[np.argmax(lost) if lost.any() else -1], sampled))
    k = round_wavenumbers(resolved)
    at_k = np.transpose([np.interp(k, array.k, column) for column in (transfer, *of_transfer.T)])

    rows = {
        "conversion_constant": (a, a * of_a),
        "gaussian_sigma": (sigma, of_sigma),
        "centre": (array.centres[i, 0], of_x),
        "centre_y": (array.centres[i, 1], of_y),
        "baseline": (array.baselines[i], np.zeros_like(of_a)),
    }
    if array.on_a_line:
        del rows["centre_y"]
    columns = np.stack([column for _, column in rows.values()])
    covariance = columns @ columns.T
    if array.baseline_uncertainties is not None:
        covariance[-1, -1] = array.baseline_uncertainties[i] ** 2
    budget = {
        quantity: {source: float(abs(u)) for source, u in _by_source(array, column).items()}
        for quantity, (_, column) in list(rows.items())[:2]
    }
    kernel_changes = _by_source(array, of_g + np.outer(g, of_a))
    del kernel_changes["noise"]
    gain_changes = of_a + at_k[:, 1:] / at_k[:, :1]
    radii = _REACH * array.film.thickness
    stress = array.load * array.radial(array.reference, radii)
    failing = array.failing
    checks = [
        check
        for check in array.checks
        if check.passed or not failing.get(check.name) or name in failing[check.name]
    ]
    configuration = {**array.process.configuration, "array": list(array.sensors)}
    return ApparatusFunction(
        plane=None,
        radial_profile=ApparatusRadial(
            r, g, g_errors, unit_gaussian(r, sigma), of_g @ of_g.T, with_a
        ),
        transfer=TransferFunction(array.k, abs(transfer), errors, np.ones_like(errors), resolved),
        reconvolution=_reconvolution(array, i, array.reference * np.stack([transfer, gaussian])),
        parameters=ParameterSet(
            tuple(rows),
            np.array([value for value, _ in rows.values()]),
            covariance,
            reading=array.reading,
        ),
        checks=tuple(checks),
        film=array.film,
        indenter=array.indenter,
        sensor=StressSensor(name=name),
        load=array.load,
        reference=StressProfile(
            r=radii, sigma_zz=stress, load=array.load, film=array.film, indenter=array.indenter
        ),
        process=replace(array.process, configuration=configuration),
        budget=budget,
        kernel_changes=kernel_changes,
        shared_effects=_by_source(array, np.vstack([of_a, of_sigma / sigma, gain_changes])),
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
    background = readings.background[i]
    own, gaussian = signals + background
    residual = readings.u[i] - readings.predicted[i]
    columns = {
        "x": readings.x,
        "u_zz": own + residual,
        "u_zz_errors": np.full_like(own, np.sqrt(array.noise[i, i])),
        "u_zz_predicted": own,
        "u_zz_gaussian": gaussian,
        "residual": residual,
    }
    if not array.on_a_line:
        columns |= {"x": distance, "offset_x": away[0], "offset_y": away[1]}
        columns |= {"load": readings.load, "background": background}
    order = np.argsort(columns["x"], kind="stable")
    kept = order[np.isfinite(residual[order])]
    return Reconvolution(**{name: values[kept] for name, values in columns.items()})
