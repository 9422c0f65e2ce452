"""Holds in the log of an instrument: rows in which the indenter presses at rest, averaged."""

from dataclasses import replace

import numpy as np

from memscal.errors import InputError, counted
from memscal.model.arrays import Arrays, BoolArray, FloatArray, IndexArray
from memscal.model.holds import Holds
from memscal.model.notation import Reading
from memscal.readings.ceiling import ceiling_of_holds

Runs = list[IndexArray]
"""Rows of a log that follow each other, run by run."""

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
#: A place is like the others within this share of their rows, or so many of their deviations.
_ALIKE = 0.05
_DEVIATIONS = 4.0
_CURE = (
    "Check the columns of position, load and reading; name the column of the load "
    "(load_column=...; --load-column COLUMN) or of a depth that grows as the indenter is lowered "
    "(depth=...; --depth COLUMN), which tell best when it presses."
)


def find_holds(
    columns: Arrays,
    line: IndexArray,
    reading: Reading,
    *,
    depth: FloatArray | None = None,
    baseline: bool = False,
) -> Holds:
    """Find the holds in the columns of a log, which are in the order of time.

    A depth in any unit tells when the indenter presses.  Of each hold the reading before its press
    may be subtracted as its baseline.
    """
    logged = [columns[name] for name in _LOGGED if name in columns]
    if depth is not None:
        logged.append(depth)
    whole = np.logical_and.reduce([np.isfinite(values) for values in logged])
    columns = {name: values[whole] for name, values in columns.items()}
    line = line[whole]
    notes: list[str] = []
    u = columns["u_zz"]
    load = columns.get("normal_load")
    if u.size < _FEWEST:
        raise InputError(f"The log has {counted(u.size, 'rows')} without gaps.", cure=_CURE)
    position = columns["x"] + 1j * columns.get("y", 0.0)
    way = np.hypot(np.ptp(position.real), np.ptp(position.imag))
    moves = abs(np.diff(position)) > _MOVING * way
    dwell = np.append(0, np.cumsum(moves))
    if depth is not None:
        pressed, waiting = _lowered(u, depth[whole], dwell, notes)
    elif load is None:
        pressed, waiting = _timed(u, dwell, line, notes)
    else:
        lifted, top = np.quantile(load, [0.01, 0.99])
        pressed = (lifted > _LIFTED * top) | (load > lifted + _PRESSED * (top - lifted))
        waiting = ~pressed

    runs = _runs(pressed, dwell)
    if load is not None:  # the ramps of a run are below the hold
        runs = _steady_rows(runs, load, pressed, lifted=0.0, share=0.75)
    level = 0.0 if pressed.all() else np.median(u[~pressed])
    runs = _steady_rows(runs, u, pressed, lifted=level, share=0.5)
    held = [run for run in runs if run.size >= _FEWEST]
    if not held:
        raise InputError(
            "The log has no hold.",
            why=f"A hold is {_FEWEST} rows or more in which position, load and reading are steady.",
            cure=_CURE,
        )
    highest = np.array([u[run].max() for run in held])
    ceiling = ceiling_of_holds(u, held, highest)
    before = None
    if baseline:
        before = _before_each(columns, line, held, waiting, dwell)
        notes.append("The mean of the rows before its press is subtracted from each hold.")
    holds = _averaged(columns, line, held, before, len(runs) - len(held), reading, notes)
    return replace(holds, highest=highest, ceiling=ceiling)


