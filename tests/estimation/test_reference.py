"""The reference: where it comes from, what it must cover, and what its inputs change."""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import LINEAR_FILM, reference_spectrum, simulated

import memscal
from memscal.axisymmetry.kernels import blurred_disc
from memscal.errors import InputError
from memscal.estimation.points import measured_points
from memscal.estimation.reference_spectra import stated_sensitivities
from memscal.estimation.set_up import reference_profile, require_same_set_up
from memscal.extensions.simulation.rod_scan import PAPER_ROD
from memscal.mechanics.contact import Contact

SCAN = simulated(film=LINEAR_FILM, rod=PAPER_ROD)
POINTS = measured_points(SCAN)
CONTACT = memscal.indent(SCAN.film, SCAN.indenter, load=1.0)


def test_the_order_of_preference_is_given_then_carried_then_solved():
    other = CONTACT.profile()
    carrying = replace(SCAN, reference=other)
    assert reference_profile(carrying, CONTACT) is CONTACT
    assert reference_profile(carrying, None) is other
    solved = reference_profile(SCAN, None)
    assert isinstance(solved, Contact)
    assert solved.load == SCAN.load


def test_a_table_that_does_not_reach_the_axis_is_refused():
    full = CONTACT.profile()
    kept = full.r > 2e-3
    part = replace(full, r=full.r[kept], sigma_zz=full.sigma_zz[kept], sigma_rz=None)
    with pytest.raises(InputError, match="begins at r = 2"):
        reference_spectrum(part, POINTS)


def test_a_table_in_tension_is_refused_with_its_cure():
    full = CONTACT.profile()
    with pytest.raises(InputError, match="Change the sign"):
        reference_spectrum(replace(full, sigma_zz=-full.sigma_zz), POINTS)


FILM = replace(SCAN.film, law="")
TABLE = CONTACT.profile()
RUBBER = {"law": "neo-hookean"}
EXACTLY = {"thickness_uncertainty": None}
LOADS = replace(SCAN, normal_load=np.geomspace(0.998, 1.001, SCAN.u_zz.size))


@pytest.mark.parametrize(
    ("scan", "table", "words"),
    [
        # Thicknesses of 0.02 mm each: twice the uncertainty of the difference is 0.057 mm.
        ({"thickness": 2.056e-3}, {}, None),
        (
            {"thickness": 2.058e-3},
            {},
            r"film thickness +2\.058 mm \(u 0\.02\).* 2 mm \(u 0",
        ),
        ({"thickness": 2.000001e-3, **EXACTLY}, EXACTLY, None),
        ({"thickness": 2.00001e-3, **EXACTLY}, EXACTLY, r"2\.00001 mm \(u not stated\)"),
        ({"poisson_ratio": 0.48}, {}, r"film Poisson's ratio +0\.48 \(u 0\.005\)"),
        ({"young_modulus": 9e6}, RUBBER, r"film Young's modulus +9 MPa .* 2\.2 MPa"),
        (
            {"law": "linear"},
            RUBBER,
            r'film law +"linear".* "neo-hookean"',
        ),
        ({"radius": 0.26e-3}, {}, r"rod radius +0\.26 mm"),
        ({"rod_friction": np.inf}, {"friction_coefficient": 0.0}, None),
        (
            {"rod_friction": np.inf},
            {"friction_coefficient": 0.0, **RUBBER},
            "friction of the rod +inf",
        ),
        ({"load": 0.5}, {"law": "linear"}, None),
        ({"load": 0.5}, {"law": ""}, r"load +0\.5 N \(u not stated\)"),
        ({"load": 0.5}, RUBBER, "film: neo-hookean"),
        ({"normal_load": LOADS.normal_load}, RUBBER, r"load +0\.998 N"),
        ({"normal_load": LOADS.normal_load, "load_uncertainty": 2e-3}, RUBBER, None),
        ({}, {"film": None, "load": 1.01}, "load +1 N"),
    ],
)
def test_a_reference_agrees_with_its_scan_within_their_uncertainties(scan, table, words):
    made = []
    for whole, values in ((SCAN, dict(scan)), (TABLE, dict(table))):
        film = {name: values.pop(name) for name in [*values] if hasattr(FILM, name)}
        rod = {name: values.pop(name) for name in [*values] if hasattr(PAPER_ROD, name)}
        parts = {"film": replace(FILM, **film), "indenter": replace(PAPER_ROD, **rod)}
        made.append(replace(whole, **(parts | values)))
    set_up = [made[0]], [made[1]]
    if words is None:
        assert require_same_set_up(*set_up, override=False) == []
        return
    with pytest.raises(InputError, match=words):
        memscal.calibrate(made[0], reference=made[1])
    (difference,) = require_same_set_up(*set_up, override=True)
    assert re.search(words, difference)


def test_an_alternative_may_have_another_law_and_no_other_thickness():
    scan = replace(SCAN, film=replace(FILM, law="linear"))
    film = replace(FILM, **RUBBER)
    other = replace(TABLE, film=film, friction_coefficient=np.inf)
    assert require_same_set_up([scan], [None], [other], override=False) == []
    with pytest.raises(InputError, match=r"the alternative\n +film thickness"):
        memscal.calibrate(scan, alternative=replace(other, film=replace(film, thickness=3e-3)))


def test_a_reference_that_travels_in_the_scan_takes_its_film_and_agrees(tmp_path):
    scan = replace(SCAN, film=replace(FILM, **RUBBER), reference=replace(TABLE, film=None))
    memscal.write_scan(scan, tmp_path / "scan.h5")
    read = memscal.read_scan(tmp_path / "scan.h5")
    assert require_same_set_up([read], [None], override=False) == []
    with pytest.raises(InputError, match=r"load +0\.5 N"):
        memscal.calibrate(replace(scan, load=0.5))


def test_sensitivities_are_the_change_of_the_solution_by_one_standard_uncertainty():
    spectrum = reference_spectrum(CONTACT, POINTS)
    owners = ("film", "indenter")
    film, rod = (stated_sensitivities(SCAN.set_up, spectrum, owner) for owner in owners)
    changes = film | rod
    assert set(changes) == {"young_modulus", "thickness", "poisson_ratio", "rod_radius"}
    # At a given load the base stress of a linear film does not know its modulus...
    assert not np.any(changes["young_modulus"])
    # ...and the total force is the load, whatever the film.
    for change in changes.values():
        assert abs(np.interp(0.0, spectrum.wavenumbers.k, change)) < 1e-6
    thicker = replace(SCAN.film, thickness=SCAN.film.thickness + 0.02e-3)
    moved = memscal.indent(thicker, SCAN.indenter, load=1.0).base_spectrum(spectrum.wavenumbers.k)
    difference = moved - spectrum.values
    np.testing.assert_allclose(
        changes["thickness"], difference, atol=0.02 * np.abs(difference).max()
    )


@pytest.mark.parametrize(("side", "narrowest"), [(70, 6e-3 / 69), (141, 0.15e-3)])
def test_waves_of_a_source_end_by_its_step_or_of_many_readings_by_g(side, narrowest):
    axis = np.linspace(-6e-3, 6e-3, side)
    u = blurred_disc(np.hypot.outer(axis, axis), 2e-3, 1e-3)
    points = measured_points(memscal.Scan(x=axis, y=axis, u_zz=u, load=1.0))
    source = memscal.IdealReference("disc", 2e-3).profile()
    last = reference_spectrum(source, points).wavenumbers.k[-1]
    assert last == pytest.approx(1.5 * np.pi / narrowest, rel=0.02)
