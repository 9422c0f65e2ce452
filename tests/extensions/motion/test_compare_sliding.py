"""Friction from sliding: what is told of known contacts, what is refused, and what is shown."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import known_apparatus
from helpers.schemas import faults
from helpers.sliding_sphere import FILM, SPHERE, Slid, sliding_scan

import memscal
from memscal.cli.compare import user_cache_folder
from memscal.errors import InputError
from memscal.extensions.motion.sliding_family import sliding_family

X = np.linspace(-8e-3, 8e-3, 81)
APPARATUS = replace(known_apparatus(conversion_uncertainty=0.01), film=FILM)
BOTH = (1, -1)


def family(film=FILM, loads=(1.37,)):
    setting = {"film": film, "indenter": SPHERE, "loads": loads, "reach": 12e-3}
    return sliding_family(setting | {"cache": user_cache_folder()})


def along_line(members):
    return members.wavenumbers.synthesise(members.spectra[0, 0], X)


def scan(friction, ways=BOTH, backlash=0.0, **changes):
    """A scan whose noise is stated, and nearly absent."""
    made = sliding_scan(Slid(friction), 1, ways, share=1e-4, backlash=backlash)
    return replace(made, u_zz_errors=50 * made.u_zz_errors, **changes)


def compared(scans, backlash=None):
    return memscal.compare(
        scans, APPARATUS, sliding=True, backlash=backlash, cache=user_cache_folder()
    )


def found(*arguments):
    return compared(*arguments).joint[""]["sliding"].value


@pytest.mark.parametrize("friction", [0.0, 0.1, 0.5])
def test_between_its_values_the_family_holds_the_contacts(friction):
    contact = memscal.slide(FILM, SPHERE, load=1.37, friction=friction)
    stress = contact.base_stress(X)
    assert along_line(family().at(friction)) == pytest.approx(stress, abs=2e-3 * stress.max())


def test_a_change_by_the_thickness_is_the_difference_of_two_families():
    h = FILM.thickness
    u = FILM.thickness_uncertainty
    more, less = (family(replace(FILM, thickness=h + side * u)).at(0.5) for side in (1, -1))
    change = more.wavenumbers.synthesise(family().at(0.5).changes["thickness"][0, 0], X)
    difference = (along_line(more) - along_line(less)) / 2
    assert change == pytest.approx(difference, abs=0.05 * abs(difference).max())


@pytest.mark.parametrize("friction", [0.1, 0.6])
def test_one_way_by_the_skew_and_both_ways_by_the_shift_tell_the_friction(friction):
    assert found(scan(friction, (1,))) == pytest.approx(friction, abs=2e-3)
    assert found(scan(friction, (-1,))) == pytest.approx(friction, abs=2e-3)
    assert found(scan(friction), 5e-6) == pytest.approx(friction, abs=1e-3)


def test_a_backlash_that_is_not_counted_is_friction_and_own_centres_do_not_see_it():
    # By friction the sensor sees the largest stress 1.5 mm earlier for each unit, on either way; by
    # this play later.
    play = scan(0.3, backlash=20e-6)
    assert found(play) == pytest.approx(0.3, abs=2e-3)
    assert 0.3 - found(play, 1e-9) == pytest.approx(20e-6 / 3e-3, rel=0.15)


def failed(comparison):
    return {check.kind for check in comparison.checks if not check.passed}


def test_a_backlash_larger_than_stated_and_a_wrong_direction_are_seen():
    assert failed(compared(scan(0.3, backlash=200e-6), 5e-6)) == {"skew_and_shift"}
    right = scan(0.3)
    wrong = replace(right, sliding_direction=-right.sliding_direction)
    assert "negative_friction" in failed(compared(wrong, 5e-6))
    assert "negative_friction" in failed(compared(replace(wrong, u_zz_errors=None)))


def test_a_noise_that_is_not_stated_is_that_about_sliding_contacts():
    made = replace(sliding_scan(Slid(0.6), 1, BOTH), u_zz_errors=None)
    [note] = [one.text for one in compared(made).messages if one.kind == "noise_unstated"]
    size = sliding_scan(Slid(0.6), 1, BOTH).u_zz_errors[0, 0]
    # 402 readings tell it to 4 %.
    assert float(note.split()[6]) == pytest.approx(1e3 * size, rel=0.15)


def test_directions_and_speeds_are_held_against_the_times():
    made = scan(0.3)
    once = np.arange(201.0)
    time = np.stack([once, 500.0 - once])
    assert memscal.measure_stress(replace(made, time=time), APPARATUS).scans[0].speed == 1e-4
    with pytest.raises(InputError, match="against its direction of sliding"):
        memscal.measure_stress(replace(made, time=np.stack([once, 300.0 + once])), APPARATUS)
    with pytest.raises(InputError, match=r"slid at 0\.05 to 0\.1 mm/s"):
        memscal.measure_stress(replace(made, time=time * [[1.0], [2.0]]), APPARATUS)


def test_speeds_are_told_apart_and_held_against_the_tangential_load(tmp_path, run):
    ratios = {1e-3: 0.3, 2e-3: 0.2}
    paths = []
    for speed, friction in ratios.items():
        pull = 1.37 * friction * np.outer(BOTH, np.ones(201))
        made = scan(friction, speed=speed, tangential_load=pull, sliding_friction=0.3)
        paths.append(tmp_path / f"{friction}.h5")
        memscal.write_scan(made, paths[-1])
    APPARATUS.save(tmp_path / "a.h5")
    figure = tmp_path / "f.png"
    options = ("--sliding", "--backlash", "5", "--json", "--figure", figure)
    outcome = run("compare", tmp_path / "a.h5", *paths, *options)
    printed = outcome.json
    assert faults("compare", printed) == []
    assert figure.stat().st_size > 10_000
    speeds = {one["speed"]["value"]: one["value"] for one in printed["speeds"]}
    assert speeds == pytest.approx({1.0: 0.3, 2.0: 0.2}, abs=2e-3)
    fails = {check["name"] for check in printed["checks"] if not check["passed"]}
    assert fails == {"sliding_friction_3", "sliding_friction_4"}
    assert [one["value"] for one in printed["joint"]] == [None]
    assert outcome.code == 1


@pytest.mark.parametrize(
    ("change", "options", "message"),
    [
        ({}, {}, "sliding"),
        ({}, {"backlash": 5e-6}, "sliding"),
        ({"motion": "", "sliding_direction": None}, {"sliding": True}, "not state .* slid"),
        ({"sliding_direction": None}, {"sliding": True}, "direction of sliding"),
        ({}, {"sliding": True, "macroscopic": 0.3}, "options of the normal one"),
        ({}, {"sliding": True, "backlash": 5e-6}, "passes forth and back"),
    ],
)
def test_what_does_not_belong_together_is_refused(change, options, message):
    made = scan(0.0, (1,), **change)
    with pytest.raises(InputError, match=message):
        memscal.compare(made, APPARATUS, **options)


def test_a_measured_stress_is_refused_likewise_without_the_option():
    with pytest.raises(InputError, match="sliding"):
        memscal.compare(memscal.measure_stress(scan(0.0, (1,)), APPARATUS), APPARATUS)
