"""Contact scans and a calibrated sensor to measured stress: the entry point."""

from __future__ import annotations

import math
import platform
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike
from typing import Any

import numpy as np
import scipy
from scipy.special import erfc

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.errors import FitError, InputError
from memscal.formats.opened import Scans, opened_scans
from memscal.measurement.measured_profile import (
    PreparedScan,
    measured_profile,
    measured_scan,
    prepared_scan,
)
from memscal.measurement.restoration import Restoration, accept_mismatches, require_covariance
from memscal.measurement.restore import (
    failed_calibration_messages,
    noise_unstated_message,
    restore_known,
)
from memscal.measurement.single_loads import (
    ContactSignal,
    SingleLoad,
    contact_signal,
    place_of,
    require_ends,
    require_points,
    single_loads,
)
from memscal.model.arrays import FloatArray
from memscal.model.checks import (
    FAILED_CALIBRATION,
    FAILED_CHECK,
    NOISE_UNSTATED,
    Message,
    QualityCheck,
    check,
    failed_check_messages,
)
from memscal.model.measured_stress import MeasuredProfile, MeasuredScan, MeasuredStress
from memscal.model.provenance import Process, timestamp
from memscal.model.scan import Scan
from memscal.parallel import single_threaded
from memscal.version import __version__

__all__ = [
    "check_of_all_forces",
    "checks_of_restoration",
    "joined_stress",
    "measure_stress",
    "pooled_force",
    "stress_checks",
]

_FORCE_LIMIT = 3.0
#: One check of all profiles together may be stricter than one for each.
_MEAN_LIMIT = 2.0
#: What the shapes of pressure leave open of the force of one profile, however small the noise.
_NEGLIGIBLE_FORCE = 0.01
#: ... of the mean of several, whose shapes differ.
_NEGLIGIBLE_MEAN = 0.005
_FORCE = (
    "A failure means that A or the gain of the channel, the load, or the unit of one of them is "
    "wrong."
)
_BLIND = (
    " It does not depend on the shape of G nor on the film's thickness, and tells nothing of them: "
    "a film thickness that is wrong shows as another width of G in the calibration."
)
#: Of a restoration's own checks, the force's is made here.
_REPLACED = "restored_force"
#: Without a noise that is stated there is nothing to compare the scatter with.
_OF_STATED_NOISE = ("noise_as_stated", "chi_square")


def stress_checks(
    profiles: Sequence[MeasuredProfile], restored: Sequence[Sequence[QualityCheck]]
) -> tuple[QualityCheck, ...]:
    """Return the checks of each profile, numbered from one, then those of all together.

    ``restored``: what :func:`checks_of_restoration` says of each profile.
    """
    found = [
        replace(one, name=f"{one.name}_{i + 1}", meaning=f"{profile.label}: {one.meaning}")
        for i, (profile, own) in enumerate(zip(profiles, restored, strict=True))
        for one in (_force(profile), *own)
    ]
    if len(profiles) > 1:
        found.append(check_of_all_forces(profiles))
    return tuple(found)


def pooled_force(profiles: Sequence[MeasuredProfile]) -> tuple[float, float]:
    """Return the mean of force over load of all profiles, and its standard uncertainty.

    The load's common uncertainty counts; that of each load of one profile does not.
    """
    parts = [_relative(profile) for profile in profiles]
    own = np.array([part["own"] for part in parts])
    weight = own**-2 / np.sum(own**-2)
    ratio = np.array([profile.force / profile.load for profile in profiles])
    variance = float(np.sum((weight * own) ** 2))
    for source in ("apparatus", "film", "position_scale", "load"):
        variance += float(weight @ [part[source] for part in parts]) ** 2
    return float(weight @ ratio), math.sqrt(variance)


def _relative(profile: MeasuredProfile) -> dict[str, float]:
    """Standard uncertainties of force over load, by source."""
    budget = {source: u / profile.load for source, u in profile.force_budget.items()}
    own = budget.pop("scan")
    common = profile.load_uncertainty or 0.0
    return {"own": own, **budget, "load": common / profile.load}


def checks_of_restoration(restoration: Restoration, *, stated: bool) -> tuple[QualityCheck, ...]:
    """Return the checks of a restoration that hold for its profile.

    ``stated``: whether the noise is, or was estimated from the scatter.
    """
    left_out = {_REPLACED} if stated else {_REPLACED, *_OF_STATED_NOISE}
    return tuple(one for one in restoration.checks if one.name not in left_out)


