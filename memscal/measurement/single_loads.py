"""A scan at several loads, taken apart: one part for each load."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import Wavenumbers
from memscal.errors import DomainError, FitError, InputError
from memscal.measurement.posterior import sensor_transfer
from memscal.mechanics.indent import indent
from memscal.model.arrays import FloatArray
from memscal.model.indenter import Rod
from memscal.model.scan import Scan

__all__ = [
    "ContactSignal",
    "SingleLoad",
    "contact_signal",
    "place_of",
    "require_ends",
    "require_points",
    "single_loads",
]

#: Lines whose loads differ by less than this are repeats of one load.
_SAME_LOAD = 0.05
#: Recorded loads of one line scatter by less than this about their median.
_SCATTER = 0.15


@dataclass(frozen=True, eq=False)
class SingleLoad:
    """The part of a scan that was made at one load.

    Parameters
    ----------
    scan : Scan
        Its voltages; ``load`` is the nominal load of this part, ``normal_load`` what was recorded
        at each point.
    load : float
        Nominal load, in N.
    lubrication : str
        ``"dry"``, ``"lubricated"`` or empty.
    """

    scan: Scan
    load: float
    lubrication: str

    @property
    def label(self) -> str:
        """Load and lubrication in words, as in ``"0.34 N, dry"``."""
        return ", ".join(part for part in (f"{self.load:.4g} N", self.lubrication) if part)


def single_loads(scan: Scan) -> tuple[SingleLoad, ...]:
    """Take a scan apart by load, the smallest first.

    Lines (rows of ``u_zz``, or points of one ``repeat``) whose median loads lie within 5 % of
    each other are repeats of one load; its nominal value is the median of all of their recorded
    loads.  A scan that records no loads is one part, at its own load.

    Raises
    ------
    InputError
        If a line was made at several loads, or records none.

    Examples
    --------
    >>> from memscal.model.film import ElasticFilm
    >>> from memscal.model.indenter import Sphere
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> scan = Scan(x=[-1e-3, 0, 1e-3], u_zz=[[1.0, 2, 1], [2, 4, 2]], load=1.0,
    ...             normal_load=[[0.5] * 3, [1.0] * 3], indenter=Sphere(radius=0.1), film=film)
    >>> [part.load for part in single_loads(scan)]
    [0.5, 1.0]
    """
    if scan.normal_load is None:
        return (SingleLoad(scan, scan.load, scan.lubrication),)
    passes = scan.passes
    if scan.kind != "repeats" and not passes.any():
        load = _line_load(scan, scan.normal_load, "")
        return (SingleLoad(replace(scan, load=load), load, scan.lubrication),)
    rows = [scan.normal_load[passes == i] for i in range(int(passes.max()) + 1)]
    loads = np.array([_line_load(scan, row, f", line {i + 1}") for i, row in enumerate(rows)])
    order = np.argsort(loads, kind="stable")
    starts = np.flatnonzero(np.diff(loads[order]) > _SAME_LOAD * loads[order][:-1]) + 1
    return tuple(_part(scan, np.sort(group)) for group in np.split(order, starts))


def place_of(scan: Scan, part: SingleLoad | None = None) -> str:
    """Name a scan's file and a load in it, for messages."""
    name = "The scan" if scan.source is None else scan.source.file_name
    return name if part is None else f"{name}, {part.label}"


def _line_load(scan: Scan, loads: FloatArray, line: str) -> float:
    known = loads[np.isfinite(loads)]
    if not known.size:
        raise InputError(
            f"{place_of(scan)}{line}: every load is missing (NaN in normal_load).",
            why="The stress under a curved indenter depends on its load.",
            cure="State the loads, or leave normal_load out where there is one nominal load only.",
        )
    load = float(np.median(known))
    if np.abs(known - load).max() > _SCATTER * load:
        raise InputError(
            f"{place_of(scan)}{line}: its loads go from {known.min():.4g} to {known.max():.4g} N.",
            why="A line is one profile, made at one load; each load has a stress of its own.",
            cure="Store each load as a line of its own: u_zz with the axes (repeat, x), or points "
            "with a number in repeat.",
        )
    return load


def _part(scan: Scan, rows: NDArray[np.intp]) -> SingleLoad:
    only = scan.only_passes(rows)
    assert only.normal_load is not None
    load = float(np.nanmedian(only.normal_load))
    common = scan.load_uncertainty
    uncertainty = None if common is None else common * load / scan.load
    return SingleLoad(
        replace(only, load=load, load_uncertainty=uncertainty), load, scan.lubrication
    )


_LARGEST_KH = 20.0
_LOAD_STEP = 0.02
#: Enough for 1e-4 of the derivative, in half the time that convergence to 1e-4 takes.
_RINGS = 24
#: Distances at which the profile is tabulated, out to the scan's width.
_DISTANCES = 401
#: What the calculated profile may have left at the ends of a scan, over its maximum.
_LARGEST_END = 0.05


