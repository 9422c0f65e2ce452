"""A measured raster, used as it is on its own lattice."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.axisymmetry.grids import Lattice, on_grid
from memscal.calibration.fields import GridChoice, taper
from memscal.deconvolution.fourier_ratio import Field
from memscal.deconvolution.problem import KernelProfile
from memscal.errors import InputError
from memscal.estimation.ellipse import elliptic_departure
from memscal.estimation.gaussian_fit import GaussianFit
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.places import EvenAxis, even_lattice
from memscal.model.validation import FloatArray

__all__ = ["RasterFields"]

_REFINEMENT = 5


@dataclass(frozen=True, eq=False)
class _Oval:
    """What an elliptic Gaussian adds to the round one, in V/Pa/m^2."""

    fit: GaussianFit

    def on(self, x: FloatArray, y: FloatArray) -> FloatArray:
        """Values on a grid about the kernel's zero."""
        departure = elliptic_departure(x, y, self.fit.sigma, self.fit.ellipticity)
        return self.fit.conversion_constant * departure


@dataclass(frozen=True, eq=False)
class RasterFields:
    """A measured raster on its own lattice, continued by the fitted profile around it."""

    grid: Lattice
    voltage: Field
    stress: Field
    support: float
    step: float
    oval: _Oval
    index: tuple[NDArray[np.intp], NDArray[np.intp]]

    @classmethod
    def place(cls, estimate: ProfileEstimate, choice: GridChoice, *, divided: bool) -> RasterFields:
        """Place the raster, and continue it by the fitted profile.

        ``divided``: whether its field is divided, and so needs an even lattice; else points off
        any lattice get one of their own step, which the fitted profile fills alone.

        Raises
        ------
        InputError
            If it is divided, and the points lie on no even lattice.
        """
        points = estimate.points
        lattice = even_lattice(points.x, points.y, points.places[0].count)
        if lattice is None and divided:
            raise InputError(
                f"The raster's {points.u.size} points are not evenly spaced: they lie on no "
                "lattice of rows and columns within a tenth of its step.",
                why="This method divides a raster as a field, on its own lattice.",
                cure='Use method="evidence" (--method evidence), which needs no lattice; or scan '
                "evenly.",
            )
        if lattice is None:
            steps, nowhere = points.places[0].steps, np.zeros(0, dtype=np.intp)
            lattice = (
                EvenAxis(float(points.x.min()), steps[0], nowhere),
                EvenAxis(float(points.y.min()), steps[1], nowhere),
            )
        x, columns = _continued(lattice[0], float(np.ptp(points.x)), choice.extent)
        y, rows = _continued(lattice[1], float(np.ptp(points.y)), choice.extent)
        grid = Lattice(x - estimate.centre[0], y - estimate.centre[1])
        step = choice.spacing / 2
        voltage = on_grid(estimate.spectrum.at, grid, step)
        if rows.size:
            # A point that is missing keeps the profile; an outlier keeps most of it.
            departure = estimate.weighed.residual * estimate.outlier_weight + estimate.oval
            voltage += _mean_at(voltage.shape, (rows, columns), departure / points.load)
        stress = Field(grid, on_grid(estimate.model.reference.at, grid, step))
        oval = _Oval(estimate.gaussian)
        index = (rows, columns)
        return cls(grid, Field(grid, voltage), stress, choice.support, step, oval, index)

    @property
    def confinement(self) -> FloatArray:
        """Taper on the grid that confines a kernel to its support."""
        return taper(self._kernel_grid.radius, self.support)

    @property
    def _kernel_grid(self) -> Lattice:
        return Lattice(_about_zero(self.grid.x), _about_zero(self.grid.y))

    def kernel(self, profile: Callable[[FloatArray], FloatArray]) -> FloatArray:
        """Lift a radial function about a kernel's zero."""
        grid = self._kernel_grid
        return on_grid(profile, grid, self.step) + self.oval.on(grid.x, grid.y)

    def at_points(self, field: FloatArray) -> FloatArray:
        """Return the values of a field at the measured points."""
        return np.asarray(field[self.index])

    def on_support(self, kernel: FloatArray, profile: KernelProfile | None) -> Field:
        """Return a kernel on its support."""
        step = float(self.grid.x[1] - self.grid.x[0])
        # Odd, so that the kernel's zero stays a point of the lattice.
        refinement = max(_REFINEMENT, int(np.ceil(step / (2 * self.step))) | 1)
        fine, values = self.grid.refined(kernel, refinement)
        if profile is not None:
            values = on_grid(profile.radial, fine, self.step) + self.oval.on(fine.x, fine.y)
        inside_x, inside_y = np.abs(fine.x) <= self.support, np.abs(fine.y) <= self.support
        plane = values[np.ix_(inside_y, inside_x)]
        return Field(Lattice(fine.x[inside_x], fine.y[inside_y]), plane)

    def along_axis(self, spectral: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return wavenumbers along one axis and a spectral quantity there."""
        return self.grid.wavenumber[0], spectral[0]


def _about_zero(axis: FloatArray) -> FloatArray:
    """A kernel's zero is the central point of the lattice, wherever the sensor is."""
    return np.asarray(axis - axis[axis.size // 2])


def _continued(axis: EvenAxis, reach: float, extent: float) -> tuple[FloatArray, NDArray[np.intp]]:
    """Continue a raster's axis on both sides, to an odd number of nodes; index the points."""
    steps = int(np.rint(reach / axis.step))
    padding = int(np.ceil(max(2 * extent - reach, 0.0) / (2 * axis.step))) + 1
    count = steps + 1 + 2 * padding + steps % 2
    nodes = axis.start + axis.step * (np.arange(count) - padding)
    return np.asarray(nodes, dtype=np.float64), axis.index + padding


def _mean_at(
    shape: tuple[int, ...], index: tuple[NDArray[np.intp], ...], values: FloatArray
) -> FloatArray:
    """Mean of the values at each node of a lattice, zero where there is none."""
    total, number = np.zeros(shape), np.zeros(shape)
    np.add.at(total, index, values)
    np.add.at(number, index, 1.0)
    return total / np.maximum(number, 1.0)
