r"""Rasters of a sensor that is not round, by direct convolution on a fine lattice.

G is an ellipse with a tail to one side, a sum of Gaussians.  Its convolution with the base stress
of the finite elements shares nothing with the analysis but the film.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from helpers.direct import spline_across
from helpers.scans import CONVERSION, EXACT_FILM, EXACT_ROD, SENSOR
from scipy.fft import irfft2, rfft2

import memscal
from memscal.model.arrays import FloatArray

CENTRE = (0.21e-3, -0.13e-3)
WIDTH = 0.65e-3
"""Where the ellipse's centre lies in the raster, and its larger width, in m."""
#: Share, offset along x and y (m), width along and across (m), angle (rad) of each Gaussian.
PARTS = (
    (0.75, 0.0, 0.0, WIDTH, 0.45e-3, 0.5),
    (0.15, 0.7e-3, 0.2e-3, 0.5e-3, 0.5e-3, 0.0),
    (0.10, 1.4e-3, 0.4e-3, 0.6e-3, 0.6e-3, 0.0),
)


@dataclass(frozen=True)
class TailedEllipse:
    """G of unit integral: an elliptic Gaussian, and two beside it that make a tail to one side."""

    parts: tuple[tuple[float, ...], ...] = PARTS

    def at(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """G at positions from the ellipse's centre, in 1/m^2."""
        total = np.zeros(np.broadcast_shapes(x.shape, y.shape))
        for share, dx, dy, along, across, angle in self.parts:
            c = np.cos(angle)
            s = np.sin(angle)
            u = c * (x - dx) + s * (y - dy)
            v = c * (y - dy) - s * (x - dx)
            form = (u / along) ** 2 + (v / across) ** 2
            total += share * np.exp(-0.5 * form) / (2 * np.pi * along * across)
        return total


@lru_cache
def clean_raster(kernel: TailedEllipse, side: int, half: float) -> FloatArray:
    """Voltages (side, side) per newton without noise, in V."""
    finer = 3
    step = 2 * half / (side - 1) / finer
    count = 2 * int(np.ceil(12e-3 / step)) + 1
    axis = step * (np.arange(count) - count // 2)
    at = spline_across(EXACT_ROD.radius, "linear", 1.0)
    g = kernel.at(axis[None, :] - CENTRE[0], axis[:, None] - CENTRE[1])
    size = 2 * count
    product = rfft2(at(np.hypot.outer(axis, axis)), (size, size)) * rfft2(g, (size, size))
    field = irfft2(product)[count // 2 :, count // 2 :][:count, :count] * step**2
    inside = np.arange(
        count // 2 - finer * (side // 2), count // 2 + finer * (side // 2) + 1, finer
    )
    return np.asarray(CONVERSION * field[np.ix_(inside, inside)])


def tailed_raster(
    *,
    seed: int,
    noise=0.005,
    side=65,
    half=6e-3,
    kernel: TailedEllipse = TailedEllipse(),
) -> memscal.Scan:
    """Raster of independent noise, a share of the largest voltage, which it does not state."""
    clean = clean_raster(kernel, side, half)
    x = np.linspace(-half, half, side)
    top = float(clean.max())
    u = clean + np.random.default_rng(seed).normal(0.0, noise * top, clean.shape)
    return memscal.Scan(
        x=x,
        y=x,
        u_zz=u + 0.01 * top,
        load=1.0,
        indenter=EXACT_ROD,
        film=EXACT_FILM,
        sensor=SENSOR,
        synthetic={"noise": noise * top, "conversion_constant": CONVERSION},
    )
