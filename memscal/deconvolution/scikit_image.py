"""Classical restorations of images, by scikit-image or its algorithm, as methods of division."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from memscal.deconvolution import division
from memscal.deconvolution.division import Division, DivisionProblem
from memscal.model.arrays import FloatArray

#: Pixels below this share of the brightest are left out of a Richardson-Lucy step.
_DARK = 1e-12


@dataclass(frozen=True, eq=False)
class _Images:
    """Both fields as images of order one, the point spread function of sum one."""

    image: FloatArray
    point_spread: FloatArray
    scale: float

    @classmethod
    def of(cls, problem: DivisionProblem) -> _Images:
        grid = problem.grid
        image, spread = grid.to_image(problem.voltage), grid.to_image(problem.reference)
        peak, total = float(np.abs(image).max()), float(spread.sum())
        # u = sum(g * spread) * cell area, with image / peak and spread / total.
        return cls(image / peak, spread / total, peak / (total * grid.cell_area))


@dataclass(frozen=True, kw_only=True)
class Wiener:
    """Wiener-Hunt restoration: the quotient with a Laplacian penalty."""

    amplitude: float = 1.0  # root of the penalty over a tenth of the weakest relevant component
    name: ClassVar[str] = "wiener"
    assumes: ClassVar[str] = "G is smooth; the noise of the lifted field is white."
    fails: ClassVar[str] = (
        "A lifted line scan has ring-shaped noise, not white: the penalty is a guess."
    )

    def __post_init__(self) -> None:
        division.require_amplitude(self.name, self.amplitude)

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide by scikit-image's Wiener-Hunt filter."""
        from skimage.restoration import wiener
        from skimage.restoration.uft import laplacian

        images = _Images.of(problem)
        penalty = np.abs(laplacian(2, images.image.shape)[0])
        spectrum = np.abs(np.fft.rfft2(np.fft.ifftshift(images.point_spread)))
        weakest = problem.weakest_reference / (
            problem.grid.cell_area * problem.grid.to_image(problem.reference).sum()
        )
        # Along one axis: the first component weaker than the weakest relevant one, or the last.
        index = int(np.argmax(spectrum[0] < weakest)) or spectrum.shape[1] - 1
        balance = (self.amplitude * division.NOISE_RATIO * weakest / penalty[0, index]) ** 2
        restored = wiener(images.image, images.point_spread, balance, clip=False)
        return division.image_division(problem, restored * images.scale)


@dataclass(frozen=True, kw_only=True)
class UnsupervisedWiener:
    """Wiener-Hunt restoration whose two precisions are sampled with the image."""

    seed: int = 0  # seed of the Gibbs sampler
    name: ClassVar[str] = "unsupervised-wiener"
    assumes: ClassVar[str] = "The noise of the field is white, and G is smooth."
    fails: ClassVar[str] = (
        "The noise of a lifted line scan is not white: almost no regularisation may be chosen."
    )

    def __post_init__(self) -> None:
        division.require_count(self.name, "seed", self.seed, 0)

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide by scikit-image's unsupervised Wiener-Hunt restoration."""
        from skimage.restoration import unsupervised_wiener

        images = _Images.of(problem)
        blurred, spread = images.image, images.point_spread
        restored, _ = unsupervised_wiener(blurred, spread, clip=False, rng=self.seed)
        return division.image_division(problem, restored * images.scale)


@dataclass(frozen=True, kw_only=True)
class RichardsonLucy:
    """Richardson-Lucy restoration: multiplicative steps that keep G positive."""

    iterations: int = 50  # number of steps; more of them resolve finer detail, then noise
    name: ClassVar[str] = "richardson-lucy"
    assumes: ClassVar[str] = "G is nowhere negative; the noise is a counting noise."
    fails: ClassVar[str] = (
        "Stopping is the regularisation: too early is too wide, too late is ripples."
    )

    def __post_init__(self) -> None:
        division.require_count(self.name, "iterations", self.iterations, 1)

    def divide(self, problem: DivisionProblem) -> Division:
        """Divide by steps on the grid's own transforms: 20 times faster than scikit-image's."""
        # Periodic, where scikit-image pads with zeros: G differs by 0.5 % of its maximum.
        grid, reference = problem.grid, problem.reference
        voltage = np.maximum(problem.voltage, 0.0)
        backward = np.conj(problem.reference_spectrum) / grid.integrate(reference)
        field = np.full_like(voltage, voltage.max())
        for _ in range(self.iterations):
            predicted = grid.convolve(field, reference)
            positive = predicted > _DARK * voltage.max()
            ratio = np.divide(voltage, predicted, out=np.zeros_like(voltage), where=positive)
            field = field * grid.inverse(backward * grid.forward(ratio))
        return division.image_division(problem, grid.to_image(field))
