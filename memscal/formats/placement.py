"""From readings to the arrays of a scan: places, repeats, and what is missing."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from memscal.errors import InputError
from memscal.formats.grid import Grid, IntArray, find_grid, group_positions
from memscal.model.validation import FloatArray

__all__ = ["Placed", "place_readings"]

# A raster whose grid is this much larger than its data is a misread column.
_MAX_EMPTINESS = 100


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
    average: bool,
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
    average : bool
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
        return _place_raster(xs, ys[known], numbers, columns, tolerance, average, notes)
    repeat = _count_repeats(xs, numbers, notes)
    if repeat.max() == 0:
        notes.append("A line scan without repeats: positions are kept as they are.")
        return Placed(xs, None, columns, None)
    return _place_line(xs, repeat, columns, tolerance, average, notes)


def _place_line(
    xs: FloatArray,
    repeat: IntArray,
    columns: Mapping[str, FloatArray],
    tolerance: float,
    average: bool,
    notes: list[str],
) -> Placed:
    grid = group_positions("x", xs, repeat, tolerance)
    _report(notes, "x", grid, tolerance)
    if average:
        means, errors = _average(columns, grid.index, grid.places.shape, notes)
        return Placed(grid.places, None, means, errors)
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
    average: bool,
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
        _report(notes, name, grid, tolerance)
    flat = grids["y"].index * shape[1] + grids["x"].index
    if repeat is not None:
        for positions, grid in ((xs, grids["x"]), (ys, grids["y"])):
            _check_merged(positions, np.stack([repeat, flat]), grid, tolerance)
        twice = flat.size - np.unique([repeat, flat], axis=1).shape[1]
        if twice:
            notes.append(f"{twice} readings share their place with another of the same repeat.")
    most = int(np.bincount(flat).max())
    if most > 1 and not average:
        raise InputError(
            f"The raster has up to {most} readings at one place.",
            why="A raster scan has one value for each place.",
            cure='Average them (repeats="average"; --repeats average), or import one repeat.',
        )
    means, errors = _average(columns, flat, shape, notes)
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


def _average(
    columns: Mapping[str, FloatArray], flat: IntArray, shape: tuple[int, ...], notes: list[str]
) -> tuple[dict[str, FloatArray], FloatArray | None]:
    """Return means by place, and the standard uncertainty of u_zz from the pooled spread."""
    size = int(np.prod(shape))
    means, errors = {}, None
    for name, values in columns.items():
        good = np.isfinite(values)
        number = np.bincount(flat[good], minlength=size).astype(float)
        total = np.bincount(flat[good], weights=values[good], minlength=size)
        mean = np.divide(total, number, out=np.full(size, np.nan), where=number > 0)
        means[name] = mean.reshape(shape)
        freedom = float(np.sum(np.maximum(number - 1, 0)))
        if name == "u_zz" and freedom > 0:
            spread = float(np.sqrt(np.sum((values[good] - mean[flat[good]]) ** 2) / freedom))
            scatter = np.full(size, spread)
            errors = np.divide(
                scatter, np.sqrt(number), out=np.full(size, np.nan), where=number > 0
            ).reshape(shape)
            notes.append(
                f"Repeats were averaged, {number[number > 0].mean():.3g} at a place on average; "
                f"their pooled standard deviation is {spread * 1e3:.4g} mV "
                f"({freedom:.0f} degrees of freedom), and u_zz_errors is that of the mean."
            )
    return means, errors


def _report(notes: list[str], name: str, grid: Grid, tolerance: float) -> None:
    notes.append(
        f"Along {name}: {grid.places.size} places, {grid.step * 1e3:.6g} mm apart; readings lie up "
        f"to {grid.deviation * 1e3:.3g} mm from theirs "
        f"({grid.deviation / grid.step:.2g} of the step; {tolerance:g} is allowed)."
    )


def _report_missing(notes: list[str], values: FloatArray) -> None:
    missing = int(np.isnan(values).sum())
    if missing:
        notes.append(f"{missing} of {values.size} points are missing (NaN).")
