"""Families of tables that were calculated elsewhere."""

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from helpers import paper
from helpers.calculated_cases import LOADS, REACH, apart
from helpers.machine import assert_same_to_rounding
from helpers.paper import SPHERE

from memscal import indent
from memscal.errors import InputError
from memscal.friction.calculated import amontons_family, external_family

FRICTIONS = (0.0, 0.3, math.inf)
FILM = replace(paper.FILM, thickness_uncertainty=2e-5)
CONTACT = {"film": FILM, "indenter": SPHERE, "reach": REACH}


@cache
def tables():
    return [
        replace(contact.profile(), loading="incremental")
        for mu in FRICTIONS
        for contact in indent(FILM, SPHERE, load=LOADS, friction=mu)
    ]


def test_tables_of_our_own_contacts_give_our_own_family(tmp_path):
    ours = amontons_family(FILM, SPHERE, LOADS, friction=FRICTIONS, reach=REACH, cache=tmp_path)
    family = external_family(tables(), LOADS, **CONTACT, cache=tmp_path)
    assert family.name == "external"
    assert family.loading == "incremental"
    assert family.values.tolist() == list(FRICTIONS)
    for index in range(len(FRICTIONS)):
        assert apart(ours, family.spectra[index], ours.spectra[index]) < 3e-4
        assert apart(ours, family.by_load[index], ours.by_load[index]) < 1e-3
    assert_same_to_rounding(family.changes["thickness"], ours.changes["thickness"])
    np.testing.assert_allclose(family.depths, ours.depths, rtol=1e-3)


def test_a_table_serves_a_load_within_one_percent_in_proportion(tmp_path):
    asked = [load * 1.008 for load in LOADS]
    exact = external_family(tables(), LOADS, **CONTACT, cache=tmp_path)
    family = external_family(tables(), asked, **CONTACT, cache=tmp_path)
    np.testing.assert_allclose(family.spectra, 1.008 * exact.spectra, rtol=1e-12)
    assert family.loads.tolist() == asked
    turned = external_family(tables()[::-1], asked, **CONTACT, cache=tmp_path)
    assert_same_to_rounding(turned.spectra, family.spectra)


def test_every_missing_table_is_named():
    given = [one for one in tables() if (one.load, one.friction_coefficient) != (2.75, 0.3)]
    with pytest.raises(InputError, match=r"No table was given for 2\.75 N with friction 0\.3\."):
        external_family(given, LOADS, **CONTACT)
    with pytest.raises(InputError, match=r"1 N with friction 0; 1 N with friction 0\.3; 1 N"):
        external_family(tables(), [0.34, 1.0], **CONTACT)


def test_tables_that_contradict_each_other_are_refused():
    with pytest.raises(InputError, match="both for"):
        external_family([*tables(), tables()[0]], LOADS, **CONTACT)
    with pytest.raises(InputError, match="one loading"):
        external_family([*tables()[:-1], replace(tables()[-1], loading="total")], LOADS, **CONTACT)
    with pytest.raises(InputError, match="No table"):
        external_family([], LOADS, **CONTACT)


def test_a_table_that_cannot_be_compared_is_refused():
    one = tables()[0]
    short = one.r < 2e-3
    for changed, said in (
        (replace(one, friction_coefficient=None), "does not say its friction"),
        (replace(one, r=one.r[short], sigma_zz=one.sigma_zz[short], sigma_rz=None), "ends at"),
        (replace(one, sigma_zz=one.sigma_zz * 1.1), "carries"),
    ):
        with pytest.raises(InputError, match=said):
            external_family([changed], [one.load], **CONTACT)
