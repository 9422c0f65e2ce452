"""Band of a scan: the relevant wavenumbers, which a division uses, and the resolved ones of G.

Components are relevant to a division while the transform of the profile stands above its noise.
G is resolved while the posterior standard uncertainty of its transfer function stays below a third
of the fitted Gaussian's, which has no zeros and no lobes.

The transform of a disc, a slit or a beam has zeros, and comes back beyond them.  There the voltage
is zero, too, whatever G is: what it has at the first zero is misfit.  Beyond, components are
relevant while the voltage stands above that in the power of all directions, not in their mean.
"""

import numpy as np

from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.smoothing import SmoothedProfile
from memscal.model.arrays import TINY, FloatArray, floats, value_record

#: A spectral component is relevant while it stands this many times above its noise: with the
#: paper's tenth of the weakest one, noise and loss at the edge of the band are then about equal...
RELEVANT = 15.0
#: ...of a raster, which has as many components as points, they are about equal at this one...
RELEVANT_OF_RASTER = 5.0
#: ...and resolved while the Gaussian's transfer function is this many standard uncertainties.
RESOLVED = 3.0
#: A division opens again where a reference comes back to this share of the weakest component.
_OPEN = 0.1
#: Where the voltage is so many times what is not explained, the reference is blurred to fall off.
_SEEN = 2.0
_DIRECTIONS = 24


@value_record
class Band:
    """The relevant and resolved wavenumbers, and what a division does at them."""

    # Both wavenumbers in rad/m, and at most the last one that the scan's step samples.
    relevant: float  # beyond it the signal is less than 15 times the noise
    resolved: float  # up to it the uncertainty is less than a third of the Gaussian
    weakest_voltage: float  # moduli of both fields' transforms at the relevant wavenumber
    weakest_reference: float
    # Width (m) of the Gaussian that both fields are blurred with before they are divided: such as
    # makes the reference fall off as the voltage does where its transform comes back.
    blur: float = 0.0
    # What is not explained where a reference vanishes, over the noise, if that is less.
    excess: float = 1.0


def find_band(estimate: ProfileEstimate, smoothed: SmoothedProfile | None) -> Band:
    """Find the band of a scan, of a tangential channel (nothing to divide) by its estimate."""
    k = estimate.model.k
    reference = envelope(estimate.model.reference.values)
    error = np.maximum(transfer_uncertainty(estimate), TINY)
    clear = RELEVANT
    signal = abs((smoothed or estimate).spectrum.values)
    if not smoothed:
        noise = error * estimate.conversion_constant * reference
    elif estimate.points.as_raster:
        # Of all points of a raster the noise is equal at all wavenumbers.
        noise = floats(np.linalg.norm(_shares(estimate) * estimate.noise))
        clear = RELEVANT_OF_RASTER
    else:
        noise = smoothed.noise
    noise = np.maximum(noise, TINY)
    # Nothing finer than two steps of the scan was sampled, whatever its signal.
    sampled = np.pi / estimate.points.step
    relevant = min(_falls_below(k, signal / noise, clear), sampled)
    ratio = gaussian_transfer(k, estimate.gaussian.sigma) / error
    lost = np.flatnonzero(ratio < RESOLVED)
    end = lost[0] + 1 if lost.size else k.size
    resolved = min(_falls_below(k[:end], ratio[:end], RESOLVED), sampled)
    weakest = (np.interp(relevant, k, modulus) for modulus in (signal, reference))
    return Band(relevant, resolved, *weakest)


def beyond_zeros(
    band: Band, estimate: ProfileEstimate, wavenumber: FloatArray, voltage: FloatArray
) -> Band:
    """Find the band of a raster of a reference with zeros, of whose voltage the transform is."""
    points = estimate.points
    k = estimate.model.k
    reference = estimate.model.reference.values
    largest = envelope(reference)
    turns = np.flatnonzero(reference[1:] * reference[:-1] < 0)
    opens_again = largest[turns + 1] > _OPEN * band.weakest_reference
    if not (points.as_raster and opens_again.any()):
        return band
    # Root mean square over directions of the residuals' transform where the reference vanishes.
    shares = _shares(estimate)
    noise = np.linalg.norm(shares * estimate.noise)
    angle = np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
    along = np.outer(points.x, np.cos(angle)) + np.outer(points.y, np.sin(angle))
    sums = (shares * (points.u - estimate.predicted)) @ np.exp(-1j * k[turns[0]] * along)
    excess = max(np.linalg.norm(sums) / _DIRECTIONS**0.5 / noise, 1.0)
    noise *= excess
    # The mean of two lobes over all directions is smaller than either: their power is not.
    width = wavenumber[0, 1]
    ring = np.rint(wavenumber / width).astype(np.intp).ravel()
    power = np.bincount(ring, abs(voltage.ravel()) ** 2) / np.bincount(ring)
    # Rings beyond, in the corners, have few components, any of which may be large by chance.
    rings = np.arange(0.0, np.pi / points.step, width)
    relevant = _falls_below(rings, np.sqrt(power[: rings.size]) / noise, _SEEN)
    weakest = noise / estimate.conversion_constant
    share = min(_SEEN * weakest / np.interp(relevant, k, largest), 1.0)
    blur = np.sqrt(-2 * np.log(share)) / relevant
    weakest *= RELEVANT_OF_RASTER
    return Band(relevant, band.resolved, RELEVANT_OF_RASTER * noise, weakest, blur, excess)


def envelope(reference: FloatArray) -> FloatArray:
    """Largest modulus of a transform from each wavenumber on: it falls, and has no zeros."""
    return np.maximum.accumulate(abs(reference)[::-1])[::-1]


def _shares(estimate: ProfileEstimate) -> FloatArray:
    """Area of the plane, over the load, for which each reading (n,) of a raster stands."""
    points = estimate.points
    return points.cell / points.place_numbers("readings") * estimate.outlier_weight / points.load


def transfer_uncertainty(estimate: ProfileEstimate) -> FloatArray:
    """Posterior standard uncertainty of K(k)/K(0) at the nodes, K = A G; the reference is exact."""
    basis = estimate.basis
    a = estimate.conversion_constant
    rows = (basis.kernels(estimate.model.k) - np.outer(estimate.kernel / a, basis.integrals)) / a
    variance = np.sum((rows @ estimate.weighed.covariance) * rows, axis=1)
    return floats(np.sqrt(np.maximum(variance, 0.0)))


def _falls_below(k: FloatArray, ratio: FloatArray, threshold: float) -> float:
    """Return where a ratio falls below a threshold for good, log-interpolated."""
    # The transform of a ring-shaped G passes through zero and comes back: such a gap ends no band.
    i = np.flatnonzero(ratio >= threshold).max(initial=-1) + 1
    if i in (0, k.size):
        return float(k[max(i - 1, 0)])
    around = slice(i - 1, i + 1)
    below = np.log(threshold) - np.log(np.maximum(ratio[around], TINY))
    return float(np.interp(0.0, below, k[around]))
