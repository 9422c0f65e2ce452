"""A simulated sensor's tangential channel: the shear through a G and an A of its own."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from memscal.axisymmetry.kernels import RadialKernel
from memscal.errors import InputError
from memscal.laboratory.response import apparatus_function, disturbance
from memscal.model.validation import FloatArray, require_positive

__all__ = ["Disturbances", "ShearChannel", "shear_channel"]

_CHANNELS = (("zz",), ("zz", "xz"))


@dataclass(frozen=True)
class Disturbances:
    """Noise, offset and drift as shares of the largest signal, and whether noise is stated."""

    noise: float
    baseline: float
    drift: float
    state_noise: bool
    seed: int


@dataclass(frozen=True)
class ShearChannel:
    """Apparatus function and conversion constant (V/Pa) of the tangential channel along x."""

    kernel: RadialKernel
    conversion_constant: float

    def side(self, x: FloatArray, away: FloatArray) -> FloatArray:
        """Cosine of the way from the sensor to the indenter with x; zero on the sensor.

        Parameters
        ----------
        x, away : ndarray
            Coordinate along x, and distance, of the indenter from the sensor, in m.
        """
        return np.asarray(np.divide(x, away, out=np.zeros_like(away + x), where=away > 0))

    def recorded(
        self, stress: FloatArray, x: FloatArray, disturbed: Disturbances
    ) -> tuple[dict[str, FloatArray], dict[str, float | str]]:
        """Return the channel's voltages, and its truth by names that end in ``_xz``.

        Parameters
        ----------
        stress : ndarray, shape (..., n)
            Component of the blurred shear along x, in Pa.
        x : ndarray, shape (n,)
            Positions, in m.
        disturbed : Disturbances
            As shares of this channel's own largest signal; its noise is drawn from a stream that
            no other channel uses.
        """
        clean = self.conversion_constant * stress
        largest = float(np.abs(clean).max())
        draws = np.random.default_rng([disturbed.seed, 1]).standard_normal(clean.shape)
        level = disturbance(x, disturbed.baseline, disturbed.drift)
        channels = {"u_xz": clean + largest * (level + disturbed.noise * draws)}
        if disturbed.state_noise and disturbed.noise > 0:
            channels["u_xz_errors"] = np.full(clean.shape, disturbed.noise * largest)
        truth: Mapping[str, float | str] = {
            **self.kernel.describe(),
            "conversion_constant": self.conversion_constant,
            "baseline": disturbed.baseline * largest,
            "drift": disturbed.drift * largest,
            "noise": disturbed.noise * largest,
        }
        return channels, {f"{name}_xz": value for name, value in truth.items()}


def shear_channel(
    channels: Sequence[str], kernel: RadialKernel | None, conversion_constant: float
) -> ShearChannel | None:
    """Return the tangential channel if it is among the channels of a scan.

    Raises
    ------
    InputError
        If there is another channel, or the kernel is no apparatus function.
    """
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
