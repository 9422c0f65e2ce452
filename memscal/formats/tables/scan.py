"""Scans from tables with one row per reading."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from memscal.errors import InputError, counted, require_names
from memscal.extensions import hook
from memscal.formats.tables.columns import Column, NamedColumns, Wanted
from memscal.formats.tables.positions import direction_of, make_positions, require_positions
from memscal.formats.tables.reference import require_sign
from memscal.formats.tables.sheets import open_table
from memscal.formats.tables.stated import ScanConditions, ScanUncertainties, TableLayout
from memscal.formats.units import reading_of, to_si
from memscal.model.arrays import Columns, Values, frozen_array, keyword_array_record, unmasked
from memscal.model.checks import Message, at_ceiling_text, import_notes, marked_texts
from memscal.model.holds import Holds
from memscal.model.indenter import Rod, RoundIndenter
from memscal.model.notation import Reading, format_measured
from memscal.model.quantities import dimension_in
from memscal.model.records import DYNAMICS, FILM, LOAD, ROUND_INDENTER, TAKEN_FOR_GRANTED
from memscal.model.scan import BRANCHES, DIRECTIONS, ArrayOptions, Scan, branch_numbers
from memscal.progress import Listener, reported
from memscal.readings.ceiling import without_clipped
from memscal.readings.dead_rows import without_dead_rows
from memscal.readings.find_holds import find_holds
from memscal.readings.find_places import clusters, places_of
from memscal.readings.mistaken_unit import (
    require_depth,
    require_plausible,
    require_recorded,
    require_span,
    warn_of_readings,
)

_RECORDS = {"layout": TableLayout, "conditions": ScanConditions, "uncertainties": ScanUncertainties}
#: What of a layout is for who opens the table.
_READING = ("sheet", "scan", "skip_rows", "missing", "delimiter", "decimal")
#: Options that name columns, besides x and u.
ARRAYS = (
    "y",
    "repeat",
    "branch",
    "u_errors",
    "load_column",
    "depth",
    "u_xz",
    "u_yz",
    "time",
    "sliding",
    "tangential_load",
)
#: Words of a column that tells when the indenter presses.
_PRESSING = {"false": 0.0, "true": 1.0}
#: Positions closer than this share of the typical spacing are probably one place, and a table with
#: so large a share of them was probably repeated.
_CLOSE = 0.1
_MANY = 0.25
#: Loads of one line that differ by more than this share were hardly meant to be one.
_MIXED = 0.3
#: Loads farther apart than this share are not one load that scatters; fewer readings are no line.
_APART = 0.1
_FEWEST = 5
_MOST_GROUPS = 12


@keyword_array_record
class ImportedScan(Scan):
    """A scan that was read from a table, and what was done on the way.

    >>> rows = {"x [mm]": [-1.0, 0.0, 1.0], "U [mV]": [1.0, 3.0, 1.0]}
    >>> isinstance(import_table(rows, x="x [mm]", u="U [mV]"), ImportedScan)
    True
    """

    messages: tuple[Message, ...] = ()
    holds: Holds | None = None


@reported
def import_table(
    source: Any,
    *,
    u: Column | Sequence[Column] | None = None,
    x: Column | None = None,
    y: Column | None = None,
    u_errors: Column | None = None,
    u_xz: Column | None = None,
    u_yz: Column | None = None,
    load_column: Column | None = None,
    depth: Column | None = None,
    repeat: Column | Sequence[Column] | None = None,
    branch: Column | None = None,
    time: Column | None = None,
    sliding: Column | None = None,
    tangential_load: Column | None = None,
    layout: TableLayout | None = None,
    conditions: ScanConditions | None = None,
    uncertainties: ScanUncertainties | None = None,
    progress: Listener = None,  # noqa: ARG001 - @reported
) -> ImportedScan:
    """Read a scan from a table with one row for each reading.

    The header is found below what precedes it.  Units stand in the heads (``x/mm``, ``x [mm]``,
    ``U (µV)``) or in a row below the header; a layout that contradicts them is refused.  Film and
    indenter, where both are stated, are held against the positions.

    Parameters
    ----------
    source : path, data frame or mapping of str to array
        Text (CSV; UTF-8, UTF-16 or Latin-1), .xlsx, Parquet, HDF5, TDMS, or columns in memory.
    x, y, u : str or int
        Columns of the positions and of the normal channel's readings, by name, or by number from 1
        where no column has a number as its name (a frame's column 1 is the one named 1).  Of
        positions along one axis, ``y`` alone or with an ``x`` that stays, a line is made.  An
        HDF5 file that plots a signal against its axis (NXdata) needs neither.  Several ``u``, or
        one in which ``*`` stands for any text, are the sensors of an array, in their order, named
        as the heads without units; holds are then found in the sum of all of them.
    u_errors : str or int, optional
        Column of the standard uncertainty of each reading.
    u_xz, u_yz, load_column, branch : str or int, optional
        Columns of the tangential channels, of the load at each point, and of the branch (approach,
        retreat).
    depth : str or int, optional
        Of a log with holds: column that grows as the indenter is lowered, or is 1 where it presses
        and 0 elsewhere.  It tells the presses, and is not kept.
    time : str or int, optional
        Column of the times, which the scan keeps in s from the first; with a speed
        (``TableLayout``) they make the positions.
    sliding : "forth", "back", str or int, optional
        Of an indenter that slid: its one direction, along the positions or against them, or the
        column that states it, as 1 and -1 or in these words.  Where it turns a pass begins, unless
        ``repeat`` numbers them; with a speed and times positions go back with it.
    tangential_load : str or int, optional
        Column of the load along the positions at each point.
    repeat : str or int, or several
        Columns that number the passes; each combination of several is one.
    layout : TableLayout, optional
        How the table is read: units, sign, holds, missing values, sheet, separators.
    conditions : ScanConditions, optional
        What was pressed on what, under which load, and measured by what.
    uncertainties : ScanUncertainties, optional
        Standard uncertainties of readings, loads and positions.
    progress : callable or True, optional
        Told how many rows are read: :class:`memscal.Progress`.

    Returns
    -------
    ImportedScan
        The scan, with ``messages`` (also in ``notes``) and ``holds``, which has a ``plot()``.

    Raises
    ------
    InputError
        If cells are no numbers (the first five lines are named), units are missing or contradict,
        an option has no effect, or no such film is scanned by such steps.

    Examples
    --------
    >>> import memscal
    >>> table = {"x": [-8e3, -4e3, 0, 4e3, 8e3], "U (mV)": [0.1, 0.4, 2.0, 0.4, 0.1]}
    >>> film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> rod = memscal.Rod(radius=0.25e-3)
    >>> scan = memscal.import_table(
    ...     table,
    ...     x="x",
    ...     u="U",
    ...     layout=memscal.TableLayout(x_unit="um"),
    ...     conditions=memscal.ScanConditions(film=film, indenter=rod, load=1.0),
    ...     uncertainties=memscal.ScanUncertainties(noise=0.01, load_uncertainty=0.005),
    ... )
    >>> scan
    <ImportedScan: line, 5 points, x from -8 to 8 mm, load 1 N>
    """
    layout = layout or TableLayout()
    conditions = conditions or ScanConditions()
    uncertainties = uncertainties or ScanUncertainties()
    readings = _listed(u)
    named = {
        "u_zz": next(iter(readings), None),
        "u_xz": u_xz,
        "u_yz": u_yz,
        "u_zz_errors": u_errors,
        "normal_load": load_column,
        "tangential_load": tangential_load,
        "sliding_direction": None if str(sliding) in DIRECTIONS else sliding,
        "depth": depth,
        "x": x,
        "y": y,
        "branch": branch,
        "time": time,
    }
    numbering = _listed(repeat)
    named |= {f"repeat {i}": column for i, column in enumerate(numbering)}
    asked = named | {f"reading {i}": column for i, column in enumerate(readings)}
    table = open_table(source, asked, **{name: getattr(layout, name) for name in _READING})
    named |= table.defaults
    if len(readings) > 1 or "*" in str(u):
        named |= hook("columns_of_array")(table, readings, named)
    array = any(" of " in name for name in named)
    _require_use(named, layout, conditions, uncertainties, slid=sliding is not None)
    wanted, reading = _wanted(table, named, layout)
    columns, notes = _read_columns(table, wanted, layout.u_sign, uncertainties.noise, str(sliding))
    if array:
        notes += hook("add_up")(columns, layout)
    presses = make_positions(columns, layout, notes, table.lines)
    if numbering:
        columns["repeat"] = _lines(columns, numbering, notes)
    holds = None
    if layout.holds:
        deep = columns.pop("depth", None)
        anew = bool(layout.baseline)
        holds = find_holds(columns, table.all_lines(), reading, depth=deep, baseline=anew)
        if presses is not None:
            hook("require_all_held")(holds, presses)
        notes += holds.notes
        columns = dict(holds.mean)
        errors = hook("errors_of_sensors")(columns) if array else holds.u_errors
        if errors.all():  # readings of few digits may not scatter
            columns["u_zz_errors"] = errors
    of = wanted["u_zz"]
    ceiling = None if array else layout.ceiling
    clipped = _leave_out_clipped(columns, holds, ceiling, of, reading, notes)
    columns = _placed(columns, notes, (lambda _: "of holds") if holds else table.lines)
    columns = without_dead_rows(columns, notes)
    bare = replace(conditions, layout=None) if array else conditions
    scan = _scan_of(columns, notes, reading, bare, uncertainties, table, holds)
    scan = one = replace(scan, at_ceiling=clipped, speed=layout.speed and abs(layout.speed))
    if array:
        scan, one = hook("array_scan")(scan, conditions.layout, layout.ceiling, of)
    del columns  # the scan has copies, and ten million rows are many
    warn_of_readings(scan)
    _require_sizes(one)
    return scan


def stated_in_words(scan: Scan) -> list[str]:
    """Return what a scan states of its set-up, and of what else would be taken for granted."""
    return [*_set_up_in_words(vars(scan)), *_granted_in_words(vars(scan))]


def with_notes(scan: ImportedScan, texts: Sequence[str]) -> ImportedScan:
    """Return a scan with further notes on how it was made."""
    messages = (*scan.messages, *import_notes(texts))
    return replace(scan, messages=messages, notes="\n".join([scan.notes, *texts]))


def _require_sizes(scan: Scan) -> None:
    """Refuse lengths that no set-up has."""
    if scan.film is not None:
        require_film = require_plausible if isinstance(scan.indenter, Rod) else require_span
        require_film(scan)
    require_depth(scan)


def _listed(column: Column | Sequence[Column] | None) -> list[Column]:
    return [column] if isinstance(column, Column) else list(column or ())


def scan_of_arrays(x: ArrayLike, u: ArrayLike, **options: Any) -> ImportedScan:
    """Return a scan of arrays like ``u``, of which some options are; a row of ``u`` is a pass."""
    require_names("Scan.from_arrays() has no argument", options, ArrayOptions.__annotations__)
    readings = frozen_array(u)
    given = {name: options.pop(name) for name in ARRAYS if options.get(name) is not None}
    if readings.ndim == 2 and not given.keys() & {"y", "repeat"}:
        given["repeat"] = np.arange(len(readings))[:, None]
    columns = {"u": readings, "x": x, **given}
    try:
        table = {
            n: np.broadcast_to(unmasked(v), readings.shape).ravel() for n, v in columns.items()
        }
    except ValueError as error:
        problem = f"An array does not have the shape of u, {readings.shape}: {error}."
        raise InputError(problem, cure="Give one value for each reading.") from error
    options = {"x_unit": "m", "u_unit": "V", **options}
    if "time" in given:
        options.setdefault("time_unit", "s")
    records = records_of(options)
    named: Values = {name: name for name in table}
    return import_table(table, **named, **records, **options)


def records_of(stated: Values) -> Values:
    """Take the fields of layout, conditions and uncertainties from what is stated; return these."""
    records = {}
    for name, record in _RECORDS.items():
        own = stated.keys() & {item.name for item in fields(record)}
        records[name] = record(**{field: stated.pop(field) for field in own})
    return records


def _require_use(
    named: Values,
    layout: TableLayout,
    conditions: ScanConditions,
    uncertainties: ScanUncertainties,
    *,
    slid: bool,
) -> None:
    """Refuse what has no use: a unit or an uncertainty of nothing, or two of the same."""
    dragged = named["tangential_load"] is not None or conditions.sliding_friction is not None
    held = layout.holds or conditions.dwell_time is not None or conditions.motion == "rest"
    no_load = conditions.load is None and named["normal_load"] is None
    given = (uncertainties.noise is not None, named["u_zz_errors"] is not None, layout.holds)
    for useless, problem, cure in (
        (
            layout.load_unit and named["normal_load"] is None,
            "load_unit (--load-unit) belongs to a column of loads.",
            "Give the load (--load) in N: 80 g weigh 0.785 N.",
        ),
        (
            no_load and uncertainties.load_uncertainty is not None,
            "load_uncertainty (--load-uncertainty) belongs to a load.",
            "Give the load, too.",
        ),
        (
            no_load and uncertainties.load_scatter is not None,
            "The scatter of the loads is given, but no load.",
            "Give the load in N, or its column.",
        ),
        (
            sum(given) > 1,
            "Readings have one uncertainty: noise (--noise), u_errors (--u-errors), or of holds.",
            "Give one of them.",
        ),
        (
            not layout.holds and (named["depth"] is not None or layout.baseline),
            "depth (--depth) and baseline (--baseline) belong to a log with holds.",
            "State holds (--holds), too.",
        ),
        (
            dragged and not slid,
            "A tangential load or a sliding friction belongs to an indenter that slides.",
            "State its direction (--sliding), too.",
        ),
        (
            held and slid,
            "An indenter that slides (--sliding) is not held (--holds, --dwell, --noise-record).",
            "Give one of both.",
        ),
        (
            layout.depth_unit and named["depth"] is None,
            "depth_unit (--depth-unit) belongs to a column of depths.",
            "Name the column (--depth COLUMN).",
        ),
        (
            layout.time_unit and named["time"] is None,
            "time_unit (--time-unit) belongs to a column of times.",
            "Name the column (--time COLUMN).",
        ),
    ):
        if useless:
            raise InputError(problem, cure=cure)
    require_sign("sign of the voltage", layout.u_sign)
    require_positions(named, layout, resting=conditions.motion == "rest")


def _wanted(
    table: NamedColumns, named: Mapping[str, Column | None], layout: TableLayout
) -> tuple[dict[str, Wanted], Reading]:
    """Return the columns that are named, with their units, and the unit of the readings."""
    u = named["u_zz"]
    if u is None:
        raise InputError("No column of the readings is named.", cure="Give u (--u COLUMN).")
    u_unit = table.unit_of(u, layout.u_unit, "u_unit (--u-unit)")
    reading = reading_of(u_unit, table.where(u))
    of_u = dimension_in("voltage", reading)
    channel = (of_u, layout.u_unit, "u_unit (--u-unit)", u_unit)
    force = ("force", layout.load_unit, "load_unit (--load-unit)", "N")
    # With a step places are counted.
    of_x, unit_of_x = ("length", None) if layout.step is None else ("dimensionless", "1")
    length = (of_x, layout.x_unit, "x_unit (--x-unit)", unit_of_x)
    # Dimension, unit as it is stated, the option that states it, and the default.
    forms = {
        "u_zz": channel,
        "u_xz": channel,
        "u_yz": channel,
        "u_zz_errors": (of_u, None, "", u_unit),
        "normal_load": force,
        "tangential_load": force,
        "depth": ("", layout.depth_unit, "depth_unit (--depth-unit)", "1"),
        "x": length,
        "y": length,
        "time": ("time", layout.time_unit, "time_unit (--time-unit)", None),
    }
    wanted = {}
    for name, column in named.items():
        if column is None:
            continue
        words = DIRECTIONS if name == "sliding_direction" else BRANCHES
        wanted[name] = Wanted(column, words=words)
        form = name.partition(" of ")[0]  # of a sensor of an array
        if form in forms:
            dimension, unit, option, default = forms[form]
            unit = table.unit_of(column, unit, option, default)
            dimension = dimension or dimension_in("voltage", reading_of(unit, table.where(column)))
            wanted[name] = Wanted(column, unit, dimension, _PRESSING if name == "depth" else {})
    return wanted, reading


def _read_columns(
    table: NamedColumns,
    wanted: Mapping[str, Wanted],
    u_sign: int,
    noise: float | None,
    sliding: str,
) -> tuple[Columns, list[str]]:
    """Read columns, with sign, noise and direction that are stated; return them with notes."""
    columns: Columns = table.columns(wanted)
    units = ", ".join(f"{name} in {item.unit}" for name, item in wanted.items() if item.unit)
    notes = [*table.notes, f"Units: {units}."]
    u = wanted["u_zz"]
    if u_sign < 0:
        columns["u_zz"] *= -1
        notes.append("The sign of u_zz was changed.")
    if noise is not None:
        in_si = to_si(noise, u.unit, u.dimension, "noise")
        columns["u_zz_errors"] = np.full(columns["u_zz"].shape, in_si)
    if sliding in DIRECTIONS:
        columns["sliding_direction"] = np.full(columns["u_zz"].shape, DIRECTIONS[sliding])
    elif "sliding_direction" in columns:
        ways = columns["sliding_direction"]
        ways[ways == 0] = np.nan  # at rest
        strange = np.unique(ways[abs(ways) != 1])[:1]
        if np.isfinite(strange).any():
            raise InputError(
                f"{table.where(wanted['sliding_direction'].column)} has the direction "
                f"{strange[0]:g}.",
                cure="Write forth or 1 to larger positions, back or -1 to smaller, and 0 at rest.",
            )
    if "branch" in columns:
        where = table.where(wanted["branch"].column)
        columns["branch"] = branch_numbers(where, np.nan_to_num(columns["branch"]))
    if "time" in columns:
        columns["time"] -= np.fmin.reduce(columns["time"], initial=np.inf)
    return columns, notes


def _leave_out_clipped(
    columns: Columns,
    holds: Holds | None,
    stated: float | None,
    of: Wanted,
    reading: Reading,
    notes: list[str],
) -> int:
    """Mark readings at a ceiling, and holds with a row there, as missing; return how many."""
    ceiling = holds.ceiling if holds else None
    if stated is not None:
        ceiling = float(to_si(stated, of.unit, of.dimension, "ceiling (--ceiling)"))
    elif ceiling is not None:
        text = reading.text(ceiling, ".6g")
        notes.append(f"Rows pile up at {text}, a ceiling (a higher --ceiling keeps them).")
    if ceiling is None:
        return 0
    highest = holds.highest if holds else None
    columns["u_zz"], number = without_clipped(columns["u_zz"], ceiling, highest)
    notes.append(at_ceiling_text(number))
    return number


def _scan_of(
    columns: Columns,
    notes: list[str],
    reading: Reading,
    conditions: ScanConditions,
    uncertainties: ScanUncertainties,
    table: NamedColumns,
    holds: Holds | None,
) -> ImportedScan:
    """Return the scan of columns without gaps in their positions, and add to the notes."""
    stated = {**vars(conditions), **vars(uncertainties)}
    del stated["noise"]  # that of each reading is a column
    load_scatter = stated.pop("load_scatter")
    x_error = stated.pop("x_error")
    if "sliding_direction" in columns:
        stated["motion"] = "sliding"
        # Where the indenter turns a pass begins, if no column numbers them.
        turns = np.diff(columns["sliding_direction"]) != 0
        if turns.any() and "repeat" not in columns:
            if np.fmin.reduce(np.diff(columns.get("time", [])), initial=0.0) < 0:
                raise InputError(
                    "The rows are not in the order of time, and the indenter turns between them.",
                    cure="Sort the table by time, or name what numbers the passes (--repeat).",
                )
            columns["repeat"] = np.append(0, np.cumsum(turns))
    loads_in_words = _numbered_by_load(columns, notes)
    stated["load"] = _nominal_load(columns.get("normal_load"), conditions.load, notes)
    if load_scatter is not None:
        columns.setdefault("normal_load", np.full(columns["u_zz"].shape, stated["load"]))
        columns["normal_load_errors"] = load_scatter * columns["normal_load"]
    along = direction_of(columns, notes)
    stated["direction"] = conditions.direction or along
    if conditions.motion != "rest":
        notes += _counted(columns, table.others)
        notes += _set_up_in_words({**stated, "load": loads_in_words or stated["load"]})
    noise = "not stated"
    if "u_zz_errors" in columns:
        noise = f"{reading.text(np.nanmedian(columns['u_zz_errors']))} (median)"
    notes.append(f"Standard uncertainty of each reading: {noise}.")
    notes += _granted_in_words(stated)
    messages = import_notes(notes)
    if "y" not in columns and "normal_load" in columns:
        messages += _mixed_loads(columns["normal_load"], columns.get("repeat"), conditions.indenter)
    columns = _as_rows(columns)
    further = [name for name in columns if " of " in name or name.startswith(("u_xz", "u_yz"))]
    channels = {name: columns.pop(name) for name in further}
    if x_error is not None:
        columns["x_errors"] = np.full(columns["x"].size, x_error)
    return ImportedScan(
        **(stated | columns),
        unit=reading.si,
        source=table.source,
        channels=channels,
        notes="\n".join(marked_texts(messages)),
        messages=tuple(messages),
        holds=holds,
    )


def _numbered_by_load(columns: Columns, notes: list[str]) -> str:
    """Number the readings of a line at several loads by these, if nothing else does; name them."""
    loads = columns.get("normal_load")
    if loads is None or "y" in columns or not np.all(loads > 0):
        return ""
    groups, _ = clusters(np.log(loads), _APART)
    counts = np.bincount(groups)
    if not 1 < counts.size <= _MOST_GROUPS or counts.min() < _FEWEST:
        return ""
    levels = [f"{np.median(loads[groups == i]):.4g}" for i in range(counts.size)]
    words = f"of {', '.join(levels[:-1])} and {levels[-1]} N"
    if "repeat" not in columns:
        columns["repeat"] = groups
        notes.append(f"{len(levels)} lines: one for each of the loads {words}.")
    return words


def _nominal_load(
    loads: NDArray[Any] | None, stated: float | None, notes: list[str]
) -> float | None:
    """Take the median of a column as the nominal load; refuse one that contradicts the column."""
    if loads is None:
        return stated
    if stated is None:
        stated = float(np.nanmedian(loads))
        notes.append(f"The nominal load is the median of the column: {stated:.4g} N.")
    require_recorded(stated, loads)
    return stated


def _set_up_in_words(stated: Values) -> Iterator[str]:
    """Yield what was pressed on what, with each uncertainty, as it was taken."""
    film = stated["film"]
    indenter = stated["indenter"]
    shape = "indenter" if indenter is None else indenter.shape
    for name, owner, record in (
        (shape, indenter, ROUND_INDENTER),
        ("pressed with", SimpleNamespace(**stated), LOAD),
        ("film", film, FILM),
        ("sensor", stated["sensor"].dynamics, DYNAMICS),
    ):
        words = []
        for quantity in record.quantities:
            value = getattr(owner, quantity.name, None)
            if quantity.name.endswith("_uncertainty") or value in (None, ""):
                continue
            if isinstance(value, int | float) and np.isfinite(value):
                u = getattr(owner, f"{quantity.name}_uncertainty", None)
                scale = quantity.scale
                value = format_measured(value / scale, u and u / scale, quantity.unit)
            words.append(f"{quantity.words} {value}")
        if words or record is not DYNAMICS:
            yield f"{name.capitalize()}: {', '.join(words) or 'not stated'}."


def _granted_in_words(stated: Values) -> Iterator[str]:
    """Yield which uncertainties are stated of what a scan else takes for granted."""
    words = []
    for quantity in TAKEN_FOR_GRANTED.quantities:
        name = quantity.name.removesuffix("_uncertainty")
        value = stated.get(quantity.name)
        if name != quantity.name and value is not None:
            size = f"{value / quantity.scale:.4g} {quantity.unit}".rstrip()
            words.append(f"{name.replace('_', ' ')} {size}")
    if words:
        yield f"Standard uncertainties: {', '.join(words)}."


def _lines(columns: Columns, numbering: Sequence[Column], notes: list[str]) -> NDArray[Any]:
    """Number the line of each row: by one column, or by the combinations of several."""
    values = [columns.pop(f"repeat {i}") for i in range(len(numbering))]
    if len(values) == 1:
        return values[0]
    finite = np.logical_and.reduce([np.isfinite(column) for column in values])
    number = np.zeros(finite.sum(), dtype=np.intp)
    for column in values:
        distinct, index = np.unique(column[finite], return_inverse=True)
        number = np.unique(number * distinct.size + index, return_inverse=True)[1]
    lines = np.full(finite.size, np.nan)
    lines[finite] = 1 + number
    names = " and ".join(repr(column) for column in numbering)
    combinations = number.max(initial=-1) + 1
    notes.append(f"{combinations} lines: one for each combination of the columns {names}.")
    return lines


def _placed(columns: Columns, notes: list[str], name_rows: Callable[[Any], str]) -> Columns:
    """Leave out rows without a position or the number of a repeat; count the repeats from 0."""
    stated = [
        columns[name] for name in ("x", "y", "repeat", "sliding_direction") if name in columns
    ]
    finite = np.logical_and.reduce([np.isfinite(values) for values in stated])
    if not finite.any():
        raise InputError("No row of the table has a position.", cure="Check the columns.")
    if np.isnan(columns["u_zz"]).all():
        raise InputError("No row of the table has a reading.", cure="Check the columns.")
    for name, values in columns.items():
        rows = np.flatnonzero(finite & np.isnan(values))
        if rows.size:
            notes.append(f"{name} is missing (NaN) in {name_rows(rows)}.")
    if not finite.all():
        rows = np.flatnonzero(~finite)
        lacking = "position or direction" if "sliding_direction" in columns else "position"
        notes.append(f"Left out, for they have no {lacking}: {name_rows(rows)}.")
        columns = {name: values[finite] for name, values in columns.items()}
    if "repeat" in columns:
        columns["repeat"] = np.unique(columns["repeat"], return_inverse=True)[1]
    return columns


def _counted(columns: Columns, others: str) -> list[str]:
    x = columns["x"]
    y = columns.get("y", np.zeros(x.size))
    repeat = columns.get("repeat", np.zeros(x.size, dtype=np.intp))
    places = places_of(x, y, repeat)
    number = repeat.max() + 1
    in_repeats = f" in {number} repeats" if number > 1 else ""
    step = " x ".join(f"{step * 1e3:.4g}" for step in places.steps if step)
    apart = f", typically {step} mm apart" if step else ""
    reach = ", ".join(
        f"{name} from {values.min() * 1e3:.4g} to {values.max() * 1e3:.4g} mm"
        for name, values in (("x", x), ("y", y))
        if name in columns
    )
    at = f"{in_repeats} at {counted(places.count, 'places')}{apart}"
    notes = [f"{counted(x.size, 'readings')}{at}; {reach}."]
    if "branch" in columns:
        counts = [(columns["branch"] == number).sum() for number in (1, 2, 0)]
        words = "{} readings on approach, {} on retreat, {} of neither branch."
        notes.append(words.format(*counts))
    full = number * places.count - x.size
    if number > 1 and full > 0:
        notes.append(f"{full} more would make every repeat complete.")
    notes += _repeated(columns, repeat, places.index, others)
    return notes


def _repeated(
    columns: Columns, line: NDArray[Any], place: NDArray[Any], others: str
) -> Iterator[str]:
    """Yield a note on positions that were read several times in one line, if there are many."""
    x = columns["x"]
    if "repeat" in columns:
        line = line * 3 + columns.get("branch", 0)
    group = place * (line.max() + 1) + line
    close = 0
    if "y" not in columns:
        order = np.lexsort((x, line))
        begins = np.diff(line[order]) > 0
        gaps = np.diff(x[order])
        within = np.sort(gaps[~begins])
        length = np.cumsum(within)
        # The gap in which half of the length lies: repeated positions do not change it.
        typical = within[np.searchsorted(length, 0.5 * length[-1])] if within.any() else 0.0
        close = int(np.count_nonzero(within < _CLOSE * typical))
        group = np.cumsum(np.append(False, begins | (gaps >= _CLOSE * typical)))
    several = np.median(np.unique(group, return_counts=True)[1])
    if "repeat" in columns and several > 1:
        yield (
            f"{several:.0f} readings at each place of each repeat. Other columns that differ: "
            f"{others or 'none'}. If one of them numbers lines, name it (--repeat; --branch)."
        )
    elif "repeat" not in columns and close > _MANY * x.size:
        yield (
            f"{close} of {x.size} positions lie closer to another than {_CLOSE:.0%} of the "
            "typical spacing. If they are repeats, name the column that numbers them "
            '(repeat="..."; --repeat COLUMN): then each is predicted from the others.'
        )


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
    line_by_line = np.split(loads[order], np.flatnonzero(np.diff(line[order])) + 1)
    stated = [values[np.isfinite(values)] for values in line_by_line]
    mixed = [
        values for values in stated if values.size and np.ptp(values) > _MIXED * np.median(values)
    ]
    if not mixed:
        return []
    text = (
        f"The loads of a line go from {mixed[0].min():.4g} to {mixed[0].max():.4g} N, "
        "but each load has a profile of its own. Name the column of the loads that were set among "
        'those that number the repeats (repeat=("set load", "pass"); --repeat "set load" --repeat '
        "pass)."
    )
    return [Message("mixed_loads", text, "warning")]
