"""Film at finite strain under a rigid rod or sphere, by finite elements, and the field in it.

The linear model is formal where an indenter sinks by a good part of the film's thickness.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cached_property, lru_cache

import numpy as np

from memscal.axisymmetry.hankel import gauss_between, hankel_transform, radial_spline, up_to
from memscal.errors import ConvergenceError, DomainError
from memscal.extensions.finite_strain.film_elements import (
    FilmElements,
    Finer,
    Rubber,
    mesh_below_a_rod,
    mesh_below_a_sphere,
)
from memscal.extensions.finite_strain.pressing import (
    Face,
    NewtonError,
    Path,
    Pressed,
    Pressing,
    work,
)
from memscal.mechanics.contact import Contact
from memscal.mechanics.film_response import RingTraction
from memscal.mechanics.solver.refinement import RingRequest, relative_change
from memscal.mechanics.solver.step import Depth, Load, Target
from memscal.mechanics.surface import anticlockwise, on_hats
from memscal.model.arrays import ArrayTriple, FloatArray, array_record, floats, value_record
from memscal.model.field_mesh import FieldMesh
from memscal.model.film import MOONEY_RIVLIN, NEO_HOOKEAN, ElasticFilm
from memscal.model.indenter import Rod, Sphere
from memscal.progress import Task

_MM = 1e3
_MPA = 1e6
# The mesh that tells the convergence has sides longer by a factor, and takes a share of the work.
_COARSER = 1.5
_COARSE_WORK = 0.3
# Where a state does not depend on the path, this is followed on a mesh that is rougher still.
_ROUGHER = 1.5**3
# Distance of the film's free edge from the axis, in thicknesses, where none is given.
_FREE_EDGE = 12.5
# Radius of the rounding of a rod's edge, as a share of the rod's radius, where none is given: a
# sharp edge would cut a film at finite strain, and there is no solution to converge to.
_EDGE = 0.1
# Sides of triangles at the edge, as a share of its rounding: a frictionless film is drawn around
# the edge and stretched, and needs them finer.
_FINEST_STICKING = 2 / 5
_FINEST_SLIDING = 1 / 8
# Undeformed radii between which the surface folds around the edge, in radii of the rod; film that
# sticks is drawn in by so much more for each radius of depth.
_FOLD_STICKING = (0.8, 1.2)
_FOLD_SLIDING = (0.2, 1.1)
_DRAWN_IN = 0.16
# Radii at which the base stress of two meshes is compared, in film thicknesses.
_SAMPLES = np.linspace(0.0, 4.0, 41)


def press_at_finite_strain(request: RingRequest) -> tuple[Contact, ...]:
    """Return the contacts at the targets, visited in their order."""
    film = request.film
    indenter = request.indenter
    targets = request.targets
    friction = request.friction
    if not (friction == 0 or math.isinf(friction)) or not request.interface.rigid:
        raise DomainError(
            "At finite strain a contact slides freely (friction 0) or sticks (inf), between "
            f"surfaces that do not yield; here the friction is {friction:g}.",
            why="What lies between is solved for small strain only.",
            cure='Use friction 0 and inf, which bracket the others, or strain="linear".',
        )
    if not isinstance(indenter, Rod | Sphere):
        raise DomainError(
            f"At finite strain a {indenter.shape} cannot be pressed on the film.",
            why="Only a rod and a sphere are modelled there.",
            cure='Press it with strain="linear".',
        )
    if math.isinf(friction) and request.loading == "incremental" and isinstance(indenter, Sphere):
        raise DomainError(
            f'At finite strain a {indenter.shape} that sticks is solved for loading="total" only.',
            why="Its contact grows, and a point would have to stick where it first touched.",
            cure='Give loading="total", where nothing in the contact has moved sideways.',
        )
    deepest = max(target.value for target in targets)
    if isinstance(targets[0], Depth) and deepest >= film.thickness:
        raise DomainError(
            f"A depth of {deepest * 1e3:g} mm goes through the film, which is "
            f"{film.thickness * 1e3:g} mm thick.",
            cure="Check the depth and its unit.",
        )
    radius = request.film_radius or _FREE_EDGE * film.thickness
    return solve_finite_strain(film, indenter, targets, sticking=friction > 0, radius=radius)


@lru_cache(maxsize=32)
def solve_finite_strain(
    film: ElasticFilm,
    indenter: Rod | Sphere,
    targets: tuple[Target, ...],
    *,
    sticking: bool = False,
    radius: float = 25e-3,
    refinement: float = 1.0,
    edge: float | None = None,
) -> tuple[Contact, ...]:
    """Press a rod (edge rounded to ``edge``, m) or a sphere on a film of ``radius`` (m)."""
    # Under a rod that sticks a point stays where it first touched, also at the rounded edge and at
    # the wall; under a sphere that sticks nothing in the contact moves radially.
    goals = [t if isinstance(t, Load) else Depth(t.value * _MM) for t in targets]
    request = Request(film, indenter, goals, sticking, radius * _MM, edge)
    task = Task("the loading", 1.0)
    rough = () if request.path_dependent else tuple(request.reached(refinement / _ROUGHER))
    coarse = tuple(
        request.solve(refinement / _COARSER, rough, lambda x: task.tell(_COARSE_WORK * x))
    )
    return tuple(
        request.solve(
            refinement, coarse, lambda x: task.tell(_COARSE_WORK + (1 - _COARSE_WORK) * x)
        )
    )


@value_record
class Request:
    """What is asked for, in mm and N."""

    film: ElasticFilm
    indenter: Rod | Sphere
    goals: Sequence[Target]
    sticking: bool
    radius: float
    edge: float | None
    finer: Finer = (1, 1)

    def solve(
        self,
        refinement: float,
        coarse: Sequence[Contact] = (),
        tell: Callable[[float], None] = lambda _: None,
    ) -> Iterator[Contact]:
        """Yield the contacts on one mesh; their convergence against those on a coarser one."""
        pressing = self._pressing(refinement, coarse)
        path = Path(pressing, self._start(pressing))
        try:
            for i, goal in enumerate(self.goals):
                others = coarse[i : i + 1]
                guesses = map(pressing.interpolated, () if self.path_dependent else others)
                for share in path.reach(goal, guesses):
                    tell((i + share) / len(self.goals))
                contact = self._contact(pressing, path.states)
                for other in others:
                    change = relative_change(contact, other, _SAMPLES * self.film.thickness)
                    steps = max(contact.steps, other.steps)
                    contact = replace(contact, convergence=change, steps=steps)
                yield contact
        except NewtonError as problem:
            stick = "" if self.sticking else "let the film stick (friction inf); "
            error = ConvergenceError(
                f"Under the {self.indenter.shape} of radius {self.indenter.radius * 1e3:.4g} mm: "
                + problem.problem,
                why="The film folds around the indenter more sharply than its elements can follow.",
                cure=f"Lower the load; {stick}or take the film as linear (--film-law linear).",
            )
            if path.states:
                error.last = self._contact(pressing, path.states)
            raise error from problem

    @property
    def path_dependent(self) -> bool:
        """Whether the film stays where it first touched the indenter."""
        return self.sticking and isinstance(self.indenter, Rod)

    def reached(self, refinement: float) -> Iterator[Contact]:
        """Yield the contacts on one mesh as far as it goes."""
        with suppress(ConvergenceError):
            yield from self.solve(refinement)

    def _pressing(self, refinement: float, coarse: Sequence[Contact]) -> Pressing:
        """Return film and indenter, on a mesh made for them."""
        size = (self.film.thickness * _MM, self.radius, refinement)
        radius = self.indenter.radius * _MM
        if isinstance(self.indenter, Rod):
            # The mesh is finest where the rod's edge folds the surface.
            face = Face(radius, _EDGE * radius if self.edge is None else self.edge * _MM)
            finest = _FINEST_SLIDING
            inner, outer = _FOLD_SLIDING
            if self.sticking:
                finest = _FINEST_STICKING
                inner, outer = _FOLD_STICKING
                outer += _DRAWN_IN * max(map(self._depth, self.goals)) / radius
            fold = (inner * radius, outer * radius)
            mesh = mesh_below_a_rod(
                size, rod=radius, fold=fold, finest=finest * face.edge, finer=self.finer
            )
        else:
            face = Face(radius, radius)
            widest = max(map(self._hertz_radius, self.goals))
            if coarse:  # now it is known
                widest = 1.1 * max(contact.contact_radius for contact in coarse) * _MM
            if widest > min(self.radius / 2, 0.9 * radius):
                raise DomainError(
                    f"The contact would be up to {widest:.3g} mm wide, but the film's radius is "
                    f"{self.radius:g} mm and the sphere's {radius:g} mm.",
                    why="It must end well within both.",
                )
            mesh = mesh_below_a_sphere(size, contact=widest)
        elements = FilmElements(mesh, Rubber.of(self.film))
        upright = isinstance(self.indenter, Sphere) and self.sticking
        return Pressing(elements, face, self.sticking, upright=upright)

    def _depth(self, goal: Target) -> float:
        """Return a rod's depth at a goal, that on a half-space at a load, in mm."""
        if isinstance(goal, Depth):
            return goal.value
        stiffness = 2 * self.film.contact_modulus / 1e6 * self.indenter.extent * _MM
        return min(goal.value / stiffness, self.film.thickness * _MM)

    def _hertz_radius(self, goal: Target) -> float:
        """Return a contact radius of a sphere that is not exceeded, in mm."""
        # At a load that on a half-space; at a depth that of an incompressible film, which rises
        # beside the contact.
        R = self.indenter.extent * _MM
        if isinstance(goal, Load):
            return float(np.cbrt(0.75 * goal.value * R / (self.film.contact_modulus / 1e6)))
        return float(1.6 * np.sqrt(goal.value * R))

    def _start(self, pressing: Pressing) -> Pressed:
        """Return the untouched film, and the nodes that will touch first."""
        elements = pressing.elements
        nodes = elements.surface
        r = elements.nodes[0][nodes]
        if isinstance(self.indenter, Rod):
            reach = pressing.face.flat
            depth = 0.0
        else:
            reach = 0.8 * self._hertz_radius(self.goals[0])
            depth = reach**2 / (self.indenter.extent * _MM)
        touching = nodes[r <= reach * (1 + 1e-9)]
        return pressing.at_nearest(Pressed(np.zeros(elements.size), depth, touching, np.empty(0)))

    def _contact(self, pressing: Pressing, states: list[Pressed]) -> Contact:
        """Return the last state on a way in SI units, of unknown convergence."""
        pressed = states[-1]
        elements = pressing.elements
        rod = isinstance(self.indenter, Rod)
        # Between the last node that touches and the next.
        field = FiniteStrainField(pressing, pressed)
        last = np.flatnonzero(np.isin(elements.surface, pressed.touching))[-1]
        ends = field.displacements[0][last : last + 2] + field.displacements[2][last : last + 2]
        radius = min(float(np.mean(ends)), self.indenter.extent if rod else math.inf)
        energy = elements.energy(pressed.x) / _MM
        # Without friction the energy is the work; a sphere that sticks has no way.
        work_done: float | None = energy
        if self.path_dependent:
            work_done = work(states) / _MM
        elif pressing.upright:
            work_done = None
        return Contact(
            film=self.film,
            indenter=self.indenter,
            load=pressed.load,
            depth=pressed.depth / _MM,
            contact_radius=radius,
            stick_radius=radius if self.sticking else 0.0,
            friction=math.inf if self.sticking else 0.0,
            loading="" if rod or not self.sticking else "total",
            backend="fem",
            convergence=math.inf,
            steps=len(states),
            discretisation=f"{elements.mesh.t.shape[1]} Taylor-Hood triangles (quadratic "
            f"displacement, linear pressure), {elements.size} unknowns",
            traction=interface_traction(pressing, pressed),
            inside=field,
            elastic_energy=energy,
            work=work_done,
            dissipated_energy=None if work_done is None else 0.0,
            strain="finite",
        )


