"""Friction between two states: what dry and lubricated scans do not share, and a friction of both.

Each experiment is a rod scan and two scans of a sphere, each with a gain and a load of its own; the
lubricated contacts may slide with friction.  Its contacts are solved with rings that are refined
load by load, those of the analysis with 56.  Set MEMSCAL_FULL_STUDY for more seeds.
"""

from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square_limit
from scipy.stats import binom, chi2

import memscal
from memscal.extensions.simulation.contact_scan import PAPER_LOADS, PAPER_SPHERE, simulate_contacts
from memscal.extensions.simulation.experiment import Reality, drawn
from memscal.extensions.simulation.rod_scan import PAPER_FILM, PAPER_ROD
from memscal.friction.calculated import amontons_family
from memscal.friction.compare import compare_measured
from memscal.friction.family import ProfileFamily
from memscal.friction.results import FrictionComparison
from memscal.model.instrument import LoadCell

pytestmark = pytest.mark.accuracy

SEEDS = 40 if FULL else 6
CHANCE = 1e-3
FRICTION = 0.1
LUBRICATED = (0.0, 0.02, 0.04)
SHARE = 0.01  # of loads, as the scans state it
GAIN = 0.005  # between scans, as it is counted
CONVERSION = 1e-7


@cache
def families() -> dict[str, ProfileFamily]:
    """Contacts of the paper's sphere at the paper's loads: the same for every experiment."""
    return {"incremental": amontons_family(PAPER_FILM, PAPER_SPHERE, PAPER_LOADS, reach=24e-3)}


@cache
def compared(
    lubricated: float,
    seed: int,
    *,
    draw: bool = False,
    gain: float = 1.0,
    load: float = 1.0,
    **options: Any,
) -> FrictionComparison:
    """Make and compare an experiment; gain and load are those of the lubricated scan."""
    stated = Reality(film=PAPER_FILM, rod=PAPER_ROD, sphere=PAPER_SPHERE)
    true = stated
    gains = np.array([1.0, gain])
    loads = np.array([1.0, load])
    rod_load = 1.0
    if draw:
        true = drawn(stated, SHARE, seed)
        rng = np.random.default_rng([seed, 35])
        gains = gains + rng.normal(0.0, GAIN, 2)
        loads = loads + rng.normal(0.0, SHARE, 2)
        rod_load = true.rod_load_scale
    rod = memscal.simulate(film=true.film, rod=true.rod, load=rod_load, seed=1000 + seed)
    nominal = {"film": PAPER_FILM, "load_cell": LoadCell()}
    rod = replace(rod, load=1.0, load_uncertainty=SHARE, indenter=PAPER_ROD, **nominal)
    scans = []
    of = {"dry": (PAPER_LOADS, FRICTION), "lubricated": (PAPER_LOADS, lubricated)}
    for i, (state, (pressed, friction)) in enumerate(of.items()):
        scan = simulate_contacts(
            film=true.film,
            sphere=true.sphere,
            conversion_constant=CONVERSION * gains[i],
            load=pressed,
            load_scale=loads[i],
            friction=friction,
            lubrication=state,
            seed=2 * seed + i,
        )
        scans.append(replace(scan, indenter=PAPER_SPHERE, **nominal))
    sensor = memscal.calibrate(rod, method="evidence").apparatus
    measured = memscal.measure_stress(scans, sensor)
    return compare_measured(measured, sensor, families(), **options)


def deviations(comparisons: list[FrictionComparison]) -> np.ndarray:
    """Errors over standard uncertainties of the dry coefficients."""
    joint = [one.joint["dry"]["incremental"] for one in comparisons]
    return np.array([(one.value - FRICTION) / one.standard_uncertainty for one in joint])


def held(comparisons: list[FrictionComparison]) -> int:
    joint = [one.joint["dry"]["incremental"] for one in comparisons]
    return sum(one.interval.holds(FRICTION) for one in joint)


#: A lubricated friction, or a gain or load of the lubricated scan, that nothing states.
PERTURBED = (
    {"lubricated": 0.0},
    {"lubricated": 0.02},
    {"lubricated": 0.04},
    {"lubricated": 0.0, "gain": 1.01},
    {"lubricated": 0.0, "load": 1.02},
)


def root_mean_square(z: np.ndarray) -> float:
    return float(np.sqrt(np.mean(z**2)))


def test_what_the_two_states_do_not_share_is_counted() -> None:
    def of_seeds(perturbed: dict[str, float]) -> np.ndarray:
        return deviations([compared(seed=seed, **perturbed) for seed in range(SEEDS)])

    z = np.concatenate([of_seeds(perturbed) for perturbed in PERTURBED])
    assert root_mean_square(z) < root_mean_square_limit(1.4, SEEDS, CHANCE)


def test_the_uncertainty_of_equal_states_stays_small() -> None:
    joint = [compared(0.0, seed).joint["dry"]["incremental"] for seed in range(SEEDS)]
    assert np.mean([one.standard_uncertainty for one in joint]) <= 0.013


@pytest.mark.parametrize("lubricated", LUBRICATED[:2])
def test_the_interval_holds_where_gains_and_loads_are_drawn(lubricated: float) -> None:
    # A lubricated friction of 0.04, 2.7 widths of its prior, it does not: docs/friction.md.
    found = [compared(lubricated, seed, draw=True) for seed in range(SEEDS)]
    assert held(found) >= binom.ppf(CHANCE, SEEDS, 0.93)
    low, high = np.sqrt(chi2.ppf([CHANCE, 1 - CHANCE], SEEDS) / SEEDS)
    assert 0.7 * low < root_mean_square(deviations(found)) < 1.3 * high
