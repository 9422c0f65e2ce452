"""Friction from whole virtual experiments: how often its interval holds the truth.

Each experiment is a rod scan and the scans of a sphere, dry and lubricated, with noise, scatter of
loads and positions, and film, radii and loads drawn from their uncertainties.  Its contacts are
solved with rings that are refined load by load, those of the analysis with 56.  Set
MEMSCAL_FULL_STUDY for the 400 seeds and four coefficients of docs/accuracy.md in place of 12 and
two, by which a coverage of 70 % is found; tests/friction/test_effective.py counts that of drawn
voltages by the hundred.
"""

import math
from dataclasses import dataclass
from functools import cache, cached_property

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.scans import simulate_experiment
from scipy.stats import binom, kstest, t

import memscal
from memscal import FrictionComparison
from memscal.extensions.simulation.contact_scan import PAPER_LOADS, PAPER_SPHERE
from memscal.extensions.simulation.rod_scan import PAPER_FILM
from memscal.friction.calculated import amontons_family
from memscal.friction.compare import channels_of, compare_measured
from memscal.friction.effective import fit_friction, fit_together

SEEDS = 400 if FULL else 12
FEW = 50 if FULL else 3  # of coefficients that no interval is counted at
FRICTIONS = (0.0, 0.1, 0.2) if FULL else (0.0, 0.2)
CHANCE = 1e-3 if FULL else 1e-2


@dataclass(frozen=True)
class Outcome:
    """What one virtual experiment found, beside its true friction coefficient."""

    truth: float
    comparison: FrictionComparison
    apparatus: memscal.ApparatusFunction

    @property
    def joint(self):
        return self.comparison.joint["dry"]["incremental"]

    @cached_property
    def apart(self):
        """The same with the lubricated loads by themselves."""
        measured = self.comparison.measured
        channels = channels_of(measured, self.apparatus, families())
        fits = {loading: fit_friction(channel) for loading, channel in channels.items()}
        return fit_together(measured, fits)["dry"]["incremental"]

    @property
    def readings(self):
        """Intervals of single dry loads, by both readings."""
        loads = [c for c in self.comparison.loads["incremental"] if c.lubrication == "dry"]
        return [reading for c in loads for reading in (c.by_profile, c.by_maximum)]

    def failed(self):
        """Names of the checks that failed, without their numbers."""
        names = {check.name for check in self.comparison.checks if not check.passed}
        return {name.rstrip("0123456789").rstrip("_") for name in names}


@cache
def families():
    """Contacts of the paper's sphere at the paper's loads: the same for every experiment."""
    return {"incremental": amontons_family(PAPER_FILM, PAPER_SPHERE, PAPER_LOADS, reach=24e-3)}


@cache
def outcome(friction, seed, gain=1.0, thickness=1.0):
    """Make, calibrate, measure and compare one experiment, all inputs drawn."""
    mistakes = {"gain": gain, "thickness_factor": thickness}
    # Every coefficient has seeds of its own: shared ones would be unlucky together.
    own = 1000 * round(100 * min(friction, 9.0)) + seed
    made = simulate_experiment(friction=friction, draw_inputs=True, seed=own, **mistakes)
    apparatus = memscal.calibrate(made.rod, method="evidence").apparatus
    measured = memscal.measure_stress([made.dry, made.lubricated], apparatus)
    # Lubricated contacts are made without friction, and all scans with one gain.
    held = {"lubricated_friction": 0.0, "between_scan_gain": 0.0}
    return Outcome(friction, compare_measured(measured, apparatus, families(), **held), apparatus)


def outcomes(*frictions, **mistakes):
    return [
        outcome(mu, seed, **mistakes)
        for mu in frictions
        for seed in range(SEEDS if mu in FRICTIONS else FEW)
    ]


def at_least(count, of, share):
    """Whether a count is not too small for a share, but for chance."""
    return count >= binom.ppf(CHANCE, of, share)


@pytest.mark.parametrize("beside", [True, False])
def test_the_interval_of_all_loads_holds_the_truth_and_misses_on_both_sides(beside):
    # Lubricated loads beside the dry ones, or apart.
    found = [(one.truth, one.joint if beside else one.apart) for one in outcomes(*FRICTIONS)]
    assert all(bool(joint.beside) == beside for _, joint in found)
    held = [joint.interval.holds(truth) for truth, joint in found]
    low, high = binom.ppf([CHANCE, 1 - CHANCE], len(held), [0.93, 0.98])
    assert low <= sum(held) <= high
    for missed in (
        [j.interval.low > truth for truth, j in found],
        [j.interval.upper < truth for truth, j in found],
    ):
        assert sum(missed) <= binom.ppf(1 - CHANCE, len(missed), 0.04)


