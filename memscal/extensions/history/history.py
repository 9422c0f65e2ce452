"""The history of a sensor from the artifacts of its calibrations."""

from __future__ import annotations

from bisect import bisect
from collections.abc import Hashable, Iterator, Sequence
from datetime import UTC, datetime, timedelta
from os import PathLike

import numpy as np

from memscal.apparatus import ApparatusFunction, load_apparatus
from memscal.errors import InputError
from memscal.extensions.history import shared
from memscal.extensions.history.changes import (
    LEVEL,
    TESTS,
    change_tests,
    exceeded_after,
    fitted,
)
from memscal.formats.opened import require_different
from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import (
    FloatArray,
    FrozenArrays,
    IndexArray,
    Values,
    array_record,
    floats,
)
from memscal.model.checks import Message
from memscal.model.quantities import PER_MM
from memscal.model.result import Shown
from memscal.summaries.table import percent

Calibrations = Sequence[ApparatusFunction]
"""Artifacts of one sensor by their dates."""

_DAYS = 365.25
FEWEST = 4
"""Dates below which no date of the next calibration is proposed."""
#: Share of the 5 % by which each of the first quantities is tested.
_SHARES = (0.4, 0.2, 0.4)
#: Temperatures (K) that differ by less change no sensor visibly.
_LEAST_SPREAD = 1.0
#: Other years are mistaken.
_YEARS = range(1900, 3000)

_STAIRCASE = (
    "A next date takes four dates since the last repair. Until then follow the staircase rule "
    "(ILAC-G24:2022, method 1): lengthen the interval after a calibration without a change, and "
    "shorten it after one with a change."
)


@array_record
class History(FrozenArrays, Shown):
    """Calibrations of one sensor by date, what changed, and when it is to be calibrated again.

    Made by :func:`memscal.history`.  ``print(history)`` shows the tests and the dates.

    Attributes
    ----------
    sensor : str
        Serial number or name of the sensor.
    labels : tuple of str
        Name of each artifact's file, or its time.
    times : tuple of str
        When each of n scans began, the earliest first, in ISO 8601.
    years : ndarray, shape (n,)
        The same in years (365.25 days) from the first.
    quantities : tuple of str
        Names of the q quantities: A, sigma, A at unchanged sigma, and A G(k) at round wavenumbers.
    values, covariances : ndarray, shape (q, n), (q, n, n)
        Natural logarithms of the quantities less those of the first date, and their covariance
        between dates by all that the calibrations state and share.
    parameters : tuple of ParameterSet
        A and sigma of each date with their covariance, in SI units.
    segment : tuple of int
        Number of repairs before each date.  The last segment alone is tested.
    films : tuple of str
        Name of the film of each date.
    tests : tuple of mapping
        Test, quantity, statistic, p-value, and ``seen``: the size that it would have seen in 95 %;
        of a change point also its size (of the logarithm), and the two dates it is ``between``.
    trend, temperature, repairs : mapping or None, mapping or None, tuple of mapping
        Slope of ln A in 1/yr; its temperature coefficient in 1/K, where temperatures differ; date
        of each repair, of the last calibration before it, and the change of ln A between them.
    tolerance : float
        Relative change of A by which ``next_date`` is chosen.
    next_date : str or None
        When the sensor will have changed by more than the tolerance with a probability of 5 %, in
        ISO 8601; ``None`` below four dates.
    due : str
        The same in words, with what limits it.
    messages : tuple of Message
        What was not named, and other notes.

    Examples
    --------
    >>> import memscal, tempfile
    >>> from dataclasses import replace
    >>> scan = memscal.simulate(seed=1)
    >>> dates = [replace(scan, start_time=f"202{year}-03-01") for year in range(3)]
    >>> history = memscal.history([memscal.calibrate(scan).apparatus for scan in dates])
    >>> history.changed, history.next_date
    (False, None)
    """

    sensor: str
    labels: tuple[str, ...]
    times: tuple[str, ...]
    years: FloatArray
    quantities: tuple[str, ...]
    values: FloatArray
    covariances: FloatArray
    parameters: tuple[ParameterSet, ...]
    segment: tuple[int, ...]
    films: tuple[str, ...]
    tests: tuple[Values, ...]
    trend: Values | None
    temperature: Values | None
    repairs: tuple[Values, ...]
    tolerance: float
    next_date: str | None
    due: str
    messages: tuple[Message, ...]

    @property
    def changes(self) -> list[Values]:
        """Each test by the quantity that is least likely by chance, adjusted for their number."""
        # Of each test the last one, of the least p, is kept.
        least = {test["test"]: test for test in sorted(self.tests, key=lambda test: -test["p"])}
        made = [least[name] for name in TESTS if name in least]
        return [{**test, "significant": test["p"] < LEVEL} for test in made]

    @property
    def changed(self) -> bool:
        """Whether a change is significant."""
        return any(change["significant"] for change in self.changes)

    @property
    def tested(self) -> IndexArray:
        """Which calibrations are tested: those since the last repair."""
        return np.flatnonzero(np.array(self.segment) == len(self.repairs))

    @property
    def of_one_date(self) -> bool:
        """Whether all scans are of one day: of two methods, rods or laboratories."""
        return not self.years.any()


