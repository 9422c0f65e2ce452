"""Families of calculated base stresses: along one parameter of the interface, at each load.

A family holds the transforms of the base stress of contacts that were solved at a few values of
one parameter: a friction coefficient, or a length by which the interface yields.  Between them it
interpolates by a monotone cubic in a bounded coordinate, t = theta/(theta + theta_0): past the
friction at which the contact sticks wholly nothing changes, and an interpolant must not ring.
"""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from dataclasses import asdict, field, replace
from functools import cached_property, partial
from itertools import chain
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import ConvergenceError, DomainError, InputError
from memscal.formats.cache import CacheFolder, find_contact_table, keep_contact_table, table_key
from memscal.mechanics.indent import Loading, indent
from memscal.mechanics.interface import Interface
from memscal.model.arrays import (
    Arrays,
    FloatArray,
    FrozenArrays,
    Values,
    array_record,
    finite_vector,
    floats,
    keyword_value_record,
    require_positive,
)
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Sphere
from memscal.parallel import require_workers, shared
from memscal.progress import Task
from memscal.version import __version__

FRICTION_SCALE = 0.3
"""Friction at the middle of the bounded coordinate: there a contact begins to stick wholly."""

#: A value this much, relatively, beyond the last one of a family is the last one.
_ROUNDING = 1e-9


def bounded(values: ArrayLike, scale: float) -> FloatArray:
    """Return the bounded coordinate t of values: 1 where they are infinite."""
    return floats(1 - scale / (floats(values) + scale))


def unbounded(coordinates: ArrayLike, scale: float) -> FloatArray:
    """Return the values at bounded coordinates: the inverse of :func:`bounded`."""
    t = floats(coordinates)
    with np.errstate(divide="ignore"):
        return scale * t / (1 - t)


#: Arrays of a family that hold one number for each value and load.
_NUMBERS = ("depths", "contact_radii", "convergence")


@array_record
class ProfileFamily(FrozenArrays):
    """Base-stress transforms of contacts at M values of one parameter, L loads, K wavenumbers."""

    name: str  # "amontons", "elasto-plastic", "normal-compliance" or "external"
    loading: str  # "incremental", "total", or "" where it is unknown or changes nothing
    wavenumbers: Wavenumbers
    loads: FloatArray  # (L,), in N
    values: FloatArray  # (M,): coefficients or lengths in m, increasing from 0 or above up to inf
    scale: float  # theta_0, of the values
    spectra: FloatArray  # (M, L, K), in N: those of Contact.base_spectrum, or base_shear_spectrum
    by_load: FloatArray  # their derivatives by the logarithm of the load
    changes: Arrays  # by one standard uncertainty of each source that states one
    depths: FloatArray  # (M, L), in m; NaN where unknown, as the next two
    contact_radii: FloatArray  # (M, L), in m
    convergence: FloatArray  # (M, L): largest relative change under refinement
    notes: tuple[str, ...] = ()  # what was assumed
    order: int = 0  # one of the shear
    slopes: FloatArray | None = None  # of a selection by at(), whose values have any order
    interpolation: str = "PchipInterpolator"  # of scipy.interpolate

    @cached_property
    def coordinates(self) -> FloatArray:
        """Bounded coordinates of the values, shape (M,)."""
        return bounded(self.values, self.scale)

    @cached_property
    def by_coordinate(self) -> FloatArray:
        """Derivatives of the spectra by the bounded coordinate, shape (M, L, K), in N."""
        if self.slopes is not None:
            return self.slopes
        return floats(self._interpolant(self.coordinates, 1)[:, 0])

    def at(self, values: ArrayLike) -> ProfileFamily:
        """Return the members at one or several values, in any order; none is extrapolated."""
        chosen = np.atleast_1d(floats(values))
        nodes = self.coordinates
        t = bounded(chosen, self.scale)
        inside = (t >= nodes[0] - _ROUNDING) & (t <= nodes[-1] + _ROUNDING)
        inside &= ~np.isnan(chosen)
        if not inside.all():
            raise InputError(
                f"A {self.name} family from {self.values[0]:g} to {self.values[-1]:g} does not "
                f"reach {chosen[~inside][0]:g}.",
                why="It is interpolated, not extrapolated.",
                cure="Calculate it with a value beyond.",
            )
        t = np.clip(t, nodes[0], nodes[-1])
        arrays = self._interpolant(t)
        changes = {source: arrays[:, 2 + i] for i, source in enumerate(self.changes)}
        numbers: Values = {}
        for name in _NUMBERS:
            columns = [np.interp(t, nodes, column) for column in getattr(self, name).T]
            numbers[name] = np.column_stack(columns)
        return replace(
            self,
            values=chosen,
            spectra=arrays[:, 0],
            by_load=arrays[:, 1],
            changes=changes,
            slopes=self._interpolant(t, 1)[:, 0],
            **numbers,
        )

    def only(self, loads_index: int | Sequence[int]) -> ProfileFamily:
        """Return the family at one or several of its loads, by index, in the order given."""
        chosen = np.atleast_1d(loads_index)
        names = ["spectra", "by_load", *_NUMBERS]
        if self.slopes is not None:
            names.append("slopes")
        arrays = {name: getattr(self, name)[:, chosen] for name in names}
        changes = {name: change[:, chosen] for name, change in self.changes.items()}
        return replace(self, loads=self.loads[chosen], changes=changes, **arrays)

    @cached_property
    def _interpolant(self) -> Any:
        """Interpolant of spectra, derivatives and changes, shape (2 + sources, L, K)."""
        from scipy import interpolate

        stack = np.stack([self.spectra, self.by_load, *self.changes.values()], axis=1)
        if self.values.size == 1:  # a constant
            return interpolate.PPoly(stack[None], [0.0, 1.0])
        return getattr(interpolate, self.interpolation)(self.coordinates, stack)


