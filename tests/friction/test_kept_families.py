"""Families that are kept in a folder: the same numbers, for the same request only."""

from dataclasses import replace

import pytest
from helpers.calculated_cases import REACH
from helpers.paper import FILM, SPHERE
from helpers.records import assert_same

from memscal.friction.calculated import amontons_family
from memscal.friction.family import FamilySetup


def calculated(cache, film=FILM, **changed):
    request = {"friction": [0.0, 0.3], "loading": "incremental", "reach": REACH} | changed
    return amontons_family(film, SPHERE, [0.34], cache=cache, **request)


@pytest.fixture
def solved(monkeypatch):
    """How many groups of paths each call solved."""
    counts = []
    solve = FamilySetup._solved

    def counted(setup, groups):
        counts.append(len(groups))
        return solve(setup, groups)

    monkeypatch.setattr(FamilySetup, "_solved", counted)
    return counts


def test_a_kept_family_is_the_calculated_one_and_is_not_calculated_again(tmp_path, solved):
    film = replace(FILM, thickness_uncertainty=2e-5, poisson_ratio_uncertainty=0.01)
    first, second = (calculated(tmp_path, film) for _ in range(2))
    assert len(solved) == 1
    assert list(first.changes) == ["thickness", "poisson_ratio"]
    assert_same(second, first)


@pytest.mark.parametrize(
    ("changed", "count"),
    [
        ({"film": replace(FILM, name="film 7")}, 1),
        ({"film": replace(FILM, thickness=1.999e-3)}, 2),
        ({"film": replace(FILM, young_modulus_uncertainty=1e5)}, 2),
        ({"loading": "total"}, 2),
        ({"friction": [0.0, 0.31]}, 2),
        ({"reach": 50e-3}, 2),
    ],
)
def test_another_request_but_not_another_name_is_calculated(tmp_path, solved, changed, count):
    calculated(tmp_path)
    calculated(tmp_path, **changed)
    assert len(solved) == count


def test_without_a_folder_nothing_is_written(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("HOME", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    calculated(None)
    assert list(tmp_path.iterdir()) == []
