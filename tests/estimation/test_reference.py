"""The reference: where it comes from, what it must cover, and what its inputs change."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import reference_spectrum, simulated

import memscal
from memscal.errors import InputError
from memscal.estimation.points import measured_points
from memscal.estimation.reference import (
    film_sensitivities,
    reference_profile,
    require_calibration_rod,
    rod_sensitivities,
)
from memscal.mechanics.contact import Contact
from memscal.simulation.rod_scan import PAPER_FILM, PAPER_ROD

SCAN = simulated(film=PAPER_FILM, rod=PAPER_ROD)
POINTS = measured_points(SCAN)
CONTACT = memscal.indent(SCAN.film, SCAN.indenter, load=1.0)


def test_a_table_of_the_contact_has_the_contact_s_transform() -> None:
    exact = reference_spectrum(CONTACT, POINTS, SCAN.film.thickness)
    table = reference_spectrum(CONTACT.profile(), POINTS, SCAN.film.thickness)
    np.testing.assert_allclose(table.values, exact.values, atol=1e-6)
    assert exact.integral == pytest.approx(1.0, abs=1e-9)


def test_the_transform_is_per_newton_whatever_the_load() -> None:
    light = reference_spectrum(CONTACT, POINTS, SCAN.film.thickness)
    heavy = memscal.indent(SCAN.film, SCAN.indenter, load=2.5)
    np.testing.assert_allclose(
        reference_spectrum(heavy, POINTS, SCAN.film.thickness).values, light.values, rtol=1e-12
    )


def test_the_order_of_preference_is_given_then_carried_then_solved() -> None:
    other = CONTACT.profile()
    carrying = replace(SCAN, reference=other)
    assert reference_profile(carrying, CONTACT) is CONTACT
    assert reference_profile(carrying, None) is other
    solved = reference_profile(SCAN, None)
    assert isinstance(solved, Contact)
    assert solved.load == SCAN.load


@pytest.mark.parametrize(
    ("keep", "words"),
    [(lambda r: r < 3e-3, "ends at r = 2"), (lambda r: r > 2e-3, "begins at r = 2")],
)
def test_a_table_that_does_not_cover_the_scan_is_refused(keep, words: str) -> None:
    full = CONTACT.profile()
    kept = keep(full.r)
    part = replace(full, r=full.r[kept], sigma_zz=full.sigma_zz[kept], sigma_rz=None)
    with pytest.raises(InputError, match=words):
        reference_spectrum(part, POINTS, SCAN.film.thickness)


def test_a_table_in_tension_is_refused_with_its_cure() -> None:
    full = CONTACT.profile()
    with pytest.raises(InputError, match="Change the sign"):
        reference_spectrum(replace(full, sigma_zz=-full.sigma_zz), POINTS, SCAN.film.thickness)


def test_a_sphere_and_a_rod_wider_than_the_film_cannot_calibrate() -> None:
    with pytest.raises(InputError, match="needs a rod"):
        require_calibration_rod(replace(SCAN, indenter=memscal.Sphere(radius=0.1)))
    with pytest.raises(InputError, match="times the film's thickness of 2 mm"):
        require_calibration_rod(replace(SCAN, indenter=memscal.Rod(radius=1.1e-3)))


def test_sensitivities_are_the_change_of_the_solution_by_one_standard_uncertainty() -> None:
    spectrum = reference_spectrum(CONTACT, POINTS, SCAN.film.thickness)
    changes = film_sensitivities(SCAN, spectrum) | rod_sensitivities(SCAN, spectrum)
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


def test_sources_whose_uncertainty_is_not_stated_are_left_out() -> None:
    bare = simulated()
    spectrum = reference_spectrum(CONTACT, POINTS, SCAN.film.thickness)
    assert film_sensitivities(bare, spectrum) == rod_sensitivities(bare, spectrum) == {}
