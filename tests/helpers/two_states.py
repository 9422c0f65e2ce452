"""Experiments of friction in two states: a rod scan and two of a sphere, dry and lubricated.

Scans are those of helpers.outside and helpers.outside_sphere, which are not the package's.
"""

from dataclasses import dataclass, replace
from functools import cache
from typing import Any

import numpy as np
from helpers.outside import FILM, World
from helpers.outside import scan as rod_scan
from helpers.outside_sphere import LOAD, LOADS, SPHERE, Pressed, contacts

import memscal
from memscal import BoundedEstimate
from memscal.friction.calculated import amontons_family
from memscal.friction.compare import compare_measured
from memscal.friction.family import ProfileFamily

FRICTION = 0.1
GAIN = 0.005
STATES = ("rod", "dry", "lubricated")
#: Mean of a Poisson's ratio of 1/2 that is stated with its uncertainty.
MEAN_RATIO = FILM.expected.poisson_ratio


@dataclass(frozen=True)
class Outcome:
    """The dry coefficient of an experiment, and the checks that it fails."""

    dry: BoundedEstimate
    failed: tuple[str, ...]  # names of checks

    @property
    def deviation(self) -> float:
        """Error over standard uncertainty."""
        return (self.dry.value - FRICTION) / self.dry.standard_uncertainty

    @property
    def held(self) -> bool:
        return self.dry.interval.holds(FRICTION)


@cache
def families() -> dict[str, ProfileFamily]:
    """Contacts of the stated film and sphere: the same for every experiment."""
    return {"incremental": amontons_family(FILM, SPHERE, LOADS, reach=24e-3)}


def outcome(
    lubricated: float,
    seed: int,
    worlds: dict[str, dict[str, Any]],
    radius: float = SPHERE.radius,
    width=0.015,
    gain_uncertainty: float = GAIN,
    load_uncertainty: float = LOAD,
) -> Outcome:
    """Make and compare an experiment; ``worlds``: what each of its scans was made with.

    Stated are the width of the lubricated friction's prior, and relative standard uncertainties
    of the gain and load of each scan.
    """
    rod_world = dict(worlds["rod"])
    rod_world.pop("young_modulus", None)
    factor = rod_world.pop("gain", 1.0)
    rod = rod_scan(World(**rod_world), 10_000 + seed)
    rod = replace(rod, u_zz=factor * rod.u_zz)
    scans = []
    for state, friction in (("dry", FRICTION), ("lubricated", lubricated)):
        world = Pressed(radius=radius, friction=friction, **worlds[state])
        scan = contacts(world, seed, state)
        scans.append(replace(scan, load_uncertainty=load_uncertainty * scan.load))
    sensor = memscal.calibrate(rod, method="evidence").apparatus
    measured = memscal.measure_stress(scans, sensor)
    found = compare_measured(
        measured,
        sensor,
        families(),
        lubricated_friction=width,
        between_scan_gain=gain_uncertainty,
    )
    failed = tuple(check.name for check in found.checks if not check.passed)
    return Outcome(found.joint["dry"]["incremental"], failed)


@cache
def perturbed(lubricated: float, seed: int, gain=1.0, load=1.0, **stated: float) -> Outcome:
    """An experiment as stated but for its lubricated scan."""
    worlds = {state: {"poisson_ratio": MEAN_RATIO} for state in STATES}
    worlds["lubricated"] |= {"gain": gain, "load_scale": load}
    return outcome(lubricated, seed, worlds, **stated)


@cache
def drawn(lubricated: float, seed: int, width=0.015) -> Outcome:
    """An experiment whose film, sphere, gains and loads are drawn from what is stated."""
    rng = np.random.default_rng([seed, round(1000 * lubricated)])
    common = {
        "young_modulus": rng.normal(FILM.young_modulus, FILM.young_modulus_uncertainty),
        "thickness": rng.normal(FILM.thickness, FILM.thickness_uncertainty),
        "poisson_ratio": 0.5 - abs(rng.normal(0.0, FILM.poisson_ratio_uncertainty)),
    }
    radius = rng.normal(SPHERE.radius, SPHERE.radius_uncertainty)
    worlds = {
        state: common | {"gain": rng.normal(1.0, GAIN), "load_scale": rng.normal(1.0, LOAD)}
        for state in STATES
    }
    # The noise of each group is its own, too.
    own = 1000 * round(100 * lubricated) + seed
    return outcome(lubricated, own, worlds, radius, width)
