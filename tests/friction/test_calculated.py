"""Families of calculated profiles, against contacts that are solved one by one."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.calculated_cases import LOADS, REACH, apart, profiles
from helpers.machine import assert_same_to_rounding
from helpers.paper import FILM, SPHERE

from memscal import ExponentialCompliance, Interface, Sphere, indent
from memscal.errors import DomainError, InputError
from memscal.extensions.interface_laws.families import (
    SLIP_LENGTHS,
    elasto_plastic_family,
    normal_compliance_family,
)
from memscal.friction.calculated import FRICTIONS, amontons_family
from memscal.friction.family import FamilySetup

LENGTHS = np.array([0.0, 0.25, 0.5, 1.0, 2.0, 4.0, 6.0, 8.0]) * 1.82e-6


def amontons(**options):
    return lambda film, sphere, loads, values: amontons_family(
        film, sphere, loads, friction=values, reach=REACH, **options
    )


def elasto_plastic(friction):
    return lambda film, sphere, loads, values: elasto_plastic_family(
        film, sphere, loads, friction=friction, slip_lengths=values, reach=REACH
    )


def normal():
    return lambda film, sphere, loads, values: normal_compliance_family(
        film, sphere, loads, lengths=values, reach=REACH
    )


@pytest.mark.parametrize(
    ("build", "loads", "grid", "between"),
    [
        (amontons(), LOADS, FRICTIONS, [0.02, 0.175, 0.35, 0.75]),
        (amontons(loading="total"), LOADS[1:], FRICTIONS, [0.02, 0.175, 0.5, 3.0]),
        (amontons(order=1), LOADS, FRICTIONS, [0.07, 0.22, 0.5]),
        (elasto_plastic(1.6), LOADS[:1], SLIP_LENGTHS, [0.3e-6, 2.5e-6, 6e-6, 6e-5, 2e-4]),
        pytest.param(
            *(normal(), LOADS, LENGTHS, [0.2e-6, 1.3e-6, 5.5e-6, 11e-6]),
            marks=pytest.mark.full_study,
        ),
    ],
    ids=["incremental", "total", "shear", "elasto-plastic", "exponential"],
)
def test_interpolated_profiles_are_those_of_contacts_solved_between(build, loads, grid, between):
    family = build(FILM, SPHERE, list(loads), list(grid))
    solved = build(FILM, SPHERE, list(loads), between)
    for index, value in enumerate(between):
        member = family.at(value)
        assert apart(family, member.spectra[0], solved.spectra[index]) < 1e-3
        assert apart(family, member.by_load[0], solved.by_load[index]) < 2e-2


@pytest.mark.parametrize(
    ("friction", "loading", "order"),
    [(0.2, "incremental", 0), (math.inf, "total", 0), (0.2, "incremental", 1)],
)
def test_a_family_holds_the_contacts_that_indent_finds(friction, loading, order):
    family = amontons(loading=loading, order=order)(FILM, SPHERE, list(LOADS), [friction])
    assert family.order == order
    spectrum = ("base_spectrum", "base_shear_spectrum")[order]
    contacts = indent(FILM, SPHERE, load=LOADS, friction=friction, loading=loading)
    truth = np.array([getattr(contact, spectrum)(family.wavenumbers.k) for contact in contacts])
    assert apart(family, family.spectra[0], truth) < 3e-4
    np.testing.assert_allclose(family.depths[0], [contact.depth for contact in contacts], rtol=2e-4)
    assert np.all(family.convergence < 1e-3)


CASES = {
    "smooth": (amontons(), [0.0], 0.0),
    "incremental": (amontons(), [0.2], 0.2),
    "total": (amontons(loading="total"), [0.4], 0.4),
    "shear": (amontons(order=1), [0.2], 0.2),
    "elasto-plastic": (elasto_plastic(1.6), [1e-6, 2e-6, 3e-6, 4e-6], 2.5e-6),
    "exponential": (normal(), [1.82e-6, 3.64e-6, 7.28e-6], 3.64e-6),
}
UNCERTAIN_FILM = replace(
    FILM,
    young_modulus_uncertainty=0.01 * FILM.young_modulus,
    thickness_uncertainty=0.01 * FILM.thickness,
    poisson_ratio_uncertainty=0.01,
)
UNCERTAIN_SPHERE = replace(SPHERE, radius_uncertainty=0.01 * SPHERE.radius)


def stress(family, spectra):
    return profiles(family, spectra, blurred=False)[0]


def with_a_changed(source, share):
    """The film and the sphere with one property larger by a share of itself."""
    if source == "indenter_radius":
        return FILM, replace(SPHERE, radius=SPHERE.radius * (1 + share))
    return replace(FILM, **{source: getattr(FILM, source) * (1 + share)}), SPHERE


FULL = pytest.mark.full_study
BY_DAY = [pytest.param(case, marks=FULL if case in ("smooth", "total") else ()) for case in CASES]


@pytest.mark.parametrize("case", BY_DAY)
def test_sensitivities_are_the_differences_of_contacts_with_other_properties(case):
    build, grid, value = CASES[case]
    load = 1.37
    step = 0.002
    family = build(UNCERTAIN_FILM, UNCERTAIN_SPHERE, [load], grid)
    member = family.at(value)
    exact = build(FILM, SPHERE, [load], [value])
    for source in ("young_modulus", "thickness", "indenter_radius"):
        larger = build(*with_a_changed(source, step), [load], [value])
        # Stated are 1 %; a film of another thickness has other wavenumbers.
        truth = stress(larger, larger.spectra[0]) - stress(exact, exact.spectra[0])
        truth *= 0.01 / step
        found = stress(family, member.changes[source][0])
        assert np.max(np.abs(found - truth)) < 0.03 * np.max(np.abs(truth)), source
    expected = UNCERTAIN_FILM.expected
    nu = expected.poisson_ratio
    u = expected.poisson_ratio_uncertainty or 0.0
    softer, stiffer = (
        build(replace(FILM, poisson_ratio=nu + d), SPHERE, [load], [value]).spectra[0]
        for d in (-u, u)
    )
    change = member.changes["poisson_ratio"][0]
    assert apart(family, change, (stiffer - softer) / 2) < 0.06
    assert np.abs(member.spectra[0] - (softer + stiffer) / 2).max() < 0.2 * np.abs(change).max()


@pytest.mark.parametrize("case", CASES)
def test_derivatives_by_the_load_are_those_of_nearer_neighbours(case):
    build, _, value = CASES[case]
    load = 1.37
    step = 0.005
    family = build(FILM, SPHERE, [load], [value])
    near = build(FILM, SPHERE, [load * (1 - step), load * (1 + step)], [value]).spectra[0]
    truth = (near[1:] - near[:1]) / math.log((1 + step) / (1 - step))
    assert apart(family, family.by_load[0], truth) < 0.01


def test_whatever_changes_the_base_still_bears_the_load():
    family = amontons_family(UNCERTAIN_FILM, UNCERTAIN_SPHERE, LOADS, friction=[0.2], reach=REACH)
    squared = family.wavenumbers.k[:3] ** 2

    def force(spectra):
        return np.polynomial.polynomial.polyfit(squared, spectra[:, :3].T, 2)[0]

    np.testing.assert_allclose(force(family.spectra[0]), LOADS, rtol=1e-6)
    np.testing.assert_allclose(force(family.by_load[0]), LOADS, rtol=1e-6)
    for source, change in family.changes.items():
        assert np.max(np.abs(force(change[0]))) < 1e-6, source


def test_only_stated_uncertainties_count():
    film = replace(FILM, thickness_uncertainty=2e-5, poisson_ratio_uncertainty=0.0)
    family = amontons_family(film, SPHERE, [0.34], friction=[0.0], reach=REACH)
    assert set(family.changes) == {"thickness"}


def test_a_slip_length_of_nothing_is_rigid_and_one_without_end_is_smooth():
    family = elasto_plastic_family(
        FILM, SPHERE, LOADS[:1], friction=0.3, slip_lengths=[0, math.inf], reach=REACH
    )
    rigid = amontons_family(FILM, SPHERE, LOADS[:1], friction=[0.0, 0.3], reach=REACH)
    assert_same_to_rounding(family.spectra[0], rigid.spectra[1])
    assert_same_to_rounding(family.spectra[1], rigid.spectra[0])


def test_the_pressure_at_which_mean_planes_meet_does_not_reach_the_base():
    # p1 exp(-d / l) with another p1 is the same law at another distance: only the depth shifts.
    family = normal_compliance_family(FILM, SPHERE, LOADS[:1], lengths=[4e-6], reach=REACH)
    for meeting in (1e2, 3e4):
        law = ExponentialCompliance(decay_length=4e-6, reference_pressure=meeting)
        contacts = indent(FILM, SPHERE, load=LOADS[:1], interface=Interface(normal=law), rings=72)
        truth = np.array([contact.base_spectrum(family.wavenumbers.k) for contact in contacts])
        assert apart(family, family.spectra[0], truth) < 3e-4


def test_the_rough_film_scales_the_usual_lengths(monkeypatch):
    monkeypatch.setattr(FamilySetup, "family", lambda _, paths, **laws: (paths, laws["values"]))
    rough = replace(FILM, roughness_rms=1e-6)
    paths, lengths = normal_compliance_family(rough, SPHERE, [0.34], reach=REACH)
    assert paths[0].interface.rigid
    assert lengths[-1] == paths[-1].interface.normal.decay_length == pytest.approx(8e-6)


def test_loads_may_come_in_any_order_and_share_their_neighbours():
    asked = [0.7, 0.34, 0.69]
    family = amontons_family(FILM, SPHERE, asked, friction=[0.25], reach=REACH)
    upward = amontons_family(FILM, SPHERE, sorted(asked), friction=[0.25], reach=REACH)
    np.testing.assert_allclose(family.spectra[0], upward.spectra[0][[2, 0, 1]], rtol=1e-12)
    assert family.loads.tolist() == asked


def test_a_load_beyond_the_model_is_named():
    with pytest.raises(DomainError, match=r"up to 300 N .*friction 0\.1"):
        amontons_family(FILM, Sphere(radius=2e-3), [1.0, 300.0], friction=[0.1], reach=REACH)


@pytest.mark.parametrize(("changed", "said"), [
    ({"loads": [0.34, -1.0]}, "load is -1 N"),
    ({"loads": []}, "loads"), ({"friction": [0.3, 0.1]}, "increase"),
    ({"friction": [-0.1, 0.1]}, "none of them negative"),
    ({"friction": []}, "none of them negative"), ({"loading": "sudden"}, "loading is 'sudden'"),
    ({"reach": 0.0}, "reach"), ({"workers": 0}, "workers"),
])  # fmt: skip
def test_a_request_that_makes_no_sense_is_refused(changed, said):
    request = {"indenter": SPHERE, "loads": [0.34], "friction": [0.1], "reach": REACH} | changed
    film_indenter_loads = FILM, request.pop("indenter"), request.pop("loads")
    with pytest.raises(InputError, match=said):
        amontons_family(*film_indenter_loads, **request)


def test_laws_without_meaning_are_refused():
    for friction in (0.0, math.inf, -1.0):
        with pytest.raises(InputError, match="macroscopic"):
            elasto_plastic_family(FILM, SPHERE, [0.34], friction=friction, reach=REACH)
    with pytest.raises(InputError, match="infinite"):
        normal_compliance_family(FILM, SPHERE, [0.34], lengths=[0, math.inf], reach=REACH)
