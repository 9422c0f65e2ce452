"""Control chart of a sensor's calibrations, with limits from their covariance."""

from datetime import datetime

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.extensions.history.changes import fitted
from memscal.extensions.history.history import History
from memscal.extensions.history.summary import answer
from memscal.figures.report import Picture, Report
from memscal.figures.style import (
    FAILED,
    GAUSSIAN,
    MEASURED,
    MUTED,
    coverage,
    draw_band,
    legend_above,
    panels_of,
)
from memscal.model.arrays import Values

#: Ends of a date's limits about it, in years.
_WIDTH = np.array([-0.06, 0.06])


def history_figure(history: History) -> Figure:
    """Draw A and sigma by date with the limits by the earlier dates, repairs, and the trend."""
    with panels_of(3.0, 1, 2) as (figure, panels):
        for row, axes in enumerate(panels):
            _draw_dates(axes, history, row)
            _draw_limits(axes, history, row)
            _draw_segments(axes, history)
        _draw_trend(panels[0], history)
        for axes in panels:
            legend_above(axes)
    return figure


def _year(time: str) -> float:
    """Return the year of a time, with its fraction."""
    moment = datetime.fromisoformat(time)
    return moment.year + moment.timetuple().tm_yday / 365.25


def _draw_dates(axes: Axes, history: History, row: int) -> None:
    errors = coverage() * np.sqrt(np.diag(history.covariances[row]))
    years = _year(history.times[0]) + history.years
    look: Values = {"fmt": "o", "color": MEASURED, "ecolor": MUTED, "elinewidth": 0.6, "ms": 4}
    axes.errorbar(years, 100 * history.values[row], 100 * errors, label="calibrations", **look)
    symbol = history.quantities[row].replace("sigma", "σ")
    axes.set(xlabel="year", ylabel=f"{symbol} over the first, less 1 (%)")


def _draw_limits(axes: Axes, history: History, row: int) -> None:
    """Draw where each date is expected by the earlier ones of its segment."""
    for i in range(1, history.years.size):
        own = np.flatnonzero(np.array(history.segment[: i + 1]) == history.segment[i])
        values = history.values[row, own]
        covariance = history.covariances[row][np.ix_(own, own)]
        newest = fitted(values[:, None], np.ones((own.size, 1)), own == i, covariance)
        if newest is not None:
            middle = 100 * (values[-1] - newest.value)
            error = 100 * coverage() * newest.uncertainty
            x = _year(history.times[0]) + history.years[i] + _WIDTH
            label = "expected by the earlier dates" if i == 1 else None
            draw_band(axes, x, middle - error, middle + error, label)


def _draw_segments(axes: Axes, history: History) -> None:
    """Draw a line where a repair or another film begins a segment."""
    between = _year(history.times[0]) + (history.years[1:] + history.years[:-1]) / 2
    look: Values = {"linestyles": "dotted", "transform": axes.get_xaxis_transform()}
    kinds = (("repair", history.segment, FAILED), ("another film", history.films, MUTED))
    for what, stated, colour in kinds:
        at = [x for x, one, other in zip(between, stated, stated[1:], strict=False) if one != other]
        if at:
            axes.vlines(at, 0.0, 1.0, colour, label=what, **look)


def _draw_trend(axes: Axes, history: History) -> None:
    """Draw the trend of A, and the date of the next calibration."""
    if history.trend is None:
        return
    own = np.array(history.segment) == history.segment[-1]
    years = history.years[own]
    mean = np.mean(history.values[0, own])
    line = 100 * (mean + history.trend["value"] * (years - years.mean()))
    axes.plot(_year(history.times[0]) + years, line, color=GAUSSIAN, ls="--", label="trend")
    if history.next_date is not None:
        axes.axvline(_year(history.next_date), color=GAUSSIAN, ls="-.", label="next calibration")


def report(history: History) -> Report:
    """Return what the page of a history says beside its tables."""
    found = answer(history)
    caption = (
        "a, b: A and the Gaussian width by date, over those of the first, with the standard "
        "uncertainty of each calibration; shaded: where a date is expected by the earlier ones, "
        "from the covariance of the calibrations. Lines: repairs, other films, the trend of A, and "
        "the next calibration."
    )
    return Report(
        title=f"History of the sensor {history.sensor}".rstrip(),
        verdict=found,
        failed=history.changed,
        leading=3,
        pictures=[Picture(history.plot, f"{caption} {found}", caption)],
        messages=history.messages,
    )
