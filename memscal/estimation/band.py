"""Band of wavenumbers in which the scan determines the apparatus function.

G is resolved while the posterior standard uncertainty of its transfer function stays below a
third of the fitted Gaussian's, which has no zeros and no lobes.  Components are relevant to a
division of fields while the voltage stands above its noise.  The measured points are rings: the
voltage's transform is a sum of :math:`a_i u_i J_0(kR_i)` with ring areas :math:`a_i` (of a
tangential channel with :math:`J_1`), and its noise is the same sum in quadrature.  Points whose
signal is lost in noise count as :math:`u_i^2/(u_i^2 + s_i^2)`.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.special import j0, j1

from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.estimation.profile import ProfileEstimate
from memscal.model.arrays import FloatArray

#: A spectral component is relevant while it stands this many times above its noise...
RELEVANT = 10.0
#: ...and resolved while the Gaussian's transfer function is this many standard uncertainties.
RESOLVED = 3.0


@dataclass(frozen=True, eq=False)
class Band:
    """Signal and noise of the voltage's transform, and the relevant and resolved wavenumbers."""

    k: FloatArray  # (n,): wavenumbers, in rad/m
    signal: FloatArray  # (n,): modulus of the voltage's transform and its noise, in V m^2 / N
    noise: FloatArray
    # Both wavenumbers in rad/m, and at most the last one that the scan's step samples.
    relevant: float  # beyond it the signal is less than ten times the noise
    resolved: float  # up to it the uncertainty is less than a third of the Gaussian
    weakest_voltage: float  # moduli of both fields' transforms at the relevant wavenumber
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
    yardstick = gaussian_transfer(k, estimate.gaussian.sigma)
    error = np.maximum(transfer_uncertainty(estimate), np.finfo(float).tiny)
    resolved = min(_first_below(k, yardstick / error, RESOLVED), sampled)
    reference = np.abs(estimate.model.reference.values)
    weakest_voltage = float(np.interp(relevant, k, signal))
    weakest_reference = float(np.interp(relevant, k, reference))
    return Band(k, signal, noise, relevant, resolved, weakest_voltage, weakest_reference)


def transfer_uncertainty(estimate: ProfileEstimate) -> FloatArray:
    """Posterior standard uncertainty of K(k)/K(0) at the nodes, K = A G; the reference is exact."""
    basis, a = estimate.basis, estimate.conversion_constant
    rows = (basis.kernels(estimate.model.k) - np.outer(estimate.kernel / a, basis.integrals)) / a
    variance = np.sum((rows @ estimate.covariance) * rows, axis=1)
    return np.asarray(np.sqrt(np.maximum(variance, 0.0)))


def _first_below(k: FloatArray, ratio: FloatArray, threshold: float) -> float:
    """Return where a ratio first falls below a threshold, log-interpolated."""
    below = ratio < threshold
    end = int(np.argmax(below)) + 1 if below.any() else k.size
    return _falls_below(k[:end], ratio[:end], threshold)


def _falls_below(k: FloatArray, ratio: FloatArray, threshold: float) -> float:
    """Return where a ratio falls below a threshold for good, log-interpolated."""
    # The transform of a ring-shaped G passes through zero and comes back: such a gap ends no band.
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
    weighted = _ring_areas(radius, tolerance=0.25 * points.step) * share * noise
    bessel = j1 if estimate.model.order else j0
    return np.asarray(np.sqrt(bessel(np.multiply.outer(k, radius)) ** 2 @ weighted**2))


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
    """Noise of a component of a raster's transform, of all points: equal at all wavenumbers."""
    points = estimate.points
    share = points.cell / points.of_places("readings")
    noise = estimate.noise / points.load * estimate.outlier_weight
    return np.full(estimate.model.k.size, np.sqrt(np.sum((share * noise) ** 2)))
