"""Speed of the likelihood of contacts: all values at once against one by one."""

from __future__ import annotations

from statistics import median

import pytest
from helpers.linear_contacts import Laboratory
from helpers.timing import once, show

from memscal.friction.effective import fine_values
from memscal.friction.likelihood import likelihood


@pytest.mark.benchmark
def test_a_whole_profile_likelihood_costs_less_than_its_values_one_by_one() -> None:
    laboratory = Laboratory.of()
    points = laboratory.measured(0.2, seed=1)
    values = fine_values(laboratory.family)
    members = laboratory.family.at(values)
    single = [laboratory.family.at(value) for value in values]

    def together() -> None:
        assert likelihood(points, laboratory.sensor, members, [0, 1]).chi_square.all()

    def one_by_one() -> None:
        for one in single:
            assert likelihood(points, laboratory.sensor, one, [0, 1]).chi_square.all()

    pairs = [(once(one_by_one), once(together)) for _ in range(3)]
    ratio = median(whole / apart for apart, whole in pairs)
    show("likelihood of all values at once, over one by one", ratio, 1 / 3)
