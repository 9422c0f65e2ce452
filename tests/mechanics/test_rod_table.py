"""The table of rods at finite strain against rods solved directly, and where it ends."""

from dataclasses import replace

import pytest
from helpers.paper import FILM, ROD
from helpers.rods import compare_with_the_table

from memscal import Rod
from memscal.mechanics.tabulated_rod import largest_tabulated_load, tabulated_rod

FULL = pytest.mark.full_study
RUBBER = replace(FILM, law="neo-hookean")


@pytest.mark.parametrize(
    ("nu", "radius", "depths", "sticking"),
    [
        (0.5, 0.16, [0.04], True),
        (0.495, 0.48, [0.04], False),
        pytest.param(0.46, 0.56, [0.02, 0.28], True, marks=FULL),
        pytest.param(0.495, 0.48, [0.012, 0.06, 0.28, 0.42], True, marks=FULL),
        pytest.param(0.46, 0.24, [0.003, 0.03, 0.15, 0.42], True, marks=FULL),
        pytest.param(0.485, 0.06, [0.012, 0.15], True, marks=FULL),
        pytest.param(0.5, 0.125, [0.28, 0.44], True, marks=FULL),
        pytest.param(0.495, 0.48, [0.06, 0.15], False, marks=FULL),
        pytest.param(0.46, 0.24, [0.01, 0.06, 0.14], False, marks=FULL),
        pytest.param(0.485, 0.06, [0.03], False, marks=FULL),
    ],
)
def test_a_tabulated_rod_is_that_which_is_solved(nu, radius, depths, sticking):
    compare_with_the_table(nu, radius, depths, sticking=sticking)


def test_the_table_ends_where_it_says():
    end = largest_tabulated_load(RUBBER, ROD, sticking=True)
    assert tabulated_rod(RUBBER, ROD, end * 0.999, sticking=True).depth < 0.45 * RUBBER.thickness
    assert tabulated_rod(RUBBER, ROD, end * 1.001, sticking=True) is None
    assert largest_tabulated_load(RUBBER, Rod(radius=2e-3), sticking=True) == 0
