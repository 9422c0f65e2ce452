"""The rod and the frictionless sphere against CalculiX, whose elements and solver are not ours.

Set MEMSCAL_FULL_STUDY for finer meshes and both Poisson's ratios.
"""

import itertools
import math
import shutil
from functools import lru_cache
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.calculix import Film, PressedSphere, press_rod, press_sphere
from helpers.getfem_sphere import contact_radius

import memscal

MISSING = "CalculiX (Debian package calculix-ccx) is not installed"
pytestmark = [pytest.mark.accuracy, pytest.mark.skipif(not shutil.which("ccx"), reason=MISSING)]

# An incompressible film is beyond CalculiX's elements: both sides are nearly so.
RATIOS = (0.495, 0.499) if FULL else (0.495,)
HALVINGS = (1, 2, 3) if FULL else (1, 2)
MESHES = ((0.1, 8), (0.05, 12), (0.025, 20)) if FULL else ((0.1, 8), (0.05, 12))
ROD = 0.25
SPHERE = 128.8
LOADS = (0.34, 0.69, 1.37, 2.75)


def films(nu: float) -> tuple[Film, memscal.ElasticFilm]:
    """The paper's film: for CalculiX in mm and MPa, for memscal in m and Pa."""
    ours = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=nu, thickness=2e-3)
    return Film(young_modulus=2.2, poisson_ratio=nu, thickness=2.0), ours


@pytest.mark.parametrize("friction", [0.0, math.inf])
@pytest.mark.parametrize("nu", RATIOS)
def test_calculix_converges_to_the_rods_stiffness_and_base_stress(nu, friction, tmp_path) -> None:
    theirs, ours = films(nu)
    contact = memscal.indent(ours, memscal.Rod(radius=ROD * 1e-3), load=1.0, friction=friction)
    stiffness = contact.load / contact.depth * 1e-3
    errors = []
    for halvings in HALVINGS:
        rod = press_rod(theirs, ROD, halvings, tmp_path, sticking=math.isinf(friction))
        stress = contact.base_stress(rod.base_r * 1e-3) * 1e-6
        difference = np.max(np.abs(rod.base_normal - stress)) / np.max(stress)
        errors.append((abs(rod.stiffness / stiffness - 1), difference))
    assert errors[-1][0] < 1e-4
    assert errors[-1][1] < 2e-3
    for coarse, fine in itertools.pairwise(errors):
        assert fine[0] < coarse[0] / 1.5
        assert fine[1] < coarse[1] / 2


@lru_cache
def spheres(nu: float) -> list[memscal.Contact]:
    """What memscal finds without friction at the paper's loads."""
    return memscal.indent(films(nu)[1], memscal.Sphere(radius=SPHERE * 1e-3), load=LOADS)


@lru_cache
def pressed_spheres(
    nu: float, mesh: tuple[float, int]
) -> list[tuple[memscal.Contact, PressedSphere]]:
    """What CalculiX finds at the depths that memscal finds, beside it."""
    depths = [contact.depth * 1e3 for contact in spheres(nu)]
    with TemporaryDirectory() as folder:
        pressed = press_sphere(films(nu)[0], SPHERE, depths, *mesh, Path(folder))
    return list(zip(spheres(nu), pressed, strict=True))


def edge(sphere: PressedSphere) -> float:
    """Contact radius in mm, from the nodes' forces."""
    # Half of a middle node's force and all of what follows is the load beyond it.
    beyond = np.cumsum(sphere.forces[::-1])[::-1] - sphere.forces / 2
    last = sphere.r[sphere.forces > 1e-4 * sphere.load].max()
    return contact_radius(sphere.r[::2], np.maximum(beyond[::2], 0.0), last)


@pytest.mark.parametrize("nu", RATIOS)
def test_calculix_converges_to_the_spheres_load_at_equal_depth(nu: float) -> None:
    errors = [
        max(abs(sphere.load / contact.load - 1) for contact, sphere in pressed)
        for pressed in (pressed_spheres(nu, mesh) for mesh in MESHES)
    ]
    assert errors[-1] < 2e-4
    assert errors[-1] < errors[0]


@pytest.mark.parametrize("nu", RATIOS)
def test_calculix_agrees_on_the_spheres_contact_and_base_stress(nu: float) -> None:
    for contact, sphere in pressed_spheres(nu, MESHES[-1]):
        assert edge(sphere) == pytest.approx(contact.contact_radius * 1e3, rel=2e-3)
        pressure = contact.interface_pressure(sphere.r[:1] * 1e-3) * 1e-6
        assert sphere.forces[0] / sphere.areas[0] == pytest.approx(pressure[0], rel=1e-3)
        stress = contact.base_stress(sphere.base_r * 1e-3) * 1e-6
        difference = np.abs(sphere.base_normal - stress) / np.max(stress)
        # Where all is on the axis, reduced integration is at its least accurate.
        assert np.max(difference[1:]) < 5e-4
        assert difference[0] < 2e-3
