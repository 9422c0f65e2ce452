"""Virtual experiments whose interface is known: which law is preferred, and its slip length.

They run with MEMSCAL_FULL_STUDY, 40 of each kind; each day draws voltages of known contacts in
tests/extensions/interface_laws/test_compliance.py.  All inputs
are drawn from their stated uncertainties.  An experiment like the paper's does not tell a slip
length to better than a factor; *precise* ones, of less noise, with loads that are recorded and with
more repeats, do; those on a film that is *known* better than the paper's do within 20 %.
"""

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.scans import simulate_experiment
from scipy.stats import binom

import memscal
from memscal import Interface
from memscal.extensions.interface_laws.families import elasto_plastic_family
from memscal.extensions.interface_laws.model_comparison import compare_interface
from memscal.extensions.simulation.contact_scan import PAPER_LOADS, PAPER_SPHERE
from memscal.extensions.simulation.rod_scan import PAPER_FILM
from memscal.friction import calculated

pytestmark = pytest.mark.full_study

SEEDS = 40
CHANCE = 1e-3
MACROSCOPIC = 1.6
SLIP_LENGTH = 16e-6
_REACH = 12e-3

PRECISE = {
    "noise": 0.001,
    "record_loads": True,
    "load_reading": 0.002,
    "position_error": 2e-6,
    "repeats": 9,
}
KINDS = {
    "paper": {"noise": 0.003, "repeats": 3},
    "precise": PRECISE,
    "known": {**PRECISE, "load_uncertainty": 0.003},
}
KNOWN_FILM = replace(
    PAPER_FILM,
    young_modulus_uncertainty=0.005 * PAPER_FILM.young_modulus,
    thickness_uncertainty=0.0025 * PAPER_FILM.thickness,
    poisson_ratio_uncertainty=0.001,
)


@lru_cache
def rigid(film):
    """Contacts of the paper's sphere at the paper's loads: the same for every experiment."""
    return calculated.amontons_family(film, PAPER_SPHERE, PAPER_LOADS, reach=_REACH)


@lru_cache
def slipping(film):
    return elasto_plastic_family(
        film, PAPER_SPHERE, PAPER_LOADS, friction=MACROSCOPIC, reach=_REACH
    )


@lru_cache
def weighed(friction, slip_length, kind, seed):
    """Make, calibrate and measure one experiment, and weigh laws of its dry interface."""
    interface = Interface(slip_length=slip_length) if slip_length else None
    film = KNOWN_FILM if kind == "known" else PAPER_FILM
    contact = {"film": film, "friction": friction, "interface": interface}
    # Every kind of experiment has seeds of its own: shared ones would be unlucky together.
    seed += round(1e5 * friction + 1e9 * slip_length) * 1000 + 250 * list(KINDS).index(kind)
    made = simulate_experiment(draw_inputs=True, seed=seed, **contact, **KINDS[kind])
    apparatus = memscal.calibrate(made.rod, method="evidence").apparatus
    profiles = memscal.measure_stress([made.dry], apparatus).profiles
    families = {"amontons": rigid(film), "slipping": slipping(film)}
    found = compare_interface(profiles, apparatus, macroscopic=MACROSCOPIC, **families).tangential
    assert found is not None
    return found


def experiments(friction, slip_length=0.0, kind="precise"):
    return [weighed(friction, slip_length, kind, seed) for seed in range(SEEDS)]


def enough(share):
    """Fewest successes that chance allows of a share."""
    return int(binom.ppf(CHANCE, SEEDS, share))


@pytest.mark.parametrize("kind", ["precise", "known"])
def test_a_slip_length_is_preferred_where_it_is_the_truth(kind):
    found = experiments(MACROSCOPIC, SLIP_LENGTH, kind)
    assert sum(one.yielding_preferred for one in found) >= enough(0.98)


def test_an_effective_coefficient_is_not_given_up_where_it_is_the_truth():
    for friction in (0.1, 0.2):
        found = experiments(friction, kind="precise")
        assert sum(not one.yielding_preferred for one in found) >= enough(0.98)


def test_on_a_known_film_the_slip_length_is_recovered_within_a_fifth():
    found = experiments(MACROSCOPIC, SLIP_LENGTH, "known")
    ratios = np.array([one.length.best for one in found]) / SLIP_LENGTH
    assert np.sum(np.abs(ratios - 1) <= 0.20) >= enough(0.95)
    assert sum(one.length.interval.holds(SLIP_LENGTH) for one in found) >= enough(0.93)
    # They scatter by 8 %.
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.03 + 3.3 * 0.08 / math.sqrt(SEEDS))


def test_on_a_film_known_as_the_papers_it_is_recovered_most_often():
    # Stated: 10 %.  The spread over experiments is 13.5 %, as the contacts are linearised about the
    # stated film: docs/interface.md.
    found = experiments(MACROSCOPIC, SLIP_LENGTH)
    ratios = np.array([one.length.best for one in found]) / SLIP_LENGTH
    assert np.sum(np.abs(ratios - 1) <= 0.20) >= enough(0.75)
    assert np.sum(np.abs(ratios - 1) <= 0.35) >= enough(0.95)
    assert np.median(ratios) == pytest.approx(1.0, abs=0.12 + 0.2 / math.sqrt(SEEDS))


def test_an_experiment_like_the_papers_tells_a_slip_length_at_best_by_a_factor():
    wide = 0
    for one in experiments(MACROSCOPIC, 1.82e-6, "paper"):
        interval = one.length.interval
        high = math.inf if interval.high is None else interval.high
        wide += high > 3 * max(interval.low, 0.2e-6)
    assert wide >= enough(0.95)
