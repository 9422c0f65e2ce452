"""From contact scans and a calibrated sensor to the friction that explains what it measured."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import permutations
from os import PathLike
from typing import Any, TypeAlias

import numpy as np

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.errors import InputError
from memscal.estimation.points import TANGENTIAL, measured_mask
from memscal.estimation.set_up import accepted_differences
from memscal.extensions import hook
from memscal.formats.cache import CacheFolder
from memscal.formats.opened import Contacts, opened_contacts, opened_stress
from memscal.friction import effective
from memscal.friction.calculated import FRICTIONS, amontons_family, external_family
from memscal.friction.checks import (
    comparison_checks,
    comparison_messages,
    frictionless_check,
    synthetic_messages,
)
from memscal.friction.family import ProfileFamily
from memscal.friction.likelihood import Channel, load_points, require_line, sensor_of
from memscal.friction.results import (
    BoundedEstimate,
    DryAgainstLubricated,
    FrictionComparison,
    LoadComparison,
    ShearComparison,
)
from memscal.measurement.measure_stress import joined_stress, measure_stress
from memscal.measurement.posterior import common_inputs
from memscal.measurement.restore import accept_other_sensor, load_of, single_loads
from memscal.model.arrays import require_non_negative
from memscal.model.checks import Message, override_messages
from memscal.model.indenter import Sphere
from memscal.model.measured_stress import MeasuredScan, MeasuredStress
from memscal.model.provenance import accepted_alterations
from memscal.model.scan import Scan
from memscal.model.sizes import MOST_COMPARED, MOST_COMPARED_TOGETHER, too_large
from memscal.model.stress import StressProfile
from memscal.parallel import single_threaded
from memscal.progress import Listener, reported


def scans_of(contacts: Sequence[Scan | MeasuredStress]) -> list[Scan | MeasuredScan]:
    """Return the scans, and those of which a stress was measured."""
    of_items = (item.scans if isinstance(item, MeasuredStress) else (item,) for item in contacts)
    return [scan for scans in of_items for scan in scans]


def require_contacts(scans: Sequence[Scan | MeasuredScan]) -> None:
    """Refuse what is no scan of a sphere's contacts, or not all on one film with one sphere."""
    for scan in scans:
        place = scan.source.file_name if scan.source else "The scan"
        if not isinstance(scan.indenter, Sphere):
            raise InputError(
                f"{place} was made with a rod, not with a sphere."
                if scan.indenter
                else f"{place} states no sphere (/entry/indenter).",
                why="The stress under a rod barely depends on friction, and its contact does not "
                "grow: a rod scan calibrates a sensor.",
                cure="Give the scans of a sphere's contacts; calibrate with the rod scan.",
            )
        if isinstance(scan, Scan) and scan.y is not None:
            require_line(place, scan.x, scan.y)
        if (scan.film, scan.indenter) != (scans[0].film, scans[0].indenter):
            problem = f"{place} states another film or sphere than the first scan."
            why = "Scans that are compared together share the calculated contacts."
            cure = "Compare them one by one, or correct /entry/sample/film and /entry/indenter."
            raise InputError(problem, why=why, cure=cure)


def same_apparatus(
    measured: MeasuredStress, apparatus: ApparatusFunction, *, override: bool
) -> MeasuredStress:
    """Refuse another apparatus function than that of a measured stress; or record it."""
    altered = accepted_alterations(apparatus.source)
    other = []
    if measured.artifact_digest != apparatus.content_digest:
        name = f" ({measured.artifact.file_name})" if measured.artifact else ""
        given = f" ({apparatus.source.file_name})" if apparatus.source else ""
        other = [
            f"the stress was measured with another apparatus function{name} than the given{given}"
        ]
    if not altered and not other:
        return measured
    differences = accepted_differences(
        other,
        override=override,
        problem="Measured stress and artifact do not belong together",
        why="The stress on the axis, centres and noise are those of the calibration by which "
        "they were measured.",
        cure="Give its artifact, or measure again with memscal apply.",
    )
    differences = [*altered, *differences]
    messages = (*measured.messages, *override_messages(differences))
    return replace(
        measured,
        overridden=(*measured.overridden, *differences),
        process=replace(measured.process, messages=messages),
    )


