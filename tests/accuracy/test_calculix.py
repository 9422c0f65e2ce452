"""The rod against CalculiX, whose elements and solver are not ours.

Set MEMSCAL_FULL_STUDY for finer meshes and both Poisson's ratios.
"""

import itertools
import math
import shutil

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.calculix import press_rod
from helpers.paper import film

import memscal

MISSING = "CalculiX (Debian package calculix-ccx) is not installed"
pytestmark = pytest.mark.skipif(not shutil.which("ccx"), reason=MISSING)

# An incompressible film is beyond CalculiX's elements: both sides are nearly so.
RATIOS = (0.495, 0.499) if FULL else (0.495,)
HALVINGS = (1, 2, 3) if FULL else (1, 2)
ROD = 0.25


@pytest.mark.parametrize("friction", [0.0, math.inf])
@pytest.mark.parametrize("nu", RATIOS)
def test_calculix_converges_to_the_rods_stiffness_and_base_stress(nu, friction, tmp_path):
    bonded = film(nu)
    contact = memscal.indent(bonded, memscal.Rod(radius=ROD * 1e-3), load=1.0, friction=friction)
    stiffness = contact.load / contact.depth * 1e-3
    errors = []
    for halvings in HALVINGS:
        rod = press_rod(bonded, ROD, halvings, tmp_path, sticking=math.isinf(friction))
        stress = contact.base_stress(rod.base_r * 1e-3) * 1e-6
        difference = np.max(np.abs(rod.base_normal - stress)) / np.max(stress)
        errors.append((abs(rod.stiffness / stiffness - 1), difference))
    assert errors[-1][0] < 1e-4
    assert errors[-1][1] < 2e-3
    for coarse, fine in itertools.pairwise(errors):
        assert fine[0] < coarse[0] / 1.5
        assert fine[1] < coarse[1] / 2
