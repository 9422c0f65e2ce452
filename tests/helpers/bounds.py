"""The size of the studies, what no estimator can be better than, and what chance allows."""

import os
from functools import lru_cache

import numpy as np
from helpers.scans import CENTRE, CONVERSION, SIGMA, simulated
from scipy.stats import chi2

import memscal
from memscal.model.arrays import FloatArray

FULL = bool(os.environ.get("MEMSCAL_FULL_STUDY"))
"""Whether studies run over all their seeds and on their finest meshes."""


def root_mean_square_limit(ratio: float, count: int, chance: float) -> float:
    """Largest RMS of ``count`` normal deviates of RMS ``ratio``, but for this chance."""
    return ratio * float(np.sqrt(chi2.isf(chance, count) / count))


@lru_cache
def cramer_rao(
    noise: float, sigma: float = SIGMA, centre: float = CENTRE, points: int = 65, repeats: int = 1
) -> tuple[float, float]:
    """Cramer-Rao bounds of A and sigma, relative; A, sigma, centre and baseline unknown.

    By finite differences of simulated, noise-free scans: not by the estimator's own Jacobian.
    """
    still = {"noise": 0.0, "points": points, "baseline": 0.0, "drift": 0.0}

    def voltage(a: float = CONVERSION, s: float = sigma, x: float = centre) -> FloatArray:
        kernel = memscal.GaussianMixture((1.0,), (s,))
        return simulated(conversion_constant=a, kernel=kernel, centre=(x, 0.0), **still).u_zz

    step, shift = 1e-4, 0.01e-3
    columns = [
        (voltage(a=CONVERSION * (1 + step)) - voltage(a=CONVERSION * (1 - step))) / (2 * step),
        (voltage(s=sigma * (1 + step)) - voltage(s=sigma * (1 - step))) / (2 * step),
        (voltage(x=centre + shift) - voltage(x=centre - shift)) / (2 * shift * 1e3),
        np.ones(points),
    ]
    jacobian = np.stack(columns, axis=1)
    deviation = noise * voltage().max() / np.sqrt(repeats)
    bound = np.sqrt(np.diag(np.linalg.inv(jacobian.T @ jacobian))) * deviation
    return float(bound[0]), float(bound[1])
