"""The two fields of the paper's Eq. (1): lifted from profiles, or measured as a raster."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.fft

from memscal.axisymmetry.grids import EvenGrid, FieldGrid, Lattice, cut, lift
from memscal.deconvolution.problem import NOISE_RATIO, DivisionProblem
from memscal.errors import InputError
from memscal.estimation.band import Band
from memscal.estimation.constrained import constrained_profile
from memscal.estimation.ellipse import elliptic_departure
from memscal.estimation.points import ScanPoints
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.validation import FloatArray

__all__ = ["Fields", "GridChoice", "KernelView", "choose_grid", "prepare_fields"]

_POINTS_PER_WIDTH = 6.0
_RASTER_REFINEMENT = 5
_RASTER_TOLERANCE = 1e-3


@dataclass(frozen=True)
class GridChoice:
    """Spacing, half width of the support of G, and half extent of the fields, in m."""

    spacing: float
    support: float
    extent: float

    @property
    def reasons(self) -> Mapping[str, str]:
        """Why each was chosen, for the record."""
        return {
            "spacing": f"{self.spacing * 1e3:.4g} mm: {_POINTS_PER_WIDTH:g} points per Gaussian "
            "width, and the last wavenumber is at least twice the one where the window has closed",
            "support": f"{self.support * 1e3:.4g} mm: the largest distance from the centre; G is "
            "tapered to zero over its outer half",
            "extent": f"{self.extent * 1e3:.4g} mm: the whole length of the scan, about twice the "
            "support, so that nothing wraps around into it",
        }


@dataclass(frozen=True, eq=False)
class KernelView:
    """A kernel on its support: the plane, a radial cut, and its integral there.

    ``x``, ``y`` in m; ``plane`` (y, x); ``r`` in m with ``radial``; ``integral`` over the plane.
    """

    x: FloatArray
    y: FloatArray
    plane: FloatArray
    r: FloatArray
    radial: FloatArray
    integral: float


class Fields(Protocol):
    """Both fields on one grid, with the ways back from the grid."""

    @property
    def grid(self) -> FieldGrid:
        """The grid."""
        ...

    @property
    def voltage(self) -> FloatArray:
        """Voltage per newton on the grid, in V/N."""
        ...

    @property
    def reference(self) -> FloatArray:
        """Base stress per newton on the grid, in 1/m^2."""
        ...

    @property
    def confinement(self) -> FloatArray:
        """Taper on the grid that confines a kernel to its support."""
        ...

    def kernel(self, profile: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """A radial function about a kernel's zero, on the grid."""
        ...

    def at_points(self, field: FloatArray) -> FloatArray:
        """Values of a field at the measured points."""
        ...

    def view(self, kernel: FloatArray) -> KernelView:
        """A kernel on its support."""
        ...

    def along_axis(self, spectral: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Wavenumbers along one axis and a spectral quantity there."""
        ...


def choose_grid(estimate: ProfileEstimate, band: Band) -> GridChoice:
    """Choose the grid from the scan: every length from a length of the data.

    Parameters
    ----------
    estimate : ProfileEstimate
        The scan's profile.
    band : Band
        Its relevant band, which says where the window closes.
    """
    points = estimate.points
    support = float(estimate.distance.max())
    if _as_raster(points):
        # A square of this half width lies within the raster's longer side.
        support = float(np.abs(points.x - estimate.centre[0]).max())
    reference = np.abs(estimate.model.reference.values)
    closed = reference < 0.1 * NOISE_RATIO * band.weakest_reference
    last = float(band.k[int(np.argmax(closed))] if closed.any() else band.k[-1])
    width = max(estimate.gaussian.sigma, 0.5 * points.step)
    spacing = min(width / _POINTS_PER_WIDTH, np.pi / (2 * last))
    spacing = support / np.ceil(support / spacing)
    span = max(float(np.ptp(offset)) for offset in estimate.offset)
    extent = max(span, 1.25 * support)
    return GridChoice(spacing=float(spacing), support=support, extent=extent)


def prepare_fields(estimate: ProfileEstimate, choice: GridChoice) -> Fields:
    """Lift the profile of lines or of several scans, or place a raster as it was measured."""
    if _as_raster(estimate.points):
        return _RasterFields.place(estimate, choice)
    return _LineFields.lift(estimate, choice)


def division_problem(estimate: ProfileEstimate, band: Band, fields: Fields) -> DivisionProblem:
    """Return what a regulariser is given."""

    def posterior(nonnegative: bool, monotone: bool) -> FloatArray:
        profile = constrained_profile(estimate, nonnegative=nonnegative, monotone=monotone)
        return fields.kernel(profile)

    return DivisionProblem(
        fields.grid,
        fields.voltage,
        fields.reference,
        band.weakest_voltage,
        band.weakest_reference,
        posterior=posterior,
    )


def _as_raster(points: ScanPoints) -> bool:
    """Whether the points are one raster, which is used as it is; several scans share a profile."""
    return points.planar and points.scans == 1


def _taper(radius: FloatArray, support: float) -> FloatArray:
    """One up to half of the support, then falling as a cosine to zero at its edge.

    A sharp edge would cut the ripples of G at full height: their integral, and with it A, would
    depend on where it lies.
    """
    phase = np.clip(2 * radius / support - 1, 0.0, 1.0)
    return np.asarray((1 + np.cos(np.pi * phase)) / 2)


@dataclass(frozen=True, eq=False)
class _LineFields:
    """Both profiles, lifted to a quarter plane."""

    grid: EvenGrid
    voltage: FloatArray
    reference: FloatArray
    support: int
    radius: FloatArray

    @classmethod
    def lift(cls, estimate: ProfileEstimate, choice: GridChoice) -> _LineFields:
        cells = scipy.fft.next_fast_len(int(np.ceil(choice.extent / choice.spacing)), real=True)
        grid = EvenGrid(cells + 1, choice.spacing)
        step = choice.spacing / 2
        # Both at once: they share the Bessel functions of their transforms.
        spectra = np.stack([estimate.spectrum.values, estimate.model.reference.values], axis=1)
        wavenumbers = estimate.model.reference.wavenumbers
        both = lift(lambda r: wavenumbers.synthesise(spectra, r), grid, step)
        voltage, reference = np.ascontiguousarray(np.moveaxis(both, -1, 0))
        support = round(choice.support / choice.spacing)
        return cls(grid, voltage, reference, support, estimate.distance)

    @property
    def confinement(self) -> FloatArray:
        return _taper(self.grid.radius, self.support * self.grid.spacing)

    def kernel(self, profile: Callable[[FloatArray], FloatArray]) -> FloatArray:
        return lift(profile, self.grid, self.grid.spacing / 2)

    def at_points(self, field: FloatArray) -> FloatArray:
        return cut(field, self.grid, self.radius)

    def view(self, kernel: FloatArray) -> KernelView:
        inside = slice(0, self.support + 1)
        quarter = kernel[inside, inside]
        axis = self.grid.axis[inside]
        mirrored = np.concatenate([-axis[:0:-1], axis])
        plane = self.grid.to_image(quarter)
        integral = self.grid.integrate(quarter)
        return KernelView(mirrored, mirrored, plane, axis, quarter[0], integral)

    def along_axis(self, spectral: FloatArray) -> tuple[FloatArray, FloatArray]:
        return self.grid.wavenumber_axis, spectral[0]


@dataclass(frozen=True, eq=False)
class _RasterFields:
    """A measured raster on its own lattice, continued by the fitted profile around it."""

    grid: Lattice
    voltage: FloatArray
    reference: FloatArray
    support: float
    step: float
    oval: FloatArray
    index: tuple[FloatArray, FloatArray]

    @classmethod
    def place(cls, estimate: ProfileEstimate, choice: GridChoice) -> _RasterFields:
        points = estimate.points
        x, columns = _even_axis("x", points.x, choice.extent)
        y, rows = _even_axis("y", points.y, choice.extent)
        grid = Lattice(x - estimate.centre[0], y - estimate.centre[1])
        step = choice.spacing / 2
        voltage = lift(estimate.spectrum.at, grid, step)
        # A point that is missing keeps the profile; an outlier keeps most of it.
        departure = estimate.weighed.residual * estimate.outlier_weight + estimate.oval
        voltage[rows, columns] += departure / points.load
        reference = lift(estimate.model.reference.at, grid, step)
        gaussian = estimate.gaussian
        oval = gaussian.conversion_constant * elliptic_departure(
            _about_zero(x), _about_zero(y), gaussian.sigma, gaussian.ellipticity
        )
        return cls(grid, voltage, reference, choice.support, step, oval, (rows, columns))

    @property
    def confinement(self) -> FloatArray:
        return _taper(self._kernel_grid.radius, self.support)

    @property
    def _kernel_grid(self) -> Lattice:
        return Lattice(_about_zero(self.grid.x), _about_zero(self.grid.y))

    def kernel(self, profile: Callable[[FloatArray], FloatArray]) -> FloatArray:
        return lift(profile, self._kernel_grid, self.step) + self.oval

    def at_points(self, field: FloatArray) -> FloatArray:
        return np.asarray(field[self.index])

    def view(self, kernel: FloatArray) -> KernelView:
        fine, values = self.grid.refined(kernel, _RASTER_REFINEMENT)
        inside_x, inside_y = np.abs(fine.x) <= self.support, np.abs(fine.y) <= self.support
        plane = values[np.ix_(inside_y, inside_x)]
        x, y = fine.x[inside_x], fine.y[inside_y]
        r = x[x.size // 2 :]
        radial = _azimuthal_mean(x, y, plane, r)
        return KernelView(x, y, plane, r, radial, float(plane.sum() * fine.cell_area))

    def along_axis(self, spectral: FloatArray) -> tuple[FloatArray, FloatArray]:
        return self.grid.wavenumber[0], spectral[0]


def _about_zero(axis: FloatArray) -> FloatArray:
    """A kernel's zero is the central point of the lattice, wherever the sensor is."""
    return np.asarray(axis - axis[axis.size // 2])


def _even_axis(name: str, positions: FloatArray, extent: float) -> tuple[FloatArray, FloatArray]:
    """Continue a raster's axis on both sides, to an odd number of points; index the points."""
    unique = np.unique(positions)
    reach = unique[-1] - unique[0]
    # Whole rows or columns may be missing: steps are counted, not positions.
    steps = int(np.rint(reach / np.median(np.diff(unique))))
    step = reach / steps
    index = (positions - unique[0]) / step
    if np.any(np.abs(index - np.rint(index)) > _RASTER_TOLERANCE * steps):
        raise InputError(
            f"The raster's {name} positions are not evenly spaced.",
            why="A raster is transformed as it is, on its own lattice.",
            cure="Import it with positions snapped to a grid, or scan evenly.",
        )
    padding = int(np.ceil(max(2 * extent - reach, 0.0) / (2 * step))) + 1
    count = steps + 1 + 2 * padding + steps % 2
    axis = unique[0] + step * (np.arange(count) - padding)
    return axis, np.rint(index).astype(int) + padding


def _azimuthal_mean(x: FloatArray, y: FloatArray, plane: FloatArray, r: FloatArray) -> FloatArray:
    """Mean over 64 directions, by cubic splines; beyond the plane its edge is continued."""
    from scipy.ndimage import map_coordinates

    angle = 2 * np.pi * np.arange(64) / 64
    rows = (np.multiply.outer(r, np.sin(angle)) - y[0]) / (y[1] - y[0])
    columns = (np.multiply.outer(r, np.cos(angle)) - x[0]) / (x[1] - x[0])
    samples = map_coordinates(plane, [rows, columns], order=3, mode="nearest")
    return np.asarray(samples.mean(axis=1))