@array_record
class FiniteStrainField:
    """The field in a film at finite strain; zero beyond the film's edge."""

    # An element of the bonded base does not deform: its Cauchy traction is the nominal one.
    pressing: Pressing
    pressed: Pressed

    @cached_property
    def tractions(self) -> ArrayTriple:
        """Radii at the base (m), pressure and outward shear on the film there (Pa)."""
        # Of the splines that do the same work as the nodal forces on every displacement that is
        # linear between the corners: more accurate than stresses taken inside the elements, and in
        # balance with the load to rounding.
        elements = self.pressing.elements
        forces = elements.forces(self.pressed.x)
        nodes = elements.base
        r = elements.nodes[0][nodes][::2]
        # The hat on the axis has hardly any area: its force is added to that of the next one.
        normal, shear = (
            np.linalg.solve(_spline_masses(r, order), _without_axis(_on_corners(forces[which])))
            for order, which in enumerate((nodes + elements.n, nodes))
        )
        return floats(r[1:]) / _MM, floats(normal * _MPA), floats(shear * _MPA)

    @cached_property
    def displacements(self) -> ArrayTriple:
        """Radii of the surface's nodes before deformation, their depression and outward shift."""
        elements = self.pressing.elements
        x = self.pressed.x
        nodes = elements.surface
        return elements.nodes[0][nodes] / _MM, -x[nodes + elements.n] / _MM, x[nodes] / _MM

    def base(self, r: FloatArray, order: int) -> FloatArray:
        """Return normal stress or outward traction at the base in Pa."""
        nodes = self.tractions[0]
        return up_to(nodes[-1], radial_spline(nodes, self.tractions[1 + order], order=order), r)

    def spectrum(self, k: FloatArray, order: int) -> FloatArray:
        """Return the transform of normal stress or traction at ``k`` (rad/m), in N."""
        return hankel_transform(self.tractions[0], self.tractions[1 + order], k, order=order)

    def surface(self, r: FloatArray, order: int) -> FloatArray:
        """Return depression or outward displacement in m at radii before the deformation."""
        from scipy.interpolate import PchipInterpolator

        nodes = self.displacements[0]
        # Without overshoot.
        return up_to(nodes[-1], PchipInterpolator(nodes, self.displacements[1 + order]), r)

    def mesh(self) -> FieldMesh:
        """Return displacement and Cauchy stress on the undeformed mesh."""
        elements = self.pressing.elements
        x = self.pressed.x
        law = MOONEY_RIVLIN if elements.material.c2 else NEO_HOOKEAN
        points = elements.nodes.T / _MM
        return FieldMesh(
            points=points,
            triangles=anticlockwise(points, elements.bases[0].element_dofs.T),
            displacement=x[: 2 * elements.n].reshape(2, -1).T / _MM,
            stress=elements.nodal_stress(x) * _MPA,
            notes=f"{law} film at finite strain under {self.pressed.load:.6g} N",
        )


