"""The classical restorations: centre, units and scale, and what each of them promises."""

import re
from pathlib import Path

import numpy as np
import pytest

from memscal import Lattice
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.deconvolution.division import (
    DivisionProblem,
    Tikhonov,
    Wiener,
)

PAGE = Path(__file__).parents[2] / "docs" / "own_method.md"
OWN = {"__name__": "own_method"}
exec(re.findall(r"^```python\n(.*?)^```$", PAGE.read_text(), re.MULTILINE | re.DOTALL)[0], OWN)
CLASSICAL = [Wiener(), OWN["UnsupervisedWiener"](), OWN["RichardsonLucy"]()]


def named(regulariser):
    return regulariser.name


@pytest.mark.parametrize("regulariser", CLASSICAL, ids=named)
def test_the_integral_is_the_conversion_constant(regulariser, on_each_grid):
    gaussians = on_each_grid()
    image = gaussians.problem.grid.to_image(regulariser.divide(gaussians.problem).field)
    assert image.sum() * gaussians.problem.grid.cell_area == pytest.approx(3e-8, rel=1e-3)


@pytest.mark.parametrize(
    ("regulariser", "error"),
    [*zip(CLASSICAL, [1e-3, 3e-2, 1e-2], strict=True)],
    ids=["wiener", "unsupervised", "rl"],
)
def test_strong_components_come_back(regulariser, error, on_each_grid):
    gaussians = on_each_grid()
    strong = gaussians.stress_transform > 0.05
    found = gaussians.transform(regulariser.divide(gaussians.problem))[strong]
    np.testing.assert_allclose(found, gaussians.kernel_transform[strong], atol=error)


@pytest.mark.parametrize(("volts", "stress"), [(2.0**-20, 1.0), (1.0, 2.0**20)])
@pytest.mark.parametrize("regulariser", [*CLASSICAL, Tikhonov()], ids=named)
def test_the_units_of_voltage_and_stress_do_not_matter(regulariser, volts, stress, gaussians):
    # Powers of two: the unsupervised filter takes the rounding of noise-free data for noise.
    problem = gaussians("lattice").problem
    scaled = DivisionProblem(
        problem.grid,
        volts * problem.voltage,
        stress * problem.reference,
        volts * problem.weakest_voltage,
        stress * problem.weakest_reference,
    )
    once = regulariser.divide(problem).field
    again = regulariser.divide(scaled).field
    np.testing.assert_allclose(again * stress / volts, once, atol=1e-9 * np.abs(once).max())


@pytest.mark.parametrize("amplitude", [0.3, 1.0, 10.0])
@pytest.mark.parametrize("grid", ["lattice", "lattice off centre"])
def test_the_penalty_of_wiener_is_the_noise_at_the_edge_of_the_relevant_band(
    gaussians, grid, amplitude
):
    # Just beyond the weakest relevant component w, the window is |z|^2/(|z|^2 + (0.1 a w)^2).
    made = gaussians(grid, weakest=1e-2)
    division = Wiener(amplitude=amplitude).divide(made.problem)
    index = int(np.argmax(made.stress_transform[0] < 1e-2))
    z2 = made.stress_transform[0, index] ** 2
    expected = z2 / (z2 + (0.1 * amplitude * 1e-2) ** 2)
    assert division.window[0, index] == pytest.approx(expected, abs=2e-3)


def test_wiener_does_not_smooth_away_a_raster_too_coarse_to_show_the_band_edge():
    # At 1 mm the last component of the lattice is still relevant.
    axis = (np.arange(19) - 9) * 1e-3
    grid = Lattice(axis, axis)
    reference = unit_gaussian(grid.radius, 0.9e-3)
    kernel = unit_gaussian(grid.radius, 0.6e-3)
    problem = DivisionProblem(grid, grid.convolve(kernel, reference), reference, 1e-5, 1e-3)
    np.testing.assert_allclose(Wiener().divide(problem).field, kernel, atol=0.01 * kernel.max())


def test_richardson_and_lucy_keep_the_kernel_positive_where_others_overshoot(on_each_grid):
    problem = on_each_grid(weakest=1e-2).problem
    assert Tikhonov().divide(problem).field.min() < 0
    field = OWN["RichardsonLucy"]().divide(problem).field
    assert field.min() > -1e-12 * field.max()


def test_more_steps_of_richardson_and_lucy_resolve_more(gaussians):
    problem = gaussians()
    divided = [OWN["RichardsonLucy"](iterations=n).divide(problem.problem) for n in (2, 8, 32)]
    errors = [problem.error(division) for division in divided]
    assert errors == sorted(errors, reverse=True)


@pytest.mark.parametrize("regulariser", CLASSICAL, ids=named)
def test_windows_lie_between_nothing_and_all(regulariser, on_each_grid):
    problem = on_each_grid().problem
    window = regulariser.divide(problem).window
    assert window.shape == problem.grid.wavenumber.shape
    assert 0 <= window.min() <= window.max() <= 1
    assert window[0, 0] == pytest.approx(1, abs=1e-2)
