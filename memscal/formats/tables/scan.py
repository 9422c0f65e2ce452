"""Scans from tables with one row per reading."""

import os
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError
from memscal.formats.tables.reference import require_sign
from memscal.formats.tables.text_table import Table, Wanted
from memscal.formats.units import reading_of
from memscal.model.checks import Message, import_notes, marked_texts
from memscal.model.indenter import Rod, RoundIndenter
from memscal.model.quantities import dimension_in
from memscal.model.scan import BRANCHES, Scan, branch_numbers, places_of

Column = str | int
Columns = dict[str, NDArray[Any]]

#: Positions closer than this share of the typical spacing are probably one place, and a table with
#: so large a share of them was probably repeated.
_CLOSE, _MANY = 0.1, 0.25
#: Loads of one line that differ by more than this share were hardly meant to be one.
_MIXED = 0.3


@dataclass(frozen=True, eq=False)
class ImportedScan:
    """A scan that was read from a table, and what was done on the way."""

    scan: Scan
    notes: tuple[Message, ...]


def read_scan_table(
    path: str | os.PathLike[str],
    *,
    x: Column,
    u: Column,
    x_unit: str | None = None,
    u_unit: str | None = None,
    load: float | None = None,
    y: Column | None = None,
    repeat: Column | Sequence[Column] | None = None,
    branch: Column | None = None,
    u_xz: Column | None = None,
    u_yz: Column | None = None,
    load_column: Column | None = None,
    load_unit: str = "N",
    load_scatter: float | None = None,
    x_error: float | None = None,
    u_sign: int = 1,
    delimiter: str | None = None,
    decimal: str | None = None,
    **stated: Any,
) -> ImportedScan:
    """Read a scan from a table with one row per reading; ``stated`` are further fields of it."""
    # Columns are names, or numbers counted from 1; x_unit holds for y too, u_unit for all channels;
    # by default they are those of the columns' heads (x/mm). load_scatter, relative, and x_error,
    # in m, are independent from point to point.
    require_sign("sign of the voltage", u_sign)
    table = Table(path, delimiter=delimiter, decimal=decimal)
    u_unit = table.unit_of(u, u_unit, "u_unit (--u-unit)")
    x_unit = table.unit_of(x, x_unit, "x_unit (--x-unit)")
    reading = reading_of(u_unit, table.where(u))
    of_unit = dimension_in("voltage", reading)
    of_quantities = {
        "u_zz": (u, u_unit, of_unit),
        "u_xz": (u_xz, u_unit, of_unit),
        "u_yz": (u_yz, u_unit, of_unit),
        "normal_load": (load_column, load_unit, "force"),
        "x": (x, x_unit, "length"),
        "y": (y, x_unit, "length"),
    }
    wanted = {
        name: Wanted(column, unit, dimension)
        for name, (column, unit, dimension) in of_quantities.items()
        if column is not None
    }
    numbering = [repeat] if isinstance(repeat, str | int) else list(repeat or ())
    wanted |= {f"repeat {i}": Wanted(c, words=BRANCHES) for i, c in enumerate(numbering)}
    if branch is not None:
        wanted["branch"] = Wanted(branch, words=BRANCHES)
    columns: Columns = table.columns(wanted)
    notes = [*table.notes]
    if u_sign < 0:
        columns["u_zz"] *= -1
        notes.append("The sign of u_zz was changed.")
    if reading.si != "V":
        notes.append(f"The readings are in {u_unit}.")
    if load is None and "normal_load" in columns:
        load = float(np.nanmedian(columns["normal_load"]))
        notes.append(f"The nominal load is the median of the column: {load:g} N.")
    if load_scatter is not None and "normal_load" not in columns:
        if load is None:
            problem = "The scatter of the loads is given, but no load."
            raise InputError(problem, cure="Give the load in N, or its column.")
        columns["normal_load"] = np.full(columns["u_zz"].shape, load)
    if numbering:
        columns["repeat"] = _lines(columns, numbering, notes)
    if branch is not None:
        columns["branch"] = branch_numbers(table.where(branch), np.nan_to_num(columns["branch"]))
    columns = _placed(columns, notes)
    notes += _counted(columns)
    messages = import_notes(notes)
    if "y" not in columns and "normal_load" in columns:
        indenter = stated.get("indenter")
        messages += _mixed_loads(columns["normal_load"], columns.get("repeat"), indenter)
    columns = _as_rows(columns)
    loads = columns.get("normal_load")
    scan = Scan(
        x=columns["x"],
        y=columns.get("y"),
        repeat=columns.get("repeat"),
        branch=columns.get("branch"),
        x_errors=None if x_error is None else np.full(columns["x"].size, x_error),
        u_zz=columns["u_zz"],
        normal_load=loads,
        normal_load_errors=None if load_scatter is None or loads is None else load_scatter * loads,
        channels={name: columns[name] for name in ("u_xz", "u_yz") if name in columns},
        load=load,
        unit=reading.si,
        notes="\n".join(marked_texts(messages)),
        source=table.source,
        **stated,
    )
    return ImportedScan(scan, tuple(messages))


