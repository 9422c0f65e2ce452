"""A family between its values: bounded coordinate, interpolation, and what it refuses."""

import math
import pickle

import numpy as np
import pytest
from helpers.machine import assert_same_to_rounding

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import InputError
from memscal.friction.family import ProfileFamily, bounded, unbounded

VALUES = np.array([0.0, 0.1, 0.3, 1.0, math.inf])
LOADS = np.array([0.5, 1.0])
NODES = Wavenumbers.covering(1e3, 1e-2)


def saturating(value):
    """A quantity that rises and levels off, as a stress does with friction."""
    return 1 - math.exp(-6 * value) if math.isfinite(value) else 1.0


def family():
    rise = np.array([saturating(value) for value in VALUES])
    spectra = (1 + 0.2 * rise)[:, None, None] * LOADS[:, None] * np.exp(-((NODES.k * 1e-3) ** 2))
    number = np.ones((VALUES.size, LOADS.size))
    return ProfileFamily(
        name="amontons",
        loading="incremental",
        wavenumbers=NODES,
        loads=LOADS,
        values=VALUES,
        scale=0.3,
        spectra=spectra,
        by_load=spectra / 2,
        changes={"thickness": spectra / 100},
        depths=number,
        contact_radii=number,
        convergence=number * 1e-4,
    )


@pytest.mark.parametrize("value", [0.0, 1e-3, 0.3, 7.0, math.inf])
def test_value_and_bounded_coordinate_are_inverse_to_each_other(value):
    coordinate = bounded(value, 0.3)
    assert 0 <= coordinate <= 1
    assert unbounded(coordinate, 0.3) == pytest.approx(value, rel=1e-12)


@pytest.mark.parametrize("index", range(VALUES.size))
def test_at_a_value_of_its_own_a_family_gives_that_member(index):
    one = family()
    member = one.at(float(VALUES[index]))
    np.testing.assert_allclose(member.spectra[0], one.spectra[index], rtol=1e-14)
    np.testing.assert_allclose(member.by_load[0], one.by_load[index], rtol=1e-14)
    np.testing.assert_allclose(
        member.changes["thickness"][0], one.changes["thickness"][index], rtol=1e-14
    )


def test_between_its_values_a_family_that_rises_never_falls():
    one = family()
    passed = np.array([one.at(unbounded(t, 0.3)).spectra[0, 0, 0] for t in np.linspace(0, 1, 101)])
    assert np.all(np.diff(passed) >= -1e-15)
    assert passed[-1] == pytest.approx(one.spectra[-1, 0, 0])


def test_a_family_is_not_extrapolated():
    fields = {name: getattr(family(), name) for name in family().__dataclass_fields__}
    short = ProfileFamily(**(fields | {"values": np.array([0.05, 0.1, 0.2, 0.3, 0.4])}))
    for beyond in (0.01, 0.5, math.inf):
        with pytest.raises(InputError, match="does not reach"):
            short.at(beyond)


def test_a_family_cannot_be_changed_and_survives_another_process():
    one = family()
    with pytest.raises(ValueError, match="read-only"):
        one.spectra[0, 0, 0] = 0.0
    again = pickle.loads(pickle.dumps(one))
    assert_same_to_rounding(again.at(0.2).spectra, one.at(0.2).spectra)
    assert_same_to_rounding(again.changes["thickness"], one.changes["thickness"])


@pytest.mark.parametrize("wrong", [-0.1, math.nan])
def test_a_value_that_is_none_is_refused(wrong):
    with pytest.raises(InputError, match="does not reach"):
        family().at(wrong)
