"""Measurement of stress from contact scans with a calibrated sensor, with its checks."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain

import numpy as np

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.errors import FitError, InputError
from memscal.formats.files import FilePath
from memscal.formats.opened import Scans, opened_scans, require_different
from memscal.measurement import measured_profile as one_load
from memscal.measurement import restore
from memscal.measurement.restoration import Restoration
from memscal.model.arrays import FloatArray
from memscal.model.checks import (
    FAILED_CALIBRATION,
    FAILED_CHECK,
    NOISE_UNSTATED,
    Message,
    QualityCheck,
    check,
    failed_check_messages,
    override_messages,
)
from memscal.model.measured_stress import MeasuredProfile, MeasuredScan, MeasuredStress
from memscal.model.provenance import Process, accepted_alterations
from memscal.model.scan import STATED_ERRORS, Scan
from memscal.model.sizes import MOST_OF_CORRELATED_CONTACT
from memscal.parallel import single_threaded
from memscal.progress import Listener, Task, reported
from memscal.readings.mistaken_unit import require_span
from memscal.readings.noise_record import record_messages

#: Sources of a force's uncertainty that all profiles have in common.
SHARED_SOURCES = ("apparatus", "film", "position_scale", "load", "dynamics")

#: What the shapes of pressure leave open of the mean force of several, whose shapes differ.
_NEGLIGIBLE_MEAN = 0.005
_FORCE = (
    "A failure means that gain, load or a unit differ between the calibration and this scan. It "
    "does not test A: a factor that is wrong in both, such as of one balance, changes nothing."
)
_BLIND = (
    " It does not depend on the shape of G nor on the film's thickness, and tells nothing of them: "
    "a film thickness that is wrong shows as another width of G in the calibration."
)
#: The restoration's check of the force is replaced by that of the profile.
_REPLACED = "restored_force"
_Measured = tuple[MeasuredProfile, Sequence[QualityCheck], list[Message]]
#: Checks that compare the scatter with a stated noise.
_NOISE_CHECKS = ("noise_as_stated", "chi_square")


def stress_checks(
    profiles: Sequence[MeasuredProfile], restored: Sequence[Sequence[QualityCheck]]
) -> Iterator[QualityCheck]:
    """Yield each profile's checks (``restored``), numbered from one, then that of all."""
    for number, (profile, others) in enumerate(zip(profiles, restored, strict=True), start=1):
        allowed = math.hypot(*_relative(profile).values(), restore.NEGLIGIBLE_FORCE)
        off = abs(profile.force / profile.load - 1) / allowed
        force = check(
            "applied_force",
            off,
            restore.FORCE_LIMIT,
            f"Difference of the profile's total force, {profile.force:.4g} N, from the applied "
            f"load of {profile.load:.4g} N, over its standard uncertainty of "
            f"{allowed * profile.load:.2g} N. {_FORCE}",
            math.erfc(off / math.sqrt(2)),
        )
        for own in (force, *others):
            meaning = f"{profile.label}: {own.meaning}"
            yield replace(own, name=f"{own.name}_{number}", meaning=meaning)
    if len(profiles) > 1:
        yield check_of_all_forces(profiles)


def pooled_force(profiles: Sequence[MeasuredProfile]) -> tuple[float, float]:
    """Return the mean of force over load of all profiles, and its standard uncertainty."""
    # Independent uncertainties u ("scan") and common ones c: weights 1/u^2, and the variance
    # w'(diag(u^2) + cc')w.  The load's common uncertainty counts, that of single loads does not.
    budgets = [_relative(profile) for profile in profiles]
    scan = np.array([budget["scan"] for budget in budgets])
    variance = 1 / np.sum(scan**-2)
    weight = variance * scan**-2
    ratio = np.array([profile.force / profile.load for profile in profiles])
    for source in SHARED_SOURCES:
        variance += (weight @ [budget.get(source, 0.0) for budget in budgets]) ** 2
    return float(weight @ ratio), math.sqrt(variance)


def _relative(profile: MeasuredProfile) -> dict[str, float]:
    """Standard uncertainties of force over load, by source."""
    budget = restore.force_less_load(profile.force_budget, profile.load_uncertainty)
    return {source: u / profile.load for source, u in budget.items()}


