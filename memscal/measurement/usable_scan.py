"""What a contact scan must hold to be measured: points at every load, and ends without stress."""

from __future__ import annotations

import numpy as np

from memscal.errors import FitError, InputError
from memscal.measurement.contact_signal import ContactSignal
from memscal.measurement.single_loads import SingleLoad, place_of
from memscal.model.validation import FloatArray

__all__ = ["require_ends", "require_points"]

#: What the calculated profile may have left at the ends of a scan, over its maximum.
_LARGEST_END = 0.05


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