def _averaged(
    columns: Arrays,
    line: IndexArray,
    held: Runs,
    before: FloatArray | None,
    left_out: int,
    reading: Reading,
    notes: list[str],
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
    for name in columns:
        if " of " in name:  # a sensor of an array
            one = _averaged({"u_zz": columns[name]}, line, held, before, 0, reading, [])
            mean[name.replace("u_zz", "u_zz_errors")] = one.u_errors

    residuals = [u[run] - u[run].mean() for run in held]
    scatter = np.array([np.std(residual, ddof=1) for residual in residuals])
    # A few rows may agree by chance: no hold counts as less noisy than the typical one.
    noise = np.maximum(scatter, np.median(scatter))
    # Neighbouring rows correlate as an amplifier's filter makes them.
    power = sum(residual @ residual for residual in residuals) or 1.0
    neighbours = sum(residual[1:] @ residual[:-1] for residual in residuals)
    correlation = np.clip(neighbours / power + 1 / np.median(size), 0.0, 0.95)
    errors = noise * np.sqrt((1 + correlation) / (1 - correlation) / size)
    if before is not None:
        errors = errors * np.sqrt(1 + size / before)

    change = np.array(
        [u[run[-(run.size // 3) :]].mean() - u[run[: run.size // 3]].mean() for run in held]
    )
    averaged = (
        f"{counted(len(held), 'holds')} of {size.min()} to {size.max()} rows, the first in lines "
        f"{line[first[0]]} to {line[stop[0] - 1]}, averaged to one reading each; "
        f"presses of fewer than {_FEWEST} steady rows left out: {left_out}."
    )
    scatters = (
        f"Within a hold the readings scatter by {reading.text(np.median(scatter))}, neighbouring "
        f"rows correlate by {correlation:.2g}, and the mean has the standard uncertainty "
        f"{reading.text(np.median(errors))} (medians)."
    )
    changes = (
        "From the first to the last third of a hold the readings change by "
        f"{reading.text(np.median(change))} (median; at most by "
        f"{reading.text(abs(change).max())})."
    )
    log = {name: columns[name] for name in _LOGGED if name in columns}
    return Holds(
        log, line, first, stop, mean, errors, reading, (averaged, scatters, changes, *notes)
    )


def _runs(rows: BoolArray, dwell: IndexArray) -> Runs:
    """Return runs of some rows, each within one dwell."""
    starts = np.flatnonzero(np.diff(np.where(rows, dwell, -1), prepend=-1))
    return [run for run in np.split(np.arange(rows.size), starts) if run.size and rows[run[0]]]


def _lowered(
    u: FloatArray, depth: FloatArray, dwell: IndexArray, notes: list[str]
) -> tuple[BoolArray, BoolArray]:
    """Tell from the depth when the indenter presses, at its lowest at a place, and when not."""
    places = _runs(np.bincount(dwell)[dwell] >= _FEWEST, dwell)
    # Each place has its stroke, with the way to the next: one that is lifted far changes no other.
    ways = np.split(np.arange(u.size), [place[0] for place in places])[1:]
    ends = [np.sort(depth[way])[[_FEWEST - 1, -_FEWEST]] for way in ways]
    lifted, top = np.median(ends or np.zeros((1, 2)), axis=0).tolist()
    noise = _NOISE * _noise(depth)
    near = _PRESSED * (top - lifted) + noise
    waiting = depth <= (lifted + top) / 2
    pressed = np.zeros(u.size, dtype=bool)
    levels = []
    for place, way in zip(places, ways, strict=True):
        low = place[~waiting[place]]
        high = way[waiting[way]]
        if low.size:  # it may wait above the film, and overshoot
            lowest = low[depth[low] > np.quantile(depth[low], 0.9) - near]
            pressed[low[(low >= lowest[0]) & (low <= lowest[-1])]] = True
            # Of several levels before a press the indenter rests at the least deep one.
            before = high[high < lowest[0]]
            least = np.sort(depth[before])[:_FEWEST].max(initial=-np.inf)
            waiting[before] = depth[before] <= least + near
            if high.size:
                levels.append((np.median(u[low]), np.median(u[high])))
    below, above = np.ptp(levels or np.zeros((1, 2)), axis=0)
    changes = top - lifted > 2 * noise and len(levels) > len(places) / _FEWEST
    if not changes or above > 2 * below + _NOISE * _noise(u):
        raise InputError(
            "The depth does not tell when the indenter presses.",
            why="It grows as the indenter is lowered, and the readings differ where it is large.",
            cure="Name another column (--depth), or change the sign of a height.",
        )
    longest = max((run.size for run in _runs(~pressed, dwell)), default=0)
    notes.append(
        f"The depth tells the presses; waits above them, of up to {longest} rows, are left out."
    )
    return pressed, waiting


def _before_each(
    columns: Arrays,
    line: IndexArray,
    held: Runs,
    waiting: BoolArray,
    dwell: IndexArray,
) -> FloatArray:
    """Subtract from each hold the reading before its press; return of how many rows it is."""
    u = columns["u_zz"]
    near = _NOISE * _noise(u[waiting])
    size = np.zeros(len(held))
    for i, run in enumerate(held):
        place = np.arange(np.searchsorted(dwell, dwell[run[0]]), run[0])
        # The nearest rows, as many as the hold has: what drifted long before counts no more.
        rows = place[waiting[place]][-run.size :]
        if rows.size < _FEWEST:
            raise InputError(
                f"The hold of lines {line[run[0]]} to {line[run[-1]]} has no baseline.",
                why=f"Before its press it has {rows.size} rows at its place, of {_FEWEST} or more.",
                cure="Leave out these lines, or baseline (--baseline).",
            )
        rows = rows[abs(u[rows] - np.median(u[rows])) <= near]
        size[i] = rows.size
        for name in columns:
            if name.startswith("u_"):
                columns[name][run] -= columns[name][rows].mean()
    return size


def _timed(
    u: FloatArray, dwell: IndexArray, line: IndexArray, notes: list[str]
) -> tuple[BoolArray, BoolArray]:
    """Tell from the readings when the indenter presses at a place, and when it waits before."""
    # Far from the sensor no reading tells: the times at the others' places, all alike, do.
    starts = np.flatnonzero(np.diff(dwell, prepend=-1))
    size = np.diff(starts, append=u.size)
    own = size[dwell]
    time = (np.arange(u.size) - starts[dwell]) / own
    # Short stops on the way are no places, and long waits at some do not tell what is usual.
    usual = np.median(size[4 * size > np.median(own)])
    spread = _DEVIATIONS * np.median(abs(own - usual))
    alike = abs(size - usual) <= max(_FEWEST, _ALIKE * usual, min(spread, usual / 2))
    spans = []
    for start, count in zip(starts[alike], size[alike], strict=True):
        rows = slice(start, start + count)
        raised = time[rows][_raised(u[rows])]
        if count >= _FEWEST and raised.size:
            spans.append((raised[0], raised[-1]))
    begins, ends = np.array(spans or [(0.0, 1.0)]).T
    begin = np.quantile(begins, 0.9)
    end = np.quantile(ends, 0.1)
    if end - begin < _PRESSED:
        raise InputError(
            "The log does not show when the indenter presses.",
            why="The readings rise at other times at each place.",
            cure=_CURE,
        )
    pressed = (time >= begin) & (time <= end) & (own >= _FEWEST)
    waiting = time < np.quantile(begins, 0.1)
    press = (end - begin) * usual
    for i in np.flatnonzero(~alike & ((end - begin) * size >= _FEWEST)):
        place = np.flatnonzero(dwell == i)
        held = place[_raised(u[place])]
        which = f"lines {line[place[0]]} to {line[place[-1]]}"
        if not press / 2 <= held.size <= 2 * press or np.ptp(held) > 1.1 * held.size:
            raise InputError(
                f"The log does not show when the indenter presses in {which}.",
                why=f"It rests for {place.size} rows there, at other places for {usual:.0f} "
                "(median).",
                cure=f"{_CURE} Or leave these lines out.",
            )
        pressed[place] = (place >= held[0]) & (place <= held[-1])
        waiting[place] = place < held[0]
        notes.append(
            f"Of {which}, more or less than at other places, the plateau of lines "
            f"{line[held[0]]} to {line[held[-1]]} is taken: its readings are higher."
        )
    return pressed, waiting


def _raised(u: FloatArray) -> BoolArray:
    """Return where the readings of a place are on the higher of two levels; nowhere if on one."""
    low, high = np.quantile(u, [0.05, 0.95])
    return np.asarray((high - low > 2 * _NOISE * _noise(u)) & (u > (low + high) / 2))


def _noise(values: FloatArray) -> float:
    return float(np.median(abs(np.diff(values)))) * _TO_SIGMA if values.size > 1 else 0.0


def _steady_rows(
    runs: Runs, values: FloatArray, pressed: BoolArray, *, lifted: float, share: float
) -> Runs:
    """Cut each run to the rows from the first to the last that is close to its quantile."""
    noise = _NOISE * _noise(values[pressed])
    steady = []
    for run in runs:
        if not run.size:
            continue
        held = np.quantile(values[run], share)
        near = max(noise, _STEADY * abs(held - lifted))
        inside = np.flatnonzero(abs(values[run] - held) <= near)
        steady.append(run[inside[0] : inside[-1] + 1] if inside.size else run[:0])
    return steady
