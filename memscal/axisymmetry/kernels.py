"""Radial apparatus functions of unit integral whose transform has a closed form."""

from collections.abc import Mapping
from typing import Protocol, runtime_checkable

import numpy as np
from scipy.special import chndtr, i0e, ive, j1

from memscal.axisymmetry.hankel import bessel
from memscal.errors import InputError
from memscal.model.arrays import FloatArray, array_record, require_positive, value_record

#: Beyond its edge by so many widths of the blur nothing is left of a disc.
_FARTHEST = 9.0


def gaussian_transfer(k: FloatArray, sigma: FloatArray | float) -> FloatArray:
    r"""Transform :math:`\exp(-\sigma^2 k^2 / 2)` of the Gaussian of unit integral."""
    return np.exp(-0.5 * (sigma * k) ** 2)


def gaussian_transfer_slope(k: FloatArray, sigma: float) -> FloatArray:
    """Derivative of :func:`gaussian_transfer` by the width, in 1/m."""
    return -sigma * k**2 * gaussian_transfer(k, sigma)


def unit_gaussian(r: FloatArray, sigma: FloatArray | float) -> FloatArray:
    """Gaussian of unit integral over the plane, in 1/m^2."""
    return np.exp(-0.5 * (r / sigma) ** 2) / (2 * np.pi * sigma**2)


def unit_gaussian_slope(r: FloatArray, sigma: float) -> FloatArray:
    """Derivative of :func:`unit_gaussian` by its width, in 1/m^3."""
    return unit_gaussian(r, sigma) * ((r / sigma) ** 2 - 2) / sigma


def disc_transfer(
    k: FloatArray, radius: FloatArray | float, sigma: FloatArray | float
) -> FloatArray:
    """Transforms of discs of unit integral, blurred by Gaussians, at ``k`` (rad/m)."""
    phase = k * radius
    disc = np.divide(2 * j1(phase), phase, out=np.ones_like(phase), where=phase != 0)
    return disc * gaussian_transfer(k, sigma)


def blurred_disc(
    r: FloatArray, radius: FloatArray | float, sigma: FloatArray | float
) -> FloatArray:
    """Discs of unit integral, blurred by Gaussians, at radii ``r`` (m), in 1/m^2."""
    # A point blurred from r falls into the disc: a non-central chi-square probability.
    place, edge = np.broadcast_arrays(r / sigma, radius / sigma)
    share = np.zeros(place.shape)
    near = place < edge + _FARTHEST
    share[near] = chndtr(edge[near] ** 2, 2, place[near] ** 2)
    return share / (np.pi * radius**2)


@runtime_checkable
class RadialKernel(Protocol):
    """A radial apparatus function of unit integral, with its transform.

    Examples
    --------
    >>> import memscal
    >>> kernel: memscal.RadialKernel = memscal.SmoothedDisc(radius=0.8e-3, sigma=0.1e-3)
    >>> memscal.simulate(kernel=kernel, seed=3).synthetic["kernel"]
    'uniform disc of unit integral, blurred by a Gaussian'
    """

    def transform(self, k: FloatArray) -> FloatArray:
        """Two-dimensional Fourier transform at ``k`` (rad/m); one at k = 0."""

    def radial(self, r: FloatArray) -> FloatArray:
        """G at radii ``r`` (m), in 1/m^2."""

    def describe(self) -> Mapping[str, float | str]:
        """What a simulated scan keeps as its truth: text, or SI numbers by name."""