def history(
    apparatuses: Sequence[str | PathLike[str] | ApparatusFunction],
    *,
    tolerance: float = 0.02,
    repairs: Sequence[str] = (),
) -> History:
    r"""Test the calibrations of one sensor for a change, and say when the next one is due.

    What calibrations share cancels in their differences: the signed effects c of one standard
    uncertainty of each input s of film, indenter, load cell and stage make the covariance

    .. math::

        C_{ij} = \sum_s c_{si}\,c_{sj}\,[i, j\ \text{used the same thing}] + \delta_{ij}\,u_i^2,

    and scatter beyond it, :math:`\tau^2`, is estimated by restricted likelihood.  Generalised least
    squares then tests the newest date against the earlier ones, their homogeneity, the largest
    step, and the trend.

    Parameters
    ----------
    apparatuses : sequence of path or ApparatusFunction
        Two or more artifacts of one sensor, in any order, each with a ``start_time``.
    tolerance : float
        Relative change of A that is allowed until the next calibration, 0.02 for 2 %.
    repairs : sequence of str
        Dates (ISO 8601) of repairs.  Calibrations before the last one are shown, not tested.

    Returns
    -------
    History

    Raises
    ------
    InputError
        If the artifacts are of different sensors, channels or units, a start time or a date is
        missing or no date, there are less than two or one twice, or the tolerance is not
        above zero.
    FormatError
        If a file is no artifact.

    References
    ----------
    GUM (JCGM 100:2008); Patterson and Thompson, Biometrika 58 (1971) 545, for the restricted
    likelihood.

    Examples
    --------
    >>> import memscal
    >>> from dataclasses import replace
    >>> scans = [memscal.simulate(seed=seed) for seed in range(2)]
    >>> dated = [replace(scan, start_time=f"2026-0{i}-01") for i, scan in enumerate(scans, 1)]
    >>> found = memscal.history([memscal.calibrate(scan).apparatus for scan in dated])
    >>> found.times, found.changed
    (('2026-01-01', '2026-02-01'), False)
    """
    if not 0 < tolerance < np.inf:
        raise InputError(
            f"The tolerance is {tolerance:g}, but it must be above zero.",
            cure="Give the relative change of A that is allowed: 0.02, or A=2%, for 2 %.",
        )
    read = sorted(map(_read, apparatuses), key=lambda one: moment_of(one.start_time))
    _require_one_sensor(read)
    contents = [*map(_contents, read)]
    require_different(contents)
    labels = tuple(label for label, _ in contents)
    repaired = sorted(repairs, key=moment_of)
    ends = [*map(moment_of, repaired)]
    moments = [moment_of(one.start_time) for one in read]
    # Scans of one day are of one time.
    dates = [moment.date() for moment in moments]
    years = np.array([(date - dates[0]).days for date in dates]) / _DAYS
    marks = [*map(str, dates)] if len(set(dates)) == len(dates) else labels
    segment = np.array([bisect(ends, moment) for moment in moments])
    names, values, covariances = _quantities(read)

    tested = np.flatnonzero(segment == len(ends))
    temperatures = _temperatures([read[i] for i in tested])
    ones = np.ones((tested.size, 1))
    base = ones if temperatures is None else np.column_stack([ones, temperatures])
    own = covariances[:, tested[:, None], tested]
    since = years[tested]
    marked = [marks[i] for i in tested]
    tests = []
    for i, share in enumerate(_SHARES):
        found = change_tests(values[i, tested], base, own[i], since, marked, share * LEVEL)
        for test, result in found.items():
            adjusted = {**result, "p": min(result["p"] / share, 1.0)}
            tests.append({"test": test, "quantity": names[i], **adjusted})
    of_a = values[0, tested]
    trend = fitted(of_a, base, since, own[0])
    next_date = None
    due = _STAIRCASE
    if trend and np.unique(since).size >= FEWEST:
        ahead = exceeded_after(of_a, base, own[0], since, tolerance)
        next_date = str(dates[-1] + timedelta(days=max(ahead * _DAYS, 1.0)))
        due = f"Next calibration: {next_date}, for a tolerance of {percent(tolerance)} of A."
        if ahead == 0:
            due += " It is due now: the tolerance is below the uncertainty of the history."
        elif ahead == np.ptp(since):
            due += " It is as far ahead as the history looks back, at most."
    by_temperature = None if temperatures is None else fitted(of_a, ones, temperatures, own[0])
    return History(
        sensor=read[0].sensor.serial_number or read[0].sensor.name,
        labels=labels,
        times=tuple(one.start_time for one in read),
        years=years,
        quantities=names,
        values=values,
        covariances=covariances,
        parameters=tuple(one.parameters.only(shared.LEVELS) for one in read),
        segment=tuple(segment.tolist()),
        films=tuple(one.film.name if one.film else "" for one in read),
        tests=tuple(tests),
        trend=trend.stated("1/yr") if trend else None,
        temperature=by_temperature.stated("1/K") if by_temperature else None,
        repairs=tuple(_repairs(repaired, read, segment, values[0], covariances[0])),
        tolerance=tolerance,
        next_date=next_date,
        due=due,
        messages=tuple(_messages(read)),
    )