#: Smaller steps of Poisson's ratio would show the rings' placing beside the change.
_SMALLEST_STEP = 0.01


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


@keyword_value_record
class LoadingPath:
    """A loading of one film with one interface, looked at at ``loads`` (N, in any order)."""

    film: ElasticFilm
    indenter: Sphere
    loads: tuple[float, ...]
    friction: float = 0.0
    loading: Loading = "incremental"
    interface: Interface = field(default_factory=Interface)
    derivatives: bool = True
    order: int = 0  # one for the shear at the base

    def contacts(self, loads: FloatArray) -> Sequence[Any]:
        """Solve the contacts at increasing loads (N)."""
        usual = _RINGS_OF_A_RIGID_CONTACT if self.interface.rigid else _RINGS_OF_A_COMPLIANT_CONTACT
        for rings in (usual, *_OTHER_RINGS):
            try:
                return indent(
                    self.film,
                    self.indenter,
                    load=loads,
                    friction=self.friction,
                    # Without friction the way makes no difference, and the solution is remembered.
                    loading=self.loading if self.friction > 0 else "incremental",
                    interface=self.interface,
                    strain="linear",
                    rings=rings,
                )
            except (ConvergenceError, DomainError) as error:
                failure = error
                if isinstance(error, DomainError):
                    break
        raise type(failure)(
            f"The contact of a sphere of radius {self.indenter.radius * 1e3:.4g} mm with a film of "
            f"{self.film.thickness * 1e3:.4g} mm cannot be calculated up to {max(self.loads):g} N "
            f"(friction {self.friction:g}, {self.loading} loading): {failure.problem}",
            why=failure.why,
            cure=failure.cure,
        ) from failure


