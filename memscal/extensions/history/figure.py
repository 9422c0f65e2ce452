"""Control chart of a sensor's calibrations, with limits from their covariance."""

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.extensions.history.changes import fitted
from memscal.extensions.history.history import History, moment_of
from memscal.extensions.history.summary import answer
from memscal.figures.report import Picture, Report
from memscal.figures.style import (
    FAILED,
    GAUSSIAN,
    MEASURED,
    MUTED,
    coverage,
    draw_band,
    drawable,
    legend_above,
    panels_of,
)
from memscal.model.arrays import FloatArray

#: Ends of a date's limits about it, in years.
_WIDTH = np.array([-0.06, 0.06])
#: Seconds of a year.
_SECONDS = 31_557_600


def history_figure(history: History) -> Figure:
    """Draw A and sigma by date with the limits by the earlier dates, repairs, and the trend."""
    with panels_of(3.0, 1, 2) as (figure, panels):
        _draw_trend(panels[0], history)
        for row, axes in enumerate(panels):
            _draw_dates(axes, history, row)
            _draw_limits(axes, history, row)
            _draw_segments(axes, history)
            legend_above(axes)
    return figure


def _year(time: str) -> float:
    """Return the year of a time, with its fraction."""
    return 1970 + moment_of(time).timestamp() / _SECONDS


def _places(history: History) -> FloatArray:
    """Return where calibrations are drawn: at their years, or of one date beside each other."""
    if history.of_one_date:
        return np.arange(history.years.size, dtype=float)
    return _year(history.times[0]) + history.years


def _draw_dates(axes: Axes, history: History, row: int) -> None:
    errors = coverage() * np.sqrt(np.diag(history.covariances[row]))
    places = _places(history)
    axes.errorbar(
        places,
        100 * history.values[row],
        100 * errors,
        label="calibrations",
        fmt="o",
        color=MEASURED,
        ecolor=MUTED,
        elinewidth=0.6,
        ms=4,
    )
    symbol = history.quantities[row].replace("sigma", "σ")
    axes.set(xlabel="year", ylabel=f"{symbol} over the first, less 1 (%)")
    axes.ticklabel_format(useOffset=False)
    if history.of_one_date:
        axes.set_xticks(places, map(drawable, history.labels), rotation=30, ha="right")
        axes.set_xlabel("")


def _draw_limits(axes: Axes, history: History, row: int) -> None:
    """Draw where each date is expected by the earlier ones of its segment."""
    for i in range(1, history.years.size):
        own = np.flatnonzero(np.array(history.segment[: i + 1]) == history.segment[i])
        values = history.values[row, own]
        covariance = history.covariances[row][np.ix_(own, own)]
        newest = fitted(values, np.ones((own.size, 1)), own == i, covariance)
        if newest:
            middle = 100 * (values[-1] - newest.value)
            error = 100 * coverage() * newest.uncertainty
            x = _places(history)[i] + _WIDTH
            label = "expected by the earlier dates" if i == 1 else None
            draw_band(axes, x, middle - error, middle + error, label)


def _draw_segments(axes: Axes, history: History) -> None:
    """Draw a line where a repair or another film begins a segment."""
    places = _places(history)
    between = (places[1:] + places[:-1]) / 2
    kinds = (("repair", history.segment, FAILED), ("another film", history.films, MUTED))
    for what, stated, colour in kinds:
        at = [x for x, one, other in zip(between, stated, stated[1:], strict=False) if one != other]
        if at:
            axes.vlines(
                at, 0.0, 1.0, colour, "dotted", label=what, transform=axes.get_xaxis_transform()
            )


def _draw_trend(axes: Axes, history: History) -> None:
    """Draw the trend of A, and the date of the next calibration."""
    if history.trend is None:
        return
    own = history.tested
    years = history.years[own]
    mean = np.mean(history.values[0, own])
    line = 100 * (mean + history.trend["value"] * (years - years.mean()))
    axes.plot(_places(history)[own], line, color=GAUSSIAN, ls="--", label="trend")
    if history.next_date:
        axes.axvline(_year(history.next_date), color=GAUSSIAN, ls="-.", label="next calibration")


def report(history: History) -> Report:
    """Return what the page of a history says beside its tables."""
    found = answer(history)
    caption = (
        "a, b: A and the Gaussian width by date (of one date by artifact), over those of the "
        "first, with the expanded uncertainty of each calibration; shaded: where a date is "
        "expected by the earlier ones, from the covariance of the calibrations. Lines: repairs, "
        "other films, the trend of A, and the next calibration."
    )
    return Report(
        title=f"History of the sensor {history.sensor}".rstrip(),
        verdict=found,
        failed=history.changed,
        leading=3,
        pictures=[Picture(history.plot, f"{caption} {found}", caption)],
        messages=history.messages,
    )
