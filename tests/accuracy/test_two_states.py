"""Friction between two states: what dry and lubricated scans do not share, and a friction of both.

Each experiment is a rod scan and two scans of a sphere, each with a gain and a load of its own; the
lubricated contacts may slide with friction.  Its contacts are solved with rings that are refined
load by load, those of the analysis with 56.  Set MEMSCAL_FULL_STUDY for more seeds.
"""

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from typing import Any

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square_limit
from scipy.stats import binom

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