def _solve(path: LoadingPath, k: FloatArray) -> Arrays:
    """Return spectra (L, K) in N, derivatives by logarithms (zero where not needed), numbers."""
    loads = np.array(path.loads)
    visited = [loads]
    if path.derivatives:
        visited += [factor * loads for factor in _NEIGHBOURS]
    increasing, places = np.unique(visited, return_inverse=True)
    solved = np.array(path.contacts(increasing), dtype=object)
    nominal, *neighbours = solved[places.reshape(-1, loads.size)]

    def spectra_of(contacts: Sequence[Any], k: FloatArray = k) -> FloatArray:
        """Spectra of contacts at the loads, or at a group of their neighbours."""
        spectrum = "base_shear_spectrum" if path.order else "base_spectrum"
        return np.array([getattr(contact, spectrum)(k) for contact in contacts])

    spectra = spectra_of(nominal)
    by_load = np.zeros_like(spectra)
    by_wavenumber = np.zeros_like(spectra)
    if path.derivatives:
        # By P d/dP and not by the logarithm's own step: the force is then met exactly.
        lighter, heavier = map(spectra_of, neighbours)
        by_load = (heavier - lighter) / (_NEIGHBOURS[1] - _NEIGHBOURS[0])
        above = spectra_of(nominal, k * (1 + _STRETCH))
        below = spectra_of(nominal, k * (1 - _STRETCH))
        by_wavenumber = (above - below) / (2 * _STRETCH)
    return {
        "spectra": spectra,
        "by_load": by_load,
        "by_wavenumber": by_wavenumber,
        "depths": np.array([contact.depth for contact in nominal]),
        "contact_radii": np.array([contact.contact_radius for contact in nominal]),
        "convergence": np.array([contact.convergence for contact in nominal]),
    }


#: Raised where the same request gives other numbers within one version.
_REVISION = 3


#: The film passes nothing of exp(-kh) beyond this: 2e-9 of the load.
_LARGEST_KH = 20.0
#: How the arrays of changes are named in a kept file.
_CHANGE = "change_"


