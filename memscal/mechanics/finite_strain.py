"""Contacts with a neo-Hookean film at finite strain, in the form of all other contacts."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from memscal.errors import ConvergenceError, DomainError
from memscal.mechanics.contact import Contact
from memscal.mechanics.interface import Interface
from memscal.mechanics.rings import RingTraction
from memscal.mechanics.solver.problem import Load, Target
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter, Rod

if TYPE_CHECKING:
    from memscal.mechanics.elements.finite_strain_state import FiniteStrainState

__all__ = ["press_at_finite_strain"]

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
    from memscal.mechanics.elements.finite_strain import solve_finite_strain

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
