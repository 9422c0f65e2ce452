"""One loading path, solved and kept as transforms: what a process is given, and gives back."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from memscal.calibration.workers import worker_pool
from memscal.errors import ConvergenceError, DomainError, MemscalError
from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import indent
from memscal.mechanics.interface import Interface
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere
from memscal.model.validation import FloatArray

__all__ = ["LoadingPath", "PathTables", "solve_paths"]

#: Neighbours of each load on the path, relative to it: their difference is its derivative.
_NEIGHBOURS = (0.98, 1.02)
#: Rings from the axis to the largest contact; more crowd at the edges.  Three times as many change
#: the base stress by less than 1e-4 of its maximum between rigid surfaces, and by less than 7e-4
#: where the interface yields.
_RINGS_OF_A_RIGID_CONTACT = 56
_RINGS_OF_A_COMPLIANT_CONTACT = 72
#: Tried in turn where the statuses of the rings do not settle: a film that sticks at once may find
#: no edge between two rings, and does between others.
_OTHER_RINGS = (80, 64, 48, 112)
#: Relative step of the derivative by the wavenumber.
_STRETCH = 1e-4


@dataclass(frozen=True, kw_only=True)
class LoadingPath:
    """A loading of one film with one interface.

    Parameters
    ----------
    film, indenter, interface
        What is pressed on what, and what is between them.
    loads : tuple of float
        Loads at which the contact is looked at, in N, in any order; they are visited upward.
    friction : float
        Amontons' coefficient.
    loading : str
        ``"incremental"`` or ``"total"``.
    derivatives : bool
        Whether the derivatives by load and wavenumber are wanted too.
    order : int
        Zero for the normal stress at the base, one for the shear.
    """

    film: ElasticFilm
    indenter: Sphere
    loads: tuple[float, ...]
    friction: float = 0.0
    loading: str = "incremental"
    interface: Interface = field(default_factory=Interface)
    derivatives: bool = True
    order: int = 0


@dataclass(frozen=True, eq=False)
class PathTables:
    """What a path shows at its L loads and K wavenumbers, spectra and derivatives in N.

    ``by_load`` and ``by_wavenumber`` are derivatives by the logarithms; zero where not wanted.
    """

    spectra: FloatArray
    by_load: FloatArray
    by_wavenumber: FloatArray
    depths: FloatArray
    contact_radii: FloatArray
    convergence: FloatArray


def solve_paths(paths: Sequence[LoadingPath], k: FloatArray, *, workers: int) -> list[PathTables]:
    """Return the tables of several paths at ``k`` (rad/m), solved in one or more processes.

    Each path is solved by itself, so that the number of processes changes no bit of the result.

    Raises
    ------
    DomainError
        If a load lies outside what the model holds for.
    ConvergenceError
        If a contact does not settle.
    """
    several = min(workers, len(paths))
    if several < 2:
        return [_solve(path, k) for path in paths]
    with worker_pool(several) as pool:
        return list(pool.map(_solve, paths, [k] * len(paths)))


def _solve(path: LoadingPath, k: FloatArray) -> PathTables:
    loads = np.array(path.loads)
    factors = np.array([1.0, *_NEIGHBOURS] if path.derivatives else [1.0])
    visited = np.multiply.outer(factors, loads)
    order = np.argsort(visited, axis=None, kind="stable")
    found = _contacts(path, visited.ravel()[order])
    contacts = [found[place] for place in np.argsort(order)]
    own = contacts[: loads.size]
    spectra = np.array([_spectrum(path, contact, k) for contact in own])
    by_load = by_wavenumber = np.zeros_like(spectra)
    if path.derivatives:
        lower, upper = (
            np.array([_spectrum(path, each, k) for each in contacts[first:][: loads.size]])
            for first in (loads.size, 2 * loads.size)
        )
        # By P d/dP and not by the logarithm's own step: the force is then met exactly.
        by_load = (upper - lower) / (_NEIGHBOURS[1] - _NEIGHBOURS[0])
        by_wavenumber = np.array([_by_log_wavenumber(path, contact, k) for contact in own])
    return PathTables(
        spectra,
        by_load,
        by_wavenumber,
        np.array([contact.depth for contact in own]),
        np.array([contact.contact_radius for contact in own]),
        np.array([contact.convergence for contact in own]),
    )


def _by_log_wavenumber(path: LoadingPath, contact: Contact, k: FloatArray) -> FloatArray:
    above, below = (_spectrum(path, contact, k * (1 + step)) for step in (_STRETCH, -_STRETCH))
    return (above - below) / (2 * _STRETCH)


def _spectrum(path: LoadingPath, contact: Contact, k: FloatArray) -> FloatArray:
    return contact.base_shear_spectrum(k) if path.order else contact.base_spectrum(k)


def _contacts(path: LoadingPath, loads: FloatArray) -> list[Contact]:
    """Solve the contacts; an error names the loads and the interface that it was about."""
    rigid = path.interface.rigid
    usual = _RINGS_OF_A_RIGID_CONTACT if rigid else _RINGS_OF_A_COMPLIANT_CONTACT
    counts = (usual, *_OTHER_RINGS)
    for rings in counts:
        try:
            return indent(
                path.film,
                path.indenter,
                load=loads,
                friction=path.friction,
                # Without friction the way makes no difference, and the solution is remembered.
                loading=path.loading if path.friction > 0 else "incremental",
                interface=path.interface,
                rings=rings,
            )
        except ConvergenceError as error:
            if rings == counts[-1]:
                raise _named(path, error) from error
        except DomainError as error:
            raise _named(path, error) from error
    raise AssertionError("one of the attempts returns or raises")


def _named(path: LoadingPath, error: DomainError | ConvergenceError) -> MemscalError:
    """Return the error with what it was about."""
    problem = (
        f"The contact of a sphere of radius {path.indenter.radius * 1e3:.4g} mm with a film of "
        f"{path.film.thickness * 1e3:.4g} mm cannot be calculated up to {max(path.loads):g} N "
        f"(friction {path.friction:g}, {path.loading} loading): {error.problem}"
    )
    return type(error)(problem, why=error.why, cure=error.cure)
