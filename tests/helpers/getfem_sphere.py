"""A sphere pressed on a bonded film with Coulomb friction, in increments, by GetFEM.

A program for the Python that GetFEM belongs to (on Debian the system's): it reads the case as
JSON from standard input and writes the solution as JSON to standard output, in mm, N and MPa.
Nothing of memscal is in it.

The film is axisymmetric, with quadratic displacements and continuous linear pressures on
rectangles (Taylor-Hood), so that it may be incompressible.  Contact and friction are GetFEM's
augmented Lagrangian (Alart and Curnier), written in its weak-form language with the radius as a
weight: pressure and shear of the interface are linear Lagrange multipliers, and so are, with
quadratic ones, the tractions of the base.  The load is prescribed and the depth is an unknown.
Displacements are small: the gap is taken at the undeformed radius.
"""

import itertools
import json
import sys

import numpy as np

BASE = 1
TOP = 2
AXIS = 3
REACH = 25.0  # free edge of the film, mm

BULK = (
    "X(1)*(2*G*(Grad_ur(1)*Grad_Test_ur(1) + Grad_uz(2)*Grad_Test_uz(2)"
    " + ur*Test_ur/sqr(X(1)))"
    " + G*(Grad_ur(2) + Grad_uz(1))*(Grad_Test_ur(2) + Grad_Test_uz(1))"
    " - m*(Grad_Test_ur(1) + Grad_Test_uz(2) + Test_ur/X(1))"
    " - Test_m*(Grad_ur(1) + Grad_uz(2) + ur/X(1)) - softness*m*Test_m)"
)
# The multipliers are the tractions of the film on its base.
HELD = "X(1)*(tz*Test_uz + uz*Test_tz + tr*Test_ur + ur*Test_tr)"
# Pressure is positive, and the multiplier p becomes it where the film is touched.
PRESSURE = "pos_part(p + c*(depth - R + sqrt(R*R - X(1)*X(1)) + uz))"
# The last term is the balance with the load, spread as a mean pressure over the meshed contact.
CONTACT = "X(1)*(pressure*Test_uz - (p - pressure)*Test_p/c + (pressure - mean)*Test_depth)"
# Shear on the film, outward; the film's own slip since the last step is what friction opposes.
SHEAR = "max(-mu*pressure, min(mu*pressure, q - c*(ur - ur_before)))"
FRICTION = "-X(1)*(shear*Test_ur + (q - shear)*Test_q/c)"


def grid(step, layers, contact, thickness):
    """Radii with one step in the contact and coarser beyond, and heights finer at both faces."""
    radii = list(np.arange(0.0, contact + step / 2, step))
    while radii[-1] < REACH:
        widest = 2 * step if radii[-1] < contact + thickness else thickness
        radii.append(radii[-1] + min(1.25 * (radii[-1] - radii[-2]), widest))
    radii = np.array(radii)
    end = radii > contact
    radii[end] = contact + (radii[end] - contact) * (REACH - contact) / (radii[-1] - contact)
    x = np.linspace(-1.0, 1.0, layers + 1)
    return radii, thickness * (1 + x * (1.5 - 0.5 * x**2)) / 2


def load_beyond(r, pressure):
    """Load carried outside each radius, of a pressure that is linear between them."""
    inner = r[:-1]
    outer = r[1:]
    first = pressure[:-1]
    last = pressure[1:]
    rings = (outer - inner) * (first * (2 * inner + outer) + last * (inner + 2 * outer)) * np.pi / 3
    return np.append(np.cumsum(rings[::-1])[::-1], 0.0)


def contact_radius(r, beyond, guess):
    """Radius outside which no load is carried, by extrapolation from well inside the contact.

    Pressure goes to zero like a square root, so that ``beyond ** (2/3)`` goes to zero linearly
    in the square of the radius; and unlike the pressure itself it does not waver at the nodes
    that the edge cuts.
    """
    for _ in range(4):
        inside = (r >= 0.5 * guess) & (r <= 0.95 * guess)
        shape = np.polynomial.Polynomial.fit(beyond[inside] ** (2 / 3), r[inside] ** 2, 3)
        guess = float(np.sqrt(shape(0.0)))
    return guess


