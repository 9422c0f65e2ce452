"""Import of tables: scans as they leave an experiment, profiles as they leave a FEM program."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from memscal.errors import InputError, UnitError
from memscal.formats.csv_table import Table, read_table
from memscal.formats.placement import place_readings
from memscal.formats.reference_profile import ImportedProfile
from memscal.formats.reference_table import read_reference_table
from memscal.formats.units import to_si
from memscal.model.checks import Message, import_notes, marked_texts
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod, RoundIndenter
from memscal.model.scan import Scan, StressSensor
from memscal.model.validation import FloatArray

__all__ = ["ImportedProfile", "ImportedScan", "read_reference_table", "read_scan_table"]

Column = str | int

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
    x_unit: str,
    u_unit: str,
    film: ElasticFilm,
    indenter: RoundIndenter,
    load: float | None = None,
    y: Column | None = None,
    repeat: Column | Sequence[Column] | None = None,
    u_xz: Column | None = None,
    u_yz: Column | None = None,
    load_column: Column | None = None,
    load_unit: str = "N",
    load_uncertainty: float | None = None,
    load_scatter: float | None = None,
    x_error: float | None = None,
    lubrication: str = "",
    lubricant: str = "",
    u_scale: float | None = None,
    u_sign: int = 1,
    grid_tolerance: float = 0.1,
    repeats: str = "keep",
    sensor: StressSensor | None = None,
    title: str = "",
    delimiter: str | None = None,
    decimal: str | None = None,
) -> ImportedScan:
    """Read a scan from a table with one row per reading.

    A line scan without repeats keeps its positions as they are.  Repeats of a line are
    brought to common places, and a raster (``y`` given) to an evenly spaced grid; places
    without a reading become NaN.

    Parameters
    ----------
    path : path
        A delimited text file.
    x, u : str or int
        Columns of position and voltage: a name, or a number counted from 1.
    x_unit, u_unit : str
        Their units; ``x_unit`` holds for ``y`` too.
    film, indenter
        What was pressed on what: a table does not say it.
    load : float, optional
        Nominal load in N; by default the median of ``load_column``.
    y : str or int, optional
        Column of the second position, for a raster.
    repeat : str or int, or several, optional
        Column that numbers the repeats; without it equal positions are counted in file order.
        Of several columns each combination is a line: of the load that was set and of the pass,
        where a table holds several of both.
    u_xz, u_yz, load_column : str or int, optional
        Columns of further channels (in ``u_unit``) and of the load at each point.
    load_unit : str
        Unit of ``load_column``.
    load_uncertainty : float, optional
        Standard uncertainty of the load common to all points, in N.
    load_scatter : float, optional
        Relative standard uncertainty of each point's own load, independent from point to point,
        as of a weight that is set down by hand.
    x_error : float, optional
        Standard uncertainty of each position, independent from point to point, in m.
    lubrication, lubricant : str
        ``"dry"`` or ``"lubricated"``, and with what; empty if not stated.
    u_scale : float, optional
        Volts per unit of the ``u`` columns, for a sensor whose output is not a voltage;
        ``u_unit`` is then only its name, and the notes of the scan record the choice.
    u_sign : {1, -1}
        -1 where the voltage falls under compression, as with swapped leads: ``u`` is turned, and
        the notes of the scan record it.  The other channels stay as they are.
    grid_tolerance : float
        Largest distance of a reading from its place, as a fraction of the grid's step.
    repeats : {"keep", "average"}
        What to do with repeats.  A raster can only average: the mean of each place, with a
        standard uncertainty from the spread pooled over all places.  Outlying readings are
        left out of the mean and named in the notes.
    sensor, title
        Carried into the scan.
    delimiter, decimal : str, optional
        Column separator and decimal mark; found from the file by default.

    Returns
    -------
    ImportedScan
        The scan, and what was done: also recorded in ``scan.notes``.

    Raises
    ------
    InputError
        If a column is missing, or the positions do not fit a grid within the tolerance.
    UnitError
        If ``u_unit`` is not a voltage and no ``u_scale`` is given.
    """
    if repeats not in ("keep", "average"):
        raise InputError(f'repeats is "{repeats}".', cure='Give "keep" or "average".')
    if not (np.isfinite(grid_tolerance) and 0 < grid_tolerance < 0.5):
        raise InputError(
            f"The grid tolerance is {grid_tolerance:g} of the step, but it must lie between 0 and "
            "0.5.",
            why="Beyond half a step a reading has no nearest place.",
        )
    if load_scatter is not None and repeats == "average":
        raise InputError(
            "load_scatter is given, but repeats are averaged.",
            why="The mean of several contacts has a smaller scatter than one of them.",
            cure='Keep the repeats (repeats="keep").',
        )
    if u_sign not in (1, -1):
        raise InputError(f"The sign of the voltage is {u_sign}.", cure="Give 1 or -1.")
    table = read_table(path, delimiter=delimiter, decimal=decimal)
    notes = [
        f"Imported from {table.source.file_name} (sha256 {table.source.sha256}).",
        *table.notes,
    ]
    columns = {"u_zz": u_sign * _voltage(table, u, u_unit, u_scale)}
    if u_sign < 0:
        notes.append("The sign of u_zz was changed.")
    for name, column in (("u_xz", u_xz), ("u_yz", u_yz)):
        if column is not None:
            columns[name] = _voltage(table, column, u_unit, u_scale)
    if u_scale is not None:
        notes.append(
            f"The readings are in {u_unit}, not in volts: {u_scale:g} V was taken for one "
            f"{u_unit}, and every voltage and conversion constant carries this choice."
        )
    if load_column is not None:
        where = table.where(load_column)
        columns["normal_load"] = to_si(table.column(load_column), load_unit, "force", where)
        if load is None:
            load = float(np.nanmedian(columns["normal_load"]))
            notes.append(f"The nominal load is the median of the column: {load:g} N.")
    if load is None:
        raise InputError(
            "The load of the scan is not given.", cure="Give the load in N, or its column."
        )
    placed = place_readings(
        columns,
        xs=to_si(table.column(x), x_unit, "length", table.where(x)),
        ys=None if y is None else to_si(table.column(y), x_unit, "length", table.where(y)),
        numbers=None if repeat is None else _lines(table, repeat, notes),
        tolerance=grid_tolerance,
        averaged=repeats == "average",
        notes=notes,
    )
    fields = dict(placed.fields)
    loads = fields.pop("normal_load", None)
    if load_scatter is not None and loads is None:
        loads = np.full(fields["u_zz"].shape, load)
    messages = import_notes(notes)
    if loads is not None and placed.y is None:
        messages += _mixed_loads(loads, indenter)
    scan = Scan(
        x=placed.x,
        y=placed.y,
        x_errors=None if x_error is None else np.full(placed.x.size, x_error),
        u_zz=fields.pop("u_zz"),
        u_zz_errors=placed.errors,
        normal_load=loads,
        normal_load_errors=None if load_scatter is None or loads is None else load_scatter * loads,
        channels=fields,
        load=load,
        load_uncertainty=load_uncertainty,
        lubrication=lubrication,
        lubricant=lubricant,
        film=film,
        indenter=indenter,
        sensor=sensor or StressSensor(),
        title=title,
        notes="\n".join(marked_texts(messages)),
        source=table.source,
    )
    return ImportedScan(scan, tuple(messages))


def _lines(table: Table, repeat: Column | Sequence[Column], notes: list[str]) -> FloatArray:
    """Number the line of each row: by one column, or by the combinations of several."""
    columns = [repeat] if isinstance(repeat, str | int) else list(repeat)
    values = np.stack([table.column(column) for column in columns])
    if len(columns) == 1:
        return np.asarray(values[0])
    known = np.isfinite(values).all(axis=0)
    found, number = np.unique(values[:, known], axis=1, return_inverse=True)
    lines = np.full(known.size, np.nan)
    lines[known] = 1 + number.reshape(-1)  # NumPy 2.0 kept an axis here
    named = " and ".join(repr(column) for column in columns)
    notes.append(f"{found.shape[1]} lines: one for each combination of the columns {named}.")
    return lines


def _mixed_loads(loads: FloatArray, indenter: RoundIndenter) -> list[Message]:
    """Warn of lines at several loads: only a rod's voltage is proportional to its load."""
    lines = np.atleast_2d(loads)
    known = lines[np.isfinite(lines).any(axis=1)]
    low, high = np.nanmin(known, axis=1), np.nanmax(known, axis=1)
    mixed = high - low > _MIXED * np.nanmedian(known, axis=1)
    if isinstance(indenter, Rod) or not mixed.any():
        return []
    i = int(np.argmax(mixed))
    text = (
        f"The loads of a line go from {low[i]:.4g} to {high[i]:.4g} N, but each load has "
        "a profile of its own. Name the column of the loads that were set among those that number "
        'the repeats (repeat=("set load", "pass"); --repeat "set load" --repeat pass).'
    )
    return [Message("mixed_loads", text, "warning")]


def _voltage(table: Table, column: Column, unit: str, scale: float | None) -> FloatArray:
    values = table.column(column)
    if scale is not None:
        if not (np.isfinite(scale) and scale != 0):
            raise InputError(f"The scale of the readings is {scale:g} V per {unit}.")
        return values * scale
    try:
        return to_si(values, unit, "voltage", table.where(column))
    except UnitError as error:
        raise UnitError(
            error.problem,
            why="Conversion constants are in volts per pascal.",
            cure="Give a unit of voltage; for another kind of sensor give the volts that one unit "
            "stands for (u_scale; --u-scale).",
        ) from error
