"""From solved loading paths to a family: derivatives, sensitivities, and what is kept."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import ConvergenceError, DomainError, InputError, MemscalError
from memscal.formats.cache import ContactTable, find_contact_table, keep_contact_table, table_key
from memscal.friction.family import (
    LogDerivatives,
    ProfileFamily,
    bounded,
    poisson_ratios,
    scaled_changes,
)
from memscal.mechanics.contact import Contact
from memscal.mechanics.indent import indent
from memscal.mechanics.interface import Interface
from memscal.model.arrays import FloatArray, finite_vector, require_positive
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter, Sphere
from memscal.parallel import require_workers, worker_pool
from memscal.version import __version__

__all__ = [
    "STRONGER",
    "CacheFolder",
    "FamilySetup",
    "LoadingPath",
    "PathTables",
    "base_wavenumbers",
    "family_key",
    "find_table",
    "keep_table",
    "parameter_values",
    "require_loads",
    "require_sphere",
    "solve_paths",
]

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


CacheFolder = str | os.PathLike[str] | None
"""A folder in which families are kept; ``None`` keeps none."""

#: Raised where the same request gives other numbers within one version.
_REVISION = 1


def family_key(
    paths: Sequence[LoadingPath], values: FloatArray, scale: float, k: FloatArray
) -> str:
    """Return the SHA-256 of all that the numbers of a family depend on.

    Film, sphere, loads, friction, loading and interface of every path, the wavenumbers, and the
    version of the program; the film's name does not count.
    """
    plain = [asdict(path) for path in paths]
    for path in plain:
        path["film"].pop("name")
        if path["order"] == 0:
            path.pop("order")
    for path, own in zip(plain, paths, strict=True):
        path["law"] = type(own.interface.normal).__name__
    return table_key(
        {
            "version": __version__,
            "revision": _REVISION,
            "paths": plain,
            "values": values.tolist(),
            "scale": scale,
            "k": hashlib.sha256(k.tobytes()).hexdigest(),
        }
    )


def find_table(cache: CacheFolder, key: str) -> ContactTable | None:
    """Return the table that was kept under a key, or ``None``."""
    return None if cache is None else find_contact_table(cache, key)


def keep_table(cache: CacheFolder, key: str, table: ContactTable) -> None:
    """Keep a table in a folder; without a folder, do nothing."""
    if cache is not None:
        keep_contact_table(cache, key, table)


#: Factor by which the law of an interface is made stronger to see what that changes.
STRONGER = 1.2
#: The film passes nothing of exp(-kh) beyond this: 2e-9 of the load.
_LARGEST_KH = 20.0


@dataclass(frozen=True, eq=False)
class FamilySetup:
    """What all members of a family share.

    Parameters
    ----------
    film, indenter
        What is pressed on what.
    loads : ndarray, shape (L,)
        Loads in N.
    wavenumbers : Wavenumbers
        Where the transforms are taken.
    cache : path or None
        Where families are kept.
    workers : int
        Processes that share the work.
    order : int
        Zero for the normal stress, one for the shear.
    """

    film: ElasticFilm
    indenter: Sphere
    loads: FloatArray
    wavenumbers: Wavenumbers
    cache: CacheFolder
    workers: int
    order: int = 0

    @classmethod
    def of(
        cls,
        film: ElasticFilm,
        indenter: Indenter,
        loads: ArrayLike,
        *,
        reach: float,
        cache: CacheFolder,
        workers: int,
        order: int = 0,
    ) -> FamilySetup:
        """Check what was asked for.

        Raises
        ------
        InputError
            If the indenter is no sphere, or a load, the reach or the workers make no sense.
        """
        require_workers(workers)
        return cls(
            film,
            require_sphere(indenter),
            require_loads(loads),
            base_wavenumbers(film.thickness, reach),
            cache,
            workers,
            order,
        )

    def path(
        self, *, friction: float, loading: str = "incremental", interface: Interface | None = None
    ) -> LoadingPath:
        """Return the loading path of one member."""
        return LoadingPath(
            film=self.film,
            indenter=self.indenter,
            loads=tuple(float(load) for load in self.loads),
            friction=friction,
            loading=loading,
            interface=interface or Interface(),
            order=self.order,
        )

    def family(
        self,
        paths: Sequence[LoadingPath],
        *,
        name: str,
        loading: str,
        values: FloatArray,
        scale: float,
        a_length: bool = False,
        stronger: Sequence[LoadingPath] | None = None,
        notes: tuple[str, ...] = (),
    ) -> ProfileFamily:
        """Return the family of some paths.

        ``a_length`` says whether its values are lengths; ``stronger`` are the paths with an
        interface that is stronger by ``STRONGER``, where that makes a difference.
        """
        key = family_key(paths, values, scale, self.wavenumbers.k)
        table = find_table(self.cache, key)
        if table is None:
            lengths = (values, scale) if a_length else None
            table = self._calculated(paths, stronger, values, lengths)
            keep_table(self.cache, key, table)
        return ProfileFamily(
            name=name,
            loading=loading,
            wavenumbers=self.wavenumbers,
            loads=self.loads,
            values=values,
            scale=scale,
            spectra=table.spectra,
            by_load=table.by_load,
            changes=table.changes,
            depths=table.depth,
            contact_radii=table.contact_radius,
            convergence=table.convergence,
            notes=notes,
            order=self.order,
        )

    def _calculated(
        self,
        paths: Sequence[LoadingPath],
        stronger: Sequence[LoadingPath] | None,
        values: FloatArray,
        lengths: tuple[FloatArray, float] | None,
    ) -> ContactTable:
        """Solve the paths and derive what follows from them."""
        ratios = poisson_ratios(self.film)
        # The strength of an interface counts beside a length of film or sphere alone.
        uncertain = self.film.thickness_uncertainty or self.indenter.radius_uncertainty
        own, strong, *sides = self._solved(paths, (uncertain and stronger) or paths, ratios)
        by_length = np.zeros_like(own.spectra)
        if lengths is not None:
            by_length = _by_log_value(own.spectra, *lengths)
        by_strength = (strong.spectra - own.spectra) / math.log(STRONGER)
        changes: Mapping[str, FloatArray] = scaled_changes(
            self.film,
            self.indenter,
            LogDerivatives(own.spectra, own.by_load, own.by_wavenumber, by_length, by_strength),
        )
        if ratios is not None:
            share = (self.film.poisson_ratio_uncertainty or 0.0) / (ratios[0] - ratios[1])
            difference = sides[0].spectra - sides[1].spectra
            changes = {**changes, "poisson_ratio": difference * share}
        return ContactTable(
            value=values,
            load=self.loads,
            k=self.wavenumbers.k,
            spectra=own.spectra,
            by_load=own.by_load,
            changes=changes,
            depth=own.depths,
            contact_radius=own.contact_radii,
            convergence=own.convergence,
        )

    def _solved(
        self,
        paths: Sequence[LoadingPath],
        stronger: Sequence[LoadingPath],
        ratios: tuple[float, float] | None,
    ) -> list[PathTables]:
        """Solve the paths, the stronger ones and those of other Poisson's ratios, each once."""
        groups = [list(paths)]
        groups.append([p if p in paths else replace(p, derivatives=False) for p in stronger])
        for nu in ratios or ():
            film = replace(self.film, poisson_ratio=nu)
            own = nu == self.film.poisson_ratio
            groups.append([replace(path, film=film, derivatives=own) for path in paths])
        wanted = list(dict.fromkeys(path for group in groups for path in group))
        found = solve_paths(wanted, self.wavenumbers.k, workers=self.workers)
        known = dict(zip(wanted, found, strict=True))
        return [_stacked([known[path] for path in group]) for group in groups]


