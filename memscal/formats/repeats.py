"""The means of a table's repeats, and a word on every reading that does not belong to them."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from memscal.formats.averaging import Average, average
from memscal.formats.grid import IntArray
from memscal.model.validation import FloatArray

__all__ = ["average_columns"]

# Readings that are named one by one.
_MAX_NAMED = 50
# Beyond this share, the spread is not one, rather than some readings outliers.
_MAX_OUTLYING = 0.1


def average_columns(
    columns: Mapping[str, FloatArray],
    place: IntArray,
    shape: tuple[int, ...],
    named: Callable[[int], str],
    numbers: FloatArray | None,
    notes: list[str],
) -> tuple[dict[str, FloatArray], FloatArray | None]:
    """Return means by place, and the standard uncertainty of u_zz.

    A reading whose voltage is outlying is left out of every mean: what shook the sensor shook
    the load too, and mean voltage and mean load must be those of the same readings.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        The fields, ``u_zz`` among them.
    place : ndarray, shape (n,)
        The place of each reading, as an index into the flattened scan.
    shape : tuple of int
        Shape of the scan.
    named : callable
        What a place is called in a note.
    numbers : ndarray, shape (n,), optional
        Number of the repeat that each reading belongs to.
    notes : list of str
        What was done, and every reading that was left out, is added here.
    """
    size = int(np.prod(shape))
    u = columns["u_zz"]
    found = average(u, place, size)
    used = found.kept | ~np.isfinite(u)
    means = {"u_zz": found.mean.reshape(shape)}
    for name, values in columns.items():
        if name == "u_zz":
            continue
        good = np.isfinite(values) & used
        number = np.bincount(place[good], minlength=size)
        total = np.bincount(place[good], weights=values[good], minlength=size)
        mean = np.divide(total, number, out=np.full(size, np.nan), where=number > 0)
        means[name] = mean.reshape(shape)
    if found.errors is None:
        return means, None
    number = np.bincount(place[found.kept], minlength=size)
    notes.append(
        f"Repeats were averaged, {number[number > 0].mean():.3g} at a place on average; "
        f"their pooled standard deviation is {found.spread * 1e3:.4g} mV "
        f"({found.freedom} degrees of freedom), and u_zz_errors is that of the mean."
    )
    notes += _outlying(u, place, found, named, numbers)
    notes += _disagreeing(u, place, found, named)
    return means, found.errors.reshape(shape)


def _outlying(
    u: FloatArray,
    place: IntArray,
    found: Average,
    named: Callable[[int], str],
    numbers: FloatArray | None,
) -> list[str]:
    """Name every reading that was left out: nothing is dropped silently."""
    read = np.isfinite(u)
    out = np.flatnonzero(read & ~found.kept)
    notes = []
    for i in out[:_MAX_NAMED]:
        # Without numbers: which of the place's readings it is, in the order of the file.
        which = (
            f"reading {np.sum(place[: i + 1] == place[i])}"
            if numbers is None
            else f"repeat {numbers[i]:g}"
        )
        notes.append(
            f"Outlying, and left out of its mean: {u[i] * 1e3:.4g} mV at {named(place[i])}, "
            f"{which}; the others there have a mean of {found.mean[place[i]] * 1e3:.4g} mV, "
            f"{found.deviation[i]:.3g} standard deviations away."
        )
    if out.size > _MAX_NAMED:
        notes.append(f"{out.size - _MAX_NAMED} more readings were outlying, and left out.")
    suspect = out.size + int(np.sum(found.disagreeing[place[read]]))
    if suspect > _MAX_OUTLYING * read.sum():
        notes.append(
            f"{suspect} of {read.sum()} readings do not agree with the others of their place: "
            "their noise is not one and the same. Look whether the repeats belong together, or "
            'keep them apart (repeats="keep"; --repeats keep).'
        )
    return notes


def _disagreeing(
    u: FloatArray, place: IntArray, found: Average, named: Callable[[int], str]
) -> list[str]:
    at = np.flatnonzero(found.disagreeing)
    notes = []
    for i in at[:_MAX_NAMED]:
        readings = u[(place == i) & np.isfinite(u)] * 1e3
        shown = f"{readings.size} readings from {readings.min():.4g} to {readings.max():.4g} mV"
        notes.append(
            f"At {named(int(i))} the {shown} disagree, and none can be called the outlier: all "
            "were averaged, and u_zz_errors there is from their own spread."
        )
    if at.size > _MAX_NAMED:
        notes.append(f"The readings of {at.size - _MAX_NAMED} more places disagree.")
    return notes
