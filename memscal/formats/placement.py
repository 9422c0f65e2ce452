"""From readings to the arrays of a scan: places, repeats, and what is missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from memscal.errors import InputError
from memscal.formats.grid import (
    Grid,
    IntArray,
    find_grid,
    group_positions,
    spacing_in_words,
    typical_spacing,
)
from memscal.formats.repeats import average_columns
from memscal.model.validation import FloatArray

__all__ = ["Placed", "place_readings"]

# A raster whose grid is this much larger than its data is a misread column.
_MAX_EMPTINESS = 100
# Positions closer than this share of the typical spacing are probably one place, and a table with
# so large a share of them was probably repeated.
_CLOSE = 0.1
_MANY = 0.25


@dataclass(frozen=True, eq=False)
class Placed:
    """The axes and fields of a scan; ``errors`` is the uncertainty of an averaged ``u_zz``."""

    x: FloatArray
    y: FloatArray | None
    fields: Mapping[str, FloatArray]
    errors: FloatArray | None


def place_readings(
    columns: Mapping[str, FloatArray],
    *,
    xs: FloatArray,
    ys: FloatArray | None,
    numbers: FloatArray | None,
    tolerance: float,
    averaged: bool,
    notes: list[str],
) -> Placed:
    """Sort readings into the arrays of a scan.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        The fields, ``u_zz`` among them.
    xs, ys : ndarray, shape (n,)
        Positions in m; ``ys`` only for a raster.
    numbers : ndarray, shape (n,), optional
        Number of the repeat that each reading belongs to.
    tolerance : float
        Largest distance of a reading from its place, as a fraction of the step.
    averaged : bool
        Whether repeats are averaged.
    notes : list of str
        What was done is added here.
    """
    known = np.isfinite(xs)
    for positions in (ys, numbers):
        known &= True if positions is None else np.isfinite(positions)
    if not known.any():
        raise InputError("No row of the table has a position.", cure="Check the columns.")
    if not known.all():
        notes.append(f"{int((~known).sum())} rows without a position were left out.")
    numbers = None if numbers is None else numbers[known]
    xs, columns = xs[known], {name: values[known] for name, values in columns.items()}
    if ys is not None:
        return _place_raster(xs, ys[known], numbers, columns, tolerance, averaged, notes)
    if averaged:
        return _average_line(xs, numbers, columns, tolerance, notes)
    repeat = _count_repeats(xs, numbers, notes)
    if repeat.max() == 0:
        return _single_line(xs, columns, averaged, notes)
    return _repeated_line(xs, repeat, columns, tolerance, notes)


def _single_line(
    xs: FloatArray, columns: Mapping[str, FloatArray], averaged: bool, notes: list[str]
) -> Placed:
    notes.append("A line scan without repeats: positions are kept as they are.")
    gaps = np.diff(np.sort(xs))
    close = int(np.sum(gaps < _CLOSE * typical_spacing(xs)))
    if close > _MANY * xs.size:
        notes.append(
            f"{close} of {xs.size} positions lie closer to another than {_CLOSE:.0%} of the "
            "typical spacing. If they are repeats, name the column that numbers them "
            '(repeat="..."; --repeat COLUMN), or '
            + (
                "raise the grid tolerance."
                if averaged
                else 'average them (repeats="average"; --repeats average).'
            )
        )
    return Placed(xs, None, columns, None)


def _average_line(
    xs: FloatArray,
    numbers: FloatArray | None,
    columns: Mapping[str, FloatArray],
    tolerance: float,
    notes: list[str],
) -> Placed:
    """Average readings by place, several of one repeat too; without numbers all are alike."""
    numbered = numbers is not None
    repeat = _count_repeats(xs, numbers, []) if numbered else np.zeros(xs.size, dtype=np.int64)
    # Unnumbered readings of a place reach as far on either side as the tolerance allows; those of
    # one repeat were meant to be equal.
    closeness = 0.5 * tolerance if numbered else min(2 * tolerance, 0.5)
    grid = group_positions("x", xs, repeat, tolerance, closeness=closeness)
    if grid.places.size == xs.size:
        return _single_line(xs, columns, True, notes)
    _report(notes, "x", spacing_in_words(grid.places, tolerance), grid, tolerance)
    twice = xs.size - np.unique(np.stack([repeat, grid.index]), axis=1).shape[1]
    if numbered and twice:
        notes.append(f"{twice} readings share their place with another of the same repeat.")

    def named(i: int) -> str:
        return f"x = {grid.places[i] * 1e3:.4g} mm"

    means, errors = average_columns(columns, grid.index, (grid.places.size,), named, numbers, notes)
    return Placed(grid.places, None, means, errors)


def _repeated_line(
    xs: FloatArray,
    repeat: IntArray,
    columns: Mapping[str, FloatArray],
    tolerance: float,
    notes: list[str],
) -> Placed:
    grid = group_positions("x", xs, repeat, tolerance)
    _report(notes, "x", spacing_in_words(grid.places, tolerance), grid, tolerance)
    shape = (int(repeat.max()) + 1, grid.places.size)
    fields = {name: np.full(shape, np.nan) for name in columns}
    for name, values in columns.items():
        fields[name][repeat, grid.index] = values
    notes.append(f"{shape[0]} repeats are kept.")
    _report_missing(notes, fields["u_zz"])
    return Placed(grid.places, None, fields, None)


def _place_raster(
    xs: FloatArray,
    ys: FloatArray,
    repeat: FloatArray | None,
    columns: Mapping[str, FloatArray],
    tolerance: float,
    averaged: bool,
    notes: list[str],
) -> Placed:
    grids = {"x": find_grid("x", xs, tolerance), "y": find_grid("y", ys, tolerance)}
    shape = (grids["y"].places.size, grids["x"].places.size)
    if shape[0] * shape[1] > _MAX_EMPTINESS * xs.size:
        raise InputError(
            f"The grid would have {shape[0]} x {shape[1]} places for {xs.size} readings.",
            why=f"Positions lie closer together than {tolerance:g} of the step explains.",
            cure="Check the position columns and their unit, or raise the grid tolerance.",
        )
    for name, grid in grids.items():
        _report(notes, name, f"{grid.step * 1e3:.4g} mm apart", grid, tolerance)
    flat = grids["y"].index * shape[1] + grids["x"].index
    if repeat is not None:
        for positions, grid in ((xs, grids["x"]), (ys, grids["y"])):
            _check_merged(positions, np.stack([repeat, flat]), grid, tolerance)
        twice = flat.size - np.unique([repeat, flat], axis=1).shape[1]
        if twice:
            notes.append(f"{twice} readings share their place with another of the same repeat.")
    most = int(np.bincount(flat).max())
    if most > 1 and not averaged:
        raise InputError(
            f"The raster has up to {most} readings at one place.",
            why="A raster scan has one value for each place.",
            cure='Average them (repeats="average"; --repeats average), or import one repeat.',
        )

    def named(i: int) -> str:
        row, column = divmod(i, shape[1])
        x, y = grids["x"].places[column] * 1e3, grids["y"].places[row] * 1e3
        return f"x = {x:.4g} mm, y = {y:.4g} mm"

    means, errors = average_columns(columns, flat, shape, named, repeat, notes)
    _report_missing(notes, means["u_zz"])
    return Placed(grids["x"].places, grids["y"].places, means, errors)


def _check_merged(positions: FloatArray, keys: FloatArray, grid: Grid, tolerance: float) -> None:
    """Refuse a grid that takes different positions of one repeat for one place."""
    _, group = np.unique(keys, axis=1, return_inverse=True)
    group = group.reshape(-1)  # NumPy 2.0 kept an axis here
    low, high = np.full(group.max() + 1, np.inf), np.full(group.max() + 1, -np.inf)
    np.minimum.at(low, group, positions)
    np.maximum.at(high, group, positions)
    widest = float((high - low).max())
    if widest > 0.5 * tolerance * grid.step:
        raise InputError(
            f"One repeat has two readings {widest * 1e3:.4g} mm apart that would share a place.",
            why=f"The grid found has a step of {grid.step * 1e3:.4g} mm, and averaging would merge "
            "different positions.",
            cure="Lower the grid tolerance, or check the columns of positions and repeats.",
        )


def _count_repeats(xs: FloatArray, numbers: FloatArray | None, notes: list[str]) -> IntArray:
    """Number the repeats from 0: by their column, or by how often a position came before."""
    if numbers is not None:
        return np.unique(numbers, return_inverse=True)[1].astype(np.int64)
    _, place = np.unique(xs, return_inverse=True)
    order = np.argsort(place, kind="stable")
    starts = np.concatenate([[0], np.cumsum(np.bincount(place))[:-1]])
    repeat = np.empty(place.size, dtype=np.int64)
    repeat[order] = np.arange(place.size) - starts[place[order]]
    if repeat.max() > 0:
        notes.append("Equal positions were counted as repeats, in the order of the file.")
    return repeat


def _report(notes: list[str], name: str, apart: str, grid: Grid, tolerance: float) -> None:
    notes.append(
        f"Along {name}: {grid.places.size} places, {apart}; readings lie up "
        f"to {grid.deviation * 1e3:.3g} mm from theirs "
        f"({grid.deviation / grid.step:.2g} of the smallest step; {tolerance:g} is allowed)."
    )


def _report_missing(notes: list[str], values: FloatArray) -> None:
    missing = int(np.isnan(values).sum())
    if missing:
        notes.append(f"{missing} of {values.size} points are missing (NaN).")
