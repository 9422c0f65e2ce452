"""Division problems whose answer is known in closed form."""

from dataclasses import dataclass

import numpy as np
import pytest

from memscal import EvenGrid, Lattice
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.deconvolution.division import DivisionProblem
from memscal.model.arrays import FloatArray

A = 3e-8
STRESS_WIDTH = 0.9e-3
KERNEL_WIDTH = 0.561e-3


def _lattice(x=0.0, y=0.0):
    return Lattice(np.arange(-80, 81) * 0.12e-3 + x, np.arange(-70, 71) * 0.11e-3 + y)


GRIDS = {
    "quarter plane": (EvenGrid(97, 0.1e-3), EvenGrid(97, 0.1e-3)),
    "lattice": (_lattice(), _lattice()),
    "lattice off centre": (_lattice(0.63e-3, -0.41e-3), _lattice()),
}


@dataclass(frozen=True, eq=False)
class Gaussians:
    """A Gaussian stress through a Gaussian kernel, without noise."""

    problem: DivisionProblem
    exact: FloatArray
    stress_transform: FloatArray
    kernel_transform: FloatArray

    def error(self, division):
        """Relative L2 error of the quotient, as an image."""
        found = self.problem.grid.to_image(division.field) / A
        exact = self.problem.grid.to_image(self.exact)
        return float(np.linalg.norm(found - exact) / np.linalg.norm(exact))

    def transform(self, division):
        """Transform of the quotient about its centre; one at zero if A is right."""
        return self.problem.grid.transfer(division.field) / A


def _make(grid_name="quarter plane", weakest=1e-3):
    grid, centred = GRIDS[grid_name]
    k = np.sqrt(-2 * np.log(weakest)) / STRESS_WIDTH
    both = float(np.hypot(STRESS_WIDTH, KERNEL_WIDTH))
    problem = DivisionProblem(
        grid,
        A * unit_gaussian(grid.radius, both),
        unit_gaussian(grid.radius, STRESS_WIDTH),
        A * float(np.exp(-((k * both) ** 2) / 2)),
        weakest,
    )
    widths = (STRESS_WIDTH, KERNEL_WIDTH)
    transforms = [np.exp(-((grid.wavenumber * width) ** 2) / 2) for width in widths]
    return Gaussians(problem, unit_gaussian(centred.radius, KERNEL_WIDTH), *transforms)


@pytest.fixture
def gaussians():
    """Return the maker of problems: by the grid's name and the weakest relevant component."""
    return _make


@pytest.fixture(params=GRIDS)
def on_each_grid(request):
    """Return the maker of problems on one of the grids."""
    return lambda weakest=1e-3: _make(request.param, weakest)
