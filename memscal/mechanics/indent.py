"""Press an indenter on a film: the entry point of the mechanics."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import overload

import numpy as np

from memscal.errors import DomainError, InputError
from memscal.mechanics.contact import Contact
from memscal.mechanics.rod import RodSolution, solve_rod
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter, Rod
from memscal.model.validation import FloatArray, require_positive

__all__ = ["indent"]

_Several = Sequence[float] | FloatArray


@overload
def indent(
    film: ElasticFilm,
    indenter: Indenter,
    *,
    load: float | None = None,
    depth: float | None = None,
    friction: float = 0.0,
    loading: str = "incremental",
    backend: str = "hankel",
) -> Contact: ...
@overload
def indent(
    film: ElasticFilm,
    indenter: Indenter,
    *,
    load: _Several,
    depth: None = None,
    friction: float = 0.0,
    loading: str = "incremental",
    backend: str = "hankel",
) -> list[Contact]: ...
@overload
def indent(
    film: ElasticFilm,
    indenter: Indenter,
    *,
    load: None = None,
    depth: _Several,
    friction: float = 0.0,
    loading: str = "incremental",
    backend: str = "hankel",
) -> list[Contact]: ...
def indent(
    film: ElasticFilm,
    indenter: Indenter,
    *,
    load: float | _Several | None = None,
    depth: float | _Several | None = None,
    friction: float = 0.0,
    loading: str = "incremental",
    backend: str = "hankel",
) -> Contact | list[Contact]:
    r"""Press a rigid indenter on a bonded film, to a load or to a depth.

    Parameters
    ----------
    film : ElasticFilm
        The film; linear elastic, bonded to a rigid base.
    indenter : Rod
        The indenter.  This version solves the flat rod.
    load, depth : float or sequence of float
        Normal load in N, or indentation depth in m: one of them.
    friction : float
        Amontons' coefficient between rod and film: 0 (slides freely) or ``inf`` (sticks).
    loading : str
        ``"incremental"`` or ``"total"``.  Under a rod it makes no difference: the contact does
        not grow.
    backend : str
        ``"hankel"``.

    Returns
    -------
    Contact, or a list of them where ``load`` or ``depth`` is a sequence.

    Raises
    ------
    InputError
        If load or depth is not positive, or both or none are given.
    DomainError
        If the request lies outside what the model or this version can do.

    Notes
    -----
    Load and depth are proportional, :math:`P = 2 E^* a\,\delta\,\kappa(a/h, \nu)`.  The paper
    finds its sensor's output linear in the load, too.  See :mod:`memscal.mechanics.rod`.

    Examples
    --------
    The rod of the calibration, 1 N on a 2 mm film:

    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> contact = indent(film, Rod(radius=0.25e-3), load=1.0)
    >>> print(f"{contact.depth * 1e3:.3f} mm, {contact.load / contact.depth * 1e-3:.3f} N/mm")
    0.587 mm, 1.704 N/mm
    >>> [round(c.load, 3) for c in indent(film, Rod(radius=0.25e-3), depth=[1e-4, 2e-4])]
    [0.17, 0.341]
    """
    _check_request(indenter, friction, loading, backend)
    if (load is None) == (depth is None):
        raise InputError(
            "Give either a load or a depth" + (", not both." if load is not None else "."),
            why="One follows from the other.",
        )
    sticking = math.isinf(friction)
    solution = solve_rod(
        indenter.radius / film.thickness, float(film.poisson_ratio), sticking=sticking
    )
    stiffness = 2 * film.contact_modulus * indenter.radius * solution.stiffness_factor
    given = np.asarray(load if depth is None else depth, dtype=np.float64)
    if given.ndim > 1:
        raise InputError(f"The loads or depths have shape {given.shape}; give a flat list.")
    for value in given.flat:
        require_positive("load" if depth is None else "depth", value, "N" if depth is None else "m")
    loads, depths = (given, given / stiffness) if depth is None else (given * stiffness, given)
    contacts = [
        _rod_contact(film, indenter, solution, float(one_load), float(one_depth), friction)
        for one_load, one_depth in zip(loads.flat, depths.flat, strict=True)
    ]
    return contacts[0] if given.ndim == 0 else contacts


def _rod_contact(
    film: ElasticFilm,
    rod: Indenter,
    solution: RodSolution,
    load: float,
    depth: float,
    friction: float,
) -> Contact:
    if depth >= film.thickness:
        raise DomainError(
            f"Under {load:g} N the rod would sink {depth * 1e6:.4g} um into a film of "
            f"{film.thickness * 1e6:.4g} um.",
            why="Linear elasticity knows no such state.",
            cure="Lower the load or the depth, or check the film's modulus and thickness.",
        )
    terms = solution.pressure_terms.size
    return Contact(
        film=film,
        indenter=rod,
        load=load,
        depth=depth,
        contact_radius=rod.radius,
        stick_radius=rod.radius if math.isinf(friction) else 0.0,
        friction=float(friction),
        loading="",
        backend="hankel",
        convergence=solution.convergence,
        discretisation=f"{terms} spherical Bessel functions per traction, Gauss-Legendre in k",
        traction=solution.traction(rod.radius, load),
    )


def _check_request(indenter: Indenter, friction: float, loading: str, backend: str) -> None:
    """Refuse what this version cannot solve, and what makes no sense."""
    if loading not in ("incremental", "total"):
        raise InputError(f'loading is {loading!r}, but it is "incremental" or "total".')
    if math.isnan(friction) or friction < 0:
        raise InputError(f"friction is {friction:g}, but a friction coefficient is not negative.")
    if backend != "hankel":
        known = backend == "fem"
        raise (DomainError if known else InputError)(
            f"The backend {backend!r} is " + ("not in this version." if known else "not known."),
            cure='Use backend="hankel".',
        )
    if not isinstance(indenter, Rod):
        raise DomainError(
            f"The indenter is a {indenter.shape}, but this version solves the flat rod only.",
            cure="Press a Rod, or read the stress of another program from a reference file.",
        )
    if not (friction == 0 or math.isinf(friction)):
        raise DomainError(
            f"friction is {friction:g}, but under a rod this version knows 0 (slides freely) and "
            "inf (sticks).",
            why="In between, a ring at the rod's edge slips.  At the base, 0 and inf differ by "
            "about a thousandth for a rod much narrower than the film is thick.",
            cure="Use 0 and inf: they bracket every coefficient.",
        )