@dataclass(frozen=True, eq=False)
class ContactSignal:
    """The contact at a nominal load as the sensor reports it, without friction and sticking.

    ``r`` (n,): distances from the centre, in m; ``voltage`` and ``by_load`` (2, n): the voltages of
    both and their derivatives by the logarithm of the load, in V; ``contact_radius`` in m, without
    friction.
    """

    r: FloatArray
    voltage: FloatArray
    by_load: FloatArray
    contact_radius: float

    def slope(self, distance: FloatArray, sticking: float = 0.0) -> FloatArray:
        """Derivative of the voltage by the logarithm of the load, at distances in m, in V.

        ``sticking``: how far from the frictionless contact to the one that sticks.
        """
        between = (1 - sticking) * self.by_load[0] + sticking * self.by_load[1]
        return np.asarray(np.interp(distance, self.r, between))

    def sticking(self, distance: float, voltage: float) -> float:
        """How far from the frictionless voltage to the sticking one a measured one is, 0 to 1.

        At a distance in m near the axis, where friction raises the stress.
        """
        free, stuck = (float(np.interp(distance, self.r, each)) for each in self.voltage)
        return min(max((voltage - free) / (stuck - free), 0.0), 1.0) if stuck > free else 0.0

    def share(self, distance: float) -> float:
        """Frictionless voltage at a distance (m) over the largest."""
        free = self.voltage[0]
        return float(np.interp(distance, self.r, free) / free.max())


def contact_signal(part: SingleLoad, apparatus: ApparatusFunction) -> ContactSignal:
    """Calculate the contacts of a part at its nominal load, and near it.

    One that is lubricated, and a rod's, has no friction to be told from.

    Raises
    ------
    DomainError
        If the load is beyond what the model of the contact holds for.
    """
    scan, load = part.scan, part.load
    loads = load * np.array([1 - _LOAD_STEP, 1.0, 1 + _LOAD_STEP])
    slides = part.lubrication == "lubricated" or isinstance(scan.indenter, Rod)
    try:
        contacts = [
            indent(scan.film, scan.indenter, load=loads, friction=friction, rings=_RINGS)
            for friction in ((0.0,) if slides else (0.0, math.inf))
        ]
    except DomainError as failure:
        raise DomainError(
            f"{place_of(scan, part)}: {failure.problem}",
            why="The measured stress is compared with a contact that the model cannot hold for.",
            cure="Leave that load out; check its unit.",
        ) from failure
    width = float(np.hypot(np.ptp(scan.x), 0.0 if scan.y is None else np.ptp(scan.y)))
    r = np.linspace(0.0, 1.5 * width, _DISTANCES)
    nodes = Wavenumbers.covering(_LARGEST_KH / scan.film.thickness, 3 * width)
    through = apparatus.conversion_constant * sensor_transfer(apparatus, nodes.k)
    spectra = [through * contact.base_spectrum(nodes.k) for path in contacts for contact in path]
    voltages = nodes.synthesise(np.stack(spectra, axis=1), r).T.reshape(-1, loads.size, r.size)
    # Where there is no friction to be told, both are the frictionless contact.
    below, at, above = np.moveaxis(voltages[[0, -1]], 1, 0)
    slope = (above - below) / (2 * _LOAD_STEP)
    return ContactSignal(r, at, slope, contacts[0][1].contact_radius)


def require_points(part: SingleLoad, signal: ContactSignal) -> None:
    """Refuse a load of which nothing, or no point over a stretch of a contact, was measured.

    Raises
    ------
    InputError
        If every point is missing (NaN), or a run of them is longer than the contact's radius.
    """
    scan = part.scan
    known = np.ones_like(scan.u_zz, dtype=np.bool_)
    for values in (scan.u_zz, scan.normal_load):
        if values is not None:
            known &= np.isfinite(values)
    if not known.any():
        raise InputError(
            f"{place_of(scan, part)}: all {known.size} points are missing (NaN).",
            why="A load without voltages has no profile.",
            cure="Check the import, or leave the lines of that load out.",
        )
    if scan.y is not None:
        return
    order = np.argsort(scan.x)
    x, measured = scan.x[order], (known.reshape(-1, scan.x.size).sum(axis=0) > 0)[order]
    places = np.flatnonzero(measured)
    missing = np.diff(places) - 1
    gaps = np.where(missing > 0, np.diff(x[places]), 0.0)
    if gaps.size and gaps.max() > signal.contact_radius:
        i = int(np.argmax(gaps))
        raise InputError(
            f"{place_of(scan, part)}: {missing[i]} neighbouring points are missing (NaN), from "
            f"{x[places[i] + 1] * 1e3:.4g} to {x[places[i + 1] - 1] * 1e3:.4g} mm.",
            why=f"The gap is wider than the contact's radius, {signal.contact_radius * 1e3:.3g} "
            "mm: the profile within it would be the model's, not measured.",
            cure="Measure these points again, or leave the lines of that load out.",
        )


def require_ends(part: SingleLoad, signal: ContactSignal, centre: FloatArray) -> None:
    """Refuse a scan that ends where the stress has not decayed: its baseline is undetermined.

    Raises
    ------
    FitError
        If the calculated profile at either outermost point exceeds 5 % of its maximum.
    """
    scan = part.scan
    known = np.isfinite(scan.u_zz)
    if scan.y is None:
        x = scan.x[known.reshape(-1, scan.x.size).any(axis=0)]
        along = centre[0 if scan.direction == "x" else 1]
        ends = [abs(float(x.min() - along)), abs(float(x.max() - along))]
    else:
        ends = [
            abs(float(e - c))
            for a, c in ((scan.x, centre[0]), (scan.y, centre[1]))
            for e in (a.min(), a.max())
        ]
    left = max(signal.share(end) for end in ends)
    if left > _LARGEST_END:
        raise FitError(
            f"{place_of(scan, part)}: the scan ends {min(ends) * 1e3:.3g} mm from its centre, "
            f"where the calculated profile still has {left:.0%} of its maximum.",
            why="The voltage never comes down to the baseline, so that it cannot be told from the "
            "stress.",
            cure="Scan farther on that side; to where the profile has decayed.",
        )