def _force(profile: MeasuredProfile) -> QualityCheck:
    off = profile.force / profile.load - 1
    allowed = float(np.linalg.norm([*_relative(profile).values(), _NEGLIGIBLE_FORCE]))
    return check(
        "applied_force",
        abs(off) / allowed,
        _FORCE_LIMIT,
        f"Difference of the profile's total force, {profile.force:.4g} N, from the applied load of "
        f"{profile.load:.4g} N, over its standard uncertainty of {allowed * profile.load:.2g} N. "
        + _FORCE,
        _two_sided(off / allowed),
    )


def check_of_all_forces(profiles: Sequence[MeasuredProfile]) -> QualityCheck:
    """Return the check of the force of all profiles together."""
    mean, spread = pooled_force(profiles)
    allowed = math.hypot(spread, _NEGLIGIBLE_MEAN)
    return check(
        "applied_force_all",
        abs(mean - 1) / allowed,
        _MEAN_LIMIT,
        f"Total force over applied load, the weighted mean of {len(profiles)} profiles: "
        f"{mean:.4f}, with a standard uncertainty of {allowed:.2g}, in units of which its "
        "difference from one is counted. " + _FORCE + _BLIND,
        _two_sided((mean - 1) / allowed),
    )


def _two_sided(z: float) -> float:
    return float(erfc(abs(z) / math.sqrt(2)))


_NUMBERED = re.compile(r"(\w+)_(\d+)")

#: Messages of a restoration that the measured stress gives itself.
_SAID_OF_ALL = (FAILED_CHECK, FAILED_CALIBRATION, NOISE_UNSTATED)


@single_threaded()
def measure_stress(
    scan: Scans,
    apparatus: ApparatusFunction | str | PathLike[str],
    *,
    override: bool = False,
) -> MeasuredStress:
    r"""Turn contact scans into measured stress, load by load.

    .. math:: S_{zz}(r) = (U_{zz} - b - d\,\xi)/A

    with centre, baseline b and drift d from the restored stress (:func:`memscal.restore`), for
    each load of each scan.  Points that were measured at a load somewhat off the nominal one are
    brought to it; the scatter of the loads counts as noise.

    Parameters
    ----------
    scan : Scan or path, or a sequence of them
        Scans with a sphere or a rod; ``normal_load`` tells the loads of one scan apart, line by
        line.
    apparatus : ApparatusFunction or path
        The calibrated sensor.
    override : bool
        Accept a scan whose sensor, channel or film is not the artifact's: it is recorded in
        ``overridden``.

    Returns
    -------
    MeasuredStress
        A profile for each load of each scan; its checks may have failed: see ``.passed``.

    Raises
    ------
    InputError
        If scan or artifact cannot be used, or not together; if a load, or the middle of its
        profile, was not measured.
    DomainError
        If a load is beyond what the model of the contact holds for.
    FitError
        If a profile is not determined: the scan ends where the stress has not decayed.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1), method="bayesian").apparatus
    >>> measured = memscal.measure_stress(memscal.simulate(seed=2), apparatus)
    >>> [profile] = measured.profiles
    >>> abs(profile.force - profile.load) < 3 * profile.force_uncertainty
    True
    """
    known, scans = opened_apparatus(apparatus), opened_scans(scan)
    require_covariance(known)
    overridden = tuple(
        text
        for one in scans
        for text in accept_mismatches(one, known, place_of(one), override=override)
    )
    origins = tuple(measured_scan(one) for one in scans)
    loads = [
        _measure(origin, part, known)
        for origin, one in zip(origins, scans, strict=True)
        for part in single_loads(one)
    ]
    profiles = tuple(load.profile for load in loads)
    checks = stress_checks(profiles, [load.checks for load in loads])
    return MeasuredStress(
        profiles=profiles,
        scans=origins,
        conversion_constant=known.conversion_constant,
        conversion_constant_uncertainty=known.parameters.uncertainty("conversion_constant"),
        checks=checks,
        overridden=overridden,
        process=_process(
            {"override": bool(override)}, tuple(_messages(loads, known, checks, overridden))
        ),
        artifact=known.source,
        artifact_digest=known.content_digest,
    )


