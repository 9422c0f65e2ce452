"""A scan at several loads, taken apart: one part for each load."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError
from memscal.model.scan import Scan
from memscal.model.validation import FloatArray

__all__ = ["SingleLoad", "place_of", "single_loads"]

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
