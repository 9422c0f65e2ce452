"""The size of the studies, what no estimator can be better than, and what chance allows."""

import os
from dataclasses import replace
from functools import lru_cache

import numpy as np
from helpers.scans import CENTRE, CONVERSION, EXACT_FILM, GAUSSIAN, simulated
from scipy.stats import chi2

import memscal
from memscal import ParameterSet
from memscal.model.arrays import FloatArray

FULL = bool(os.environ.get("MEMSCAL_FULL_STUDY"))
"""Whether studies run over all their seeds and on their finest meshes."""


RARE = 1e-9
"""Probability with which a correct program would fail one of the random tests."""


def root_mean_square_limit(ratio: float, count: int, chance: float) -> float:
    """Largest RMS of ``count`` normal deviates of RMS ``ratio``, but for this chance."""
    return ratio * float(np.sqrt(chi2.isf(chance, count) / count))


def root_mean_square_range(count: int, chance: float) -> FloatArray:
    """Smallest and largest RMS of ``count`` normal deviates, but for this chance each."""
    return np.sqrt(chi2.isf([1 - chance, chance], count) / count)


def root_mean_square(values) -> FloatArray:
    """RMS along the first axis."""
    return np.sqrt(np.mean(np.square(values), axis=0))


def deviates(parameters: ParameterSet, truths: dict[str, float]) -> list[float]:
    """Return errors of parameters over their standard uncertainties."""
    return [
        (parameters[name] - true) / parameters.uncertainty(name) for name, true in truths.items()
    ]


@lru_cache
def cramer_rao(
    noise: float,
    kernel: memscal.GaussianMixture = GAUSSIAN,
    *,
    centre=(CENTRE, 0.0),
    inexact=False,
    **setting,
) -> dict[str, float]:
    """Cramer-Rao bounds of A, sigma, centre and baseline, all unknown, in SI units.

    The baseline may be curved by half a percent of the largest signal, edge to centre.  By finite
    differences of simulated, noise-free scans: not by the estimator's own Jacobian.
    ``inexact``: with what the uncertainties of the paper's film and of a load known to 1 % add.
    """
    width = kernel.sigmas[0]
    names = ("conversion_constant", "gaussian_sigma", "centre", "centre_y")
    steps = dict(zip(names, (1e-4 * CONVERSION, 1e-4 * width, 0.01e-3, 0.01e-3), strict=True))

    def voltage(name="", change=0.0, **other):
        a, s, x, y = np.array([CONVERSION, width, *centre]) + change * (np.array(names) == name)
        sigmas = tuple(sigma * s / width for sigma in kernel.sigmas)
        return simulated(
            conversion_constant=a,
            kernel=memscal.GaussianMixture(kernel.weights, sigmas),
            centre=(x, y),
            noise=0.0,
            baseline=0.0,
            drift=0.0,
            **(setting | other),
        ).u_zz.ravel()

    if not setting.get("raster"):
        del steps["centre_y"]
    signal = voltage()
    columns = [(voltage(name, h) - voltage(name, -h)) / 2 for name, h in steps.items()]
    made = simulated(noise=noise, kernel=kernel, centre=centre, **setting)
    parabola = sum((axis.ravel() / max(np.ptp(axis) / 2, 1e-9)) ** 2 for axis in made.positions)
    # In units of the steps, of the largest signal, and of the curvature's standard deviation.
    flat = np.full(signal.size, signal.max())
    # Of three readings a median is the largest signal, over that in the outer quarter.
    far = np.median(signal[parabola >= np.quantile(parabola, 0.75)])
    largest = np.median(np.sort(signal)[-3:]) - far
    whole = np.stack([*columns, flat, 0.005 * largest * parabola], axis=1)
    deviation = made.synthetic["noise"]
    information = whole.T @ whole / deviation**2
    information[-1, -1] += 1
    variance = np.diag(np.linalg.inv(information))[:-1].copy()
    if inexact:
        changes = {"thickness": 1.01 * EXACT_FILM.thickness}, {"poisson_ratio": 0.495}
        film = setting.get("film", EXACT_FILM)
        others = [1.01 * signal, *(voltage(film=replace(film, **c)) for c in changes)]
        by_voltage = np.linalg.solve(information, whole.T / deviation**2)[:-1]
        shifts = [by_voltage @ (other - signal) for other in others]
        variance += np.sum(np.square(shifts), axis=0)
    bounds = np.sqrt(variance) * [*steps.values(), signal.max()]
    return dict(zip([*steps, "baseline"], bounds.tolist(), strict=True))


WIDEST = {"conversion_constant": 4.0, "baseline": 1.6}
"""Largest uncertainties over their bounds: a free G, and a drift, cost A and the baseline more."""


def assert_as_stated(parameters: ParameterSet, truths, bounds: dict[str, float]):
    """Assert that the truth is within four uncertainties, and these are at their bounds."""
    for name, bound in bounds.items():
        u = parameters.uncertainty(name)
        assert abs(parameters[name] - truths[name]) < 4 * u, name
        assert 0.85 * bound < u < WIDEST.get(name, 1.2) * bound, name
