"""Virtual experiments from the calibration to the friction coefficient, their truth known."""

from __future__ import annotations

import os
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

import memscal
from memscal.friction.calculated import amontons_family
from memscal.friction.compare import compare_measured
from memscal.friction.family import ProfileFamily
from memscal.friction.results import FrictionComparison
from memscal.simulation.contact_scan import PAPER_LOADS, PAPER_SPHERE
from memscal.simulation.rod_scan import PAPER_FILM

FULL = bool(os.environ.get("MEMSCAL_FULL_STUDY"))
SEEDS = 50 if FULL else 3
FRICTIONS = (0.0, 0.1, 0.2, 0.3) if FULL else (0.0, 0.3)
CHANCE = 1e-3
REACH = 24e-3


@dataclass(frozen=True)
class Outcome:
    """What one virtual experiment found, beside its true friction coefficient."""

    truth: float
    found: FrictionComparison

    @property
    def joint(self) -> Any:
        return self.found.joint["dry"]["incremental"]

    @property
    def readings(self) -> list[Any]:
        """Intervals of single dry loads, by both readings."""
        loads = [c for c in self.found.loads["incremental"] if c.lubrication == "dry"]
        return [reading for c in loads for reading in (c.by_profile, c.by_maximum)]

    def failed(self) -> set[str]:
        """Names of the checks that failed, without their numbers."""
        names = {check.name for check in self.found.checks if not check.passed}
        return {name.rstrip("0123456789").rstrip("_") for name in names}


@lru_cache
def families() -> dict[str, ProfileFamily]:
    """Contacts of the paper's sphere at the paper's loads: the same for every experiment."""
    family = amontons_family(PAPER_FILM, PAPER_SPHERE, PAPER_LOADS, reach=REACH)
    return {"incremental": family}


@lru_cache
def outcome(friction: float, seed: int, gain: float = 1.0, thickness: float = 1.0) -> Outcome:
    """Make, calibrate, measure and compare one experiment, all inputs drawn."""
    made = memscal.simulate_experiment(
        friction=friction,
        draw_inputs=True,
        gain=gain,
        thickness_factor=thickness,
        # Every coefficient has seeds of its own: shared ones would be unlucky together.
        seed=1000 * round(100 * min(friction, 9.0)) + seed,
    )
    apparatus = memscal.calibrate(made.rod, method="evidence").apparatus
    measured = memscal.measure_stress([made.dry, made.lubricated], apparatus)
    return Outcome(friction, compare_measured(measured, apparatus, families()))


def outcomes(*frictions: float, **mistakes: float) -> list[Outcome]:
    return [outcome(mu, seed, **mistakes) for mu in frictions for seed in range(SEEDS)]


def share(flags: list[bool]) -> float:
    return float(np.mean(flags))
