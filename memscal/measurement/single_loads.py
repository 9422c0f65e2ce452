"""Loads of a contact scan: its lines load by load, those of one load, and how errors name them."""

from dataclasses import replace

import numpy as np

from memscal.errors import InputError
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan

#: Lines whose loads differ by less than this are repeats of one load.
_SAME_LOAD = 0.05
#: Recorded loads of one line scatter by less than this about their median.
_SCATTER = 0.15


def single_loads(scan: Scan) -> tuple[Scan, ...]:
    """Split a scan by load, the smallest first; one that records no loads stays whole."""
    # Lines whose median loads lie within 5 % of each other are repeats of one load, the median of
    # all recorded ones.  A line at several loads, or without any, raises an InputError.
    if scan.normal_load is None:
        return (scan,)
    passes = scan.passes
    if scan.kind != "repeats" and not passes.any():
        return (replace(scan, load=_line_load(scan, scan.normal_load, "")),)
    rows = [scan.normal_load[passes == i] for i in range(int(passes.max()) + 1)]
    loads = np.array([_line_load(scan, row, f", line {i + 1}") for i, row in enumerate(rows)])
    order = np.argsort(loads, kind="stable")
    starts = np.flatnonzero(np.diff(loads[order]) > _SAME_LOAD * loads[order][:-1]) + 1
    singles = []
    for group in np.split(order, starts):
        load = float(np.nanmedian(scan.normal_load[np.isin(passes, group)]))
        u = scan.load_uncertainty and scan.load_uncertainty * load / scan.stated_load
        singles.append(replace(scan.only_passes(np.sort(group)), load=load, load_uncertainty=u))
    return tuple(singles)


def scan_at_load(scan: Scan, load: float) -> Scan:
    """Return what a scan holds of one of its loads, in N."""
    singles = single_loads(scan)
    for single in singles:
        if abs(single.stated_load - load) <= _SAME_LOAD * load:
            return single
    held = ", ".join(f"{single.stated_load:.4g}" for single in singles)
    cure = "Give one of these loads, to within 5 %."
    raise InputError(
        f"{place_of(scan)} has loads of {held} N, and none of {load:.4g} N.", cure=cure
    )


def place_of(scan: Scan) -> str:
    """Name a scan's file, for messages."""
    return "The scan" if scan.source is None else scan.source.file_name


def load_of(scan: Scan) -> str:
    """Name a scan's file, load and lubrication, for messages."""
    words = (place_of(scan), f"{scan.load:.4g} N", scan.lubrication)
    return ", ".join(word for word in words if word)


def _line_load(scan: Scan, loads: FloatArray, line: str) -> float:
    recorded = loads[np.isfinite(loads)]
    if not recorded.size:
        problem = f"{place_of(scan)}{line}: every load is missing (NaN in normal_load)."
        why = "The stress under a curved indenter depends on its load."
        cure = "State the loads, or leave normal_load out where there is one nominal load only."
        raise InputError(problem, why=why, cure=cure)
    load = float(np.median(recorded))
    if np.abs(recorded - load).max() > _SCATTER * load:
        raise InputError(
            f"{place_of(scan)}{line}: its loads go from {recorded.min():.4g} to "
            f"{recorded.max():.4g} N.",
            why="A line is one profile, made at one load; each load has a stress of its own.",
            cure="Store each load as a line of its own: u_zz with the axes (repeat, x), or points "
            "with a number in repeat.",
        )
    return load
