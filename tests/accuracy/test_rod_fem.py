"""The rod against finite elements: mixed P4/P3 triangles, axisymmetric, graded at the edge."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest
import skfem
from numpy.typing import NDArray
from scipy.sparse import bmat
from skfem.helpers import ddot, div, sym_grad

from memscal.mechanics.indent import indent
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod

# In MPa and mm: the mixed system is badly scaled in SI units.
YOUNG_MODULUS = 2.2
RADIUS = 0.25
THICKNESS = 2.0
REACH = 25.0

FloatArray = NDArray[np.float64]

pytestmark = pytest.mark.accuracy


@dataclass(frozen=True)
class FiniteElementRod:
    """Stiffness (N/mm) and the stresses at the base (MPa) under 1 N, at radii r (mm)."""

    stiffness: float
    r: FloatArray
    sigma_zz: FloatArray
    sigma_rz: FloatArray


def mesh_graded_at_the_edge() -> skfem.MeshTri:
    toward_edge = 0.3 ** np.arange(9)
    radii = [RADIUS * (1 - toward_edge), [RADIUS], RADIUS * (1 + toward_edge)]
    far, step = [2 * RADIUS], RADIUS
    while far[-1] < REACH:
        step = min(1.35 * step, 0.2 * THICKNESS if far[-1] < 3 * THICKNESS else THICKNESS)
        far.append(far[-1] + step)
    below = np.concatenate([[0.0], RADIUS * toward_edge, np.linspace(RADIUS, THICKNESS, 10)])
    return skfem.MeshTri.init_tensor(
        np.unique(np.concatenate([*radii, far])), np.unique(THICKNESS - below)
    )


def solve_with_elements(nu: float, *, sticking: bool) -> FiniteElementRod:
    """Press the rod down by 1 mm (the problem is linear) and scale to 1 N."""
    shear_modulus = YOUNG_MODULUS / (2 * (1 + nu))
    # 1/lambda; zero where the film is incompressible.
    softness = (1 - 2 * nu) / (2 * shear_modulus * nu)
    mesh = mesh_graded_at_the_edge()
    element = skfem.ElementVector(skfem.ElementTriP4())
    displacement = skfem.Basis(mesh, element, intorder=8)
    pressure = displacement.with_element(skfem.ElementTriP3())

    @skfem.BilinearForm
    def distortion(u, v, w):  # type: ignore[no-untyped-def]
        r = w.x[0]
        hoop = u[0] * v[0] / r**2
        return 2 * shear_modulus * (ddot(sym_grad(u), sym_grad(v)) + hoop) * r

    @skfem.BilinearForm
    def dilatation(u, q, w):  # type: ignore[no-untyped-def]
        return -(div(u) * w.x[0] + u[0]) * q

    @skfem.BilinearForm
    def compressibility(p, q, w):  # type: ignore[no-untyped-def]
        return softness * p * q * w.x[0]

    stiff = distortion.assemble(displacement)
    couple = dilatation.assemble(displacement, pressure)
    soft = compressibility.assemble(pressure)
    system = bmat([[stiff, couple.T], [couple, -soft]], format="csr")

    base = displacement.get_dofs(lambda x: x[1] < 1e-9)
    axis = displacement.get_dofs(lambda x: x[0] < 1e-12)
    rim = displacement.get_dofs(lambda x: x[0] > mesh.p[0].max() - 1e-9)
    rod = displacement.get_dofs(lambda x: (x[1] > THICKNESS - 1e-12) & (x[0] < RADIUS * (1 + 1e-9)))
    fixed = [base.all(), axis.all(["u^1"]), rim.all(["u^1"]), rod.all(["u^2"])]
    if sticking:
        fixed.append(rod.all(["u^1"]))
    prescribed = np.zeros(system.shape[0])
    prescribed[rod.all(["u^2"])] = -1.0
    solution = skfem.solve(
        *skfem.condense(system, x=prescribed, D=np.unique(np.concatenate(fixed)))
    )
    u, p = np.split(solution, [displacement.N])
    force = 2 * np.pi * (u @ (stiff @ u) + p @ (soft @ p))  # twice the energy, over 1 mm

    at_base = skfem.FacetBasis(mesh, element, facets=mesh.facets_satisfying(lambda x: x[1] < 1e-9))
    gradient = at_base.interpolate(u).grad
    squeeze = at_base.with_element(skfem.ElementTriP3()).interpolate(p)
    vertical = np.asarray(squeeze) - 2 * shear_modulus * gradient[1][1]
    r = np.asarray(at_base.global_coordinates())[0].ravel()
    return FiniteElementRod(
        stiffness=force,
        r=r,
        sigma_zz=vertical.ravel() / force,
        sigma_rz=(shear_modulus * gradient[0][1]).ravel() / force,
    )


@pytest.mark.parametrize("friction", [0.0, math.inf])
@pytest.mark.parametrize("nu", [0.2, 0.5])
def test_the_rod_agrees_with_finite_elements(nu: float, friction: float) -> None:
    elements = solve_with_elements(nu, sticking=math.isinf(friction))
    film = ElasticFilm(
        young_modulus=YOUNG_MODULUS * 1e6, poisson_ratio=nu, thickness=THICKNESS * 1e-3
    )
    contact = indent(film, Rod(radius=RADIUS * 1e-3), load=1.0, friction=friction)
    stiffness = contact.load / contact.depth * 1e-3
    assert stiffness == pytest.approx(elements.stiffness, rel=1e-4)
    sigma_zz = contact.base_stress(elements.r * 1e-3) * 1e-6
    # The component with the third axis upward is the traction of the film on its base.
    sigma_rz = -contact.base_shear(elements.r * 1e-3) * 1e-6
    highest = np.max(sigma_zz)
    assert np.max(np.abs(elements.sigma_zz - sigma_zz)) < 5e-4 * highest
    assert np.max(np.abs(elements.sigma_rz - sigma_rz)) < 5e-4 * highest
