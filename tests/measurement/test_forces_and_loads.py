"""Loads taken apart, and the force check: what it sees, what it does not, how often it is wrong."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.builders import make_scan
from helpers.scans import (
    EXACT_FILM,
    GAUSSIAN,
    LOADS,
    SIGMA,
    contact_scan,
    known_apparatus,
    measured,
)

import memscal
from memscal import SourceFile
from memscal.errors import InputError
from memscal.measurement.measure_stress import pooled_force
from memscal.measurement.restore import single_loads

SENSOR = known_apparatus()
QUIET = {"noise": 0.001, "load_scatter": 0.002, "position_error": 0.0}


def ratios(found):
    return np.array([profile.force / profile.load for profile in found.profiles])


def test_there_is_a_check_for_each_load_and_one_for_all():
    checks = {check.name: check for check in measured(0).checks}
    names = [name for name in checks if "force" in name]
    assert names == [*(f"applied_force_{i}" for i in (1, 2, 3, 4)), "applied_force_all"]
    assert checks["applied_force_3"].meaning.startswith("1.37 N, dry: ")
    for name in names:
        assert (checks[name].p_value > 0.05) == (checks[name].value < 1.96)


WIDER, NARROWER = (memscal.GaussianMixture((1.0,), (share * SIGMA,)) for share in (1.2, 0.8))
THICKER = replace(EXACT_FILM, thickness=1.05 * EXACT_FILM.thickness)


@pytest.mark.parametrize(
    ("kernel", "film"), [(WIDER, EXACT_FILM), (NARROWER, EXACT_FILM), (GAUSSIAN, THICKER)]
)
def test_the_force_depends_neither_on_the_width_of_g_nor_on_the_film(kernel, film):
    scan = contact_scan(1, **QUIET, load=LOADS[::3])
    right = ratios(memscal.measure_stress(scan, SENSOR))
    sensor = known_apparatus(kernel)
    wrong = ratios(memscal.measure_stress(replace(scan, film=film), sensor, override=True))
    np.testing.assert_allclose(wrong, right, atol=0.01)
    assert kernel is GAUSSIAN or abs(np.mean(wrong - right)) < 0.006


def test_all_profiles_together_tell_more_than_one_until_a_is_all_that_is_left():
    found = measured(3, conversion_uncertainty=0.01)
    single = [p.force_budget["scan"] / p.load for p in found.profiles]
    _, spread = pooled_force(found.profiles)
    assert 0.01 < spread < np.hypot(min(single), 0.01)
    own = 1 / np.sqrt(np.sum(np.array(single) ** -2.0))
    assert spread == pytest.approx(np.hypot(own, 0.01), rel=0.03)


def test_a_common_error_of_the_loads_does_not_average_out():
    one, two = (
        pooled_force(measured(3, load=loads, load_uncertainty=0.03).profiles)[1]
        for loads in ((2.75,), LOADS[::3])
    )
    assert two > 0.03
    assert one > two


def test_every_line_goes_to_the_part_of_its_load():
    scan = contact_scan(repeats=2, record_loads=True)
    parts = single_loads(scan)
    np.testing.assert_allclose([part.load for part in parts], LOADS, rtol=0.02)
    assert scan.normal_load is not None
    together = np.concatenate([part.u_zz for part in parts])
    assert np.sort(together, axis=None).tolist() == np.sort(scan.u_zz, axis=None).tolist()
    for part in parts:
        assert part.u_zz.shape == (2, scan.x.size)
        assert np.all(np.abs(part.normal_load / part.load - 1) < 0.15)


def test_the_common_uncertainty_of_the_load_grows_with_the_load():
    scan = contact_scan(load_uncertainty=0.01)
    spreads = [part.load_uncertainty for part in single_loads(scan)]
    np.testing.assert_allclose(spreads, 0.01 * np.array(LOADS), rtol=1e-12)


@pytest.mark.parametrize("kind", ["line", "repeats", "raster"])
def test_a_scan_that_records_no_load_is_one_part(kind):
    scan = make_scan(kind, normal_load=None)
    [part] = single_loads(scan)
    assert part is scan


@pytest.mark.parametrize(
    ("places", "load", "words"),
    [
        ((2, slice(5)), 0.5, r"mixed\.h5, line 3: its loads go from 0\.5 to 1\.37 N"),
        (1, np.nan, "line 2: every load is missing"),
    ],
)
def test_a_line_of_several_loads_or_of_none_is_refused_by_its_number(places, load, words):
    scan = contact_scan()
    loads = scan.normal_load.copy()
    loads[places] = load
    with pytest.raises(InputError, match=words):
        single_loads(replace(scan, normal_load=loads, source=SourceFile("mixed.h5", "")))


@pytest.mark.usefixtures("folder")
def test_each_load_and_direction_of_a_sliding_scan_is_a_profile():
    scan = contact_scan(4, **QUIET, load=LOADS[::3], repeats=2)
    signs = np.where(scan.passes % 2, -1.0, 1.0)
    tangential = 0.3 * signs * scan.normal_load
    slid = {"motion": "sliding", "sliding_direction": signs, "tangential_load": tangential}
    scan = replace(scan, **slid)
    memscal.measure_stress(scan, SENSOR).save("a.stress.h5")
    profiles = memscal.read_stress("a.stress.h5").profiles
    assert [p.state for p in profiles] == ["forth, dry", "forth, dry", "back, dry", "back, dry"]
    for profile in profiles:
        mean = 0.3 * profile.direction * profile.load
        assert profile.tangential_load == pytest.approx(mean, rel=0.01)
    back = memscal.restore(scan, SENSOR, load=LOADS[0], direction="back")
    assert back.force == pytest.approx(profiles[2].force, rel=1e-3)
    rows = str(back.summary()).splitlines()
    assert "direction of sliding back" in [" ".join(row.split()) for row in rows]
    with pytest.raises(InputError, match="slid forth and back, and no direction is chosen"):
        memscal.restore(scan, SENSOR, load=LOADS[0])
    with pytest.raises(InputError, match="no direction of sliding, and back is chosen"):
        memscal.restore(contact_scan(1), SENSOR, direction="back")