def interface_traction(pressing: Pressing, pressed: Pressed) -> RingTraction:
    """Return pressure and shear (Pa) at the deformed radii of the corners in contact."""
    # Means over the hats of the corners: nodal forces of quadratic elements are no tractions (that
    # on the axis has no area).  A rod's wall is left out.
    elements = pressing.elements
    x = pressed.x
    nodes = elements.surface
    forces = elements.forces(x)
    touching = np.isin(nodes, pressed.touching)
    place = np.zeros(nodes.size)
    place[touching] = pressed.place
    _, (along, up), _ = pressing.face.contour(place)
    radial = forces[nodes] * touching
    upward = forces[nodes + elements.n] * touching
    pushed = up * radial - along * upward
    dragged = along * radial + up * upward
    r = elements.nodes[0][nodes] + x[nodes]
    z = x[nodes + elements.n]
    # The axis is held: its radial force is not the indenter's.
    if r[0] < 1e-12:
        dragged[0] = 0.0
    corners = r[::2]
    side = np.hypot(np.diff(corners), np.diff(z[::2]))
    left = r[:-2:2]
    right = r[2::2]
    area = np.pi / 3 * on_hats(side * (2 * left + right), side * (left + 2 * right))

    chosen = np.flatnonzero(touching[::2] & (along[::2] > 1e-6))
    chosen = chosen[np.argsort(corners[chosen], kind="stable")]
    pressure = _on_corners(pushed) / area
    shear = _on_corners(dragged) / area
    return RingTraction(corners[chosen] / _MM, pressure[chosen] * _MPA, shear[chosen] * _MPA)


def _on_corners(forces: FloatArray) -> FloatArray:
    """Return the forces on hats between corners; nodes are corners and middles by turns."""
    halves = forces[1::2] / 2
    return forces[::2] + on_hats(halves, halves)


def _without_axis(rows: FloatArray) -> FloatArray:
    """Add the first row to the second, and leave it out."""
    return np.concatenate([rows[:1] + rows[1:2], rows[2:]])


def _spline_masses(r: FloatArray, order: int) -> FloatArray:
    """Return integrals around the axis of hats times splines that are 1 at one corner off it."""
    from scipy.interpolate import BSpline

    nodes, weights = gauss_between(r, order=6)
    splines = radial_spline(r[1:], np.eye(r.size - 1), order=order)(nodes)
    hats = BSpline.design_matrix(nodes, np.pad(r, 1, mode="edge"), 1)
    masses = hats.T @ (splines * (2 * np.pi * nodes * weights)[:, None])
    return _without_axis(np.asarray(masses))
