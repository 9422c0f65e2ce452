r"""Creep of a sensor, from its readings while an indenter rests on it: share, time and level.

A sensor, its adhesive or its package gives a part of each reading late.  From the contact on, t = 0
at the first reading, the record of a constant load is

.. math::

    u(t) = u(T)\,\frac{1 - g\,e^{-t/\tau}}{1 - g\,e^{-T/\tau}},

with the share g, the time :math:`\tau` and the level u(T) at the end of the record, in white noise
of a size that is estimated.  What creeps later than T is not seen: a calibration with it states A
as it is the time T after a contact.
"""

from dataclasses import replace
from pathlib import Path

import numpy as np

from memscal.calibration.prepare import Request
from memscal.errors import FitError, InputError
from memscal.formats import groups
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.formats.hdf5.writer import Group, file_tree, write_tree
from memscal.formats.scan import scan_entry, scan_from
from memscal.formats.tables.scan import ImportedScan
from memscal.measurement.restore import place_of
from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import ArrayPair, FloatArray, keyword_array_record
from memscal.model.checks import (
    QualityChecks,
    added_check,
    check,
    chi_square_limit,
    state_of_checks,
)
from memscal.model.instrument import MOST_CREEP, Dynamics
from memscal.model.provenance import Process
from memscal.model.records import PROCESS
from memscal.model.result import Shown
from memscal.model.scan import Scan

_SCHEMA = "memscal-creep"
LAYOUT = {"/entry/process": PROCESS}
"""Groups of its file beside those of a scan, of parameters and of checks."""

_FEWEST = 64
#: Times that are tried, from the step to the length of a record.
_TRIED = 40
#: Degrees of freedom that the search for a time takes, by simulation.
_SEARCHED = 2
#: Share of a record's length from which on times are named where no creep is seen.
_SHORT = 0.01
#: Standard deviations below which 95 % are.
_MOSTLY = 1.645
#: Share of the mean square that counts as rounding.
_ROUNDING = 1e-18
_ONE_TIME = """\
Fall of chi-square by a further creep of another time. A failure means that one time does not \
explain the record, and would correct readings wrongly."""
_WHITE = """\
Correlation of neighbouring residuals. A failure means that they are no white noise: the \
uncertainties are too small."""


@keyword_array_record
class Creep(Shown):
    r"""Creep of a sensor, as :func:`creep_of` finds it in a dwell record.

    Parameters
    ----------
    record : Scan
        The dwell record: readings u_zz (n,) by time (n,), in s, under an indenter at rest.
    parameters : ParameterSet
        ``share``, ``time`` (in s), ``level`` (the reading at the end of the record, in its unit)
        and ``record`` (its length, in s, without uncertainty), with their covariance.
        The standard uncertainty of :math:`\ln\tau`, of which the error is nearer to normal, is
        that of the time over the time.
    checks : tuple of QualityCheck
        Whether one time explains the record, and whether its noise is white.

    Examples
    --------
    >>> import numpy as np
    >>> import memscal
    >>> time = np.arange(1200) / 20  # 60 s at 20 Hz
    >>> noise = 1e-6 * np.random.default_rng(1).normal(size=time.size)
    >>> u = 1e-3 * (1 - 0.05 * np.exp(-time / 1.0)) + noise
    >>> rod = memscal.Rod(radius=0.25e-3)
    >>> creep = creep_of(memscal.Scan(x=0 * time, u_zz=u, time=time, motion="rest", indenter=rod))
    >>> round(creep.parameters["share"], 2), round(creep.parameters["time"], 1)
    (0.05, 1.0)
    """

    record: Scan
    parameters: ParameterSet
    checks: QualityChecks
    messages = ()


def dwell_readings(time: FloatArray, share: float, tau: float, level: float) -> FloatArray:
    """Return readings at times (n,), the last of which is at the level."""
    arrived = 1 - share * np.exp(-time / tau)
    return np.asarray(level * arrived / arrived[-1])


def creep_of(record: Scan) -> Creep:
    """Find share, time and level of the creep in a dwell record, by maximum likelihood.

    Parameters
    ----------
    record : Scan
        Readings in time (``motion="rest"``), zero without contact, from the contact on, under an
        indenter at rest, which it states unless it was imported: readings before the contact are
        no part of it.

    Returns
    -------
    Creep
        Its checks may have failed: see ``checks``.

    Raises
    ------
    InputError
        If it is no dwell record.
    FitError
        If no creep is seen (the share that would have been seen is said), one of a time that the
        record does not tell, or a share that no sensor has.

    Examples
    --------
    See :class:`Creep`.
    """
    from scipy.optimize import curve_fit

    time, u = _readings(record)
    length = time[-1]
    fall, tau = _further(time, u)
    least = chi_square_limit(_SEARCHED)
    if fall >= least and tau >= length:
        raise FitError(
            f"{place_of(record)}: the creep takes {length:.3g} s or longer, the whole record.",
            why="Its share and its time are told by how it comes to an end.",
            cure="Record for several times as long.",
        )
    if fall < least or not length / u.size < tau < length:
        short = _SHORT * length
        spread = np.std(np.exp(-time / short)) * u.size**0.5
        seen = (least**0.5 + _MOSTLY) * np.std(u) / spread / abs(u.mean())
        raise FitError(
            f"{place_of(record)}: no creep seen; a share of {100 * seen:.2g} % with a time of "
            f"{short:.2g} s or longer would have been seen.",
            why="It was sought with times from that between readings to that of the whole record.",
            cure="Calibrate without it; or begin the record at the contact, and record for longer.",
        )
    found, covariance = curve_fit(dwell_readings, time, u, (0.1, tau, u[-1]))
    if not 0 < found[0] < MOST_CREEP:
        raise FitError(
            f"{place_of(record)}: the share that comes late is {100 * found[0]:.2g} %, with a time "
            f"of {found[1]:.2g} s.",
            why="The creep of a sensor is a small part of its reading, which grows.",
            cure="Begin the record at the contact. Readings that fall are of a film that relaxes, "
            "under a held depth in place of a load, or of a drift.",
        )
    left = u - dwell_readings(time, *found)
    decay = np.exp(-time / found[1])
    added, _ = _further(time, u, decay, time * decay)
    # Exact readings leave their rounding.
    alike = float(left[1:] @ left[:-1] / (left @ left + _ROUNDING * u @ u))
    return Creep(
        record=replace(record, x=0 * time, u_zz=u, time=time),
        parameters=ParameterSet(
            ("share", "time", "level", "record"),
            np.append(found, length),
            np.pad(covariance, (0, 1)),
            ("1", "s", record.reading.si, "s"),
            record.reading,
        ),
        checks=(
            added_check("one_time", added, _SEARCHED, _ONE_TIME),
            check("residual_correlation", alike, (chi_square_limit(1) / u.size) ** 0.5, _WHITE),
        ),
    )


