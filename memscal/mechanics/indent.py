"""Indentation of a film by a rigid indenter: the entry point of the mechanics."""

import math
from collections.abc import Sequence
from functools import partial
from typing import Literal, TypedDict, Unpack, overload

import numpy as np

from memscal.errors import InputError
from memscal.extensions import hook
from memscal.mechanics.contact import Contact, too_deep
from memscal.mechanics.film_response import HankelField
from memscal.mechanics.interface import Interface
from memscal.mechanics.rod import solve_rod
from memscal.mechanics.solver.refinement import RingRequest, solve_on_rings
from memscal.mechanics.solver.step import Depth, Load, Target
from memscal.model.arrays import FloatArray, require_positive
from memscal.model.film import LINEAR, ElasticFilm, more_and_less
from memscal.model.indenter import Indenter, Rod
from memscal.parallel import single_threaded
from memscal.progress import Listener, reported

Loading = Literal["incremental", "total"]
_Several = Sequence[float] | FloatArray

# Fewer rings than this resolve no contact.
_FEWEST_RINGS = 16
#: Contacts whose depths differ by less than this share are one.
_SAME = 1e-6


class _Options(TypedDict, total=False):
    friction: float
    loading: Loading
    backend: Literal["hankel", "fem"]
    interface: Interface | None
    strain: Literal["linear", "finite"] | None
    film_radius: float | None
    rings: int | None
    progress: Listener


@overload
def indent(
    film: ElasticFilm,
    indenter: Indenter,
    *,
    load: float | None = None,
    depth: float | None = None,
    **options: Unpack[_Options],
) -> Contact: ...
@overload
def indent(
    film: ElasticFilm,
    indenter: Indenter,
    *,
    load: _Several | None = None,
    depth: _Several | None = None,
    **options: Unpack[_Options],
) -> list[Contact]: ...
@reported
@single_threaded()
def indent(
    film: ElasticFilm,
    indenter: Indenter,
    *,
    load: float | _Several | None = None,
    depth: float | _Several | None = None,
    friction: float = 0.0,
    loading: str = "incremental",
    backend: str = "hankel",
    interface: Interface | None = None,
    strain: str | None = None,
    film_radius: float | None = None,
    rings: int | None = None,
    progress: Listener = None,  # noqa: ARG001 - @reported
) -> Contact | list[Contact]:
    r"""Press a rigid indenter on a bonded film, to a load or to a depth.

    Parameters
    ----------
    film, indenter : ElasticFilm, Indenter
        The film, bonded to a rigid base, and a Rod, Sphere, Cone or Profile.
    load, depth : float or sequence of float
        Normal load in N, or indentation depth in m: one of them.  A sequence is a path: its
        states are visited in the order given, also downward (unloading) and up again.
    friction : float
        Amontons' coefficient between indenter and film, from 0 (slides freely) to ``inf``
        (sticks wherever it touches).
    loading : str
        ``"incremental"``: as in a slow loading, a point of the film sticks where it first
        touched.  ``"total"``: every state is reached in one step from the untouched film; with
        ``friction=inf`` nothing in the contact has moved sideways.  Under a rod, whose contact
        does not grow, both are the same.
    backend : str
        ``"hankel"``: Hankel transforms on a film of infinite extent.  ``"fem"``: finite elements
        on a film with a free edge; slower, and independent.
    interface : Interface, optional
        Compliance of the interface; rigid by default.
    strain : str, optional
        ``"linear"``: small strain, whatever the film's law; ``"finite"``: by finite elements, under
        a rod or a sphere that slides freely or sticks (a sphere with loading ``"total"``), a film
        that states no law as neo-Hookean.  By default a rod is pressed as the film's law has it,
        and other indenters, which sink less, at small strain.
    film_radius : float, optional
        Radius of the film's free edge in m, for finite elements; by default twelve thicknesses
        away from the contact.
    rings : int, optional
        Rings from the axis to the largest contact, at least 16.  By default they are doubled
        until base stress, load and depth change by less than 1e-4.
    progress : callable or True, optional
        Told how far it is, of loads or of the loading at finite strain: :class:`memscal.Progress`.

    Returns
    -------
    Contact, or a list of them where ``load`` or ``depth`` is a sequence.

    Raises
    ------
    InputError
        If an argument makes no sense, or if load and depth are both or neither given.
    DomainError
        If the contact outgrows the film or the indenter's known face, or the indenter would pass
        through the film.
    ConvergenceError
        If the contact does not settle, or has not converged; ``last`` is the last one solved.

    Notes
    -----
    Contact is unilateral, friction Amontons' (``mechanics.solver.step``).  A rod that
    slides freely or sticks is solved to higher accuracy (``mechanics.rod``).  Solutions
    are cached: the same request is answered at once.

    Examples
    --------
    The rod of the calibration, 1 N on a 2 mm film:

    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> contact = indent(film, Rod(radius=0.25e-3), load=1.0)
    >>> print(f"{contact.depth * 1e3:.3f} mm, {contact.load / contact.depth * 1e-3:.3f} N/mm")
    0.587 mm, 1.704 N/mm

    The paper's sphere, with friction, along a loading:

    >>> from memscal.model.indenter import Sphere
    >>> sphere = Sphere(radius=128.8e-3)
    >>> for contact in indent(film, sphere, load=[0.34, 1.37], friction=0.3):
    ...     print(f"{contact.depth * 1e6:.1f} um, {contact.contact_radius * 1e3:.2f} mm")
    16.9 um, 1.98 mm
    30.7 um, 2.83 mm
    """
    by_law = isinstance(indenter, Rod) and film.law not in ("", LINEAR)
    strain = strain or ("finite" if by_law else "linear")
    _check_request(friction, loading, backend, strain, rings)
    if film_radius is not None:
        require_positive("film_radius", film_radius, "m")
        if backend == "hankel" and strain == "linear":
            raise InputError(
                f"film_radius is {film_radius * 1e3:g} mm, but by Hankel transforms a film has no "
                "end.",
                cure='Use backend="fem" for a film with a free edge.',
            )
    if (load is None) == (depth is None):
        raise InputError(
            "Give either a load or a depth" + (", not both." if load is not None else "."),
            why="One follows from the other.",
        )
    values = np.asarray(load if depth is None else depth, np.float64)
    if values.ndim > 1 or values.size == 0:
        raise InputError(f"The loads or depths have shape {values.shape}; give a flat list.")
    for value in values.flat:
        require_positive("load" if depth is None else "depth", value, "N" if depth is None else "m")
    kind = Load if depth is None else Depth
    targets = tuple(kind(float(value)) for value in values.flat)
    interface = interface or Interface()
    friction = float(friction)
    request = RingRequest(
        film, indenter, interface, targets, friction, loading, backend, film_radius, rings
    )
    slides_or_sticks = friction == 0 or math.isinf(friction)
    # Without friction there is nothing for a slip length to act on.
    rigid = interface.rigid or (friction == 0 and not interface.normal_law)
    if strain == "finite":
        contacts = hook("press_at_finite_strain")(request)
    elif isinstance(indenter, Rod) and slides_or_sticks and rigid and backend == "hankel":
        contacts = tuple(_rod_contact(film, indenter, target, friction) for target in targets)
    else:
        contacts = solve_on_rings(request)
    return list(contacts) if values.ndim else contacts[0]


