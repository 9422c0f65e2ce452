"""The restored stress over many noise draws and contacts: its error, and the truth of its band.

Set MEMSCAL_FULL_STUDY for 40 seeds a case and three noises in place of 3 and two.  Neighbouring
radii of one scan share their error: the scan, not the radius, is the unit of every bound.
"""

from dataclasses import replace
from functools import lru_cache, partial

import numpy as np
import pytest
from helpers import scans as made
from helpers.bounds import FULL
from helpers.scans import GAUSSIAN, RING, TAILS, plane_error, pressed
from scipy.stats import binom, chi2

import memscal
from memscal.measurement import posterior

SEEDS, NOISES = (40, (0.002, 0.005, 0.01)) if FULL else (3, (0.002, 0.01))
SIGMAS = 4.0
CHANCE = 1e-4
REACH = 6e-3
RUBBER = replace(made.EXACT_FILM, law="neo-hookean")

COMPRESSIBLE, NEARLY = (replace(made.EXACT_FILM, poisson_ratio=nu) for nu in (0.3, 0.45))
STIFF = replace(made.EXACT_FILM, young_modulus=4e6, poisson_ratio=0.4)
THIN, THICK = (replace(made.EXACT_FILM, thickness=h) for h in (1.4e-3, 3e-3))
SMALL, MIDDLE, LARGE = (memscal.Sphere(radius=radius) for radius in (50e-3, 80e-3, 300e-3))
FLAT, STEEP = (memscal.Cone(inclination=angle) for angle in (0.035, 0.07))


def at_once(load, indenter=made.SPHERE):
    """Press in one step, so that all of the contact sticks."""
    return memscal.indent(made.EXACT_FILM, indenter, load=load, friction=np.inf, loading="total")


CHOSEN_ON = {
    "light": (partial(pressed, 0.34), GAUSSIAN),
    "middle": (partial(pressed, 1.0), GAUSSIAN),
    "heavy": (partial(pressed, 2.75), GAUSSIAN),
    "sticking, light": (partial(pressed, 0.34, np.inf), GAUSSIAN),
    "sticking, heavy": (partial(pressed, 2.75, np.inf), GAUSSIAN),
    "at once": (partial(at_once, 2.75), GAUSSIAN),
    "compressible": (partial(pressed, film=COMPRESSIBLE), GAUSSIAN),
    "nearly incompressible": (partial(pressed, film=NEARLY), GAUSSIAN),
    "ring": (pressed, RING),
    "tails": (pressed, TAILS),
    "cone": (partial(pressed, indenter=FLAT), GAUSSIAN),
    "thin rod": (partial(pressed, indenter=memscal.Rod(radius=0.25e-3)), GAUSSIAN),
    "deep rod": (partial(pressed, 0.3, np.inf, film=RUBBER, indenter=made.EXACT_ROD), GAUSSIAN),
    "wide rod": (partial(pressed, indenter=memscal.Rod(radius=2.5e-3)), GAUSSIAN),
}
"""Contacts on which the strength of a pressure's departures was chosen; that choice alone is tested
on them."""

CASES = {
    "small sphere": (partial(pressed, 0.6, indenter=SMALL), GAUSSIAN),
    "large sphere": (partial(pressed, 1.8, indenter=LARGE), GAUSSIAN),
    "slipping": (partial(pressed, 2.0, 0.15, indenter=MIDDLE), GAUSSIAN),
    "sticking": (partial(pressed, 1.2, np.inf, indenter=MIDDLE), GAUSSIAN),
    "at once": (partial(at_once, 1.2, memscal.Sphere(radius=0.2)), GAUSSIAN),
    "cone": (partial(pressed, 0.5, indenter=STEEP), GAUSSIAN),
    "thin film": (partial(pressed, 0.8, film=THIN), GAUSSIAN),
    "thick film": (partial(pressed, 1.5, film=THICK), GAUSSIAN),
    "stiff film": (partial(pressed, 1.7, np.inf, film=STIFF), GAUSSIAN),
    "disc": (
        partial(pressed, 0.8, indenter=MIDDLE),
        memscal.SmoothedDisc(radius=0.8e-3, sigma=0.2e-3),
    ),
    "ring": (
        partial(pressed, 2.0, np.inf),
        memscal.GaussianMixture((1.25, -0.25), (0.7e-3, 0.35e-3)),
    ),
    "rod": (partial(pressed, 0.5, indenter=memscal.Rod(radius=0.6e-3)), GAUSSIAN),
    "wide rod": (partial(pressed, indenter=memscal.Rod(radius=1.5e-3)), GAUSSIAN),
    "deep rod": (
        partial(pressed, 0.5, np.inf, film=RUBBER, indenter=memscal.Rod(radius=0.35e-3)),
        GAUSSIAN,
    ),
}
"""Contacts of other loads, radii, films and sensors, on which everything else is tested."""