def _readings(record: Scan) -> ArrayPair:
    """Return times from the first one and readings, (n,) each; refuse what is no dwell record."""
    pressed = record.indenter or isinstance(record, ImportedScan)
    if record.motion != "rest" or record.time is None or not pressed:
        raise InputError(
            f"{place_of(record)} is no dwell record.",
            why="Creep is seen in readings in time, under an indenter at rest.",
            cure="Give a table (--time, --u), or a scan along time alone that states its indenter.",
        )
    moment = record.time + 0 * record.u_zz  # NaN where either is missing
    order = np.argsort(moment)[: np.isfinite(moment).sum()]
    time = moment[order] - moment[order[:1]]
    u = record.u_zz[order]
    if u.size < _FEWEST or not time[-1] * np.ptp(u):
        raise InputError(
            f"{place_of(record)} has fewer than {_FEWEST} readings, or all are equal.",
            cure="Record for longer, or with more digits.",
        )
    return time, u


def _further(time: FloatArray, u: FloatArray, *columns: FloatArray) -> tuple[float, float]:
    """Return the fall of chi-square by a decay beside a level and columns, and its time."""
    basis = np.linalg.qr(np.column_stack([np.ones_like(u), *columns]))[0]
    left = u - basis @ (basis.T @ u)
    best = (0.0, 0.0)
    for tau in np.geomspace(time[-1] / u.size, time[-1], _TRIED):
        decay = np.exp(-time / tau)
        decay -= basis @ (basis.T @ decay)
        best = max(best, ((left @ decay) ** 2 / (decay @ decay), tau))
    share = best[0] / (left @ left + _ROUNDING * u @ u)
    return float(-u.size * np.log1p(-share)), best[1]


def write_creep(creep: Creep, path: Path, *, overwrite: bool = False) -> None:
    """Write a creep as a memscal-creep file."""
    # The scan enters the unit of its readings.
    children = {
        **scan_entry(creep.record).children,
        "parameters": groups.parameter_group(creep.parameters, {}),
        "quality": groups.quality_group(creep.checks),
        "process": groups.write_record(PROCESS, Process.of_now(input_scan=creep.record.source)),
    }
    entry = Group("NXentry", children, {"default": "data"})
    write_tree(file_tree(_SCHEMA, entry), path, overwrite=overwrite)


def read_open(file: SafeFile) -> Creep:
    """Read the creep of an open memscal-creep file; refuse one that was changed."""
    record = scan_from(file, schema=_SCHEMA)
    return Creep(
        record=record,
        parameters=groups.read_parameters(file, "/entry/parameters", record.reading),
        checks=groups.read_quality(file),
    )


def with_creep(scans: tuple[Scan, ...], request: Request) -> tuple[tuple[Scan, ...], Request]:
    """Return scans of a sensor whose creep a calibration is asked to correct for.

    The request then has the name and the digest of its file, in words.  Errors of share and time
    count as independent.  Their correlation, -0.7 of a time of 1 s in 60 s, would change what they
    leave open, 0.1 % of A and sigma by a record of 0.2 % noise, to between 0.6 and 1.3 times that.
    """
    creep = request.creep
    if not isinstance(creep, Creep):
        with open_hdf5(creep, accept_altered=request.accept_altered) as opened:
            creep = read_open(opened)
    found = creep.parameters
    dynamics = replace(
        scans[0].sensor.dynamics or Dynamics(),
        creep_share=found["share"],
        creep_share_uncertainty=found.uncertainty("share"),
        creep_time=found["time"],
        creep_time_uncertainty=found.uncertainty("time"),
        creep_record=found["record"],
    )
    # All scans are of one sensor.
    corrected = [replace(s, sensor=replace(s.sensor, dynamics=dynamics)) for s in scans]
    file = creep.record.source
    checked = state_of_checks(creep.checks)
    named = file and f"{file.file_name} (sha256 {file.sha256}): {checked} {file.altered}".strip()
    return tuple(corrected), replace(request, creep=named)