def changes_by_inputs(contact: Contact) -> list[tuple[Contact, Contact, float]]:
    """Return contacts with more and less of each uncertain input, and u over its difference."""
    names = ("film", "indenter", "load", "friction", "backend", "interface", "strain")
    settings = {name: getattr(contact, name) for name in names}
    again = partial(indent, loading=contact.loading or "incremental", **settings)
    if abs(again().depth / contact.depth - 1) > max(_SAME, 2 * contact.convergence):
        raise InputError(
            "The contact was not reached by loading alone, or in a film of its own radius.",
            why="Its depth is not that of one loading to its load, which is what can be repeated "
            "with other properties.",
            cure="Ask a contact of a single load for its uncertainties.",
        )
    varied = []
    for name in ("young_modulus", "poisson_ratio", "thickness", "radius"):
        holder = "indenter" if name == "radius" else "film"
        ends = more_and_less(settings[holder], name)
        if ends:
            more, less, share = ends
            varied.append((again(**{holder: more}), again(**{holder: less}), share))
    return varied


def _rod_contact(film: ElasticFilm, rod: Rod, target: Target, friction: float) -> Contact:
    """Return the solution in spherical Bessel functions."""
    radius = rod.radius
    sticking = math.isinf(friction)
    solution = solve_rod(radius / film.thickness, film.poisson_ratio, sticking=sticking)
    stiffness = 2 * film.contact_modulus * radius * solution.stiffness_factor
    load = target.value if isinstance(target, Load) else target.value * stiffness
    depth = target.value if isinstance(target, Depth) else target.value / stiffness
    if depth >= film.thickness:
        raise too_deep(film, rod, load, depth)
    terms = solution.pressure_terms.size
    traction = solution.traction(radius, load)
    return Contact(
        film=film,
        indenter=rod,
        load=load,
        depth=depth,
        contact_radius=radius,
        stick_radius=radius if sticking else 0.0,
        friction=friction,
        loading="",
        backend="hankel",
        convergence=solution.convergence,
        steps=1,
        discretisation=f"{terms} spherical Bessel functions per traction, Gauss-Legendre in k",
        traction=traction,
        inside=HankelField(film, traction),
        elastic_energy=load * depth / 2,
        work=load * depth / 2,
        dissipated_energy=0.0,
    )


def _check_request(
    friction: float, loading: str, backend: str, strain: str, rings: int | None
) -> None:
    for name, value, choices in (
        ("loading", loading, ("incremental", "total")),
        ("backend", backend, ("hankel", "fem")),
        ("strain", strain, ("linear", "finite")),
    ):
        if value not in choices:
            raise InputError(f'{name} is {value!r}, but it is "{choices[0]}" or "{choices[1]}".')
    if math.isnan(friction) or friction < 0:
        raise InputError(f"friction is {friction:g}, but a friction coefficient is not negative.")
    if rings is not None and strain == "finite":
        raise InputError(
            "rings are given, but at finite strain the surface has none: it moves with its mesh.",
            cure="Leave them out.",
        )
    if rings is not None and rings < _FEWEST_RINGS:
        raise InputError(
            f"rings is {rings}, but a contact takes at least {_FEWEST_RINGS}.",
            cure="Leave it out: rings are then doubled until the contact has converged.",
        )
