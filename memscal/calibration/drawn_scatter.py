"""Scatter of a calibration by repeated draws, for methods of division that are no linear window.

The derivative of such a method's result by the voltages does not describe it: a restoration that
is iterated or sampled, or one draw of the paper's noise.  The voltages are drawn anew about the
estimate's prediction, at the adopted noise, and divided by the same method, with new random
numbers of its own.  Profile, centre, baseline and width follow the voltages to first order, as they
do for every method; band, grid and fields are made anew; the weights of the points are kept.
"""

from dataclasses import is_dataclass, replace
from typing import Any

import numpy as np

from memscal.calibration.stages import Solution, solved
from memscal.calibration.uncertainty import DrawnScatter, read_off
from memscal.deconvolution.division import Method, Tikhonov, WhiteNoise, WhiteNoiseDraw, Wiener
from memscal.errors import FitError
from memscal.estimation.bayesian import Bayesian
from memscal.estimation.profile import ProfileEstimate
from memscal.model.arrays import FloatArray

#: Draws: their standard deviation is known to 1/sqrt(2 n), 10 % for 50.  Restorations of large
#: images take fewer, by the number of pixels, so that they take 1 to 4 s: 12 of 361 by 361.
_MOST = 50
_FEWEST = 12
_PIXELS = 1.6e6
#: Methods that multiply the quotient of the spectra by a window of the stress alone.
LINEAR_METHODS = (WhiteNoise, Tikhonov, Wiener, Bayesian)


def drawn_scatter(solution: Solution) -> DrawnScatter | None:
    """Repeat the division on drawn voltages; ``None`` for a linear method, which needs none."""
    if isinstance(solution.method, LINEAR_METHODS):
        return None
    count = draw_count(solution)
    rng = np.random.default_rng([0, count])
    errors = []
    results = []
    failure = ""
    method: Any = solution.method
    seeded = is_dataclass(method) and hasattr(method, "seed")
    estimate = solution.estimate
    weighed = estimate.weighed
    model = estimate.model
    predicted = estimate.predicted
    for _ in range(count):
        # Noise of the voltages (n,), in V, with which the estimate moves to first order.
        error = rng.standard_normal(predicted.size)
        if estimate.correlation:
            error = estimate.correlation.correlate(error)
        error = estimate.scatter * error
        new_seed = int(rng.integers(2**32))
        change = weighed.gain @ error
        drawn_model = replace(model, points=replace(model.points, u=predicted + error))
        left = error - estimate.basis.voltages(model, estimate.gaussian, change)
        drawn = replace(weighed, mean=weighed.mean + change, residual=left)
        moved = replace(estimate, model=drawn_model, weighed=drawn)
        try:
            other = replace(method, seed=new_seed) if seeded else method
            results.append(_divided(solution, moved, error, other))
            errors.append(error)
        except FitError as problem:
            failure = problem.problem
    if len(results) <= count // 2:
        raise FitError(
            f"Method {method.name} fails on {count - len(results)} of {count} scans like this one. "
            f"The last time: {failure}",
            why="Its uncertainty is the scatter of repeated draws of the voltages.",
            cure='Use method "white-noise" or "bayesian".',
        )
    parameters, radial, transfer = zip(*results, strict=True)
    numbers = {name: _columns([row[name] for row in parameters]) for name in parameters[0]}
    return DrawnScatter(_columns(errors), numbers, _columns(radial), _columns(transfer))


def draw_count(solution: Solution) -> int:
    """Return how many draws the scatter of a solution is taken from."""
    if isinstance(solution.method, WhiteNoiseDraw):
        return _MOST
    return int(np.clip(round(_PIXELS / solution.fields.voltage.image.size), _FEWEST, _MOST))


def _columns(rows: Any) -> FloatArray:
    """Draws (m, ...) less their mean over sqrt(m - 1), the draw as the last axis."""
    values = np.array(rows)
    apart = (values - values.mean(axis=0)) / np.sqrt(len(values) - 1)
    return np.moveaxis(apart, 0, -1)


def _divided(
    solution: Solution, estimate: ProfileEstimate, error: FloatArray, method: Method
) -> tuple[dict[str, float], FloatArray, FloatArray]:
    """Divide a draw: A and the numbers read off G, G at the solution's radii, and its transfer."""
    # The width of the Gaussian chooses the grid.
    gain = solution.estimate.gaussian.gain(solution.estimate.weights)
    sigma = estimate.gaussian.sigma + (gain[1:2] @ error)[0]
    wider = replace(estimate, gaussian=replace(estimate.gaussian, sigma=sigma))
    again = solved(solution.scans, solution.stresses, estimate, method, wider)
    transfer = np.interp(solution.fields.grid.wavenumber_axis, *again.transfer, right=0.0)
    return *read_off(again.deconvolution, solution.deconvolution.g.r), transfer