def require_macroscopic(value: float | None, uncertainty: float | None, *, interface: bool) -> None:
    """Refuse a macroscopic coefficient that is none, or is asked for and not given."""
    if value is not None:
        require_non_negative("macroscopic friction coefficient", value)
    if uncertainty is not None:
        require_non_negative("uncertainty of the macroscopic coefficient", uncertainty)
    if value is None and (interface or uncertainty is not None):
        raise InputError(
            "The macroscopic friction coefficient is not given.",
            why="Laws of the interface are weighed at it."
            if interface
            else "Its uncertainty has no use without it.",
            cure="Give macroscopic, such as from a measurement of sliding.",
        )


FRICTIONLESS = "frictionless"
APART = "apart"
"""How lubricated loads are fitted: with no friction beside the others, or by themselves."""

Tangential: TypeAlias = tuple[ApparatusFunction, Mapping[str, ProfileFamily], Sequence[Message]]
"""A tangential channel, families of the shear by loading, and what to say of it."""

#: Calculated stresses reach this multiple of a scan's width.
_REACH = 1.5
_MM = 1e-3


@reported
@single_threaded()
def compare(
    contacts: Contacts,
    apparatus: ApparatusFunction | str | PathLike[str],
    *,
    friction: Sequence[float] | None = None,
    loading: str | Sequence[str] = ("incremental", "total"),
    references: Sequence[StressProfile] | None = None,
    lubricated: str | None = None,
    shear: ApparatusFunction | str | PathLike[str] | None = None,
    macroscopic: float | None = None,
    macroscopic_uncertainty: float | None = None,
    interface: bool = False,
    override: bool = False,
    accept_altered: bool = False,
    cache: CacheFolder = None,
    workers: int = 1,
    progress: Listener = None,  # noqa: ARG001 - @reported
) -> FrictionComparison:
    r"""Hold measured stress against calculated contacts, and find the friction that explains it.

    The calculated base stress of a sphere on the film is convolved with the sensor's G, and the
    voltages are compared with it: :math:`U = A\,(G \otimes \sigma_\mu)` with centre, baseline and
    drift of each load free, and with the uncertainties of A G, film, sphere, loads and positions
    in the likelihood.  The effective friction coefficient is the most likely one; its
    interval is what the profile likelihood does not exclude, and has no upper end where the
    stress tells no large coefficient from another.

    Parameters
    ----------
    contacts : Scan, MeasuredStress or path, or a sequence of them
        Contact scans of a sphere at one load or several, dry or lubricated, on one film with one
        sphere; or the stress that was measured of them, which holds their points.
    apparatus : ApparatusFunction or path
        The calibrated sensor; of a measured stress the one by which it was measured.
    friction : sequence of float, optional
        Friction coefficients of the calculated profiles, increasing; the last may be ``inf``.
    loading : str or sequence of str
        ``"incremental"``, ``"total"``, or both: see :func:`memscal.indent`.
    references : sequence of StressProfile, optional
        Profiles that were calculated elsewhere, in place of ours: each with its load and friction
        coefficient.  ``friction`` and ``loading`` are theirs then.
    lubricated : str, optional
        ``"frictionless"``: lubricated loads have no friction, and are fitted together with the dry
        ones, which cancels most of what A, G and film leave uncertain; ``"apart"``: each kind by
        itself.  By default together unless the check ``lubricated_frictionless`` fails.
    shear : ApparatusFunction or path, optional
        The tangential channel of the same sensor (experimental, see :func:`compare_shear`): the
        coefficients of all loads together are then those of both channels together, which share
        the errors of film, contacts and calibration.  All scans hold its voltage.
    macroscopic, macroscopic_uncertainty : float, optional
        A friction coefficient that was measured otherwise, and its standard uncertainty.
    interface : bool
        Whether to weigh laws of the interface against effective friction, at the macroscopic
        coefficient.
    override : bool
        Whether to accept an artifact of another sensor or film; that is recorded.
    accept_altered : bool
        Accept files whose content does not fit their digest; recorded like what is overridden.
    cache : path, optional
        A folder in which calculated contacts are kept; without it nothing is written.
    workers : int
        Processes that calculate contacts.
    progress : callable or True, optional
        Told how many loads are measured and contacts calculated: :class:`memscal.Progress`.

    Returns
    -------
    FrictionComparison
        Its checks may have failed: see ``.passed``.

    Raises
    ------
    InputError
        If a scan is not a sphere's or is over a plane, scans differ in film or sphere, artifact and
        scan do not belong together, or there are too many readings (25,000; 500 of one load that
        share noise, by a correlation or with the shear).
    FitError
        If a load determines no stress.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(
    ...     friction=0.1, loads=[0.69], lubricated_loads=[0.69], seed=1
    ... )
    >>> apparatus = memscal.calibrate(made.rod, method="bayesian").apparatus
    >>> comparison = compare(made.dry, apparatus, friction=(0, 0.1, 0.3, math.inf), loading="total")
    >>> comparison.joint["dry"]["total"].interval.low < 0.1
    True
    """
    opened = opened_contacts(contacts, accept_altered=accept_altered)
    sensor = opened_apparatus(apparatus, accept_altered=accept_altered)
    require_macroscopic(macroscopic, macroscopic_uncertainty, interface=interface)
    if lubricated not in (None, FRICTIONLESS, APART):
        problem = f"Lubricated loads cannot be fitted {lubricated!r}."
        raise InputError(problem, cure=f"Give {FRICTIONLESS!r} or {APART!r}, or leave it out.")
    require_contacts(scans_of(opened))
    of_shear = None if shear is None else opened_apparatus(shear, accept_altered=accept_altered)
    _require_few(opened, "zz", *([of_shear.sensor.channel] if of_shear else []))
    measured = _measured(opened, sensor, override)
    setting = _setting(measured, cache, workers)
    tangential = None
    if of_shear is not None:
        if references is not None:
            problem = "Profiles of another program and the shear are asked for."
            raise InputError(problem, cure="Leave one of them out: those profiles have no shear.")
        notes = _accept_tangential(measured, of_shear, override=override)
        sheared = _families(setting, friction, loading, order=1)
        tangential = of_shear, sheared, notes
    if references is None:
        families = _families(setting, friction, loading)
    else:
        family = external_family(references, **setting)
        families = {family.loading: family}
    sliding = None if macroscopic is None else (macroscopic, macroscopic_uncertainty)
    comparison = compare_measured(
        measured, sensor, families, lubricated=lubricated, shear=tangential, macroscopic=sliding
    )
    altered = accepted_alterations(*(profile.source for profile in references or ()))
    messages = (*override_messages(altered), *comparison.messages)
    comparison = replace(comparison, messages=messages)
    if not interface:
        return comparison
    assert macroscopic is not None
    laws = hook("compare_interface")(
        measured.profiles,
        sensor,
        macroscopic=macroscopic,
        macroscopic_uncertainty=macroscopic_uncertainty,
        amontons=families.get("incremental") if references is None else None,
        cache=cache,
        workers=workers,
    )
    return replace(comparison, interface=laws, messages=(*comparison.messages, *laws.messages))