@pytest.mark.parametrize("friction", [mu for mu in FRICTIONS if mu > 0])
def test_the_coefficient_is_right_on_average(friction):
    pairs = [(one.joint.best, one.joint.standard_uncertainty) for one in outcomes(friction)]
    error = np.array([(best - friction) / u for best, u in pairs if u])
    assert abs(error.mean()) < 0.15 + t.isf(CHANCE / 2, error.size - 1) * error.std(
        ddof=1
    ) / math.sqrt(error.size)


@pytest.mark.parametrize("friction", FRICTIONS)
def test_no_coefficient_is_left_out(friction):
    intervals = [one.joint.interval for one in outcomes(friction)]
    held = [interval.holds(friction) for interval in intervals]
    assert at_least(sum(held), len(held), 0.90)
    # Other frictions are excluded; larger ones only where the contact does not stick nearly whole.
    told = [
        i.low > friction - 0.15 and (friction > 0.1 or i.upper < friction + 0.1) for i in intervals
    ]
    assert at_least(sum(told), len(told), 0.90)


def test_the_intervals_of_single_loads_hold_the_truth():
    # Loads of one experiment share their systematic errors: the experiment is the unit.
    held = np.array(
        [
            [reading.interval.holds(one.truth) for reading in one.readings]
            for one in outcomes(*FRICTIONS)
        ]
    )
    assert held.mean() > 0.92 - 4 * held.mean(axis=1).std() / math.sqrt(len(held))
    found = [*outcomes(0.3), *outcomes(0.0)[:FEW]]
    confused = [r.interval.holds(0.3 - one.truth) for one in found for r in one.readings]
    assert np.mean(confused) < 0.15


def test_full_stick_is_a_lower_bound_and_no_number():
    found = outcomes(1.0)
    bounds = [one.joint for one in found if one.joint.value is None]
    assert at_least(len(bounds), len(found), 0.94)
    for bound in bounds:
        assert bound.interval.high is None
        assert bound.reason
    assert np.median([bound.interval.low for bound in bounds]) > 0.15


def test_lubricated_contacts_reach_no_friction():
    found = outcomes(*FRICTIONS)
    intervals = [one.comparison.joint["lubricated"]["incremental"].interval for one in found]
    reached = [interval.low == 0 for interval in intervals]
    assert at_least(sum(reached), len(reached), 0.94)
    assert np.median([interval.upper for interval in intervals]) < 0.08


def test_chi_square_is_as_large_as_its_degrees_say():
    assert kstest([one.joint.p_value for one in outcomes(*FRICTIONS)], "uniform").pvalue > CHANCE


def test_dry_and_lubricated_differ_where_there_is_friction_only():
    def apart(friction):
        pairs = [one.comparison.dry_against_lubricated for one in outcomes(friction)]
        return [pair.p_value < 0.05 for both in pairs for pair in both]

    same = apart(0.0)
    assert sum(same) <= binom.ppf(1 - CHANCE, len(same), 0.05)
    assert np.mean(apart(0.3)) > 0.9


def test_checks_of_friction_pass_where_nothing_is_wrong():
    found = outcomes(*FRICTIONS)
    # What moves the dry coefficient by its uncertainty is found, and one of ten times by chance.
    for names, share in (
        ({"profile_chi_square", "bracketing"}, 0.05),
        ({"lubricated_frictionless"}, 0.1),
    ):
        failing = [bool(names & one.failed()) for one in found]
        assert sum(failing) <= binom.ppf(1 - CHANCE, len(failing), share)


@pytest.mark.full_study
def test_a_mistake_that_sensor_and_film_share_cancels_beside_lubricated_loads():
    seeds = range(min(SEEDS, 16))

    def shifts(**mistakes):
        """Median change of the coefficient, dry loads apart, and beside the lubricated ones."""
        pairs = [(outcome(0.1, seed, **mistakes), outcome(0.1, seed)) for seed in seeds]
        apart = np.median([wrong.apart.best - clean.apart.best for wrong, clean in pairs])
        return float(apart), float(np.median([w.joint.best - c.joint.best for w, c in pairs]))

    for mistakes, sign in (({"gain": 1.05}, 1), ({"thickness": 1.05}, -1)):
        apart, beside = shifts(**mistakes)
        assert sign * apart > 0.008
        assert abs(beside) < abs(apart) / 3
