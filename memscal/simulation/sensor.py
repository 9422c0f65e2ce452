"""What a simulated sensor reports: base stresses through its apparatus function, disturbed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel
from memscal.errors import InputError
from memscal.mechanics.contact import Contact
from memscal.model.arrays import FloatArray, require_positive

# The film passes exp(-kh): beyond this in kh nothing is left in double precision.
_REACH = 40.0


def apparatus_function(kernel: RadialKernel | None) -> RadialKernel:
    """Return the kernel, of unit integral, or the paper's Gaussian where there is none."""
    if kernel is None:
        return GaussianMixture()
    if not isinstance(kernel, RadialKernel):
        raise InputError(
            f"The kernel is a {type(kernel).__name__}, which has no transform(), radial() and "
            "describe().",
            cure="Give a GaussianMixture, a SmoothedDisc, or an object with these three methods.",
        )
    # Not at k = 0 itself, where a closed form such as J1(ka)/ka may divide by zero.
    integral = float(kernel.transform(np.array([1e-2]))[0])
    if not abs(integral - 1) <= 1e-6:
        raise InputError(
            f"The kernel's transform is {integral:g} at k = 0, not 1.",
            why="An apparatus function has unit integral.",
            cure="Divide the kernel by its integral; the conversion constant carries the size.",
        )
    return kernel


def blurred_stress(
    contacts: Sequence[Contact], kernel: RadialKernel, radius: FloatArray, *, order: int = 0
) -> FloatArray:
    r"""Return :math:`G \otimes \sigma_{zz}` in Pa at ``radius`` (m), a row for each contact."""
    # Of order one: the radial component of the blurred base shear.
    nodes = Wavenumbers.covering(_REACH / contacts[0].film.thickness, float(radius.max()))
    transforms = [(c.base_shear_spectrum if order else c.base_spectrum)(nodes.k) for c in contacts]
    spectra = np.stack(transforms, axis=1) * kernel.transform(nodes.k)[:, None]
    return np.moveaxis(nodes.synthesise(spectra, radius, order=order), -1, 0)


def disturbance(x: FloatArray, baseline: float, drift: float) -> FloatArray:
    """Return an offset and a linear drift over the positions, as shares of the largest signal."""
    half_range = 0.5 * float(np.ptp(x))
    return np.asarray(baseline + 0.5 * drift * (x - 0.5 * (x.min() + x.max())) / half_range)


_CHANNELS = (("zz",), ("zz", "xz"))


@dataclass(frozen=True)
class Disturbances:
    """Noise, offset and drift as shares of the largest signal, and whether noise is stated."""

    noise: float
    baseline: float
    drift: float
    state_noise: bool
    seed: int

    def in_volts(self, largest: float) -> dict[str, float]:
        """Return offset, drift and noise in V, by the names of a truth."""
        return {name: getattr(self, name) * largest for name in ("baseline", "drift", "noise")}

    def errors(self, shape: tuple[int, ...], largest: float) -> FloatArray | None:
        """Return the standard deviations that a scan states, in V; None if it states none."""
        return np.full(shape, self.noise * largest) if self.state_noise and self.noise > 0 else None


@dataclass(frozen=True)
class ShearChannel:
    """Apparatus function and conversion constant (V/Pa) of the tangential channel along x."""

    kernel: RadialKernel
    conversion_constant: float

    def side(self, x: FloatArray, away: FloatArray) -> FloatArray:
        """Cosine of the angle from x to the indenter, ``away`` from the sensor (m); 0 on it."""
        return np.asarray(np.divide(x, away, out=np.zeros_like(away + x), where=away > 0))

    def recorded(
        self, stress: FloatArray, x: FloatArray, disturbed: Disturbances
    ) -> tuple[dict[str, FloatArray], dict[str, float | str]]:
        """Return voltages of the blurred shear along x (..., n), in Pa, and their truth (_xz)."""
        clean = self.conversion_constant * stress
        largest = float(np.abs(clean).max())
        draws = np.random.default_rng([disturbed.seed, 1]).standard_normal(clean.shape)
        level = disturbance(x, disturbed.baseline, disturbed.drift)
        channels = {"u_xz": clean + largest * (level + disturbed.noise * draws)}
        if (errors := disturbed.errors(clean.shape, largest)) is not None:
            channels["u_xz_errors"] = errors
        volts = {"conversion_constant": self.conversion_constant, **disturbed.in_volts(largest)}
        truth = {**self.kernel.describe(), **volts}
        return channels, {f"{name}_xz": value for name, value in truth.items()}


def shear_channel(
    channels: Sequence[str], kernel: RadialKernel | None, conversion_constant: float
) -> ShearChannel | None:
    """Return the tangential channel if it is among the channels of a scan."""
    if tuple(channels) not in _CHANNELS:
        raise InputError(
            f"The channels are {tuple(channels)}.",
            why="A line scan along x has the normal channel, and may have the shear's along x.",
            cure='Give ("zz",) or ("zz", "xz").',
        )
    if len(channels) == 1:
        return None
    require_positive("conversion_constant of the channel xz", conversion_constant, "V/Pa")
    return ShearChannel(apparatus_function(kernel), conversion_constant)