def _read(given: str | PathLike[str] | ApparatusFunction) -> ApparatusFunction:
    """Return an artifact that has a start time."""
    apparatus = given if isinstance(given, ApparatusFunction) else load_apparatus(given)
    if not apparatus.start_time:
        where = f"{apparatus.source.file_name}: " if apparatus.source else ""
        raise InputError(
            f"{where}/entry/start_time is missing.",
            why="A history is in the order of the dates of its scans.",
            cure="State it in the scan (memscal import --start-time), and calibrate again.",
        )
    return apparatus


def _contents(apparatus: ApparatusFunction) -> tuple[str, Hashable]:
    """Return what names an artifact, and what tells it from another one."""
    label = apparatus.source.file_name if apparatus.source else apparatus.start_time
    arrays = apparatus.parameters.values, apparatus.radial_profile.g
    return label, (apparatus.start_time, *map(bytes, arrays))


def moment_of(text: str) -> datetime:
    """Return a time of ISO 8601 in UTC, which it counts as without an offset."""
    try:
        moment = datetime.fromisoformat(text)
        known = moment.year in _YEARS
    except ValueError:
        known = False
    if not known:
        raise InputError(
            f"{text!r} is no date or time of a calibration or repair.",
            cure="Write it in ISO 8601, of the years 1900 to 2999: 2026-11-20, or "
            "2026-11-20T09:30:00+01:00.",
        )
    return moment.replace(tzinfo=moment.tzinfo or UTC).astimezone(UTC)