def base_wavenumbers(thickness: float, reach: float) -> Wavenumbers:
    """Return nodes for all that reaches the base of a film, seen out to ``reach`` (m).

    Raises
    ------
    InputError
        If the reach is not positive.
    """
    require_positive("reach", reach, "m")
    return Wavenumbers.covering(_LARGEST_KH / thickness, reach)


def require_sphere(indenter: Indenter) -> Sphere:
    """Return the indenter; refuse one that is no sphere.

    Raises
    ------
    InputError
        If it is no sphere.
    """
    if isinstance(indenter, Sphere):
        return indenter
    raise InputError(
        f"Profiles were asked for under a {indenter.shape}, but a sphere is needed.",
        why="Friction shows under an indenter whose contact grows with the load.",
        cure="Give the sphere of the contact scan.",
    )


def require_loads(loads: ArrayLike) -> FloatArray:
    """Return loads (N) as an array.

    Raises
    ------
    InputError
        If one of them is not finite and positive, or there is none.
    """
    found = finite_vector("loads", np.atleast_1d(np.asarray(loads, dtype=np.float64)))
    for load in found:
        require_positive("load", float(load), "N")
    return found


def parameter_values(what: str, values: Sequence[float]) -> FloatArray:
    """Return the values of a parameter as an array.

    Raises
    ------
    InputError
        If there is none, one is negative or no number, or they do not increase.
    """
    found = np.asarray(values, dtype=np.float64)
    if found.ndim != 1 or found.size == 0 or np.any(np.isnan(found)) or np.any(found < 0):
        raise InputError(f"The {what} are {values!r}, but they are a list, none of them negative.")
    if np.any(np.diff(found) <= 0):
        raise InputError(
            f"The {what} {', '.join(f'{value:g}' for value in found)} do not increase.",
            cure="Sort them, and give each once.",
        )
    return found


def _stacked(tables: Sequence[PathTables]) -> PathTables:
    """Return the tables of the members as one, with a first axis over the members."""
    names = PathTables.__dataclass_fields__
    return PathTables(*(np.stack([getattr(one, name) for one in tables]) for name in names))


def _by_log_value(spectra: FloatArray, values: FloatArray, scale: float) -> FloatArray:
    r"""Return :math:`t(1-t)\,\partial/\partial t`: the derivatives by the value's logarithm."""
    if values.size == 1:
        return np.zeros_like(spectra)
    from scipy.interpolate import PchipInterpolator

    t = np.array([bounded(float(value), scale) for value in values])
    slopes = PchipInterpolator(t, spectra, axis=0)(t, 1)
    return np.asarray((t * (1 - t))[:, None, None] * slopes)