def joined_stress(parts: Sequence[MeasuredStress]) -> MeasuredStress:
    """Return several measured stresses as one: profiles in their order, checks numbered anew.

    Raises
    ------
    InputError
        If they were measured with different apparatus functions.
    """
    first = parts[0]
    if len(parts) == 1:
        return first
    if len({part.artifact_digest for part in parts}) > 1:
        raise InputError(
            "The measured stresses are of different apparatus functions: their digests differ.",
            why="What is compared together shares one sensor and its calibration.",
            cure="Measure all of them with one artifact (memscal apply ARTIFACT SCAN...).",
        )
    profiles = tuple(profile for part in parts for profile in part.profiles)
    starts = np.cumsum([0, *(len(part.profiles) for part in parts)])
    checks = [
        replace(one, name=f"{numbered[1]}_{int(numbered[2]) + start}")
        for part, start in zip(parts, starts, strict=False)
        for one in part.checks
        if (numbered := _NUMBERED.fullmatch(one.name))
    ]
    # What failed is said by the checks, under their new numbers.
    messages = [
        replace(message, text=f"{_files_of(part)}: {message.text}")
        for part in parts
        for message in part.messages
        if message.kind != FAILED_CHECK
    ]
    return replace(
        first,
        profiles=profiles,
        scans=tuple(scan for part in parts for scan in part.scans),
        checks=(*checks, check_of_all_forces(profiles)),
        overridden=tuple(text for part in parts for text in part.overridden),
        process=replace(first.process, messages=tuple(dict.fromkeys(messages))),
    )


def _files_of(measured: MeasuredStress) -> str:
    names = [scan.source.file_name for scan in measured.scans if scan.source]
    return ", ".join(names) or f"{measured.profiles[0].label} and on"


def _process(configuration: Mapping[str, Any], messages: tuple[Message, ...]) -> Process:
    return Process(
        program="memscal",
        version=__version__,
        date=timestamp(),
        configuration=configuration,
        environment={
            "python": platform.python_version(),
            "numpy": np.__version__,
            "scipy": scipy.__version__,
        },
        messages=messages,
    )


@dataclass(frozen=True, eq=False)
class _MeasuredLoad:
    """The profile of one load, and what its restoration says of it."""

    profile: MeasuredProfile
    checks: tuple[QualityCheck, ...]
    messages: tuple[Message, ...]


def _measure(origin: MeasuredScan, part: SingleLoad, known: ApparatusFunction) -> _MeasuredLoad:
    signal = contact_signal(part, known)
    require_points(part, signal)
    prepared = _prepared(part, known, signal)
    try:
        found = restore_known(prepared.scan, known)
    except (FitError, InputError) as failure:
        raise _placed(failure, part) from failure
    require_ends(part, signal, found.centre)
    profile = measured_profile(origin, part, prepared, found, signal)
    estimated = prepared.noise_found or found.points.u_errors is None
    noise = profile.points["zz"].noise if estimated else None
    return _MeasuredLoad(
        profile=profile,
        checks=checks_of_restoration(found, stated=not estimated),
        messages=tuple(_of_profile(part.scan, found, noise)),
    )


def _prepared(part: SingleLoad, known: ApparatusFunction, signal: ContactSignal) -> PreparedScan:
    try:
        return prepared_scan(part, known, signal)
    except (FitError, InputError) as failure:
        # A scan that is too short fails here already, and in less plain words.
        scan = part.scan
        if scan.y is None:
            top = np.nanargmax(np.nanmedian(scan.u_zz.reshape(-1, scan.x.size), axis=0))
            require_ends(part, signal, np.full(2, scan.x[top]))
        raise _placed(failure, part) from failure


def _placed(failure: FitError | InputError, part: SingleLoad) -> FitError | InputError:
    """Say in which file and at which load something failed."""
    return type(failure)(
        f"{place_of(part.scan, part)}: {failure.problem}", why=failure.why, cure=failure.cure
    )


def _messages(
    loads: Sequence[_MeasuredLoad],
    known: ApparatusFunction,
    checks: Sequence[QualityCheck],
    overridden: Sequence[str],
) -> Iterator[Message]:
    """Yield what a user should know, the gravest first."""
    yield from failed_check_messages(checks)
    for text in overridden:
        yield Message("overridden", f"Overridden: {text}.", "warning")
    yield from failed_calibration_messages(known)
    # What is true of every profile is said once.
    numbers: dict[Message, list[str]] = {}
    for i, load in enumerate(loads):
        for message in load.messages:
            numbers.setdefault(message, []).append(str(i + 1))
    for message, of_profiles in numbers.items():
        everywhere = len(of_profiles) == len(loads)
        place = "" if everywhere else f"Profile {', '.join(of_profiles)}: "
        yield replace(message, text=f"{place}{message.text}")


def _of_profile(scan: Scan, found: Restoration, noise: FloatArray | None) -> Iterator[Message]:
    """Yield what one load should be known for; ``noise``: where it was estimated, in V."""
    if noise is not None:
        yield noise_unstated_message(float(noise.min()))
    if scan.normal_load is not None and scan.normal_load_errors is None:
        yield Message(
            "load_errors_unstated",
            "normal_load_errors is absent: the recorded loads are taken as exact.",
        )
    if not scan.lubrication:
        yield Message("lubrication_unstated", "The scan does not state its lubrication.")
    for message in found.messages:
        if message.kind not in _SAID_OF_ALL:
            yield message
