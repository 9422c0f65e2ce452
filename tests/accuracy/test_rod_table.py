"""The table of rods at finite strain against rods solved directly, throughout its range."""

import pytest
from helpers.rods import compare_with_the_table

pytestmark = [pytest.mark.accuracy, pytest.mark.full_study]


@pytest.mark.parametrize(
    ("nu", "radius", "depths"),
    [
        (0.495, 0.48, [0.012, 0.06, 0.28, 0.42]),
        (0.46, 0.24, [0.003, 0.03, 0.15, 0.42]),
        (0.485, 0.06, [0.012, 0.15]),
        (0.5, 0.125, [0.28, 0.44]),
    ],
)
def test_a_rod_that_sticks(nu: float, radius: float, depths: list[float]) -> None:
    compare_with_the_table(nu, radius, depths, sticking=True)


@pytest.mark.parametrize(
    ("nu", "radius", "depths"),
    [
        (0.495, 0.48, [0.06, 0.15]),
        (0.46, 0.24, [0.01, 0.06, 0.14]),
        (0.485, 0.06, [0.03]),
    ],
)
def test_a_rod_that_slides(nu: float, radius: float, depths: list[float]) -> None:
    compare_with_the_table(nu, radius, depths, sticking=False)
