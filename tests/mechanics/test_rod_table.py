"""The table of rods at finite strain against rods solved directly, and where it ends."""

import pytest
from helpers.rods import compare_with_the_table

from memscal import ElasticFilm, Rod
from memscal.mechanics.finite_strain.table import largest_tabulated_load, tabulated_rod

FILM = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3, law="neo-hookean")
ROD = Rod(radius=0.25e-3)


@pytest.mark.parametrize(
    ("nu", "radius", "depths"), [(0.5, 0.125, [0.06]), (0.46, 0.56, [0.02, 0.28])]
)
def test_a_tabulated_rod_is_that_which_is_solved(nu: float, radius: float, depths) -> None:
    compare_with_the_table(nu, radius, depths, sticking=True)


def test_the_table_ends_where_it_says() -> None:
    end = largest_tabulated_load(FILM, ROD, sticking=True)
    assert tabulated_rod(FILM, ROD, end * 0.999, sticking=True).depth < 0.45 * FILM.thickness
    assert tabulated_rod(FILM, ROD, end * 1.001, sticking=True) is None
    assert largest_tabulated_load(FILM, Rod(radius=2e-3), sticking=True) == 0
