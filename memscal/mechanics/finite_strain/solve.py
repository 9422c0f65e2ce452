r"""A neo-Hookean film at finite strain under a rigid rod or sphere, by finite elements.

The linear model is formal where an indenter sinks by a good part of the film's thickness.  Here
the film is neo-Hookean (``finite_strain_material``), displacement and pressure are quadratic and
linear on triangles of the undeformed cross-section (``finite_strain_system``), and the surface
touches the indenter where it has moved to (``finite_strain_contact``).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from memscal.errors import ConvergenceError, DomainError, InputError
from memscal.mechanics.contact import Contact
from memscal.mechanics.finite_strain.film_elements import (
    FilmElements,
    NeoHookean,
    mesh_below_a_rod,
    mesh_below_a_sphere,
)
from memscal.mechanics.finite_strain.pressing import (
    Goal,
    NewtonError,
    Pressed,
    Pressing,
    RodFace,
    SphereFace,
    Step,
    follow,
)
from memscal.mechanics.finite_strain.state import (
    FiniteStrainField,
    FiniteStrainState,
    interface_tractions,
    outermost,
)
from memscal.mechanics.interface import Interface
from memscal.mechanics.rings import RingTraction
from memscal.mechanics.solver.problem import Load, Target
from memscal.model.arrays import FloatArray, require_positive
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter, Rod, Sphere

__all__ = ["press_at_finite_strain", "solve_finite_strain"]

_MM = 1e3
# The mesh that tells the convergence has sides longer by this factor.
_COARSER = 1.5
# Radius of the rounding of a rod's edge, as a share of the rod's radius, where none is given.
_EDGE = 0.1
# Sides of triangles at the edge, as a share of its rounding: a frictionless film is drawn around
# the edge and stretched, and needs them finer.
_FINEST_STICKING = 1 / 5
_FINEST_SLIDING = 1 / 8
# Undeformed radii between which the surface folds around the edge, in radii of the rod.
_FOLD_STICKING = (0.8, 1.9)
_FOLD_SLIDING = (0.2, 1.1)
# Radii at which the base stress of two meshes is compared, in film thicknesses.
_SAMPLES = np.linspace(0.0, 4.0, 41)


def solve_finite_strain(
    film: ElasticFilm,
    indenter: Indenter,
    *,
    depths: Sequence[float] | FloatArray | None = None,
    loads: Sequence[float] | FloatArray | None = None,
    sticking: bool = False,
    radius: float = 25e-3,
    refinement: float = 1.0,
    edge: float | None = None,
) -> list[FiniteStrainState]:
    r"""Press a rod or a sphere on a neo-Hookean film at finite strain.

    Parameters
    ----------
    film : ElasticFilm
        The film; its moduli are those at small strain.
    indenter : Rod or Sphere
        The rigid indenter.
    depths, loads : sequence of float
        Indentation depths in m, or loads in N: one of them, visited in the order given.
    sticking : bool
        Whether the contact sticks; otherwise it is frictionless.  Under a rod a point of the
        film stays where it first touched, also at the rounded edge and at the wall; under a
        sphere nothing in the contact moves radially (the "total" definition of sticking).
    radius : float
        Radius of the film's free edge, in m.
    refinement : float
        How many times shorter than by default the sides of the triangles are.
    edge : float, optional
        Radius of the rounding of a rod's edge, in m; a tenth of the rod's radius by default.  A
        perfectly sharp edge would cut a film at finite strain: there is no solution to converge to.

    Returns
    -------
    list of FiniteStrainState, one for each depth or load.

    Raises
    ------
    InputError
        If an argument makes no sense.
    DomainError
        If the indenter is of another shape, or the contact outgrows the film.
    ConvergenceError
        If no equilibrium is found, even in small steps; ``last`` is the last state on the way,
        whose convergence is not known (``inf``).

    Examples
    --------
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> (state,) = solve_finite_strain(film, Sphere(radius=128.8e-3), loads=[0.34])
    >>> print(f"{state.depth * 1e6:.1f} um, {state.contact_radius * 1e3:.1f} mm")
    17.3 um, 2.0 mm
    """
    goals = _goals(film, indenter, depths, loads, edge)
    request = _Request(film, indenter, goals, sticking, radius * _MM, edge)
    coarse = request.solve(refinement / _COARSER, compare=None)
    return request.solve(refinement, compare=coarse)


def _goals(
    film: ElasticFilm,
    indenter: Indenter,
    depths: Sequence[float] | FloatArray | None,
    loads: Sequence[float] | FloatArray | None,
    edge: float | None,
) -> list[Goal]:
    """Return what is to be reached, in mm or N."""
    if not isinstance(indenter, Rod | Sphere):
        raise DomainError(
            f"At finite strain a {indenter.shape} cannot be pressed on the film.",
            why="Only a rod and a sphere are modelled there.",
            cure='Press it with strain="linear".',
        )
    if edge is not None and not (isinstance(indenter, Rod) and 0 < edge < indenter.radius):
        raise InputError(
            f"The rounding of the indenter's edge is {edge:g} m.",
            why="Only a rod has an edge, and its rounding is positive and smaller than the rod.",
        )
    if (depths is None) == (loads is None):
        raise InputError("Give either depths or loads.", why="One follows from the other.")
    given = np.atleast_1d(np.asarray(loads if depths is None else depths, dtype=np.float64))
    if given.ndim != 1 or given.size == 0:
        raise InputError(f"The loads or depths have shape {given.shape}; give a flat list.")
    for value in given:
        require_positive(
            "load" if depths is None else "depth", value, "N" if depths is None else "m"
        )
    if depths is not None and given.max() >= film.thickness:
        raise DomainError(
            f"A depth of {given.max() * 1e3:g} mm goes through the film, which is "
            f"{film.thickness * 1e3:g} mm thick.",
            cure="Check the depth and its unit.",
        )
    scale = 1.0 if depths is None else _MM
    return [Goal(float(value) * scale, depths is None) for value in given]


@dataclass(frozen=True)
class _Request:
    """What is asked for, in mm and N."""

    film: ElasticFilm
    indenter: Indenter
    goals: list[Goal]
    sticking: bool
    radius: float
    edge: float | None

    def solve(
        self, refinement: float, *, compare: list[FiniteStrainState] | None
    ) -> list[FiniteStrainState]:
        """Return the states on one mesh, held against those of a coarser one."""
        pressing = self._pressing(refinement, compare)
        states: list[FiniteStrainState] = []
        goals = self.goals
        try:
            for step in follow(pressing, self._start(pressing), goals):
                other = compare[len(states)] if compare is not None else None
                states.append(self._state(pressing, step, other))
        except NewtonError as problem:
            error = ConvergenceError(
                problem.problem,
                why="The film folds around the indenter more sharply than its elements can follow.",
                cure="Ask for less; or let the film stick (friction inf), which goes further.",
            )
            if isinstance(problem.last, Step):
                error.last = self._state(pressing, problem.last, None)
            raise error from problem
        return states

    def _pressing(self, refinement: float, coarse: list[FiniteStrainState] | None) -> Pressing:
        """Return film and indenter, on a mesh made for them."""
        thickness = self.film.thickness * _MM
        face: RodFace | SphereFace
        if isinstance(self.indenter, Rod):
            rod = self.indenter.radius * _MM
            face = RodFace(rod, _EDGE * rod if self.edge is None else self.edge * _MM)
            fold = _FOLD_STICKING if self.sticking else _FOLD_SLIDING
            mesh = mesh_below_a_rod(
                rod=rod,
                thickness=thickness,
                radius=self.radius,
                refinement=refinement,
                fold=(fold[0] * rod, fold[1] * rod),
                finest=face.edge * (_FINEST_STICKING if self.sticking else _FINEST_SLIDING),
            )
        else:
            assert isinstance(self.indenter, Sphere)
            face = SphereFace(self.indenter.radius * _MM)
            widest = max(map(self._hertz_radius, self.goals))
            if coarse is not None:  # now it is known
                widest = 1.1 * max(state.contact_radius for state in coarse) * _MM
            if widest > min(self.radius / 2, 0.9 * face.radius):
                raise DomainError(
                    f"The contact would be up to {widest:.3g} mm wide, but the film's radius is "
                    f"{self.radius:g} mm and the sphere's {face.radius:g} mm.",
                    why="It must end well within both.",
                )
            mesh = mesh_below_a_sphere(
                contact=widest, thickness=thickness, radius=self.radius, refinement=refinement
            )
        elements = FilmElements(mesh, NeoHookean.of(self.film))
        upright = isinstance(self.indenter, Sphere) and self.sticking
        return Pressing(elements, face, self.sticking, upright=upright)

    def _hertz_radius(self, goal: Goal) -> float:
        """Return a contact radius of a sphere that is not exceeded, in mm.

        At a load it is that on a half-space; at a depth that of an incompressible film, which
        rises beside the contact.
        """
        R = self.indenter.extent * _MM
        if goal.is_load:
            return float(np.cbrt(0.75 * goal.value * R / (self.film.contact_modulus / 1e6)))
        return float(1.6 * np.sqrt(goal.value * R))

    def _start(self, pressing: Pressing) -> Pressed:
        """Return the untouched film, and the nodes that will touch first."""
        elements = pressing.elements
        nodes, goal = elements.surface, self.goals[0]
        r = elements.nodes[0][nodes]
        if isinstance(pressing.face, RodFace):
            reach, depth = pressing.face.flat, 0.0
        else:
            reach = 0.8 * self._hertz_radius(goal)
            depth = reach**2 / (self.indenter.extent * _MM)
        chosen = r <= reach * (1 + 1e-9)
        place = pressing.place_at(r[chosen])
        return Pressed(np.zeros(elements.size), depth, nodes[chosen], place)

    def _state(
        self, pressing: Pressing, step: Step, other: FiniteStrainState | None
    ) -> FiniteStrainState:
        """Return a state in SI units."""
        pressed, elements = step.pressed, pressing.elements
        wall = isinstance(self.indenter, Rod)
        contact = outermost(pressing, pressed) / _MM
        r, pressure, shear = interface_tractions(pressing, pressed)
        state = FiniteStrainState(
            film=self.film,
            indenter=self.indenter,
            sticking=self.sticking,
            load=pressed.load,
            depth=pressed.depth / _MM,
            contact_radius=min(contact, self.indenter.extent) if wall else contact,
            inside=FiniteStrainField(pressing, pressed),
            interface_r=r,
            interface_pressure=pressure,
            interface_shear=shear,
            elastic_energy=elements.energy(pressed.x) / _MM,
            work=None if pressing.upright else step.work / _MM,
            convergence=np.inf,
            steps=step.count,
            discretisation=(
                f"{elements.mesh.t.shape[1]} Taylor-Hood triangles (quadratic displacement, linear "
                f"pressure), {elements.size} unknowns"
            ),
        )
        return state if other is None else replace(state, convergence=_change(state, other))


def _change(state: FiniteStrainState, other: FiniteStrainState) -> float:
    """Return the largest relative difference of base stress, load and depth."""
    r = _SAMPLES * state.film.thickness
    stress = state.inside.base_normal(r)
    changed = np.max(np.abs(stress - other.inside.base_normal(r))) / np.max(np.abs(stress))
    return max(float(changed), abs(other.load / state.load - 1), abs(other.depth / state.depth - 1))


# Distance of the film's free edge from the axis, in thicknesses, where none is given.
_FREE_EDGE = 12.5


def press_at_finite_strain(
    film: ElasticFilm,
    indenter: Indenter,
    targets: tuple[Target, ...],
    *,
    friction: float,
    loading: str,
    interface: Interface,
    film_radius: float | None,
) -> list[Contact]:
    """Return the contacts at ``targets``, visited in their order.

    Raises
    ------
    DomainError
        If friction, loading, interface or indenter are not modelled at finite strain.
    ConvergenceError
        If no equilibrium is found; ``last`` is the last contact that was.
    """
    if not (friction == 0 or math.isinf(friction)) or not interface.rigid:
        raise DomainError(
            "At finite strain a contact slides freely (friction 0) or sticks (inf), between "
            f"surfaces that do not yield; here the friction is {friction:g}.",
            why="What lies between is solved for small strain only.",
            cure='Use friction 0 and inf, which bracket the others, or strain="linear".',
        )
    if math.isinf(friction) and loading == "incremental" and not isinstance(indenter, Rod):
        raise DomainError(
            f'At finite strain a {indenter.shape} that sticks is solved for loading="total" only.',
            why="Its contact grows, and a point would have to stick where it first touched.",
            cure='Give loading="total", where nothing in the contact has moved sideways.',
        )
    radius = film_radius if film_radius is not None else _FREE_EDGE * film.thickness
    return list(_pressed(film, indenter, targets, friction > 0, radius))


@lru_cache(maxsize=32)
def _pressed(
    film: ElasticFilm,
    indenter: Indenter,
    targets: tuple[Target, ...],
    sticking: bool,
    radius: float,
) -> tuple[Contact, ...]:

    values = [target.value for target in targets]
    by_load = isinstance(targets[0], Load)
    try:
        states = solve_finite_strain(
            film,
            indenter,
            loads=values if by_load else None,
            depths=None if by_load else values,
            sticking=sticking,
            radius=radius,
        )
    except ConvergenceError as error:
        if error.last is not None:
            error.last = _contact(error.last)  # type: ignore[arg-type]
        raise
    return tuple(_contact(state) for state in states)


def _contact(state: FiniteStrainState) -> Contact:
    order = np.argsort(state.interface_r, kind="stable")
    rod = isinstance(state.indenter, Rod)
    return Contact(
        film=state.film,
        indenter=state.indenter,
        load=state.load,
        depth=state.depth,
        contact_radius=state.contact_radius,
        stick_radius=state.contact_radius if state.sticking else 0.0,
        friction=math.inf if state.sticking else 0.0,
        loading="" if rod or not state.sticking else "total",
        backend="fem",
        convergence=state.convergence,
        steps=state.steps,
        discretisation=state.discretisation,
        traction=RingTraction(
            state.interface_r[order], state.interface_pressure[order], state.interface_shear[order]
        ),
        inside=state.inside,
        elastic_energy=state.elastic_energy,
        work=state.work,
        dissipated_energy=None if state.work is None else 0.0,
        strain="finite",
    )
