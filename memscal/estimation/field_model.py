r"""Forward model of scans through fields that are not round: by transforms over the plane.

The voltage of a round kernel is :math:`U = \mathcal F^{-1}\{\hat K(|k|)\,\hat\sigma(k_x, k_y)\}`
on a grid, and at the points by quintic splines through it; its slopes are the same of
:math:`i k_x \hat U`.  The grid is longer than scan and field, so that nothing wraps around.
"""

from dataclasses import replace
from functools import cached_property
from typing import Any, ClassVar

import numpy as np
import scipy.fft

from memscal.axisymmetry.hankel import RadialSpectrum
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.estimation.forward import ForwardModel, Geometry
from memscal.model.arrays import (
    ArrayPair,
    FloatArray,
    IndexArray,
    array_record,
    keyword_array_record,
)
from memscal.model.stress import StressField

#: Points of the grid for each half wave of the last wavenumber, and at most for each step.
_OVERSAMPLING = 2.0
_PER_STEP = 4.0


@array_record
class PlaneGeometry(Geometry):
    """Places of the points about trial centres; no Bessel functions."""

    places: FloatArray  # (2, n) or (2, n, m): rows and columns of the grid


@array_record
class _Plane:
    """Grid on which voltages are transformed, and the part of its wavenumbers that is used."""

    count: int
    spacing: float
    ky: FloatArray  # (c,): of the cells up to the last wavenumber
    kx: FloatArray
    cells: tuple[IndexArray, ...]
    # (scans, c): transform of each reference, with what makes splines of it.
    stress: FloatArray


@array_record
class FieldModel(ForwardModel):
    """Voltages at the points of scans through fields."""

    sums_waves: ClassVar[bool] = False
    round_references: ClassVar[bool] = False

    @cached_property
    def _plane(self) -> _Plane:
        points = self.points
        last = self.k[-1]
        span = max(np.ptp(points.x), np.ptp(points.y))
        fields = [each.field for each in self.references if isinstance(each, FieldSpectrum)]
        wide = max((max(np.ptp(field.x), np.ptp(field.y)) for field in fields), default=0.0)
        h = max(np.pi / (_OVERSAMPLING * last), points.step / _PER_STEP)
        count = scipy.fft.next_fast_len(int(np.ceil((1.5 * span + wide) / h)), real=True)
        ky = 2 * np.pi * scipy.fft.fftfreq(count, h)
        kx = 2 * np.pi * scipy.fft.rfftfreq(count, h)
        cells = np.nonzero(np.hypot.outer(ky, kx) <= last)
        # Middle of the grid; a quintic spline through values has these coefficients.
        turn = [np.exp(-0.5j * k * count * h) * 120 for k in (ky, kx)]
        spline = [66 + 52 * np.cos(k * h) + 2 * np.cos(2 * k * h) for k in (ky, kx)]
        factor = np.outer(turn[0] / spline[0], turn[1] / spline[1]) / h**2
        stress = np.stack([(r.plane(ky, kx) * factor)[cells] for r in self.references])
        return _Plane(count, h, ky[cells[0]], kx[cells[1]], cells, stress)

    def geometry(self, centres: FloatArray) -> PlaneGeometry:
        """Return distances and places on the grid for trial centres, shape (scans, 2), in m."""
        plain = super().geometry(centres)
        places = self.offset(centres)[::-1] / self._plane.spacing + self._plane.count / 2
        return PlaneGeometry(plain.radius, plain.towards, self.k, False, self.reach, places)

    def signal(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Voltages for kernels in V/Pa by their transforms, shape (nodes,) or (nodes, m)."""
        voltages = self._read(geometry, self._on_cells(np.atleast_2d(kernel.T)))
        return voltages.reshape(self.points.u.size, *kernel.shape[1:])

    def shift_derivative(self, geometry: Geometry, kernel: FloatArray) -> FloatArray:
        """Derivatives of :meth:`signal` by each point's centre, shape (2, n), in V/m."""
        (spectrum,) = self._on_cells(kernel[None])
        plane = self._plane
        return self._read(geometry, [-1j * k * spectrum for k in (plane.kx, plane.ky)]).T

    def elliptic(self, geometry: Geometry, ellipses: FloatArray) -> ArrayPair:
        """Responses (m, n) per A to (s, e1, e2), (m, 3); slopes (2, n) of the first by place."""
        kx = self._plane.kx
        ky = self._plane.ky
        kernels = []
        for sigma, e1, e2 in ellipses:
            square = (1 + e1) * kx**2 + 2 * e2 * kx * ky + (1 - e1) * ky**2
            kernels.append(np.exp(-0.5 * sigma**2 * square))
        shifts = [-1j * k * kernels[0] for k in (kx, ky)]
        return self._read(geometry, kernels).T, self._read(geometry, shifts).T

    def around(
        self, m: int, cosines: FloatArray, sines: FloatArray, centres: FloatArray
    ) -> FloatArray:
        """Voltages of kernels with cos or sin of m times the angle: (n, both), in V."""
        geometry = self.geometry(centres)
        angle = m * np.arctan2(self._plane.ky, self._plane.kx)
        even = np.cos(angle) * self._on_cells(cosines.T)
        odd = np.sin(angle) * self._on_cells(sines.T)
        return self._read(geometry, (-1j) ** m * np.vstack([even, odd]))

    def spotted(self, places: FloatArray, width: float, centres: FloatArray) -> FloatArray:
        """Voltages of Gaussians of unit integral at places (2, m) from centres, in m: (n, m)."""
        geometry = self.geometry(centres)
        plane = self._plane
        apart = geometry.places[:, :, None] - places[::-1, None] / plane.spacing
        kernel = gaussian_transfer(np.hypot(plane.ky, plane.kx), width)
        return self._read(replace(geometry, places=apart), [kernel])[..., 0]

    def _on_cells(self, kernels: FloatArray) -> FloatArray:
        """Interpolate kernels (m, nodes) to the cells of the plane."""
        from scipy.interpolate import CubicSpline

        return CubicSpline(self.k, kernels, axis=1)(np.hypot(self._plane.ky, self._plane.kx))

    def _read(self, geometry: Any, spectra: Any) -> FloatArray:
        """Read voltages (n, k) or (n, m, k) at the points for k transforms on the cells."""
        from scipy.ndimage import map_coordinates

        plane = self._plane
        places = geometry.places
        values = np.zeros((*places.shape[1:], len(spectra)))
        shape = (plane.count, plane.count)
        whole = np.zeros((plane.count, plane.count // 2 + 1), complex)
        for scan, stress in enumerate(plane.stress):
            rows = self.points.scan == scan
            for i, spectrum in enumerate(spectra):
                whole[plane.cells] = spectrum * stress
                splines = scipy.fft.irfft2(whole, s=shape)
                values[rows, ..., i] = map_coordinates(
                    splines, places[:, rows], order=5, mode="grid-wrap", prefilter=False
                )
        return (values.T * self.points.load).T


@keyword_array_record
class FieldSpectrum(RadialSpectrum):
    """A field per newton by the transform of its mean over directions, and by itself."""

    field: StressField
    load: float
    model: ClassVar[type[ForwardModel]] = FieldModel

    def plane(self, ky: FloatArray, kx: FloatArray) -> FloatArray:
        """Transform over the plane, (ky, kx), complex."""
        return self.field.plane(ky, kx) / self.load
