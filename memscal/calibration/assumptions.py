"""Sizes at which what a calibration takes for granted moves its result by one uncertainty."""

import math
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from memscal.calibration.stages import Solution, solve
from memscal.calibration.uncertainty import Results
from memscal.errors import InputError
from memscal.estimation.influences import Influence, influences, measured_by
from memscal.estimation.points import measured_mask
from memscal.estimation.residuals import residuals_of
from memscal.estimation.slow_noise import slow_noise
from memscal.estimation.voltage_map import DENSE
from memscal.model.assumptions import ASSUMED, MEASURED, MOVED, NAMES, STATED, Assumption
from memscal.model.scan import Scan

#: Lines that pass farther away, in widths of the Gaussian, are hardly those of one stage.
_FARTHEST = 2.0
#: Correlations of neighbours that are tried.
_CORRELATIONS = np.linspace(0.02, 0.98, 49)
#: What states a thing, where it is not the uncertainty of the thing's name; of some it is the film.
_STATEMENTS = {
    "stage_scale": "position_scale_uncertainty",
    "load_scale": "load_uncertainty",
    "noise_correlation": "u_zz_correlation",
    "rod_friction": "rod_friction",
    "film_law": "law",
}
OF_FILM = ("thickness", "poisson_ratio", "film_law")


def statement(owner: object, name: str) -> Any:
    """What a scan, or its film, states of a thing that is else taken for granted; or None."""
    stated = getattr(owner, _STATEMENTS.get(name, f"{name}_uncertainty"), None)
    return None if isinstance(stated, str) and not stated else stated


def assumptions_of(solution: Solution, results: Results, *, loads: bool) -> tuple[Assumption, ...]:
    """Return what a calibration takes for granted, each with its sizes for one uncertainty."""
    effects = influences(solution.scans, solution.estimate)
    if not loads:
        # A is relative, or per unit of a reference that no load makes.
        del effects["load_scale"]
    sizes = {name: _sizes(effect, results) for name, effect in effects.items()}
    if solution.estimate.points.u.size <= DENSE:
        sizes["noise_correlation"] = _correlations(solution, results)
    assumptions = []
    for name in NAMES:
        state = _state(solution, name)
        # What every calibration asks for, film and load, is listed where it is missing.
        if name in sizes and (state, name) != (STATED, "load_scale"):
            assumptions.append(Assumption(name, state, sizes[name]))
    return tuple(assumptions)


def at_offsets(solution: Solution) -> Solution:
    """Solve crossed lines again at the offset at which each passes, by the other's centre."""
    # The lines are those of one stage, along x at y = 0 and along y at x = 0.
    points = solution.estimate.points
    if points.order or points.planar or not points.ellipse:
        return solution
    centres = solution.estimate.centres
    scans = []
    for scan, free in zip(solution.scans, points.free, strict=True):
        axis = int(free[0])
        offset = -float(centres[points.free[:, axis], axis].mean())
        scans.append(replace(scan, line_offset=offset))
    farthest = max(abs(scan.line_offset) for scan in scans)
    if farthest > _FARTHEST * solution.estimate.gaussian.sigma:
        return solution
    return _again(solution, scans)


def less_mean_offset(solution: Solution) -> Solution:
    """Solve again without what lines read less on average for passing beside the centre."""
    # Of an offset of mean zero the square has the mean u^2, whichever side the line passes on.
    points = solution.estimate.points
    u = np.array([scan.line_offset_uncertainty or 0.0 for scan in solution.scans])
    if points.order or not u.any() or "line_offset" in measured_by(points):
        return solution
    sigma = solution.estimate.gaussian.sigma
    if u.max() > _FARTHEST * sigma:
        raise InputError(
            f"The line offset uncertainty of the scan is {u.max() * 1e3:.4g} mm, but the sensor's "
            f"Gaussian width is {sigma * 1e3:.3g} mm.",
            why=f"Beyond {_FARTHEST:g} widths a line says nothing of the sensor's centre.",
            cure="Check its unit: m in Python and lab.toml, mm on the command line.",
        )
    offset = influences(solution.scans, solution.estimate)["line_offset"]
    mean = offset.squared * u[points.scan] ** 2
    scans = []
    for i, scan in enumerate(solution.scans):
        readings = scan.u_zz.copy()
        readings[measured_mask(scan)] -= mean[points.scan == i]
        scans.append(replace(scan, u_zz=readings))
    return _again(solution, scans)


def _again(solution: Solution, scans: Sequence[Scan]) -> Solution:
    per = solution.estimate.points.reading.per
    solved = solve(scans, solution.stresses, solution.method, owners=solution.owners, per=per)
    return replace(solved, apart=solution.apart)


def with_slow_noise(solution: Solution) -> Solution:
    """Count what correlation the noise may have, where a scan states no noise."""
    estimate = solution.estimate
    rounding = estimate.noise_scale > estimate.weighed.noise
    if rounding or estimate.points.noise_stated:
        return solution
    slow = slow_noise(estimate, residuals_of(estimate))
    return replace(solution, estimate=replace(estimate, slow=slow))


def _state(solution: Solution, name: str) -> str:
    """Say whether something is assumed, stated by every scan, or measured by them."""
    points = solution.estimate.points
    measured = name in measured_by(points)
    if name == "line_offset" and not points.planar:
        # Not by lines that are too far apart for one stage.
        measured = measured and any(scan.line_offset for scan in solution.scans)
    if measured or (name == "noise_correlation" and solution.estimate.slow):
        return MEASURED
    for scan in solution.scans:
        if statement(scan.film if name in OF_FILM else scan, name) is None:
            return ASSUMED
    return STATED


def _sizes(effect: Influence, results: Results) -> dict[str, float]:
    """Sizes of an influence, of the sign that needs less, that move each parameter by its u."""
    parameters = results.parameters
    squared = np.broadcast_to(effect.squared, effect.voltage.shape)
    moved = abs(results.by_voltage @ np.column_stack([effect.voltage, squared]))
    sizes = {}
    for parameter in MOVED:
        row = parameters.names.index(parameter)
        u = parameters.uncertainty(parameter)
        by_one, by_square = moved[row]
        if parameter == "conversion_constant":
            by_one += abs(effect.scaling) * parameters[parameter]
        # The root of by_square d^2 + by_one d = u, in a form without cancellation.
        divisor = by_one + math.sqrt(by_one**2 + 4 * by_square * u)
        sizes[parameter] = float(2 * u / divisor) if divisor > 0 else math.inf
    return sizes


def _correlations(solution: Solution, results: Results) -> dict[str, float]:
    """Correlations of neighbours that add a squared uncertainty to the variance by noise."""
    # Of noise whose correlation falls off exponentially along each pass.
    points = solution.estimate.points
    order = np.lexsort((points.x, points.y, points.repeat))
    passes = points.repeat[order]
    by_noise = results.by_voltage.dense() * solution.estimate.noise
    sizes = {}
    for parameter in MOVED:
        row = by_noise[results.parameters.names.index(parameter), order]
        added = np.zeros_like(_CORRELATIONS)
        for number in np.unique(passes):
            alike = row[passes == number]
            lags = np.arange(1, alike.size)
            products = np.correlate(alike, alike, "full")[alike.size :]
            added += 2 * (_CORRELATIONS[:, None] ** lags) @ products
        beyond = _CORRELATIONS[added >= results.parameters.uncertainty(parameter) ** 2]
        sizes[parameter] = float(beyond[0]) if beyond.size else math.inf
    return sizes