def _lines(columns: Columns, numbering: Sequence[Column], notes: list[str]) -> NDArray[Any]:
    """Number the line of each row: by one column, or by the combinations of several."""
    values = [columns.pop(f"repeat {i}") for i in range(len(numbering))]
    if len(values) == 1:
        return values[0]
    finite = np.logical_and.reduce([np.isfinite(column) for column in values])
    number = np.zeros(int(finite.sum()), dtype=np.intp)
    for column in values:
        distinct, index = np.unique(column[finite], return_inverse=True)
        number = np.unique(number * distinct.size + index, return_inverse=True)[1]
    lines = np.full(finite.size, np.nan)
    lines[finite] = 1 + number
    names = " and ".join(repr(column) for column in numbering)
    combinations = int(number.max(initial=-1)) + 1
    notes.append(f"{combinations} lines: one for each combination of the columns {names}.")
    return lines


def _placed(columns: Columns, notes: list[str]) -> Columns:
    """Leave out rows without a position or the number of a repeat; count the repeats from 0."""
    stated = [columns[name] for name in ("x", "y", "repeat") if name in columns]
    finite = np.logical_and.reduce([np.isfinite(values) for values in stated])
    if not finite.any():
        raise InputError("No row of the table has a position.", cure="Check the columns.")
    if not finite.all():
        notes.append(f"{int((~finite).sum())} rows without a position were left out.")
        columns = {name: values[finite] for name, values in columns.items()}
    if "repeat" in columns:
        columns["repeat"] = np.unique(columns["repeat"], return_inverse=True)[1]
    return columns


def _counted(columns: Columns) -> list[str]:
    x, y = columns["x"], columns.get("y", np.zeros(columns["x"].size))
    repeat = columns.get("repeat", np.zeros(x.size, dtype=np.intp))
    places = places_of(x, y, repeat)
    number = int(repeat.max()) + 1
    in_repeats = f" in {number} repeats" if number > 1 else ""
    step = " x ".join(f"{step * 1e3:.4g}" for step in places.steps if step)
    apart = f", typically {step} mm apart" if step else ""
    reach = ", ".join(
        f"{name} from {values.min() * 1e3:.4g} to {values.max() * 1e3:.4g} mm"
        for name, values in (("x", x), ("y", y))
        if name in columns
    )
    notes = [f"{x.size} readings{in_repeats} at {places.count} places{apart}; {reach}."]
    if "branch" in columns:
        counts = [int((columns["branch"] == number).sum()) for number in (1, 2, 0)]
        words = "{} readings on approach, {} on retreat, {} of neither branch."
        notes.append(words.format(*counts))
    for name, values in columns.items():
        if missing := int(np.isnan(values).sum()):
            notes.append(f"{missing} values of {name} are missing (NaN).")
    full = number * places.count - x.size
    if number > 1 and full > 0:
        notes.append(f"{full} more would make every repeat complete.")
    if "repeat" not in columns and "y" not in columns:
        gaps = np.sort(np.diff(np.sort(x)))
        # The gap in which half of the length lies: repeated positions do not change it.
        typical = gaps[np.searchsorted(np.cumsum(gaps), 0.5 * np.ptp(x))] if np.ptp(x) else 0.0
        close = int(np.sum(gaps < _CLOSE * typical))
        if close > _MANY * x.size:
            notes.append(
                f"{close} of {x.size} positions lie closer to another than {_CLOSE:.0%} of the "
                "typical spacing. If they are repeats, name the column that numbers them "
                '(repeat="..."; --repeat COLUMN): then each is predicted from the others.'
            )
    return notes


def _as_rows(columns: Columns) -> Columns:
    """Make rows of repeats over exactly the same positions; leave all other columns as they are."""
    if "repeat" not in columns or "y" in columns:
        return columns
    readings = np.bincount(columns["repeat"])
    if np.any(readings != readings[0]):
        return columns
    order = np.lexsort((columns["x"], columns["repeat"]))
    x = columns["x"][order].reshape(readings.size, -1)
    if np.any(np.diff(x[0]) == 0) or np.any(x != x[0]):
        return columns
    # A column goes as its rows come: of ten million readings not all are held twice.
    names = [name for name in columns if name not in ("x", "repeat")]
    return {"x": x[0], **{name: columns.pop(name)[order].reshape(x.shape) for name in names}}


def _mixed_loads(
    loads: NDArray[Any], repeat: NDArray[Any] | None, indenter: RoundIndenter | None
) -> list[Message]:
    """Warn of lines at several loads: only a rod's voltage is proportional to its load."""
    if indenter is None or isinstance(indenter, Rod):
        return []
    line = np.zeros(loads.size, dtype=np.intp) if repeat is None else repeat
    order = np.argsort(line, kind="stable")
    of_lines = np.split(loads[order], np.flatnonzero(np.diff(line[order])) + 1)
    stated = [v[np.isfinite(v)] for v in of_lines]
    mixed = [v for v in stated if v.size and np.ptp(v) > _MIXED * np.median(v)]
    if not mixed:
        return []
    text = (
        f"The loads of a line go from {mixed[0].min():.4g} to {mixed[0].max():.4g} N, "
        "but each load has a profile of its own. Name the column of the loads that were set among "
        'those that number the repeats (repeat=("set load", "pass"); --repeat "set load" --repeat '
        "pass)."
    )
    return [Message("mixed_loads", text, "warning")]
