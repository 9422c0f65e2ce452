"""Families of calculated base stresses: from film, sphere and loads to transforms."""

from __future__ import annotations

import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.calibration.workers import require_workers
from memscal.errors import InputError
from memscal.friction.family import ProfileFamily
from memscal.friction.paths import LoadingPath, PathTables, solve_paths
from memscal.friction.sensitivities import poisson_ratios, scaled_changes
from memscal.mechanics.interface import Interface
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Indenter, Sphere
from memscal.model.validation import FloatArray, finite_vector, require_positive

__all__ = [
    "FRICTIONS",
    "amontons_family",
]

FRICTIONS = (0.0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.4, 0.6, 1.0, math.inf)
"""Friction coefficients between which profiles are interpolated to 1e-3 of their maximum."""

#: Friction at the middle of the bounded coordinate: there a sphere's contact begins to stick.
_FRICTION_SCALE = 0.3
#: The film passes nothing of exp(-kh) beyond this: 2e-9 of the load.
_LARGEST_KH = 20.0

CacheFolder = str | os.PathLike[str] | None


def amontons_family(
    film: ElasticFilm,
    indenter: Indenter,
    loads: ArrayLike,
    *,
    friction: Sequence[float] = FRICTIONS,
    loading: str = "incremental",
    reach: float,
    cache: CacheFolder = None,  # noqa: ARG001
    workers: int = 1,
) -> ProfileFamily:
    r"""Return the base stresses of a sphere on a film for a range of friction coefficients.

    Parameters
    ----------
    film : ElasticFilm
        The film; its stated uncertainties become ``changes`` of the family.
    indenter : Sphere
        The sphere.
    loads : array_like, shape (L,)
        Loads in N.
    friction : sequence of float
        Amontons' coefficients, increasing from 0 or above; the last may be ``inf``.
    loading : str
        ``"incremental"`` or ``"total"``: see :func:`memscal.indent`.
    reach : float
        Largest distance from the axis at which stresses will be asked for, in m.
    cache : path, optional
        Folder in which families are kept from one run to the next; without it nothing is written.
    workers : int
        Processes that share the work; the result is the same, bit for bit.

    Returns
    -------
    ProfileFamily

    Raises
    ------
    InputError
        If the indenter is no sphere, or an argument makes no sense.
    DomainError
        If a load lies outside what the model holds for.
    ConvergenceError
        If a contact does not settle.

    Examples
    --------
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> family = amontons_family(
    ...     film, Sphere(radius=128.8e-3), [0.34], friction=[0, math.inf], reach=8e-3
    ... )
    >>> maxima = family.wavenumbers.synthesise(family.spectra[:, 0].T, np.array(0.0))
    >>> (maxima / 1e3).round(1)
    array([27.7, 30.9])
    """
    setup = _Setup.of(film, indenter, loads, reach, workers)
    values = _parameter_values("friction coefficients", friction)
    if loading not in ("incremental", "total"):
        raise InputError(f'loading is {loading!r}, but it is "incremental" or "total".')
    paths = [setup.path(friction=float(mu), loading=loading) for mu in values]
    return setup.family("amontons", loading, values, _FRICTION_SCALE, paths)


