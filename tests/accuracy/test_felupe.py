"""The film under a rod at finite strain against FElupe, a program that shares nothing with ours.

The surface of FElupe's film is moved as ours was where it touches the rod.  Load and base stress
must then be the same; and where our contact is frictionless, nothing must hold FElupe's film back
sideways.  Its film is nearly incompressible (a bulk modulus 5000 times the shear modulus), on
bilinear quadrilaterals with constant pressure and volume ratio, finer if MEMSCAL_FULL_STUDY is set.
"""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from helpers.bounds import FULL
from numpy.typing import NDArray
from scipy.special import j0

from memscal import Contact, ElasticFilm, Rod, indent
from memscal.mechanics.finite_strain.solve import solve_finite_strain
from memscal.mechanics.solver.problem import Depth

felupe = pytest.importorskip(
    "felupe", reason="FElupe, the independent program at finite strain, is not installed"
)

pytestmark = pytest.mark.accuracy

FILM = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
ROD = Rod(radius=0.25e-3)
STEPS = 8 if FULL else 3
#: Of FElupe's mesh; bilinear elements converge with the square of their side.
REFINEMENTS = (1.0, 2.0) if FULL else (0.6, 1.2)
WAVENUMBERS = np.array([0.5, 1.0, 1.5, 2.0])  # rad/mm


def graded(start: float, end: float, first: float, growth: float, widest: float) -> list[float]:
    points, step = [start], first
    while points[-1] < end:
        points.append(end if end - points[-1] < 1.5 * step else points[-1] + step)
        step = min(step * growth, widest)
    return points


def film_of_quadrilaterals(refinement: float) -> Any:
    """Return a mesh in FElupe's coordinates: height, radius."""
    a, h = 0.25, 2.0
    first, growth = 0.01 / refinement, 1 + 0.15 / refinement
    inner = [a - x for x in graded(0.0, a, first, growth, 0.03)]
    near = graded(a, 4.0, first, growth, 0.1 / refinement)
    r = np.unique(np.concatenate([inner, near, graded(4.0, 25.0, 0.1 / refinement, growth, 0.5)]))
    z = h - np.array(graded(0.0, h, first, growth, 0.1 / refinement))[::-1]
    Z, R = np.meshgrid(z, r, indexing="ij")
    number = np.arange(Z.size).reshape(Z.shape)
    corners = [number[:-1, :-1], number[1:, :-1], number[1:, 1:], number[:-1, 1:]]
    cells = np.stack([corner.ravel() for corner in corners], axis=-1)
    return felupe.Mesh(np.stack([Z.ravel(), R.ravel()], axis=-1), cells, "quad")


@dataclass(frozen=True)
class Answer:
    """Load in N, spectrum of the base's reactions, and the sideways forces at the surface."""

    load: float
    base: NDArray[np.float64]
    sideways: float


def press_with_felupe(state: Contact, refinement: float) -> Answer:
    """Move the surface of FElupe's film as that of ``state`` where it touches the rod."""
    mesh = film_of_quadrilaterals(refinement)
    z, r = mesh.points.T
    field = felupe.FieldsMixed(felupe.RegionQuad(mesh), n=3, axisymmetric=True)
    shear = FILM.shear_modulus * 1e-6
    material = felupe.ThreeFieldVariation(felupe.NeoHooke(mu=shear, bulk=5000 * shear))
    solid = felupe.SolidBody(umat=material, field=field)
    last = state.inside.pressing.elements.nodes[0][state.inside.pressed.touching[-1]]
    moved = (z > 2.0 - 1e-9) & (r < last + 1e-9)
    bounds = {
        "base": felupe.Boundary(field[0], mask=z < 1e-9),
        "axis": felupe.Boundary(field[0], mask=r < 1e-9, skip=(1, 0)),
        "moved": felupe.Boundary(field[0], mask=moved),
    }
    fixed, free = felupe.dof.partition(field, bounds)
    whole = np.zeros((z.size, 2))
    whole[moved, 0] = -state.inside.depression(r[moved] * 1e-3) * 1e3
    whole[moved, 1] = state.inside.outward(r[moved] * 1e-3) * 1e3
    for share in np.linspace(0, 1, STEPS + 1)[1:]:
        found = felupe.newtonraphson(
            items=[solid], dof0=fixed, dof1=free, ext0=share * whole.ravel()[fixed], verbose=0,
            tol=1e-7,
        )  # fmt: skip
        assert found.success
    reactions = np.asarray(solid.assemble.vector(field).todense()).ravel()
    upward, outward = reactions[: 2 * z.size].reshape(-1, 2).T
    base = z < 1e-9
    spectrum = j0(np.multiply.outer(WAVENUMBERS, r[base])) @ upward[base]
    load = -float(np.sum(upward[moved]))
    assert np.sum(upward[base]) == pytest.approx(load, rel=1e-5)
    return Answer(load, spectrum, float(np.sum(outward[moved & (r > 0)])))


@pytest.mark.parametrize("sticking", [False, True])
def test_the_film_under_a_rod_agrees_with_felupe(sticking: bool) -> None:
    (state,) = solve_finite_strain(FILM, ROD, (Depth(0.15e-3),), sticking=sticking, edge=0.05e-3)
    coarse, fine = (press_with_felupe(state, refinement) for refinement in REFINEMENTS)
    load, base = (
        getattr(fine, name) + (getattr(fine, name) - getattr(coarse, name)) / 3
        for name in ("load", "base")
    )
    assert state.load == pytest.approx(load, rel=3e-3)
    spectrum = state.inside.base_spectrum(WAVENUMBERS * 1e3)
    assert spectrum == pytest.approx(base, abs=3e-3 * load)
    linear = indent(FILM, ROD, load=state.load, friction=math.inf if sticking else 0.0)
    departure = spectrum - linear.base_spectrum(WAVENUMBERS * 1e3)
    assert np.max(np.abs(departure)) > 3e-3 * load  # what is compared is more than the linear model
    if not sticking:
        normal = state.inside.pressing.elements  # the rod pushes sideways only at its edge
        forces = normal.forces(state.inside.pressed.x)[normal.surface]
        assert fine.sideways == pytest.approx(float(np.sum(forces[1:])), abs=0.01 * load)
