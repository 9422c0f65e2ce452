"""The sphere, with and without friction, against GetFEM, whose elements and contact are not ours.

GetFEM is run by the Python that it belongs to.  Set MEMSCAL_FULL_STUDY for a finer mesh and
smaller steps.
"""

import itertools
import json
import math
import os
import shutil
import subprocess
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from helpers import getfem_sphere
from helpers.bounds import FULL
from helpers.getfem_sphere import contact_radius, load_beyond
from helpers.paper import FILM, LOADS, SPHERE

import memscal

STEP, LAYERS = (0.05, 8) if FULL else (0.1, 5)
STEPS = (50, 100, 200) if FULL else (50, 100)
FRICTIONS = (0.3, 1.0, math.inf)
PROGRAM = Path(getfem_sphere.__file__)
# As good as infinite: the shear of a sticking contact stays below the pressure.
STICKING = 1e3


@pytest.fixture(scope="module", autouse=True)
def python():
    """The Python that GetFEM belongs to."""
    found = shutil.which("python3", path="/usr/bin")
    probe = [found or "", "-c", "import getfem"]
    if found and subprocess.run(probe, capture_output=True, check=False).returncode == 0:
        return found
    pytest.skip("GetFEM (Debian package python3-getfem) is not installed")


@lru_cache
def by_getfem(python, friction, steps, step=STEP):
    """States of the paper's sphere and film at the paper's loads, in mm, N and MPa."""
    case = {
        "young_modulus": 2.2,
        "poisson_ratio": 0.5,
        "thickness": 2.0,
        "radius": 128.8,
        "friction": min(friction, STICKING),
        "loads": LOADS,
        "steps": steps,
        "contact": 4.2,
        "step": step,
        "layers": LAYERS,
        "first_depth": 2e-3,
    }
    done = subprocess.run(
        [python, str(PROGRAM)],
        input=json.dumps(case),
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1"},
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    states = json.loads(done.stdout)
    return [
        {name: np.array(v) if isinstance(v, list) else v for name, v in s.items()} for s in states
    ]


@lru_cache
def by_memscal(friction):
    return memscal.indent(FILM, SPHERE, load=LOADS, friction=friction, loading="incremental")


def edge(state):
    """Contact radius in mm."""
    r = state["r"]
    pressure = state["pressure"]
    return contact_radius(r, load_beyond(r, pressure), r[pressure > 0.02 * pressure.max()].max())


def differences(contact, state):
    """Depth and contact radius relative to memscal's; stresses to the highest of their face."""
    base = contact.base_stress(state["base_r"] * 1e-3) * 1e-6
    base_shear = contact.base_shear(state["base_shear_r"] * 1e-3) * 1e-6
    r = state["r"][state["r"] < 0.9e3 * contact.contact_radius]
    pressure = contact.interface_pressure(r * 1e-3) * 1e-6
    shear = contact.interface_shear(r * 1e-3) * 1e-6
    return {
        "depth": abs(state["depth"] * 1e-3 / contact.depth - 1),
        "contact radius": abs(edge(state) * 1e-3 / contact.contact_radius - 1),
        "highest base stress": abs(state["base_normal"].max() / base.max() - 1),
        "base stress": np.max(np.abs(state["base_normal"] - base)) / base.max(),
        "base shear": np.max(np.abs(state["base_shear"] - base_shear)) / base.max(),
        "pressure": np.max(np.abs(state["pressure"][: r.size] - pressure)) / pressure.max(),
        "shear": np.max(np.abs(state["shear"][: r.size] - shear)) / pressure.max(),
    }


def in_the_limit(coarse, fine):
    """States for infinitely many steps, by extrapolation: the error goes with their length."""
    return [
        {name: 2 * last[name] - first[name] for name in last}
        for first, last in zip(coarse, fine, strict=True)
    ]


def worst(friction, states):
    """The largest differences over all loads."""
    each = [differences(*pair) for pair in zip(by_memscal(friction), states, strict=True)]
    return {name: max(one[name] for one in each) for name in each[0]}


def test_getfem_agrees_on_the_sphere_without_friction(python):
    # Without friction the path is of no account, and a step per load is enough.
    found = worst(0.0, by_getfem(python, 0.0, len(LOADS), 0.025 if FULL else 0.05))
    limits = {"depth": 1e-4, "contact radius": 1e-3, "highest base stress": 3e-4}
    limits |= {"base stress": 3e-4, "base shear": 2e-4, "pressure": 2e-3}
    assert {name: found[name] for name in limits if found[name] >= limits[name]} == {}


@pytest.mark.parametrize("friction", FRICTIONS)
def test_getfem_agrees_on_the_sphere_with_friction(python, friction):
    coarse, fine = (by_getfem(python, friction, steps) for steps in STEPS[-2:])
    found = worst(friction, in_the_limit(coarse, fine))
    limit = 5e-4 if FULL else 2e-3
    for name in ("depth", "contact radius", "highest base stress", "base stress", "base shear"):
        assert found[name] < limit, name
    assert found["pressure"] < 6e-3
    # The shear of the interface has a stair for every step, which no extrapolation takes away.
    assert worst(friction, fine)["shear"] < 2e-2


@pytest.mark.parametrize("friction", FRICTIONS)
def test_smaller_steps_bring_getfem_closer(python, friction):
    errors = [worst(friction, by_getfem(python, friction, n))["base stress"] for n in STEPS]
    assert all(fine < coarse / 1.3 for coarse, fine in itertools.pairwise(errors))