def _readings(
    item: Scan | MeasuredStress, channels: Sequence[str]
) -> Iterator[tuple[str, int, bool]]:
    """Yield the name of each load, its readings of channels, and whether these share noise."""
    if isinstance(item, Scan):
        for one in single_loads(item):
            shared = len(channels) > 1 or one.u_zz_correlation is not None
            yield load_of(one), len(channels) * int(measured_mask(one).sum()), shared
        return
    for profile in item.profiles:
        points = [profile.points[channel] for channel in channels if channel in profile.points]
        shared = len(points) > 1 or any(of.correlation is not None for of in points)
        yield profile.label, sum(of.u.size for of in points), shared


def _require_few(contacts: Sequence[Scan | MeasuredStress], *channels: str) -> None:
    """Refuse more readings of the channels than are compared."""
    loads = [load for item in contacts for load in _readings(item, channels)]
    for name, size, shared in loads:
        if shared and size > MOST_COMPARED_TOGETHER:
            of = "readings that share noise (a correlation, or two channels)"
            why = "A matrix over them is held in memory for each friction coefficient."
            cure = "Average neighbouring readings, or compare without correlation and shear."
            raise too_large(name, size, MOST_COMPARED_TOGETHER, of, why=why, cure=cure)
    if (total := sum(size for _, size, _ in loads)) > MOST_COMPARED:
        what = "What is compared"
        why = "Columns over them are held for each friction coefficient."
        cure = "Average neighbouring readings, or leave out repeats."
        raise too_large(what, total, MOST_COMPARED, "readings", why=why, cure=cure)


