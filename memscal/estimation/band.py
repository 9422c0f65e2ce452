r"""Up to which wavenumber the scan determines the apparatus function.

The measured points are rings: the transform of the voltage at :math:`k` is a sum
:math:`\sum_i a_i u_i J_0(kR_i)` with ring areas :math:`a_i`, and its noise is the same sum in
quadrature.  Points whose signal is lost in noise carry the profile's tail instead, and count
as :math:`u_i^2/(u_i^2 + s_i^2)`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import j0

from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.validation import FloatArray

__all__ = ["Band", "find_band"]

#: A spectral component is relevant while it stands this many times above its noise...
RELEVANT = 10.0
#: ...and resolved while its relative standard uncertainty is below a third.
RESOLVED = 3.0


@dataclass(frozen=True, eq=False)
class Band:
    """Signal and noise of the voltage's transform.

    Parameters
    ----------
    k : ndarray, shape (n,)
        Wavenumbers, in rad/m.
    signal, noise : ndarray, shape (n,)
        Modulus of the voltage's transform and its noise, in V m^2 / N.
    relevant, resolved : float
        Wavenumbers beyond which the signal stays below ten and three times the noise, in rad/m;
        at most the last one that the scan's step samples.
    weakest_voltage, weakest_reference : float
        Moduli of both fields' transforms at ``relevant``.
    """

    k: FloatArray
    signal: FloatArray
    noise: FloatArray
    relevant: float
    resolved: float
    weakest_voltage: float
    weakest_reference: float


def find_band(estimate: ProfileEstimate) -> Band:
    """Find the relevant and the resolved band of a scan."""
    spectrum = estimate.spectrum
    k, signal = spectrum.wavenumbers.k, np.abs(spectrum.values)
    noise = _planar_noise(estimate) if estimate.points.planar else _ring_noise(estimate, k)
    ratio = signal / noise
    # Nothing finer than two steps of the scan was sampled, whatever its signal.
    sampled = np.pi / estimate.points.step
    relevant = min(_falls_below(k, ratio, RELEVANT), sampled)
    resolved = min(_falls_below(k, ratio, RESOLVED), sampled)
    reference = np.abs(estimate.model.reference.values)
    weakest_voltage = float(np.interp(relevant, k, signal))
    weakest_reference = float(np.interp(relevant, k, reference))
    return Band(k, signal, noise, relevant, resolved, weakest_voltage, weakest_reference)


def _falls_below(k: FloatArray, ratio: FloatArray, threshold: float) -> float:
    """Return where a ratio falls below a threshold for good, log-interpolated.

    The transform of a ring-shaped G passes through zero and comes back: such a gap ends no band.
    """
    i = int(np.flatnonzero(ratio >= threshold).max(initial=-1)) + 1
    if i in (0, k.size):
        return float(k[max(i - 1, 0)])
    upper, lower = np.log(ratio[i - 1]), np.log(max(ratio[i], np.finfo(float).tiny))
    return float(k[i - 1] + (k[i] - k[i - 1]) * (upper - np.log(threshold)) / (upper - lower))


def _ring_noise(estimate: ProfileEstimate, k: FloatArray) -> FloatArray:
    points = estimate.points
    radius = estimate.distance
    signal = (estimate.predicted - estimate.background) / points.load
    noise = estimate.noise / points.load
    share = signal**2 / (signal**2 + noise**2) * estimate.outlier_weight
    area = _ring_areas(radius, tolerance=0.25 * points.step)
    weighted = area * share * noise
    return np.asarray(np.sqrt(j0(np.multiply.outer(k, radius)) ** 2 @ weighted**2))


def _ring_areas(radius: FloatArray, tolerance: float) -> FloatArray:
    """Area of the plane that each point stands for; points at equal radii share a ring."""
    order = np.argsort(radius, kind="stable")
    ordered = radius[order]
    group = np.concatenate([[0], np.cumsum(np.diff(ordered) > tolerance)])
    count = np.bincount(group)
    mean = np.bincount(group, ordered) / count
    edges = np.concatenate([[0.0], (mean[1:] + mean[:-1]) / 2, mean[-1:]])
    area = np.empty_like(radius)
    area[order] = (np.pi * np.diff(edges**2) / count)[group]
    return area


def _planar_noise(estimate: ProfileEstimate) -> FloatArray:
    """Noise of one component of a raster's transform: the same at every wavenumber.

    A raster is used as it is, so that every point brings its noise, be there signal or not.
    """
    points = estimate.points
    cell = points.step * float(np.median(np.diff(np.unique(points.y))))
    noise = estimate.noise / points.load * estimate.outlier_weight
    return np.full(estimate.model.k.size, cell * np.sqrt(np.sum(noise**2)))
