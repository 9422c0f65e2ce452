"""Press a smooth pressure on a bonded film with GetFEM, and save the field as GetFEM does.

A program for the Python that GetFEM belongs to (on Debian the system's, package
python3-getfem); nothing of memscal is in it.  In mm, N and MPa: a film of 2 mm, E = 2.2 MPa,
nu = 1/2, bonded at y = 0, under 1 N spread as a Gaussian with a standard deviation of 1 mm.
Axisymmetric: x is the radius, y the height.  Taylor-Hood elements on rectangles.
"""

import sys

import numpy as np

THICKNESS = 2.0
MODULUS = 2.2
LOAD = 1.0
WIDTH = 1.0
REACH = 16.0
BASE = 1
TOP = 2
AXIS = 3

BULK = (
    "X(1)*(2*G*(Grad_u(1,1)*Grad_Test_u(1,1) + Grad_u(2,2)*Grad_Test_u(2,2)"
    " + u(1)*Test_u(1)/sqr(X(1)))"
    " + G*(Grad_u(1,2) + Grad_u(2,1))*(Grad_Test_u(1,2) + Grad_Test_u(2,1))"
    " - m*(Grad_Test_u(1,1) + Grad_Test_u(2,2) + Test_u(1)/X(1))"
    " - Test_m*(Grad_u(1,1) + Grad_u(2,2) + u(1)/X(1)))"
)
PRESSED = "X(1)*load/(2*pi*sqr(width))*exp(-sqr(X(1)/width)/2)*Test_u(2)"
# The stress of an element jumps to the next; its projection on continuous elements does not.
SMOOTHED = "(s - (2*G*Sym(Grad_u) - m*Id(2))):Test_s"


def elements(mesh, degree, *size):
    """Continuous elements on rectangles."""
    import getfem

    found = getfem.MeshFem(mesh, *size)
    found.set_fem(getfem.Fem(f"FEM_QK(2,{degree})"))
    return found


def main(path):
    """Solve and save."""
    import getfem

    near = 6.0 * np.linspace(0.0, 1.0, 23) ** 1.6
    far = np.linspace(6.0, REACH, 9)
    heights = THICKNESS * np.linspace(0.0, 1.0, 8) ** 1.5
    getfem.util("trace level", 0)
    mesh = getfem.Mesh("cartesian", np.concatenate([near, far[1:]]), heights)
    r, z = mesh.pts()
    sides = ((BASE, z < 1e-9), (TOP, z > THICKNESS - 1e-9), (AXIS, r < 1e-9))
    for region, inside in sides:
        mesh.set_region(region, mesh.faces_from_pid(np.flatnonzero(inside)))
    rule = getfem.MeshIm(mesh, getfem.Integ("IM_GAUSS_PARALLELEPIPED(2,6)"))
    model = getfem.Model("real")
    model.add_fem_variable("u", elements(mesh, 2, 2))
    model.add_fem_variable("m", elements(mesh, 1))
    model.add_initialized_data("G", MODULUS / 3)
    model.add_initialized_data("load", -LOAD)
    model.add_initialized_data("width", WIDTH)
    model.add_linear_term(rule, BULK)
    model.add_source_term(rule, PRESSED, TOP)
    model.add_Dirichlet_condition_with_multipliers(rule, "u", 2, BASE)
    model.add_normal_Dirichlet_condition_with_multipliers(rule, "u", 2, AXIS)
    stress = elements(mesh, 2, 2, 2)
    model.add_fem_variable("s", stress)
    model.add_linear_term(rule, SMOOTHED)
    model.solve("max_res", 1e-10, "lsolver", "mumps")
    displacement = model.mesh_fem_of_variable("u")
    fields = (displacement, model.variable("u"), "u", stress, model.variable("s"), "stress")
    stress.export_to_vtu(path, *fields)


if __name__ == "__main__":
    main(sys.argv[1])