class FamilySetup:
    """What all members of a family share: contact, loads (N), wavenumbers, cache and workers."""

    def __init__(
        self,
        film: ElasticFilm,
        indenter: Sphere,
        loads: ArrayLike,
        *,
        reach: float,  # largest distance from the axis at which stresses will be asked for, in m
        cache: CacheFolder = None,
        workers: int = 1,
        order: int = 0,  # one for the shear at the base
    ) -> None:
        """Refuse what is no positive load or reach, or no number of workers."""
        require_workers(workers)
        self.film = film
        self.indenter = indenter
        require_positive("reach", reach, "m")
        self.wavenumbers = Wavenumbers.covering(_LARGEST_KH / film.thickness, reach)
        self.loads = require_loads(loads)
        self.cache = cache
        self.workers = workers
        self.order = order

    def path(self, **law: Any) -> LoadingPath:
        """Return the loading path of one member; ``law``: its friction, loading and interface."""
        law |= {"loads": tuple(self.loads.tolist()), "order": self.order}
        return LoadingPath(film=self.film, indenter=self.indenter, **law)

    def family(
        self,
        paths: Sequence[LoadingPath],
        *,
        name: str,
        loading: str,
        values: FloatArray,
        a_length: bool = False,
        notes: tuple[str, ...] = (),
    ) -> ProfileFamily:
        """Return the family of some paths, as it was kept or calculated now."""
        k = self.wavenumbers.k
        scale = FRICTION_SCALE
        if a_length:
            # Lengths scale as the film's displacements: twice the sphere's rise over its thickness.
            scale = self.film.thickness**2 / self.indenter.radius
        arrays = None
        if self.cache is not None:
            # All that a family's numbers depend on: not the film's name.
            requests = []
            for path in paths:
                request = asdict(path) | {"law": type(path.interface.normal).__name__}
                request["film"].pop("name")
                requests.append(request)
            numbers = {"values": values.tolist(), "scale": scale, "paths": requests}
            digest = hashlib.sha256(k.tobytes()).hexdigest()
            key = table_key({"version": __version__, "revision": _REVISION, "k": digest, **numbers})
            arrays = find_contact_table(self.cache, key)
        if arrays is None:
            arrays = self._calculated(paths, (values, scale) if a_length else None)
            if self.cache is not None:
                axes = {"value": values, "load": self.loads, "k": k}
                keep_contact_table(self.cache, key, axes | arrays)
        changes = [name for name in arrays if name.startswith(_CHANGE)]
        members: Values = {name: arrays[name] for name in ("spectra", "by_load", *_NUMBERS)}
        return ProfileFamily(
            name=name,
            loading=loading,
            wavenumbers=self.wavenumbers,
            loads=self.loads,
            values=values,
            scale=scale,
            changes={source.removeprefix(_CHANGE): arrays[source] for source in changes},
            notes=notes,
            order=self.order,
            **members,
        )

    def _calculated(
        self, paths: Sequence[LoadingPath], lengths: tuple[FloatArray, float] | None
    ) -> Arrays:
        """Solve the paths and derive what follows from them: the arrays that are kept."""
        film = self.film
        nu = film.poisson_ratio
        ratios = []
        if film.poisson_ratio_uncertainty:
            step = max(film.poisson_ratio_uncertainty, _SMALLEST_STEP)
            ratios = [min(nu + step, 0.5), max(nu - step, 0.0)]  # one-sided if incompressible
        groups = [paths]
        for ratio in ratios:
            changed = replace(film, poisson_ratio=ratio)
            whole = ratio == nu
            groups.append([replace(path, film=changed, derivatives=whole) for path in paths])
        nominal, *sides = self._solved(groups)
        spectra = nominal["spectra"]
        by_length = np.zeros_like(spectra)
        if lengths is not None and lengths[0].size > 1:
            from scipy.interpolate import PchipInterpolator

            # By the logarithm of the length: t (1 - t) times that by the bounded coordinate t.
            t = bounded(*lengths)
            slopes = PchipInterpolator(t, spectra)(t, 1)
            by_length = (t * (1 - t))[:, None, None] * slopes
        # Changes by one stated standard uncertainty, by the scales of the contact, from derivatives
        # by the logarithms of load, wavenumber and length of the interface:
        # docs/contact_families.md.
        indenter = self.indenter
        stiffer = spectra - nominal["by_load"]
        thicker = 3 * stiffer + nominal.pop("by_wavenumber") - 2 * by_length
        larger = by_length - stiffer
        stated = {
            "young_modulus": (stiffer, film.young_modulus, film.young_modulus_uncertainty),
            "thickness": (thicker, film.thickness, film.thickness_uncertainty),
            "indenter_radius": (larger, indenter.radius, indenter.radius_uncertainty),
        }
        changes = {
            source: derivative * (uncertainty / value)
            for source, (derivative, value, uncertainty) in stated.items()
            if uncertainty is not None
        }
        if sides:
            upper, lower = (side["spectra"] for side in sides)
            slope = (upper - lower) / (ratios[0] - ratios[1])
            expected = film.expected
            changes["poisson_ratio"] = slope * (expected.poisson_ratio_uncertainty or 0.0)
            nominal["spectra"] = spectra + slope * (expected.poisson_ratio - nu)
        return nominal | {f"{_CHANGE}{source}": change for source, change in changes.items()}

    def _solved(self, groups: Sequence[Sequence[LoadingPath]]) -> list[Arrays]:
        """Solve groups of paths, each path once, in one or more processes; stack each group."""
        distinct = list(dict.fromkeys(chain.from_iterable(groups)))
        task = Task("contacts", sum(len(path.loads) for path in distinct))
        found = shared(partial(_solve, k=self.wavenumbers.k), distinct, workers=self.workers)
        arrays = list(task.counted(found, lambda numbers: numbers["depths"].size))
        solved = dict(zip(distinct, arrays, strict=True))
        stacks = []
        for group in groups:
            members = [solved[path] for path in group]
            stacks.append({name: np.stack([own[name] for own in members]) for name in arrays[0]})
        return stacks


def require_loads(loads: ArrayLike) -> FloatArray:
    """Return loads (N) as an array; refuse none, and what is not finite and positive."""
    checked = finite_vector("loads", np.atleast_1d(loads))
    for load in checked:
        require_positive("load", load, "N")
    return checked


def parameter_values(what: str, values: Sequence[float]) -> FloatArray:
    """Return the values of a parameter; refuse what does not increase from 0 or above."""
    checked = floats(values)
    if checked.ndim != 1 or checked.size == 0 or not np.all(np.diff(checked, prepend=-1e-9) > 0):
        raise InputError(
            f"The {what} are {values!r}, but they are numbers that increase, none of them negative."
        )
    return checked