def _measured(
    contacts: Sequence[Scan | MeasuredStress], apparatus: ApparatusFunction, override: bool
) -> MeasuredStress:
    scans = [item for item in contacts if isinstance(item, Scan)]
    if len(scans) == len(contacts):
        return measure_stress(scans, apparatus, override=override)
    stresses = []
    for item in contacts:
        if isinstance(item, Scan):
            stresses.append(measure_stress(item, apparatus, override=override))
            continue
        for profile in item.profiles:
            load_points(profile)  # refuses a file without points before anything is calculated
        stresses.append(same_apparatus(item, apparatus, override=override))
    return joined_stress(stresses)


def compare_measured(
    measured: MeasuredStress,
    apparatus: ApparatusFunction,
    families: Mapping[str, ProfileFamily],
    *,
    lubricated: str | None = None,
    shear: Tangential | None = None,
    macroscopic: tuple[float, float | None] | None = None,
) -> FrictionComparison:
    """Compare measured stress with families by loading, which hold every measured load."""
    confronted = _confronted(measured, _channels(measured, apparatus, families))
    together = confronted
    if shear is not None:
        common = common_inputs(apparatus, shear[0])
        both = (apparatus, families), shear[:2]
        together = _confronted(measured, *(_channels(measured, *one, common) for one in both))
    loads = {
        name: tuple(
            effective.load_comparison(p, of_family, i) for i, p in enumerate(measured.profiles)
        )
        for name, of_family in confronted.items()
    }
    loads, joint = _loading_counted(loads, _joint(measured, together, lubricated))
    stated = measured.noise_stated
    checks = (*measured.checks, *comparison_checks(loads, joint, noise_stated=stated))
    return FrictionComparison(
        measured=measured,
        friction=next(iter(families.values())).values,
        loads=loads,
        joint=joint,
        dry_against_lubricated=_pairs(measured, next(iter(confronted.values()))),
        macroscopic=macroscopic,
        checks=checks,
        messages=(
            *comparison_messages(measured, families, joint, checks, macroscopic),
            *(() if shear is None else shear[2]),
        ),
        shear=None if shear is None else shear[0],
    )


def _setting(measured: MeasuredStress, cache: CacheFolder, workers: int) -> dict[str, Any]:
    """Return film, sphere, loads and reach (whole millimetres) of the contacts to calculate."""
    scan = measured.scans[0]
    reach = math.ceil(_REACH * max(scan.width for scan in measured.scans) / _MM) * _MM
    contacts = {"film": scan.film, "indenter": scan.indenter, "loads": np.unique(measured.loads)}
    return {**contacts, "reach": reach, "cache": cache, "workers": workers}


def _families(
    setting: Mapping[str, Any],
    friction: Sequence[float] | None,
    loading: str | Sequence[str],
    order: int = 0,
) -> dict[str, ProfileFamily]:
    values = FRICTIONS if friction is None else tuple(float(mu) for mu in friction)
    if len(values) < 2:
        problem = "One friction coefficient is nothing to choose from."
        raise InputError(problem, cure="Give several, such as 0, 0.1, 0.3 and infinity.")
    loadings = (loading,) if isinstance(loading, str) else tuple(dict.fromkeys(loading))
    if not loadings:
        raise InputError('No loading was given: "incremental", "total", or both.')
    return {
        name: amontons_family(friction=values, loading=name, order=order, **setting)
        for name in loadings
    }


