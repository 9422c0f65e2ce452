"""Scans from tables with one row per reading."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, fields
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from memscal.errors import InputError
from memscal.formats.tables.reference import require_sign
from memscal.formats.tables.sheets import open_table
from memscal.formats.tables.text_table import Wanted
from memscal.formats.units import reading_of, to_si
from memscal.model.checks import Message, import_notes, marked_texts
from memscal.model.indenter import Rod, RoundIndenter
from memscal.model.notation import Reading, format_measured
from memscal.model.quantities import dimension_in
from memscal.model.records import FILM, LOAD, ROUND_INDENTER
from memscal.model.scan import BRANCHES, LINE, Scan, branch_numbers, load_groups
from memscal.progress import Listener, reported
from memscal.readings.find_holds import find_holds
from memscal.readings.find_places import places_of
from memscal.readings.mistaken_unit import require_plausible, require_recorded, require_span

Column = str | int
Columns = dict[str, NDArray[Any]]

#: Options that name columns, besides x and u.
_ARRAYS = ("y", "repeat", "branch", "u_errors", "load_column", "u_xz", "u_yz")
#: Positions closer than this share of the typical spacing are probably one place, and a table with
#: so large a share of them was probably repeated.
_CLOSE = 0.1
_MANY = 0.25
#: Loads of one line that differ by more than this share were hardly meant to be one.
_MIXED = 0.3


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class ImportedScan(Scan):
    """A scan that was read from a table, and what was done on the way.

    >>> rows = {"x [mm]": [-1.0, 0.0, 1.0], "U [mV]": [1.0, 3.0, 1.0]}
    >>> isinstance(import_table(rows, x="x [mm]", u="U [mV]"), ImportedScan)
    True
    """

    messages: tuple[Message, ...] = ()
    holds: Any = None  # memscal.model.holds.Holds, where they were asked for


@reported
def import_table(
    source: Any,
    *,
    u: Column,
    x: Column | None = None,
    y: Column | None = None,
    x_unit: str | None = None,
    u_unit: str | None = None,
    u_errors: Column | None = None,
    noise: float | None = None,
    load: float | None = None,
    load_column: Column | None = None,
    load_unit: str | None = None,
    load_scatter: float | None = None,
    x_error: float | None = None,
    repeat: Column | Sequence[Column] | None = None,
    branch: Column | None = None,
    u_xz: Column | None = None,
    u_yz: Column | None = None,
    u_sign: int = 1,
    holds: bool = False,
    sheet: str | None = None,
    skip_rows: int = 0,
    missing: Sequence[str] = (),
    delimiter: str | None = None,
    decimal: str | None = None,
    progress: Listener = None,  # noqa: ARG001 - @reported
    **stated: Any,
) -> ImportedScan:
    """Read a scan from a table with one row for each reading.

    The header is found below what precedes it.  Units stand in the heads (``x/mm``, ``x [mm]``,
    ``U (µV)``) or in a row below the header; an option that contradicts them is refused.  Film and
    indenter, where both are stated, are held against the positions.

    Parameters
    ----------
    source : path, data frame or mapping of str to array
        Text (CSV; UTF-8, UTF-16 or Latin-1), .xlsx, Parquet, or columns in memory.
    x, y, u : str or int
        Columns of the positions and of the normal channel's readings, by name, or by number from
        1.  Of positions along one axis, ``y`` alone or with an ``x`` that stays, a line is made.
    x_unit, u_unit : str, optional
        Units of ``x`` and ``y``, and of all channels, where the table states none.
    u_errors, noise : str or int, float
        Column of the standard uncertainty of each reading, or one number in the unit of ``u``.
    load, load_column, load_unit : float, str or int, str
        Nominal load in N, by default the median of its column; the column's unit, by default N.
    load_scatter, x_error : float, optional
        Standard uncertainties of the loads, relative, and of the positions, in m, both
        independent from point to point.
    repeat : str or int, or several
        Columns that number the passes; each combination of several is one.
    branch, u_xz, u_yz : str or int, optional
        Columns of the branch (approach, retreat), and of the tangential channels.
    u_sign : int
        -1 where the voltage falls when the indenter presses.
    holds : bool
        The table is a log in the order of time: holds are found, and each is averaged.
    sheet, skip_rows, missing, delimiter, decimal
        Sheet of a workbook; lines before the header; words, or numbers as text, that mean a
        missing value; what separates cells; decimal mark.
    progress : callable or True, optional
        Told how many rows are read: :class:`memscal.Progress`.
    **stated
        Further fields of :class:`memscal.Scan`: ``film``, ``indenter``, ``sensor``, ``title`` ...

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
    >>> table = {"x [um]": [-8e3, -4e3, 0, 4e3, 8e3], "U (mV)": [0.1, 0.4, 2.0, 0.4, 0.1]}
    >>> film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> scan = memscal.import_table(
    ...     table, x="x", u="U", load=1.0, film=film, indenter=memscal.Rod(radius=0.25e-3)
    ... )
    >>> scan
    <ImportedScan: line, 5 points, x from -8 to 8 mm, load 1 N>
    """
    if unknown := stated.keys() - {item.name for item in fields(Scan)}:
        problem = f"import_table has no argument {', '.join(map(repr, sorted(unknown)))}."
        cure = "Give fields of memscal.Scan, such as indenter=memscal.Rod(radius=0.25e-3)."
        raise InputError(problem, cure=cure)
    require_sign("sign of the voltage", u_sign)
    no_load = load is None and load_column is None
    of_u = (u_unit, "u_unit (--u-unit)")
    noisy = u_errors is not None or noise is not None
    for useless, problem, cure in (
        (
            load_unit and load_column is None,
            "load_unit (--load-unit) belongs to a column of loads.",
            "Give the load (--load) in N: 80 g weigh 0.785 N.",
        ),
        (
            no_load and stated.get("load_uncertainty") is not None,
            "load_uncertainty (--load-uncertainty) belongs to a load.",
            "Give the load, too.",
        ),
        (
            noisy and (holds or (u_errors is not None and noise is not None)),
            "Readings have one uncertainty: noise (--noise), u_errors (--u-errors), or of holds.",
            "Give one of them.",
        ),
    ):
        if useless:
            raise InputError(problem, cure=cure)
    if x is None and y is None:
        raise InputError("No column of the positions is named.", cure="Give x (--x COLUMN).")
    table = open_table(
        source,
        sheet=sheet,
        skip_rows=skip_rows,
        missing=tuple(missing),
        delimiter=delimiter,
        decimal=decimal,
    )
    u_unit = table.unit_of(u, *of_u)
    reading = reading_of(u_unit, table.where(u))
    volts = dimension_in("voltage", reading)
    of_x = x_unit, "x_unit (--x-unit)", None
    wanted = {
        name: Wanted(column, table.unit_of(column, *unit), dimension)
        for name, column, dimension, unit in (
            ("u_zz", u, volts, (*of_u, None)),
            ("u_xz", u_xz, volts, (*of_u, u_unit)),
            ("u_yz", u_yz, volts, (*of_u, u_unit)),
            ("u_zz_errors", u_errors, volts, (None, "", u_unit)),
            ("normal_load", load_column, "force", (load_unit, "load_unit (--load-unit)", "N")),
            ("x", x, "length", of_x),
            ("y", y, "length", of_x),
        )
        if column is not None
    }
    units = ", ".join(f"{name} in {item.unit}" for name, item in wanted.items())
    numbering = [repeat] if isinstance(repeat, str | int) else list(repeat or ())
    wanted |= {f"repeat {i}": Wanted(c, words=BRANCHES) for i, c in enumerate(numbering)}
    if branch is not None:
        wanted["branch"] = Wanted(branch, words=BRANCHES)
    columns: Columns = table.columns(wanted)
    notes = [*table.notes, f"Units: {units}."]
    if u_sign < 0:
        columns["u_zz"] *= -1
        notes.append("The sign of u_zz was changed.")
    if noise is not None:
        u_noise = float(to_si(noise, u_unit, volts, "noise"))
        columns["u_zz_errors"] = np.full(columns["u_zz"].shape, u_noise)
    if numbering:
        columns["repeat"] = _lines(columns, numbering, notes)
    if branch is not None:
        columns["branch"] = branch_numbers(table.where(branch), np.nan_to_num(columns["branch"]))
    if x is None:
        columns["x"] = np.zeros(columns["y"].size)
    found = find_holds(columns, table.all_lines(), reading) if holds else None
    if found is not None:
        notes += found.notes
        columns = dict(found.mean)
        if found.u_errors.all():  # readings of few digits may not scatter
            columns["u_zz_errors"] = found.u_errors
    columns = _placed(columns, notes, (lambda _: "of holds") if found else table.lines)
    stated |= {"load": load, "unit": reading.si, "source": table.source, "holds": found}
    scan = _scan_of(columns, notes, reading, load_scatter, x_error, stated)
    del columns  # the scan has copies, and ten million rows are many
    if scan.film is not None:
        (require_plausible if isinstance(scan.indenter, Rod) else require_span)(scan)
    return scan


def _scan_of(
    columns: Columns,
    notes: list[str],
    reading: Reading,
    load_scatter: float | None,
    x_error: float | None,
    stated: dict[str, Any],
) -> ImportedScan:
    """Return the scan of columns without gaps in their positions, and add to the notes."""
    words = _numbered_by_load(columns, notes)
    if "normal_load" in columns:
        _take_load(columns["normal_load"], notes, stated)
    if load_scatter is not None and "normal_load" not in columns:
        if stated["load"] is None:
            problem = "The scatter of the loads is given, but no load."
            raise InputError(problem, cure="Give the load in N, or its column.")
        columns["normal_load"] = np.full(columns["u_zz"].shape, stated["load"])
    stated = {"direction": _direction(columns, notes), **stated}
    in_words = SimpleNamespace(**{**stated, "load": words or stated["load"]})
    notes += [*_counted(columns), *_set_up_in_words(in_words)]
    errors = columns.get("u_zz_errors")
    u = None if errors is None else f"{reading.text(float(np.nanmedian(errors)))} (median)"
    notes.append(f"Standard uncertainty of each reading: {u or 'not stated'}.")
    messages = import_notes(notes)
    if "y" not in columns and "normal_load" in columns:
        indenter = stated.get("indenter")
        messages += _mixed_loads(columns["normal_load"], columns.get("repeat"), indenter)
    columns = _as_rows(columns)
    channels: Columns = {n: columns.pop(n) for n in ("u_xz", "u_yz") if n in columns}
    if load_scatter is not None:
        columns["normal_load_errors"] = load_scatter * columns["normal_load"]
    if x_error is not None:
        columns["x_errors"] = np.full(columns["x"].size, x_error)
    texts = "\n".join(marked_texts(messages))
    told = {"channels": channels, "notes": texts, "messages": tuple(messages)}
    fields: dict[str, Any] = {**columns, **stated, **told}
    return ImportedScan(**fields)


def _numbered_by_load(columns: Columns, notes: list[str]) -> str:
    """Number the readings of a line at several loads by these, if nothing else does; name them."""
    loads = columns.get("normal_load")
    if loads is None or "y" in columns or not np.all(loads > 0):
        return ""
    groups = load_groups(loads)
    if not groups.any():
        return ""
    levels = [f"{np.median(loads[groups == i]):.4g}" for i in range(int(groups.max()) + 1)]
    words = f"of {', '.join(levels[:-1])} and {levels[-1]} N"
    if "repeat" not in columns:
        columns["repeat"] = groups
        notes.append(f"{len(levels)} lines: one for each of the loads {words}.")
    return words


def _take_load(loads: NDArray[Any], notes: list[str], stated: dict[str, Any]) -> None:
    """Take the median of a column as the nominal load; refuse one that contradicts the column."""
    if stated["load"] is None:
        stated["load"] = float(np.nanmedian(loads))
        notes.append(f"The nominal load is the median of the column: {stated['load']:.4g} N.")
    require_recorded(stated["load"], loads)


def scan_of_arrays(x: ArrayLike, u: ArrayLike, **options: Any) -> ImportedScan:
    """Return a scan of arrays like ``u``, of which some options are; a row of ``u`` is a pass."""
    readings = np.asarray(u, dtype=np.float64)
    given = {name: options.pop(name) for name in _ARRAYS if options.get(name) is not None}
    if readings.ndim == 2 and not given.keys() & {"y", "repeat"}:
        given["repeat"] = np.arange(len(readings))[:, None]
    columns = {"u": readings, "x": x, **given}
    try:
        table = {n: np.broadcast_to(v, readings.shape).ravel() for n, v in columns.items()}
    except ValueError as error:
        problem = f"An array does not have the shape of u, {readings.shape}: {error}."
        raise InputError(problem, cure="Give one value for each reading.") from error
    named: dict[str, Any] = {name: name for name in table}
    return import_table(table, **named, **{"x_unit": "m", "u_unit": "V", **options})


def _set_up_in_words(stated: Any) -> Iterator[str]:
    """Yield what was pressed on what, with each uncertainty, as it was taken."""
    film, indenter = (getattr(stated, name, None) for name in ("film", "indenter"))
    shape = "indenter" if indenter is None else indenter.shape
    for name, owner, record in (
        (shape, indenter, ROUND_INDENTER),
        ("pressed with", stated, LOAD),
        ("film", film, FILM),
    ):
        words = []
        for q in (q for q in record.quantities if not q.name.endswith("_uncertainty")):
            value, u = (getattr(owner, key, None) for key in (q.name, f"{q.name}_uncertainty"))
            if isinstance(value, int | float) and np.isfinite(value):
                value = format_measured(value / q.scale, u and u / q.scale, q.unit)
            words += [f"{q.words} {value}"] if value not in (None, "") else []
        yield f"{name.capitalize()}: {', '.join(words) or 'not stated'}."


def _direction(columns: Columns, notes: list[str]) -> str:
    """Return the axis of a line; points of two axes that spread along one become one."""
    x, y = (float(np.ptp(columns[name])) if name in columns else 0.0 for name in ("x", "y"))
    if "y" not in columns or min(x, y) > LINE * max(x, y):
        return "x"
    along, across = ("y", "x") if y > x else ("x", "y")
    if across in columns and min(x, y) > 0:
        stays = f": {across} stays within {min(x, y) * 1e3:.4g} mm"
    else:
        stays = ""
    notes.append(f"The points are a line along {along}{stays}.")
    columns["x"] = columns.pop("y") if along == "y" else columns["x"]
    columns.pop("y", None)
    return along


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


def _placed(columns: Columns, notes: list[str], of_rows: Callable[[Any], str]) -> Columns:
    """Leave out rows without a position or the number of a repeat; count the repeats from 0."""
    stated = [columns[name] for name in ("x", "y", "repeat") if name in columns]
    finite = np.logical_and.reduce([np.isfinite(values) for values in stated])
    if not finite.any():
        raise InputError("No row of the table has a position.", cure="Check the columns.")
    for name, values in columns.items():
        if (rows := np.flatnonzero(finite & np.isnan(values))).size:
            notes.append(f"{name} is missing (NaN) in {of_rows(rows)}.")
    if not finite.all():
        rows = np.flatnonzero(~finite)
        notes.append(f"Left out, for they have no position: {of_rows(rows)}.")
        columns = {name: values[finite] for name, values in columns.items()}
    if "repeat" in columns:
        columns["repeat"] = np.unique(columns["repeat"], return_inverse=True)[1]
    return columns


def _counted(columns: Columns) -> list[str]:
    x = columns["x"]
    y = columns.get("y", np.zeros(columns["x"].size))
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