@value_record
class GaussianMixture:
    """A radial apparatus function: a sum of Gaussians, of unit integral in all.

    Parameters
    ----------
    weights : tuple of float
        Share of each; they may be negative (a ring), and must add up to one.
    sigmas : tuple of float
        Standard deviation of each, in m.

    Examples
    --------
    >>> GaussianMixture((0.75, 0.25), (0.5e-3, 1e-3)).transform(np.array([0.0]))
    array([1.])
    """

    weights: tuple[float, ...] = (1.0,)
    sigmas: tuple[float, ...] = (561e-6,)

    def __post_init__(self) -> None:
        if len(self.weights) != len(self.sigmas) or not self.weights:
            raise InputError(
                f"{len(self.weights)} weights do not fit {len(self.sigmas)} widths of Gaussians."
            )
        if not abs(sum(self.weights) - 1) <= 1e-9:
            raise InputError(
                f"The weights of the Gaussians add up to {sum(self.weights):g}, not to 1.",
                why="An apparatus function has unit integral.",
            )
        for sigma in self.sigmas:
            require_positive("width of a Gaussian", sigma, "m")

    def transform(self, k: FloatArray) -> FloatArray:
        """Two-dimensional Fourier transform at ``k`` (rad/m); one at k = 0."""
        return gaussian_transfer(np.expand_dims(k, -1), np.array(self.sigmas)) @ self.weights

    def radial(self, r: FloatArray) -> FloatArray:
        """G at radii ``r`` (m), in 1/m^2."""
        return unit_gaussian(np.expand_dims(r, -1), np.array(self.sigmas)) @ self.weights

    def describe(self) -> dict[str, float | str]:
        """Weights and widths as text; the width of a single Gaussian, in m, as a number."""
        truth: dict[str, float | str] = {
            "kernel": "sum of Gaussians of unit integral",
            "kernel_weights": ", ".join(repr(float(w)) for w in self.weights),
            "kernel_sigmas_um": ", ".join(f"{s * 1e6:g}" for s in self.sigmas),
        }
        if len(self.sigmas) == 1:
            truth["gaussian_sigma"] = self.sigmas[0]
        return truth


@value_record
class SmoothedDisc:
    r"""A radial apparatus function: a uniform disc of unit integral, blurred by a Gaussian.

    .. math::

        \hat G(k) = \frac{2 J_1(ka)}{ka}\,e^{-s^2k^2/2}

    Parameters
    ----------
    radius : float
        Radius a of the disc, in m.
    sigma : float
        Standard deviation s of the Gaussian, in m.

    Raises
    ------
    InputError
        If one of them is not finite and above zero.

    Examples
    --------
    A wide disc is flat inside: its density there is one over its area.

    >>> disc = SmoothedDisc(radius=0.8e-3, sigma=0.1e-3)
    >>> round(float(disc.radial(np.array([0.0]))[0] * np.pi * disc.radius**2), 6)
    1.0
    """

    radius: float
    sigma: float

    def __post_init__(self) -> None:
        require_positive("radius of the disc", self.radius, "m")
        require_positive("width of the Gaussian that blurs the disc", self.sigma, "m")

    def transform(self, k: FloatArray) -> FloatArray:
        """Two-dimensional Fourier transform at ``k`` (rad/m); one at k = 0."""
        return disc_transfer(k, self.radius, self.sigma)

    def radial(self, r: FloatArray) -> FloatArray:
        """G at radii ``r`` (m), in 1/m^2."""
        return blurred_disc(r, self.radius, self.sigma)

    def describe(self) -> dict[str, float | str]:
        """Radius and blur, as text."""
        return {
            "kernel": "uniform disc of unit integral, blurred by a Gaussian",
            "kernel_radius_um": f"{self.radius * 1e6:g}",
            "kernel_sigmas_um": f"{self.sigma * 1e6:g}",
        }


@array_record
class Rings:
    """Blurred rings: ``radius`` and ``blur`` in m, ``amplitude`` in V/Pa; each of shape (m,).

    Those of an order n vary as the cosine of n times the angle.
    """

    radius: FloatArray
    blur: FloatArray
    amplitude: FloatArray

    def transform(self, k: FloatArray, order: int = 0) -> FloatArray:
        """Hankel transforms at ``k`` (rad/m), shape (k, m)."""
        blurred = self.amplitude * np.exp(-0.5 * np.multiply.outer(k, self.blur) ** 2)
        return blurred * bessel(order, np.multiply.outer(k, self.radius))

    def radial(self, r: FloatArray, order: int = 0) -> FloatArray:
        """Values at radii ``r`` (m), shape (r, m), in V/Pa/m^2."""
        square = self.blur**2
        # The scaled Bessel function carries exp(-rq/b^2), which completes the square.
        near = np.exp(-0.5 * np.subtract.outer(r, self.radius) ** 2 / square)
        phase = np.multiply.outer(r, self.radius / square)
        scaled = ive(order, phase) if order else i0e(phase)
        return self.amplitude / (2 * np.pi * square) * near * scaled

    @property
    def size(self) -> float:
        """Expected L2 norm over the plane of the sum with random signs, in V/Pa/m."""
        square = i0e(self.radius**2 / (2 * self.blur**2)) / (4 * np.pi * self.blur**2)
        return float(np.sqrt(np.sum(self.amplitude**2 * square)))