def check_of_all_forces(profiles: Sequence[MeasuredProfile]) -> QualityCheck:
    """Return the check of the force of all profiles together."""
    mean, spread = pooled_force(profiles)
    allowed = math.hypot(spread, _NEGLIGIBLE_MEAN)
    off = abs(mean - 1) / allowed
    # One check of all profiles together may be stricter than one for each.
    return check(
        "applied_force_all",
        off,
        2.0,
        f"Total force over applied load, the weighted mean of {len(profiles)} profiles: "
        f"{mean:.4f}, with a standard uncertainty of {allowed:.2g}, in units of which its "
        f"difference from one is counted. {_FORCE}{_BLIND}",
        math.erfc(off / math.sqrt(2)),
    )


#: Messages of a restoration that the measured stress gives itself.
_GIVEN_ONCE = (FAILED_CHECK, FAILED_CALIBRATION, NOISE_UNSTATED)


@reported
@single_threaded()
def measure_stress(
    scan: Scans,
    apparatus: ApparatusFunction | FilePath,
    *,
    noise_record: Scan | FilePath | None = None,
    override: bool = False,
    accept_altered: bool = False,
    progress: Listener = None,  # noqa: ARG001 - @reported
) -> MeasuredStress:
    r"""Turn contact scans into measured stress, load by load.

    .. math:: S_{zz}(r) = (U_{zz} - b - d\,\xi)/A

    with centre, baseline b and drift d from the restored stress (:func:`memscal.restore`), for
    each load of each scan.  Points that were measured at a load somewhat off the nominal one are
    brought to it; the scatter of the loads counts as noise.

    Parameters
    ----------
    scan : Scan or path, or a sequence of them
        Scans with a sphere or a rod; ``normal_load`` states the load of each line.
    apparatus : ApparatusFunction or path
        The calibrated sensor.
    noise_record : Scan or path, optional
        Readings of the sensor at rest (``memscal import --noise-record``), whose noise, in size and
        correlation, the scans' readings have at their times, in place of a stated one.
    override : bool
        Accept a scan whose sensor, channel or film is not the artifact's: it is recorded in
        ``overridden``.
    accept_altered : bool
        Accept files whose content does not fit their digest; recorded like what is overridden.
    progress : callable or True, optional
        Told how many loads are done: :class:`memscal.Progress`.

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
    sensor = opened_apparatus(apparatus, accept_altered=accept_altered)
    scans = opened_scans(scan, accept_altered=accept_altered, noise_record=noise_record)
    restore.require_covariance(sensor)
    overridden = accepted_alterations(sensor.source, *(data.source for data in scans))
    for data in scans:
        overridden += restore.accept_mismatches(data, sensor, override=override)
        require_span(data)
    origins = tuple(map(one_load.measured_scan, scans))
    singles = list(map(restore.single_loads, scans))
    for single in chain(*singles):
        restore.require_contact_size(single)
        if single.u_zz_correlation is not None:
            restore.require_contact_size(
                single,
                MOST_OF_CORRELATED_CONTACT,
                "Their noise is correlated: of each load two matrices over them are kept.",
            )
    loads = _measured_loads(origins, singles, sensor)
    measured = Task("loads", sum(map(len, singles))).counted(loads)
    profiles, restored, notes = zip(*measured, strict=True)
    checks = tuple(stress_checks(profiles, restored))
    return MeasuredStress(
        profiles=profiles,
        scans=origins,
        conversion_constant=sensor.conversion_constant,
        conversion_constant_uncertainty=sensor.parameters.uncertainty("conversion_constant"),
        checks=checks,
        overridden=tuple(overridden),
        process=Process.of_now(
            configuration={"override": overridden},
            messages=tuple(_messages(notes, sensor, checks, overridden)),
        ),
        artifact=sensor.source,
        artifact_digest=sensor.content_digest,
    )


def joined_stress(stresses: Sequence[MeasuredStress]) -> MeasuredStress:
    """Return measured stresses of one apparatus function as one, checks numbered anew."""
    first = stresses[0]
    if len(stresses) == 1:
        return first
    if len({stress.artifact_digest for stress in stresses}) > 1:
        raise InputError(
            "The measured stresses are of different apparatus functions: their digests differ.",
            why="What is compared together shares one sensor and its calibration.",
            cure="Measure all of them with one artifact (memscal apply ARTIFACT SCAN...).",
        )
    profiles: list[MeasuredProfile] = []
    checks = []
    for stress in stresses:
        for own in stress.checks:
            if own.profile:
                number = len(profiles) + int(own.profile)
                checks.append(replace(own, name=f"{own.kind}_{number}"))
        profiles += stress.profiles
    require_different(map(_contents, profiles))
    # The checks, under their new numbers, state what failed.
    messages = []
    for stress in stresses:
        names = ", ".join(scan.source.file_name for scan in stress.scans if scan.source)
        place = names or f"{stress.profiles[0].label} and on"
        others = [message for message in stress.messages if message.kind != FAILED_CHECK]
        messages += [replace(message, text=f"{place}: {message.text}") for message in others]
    return replace(
        first,
        profiles=tuple(profiles),
        scans=tuple(chain(*(stress.scans for stress in stresses))),
        checks=(*checks, check_of_all_forces(profiles)),
        overridden=tuple(chain(*(stress.overridden for stress in stresses))),
        process=replace(first.process, messages=tuple(dict.fromkeys(messages))),
    )


def _contents(profile: MeasuredProfile) -> tuple[str, tuple[bytes, ...]]:
    """Return the name of a profile, and its readings."""
    points = profile.points.get("zz")
    arrays = (points.x, points.y, points.u) if points else (profile.r, profile.s_zz)
    named = profile.label
    if profile.scan.source:
        named = f"{profile.scan.source.file_name}, {named}"
    return f"The profile of {named}", tuple(array.tobytes() for array in arrays)


def _measured_loads(
    origins: Sequence[MeasuredScan], singles: Sequence[Sequence[Scan]], sensor: ApparatusFunction
) -> Iterator[_Measured]:
    for origin, loads in zip(origins, singles, strict=True):
        signals = one_load.contact_signals(loads, sensor)
        for single, signal in zip(loads, signals, strict=True):
            yield _measure(origin, single, sensor, signal)


def _measure(
    origin: MeasuredScan, scan: Scan, sensor: ApparatusFunction, signal: one_load.ContactSignal
) -> _Measured:
    """Return the profile of a scan of one load, with checks and messages of its restoration."""
    one_load.require_points(scan, signal)
    try:
        prepared = one_load.prepared_scan(scan, sensor, signal)
        restored = restore.restore_known(prepared.scan, sensor, start=prepared.estimate)
    except (FitError, InputError) as failure:
        # A scan that is too short fails here already, and in less plain words.
        if scan.y is None:
            top = np.nanargmax(np.nanmedian(scan.u_zz.reshape(-1, scan.x.size), axis=0))
            one_load.require_ends(scan, signal, np.full(2, scan.x[top]))
        raise type(failure)(
            f"{restore.load_of(scan)}: {failure.problem}", why=failure.why, cure=failure.cure
        ) from failure
    one_load.require_ends(scan, signal, restored.centre)
    profile = one_load.measured_profile(origin, scan, prepared.electronic, restored, signal)
    checks = [check for check in restored.checks if check.name != _REPLACED]
    noise = None
    if scan.u_zz_errors is None:
        checks = [check for check in checks if check.name not in _NOISE_CHECKS]
        noise = profile.points["zz"].noise
    return profile, checks, list(_profile_messages(scan, restored, noise))


def _messages(
    notes: Sequence[Sequence[Message]],
    sensor: ApparatusFunction,
    checks: Sequence[QualityCheck],
    overridden: Sequence[str],
) -> Iterator[Message]:
    yield from failed_check_messages(checks)
    yield from override_messages(overridden)
    yield from restore.failed_calibration_messages(sensor)
    # A message that several profiles have in common is given once.
    numbers: dict[Message, list[str]] = {}
    for i, messages in enumerate(notes, start=1):
        for message in messages:
            numbers.setdefault(message, []).append(str(i))
    for message, profiles in numbers.items():
        place = f"Profile {', '.join(profiles)}: " if len(profiles) < len(notes) else ""
        yield replace(message, text=place + message.text)


def _profile_messages(
    scan: Scan, restored: Restoration, noise: FloatArray | None
) -> Iterator[Message]:
    """Yield the messages of one load; ``noise``: where it was estimated, in V."""
    if noise is not None:
        yield restore.noise_unstated_message(scan.reading.text(noise.min()))
    yield from record_messages(scan)
    if scan.normal_load is not None and scan.normal_load_errors is None:
        yield Message(
            "load_errors_unstated",
            "normal_load_errors is absent: the recorded loads are taken as exact.",
        )
    # The first two, scale and gain, a comparison counts.
    others = [n for n in STATED_ERRORS[2:] if getattr(scan, f"{n}_uncertainty")]
    if others:
        names = ", ".join(others).replace("_", " ")
        yield Message(
            "statement_unused",
            f"Uncertainties that the scan states count in a calibration only: {names}.",
        )
    if not scan.lubrication:
        yield Message("lubrication_unstated", "The scan does not state its lubrication.")
    for message in restored.messages:
        if message.kind not in _GIVEN_ONCE:
            yield message
