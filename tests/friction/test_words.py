"""What a comparison says beside its numbers: bracketing, checks and messages."""

from __future__ import annotations

import math
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from memscal.friction.checks import comparison_checks, comparison_messages, in_words
from memscal.friction.effective import bracketed_share
from memscal.friction.results import EffectiveFriction, FrictionComparison, Interval
from memscal.model.checks import Message
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere

FILM = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)


def reading(
    value: float | None, low: float, high: float | None, *, u: float | None = 0.02, **fields: Any
) -> EffectiveFriction:
    made = EffectiveFriction(
        value=value,
        standard_uncertainty=u,
        interval=Interval(low, high),
        reason="" if value is not None else "a lower bound",
        budget={},
        values=np.array([0.0, 0.1, math.inf]),
        chi_square=np.array([40.0, 30.0, 50.0]),
        degrees=29,
        least=30.0,
        p_value=0.4,
    )
    return replace(made, **fields)


def measured(**film: float) -> Any:
    scan = SimpleNamespace(synthetic=False, film=replace(FILM, **film), indenter=Sphere(radius=0.1))
    profile = SimpleNamespace(scan=scan, load_uncertainty=None)
    return SimpleNamespace(
        scans=(scan,),
        profiles=(profile,),
        messages=(Message("measured", "from the measured stress"),),
    )


def messages(
    incremental: EffectiveFriction, total: EffectiveFriction, macroscopic: float | None = None
) -> str:
    joint = {"dry": {"incremental": incremental, "total": total}}
    given = None if macroscopic is None else (macroscopic, None)
    return "\n".join(map(str, comparison_messages(measured(), {}, joint, (), given)))


def test_points_within_both_extremes_and_their_uncertainty_are_bracketed() -> None:
    """Profiles cross: under the flank the frictionless stress is the larger one."""
    calculated = np.array([[10.0, 5.0], [11.0, 5.5], [12.0, 4.0]])
    none = np.zeros_like(calculated)
    inside = np.array([11.0, 4.5])
    assert bracketed_share(inside, np.zeros(2), calculated, none) == 1
    outside = np.array([13.0, 4.5])
    assert bracketed_share(outside, np.zeros(2), calculated, none) == 0.5
    assert bracketed_share(outside, np.full(2, 0.6), calculated, none) == 1
    assert bracketed_share(outside, np.zeros(2), calculated, none + 0.6) == 1


@pytest.mark.parametrize(
    ("found", "words"),
    [
        (reading(0.12, 0.08, 0.17), "0.12 (0.080 to 0.17)"),
        (reading(0.01, 0.0, 0.05), "at most 0.050"),
        (reading(None, 0.2, None), "at least 0.20"),
        (reading(None, 0.0, None), "no bound"),
    ],
)
def test_an_interval_is_said_in_words(found: EffectiveFriction, words: str) -> None:
    assert in_words(found) == words


def test_definitions_of_the_loading_that_disagree_are_told() -> None:
    near, far = reading(0.25, 0.2, 0.3), reading(0.29, 0.24, 0.36)
    assert "disagree for the dry loads by 0.04" in messages(near, far)
    assert "disagree" not in messages(near, reading(0.26, 0.21, 0.31))
    bound = reading(None, 0.2, None)
    assert "gives at least 0.20, total loading 0.29" in messages(bound, far)
    assert "disagree" not in messages(bound, bound)


def test_the_macroscopic_coefficient_is_held_against_the_interval() -> None:
    one = reading(0.12, 0.08, 0.17)
    assert "is smaller than the macroscopic one, 1.6" in messages(one, one, 1.6)
    assert "is larger than the macroscopic one, 0.05" in messages(one, one, 0.05)
    assert "agrees with the macroscopic one, 0.1" in messages(one, one, 0.1)
    bound = reading(None, 0.2, None)
    assert "does not contradict the macroscopic one, 1.6" in messages(bound, bound, 1.6)


def test_what_states_no_uncertainty_is_named_and_the_rest_is_passed_on() -> None:
    text = messages(reading(0.1, 0.05, 0.2), reading(0.1, 0.05, 0.2))
    assert "Young's modulus, Poisson's ratio, film thickness, sphere radius, load" in text
    assert "from the measured stress" in text


def test_lubricated_loads_that_exclude_no_friction_fail_their_check() -> None:
    def check(rise: float) -> Any:
        along = np.array([30.0 + rise, 30.0, 60.0])
        joint = {"lubricated": {"total": reading(0.1, 0.05, 0.2, chi_square=along)}}
        return comparison_checks({}, joint)[-1]

    assert check(9.0).passed
    failing = check(12.0)
    assert not failing.passed
    assert failing.name == "lubricated_frictionless"
    assert failing.p_value == pytest.approx(5.3e-4, rel=0.02)


def test_a_misfit_of_all_loads_fails_though_one_loading_is_enough_to_pass() -> None:
    bad = reading(0.1, 0.05, 0.2, least=90.0, p_value=1e-8)
    good = reading(0.1, 0.05, 0.2)
    assert not comparison_checks({}, {"dry": {"total": bad}})[0].passed
    assert comparison_checks({}, {"dry": {"incremental": good, "total": bad}})[0].passed


def test_the_best_coefficient_of_a_bound_is_that_of_least_chi_square() -> None:
    assert reading(None, 0.05, None).best == 0.1
    assert reading(0.12, 0.08, 0.17).best == 0.12


def test_a_comparison_shows_its_numbers() -> None:
    joint = {"dry": {"total": reading(0.12, 0.08, 0.17)}, "": {"total": reading(None, 0.2, None)}}
    found = FrictionComparison(
        measured=measured(), friction=np.array([0.0, math.inf]), loads={}, joint=joint
    )
    assert repr(found) == (
        "<FrictionComparison: dry, total: 0.12 (0.08 to 0.17); "
        "not stated, total: 0.2 to infinity; all checks passed>"
    )
