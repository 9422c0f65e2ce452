"""From solved loading paths to a family: derivatives, sensitivities, and what is kept."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.calibration.workers import require_workers
from memscal.errors import InputError
from memscal.formats.contact_table import ContactTable
from memscal.friction.cache import CacheFolder, family_key, find_table, keep_table
from memscal.friction.family import ProfileFamily, bounded
from memscal.friction.paths import LoadingPath, PathTables, solve_paths
from memscal.friction.sensitivities import LogDerivatives, poisson_ratios, scaled_changes
from memscal.mechanics.interface import Interface
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter, Sphere
from memscal.model.validation import FloatArray, finite_vector, require_positive

__all__ = [
    "STRONGER",
    "FamilySetup",
    "base_wavenumbers",
    "parameter_values",
    "require_loads",
    "require_sphere",
]

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
