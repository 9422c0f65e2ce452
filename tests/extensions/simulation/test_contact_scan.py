"""Synthetic contact scans and whole experiments: mechanics, force, statistics, stated truth."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import RARE
from helpers.scans import LINEAR_FILM, STILL, simulate, simulate_contacts, simulate_experiment
from scipy.stats import chi2

import memscal
from memscal.errors import DomainError, InputError
from memscal.extensions.simulation.contact_scan import PAPER_SPHERE
from memscal.extensions.simulation.experiment import Reality, drawn
from memscal.extensions.simulation.rod_scan import PAPER_FILM, PAPER_ROD
from memscal.extensions.simulation.sensor import blurred_stress

EXACT = {**STILL, "load_scatter": 0.0, "position_error": 0.0}


def truth(scan):
    return dict(scan.synthetic)


def test_contacts_that_scatter_are_those_solved_at_their_own_loads(seed):
    options = {"load": [0.34, 1.37], "friction": 0.15, "points": 9, **STILL}
    options |= {"spacing": 1e-3, "position_error": 0.0, "load_reading": 0.0}
    scan = simulate_contacts(record_loads=True, load_scatter=0.02, seed=seed, **options)
    each = np.sort(scan.normal_load, axis=None)
    contacts = memscal.indent(LINEAR_FILM.expected, PAPER_SPHERE, load=each, friction=0.15)
    solved = {contact.load: contact for contact in contacts}
    away = np.abs(scan.x - 0.14e-3)
    expected = np.empty_like(scan.u_zz)
    for place, load in np.ndenumerate(scan.normal_load):
        one = blurred_stress([solved[float(load)]], memscal.GaussianMixture(), away[place[1]])
        expected[place] = 1e-7 * float(one[0])
    nominal = simulate_contacts(load_scatter=0.0, **options)
    # What the scatter did is met to a hundredth of what it did, and to the solver's own 1e-4.
    top = expected.max(axis=1, keepdims=True)
    assert np.abs(expected - nominal.u_zz).max() > 3e-3 * top.min()
    assert np.all(np.abs(scan.u_zz - expected) < 3e-4 * top)


def test_a_scan_is_that_of_its_contacts_at_the_nominal_loads():
    law = memscal.Interface(slip_length=3e-6)
    scan = simulate_contacts(load=1.37, friction=0.8, interface=law, points=17, **EXACT)
    contact = memscal.indent(
        LINEAR_FILM.expected, PAPER_SPHERE, load=1.37, friction=0.8, interface=law
    )
    r = np.linspace(0, 30e-3, 3001)
    profile = contact.base_stress(r)
    # The blurred stress at a place, as an integral over the plane around it.
    x, y = np.meshgrid(np.linspace(-3.5e-3, 3.5e-3, 141), np.linspace(-3.5e-3, 3.5e-3, 141))
    weight = memscal.GaussianMixture().radial(np.hypot(x, y)) * (x[0, 1] - x[0, 0]) ** 2
    for i in (3, 8, 11):
        stress = np.interp(np.hypot(scan.x[i] - 0.14e-3 + x, y), r, profile)
        assert scan.u_zz[i] == pytest.approx(1e-7 * float(np.sum(weight * stress)), rel=1e-4)


@pytest.mark.parametrize(
    ("options", "error", "problem"),
    [
        ({"load": []}, InputError, "loads has shape"),
        ({"load": [0.3, 0.3]}, InputError, "given twice"),
        ({"load": 1e12}, DomainError, "load|film"),
        ({"points": 1}, InputError, "two contacts"),
        ({"repeats": 0}, InputError, "one row"),
        ({"load_scatter": 0.5}, InputError, "load_scatter is 0.5"),
        ({"load_reading": -0.1}, InputError, "load_reading"),
        ({"load_scale": 0.0}, InputError, "load_scale"),
        ({"position_error": -1e-6}, InputError, "position_error"),
        ({"lubrication": "wet"}, InputError, "lubrication"),
        ({"lubrication": "dry", "lubricant": "oil"}, InputError, "lubricant"),
        ({"kernel": 561e-6}, InputError, "transform"),
    ],
)
def test_what_cannot_be_scanned_is_refused(options, error, problem):
    with pytest.raises(error, match=problem):
        simulate_contacts(**{"load": [0.34], **options})


FEW = {"loads": [0.69], "lubricated_loads": [0.69], "points": 9, "spacing": 2e-3}
NOMINAL = Reality(film=PAPER_FILM, rod=PAPER_ROD, sphere=PAPER_SPHERE)
UNCERTAIN = (
    "film.young_modulus",
    "film.poisson_ratio",
    "film.thickness",
    "rod.radius",
    "sphere.radius",
)


def test_the_scans_of_one_seed_share_no_noise():
    options = {**FEW, "friction": 0.0, "load_scatter": 0.0, "position_error": 0.0}
    noisy = simulate_experiment(**options, noise=0.01)
    still = simulate_experiment(**options, noise=0.0)
    dry, lubricated = (
        getattr(noisy, name).u_zz - getattr(still, name).u_zz for name in ("dry", "lubricated")
    )
    np.testing.assert_allclose(still.dry.u_zz, still.lubricated.u_zz, rtol=1e-12)
    assert np.abs(dry - lubricated).min() > 0
    again = simulate_experiment(**options, noise=0.01, seed=1)
    assert np.abs(again.dry.u_zz - noisy.dry.u_zz).min() > 0


def test_what_is_drawn_scatters_as_it_is_stated():
    stated = memscal.Disturbances(load_uncertainty=0.01)
    draws = [drawn(NOMINAL, stated, seed) for seed in range(2000)]
    sampled = {}
    for place in UNCERTAIN:
        record, name = place.split(".")
        nominal = getattr(NOMINAL, record)
        found = np.array([getattr(getattr(one, record), name) for one in draws])
        u = getattr(nominal, f"{name}_uncertainty")
        sampled[place] = (found - getattr(nominal, name)) / u
    for name in ("rod_load_scale", "load_scale"):
        sampled[name] = (np.array([getattr(one, name) for one in draws]) - 1) / 0.01
    low, high = chi2.ppf([RARE, 1 - RARE], len(draws))
    for name, values in sampled.items():
        assert low < np.sum(np.square(values)) < high, name
    assert max(sampled.pop("film.poisson_ratio")) <= 0
    own = np.array([*sampled.values()])
    assert np.all(np.abs(own.mean(axis=1)) < 6 / np.sqrt(len(draws)))
    assert np.abs(np.corrcoef(own) - np.eye(len(own))).max() < 6 / np.sqrt(len(draws))


def test_the_files_state_the_nominal_values_and_the_voltages_are_of_the_true_ones():
    found = simulate_experiment(**FEW, **EXACT, draw_inputs=True, seed=3)
    told = truth(found.dry)
    rod = truth(found.rod)
    names = ("young_modulus", "poisson_ratio", "thickness")
    for name in names:
        assert told[name] == rod[name] != getattr(PAPER_FILM, name)
        assert getattr(found.dry.film, name) == getattr(PAPER_FILM, name)
    assert (found.dry.indenter, found.rod.indenter) == (PAPER_SPHERE, PAPER_ROD)
    assert (found.dry.load, found.rod.load) == (0.69, 1.0)
    np.testing.assert_array_equal(found.dry.normal_load, np.full(9, 0.69))
    assert found.rod.load_uncertainty == pytest.approx(0.01)
    assert told["load_1"] == pytest.approx(0.69 * told["load_scale"])
    film = replace(PAPER_FILM, **{name: told[name] for name in names})
    film = replace(film, poisson_ratio_uncertainty=None)
    sphere = memscal.Sphere(radius=told["indenter_radius"])
    again = simulate_contacts(
        film=film,
        sphere=sphere,
        load=[told["load_1"]],
        friction=0.2,
        points=9,
        spacing=2e-3,
        **EXACT,
    )
    np.testing.assert_allclose(found.dry.u_zz, again.u_zz, rtol=1e-9)
    pressed = simulate(
        film=film,
        rod=memscal.Rod(radius=rod["indenter_radius"]),
        load=rod["load_1"],
        **STILL,
    )
    np.testing.assert_allclose(found.rod.u_zz, pressed.u_zz, rtol=1e-12)


def test_a_lubricated_contact_keeps_the_normal_compliance_of_its_surface():
    normal = memscal.ExponentialCompliance(decay_length=1e-6, reference_pressure=1e6)
    law = memscal.Interface(normal=normal, slip_length=2e-6)
    found = simulate_experiment(**FEW, load_scatter=0.0, friction=0.3, interface=law)
    dry = truth(found.dry)
    lubricated = truth(found.lubricated)
    assert (dry["slip_length"], dry["decay_length"]) == (2e-6, 1e-6)
    assert "slip_length" not in lubricated
    assert lubricated["decay_length"] == 1e-6


@pytest.mark.parametrize(("options", "problem"), [
    ({"gain": 0.0}, "gain is 0"), ({"thickness_factor": -1.0}, "thickness_factor"),
    ({"seed": -1}, "seed is -1"),
])  # fmt: skip
def test_an_experiment_that_cannot_be_made_is_refused(options, problem):
    with pytest.raises(InputError, match=problem):
        simulate_experiment(**{**FEW, **options})
