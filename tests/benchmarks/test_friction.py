"""Speed of families of profiles and of their likelihood, as ratios on the same machine."""

from dataclasses import replace
from pathlib import Path
from statistics import median

import pytest
from helpers.linear_contacts import Laboratory
from helpers.machine import once, show
from helpers.paper import FILM, SPHERE

from memscal.friction.calculated import amontons_family
from memscal.friction.effective import fine_values
from memscal.friction.family import ProfileFamily
from memscal.friction.likelihood import likelihood
from memscal.mechanics.solver.refinement import solve_on_rings

pytestmark = pytest.mark.benchmark

UNCERTAIN = replace(FILM, thickness_uncertainty=2e-5)


def family(cache: Path | None) -> ProfileFamily:
    solve_on_rings.cache_clear()
    return amontons_family(
        UNCERTAIN, SPHERE, [0.34, 2.75], friction=[0.0, 0.3], reach=12e-3, cache=cache
    )


def test_a_kept_family_is_read_ten_times_faster_than_it_is_calculated(tmp_path: Path) -> None:
    family(tmp_path)
    pairs = [(once(lambda: family(None)), once(lambda: family(tmp_path))) for _ in range(3)]
    ratio = median(kept / calculated for calculated, kept in pairs)
    show("kept family, over a calculated one", ratio, 1 / 10)


def test_a_whole_profile_likelihood_costs_less_than_its_values_separately() -> None:
    laboratory = Laboratory.of()
    points = laboratory.measured(0.2, seed=1)
    values = fine_values(laboratory.family)
    members = laboratory.family.at(values)
    single = [laboratory.family.at(value) for value in values]

    def together() -> None:
        assert likelihood(points, laboratory.sensor, members, [0, 1]).chi_square.all()

    def separately() -> None:
        for member in single:
            assert likelihood(points, laboratory.sensor, member, [0, 1]).chi_square.all()

    pairs = [(once(separately), once(together)) for _ in range(3)]
    ratio = median(whole / apart for apart, whole in pairs)
    show("likelihood of all values at once, over one by one", ratio, 1 / 3)