class Film:
    """The discretised film, its unknowns and its equations."""

    def __init__(self, case):
        import getfem

        getfem.util("trace level", 0)
        getfem.util("warning level", 0)
        self.getfem = getfem
        self.friction = case["friction"]
        self.contact = case["contact"]
        radii, heights = grid(case["step"], case["layers"], self.contact, case["thickness"])
        self.mesh = getfem.Mesh("cartesian", radii, heights)
        self.integration = getfem.MeshIm(self.mesh, getfem.Integ("IM_GAUSS_PARALLELEPIPED(2,5)"))
        self.mark_boundaries(case["thickness"])
        self.model = getfem.Model("real")
        self.nodes = {}
        self.kept = []
        self.add_bulk(case)
        self.add_contact(case)

    def mark_boundaries(self, thickness):
        r, z = self.mesh.pts()
        top = (z > thickness - 1e-9) & (r < self.contact + 1e-9)
        for region, inside in ((BASE, z < 1e-9), (AXIS, r < 1e-9), (TOP, top)):
            self.mesh.set_region(region, self.mesh.faces_from_pid(np.flatnonzero(inside)))

    def space(self, degree, region=None, without_axis=False):
        """Lagrange elements on the mesh, or their traces on a boundary, with their radii."""
        elements = self.getfem.MeshFem(self.mesh, 1)
        elements.set_fem(self.getfem.Fem(f"FEM_QK(2,{degree})"))
        self.kept.append(elements)  # GetFEM lets go of what only a trace refers to
        if region is None:
            return elements, None
        degrees = elements.basic_dof_on_region(region)
        if without_axis:
            degrees = np.setdiff1d(degrees, elements.basic_dof_on_region(AXIS))
        radii = elements.basic_dof_nodes()[0][np.sort(degrees)]
        return self.getfem.MeshFem("partial", elements, degrees), radii

    def add_unknown(self, name, degree, region=None, without_axis=False):
        elements, self.nodes[name] = self.space(degree, region, without_axis)
        self.model.add_fem_variable(name, elements)
        return elements

    def add_bulk(self, case):
        nu = case["poisson_ratio"]
        shear_modulus = case["young_modulus"] / (2 * (1 + nu))
        self.model.add_initialized_data("G", shear_modulus)
        self.model.add_initialized_data("softness", (1 - 2 * nu) / (2 * shear_modulus * nu))
        displacement = self.add_unknown("ur", 2)
        self.model.add_fem_variable("uz", displacement)
        self.model.add_fem_data("ur_before", displacement)
        self.add_unknown("m", 1)
        self.add_unknown("tz", 2, BASE)
        self.add_unknown("tr", 2, BASE, without_axis=True)
        self.model.add_linear_term(self.integration, BULK)
        self.model.add_linear_term(self.integration, HELD, BASE)
        self.model.add_Dirichlet_condition_with_simplification("ur", AXIS)

    def add_contact(self, case):
        self.model.add_initialized_data("R", case["radius"])
        self.model.add_initialized_data("c", 2 * case["young_modulus"])
        self.add_unknown("p", 1, TOP)
        # An unknown depth starts where something is touched, or no load could be carried.
        self.model.add_variable("depth", 1)
        self.model.set_variable("depth", [case["first_depth"]])
        self.model.add_macro("pressure", PRESSURE)
        self.model.add_initialized_data("mean", 0.0)
        self.model.add_nonlinear_term(self.integration, CONTACT, TOP)
        if self.friction > 0:
            self.add_unknown("q", 1, TOP)
            self.model.add_initialized_data("mu", self.friction)
            self.model.add_macro("shear", SHEAR)
            self.model.add_nonlinear_term(self.integration, FRICTION, TOP)

    def press(self, load):
        """Find the equilibrium under a load."""
        self.model.set_variable("mean", load / (np.pi * self.contact**2))
        _, converged = self.model.solve(
            "max_res", 1e-10, "max_iter", 60, "lsolver", "mumps", "lsearch", "simplest"
        )
        if not converged:
            raise RuntimeError(f"GetFEM did not converge at {load:g} N")
        self.model.set_variable("ur_before", self.model.variable("ur"))

    def profile(self, name):
        """Radii and values of a multiplier, from the axis outward."""
        order = np.argsort(self.nodes[name])
        return self.nodes[name][order], self.model.variable(name)[order]

    def state(self):
        r, pressure = self.profile("p")
        base_r, base_normal = self.profile("tz")
        shear_r, base_shear = self.profile("tr")
        shear = self.profile("q")[1] if self.friction > 0 else np.zeros_like(r)
        return {
            "depth": float(self.model.variable("depth")[0]),
            "r": r.tolist(),
            "pressure": pressure.tolist(),
            "shear": shear.tolist(),
            "base_r": base_r.tolist(),
            "base_normal": (-base_normal).tolist(),
            "base_shear_r": shear_r.tolist(),
            "base_shear": (-base_shear).tolist(),
        }


def increments(loads, steps):
    """Rising loads through all those asked for, even in the square root, and where they are."""
    marks = np.sqrt([0.0, *loads])
    pieces = []
    reached = []
    for low, high in itertools.pairwise(marks):
        count = max(1, round(steps * (high - low) / marks[-1]))
        pieces.extend(np.linspace(low, high, count + 1)[1:] ** 2)
        reached.append(len(pieces) - 1)
    return pieces, reached


def main():
    case = json.load(sys.stdin)
    film = Film(case)
    path, reached = increments(case["loads"], case["steps"])
    states = []
    for number, load in enumerate(path):
        film.press(load)
        if number in reached:
            states.append(film.state())
    json.dump(states, sys.stdout)


if __name__ == "__main__":
    main()
