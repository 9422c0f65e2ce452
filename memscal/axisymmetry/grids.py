r"""Grids on which fields are transformed, and the field of a radial profile on them.

A field lifted from a radial profile is real and even in x and in y: a quarter of the plane holds it
all, by type-I cosine transforms (:class:`EvenGrid`).  A raster's grid is a :class:`Lattice`.
Both scale their transforms to approximate :math:`\hat f(k) = \int f e^{-ikx} dx\,dy`.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import numpy as np
import scipy.fft
from numpy.typing import NDArray

from memscal.axisymmetry.hankel import radial_spline
from memscal.errors import InputError
from memscal.model.arrays import ArrayFunction, FloatArray, array_record, value_record

#: Directions over which a field of a lattice is averaged.
_DIRECTIONS = 64


class _Grid:
    """What every grid does by its transforms."""

    transfer: ArrayFunction
    forward: ArrayFunction
    _back: ArrayFunction  # undoes ``forward``

    def filtered(self, field: FloatArray, factor: FloatArray) -> FloatArray:
        """Multiply the transform of a field by a real factor."""
        return self._back(self.forward(field) * factor)

    def convolve(self, kernel: FloatArray, field: FloatArray) -> FloatArray:
        """Convolve a kernel about the axis with a field of the grid."""
        return self._back(self.transfer(kernel) * self.forward(field))


@value_record
class EvenGrid(_Grid):
    """A quarter plane of ``count`` by ``count`` points, ``spacing`` (m) apart, axis included.

    >>> EvenGrid(count=3, spacing=1e-3).axes[0]
    array([-0.002, -0.001,  0.   ,  0.001,  0.002])
    """

    count: int
    spacing: float

    @property
    def axis(self) -> FloatArray:
        """Half axis from 0, shape (count,), in m."""
        return self.spacing * np.arange(self.count, dtype=np.float64)

    @property
    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Positions along x and along y of the whole plane, shape (2 count - 1,), in m."""
        whole = np.append(-self.axis[:0:-1], self.axis)
        return whole, whole

    @property
    def wavenumber_axis(self) -> FloatArray:
        """Wavenumbers along one axis, shape (count,), in rad/m."""
        return np.pi * np.arange(self.count, dtype=np.float64) / ((self.count - 1) * self.spacing)

    @cached_property
    def radius(self) -> FloatArray:
        """Distance of each point from the axis, shape (count, count), in m."""
        return np.hypot.outer(self.axis, self.axis)

    @cached_property
    def wavenumber(self) -> FloatArray:
        """Modulus of each wave vector, shape (count, count), in rad/m."""
        return np.hypot.outer(self.wavenumber_axis, self.wavenumber_axis)

    @property
    def cell_area(self) -> float:
        """Area of one cell, in m^2."""
        return self.spacing**2

    def forward(self, field: FloatArray) -> FloatArray:
        """Fourier transform of the even field: real, shape (count, count)."""
        return scipy.fft.dctn(field, type=1) * self.cell_area

    def inverse(self, spectrum: FloatArray) -> FloatArray:
        """Return the even field of a real even spectrum."""
        return scipy.fft.idctn(spectrum, type=1) / self.cell_area

    #: Of an even field the axis already is at the origin.
    transfer = forward
    _back = inverse

    def axis_transfer(self, field: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return wavenumbers along one axis and the Fourier transform about the origin there."""
        line = 2 * field.sum(axis=0) - field[0] - field[-1]
        return self.wavenumber_axis, scipy.fft.dct(line, type=1) * self.cell_area

    def inverse_on_axis(self, spectrum: FloatArray) -> FloatArray:
        """Return the first row of the field of a real even spectrum, (1, count)."""
        line = (2 * spectrum.sum(axis=0) - spectrum[0] - spectrum[-1]) / (2 * (self.count - 1))
        return scipy.fft.idct(line[None], type=1) / self.cell_area

    def integrate(self, field: FloatArray) -> float:
        """Integral of an even field over the whole plane that the quarter stands for."""
        sides = np.append(1.0, np.full(field.shape[0] - 1, 2.0))
        return float(sides @ field @ sides * self.cell_area)

    def radial(self, field: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Radii and values along the half axis."""
        return self.axis, field[0]

    def to_period(self, field: FloatArray) -> FloatArray:
        """Mirror the quarter to one period: 2 (count - 1) points, the axis at the first."""
        return np.pad(field, (0, self.count - 2), mode="reflect")

    def from_quotient(self, period: FloatArray) -> FloatArray:
        """Return the even part of a period, as a quarter plane."""
        # Its first row and column close it on the other side: the axis is at the central pixel.
        return self.from_image(np.pad(scipy.fft.fftshift(period), (0, 1), mode="wrap"))

    def to_image(self, field: FloatArray) -> FloatArray:
        """Mirror the quarter to the whole plane: odd size, axis at the central pixel."""
        return np.pad(field, (self.count - 1, 0), mode="reflect")

    def from_image(self, image: FloatArray) -> FloatArray:
        """Return the even part of an image, as a quarter plane."""
        even = (image + image[::-1]) / 2
        return ((even + even[:, ::-1]) / 2)[self.count - 1 :, self.count - 1 :]


@array_record
class Lattice(_Grid):
    """A rectangular lattice for a raster: odd numbers of even positions about the axis, in m.

    >>> Lattice(x=np.linspace(-2e-3, 2e-3, 5), y=np.linspace(-1e-3, 1e-3, 3)).spacing
    (0.001, 0.001)
    """

    x: FloatArray
    y: FloatArray

    def __post_init__(self) -> None:
        if self.x.size % 2 == 0 or self.y.size % 2 == 0:
            raise InputError(
                f"A lattice of {self.y.size} by {self.x.size} points has no central point.",
                cure="Use odd numbers of points.",
            )

    @property
    def axes(self) -> tuple[FloatArray, FloatArray]:
        """Positions along x and along y, in m."""
        return self.x, self.y

    @property
    def spacing(self) -> tuple[float, float]:
        """Distances of neighbouring points along y and x, in m."""
        return float(self.y[1] - self.y[0]), float(self.x[1] - self.x[0])

    @cached_property
    def radius(self) -> FloatArray:
        """Distance of each point from the axis, shape (m, n), in m."""
        return np.hypot.outer(self.y, self.x)

    @cached_property
    def wavenumber(self) -> FloatArray:
        """Modulus of each wave vector, shape (m, n // 2 + 1), in rad/m."""
        return np.hypot.outer(*self._wavenumber_axes)

    @property
    def _wavenumber_axes(self) -> tuple[FloatArray, FloatArray]:
        """Wavenumbers along y and x, in rad/m."""
        dy, dx = self.spacing
        ky = 2 * np.pi * scipy.fft.fftfreq(self.y.size, dy)
        return ky, 2 * np.pi * scipy.fft.rfftfreq(self.x.size, dx)

    @property
    def cell_area(self) -> float:
        """Area of one cell, in m^2."""
        return self.spacing[0] * self.spacing[1]

    def forward(self, field: FloatArray) -> FloatArray:
        """Fourier transform about the first lattice point: complex, shape (m, n // 2 + 1)."""
        return np.asarray(scipy.fft.rfft2(field) * self.cell_area)

    def inverse(self, spectrum: FloatArray) -> FloatArray:
        """Return the field of a spectrum whose origin is the first point: a quotient's."""
        return scipy.fft.fftshift(self._back(spectrum))

    def _back(self, spectrum: FloatArray) -> FloatArray:
        """Undo :meth:`forward`."""
        return scipy.fft.irfft2(spectrum, s=(self.y.size, self.x.size)) / self.cell_area

    def sampled(self, plane: Callable[[FloatArray, FloatArray], FloatArray]) -> FloatArray:
        """Return a field by its transform (ky, kx) about the axis, as far as this samples it."""
        ky, kx = self._wavenumber_axes
        spectrum = plane(ky, kx) * np.exp(1j * np.add.outer(ky * self.y[0], kx * self.x[0]))
        return self._back(spectrum)

    def transfer(self, field: FloatArray) -> FloatArray:
        """Fourier transform about the central point."""
        return self.forward(scipy.fft.ifftshift(field))

    @property
    def wavenumber_axis(self) -> FloatArray:
        """Wavenumbers along x, in rad/m."""
        return self._wavenumber_axes[1]

    def axis_transfer(self, field: FloatArray) -> tuple[FloatArray, NDArray[np.complex128]]:
        """Return wavenumbers along x and the Fourier transform about the central point there."""
        line = scipy.fft.rfft(scipy.fft.ifftshift(field.sum(axis=0)))
        return self.wavenumber_axis, line * self.cell_area

    def integrate(self, field: FloatArray) -> float:
        """Integral of a field over the lattice."""
        return float(field.sum() * self.cell_area)

    def radial(self, field: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Radii along half of x, and the mean over directions there, by cubic splines."""
        from scipy.ndimage import map_coordinates

        r = self.x[self.x.size // 2 :]
        angle = 2 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        dy, dx = self.spacing
        rows = (np.outer(r, np.sin(angle)) - self.y[0]) / dy
        columns = (np.outer(r, np.cos(angle)) - self.x[0]) / dx
        samples = map_coordinates(field, [rows, columns], order=3, mode="nearest")
        return r, samples.mean(axis=1)

    def refined(self, kernel: FloatArray, factor: int) -> tuple[Lattice, FloatArray]:
        """Interpolate a centred kernel to a lattice ``factor`` (odd) times finer, by its series."""
        from scipy.signal import resample

        fine = scipy.fft.ifftshift(kernel)
        axes = []
        for axis, step in enumerate(self.spacing):
            count = factor * kernel.shape[axis]
            fine = resample(fine, count, axis=axis)
            axes.append((np.arange(count) - count // 2) * step / factor)
        y, x = axes
        return Lattice(x, y), scipy.fft.fftshift(fine)

    def to_period(self, field: FloatArray) -> FloatArray:
        """Return the field itself: it covers the plane, and is its own period."""
        return field

    to_image = to_period

    def from_quotient(self, period: FloatArray) -> FloatArray:
        """Roll the quotient's zero from the first point to the central one."""
        return scipy.fft.fftshift(period)

    def from_image(self, image: FloatArray) -> FloatArray:
        """Return the image itself."""
        return image


#: What deconvolution works on.
FieldGrid = EvenGrid | Lattice


def on_grid(profile: ArrayFunction, grid: FieldGrid, step: float) -> FloatArray:
    """Values of a radial function on a grid, by an even spline through it every ``step`` (m)."""
    reach = np.max(grid.radius)
    table = np.linspace(0.0, reach, int(np.ceil(reach / step)) + 4)
    return radial_spline(table, profile(table))(grid.radius)
