"""Dry against lubricated voltages: nothing where there is nothing, and what friction adds."""

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.linear_contacts import CONVERSION, Laboratory, bare_points
from scipy.stats import kstest

from memscal.friction.dry_against_lubricated import dry_against_lubricated, lubricated_pairs
from memscal.friction.likelihood import Channel

CHANCE = 1e-4
PAIRS = 60 if FULL else 30
LOAD = 1


def profile(points, lubrication, load=2.0):
    """What a comparison reads of a measured profile."""
    stress = points.u / CONVERSION
    noise = points.noise / CONVERSION
    return SimpleNamespace(
        lubrication=lubrication,
        load=load,
        x=points.offset,
        y=0 * stress,
        axis=0,
        s_zz=stress,
        roots={"noise": noise, "conversion_constant": 1e-2 * stress[:, None]},
        errors_by=lambda source: {"noise": noise}[source],
        maximum=float(stress.max()),
        maximum_budget={"noise": 100.0, "apparatus": 500.0},
    )


def compared(friction, seed, *, correlation=0.0, shift=0.0):
    laboratory = Laboratory.of(points=bare_points(correlation=correlation))
    dry = laboratory.measured(friction, 2 * seed, systematic=False)[LOAD]
    wet = laboratory.measured(0.0, 2 * seed + 1, systematic=False)[LOAD]
    if shift:
        there = replace(wet, offset=wet.offset + shift)
        after, before = (laboratory.predicted(0.0, LOAD, read).signal for read in (there, wet))
        moved = after - before
        wet = replace(there, u=wet.u + moved[0])
    frictionless = laboratory.family.at(0.0).only([LOAD, LOAD])
    measured = SimpleNamespace(
        profiles=(profile(dry, "dry"), profile(wet, "lubricated")),
        conversion_constant=CONVERSION,
        conversion_constant_uncertainty=0.01 * CONVERSION,
    )
    return dry_against_lubricated(
        measured, Channel((dry, wet), laboratory.sensor, frictionless), (0, 1)
    )


def every(friction, **options):
    found = [compared(friction, seed, **options) for seed in range(PAIRS)]
    return [one for one in found if one is not None]


@pytest.mark.parametrize(
    "options", [{}, {"correlation": 0.6}, {"shift": 0.1e-3}], ids=["plain", "correlated", "shifted"]
)
def test_two_frictionless_scans_differ_by_chance(options):
    found = every(0.0, **options)
    assert len(found) == PAIRS
    assert kstest([one.p_value for one in found], "uniform").pvalue > CHANCE
    assert all(one.degrees == 33 - 3 for one in found)


def test_friction_shows():
    found = every(0.2)
    assert np.mean([one.p_value < 1e-3 for one in found]) > 0.9
    assert np.mean([one.maximum for one in found]) > 0


def test_an_error_of_the_conversion_constant_scales_the_difference_alone():
    one = compared(0.2, 1)
    noise = np.sqrt(2) * bare_points().noise[0] / CONVERSION
    assert one.difference_errors == pytest.approx(np.hypot(noise, 0.01 * one.difference))
    assert one.maximum_uncertainty == pytest.approx(np.hypot(0.01 * one.maximum, 100 * 2**0.5))


def test_scans_without_common_places_are_not_compared():
    assert compared(0.0, 1, shift=0.25e-3) is None


def test_pairs_are_of_one_load_dry_and_lubricated():
    points = bare_points()
    profiles = [
        profile(points, "dry", 0.5),
        profile(points, "dry", 2.0),
        profile(points, "lubricated", 2.02),
        profile(points, "", 0.5),
    ]
    assert lubricated_pairs(profiles) == [(1, 2)]
