"""Contacts on rings, which are doubled until base stress, load and depth have settled."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache

import numpy as np

from memscal.errors import ConvergenceError, DomainError
from memscal.mechanics.contact import Contact, too_deep
from memscal.mechanics.elements.element_film import ElementFilm
from memscal.mechanics.film_response import HankelFilm, RingTraction
from memscal.mechanics.interface import Interface
from memscal.mechanics.solver.path import PathPoint, follow
from memscal.mechanics.solver.step import ContactProblem, ContactState, Load, Target
from memscal.model.arrays import FloatArray, value_record
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter, Rod

# Rings beyond the largest contact, so that it can end where it will.
_MARGIN = 4
# Shrinkage of the spacing at a contact's edge, and its growth with the distance from there.
_FINEST = 1 / 16
_GROWTH = 0.4
# A rod's rings crowd as the fourth power of their number counted from the edge.
_CROWDING = 4.0
# Radii at which the spacing is tabulated.
_PLACING_SAMPLES = 100_001


def _rings(request: RingRequest, edges: Sequence[float], reach: float, count: int) -> FloatArray:
    """Return ``count`` even rings up to ``reach`` (m), and more at the expected ``edges`` (m)."""
    from scipy.integrate import cumulative_trapezoid

    if isinstance(request.indenter, Rod):
        # They crowd towards the edge; the last is on it.
        return request.indenter.radius * (1.0 - np.linspace(1.0, 0.0, count) ** _CROWDING)
    spacing = reach / count
    r = np.linspace(0.0, reach + _MARGIN * spacing, _PLACING_SAMPLES)
    near = np.sort(edges)
    distance = r - near[np.searchsorted((near[1:] + near[:-1]) / 2, r)]
    # Where the number of rings passed so far is whole, there is one.
    density = 1 / np.minimum(spacing, np.hypot(_FINEST * spacing, _GROWTH * distance))
    passed = cumulative_trapezoid(density, r, initial=0)
    return np.interp(np.arange(math.floor(passed[-1]) + 1), passed, r)


_FEWEST_RINGS = 48
_MOST_RINGS = 384
# Rings are doubled until base stress, load and depth change by less than this ...
_SETTLED = 1e-4
# ... and a solution that changes by more than this is refused.
_TOLERABLE = 5e-3
# Rings of the coarse contact that tells where to place the others.
_COARSE = 40
# A film responds like a column at every point of a contact wider than so many thicknesses.
_WIDEST = 100.0
# Where the pressure is below this share of its largest, there is no contact.
_EDGE = 1e-3
# Radii at which the base stress of two solutions is compared.
_REQUEST_SAMPLES = 24
# Distance of the film's free edge from the contact, in thicknesses, where none is given.
_FREE_EDGE = 12.0


@value_record
class RingRequest:
    """What is asked for; its content is the key under which a solution is remembered."""

    film: ElasticFilm
    indenter: Indenter
    interface: Interface
    targets: tuple[Target, ...]
    friction: float
    loading: str
    backend: str
    film_radius: float | None
    rings: int | None
    compared: bool = True  # with fewer rings; the convergence is unknown otherwise


@lru_cache(maxsize=64)
def solve_on_rings(request: RingRequest) -> tuple[Contact, ...]:
    """Return the contacts of a request, in its order."""
    edges, reach = _expected(request)
    count = request.rings or _FEWEST_RINGS
    if not request.compared:
        return tuple(_solve(request, _rings(request, edges, reach, count)))
    coarse = _solve(request, _rings(request, edges, reach, max(count // 2, 8)))
    while True:
        edges = [contact.contact_radius for contact in coarse]
        fine = _solve(request, _rings(request, edges, reach, count))
        changes = [_change(request, *pair) for pair in zip(fine, coarse, strict=True)]
        if max(changes) < _SETTLED or request.rings or 2 * count > _MOST_RINGS:
            break
        count = 2 * count
        coarse = fine
    contacts = [replace(c, convergence=change) for c, change in zip(fine, changes, strict=True)]
    if max(changes) > _TOLERABLE:
        error = ConvergenceError(
            f"On {count} rings the contact still changes by {max(changes):.1g} of its largest base "
            "stress, its load or its depth when they are doubled.",
            why=f"The largest change allowed is {_TOLERABLE:g}.",
            cure="Give more rings, or ask for a state nearer to one that was solved.",
        )
        error.last = contacts[-1]
        raise error
    return tuple(contacts)


def _expected(request: RingRequest) -> tuple[list[float], float]:
    """Return the contact radii to expect and how far pressure reaches (m), by a coarse contact."""
    if isinstance(request.indenter, Rod):
        return [], request.indenter.radius
    film = request.film
    # Doubled until the contact ends within the rings; shortened until it fills a good part of them.
    reach = film.thickness
    while True:
        model = _even_film(film, reach)
        rings = model.r
        try:
            points = [] if _overflows(request, model) else _follow(request, model)
        except ConvergenceError:
            # A contact that has run off the rings may not settle.
            if reach > _WIDEST * film.thickness:
                raise
            reach *= 2
            continue
        states = [point.state for point in points]
        filled = max((np.flatnonzero(s.pressure > 0)[-1] for s in states), default=_COARSE)
        if filled >= _COARSE - 4:
            reach *= 2
        elif filled < _COARSE // 3 and reach > 1e-6 * film.thickness:
            reach *= max(1.5 * filled / _COARSE, 0.05)
        else:
            break
        if reach > _WIDEST * film.thickness:
            raise DomainError(
                f"The contact would be more than {_WIDEST:g} times as wide as the film is thick.",
                why="Such a film responds like a column at every point, not like a layer.",
                cure="Lower the load or the depth, or check the units of film and indenter.",
            )
    within = rings[filled + 1]
    if within > request.indenter.extent:
        raise DomainError(
            f"The contact would reach the end of the {request.indenter.shape}, "
            f"{request.indenter.extent * 1e3:.4g} mm from its axis.",
            why="Its face is not known beyond.",
            cure="Lower the load or the depth, or extend the profile.",
        )
    return [_contact_radius(request, rings, state) for state in states], within


def _overflows(request: RingRequest, model: HankelFilm) -> bool:
    """Whether a contact fills all rings: without friction, at once; with it, it is hardly less."""
    farthest = max(request.targets, key=lambda target: target.value)
    smooth = replace(request, targets=(farthest,), friction=0.0, interface=Interface())
    with suppress(ConvergenceError):
        return bool(_follow(smooth, model)[0].state.pressure[-1] > 0)
    return False


@lru_cache(maxsize=16)
def _even_film(film: ElasticFilm, reach: float) -> HankelFilm:
    """Return a film with even rings up to ``reach`` (m): several coefficients share it."""
    return HankelFilm(film, np.linspace(0.0, reach, _COARSE))


def _follow(request: RingRequest, model: HankelFilm | ElementFilm) -> list[PathPoint]:
    rings = model.compliance.r
    film = request.film
    heights = request.indenter.height(rings)
    problem = ContactProblem(film, model.compliance, heights, request.friction, request.interface)
    # Between rigid surfaces a step is a ring; where nothing touches all at once, as many steps.
    return follow(problem, request.targets, request.loading, increments=rings.size)


def _solve(request: RingRequest, rings: FloatArray) -> list[Contact]:
    """Return the contacts on ``rings`` (m)."""
    model: HankelFilm | ElementFilm
    if request.backend == "fem":
        radius = request.film_radius or rings[-1] + _FREE_EDGE * request.film.thickness
        model = ElementFilm(request.film, rings, radius)
    else:
        model = HankelFilm(request.film, rings)
    try:
        points = _follow(request, model)
    except ConvergenceError as error:
        if isinstance(error.last, PathPoint):
            error.last = _contact(request, model, error.last)
        raise
    contacts = (_contact(request, model, point) for point in points)
    # The targets are met to rounding; a contact has the target's own value.
    return [
        replace(c, load=t.value) if isinstance(t, Load) else replace(c, depth=t.value)
        for c, t in zip(contacts, request.targets, strict=True)
    ]


def _contact(request: RingRequest, model: HankelFilm | ElementFilm, point: PathPoint) -> Contact:
    state = point.state
    rings = model.compliance.r
    if state.depth >= request.film.thickness:
        raise too_deep(request.film, request.indenter, state.load, state.depth)
    radius = _contact_radius(request, rings, state)
    count = np.count_nonzero(state.pressure > 0)
    return Contact(
        film=request.film,
        indenter=request.indenter,
        interface=request.interface,
        load=state.load,
        depth=state.depth,
        contact_radius=radius,
        stick_radius=_stick_radius(request, rings, state, radius),
        friction=request.friction,
        loading="" if isinstance(request.indenter, Rod) else request.loading,
        backend=request.backend,
        convergence=math.nan,
        steps=point.steps,
        discretisation=f"{count} rings in contact, {model.discretisation}",
        traction=RingTraction(rings, state.pressure, state.shear),
        inside=model.field(state.pressure, state.shear),
        elastic_energy=point.elastic_energy,
        work=point.work,
        dissipated_energy=point.dissipated_energy,
    )


def _contact_radius(request: RingRequest, rings: FloatArray, state: ContactState) -> float:
    """Return the radius in m at which the pressure ends."""
    if isinstance(request.indenter, Rod):
        return request.indenter.radius
    p = state.pressure
    if request.interface.normal_law:
        # Without an edge: where the pressure has fallen to a small share of its largest.
        edge = _EDGE * p.max()
        last = np.flatnonzero(p > edge)[-1]
        around = slice(last, last + 2)
        return float(np.interp(-edge, -p[around], rings[around]))
    last = np.flatnonzero(p > 0)[-1]
    if last == 0:
        return float(rings[1]) / 2
    # The pressure ends like a square root: its square falls in proportion to r^2.
    inner = p[last - 1] ** 2
    outer = p[last] ** 2
    if inner <= outer:
        return float(rings[last])
    area = rings[last] ** 2
    edge = math.sqrt(area + outer / (inner - outer) * (area - rings[last - 1] ** 2))
    return float(min(edge, rings[last + 1]))


def _stick_radius(
    request: RingRequest, rings: FloatArray, state: ContactState, contact_radius: float
) -> float:
    """Return the radius in m within which the film sticks."""
    sticking = np.flatnonzero(state.touching & (state.slip == 0) & (state.pressure > 0))
    last = sticking.max(initial=0)
    if last == 0 or request.friction == 0:
        return 0.0
    if last + 1 >= rings.size or not state.touching[last + 1]:
        return contact_radius
    return min(contact_radius, float(rings[last] + rings[last + 1]) / 2)


def _change(request: RingRequest, fine: Contact, coarse: Contact) -> float:
    """Return the change of a contact from one on fewer rings."""
    reach = fine.contact_radius + 3 * fine.film.thickness
    radius = request.film_radius
    if radius is not None:
        # In the corner between the base and a free edge the stress is singular.
        reach = min(reach, max(radius - fine.film.thickness, radius / 2))
    return relative_change(fine, coarse, np.linspace(0.0, reach, _REQUEST_SAMPLES))


def relative_change(fine: Contact, coarse: Contact, r: FloatArray) -> float:
    """Return the largest relative change of base stress at ``r`` (m), load and depth."""
    stress = fine.base_stress(r)
    by_stress = np.max(abs(stress - coarse.base_stress(r))) / np.max(abs(stress))
    by_load = abs(coarse.load / fine.load - 1)
    by_depth = abs(coarse.depth / fine.depth - 1)
    return float(max(by_stress, by_load, by_depth))