def _channels(
    measured: MeasuredStress,
    apparatus: ApparatusFunction,
    families: Mapping[str, ProfileFamily],
    common: Sequence[str] = (),
) -> dict[str, Channel]:
    points = [load_points(profile, apparatus.sensor.channel) for profile in measured.profiles]
    reach = float(max(of_load.radius.max() for of_load in points))
    return {
        name: Channel(points, sensor_of(apparatus, family, reach, measured.scans, common), family)
        for name, family in families.items()
    }


def _confronted(
    measured: MeasuredStress,
    channels: Mapping[str, Channel],
    shear: Mapping[str, Channel] | None = None,
) -> dict[str, effective.Confrontation]:
    """Hold the loads against each family, by one channel or by two."""
    loads = [profile.load for profile in measured.profiles]
    return {
        name: effective.confront(
            one.family,
            one.sensor,
            one.points,
            [int(np.abs(one.family.loads - load).argmin()) for load in loads],
            None if shear is None else shear[name],
        )
        for name, one in channels.items()
    }


def _joint(
    measured: MeasuredStress,
    confronted: Mapping[str, effective.Confrontation],
    lubricated: str | None = APART,
) -> dict[str, dict[str, BoundedEstimate]]:
    """Fit all loads of a kind; the lubricated ones beside the others, if they have no friction."""
    by_lubrication: dict[str, list[int]] = {}
    for i, profile in enumerate(measured.profiles):
        by_lubrication.setdefault(profile.lubrication, []).append(i)
    held = by_lubrication.get("lubricated", [])
    joint = {
        lubrication: {name: of_all.effective(indices) for name, of_all in confronted.items()}
        for lubrication, indices in by_lubrication.items()
    }
    if not held or lubricated == APART or next(iter(confronted.values())).family.values[0] > 0:
        return joint
    if lubricated is None and not frictionless_check(joint["lubricated"]).passed:
        return joint
    for lubrication, indices in by_lubrication.items():
        if lubrication != "lubricated":
            joint[lubrication] = {
                name: replace(of_all.effective(indices, held), beside=len(held))
                for name, of_all in confronted.items()
            }
    return joint


def _loading_counted(
    loads: Mapping[str, tuple[LoadComparison, ...]],
    joint: Mapping[str, Mapping[str, BoundedEstimate]],
) -> tuple[dict[str, tuple[LoadComparison, ...]], dict[str, dict[str, BoundedEstimate]]]:
    """Add to every budget what the other definition of the loading would have given."""
    counted = dict(loads)
    together = {kind: dict(by) for kind, by in joint.items()}
    for name, other in permutations(loads, 2):
        counted[name] = tuple(
            replace(
                mine,
                by_maximum=effective.with_loading(mine.by_maximum, theirs.by_maximum),
                by_profile=effective.with_loading(mine.by_profile, theirs.by_profile),
            )
            for mine, theirs in zip(loads[name], loads[other], strict=True)
        )
        for kind, by in joint.items():
            together[kind][name] = effective.with_loading(by[name], by[other])
    return counted, together


def _pairs(
    measured: MeasuredStress, confronted: effective.Confrontation
) -> tuple[DryAgainstLubricated, ...]:
    frictionless = confronted.family.at(confronted.family.values[:1])
    pairs = (
        effective.dry_against_lubricated(
            (measured.profiles[i], measured.profiles[j]),
            (confronted.points[i], confronted.points[j]),
            confronted.sensor,
            frictionless,
            (confronted.loads[i], confronted.loads[j]),
            measured.conversion_constant_uncertainty / measured.conversion_constant,
        )
        for i, j in effective.lubricated_pairs(measured.profiles)
    )
    return tuple(pair for pair in pairs if pair is not None)


