"""Holds in the log of an instrument: rows in which the indenter presses at rest, averaged."""

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError
from memscal.model.arrays import BoolArray, FloatArray, IndexArray
from memscal.model.holds import Holds
from memscal.model.notation import Reading

#: The indenter moves where its position changes, from one row to the next, by more than this share
#: of the whole way, and presses where the load is above this share of the way from lifted to held.
_MOVING = 1e-3
_PRESSED = 0.05
#: A load that never falls below this share of the largest is never lifted.
_LIFTED = 0.5
#: Load and reading are steady within this share, or so many standard deviations of their noise.
_STEADY = 0.02
_NOISE = 5.0
_TO_SIGMA = 1.4826 / np.sqrt(2)
#: Fewer rows do not tell the scatter.
_FEWEST = 5
_LOGGED = ("x", "y", "u_zz", "normal_load")
_CURE = (
    "Check the columns of position, load and reading; name the column of the load "
    "(load_column=...; --load-column COLUMN), which tells best when the indenter presses."
)


def find_holds(columns: Mapping[str, FloatArray], line: NDArray[Any], reading: Reading) -> Holds:
    """Find the holds in the columns of a log, which are in the order of time."""
    whole = np.logical_and.reduce([np.isfinite(columns[n]) for n in _LOGGED if n in columns])
    columns = {name: values[whole] for name, values in columns.items()}
    line = line[whole]
    u = columns["u_zz"]
    load = columns.get("normal_load")
    if u.size < _FEWEST:
        raise InputError(f"The log has {u.size} rows without gaps.", cure=_CURE)
    position = columns["x"] + 1j * columns.get("y", np.zeros(u.size))
    way = np.hypot(np.ptp(position.real), np.ptp(position.imag))
    moves = np.abs(np.diff(position)) > _MOVING * way
    dwell = np.append(0, np.cumsum(moves))
    if load is None:
        pressed = _timed(u, dwell)
    else:
        lifted, top = np.quantile(load, [0.01, 0.99])
        pressed = (lifted > _LIFTED * top) | (load > lifted + _PRESSED * (top - lifted))

    starts = np.flatnonzero(np.diff(np.where(pressed, dwell, -1), prepend=-1))
    runs = [run for run in np.split(np.arange(u.size), starts) if run.size and pressed[run[0]]]
    if load is not None:  # the ramps of a run are below the hold
        runs = _steady_rows(runs, load, pressed, lifted=0.0, share=0.75)
    level = 0.0 if pressed.all() else np.median(u[~pressed])
    runs = _steady_rows(runs, u, pressed, lifted=level, share=0.5)
    held = [run for run in runs if run.size >= _FEWEST]
    if not held:
        why = f"A hold is {_FEWEST} rows or more in which position, load and reading are steady."
        raise InputError("The log has no hold.", why=why, cure=_CURE)
    return _averaged(columns, line, held, len(runs) - len(held), reading)


def _averaged(
    columns: Mapping[str, FloatArray],
    line: NDArray[Any],
    held: list[IndexArray],
    left_out: int,
    reading: Reading,
) -> Holds:
    """Average all columns over the rows of each hold, and say what the readings scatter by."""
    first = np.array([run[0] for run in held])
    stop = np.array([run[-1] + 1 for run in held])
    size = stop - first
    u = columns["u_zz"]
    mean = {
        name: np.array([values[run].mean() for run in held]) for name, values in columns.items()
    }
    for name in mean.keys() & {"repeat", "branch"}:
        mean[name] = columns[name][first]

    residuals = [u[run] - u[run].mean() for run in held]
    scatter = np.array([np.std(residual, ddof=1) for residual in residuals])
    # A few rows may agree by chance: no hold counts as less noisy than the typical one.
    noise = np.maximum(scatter, np.median(scatter))
    # Neighbouring rows correlate as an amplifier's filter makes them.
    power = sum(residual @ residual for residual in residuals) or 1.0
    neighbours = sum(residual[1:] @ residual[:-1] for residual in residuals)
    correlation = np.clip(neighbours / power + 1 / np.median(size), 0.0, 0.95)
    errors = noise * np.sqrt((1 + correlation) / (1 - correlation)) / np.sqrt(size)

    thirds = [run.size // 3 for run in held]
    change = np.array(
        [u[run[-n:]].mean() - u[run[:n]].mean() for run, n in zip(held, thirds, strict=True)]
    )
    averaged = (
        f"{len(held)} holds of {size.min()} to {size.max()} rows, the first in lines "
        f"{line[first[0]]} to {line[stop[0] - 1]}, are averaged to one reading each; "
        f"{left_out} presses of fewer than {_FEWEST} steady rows are left out."
    )
    scatters = (
        f"Within a hold the readings scatter by {reading.text(np.median(scatter))}, neighbouring "
        f"rows correlate by {correlation:.2g}, and the mean has the standard uncertainty "
        f"{reading.text(np.median(errors))} (medians)."
    )
    changes = (
        "From the first to the last third of a hold the readings change by "
        f"{reading.text(np.median(change))} (median; at most by "
        f"{reading.text(np.abs(change).max())})."
    )
    log = {name: columns[name] for name in _LOGGED if name in columns}
    return Holds(log, line, first, stop, mean, errors, reading, (averaged, scatters, changes))


def _timed(u: FloatArray, dwell: IndexArray) -> BoolArray:
    """Tell from the readings when the indenter presses, after it came to rest at a place."""
    # Far from the sensor no reading tells: the times at the others' places, all alike, do.
    starts = np.flatnonzero(np.diff(dwell, prepend=-1))
    size = np.diff(starts, append=u.size)
    time = (np.arange(u.size) - starts[dwell]) / size[dwell]
    spans = []
    for start, count in zip(starts, size, strict=True):
        rows = slice(start, start + count)
        low, high = np.quantile(u[rows], [0.05, 0.95])
        if count >= _FEWEST and high - low > 2 * _NOISE * _noise(u[rows]):
            raised = time[rows][u[rows] > (low + high) / 2]
            spans.append((raised[0], raised[-1]))
    begins, ends = np.array(spans or [(0.0, 1.0)]).T
    begin = np.quantile(begins, 0.9)
    end = np.quantile(ends, 0.1)
    if end - begin < _PRESSED:
        why = "The readings rise at other times at each place."
        raise InputError("The log does not show when the indenter presses.", why=why, cure=_CURE)
    return np.asarray((time >= begin) & (time <= end) & (size[dwell] >= _FEWEST))


def _noise(values: FloatArray) -> float:
    return float(np.median(np.abs(np.diff(values)))) * _TO_SIGMA if values.size > 1 else 0.0


def _steady_rows(
    runs: list[IndexArray],
    values: FloatArray,
    pressed: BoolArray,
    *,
    lifted: float,
    share: float,
) -> list[IndexArray]:
    """Cut each run to the rows from the first to the last that is close to its quantile."""
    noise = _NOISE * _noise(values[pressed])
    steady = []
    for run in runs:
        if not run.size:
            continue
        held = np.quantile(values[run], share)
        near = max(noise, _STEADY * abs(held - lifted))
        inside = np.flatnonzero(np.abs(values[run] - held) <= near)
        steady.append(run[inside[0] : inside[-1] + 1] if inside.size else run[:0])
    return steady
