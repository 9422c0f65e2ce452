"""Scans from tables with one row per reading."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from memscal.errors import InputError
from memscal.formats.tables.reference import require_sign
from memscal.formats.tables.text_table import Table, read_table
from memscal.formats.units import reading_of
from memscal.model.arrays import FloatArray
from memscal.model.checks import Message, import_notes, marked_texts
from memscal.model.indenter import Rod, RoundIndenter
from memscal.model.quantities import dimension_in
from memscal.model.scan import BRANCHES, Scan, branch_numbers, places_of

Column = str | int

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
    table = read_table(path, delimiter=delimiter, decimal=decimal)
    notes = [*table.notes]
    channels = {n: c for n, c in (("u_zz", u), ("u_xz", u_xz), ("u_yz", u_yz)) if c is not None}
    u_unit = table.unit_of(u, u_unit, "u_unit (--u-unit)")
    x_unit = table.unit_of(x, x_unit, "x_unit (--x-unit)")
    reading = reading_of(u_unit, table.where(u))
    of_unit = dimension_in("voltage", reading)
    columns = {n: table.quantity(c, u_unit, of_unit) for n, c in channels.items()}
    columns["u_zz"] = u_sign * columns["u_zz"]
    notes += ["The sign of u_zz was changed."] if u_sign < 0 else []
    if reading.si != "V":
        notes.append(f"The readings are in {u_unit}.")
    if load_column is not None:
        columns["normal_load"] = table.quantity(load_column, load_unit, "force")
    if load is None and "normal_load" in columns:
        load = float(np.nanmedian(columns["normal_load"]))
        notes.append(f"The nominal load is the median of the column: {load:g} N.")
    if load_scatter is not None and "normal_load" not in columns:
        if load is None:
            problem = "The scatter of the loads is given, but no load."
            raise InputError(problem, cure="Give the load in N, or its column.")
        columns["normal_load"] = np.full(columns["u_zz"].shape, load)
    columns["x"] = table.quantity(x, x_unit, "length")
    if y is not None:
        columns["y"] = table.quantity(y, x_unit, "length")
    if repeat is not None:
        columns["repeat"] = _lines(table, repeat, notes)
    if branch is not None:
        numbers = np.nan_to_num(table.column(branch, BRANCHES))
        columns["branch"] = branch_numbers(table.where(branch), numbers).astype(np.float64)
    columns = _placed(columns, notes)
    notes += _counted(columns)
    messages = import_notes(notes)
    if "y" not in columns and "normal_load" in columns:
        indenter = stated.get("indenter")
        messages += _mixed_loads(columns["normal_load"], columns.get("repeat"), indenter)
    arrays = _as_rows(columns)
    loads = arrays.get("normal_load")
    scan = Scan(
        x=arrays["x"],
        y=arrays.get("y"),
        repeat=None if "repeat" not in arrays else arrays["repeat"].astype(np.int64),
        branch=None if branch is None else arrays["branch"].astype(np.int64),
        x_errors=None if x_error is None else np.full(arrays["x"].size, x_error),
        u_zz=arrays["u_zz"],
        normal_load=loads,
        normal_load_errors=None if load_scatter is None or loads is None else load_scatter * loads,
        channels={name: arrays[name] for name in ("u_xz", "u_yz") if name in arrays},
        load=load,
        unit=reading.si,
        notes="\n".join(marked_texts(messages)),
        source=table.source,
        **stated,
    )
    return ImportedScan(scan, tuple(messages))


def _lines(table: Table, repeat: Column | Sequence[Column], notes: list[str]) -> FloatArray:
    """Number the line of each row: by one column, or by the combinations of several."""
    columns = [repeat] if isinstance(repeat, str | int) else list(repeat)
    values = np.stack([table.column(column, BRANCHES) for column in columns])
    if len(columns) == 1:
        return np.asarray(values[0])
    finite = np.isfinite(values).all(axis=0)
    combinations, number = np.unique(values[:, finite], axis=1, return_inverse=True)
    lines = np.full(finite.size, np.nan)
    lines[finite] = 1 + number.reshape(-1)  # NumPy 2.0 kept an axis here
    names = " and ".join(repr(column) for column in columns)
    notes.append(f"{combinations.shape[1]} lines: one for each combination of the columns {names}.")
    return lines


def _placed(columns: Mapping[str, FloatArray], notes: list[str]) -> dict[str, FloatArray]:
    """Leave out rows without a position or the number of a repeat; count the repeats from 0."""
    stated = [columns[name] for name in ("x", "y", "repeat") if name in columns]
    finite = np.isfinite(stated).all(axis=0)
    if not finite.any():
        raise InputError("No row of the table has a position.", cure="Check the columns.")
    if not finite.all():
        notes.append(f"{int((~finite).sum())} rows without a position were left out.")
    kept = {name: values[finite] for name, values in columns.items()}
    if "repeat" in kept:
        kept["repeat"] = np.unique(kept["repeat"], return_inverse=True)[1].astype(np.float64)
    return kept


def _counted(columns: Mapping[str, FloatArray]) -> list[str]:
    x, y = columns["x"], columns.get("y", np.zeros(columns["x"].size))
    repeat = columns.get("repeat", np.zeros(x.size)).astype(np.intp)
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


def _as_rows(columns: Mapping[str, FloatArray]) -> Mapping[str, FloatArray]:
    """Make rows of repeats over exactly the same positions; leave all other columns as they are."""
    if "repeat" not in columns or "y" in columns:
        return columns
    number = int(columns["repeat"].max()) + 1
    order = np.lexsort((columns["x"], columns["repeat"]))
    if number > 1 and order.size % number:
        return columns
    rows = {name: values[order].reshape(number, -1) for name, values in columns.items()}
    x = rows.pop("x")
    if np.any(np.diff(x[0]) == 0) or np.any(x != x[0]) or np.any(np.diff(rows.pop("repeat"))):
        return columns
    return {"x": x[0], **rows}


def _mixed_loads(
    loads: FloatArray, repeat: FloatArray | None, indenter: RoundIndenter | None
) -> list[Message]:
    """Warn of lines at several loads: only a rod's voltage is proportional to its load."""
    line = np.zeros(loads.size) if repeat is None else repeat
    of_lines = [loads[(line == i) & np.isfinite(loads)] for i in np.unique(line)]
    mixed = [v for v in of_lines if v.size and np.ptp(v) > _MIXED * np.median(v)]
    if indenter is None or isinstance(indenter, Rod) or not mixed:
        return []
    text = (
        f"The loads of a line go from {mixed[0].min():.4g} to {mixed[0].max():.4g} N, "
        "but each load has a profile of its own. Name the column of the loads that were set among "
        'those that number the repeats (repeat=("set load", "pass"); --repeat "set load" --repeat '
        "pass)."
    )
    return [Message("mixed_loads", text, "warning")]
