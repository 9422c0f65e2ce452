"""The film under a rod at finite strain against FElupe, a program that shares nothing with ours.

FElupe presses the same rod, with its rounded edge and its wall, by penalties and friction of its
own, on biquadratic quadrilaterals with discontinuous linear pressures and volume ratios; its bulk
modulus is 5000 times the shear modulus.  All meshes are twice finer if MEMSCAL_FULL_STUDY is set.
"""

import math

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.paper import FILM, ROD
from scipy.special import j0

from memscal import indent
from memscal.extensions.finite_strain.solve import solve_finite_strain
from memscal.mechanics.solver.step import Load

felupe = pytest.importorskip("felupe", reason="FElupe, the other program, is not installed")


H = 2.0
A = 0.25
EDGE = 0.025  # mm
WAVENUMBERS = np.linspace(0.0, 3.0, 13)  # rad/mm
REFINEMENT = 1.0 if FULL else 0.5


def graded(length, first, widest):
    x = np.cumsum(np.minimum(first * 1.4 ** np.arange(99), widest))
    count = np.searchsorted(x, length) + 1
    return x[:count] * (length / x[count - 1])


def film_of_quadrilaterals(start, end, side):
    """Return a mesh in FElupe's coordinates (height, radius), even from start to end; the rod."""
    wide = 0.2 / math.sqrt(REFINEMENT)
    even = np.linspace(start, end, round((end - start) / side) + 1)
    outer = end + graded(4.0, side, wide), end + 4.0 + graded(20.0, wide, 5 * wide)
    r = np.concatenate([start - graded(start, side, wide)[::-1], even, *outer])
    z = np.append(H - graded(H, side, wide)[::-1], H)
    mesh = felupe.Grid(z.round(12), r.round(12)).add_midpoints_edges().add_midpoints_faces()
    mesh.add_points([[H, 0.0]])
    return mesh


class RodContact(felupe.mechanics.ContactRigidBase):
    """FElupe's contact of nodes with a rigid body, in the shape of a rod."""

    def _kinematics(self, dx):
        """Return distances outside the rod, normals of its surface and their derivatives."""
        p = np.stack([EDGE - dx[:, 0], dx[:, 1] - (A - EDGE)], axis=-1)  # from the edge's centre
        turning = np.all(p > 0, axis=1)[:, None]
        away = np.where(turning, np.hypot(*p.T)[:, None], 1.0)
        straight = np.where(p[:, 1:] > p[:, :1], [0.0, 1.0], [-1.0, 0.0])
        normal = np.where(turning, p * [-1.0, 1.0] / away, straight)
        gap = np.where(turning, away, p.max(axis=1, keepdims=True))[:, 0] - EDGE
        bend = np.eye(2) - normal[:, :, None] * normal[:, None, :]
        return gap, normal, bend * (turning / away)[:, :, None]


def press_with_felupe(loads, friction, mesh):
    """Return depths (mm) and spectra of the base's reactions (N)."""
    region = felupe.RegionBiQuadraticQuad(mesh)
    inside = {"quadrature": region.quadrature, "grad": False}
    linear = felupe.Region(mesh.dual(points_per_cell=3), felupe.Triangle(), **inside)
    u = felupe.FieldAxisymmetric(region, dim=2)
    field = felupe.FieldContainer([u, felupe.Field(linear), felupe.Field(linear, values=1.0)])
    shear = FILM.shear_modulus * 1e-6
    material = felupe.NearlyIncompressible(felupe.NeoHooke(mu=shear), bulk=5000 * shear)
    z, r = mesh.points.T
    base = np.flatnonzero(z < 1e-9)
    top = np.flatnonzero((z > H - 1e-9) & (r < 1.5))[:-1]
    stiff = {"multiplier": 1e3, "multiplier_tangential": 1e3, "curvature": "trial"}  # N/mm
    contact = RodContact(field, points=top, centerpoint=-1, friction=friction, **stiff)
    solid = felupe.SolidBody(material, field)
    weight = felupe.PointLoad(field, [r.size - 1])
    held = (felupe.Boundary(u, mask=z < 1e-9), felupe.Boundary(u, mask=r < 1e-9, skip=(1, 0)))
    fixed, free = felupe.dof.partition(field, dict(enumerate(held)))
    setting = {"dof0": fixed, "dof1": free, "ext0": np.zeros(fixed.size), "verbose": 0, "tol": 1e-6}
    u.values[-1, 0] = -1e-3  # the rod touches
    reached = 0.0
    step = 0.01
    answers = []
    for load in loads:
        while reached < load:
            ahead = load if load - reached < 1.5 * step else reached + step
            before = [values.values.copy() for values in field.fields]
            weight.update([[-ahead, 0.0]])
            try:
                with np.errstate(invalid="raise"):
                    felupe.newtonraphson(items=[solid, contact, weight], **setting)
            except (felupe.tools.NewtonConvergenceError, FloatingPointError):
                for values, old in zip(field.fields, before, strict=True):
                    values.values = old
                step /= 2
                assert step > 1e-4
            else:
                reached = ahead
                step = min(1.3 * step, 0.05)
        forces = np.asarray(solid.assemble.vector(field).todense()).ravel()[2 * base]
        answers.append((-float(u.values[-1, 0]), j0(np.outer(WAVENUMBERS, r[base])) @ forces))
    return answers


# Loads in N; where the mesh is even, which is where the film folds around the edge, and its sides.
STICKING = (math.inf, (0.1, 0.3, 1.0) if FULL else (0.1, 0.3), (0.2, 0.5, 0.0125 / REFINEMENT))
SLIDING = (0.0, (0.1,), (0.15, 0.3, 0.00625 / REFINEMENT))


@pytest.mark.parametrize(("friction", "loads", "fold"), [STICKING, SLIDING] if FULL else [STICKING])
def test_the_film_under_a_rod_agrees_with_felupe(friction, loads, fold):
    targets = tuple(Load(load) for load in loads)
    sticking = friction > 0
    ours = solve_finite_strain(FILM, ROD, targets, sticking=sticking, refinement=REFINEMENT)
    theirs = press_with_felupe(loads, friction, film_of_quadrilaterals(*fold))
    for state, (depth, base) in zip(ours, theirs, strict=True):
        spectrum = state.base_spectrum(WAVENUMBERS * 1e3)
        assert spectrum == pytest.approx(base, rel=0.01)
        assert state.depth * 1e3 == pytest.approx(depth, rel=0.015)
    linear = indent(FILM, ROD, load=loads[-1], friction=friction, strain="linear")
    difference = spectrum / linear.base_spectrum(WAVENUMBERS * 1e3) - 1
    # More is compared than a linear film.
    assert np.max(difference) > (0.3 * loads[-1] if sticking else 0.015)