@dataclass(frozen=True, eq=False)
class _Setup:
    """What all members of a family share."""

    film: ElasticFilm
    indenter: Sphere
    loads: FloatArray
    wavenumbers: Wavenumbers
    workers: int

    @classmethod
    def of(
        cls, film: ElasticFilm, indenter: Indenter, loads: ArrayLike, reach: float, workers: int
    ) -> _Setup:
        if not isinstance(indenter, Sphere):
            raise InputError(
                f"Profiles were asked for under a {indenter.shape}, but a sphere is needed.",
                why="Friction shows under an indenter whose contact grows with the load.",
                cure="Give the sphere of the contact scan.",
            )
        chosen = finite_vector("loads", np.atleast_1d(np.asarray(loads, dtype=np.float64)))
        for load in chosen:
            require_positive("load", float(load), "N")
        require_positive("reach", reach, "m")
        require_workers(workers)
        nodes = Wavenumbers.covering(_LARGEST_KH / film.thickness, reach)
        return cls(film, indenter, chosen, nodes, workers)

    def path(
        self, *, friction: float, loading: str = "incremental", interface: Interface | None = None
    ) -> LoadingPath:
        return LoadingPath(
            film=self.film,
            indenter=self.indenter,
            loads=tuple(float(load) for load in self.loads),
            friction=friction,
            loading=loading,
            interface=interface or Interface(),
        )

    def family(
        self,
        name: str,
        loading: str,
        values: FloatArray,
        scale: float,
        paths: Sequence[LoadingPath],
        *,
        a_length: bool = False,
        notes: tuple[str, ...] = (),
    ) -> ProfileFamily:
        """Solve the paths and put the family together; ``a_length`` if its values are lengths."""
        ratios = poisson_ratios(self.film)
        tables = self._solved(paths, ratios)
        whole = _stacked(tables[0])
        plain = ProfileFamily(
            name=name,
            loading=loading,
            wavenumbers=self.wavenumbers,
            loads=self.loads,
            values=values,
            scale=scale,
            spectra=whole.spectra,
            by_load=whole.by_load,
            changes={},
            depths=whole.depths,
            contact_radii=whole.contact_radii,
            convergence=whole.convergence,
            notes=notes,
        )
        by_length = _by_log_value(plain) if a_length else np.zeros_like(whole.spectra)
        changes: Mapping[str, FloatArray] = scaled_changes(
            self.film, self.indenter, whole.spectra, whole.by_load, whole.by_wavenumber, by_length
        )
        if ratios is not None:
            share = (self.film.poisson_ratio_uncertainty or 0.0) / (ratios[0] - ratios[1])
            upper, lower = (_stacked(side).spectra for side in tables[1:])
            changes = {**changes, "poisson_ratio": (upper - lower) * share}
        return replace(plain, changes=changes)

    def _solved(
        self, paths: Sequence[LoadingPath], ratios: tuple[float, float] | None
    ) -> list[list[PathTables]]:
        """Solve the paths, and those of two other Poisson's ratios, where they are others."""
        groups = [list(paths)]
        for nu in ratios or ():
            film = replace(self.film, poisson_ratio=nu)
            own = nu == self.film.poisson_ratio
            groups.append([replace(p, film=film, derivatives=own) for p in paths])
        wanted = list(dict.fromkeys(path for group in groups for path in group))
        found = solve_paths(wanted, self.wavenumbers.k, workers=self.workers)
        known = dict(zip(wanted, found, strict=True))
        return [[known[path] for path in group] for group in groups]


def _stacked(tables: Sequence[PathTables]) -> PathTables:
    """Return the tables of the members as one, with a first axis over the members."""
    names = PathTables.__dataclass_fields__
    return PathTables(*(np.stack([getattr(one, name) for one in tables]) for name in names))


def _by_log_value(family: ProfileFamily) -> FloatArray:
    r"""Return :math:`t(1-t)\,\partial/\partial t`: the derivatives by the value's logarithm."""
    t = family.coordinates
    slopes = np.stack([family.at(float(value)).by_coordinate for value in family.values])
    return np.asarray((t * (1 - t))[:, None, None] * slopes)


def _parameter_values(what: str, values: Sequence[float]) -> FloatArray:
    found = np.asarray(values, dtype=np.float64)
    if found.ndim != 1 or found.size == 0 or np.any(np.isnan(found)) or np.any(found < 0):
        raise InputError(f"The {what} are {values!r}, but they are a list, none negative.")
    if np.any(np.diff(found) <= 0):
        raise InputError(
            f"The {what} {', '.join(f'{value:g}' for value in found)} do not increase.",
            cure="Sort them, and give each once.",
        )
    return found
