"""Positions of the readings of a table, of its columns or made, and the line that they are."""

from collections.abc import Callable
from typing import Any

import numpy as np

from memscal.errors import InputError
from memscal.extensions import hook
from memscal.formats.tables.stated import TableLayout
from memscal.model.arrays import Columns, Values
from memscal.model.scan import LINE


def require_positions(named: Values, layout: TableLayout, *, resting: bool) -> None:
    """Refuse a table without positions, or with two kinds of them."""
    columns = named["x"] is not None or named["y"] is not None
    if resting:
        others = columns or layout.step is not None or layout.speed is not None
        if others or layout.holds or named["time"] is None:
            cure = "Name the columns of time and readings alone (--time, --u)."
            raise InputError("A noise record is readings in time, at rest.", cure=cure)
    elif layout.speed is not None and not (columns and named["time"] is None):
        others = columns or layout.step is not None or layout.holds or "repeat 0" in named
        if others or named["time"] is None or not 0 < abs(layout.speed) < np.inf:
            raise InputError(
                "speed (--speed) makes the positions of one pass from its times.",
                cure="Name the column of the times (--time COLUMN), leave out positions (--x, --y, "
                "--step), --repeat and --holds, and give a speed that is not zero.",
            )
    elif layout.step is not None:
        presses = layout.holds and (named["depth"], named["normal_load"]) != (None, None)
        if named["y"] is not None or not (columns or presses):
            raise InputError(
                "step (--step) needs places that are counted.",
                cure="Name the column that counts them (--x COLUMN) or, of a log with holds "
                "(--holds), that of the load (--load-column) or depth (--depth) of each press.",
            )
    elif not columns:
        cure = "Give x (--x COLUMN), or times (--time COLUMN) and the stage's speed (--speed)."
        raise InputError("No column of the positions is named.", cure=cure)


def make_positions(
    columns: Columns, layout: TableLayout, notes: list[str], name_rows: Callable[[Any], str]
) -> int | None:
    """Make the positions that no column states; return how many presses were counted for it."""
    presses = None
    if layout.speed is not None and "time" in columns:
        time = columns["time"]
        stated = np.flatnonzero(np.isfinite(time))
        back = stated[1:][np.diff(time[stated]) < 0]
        if back.size:
            raise InputError(
                f"The time goes back in {name_rows(back)}.",
                why="Another pass or another clock begins there: no speed tells its positions.",
                cure="Give the positions (--x COLUMN), or each pass as a table of its own.",
            )
        columns["x"] = layout.speed * time
        signs = columns.get("sliding_direction")
        if signs is not None and stated.size:
            from scipy.integrate import cumulative_trapezoid

            # From the last reading forth to the first one back half of the time is forth.
            way = cumulative_trapezoid(np.nan_to_num(signs[stated]), time[stated], initial=0)
            columns["x"][stated] = abs(layout.speed) * way
        notes.append(f"The positions are {layout.speed * 1e3:.4g} mm/s times the time.")
    elif layout.step is not None:
        counted = "The places"
        if "x" not in columns:
            kind = "depth" if "depth" in columns else "load"
            press = columns.get("depth", columns.get("normal_load"))
            columns["x"], presses = hook("count_presses")(press, kind)
            counted = f"{presses} presses"
        columns["x"] = layout.step * columns["x"]
        notes.append(f"{counted} are counted, {layout.step * 1e3:.4g} mm apart.")
    elif "x" not in columns:
        columns["x"] = np.zeros(columns["u_zz"].size)
    return presses


def direction_of(columns: Columns, notes: list[str]) -> str:
    """Return the axis of a line; points of two axes that spread along one become one."""
    x, y = (np.ptp(columns[name]) if name in columns else 0.0 for name in ("x", "y"))
    if "y" not in columns or min(x, y) > LINE * max(x, y):
        return "x"
    along, across = ("y", "x") if y > x else ("x", "y")
    stays = ""
    if across in columns and min(x, y) > 0:
        stays = f": {across} stays within {min(x, y) * 1e3:.4g} mm"
    notes.append(f"The points are a line along {along}{stays}.")
    if along == "y":
        columns["x"] = columns["y"]
    columns.pop("y", None)
    return along