@lru_cache
def study(case, noise):
    """Of each seed: share of radii within 95 % bounds, error, stated error, z of the force."""
    # Every case and noise has draws of its own: shared ones would be unlucky together.
    press, kernel = CASES[case]
    place = list(CASES).index(case) * len(NOISES) + NOISES.index(noise)
    return drawn(press(), kernel, noise, place)


def drawn(contact, kernel, noise, place):
    sensor = replace(made.known_apparatus(kernel), film=contact.film)
    seeds = range(1000 * place, 1000 * place + SEEDS)
    scans = (made.sphere_scan(contact, kernel=kernel, noise=noise, seed=s) for s in seeds)
    return np.array([outcome(memscal.restore(scan, sensor), contact) for scan in scans])


def outcome(found, contact):
    r = found.r[found.r <= REACH]
    stress = found.stress(r)
    errors = found.stress_uncertainty(r)
    truth = contact.base_stress(r)
    within = np.mean(np.abs(stress - truth) <= 1.96 * errors)
    stated = plane_error(r, truth + errors, truth)
    z = (found.force - contact.load) / found.force_uncertainty
    return float(within), plane_error(r, stress, truth), stated, z


def everything():
    return np.concatenate([study(case, noise) for case in CASES for noise in NOISES])


def test_the_band_holds_the_truth_as_often_as_it_says():
    within = everything()[:, 0]
    allowed = SIGMAS * within.std() / np.sqrt(within.size)
    assert 0.93 - allowed < within.mean() < 0.98 + allowed


@pytest.mark.full_study
def test_departures_are_as_strong_as_was_chosen_on_other_contacts(
    monkeypatch,
):
    # The rule: the strongest of 1, 0.5, 0.4, 0.3, 0.2 and 0.1 that holds at most 98 %.  0.5 does so
    # within chance: docs/restoration.md.
    cases = [(press(), kernel, n) for press, kernel in CHOSEN_ON.values() for n in NOISES]

    def within():
        return np.concatenate([drawn(*case, 500 + i)[:, 0] for i, case in enumerate(cases)])

    chosen = within()
    monkeypatch.setattr(posterior, "_SMALLER", 1.0)
    assert chosen.mean() < 0.98 + SIGMAS * chosen.std() / np.sqrt(chosen.size)
    assert within().mean() > 0.98


@pytest.mark.parametrize("case", CASES)
def test_no_contact_is_left_out_of_the_band_or_has_another_error_than_stated(case):
    found = np.concatenate([study(case, noise) for noise in NOISES])
    within = found[:, 0]
    assert within.mean() > 0.90 - SIGMAS * within.std() / np.sqrt(within.size)
    error, stated = np.mean(found[:, 1:3] ** 2, axis=0)
    assert 0.3 < np.sqrt(error / stated) < 1.5


def test_over_all_contacts_the_error_is_two_thirds_of_what_is_stated_or_more():
    ratios = everything()[:, 1] / everything()[:, 2]
    spread = np.std(ratios**2) / np.sqrt(ratios.size)
    assert np.mean(ratios**2) > (2 / 3) ** 2 - SIGMAS * spread


def test_the_error_falls_with_the_noise():
    for case in CASES:
        errors = [np.median(study(case, noise)[:, 1]) for noise in NOISES]
        assert errors == sorted(errors)
        assert errors[0] < 0.01


def test_the_force_is_the_load_as_often_as_it_says():
    z = everything()[:, 3]
    assert np.sum(np.abs(z) <= 1.96) >= binom.ppf(CHANCE, z.size, 0.92)
    # Shapes that no contact has are allowed for: errors are three quarters of what is stated.
    assert np.mean(z**2) > 0.65**2 * chi2.ppf(CHANCE, z.size) / z.size


@pytest.mark.parametrize("kernel", [GAUSSIAN, RING], ids=["gaussian", "ring"])
def test_the_uncertainty_of_a_calibrated_sensor_is_counted(kernel):
    outcomes = []
    for seed in range(2 * SEEDS):
        rod = made.simulated(kernel=kernel, noise=0.01, seed=500 + seed, load_uncertainty=None)
        sensor = memscal.calibrate(rod, method="evidence").apparatus
        contact = pressed((0.34, 1.0, 2.75)[seed % 3], (0.0, np.inf)[seed % 2])
        scan = made.sphere_scan(contact, kernel=kernel, noise=0.003, seed=seed)
        outcomes.append(outcome(memscal.restore(scan, sensor), contact))
    within, error, stated, _ = np.transpose(outcomes)
    assert within.mean() > 0.92 - SIGMAS * within.std() / np.sqrt(within.size)
    assert 0.3 < np.sqrt(np.mean(error**2) / np.mean(stated**2)) < 1.5
