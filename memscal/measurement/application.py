"""Contact scans and a calibrated sensor to measured stress: the entry point."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from os import PathLike

import numpy as np

from memscal.apparatus import ApparatusFunction, load_apparatus
from memscal.errors import FitError, InputError
from memscal.measurement.belonging import accept_mismatches
from memscal.measurement.contact_signal import ContactSignal, contact_signal
from memscal.measurement.measured_stress import MeasuredProfile, MeasuredStress
from memscal.measurement.prepared_scan import PreparedScan, prepared_scan
from memscal.measurement.procedure import restore_known
from memscal.measurement.requirements import require_covariance
from memscal.measurement.single_loads import SingleLoad, place_of, single_loads
from memscal.measurement.single_profile import measured_profile
from memscal.measurement.stress_checks import stress_checks
from memscal.measurement.usable_scan import require_ends, require_points
from memscal.model.apparatus import QualityCheck
from memscal.model.provenance import SourceFile
from memscal.model.scan import Scan
from memscal.threads import single_threaded

__all__ = ["measure_stress"]


@single_threaded()
def measure_stress(
    scan: Scan | Sequence[Scan],
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
    scan : Scan or sequence of Scan
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
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1), method="evidence").apparatus
    >>> measured = memscal.measure_stress(memscal.simulate(seed=2), apparatus)
    >>> [profile] = measured.profiles
    >>> abs(profile.force - profile.load) < 3 * profile.force_uncertainty
    True
    """
    known, artifact = _opened(apparatus)
    scans = (scan,) if isinstance(scan, Scan) else tuple(scan)
    _require_scans(scans)
    require_covariance(known)
    overridden = tuple(
        text
        for one in scans
        for text in accept_mismatches(one, known, place_of(one), override=override)
    )
    parts = [single_loads(one) for one in scans]
    profiles = tuple(_measure(part, known) for of_scan in parts for part in of_scan)
    checks = stress_checks(profiles)
    return MeasuredStress(
        profiles=profiles,
        apparatus=known,
        scans=scans,
        checks=checks,
        messages=tuple(_messages(profiles, known, checks, overridden)),
        overridden=overridden,
        configuration={"override": bool(override)},
        artifact=artifact,
        parts=tuple(len(of_scan) for of_scan in parts),
    )


def _opened(
    apparatus: ApparatusFunction | str | PathLike[str],
) -> tuple[ApparatusFunction, SourceFile | None]:
    if isinstance(apparatus, ApparatusFunction):
        return apparatus, None
    from memscal.formats.hdf5_reader import open_hdf5

    known = load_apparatus(apparatus)
    with open_hdf5(apparatus) as file:
        return known, file.source


def _require_scans(scans: tuple[Scan, ...]) -> None:
    if not scans:
        raise InputError("There is no scan.", cure="Give a scan, or several.")
    for one in scans:
        if not isinstance(one, Scan):
            raise InputError(
                f"measure_stress() was given a {type(one).__name__}, not a Scan.",
                cure="Read a scan file with memscal.read_scan(path).",
            )


def _measure(part: SingleLoad, known: ApparatusFunction) -> MeasuredProfile:
    signal = contact_signal(part, known)
    require_points(part, signal)
    prepared = _prepared(part, known, signal)
    try:
        found = restore_known(prepared.scan, known)
    except (FitError, InputError) as failure:
        raise _placed(failure, part) from failure
    require_ends(part, signal, found.centre)
    return measured_profile(part, prepared, found, signal)


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
    profiles: Sequence[MeasuredProfile],
    known: ApparatusFunction,
    checks: Sequence[QualityCheck],
    overridden: Sequence[str],
) -> Iterator[str]:
    """Yield what a user should know, the gravest first."""
    for one in checks:
        if not one.passed:
            yield (
                f"Quality check {one.name} failed: {one.value:.3g} exceeds {one.limit:.3g}. "
                f"{one.meaning}"
            )
    for text in overridden:
        yield f"Overridden: {text}."
    if not known.passed:
        yield "A quality check of the calibration itself had failed: see its artifact."
    # What is true of every profile is said once.
    said: dict[str, list[str]] = {}
    for i, profile in enumerate(profiles):
        for text in _of_profile(profile):
            said.setdefault(text, []).append(str(i + 1))
    for text, where in said.items():
        yield text if len(where) == len(profiles) else f"Profile {', '.join(where)}: {text}"


def _of_profile(profile: MeasuredProfile) -> Iterator[str]:
    found, scan = profile.restoration, profile.part.scan
    if profile.noise_found:
        noise = float(np.nanmin(profile.electronic_noise)) * 1e3
        yield f"u_zz_errors is absent: a noise of {noise:.3g} mV was estimated from the scatter."
    if scan.normal_load is not None and scan.normal_load_errors is None:
        yield "normal_load_errors is absent: the recorded loads are taken as exact."
    if not scan.lubrication:
        yield "The scan does not state its lubrication."
    for text in found.messages:
        if not text.startswith(("Quality check", "u_zz_errors", "A quality check of the cal")):
            yield text