@reported
@single_threaded()
def compare_shear(
    measured: MeasuredStress | str | PathLike[str],
    apparatus: ApparatusFunction | str | PathLike[str],
    *,
    friction: Sequence[float] = FRICTIONS,
    loading: str | Sequence[str] = ("incremental", "total"),
    override: bool = False,
    accept_altered: bool = False,
    cache: CacheFolder = None,
    workers: int = 1,
    progress: Listener = None,  # noqa: ARG001 - @reported
) -> ShearComparison:
    r"""Find the friction that explains a tangential channel's voltage under a sphere.

    Experimental: tested on synthetic scans only.  For each load,
    :math:`U_{xz} = A_{xz}\,(G_{xz} \otimes \tau_\mu)(R)\cos\theta` with baseline, drift and centre
    free, and with the uncertainties of A G, film, sphere, loads and positions.

    Parameters
    ----------
    measured : MeasuredStress or path
        From :func:`memscal.measure_stress`, of scans that hold ``u_xz`` and ``u_xz_errors`` beside
        ``u_zz`` (``u_yz`` of a line along y).
    apparatus : ApparatusFunction or path
        The tangential channel of the same sensor, from ``memscal.calibrate(..., channel="xz")``.
    friction : sequence of float
        Friction coefficients between which to interpolate; the last may be ``inf``.
    loading : str or sequence of str
        ``"incremental"``, ``"total"``, or both.
    override, accept_altered, cache, workers, progress
        As of :func:`memscal.compare`.

    Returns
    -------
    ShearComparison

    Raises
    ------
    InputError
        If the artifact is of no tangential channel, or of another sensor or film, if a scan is not
        a sphere's, or if it holds no voltage of the channel with its noise.

    Examples
    --------
    >>> import math, memscal
    >>> shear = (memscal.GaussianMixture(), 5e-8)  # G and A of the tangential channel
    >>> made = memscal.simulate_experiment(
    ...     friction=0.1, loads=[1.37], lubricated_loads=[1.37], shear=shear, seed=1
    ... )
    >>> normal, shear = (
    ...     memscal.calibrate(made.rod, channel=channel, method="bayesian").apparatus
    ...     for channel in ("zz", "xz")
    ... )
    >>> measured = memscal.measure_stress(made.dry, normal)
    >>> comparison = compare_shear(
    ...     measured, shear, friction=(0, 0.1, 0.3, math.inf), loading="total"
    ... )
    >>> comparison.joint["dry"]["total"].interval.low < 0.15
    True
    """
    sensor = opened_apparatus(apparatus, accept_altered=accept_altered)
    measured = opened_stress(measured, accept_altered=accept_altered)
    require_contacts(measured.scans)
    _require_few([measured], sensor.sensor.channel)
    notes = _accept_tangential(measured, sensor, override=override)
    families = _families(_setting(measured, cache, workers), friction, loading, order=1)
    confronted = _confronted(measured, _channels(measured, sensor, families))
    return ShearComparison(
        measured=measured,
        apparatus=sensor,
        friction=next(iter(families.values())).values,
        loads={
            name: tuple(of_family.effective([i]) for i in range(len(measured.profiles)))
            for name, of_family in confronted.items()
        },
        joint=_joint(measured, confronted),
        messages=(
            *override_messages(measured.overridden),
            *notes,
            *synthetic_messages(measured),
        ),
    )


def _accept_tangential(
    measured: MeasuredStress, sensor: ApparatusFunction, *, override: bool
) -> list[Message]:
    """Refuse what is no tangential channel of the sensor of a measured stress; say what it is."""
    channel = sensor.sensor.channel
    if channel not in TANGENTIAL:
        raise InputError(
            f"The artifact is of channel {channel}, not of a tangential one.",
            cure='Give the artifact of memscal.calibrate(scan, channel="xz", method="bayesian"); '
            "compare the normal channel with memscal.compare().",
        )
    for profile in measured.profiles:
        load_points(profile, channel)  # refuses a scan without it before anything is calculated
    overridden = [
        *accepted_alterations(sensor.source),
        *accept_other_sensor(measured.scans[0], sensor, ("name",), override=override),
    ]
    note = f"Channel {channel} is experimental: comparisons were tested on synthetic scans only."
    return [*override_messages(overridden), Message("experimental", note)]