def _require_one_sensor(read: Calibrations) -> None:
    """Refuse artifacts that do not measure the same quantity with one sensor."""
    if len(read) < 2:
        raise InputError(
            f"A history takes two or more calibrations, not {len(read)}.",
            cure="Give the artifacts of all dates.",
        )
    serials = {one.sensor.serial_number for one in read}
    names = {one.sensor.name for one in read} - {""}
    stated = {
        "sensors": serials - {""},
        "sensors by their names": names if "" in serials else serials,
        "channels": {one.sensor.channel for one in read},
        "units": {one.reading.over(one.reading.unit) for one in read},
    }
    for what, found in stated.items():
        if len(found) > 1:
            raise InputError(
                f"The artifacts are of different {what}: {', '.join(sorted(found))}.",
                why="A history follows one channel of one sensor in one unit.",
                cure="Give the artifacts of each apart.",
            )


def _quantities(
    read: Calibrations,
) -> tuple[tuple[str, ...], FloatArray, FloatArray]:
    """Return names, logarithms (q, n) less the first date's, and covariances (q, n, n)."""
    k = shared.common_wavenumbers(read)
    values = np.array([shared.logarithms(one, k) for one in read]).T
    joint = shared.covariances(read, k)
    # A less what of sigma scatters with it: the combination of least variance within a history.
    within = np.eye(len(read)) - 1 / len(read)
    with_sigma = np.sum(within * joint[0, 1]) / np.sum(within * joint[1, 1])
    rows = np.insert(np.eye(len(values)), 2, 0.0, axis=0)
    rows[2, :2] = 1.0, -with_sigma
    covariances = np.einsum("aq,ap,qpij->aij", rows, rows, joint)
    transfers = (f"A G({number / PER_MM:g} rad/mm)" for number in k)
    names = ("A", "sigma", "A at unchanged sigma", *transfers)
    return names, rows @ (values - values[:, :1]), covariances


def _temperatures(read: Calibrations) -> FloatArray | None:
    """Return temperatures less their mean, in K, where they differ and all dates state one."""
    stated = [one.sensor.temperature for one in read if one.sensor.temperature is not None]
    if len(stated) < max(len(read), FEWEST) or np.ptp(stated) < _LEAST_SPREAD:
        return None
    return floats(stated) - np.mean(floats(stated))


def _repairs(
    repaired: Sequence[str],
    read: Calibrations,
    segment: IndexArray,
    values: FloatArray,
    covariance: FloatArray,
) -> Iterator[Values]:
    """Yield each repair, the last calibration before it, and how A differs after it."""
    for i, date in enumerate(repaired):
        around = np.flatnonzero((segment == i) | (segment == i + 1))
        ones = np.ones((around.size, 1))
        own = covariance[np.ix_(around, around)]
        fit = fitted(values[around], ones, floats(segment[around] > i), own)
        before = np.flatnonzero(segment <= i)
        last = read[before[-1]].start_time if before.size else None
        change = fit.stated("1") if fit else None
        yield {"date": date, "last_before": last, "change": change}


def _messages(read: Calibrations) -> Iterator[Message]:
    """Yield what weakens the history, and what would mend it."""
    numbered = [one.sensor.serial_number for one in read]
    failed = "failed a quality check."
    lacking = {
        failed: [not one.passed for one in read],
        "state no effects of what they share (their artifacts are older than version 1.2, or "
        "their inputs are correlated): all their errors count as new. Calibrate their scans "
        "again.": [not one.shared_effects for one in read],
        "state no serial number: they count as of the same sensor.": [
            any(numbered) and not number for number in numbered
        ],
    }
    used = {shared.thing_of(source) for source in shared.sources_of(read)}
    for thing, option in shared.THINGS.items():
        text = f"do not name the {thing.replace('_', ' ')} ({option}): it counts as another one "
        lacking[text + "each time."] = [
            thing in used and shared.identity(one, thing) is None for one in read
        ]
    for text, found in lacking.items():
        if any(found):
            counted = f"{sum(found)} of {len(read)} calibrations {text}"
            yield Message("history", counted, "warning" if text == failed else "note")
