"""From contact scans and a calibrated sensor to the friction that explains what it measured."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from os import PathLike

import numpy as np

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.errors import InputError
from memscal.estimation.points import TANGENTIAL
from memscal.formats.opened import Contacts, opened_contacts, opened_stress
from memscal.friction.calculated import FRICTIONS, amontons_family
from memscal.friction.checks import SYNTHETIC_SCANS, comparison_checks, comparison_messages
from memscal.friction.effective import Confrontation, confront, load_comparison, with_loading
from memscal.friction.external import external_family
from memscal.friction.family import ProfileFamily
from memscal.friction.lubrication import dry_against_lubricated, lubricated_pairs
from memscal.friction.model_comparison import compare_interface
from memscal.friction.paths import CacheFolder, require_sphere
from memscal.friction.prediction import LoadPoints, load_points, members_of, sensor_of
from memscal.friction.results import (
    DryAgainstLubricated,
    EffectiveFriction,
    FrictionComparison,
    LoadComparison,
)
from memscal.measurement.measure_stress import joined_stress, measure_stress
from memscal.model.arrays import FloatArray, require_non_negative
from memscal.model.checks import Message
from memscal.model.indenter import Sphere
from memscal.model.measured_stress import MeasuredScan, MeasuredStress
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.parallel import single_threaded

__all__ = [
    "ShearComparison",
    "compare",
    "compare_measured",
    "compare_shear",
    "require_contacts",
    "require_macroscopic",
    "same_apparatus",
    "scans_of",
]


def scans_of(contacts: Sequence[Scan | MeasuredStress]) -> list[Scan | MeasuredScan]:
    """Return the scans, and those of which a stress was measured."""
    return [
        scan
        for item in contacts
        for scan in (item.scans if isinstance(item, MeasuredStress) else (item,))
    ]


def require_contacts(scans: Sequence[Scan | MeasuredScan]) -> None:
    """Refuse what is no scan of a sphere's contacts, or not all on one film with one sphere."""
    for one in scans:
        place = one.source.file_name if one.source else "The scan"
        if not isinstance(one.indenter, Sphere):
            raise InputError(
                f"{place} was made with a {one.indenter.shape}, not with a sphere.",
                why="The stress under a rod barely depends on friction, and its contact does not "
                "grow: a rod scan calibrates a sensor.",
                cure="Give the scans of a sphere's contacts; calibrate with the rod scan.",
            )
        if (one.film, one.indenter) != (scans[0].film, scans[0].indenter):
            raise InputError(
                f"{place} states another film or sphere than the first scan.",
                why="Scans that are compared together share the calculated contacts.",
                cure="Compare them one by one, or correct /entry/sample/film and /entry/indenter.",
            )


def same_apparatus(
    measured: MeasuredStress, apparatus: ApparatusFunction, *, override: bool
) -> MeasuredStress:
    """Refuse another apparatus function than that of a measured stress; or record it.

    Raises
    ------
    InputError
        If their content digests differ and ``override`` is false.
    """
    if measured.artifact_digest == apparatus.content_digest:
        return measured
    name = f" ({measured.artifact.file_name})" if measured.artifact else ""
    other = f" ({apparatus.source.file_name})" if apparatus.source else ""
    text = f"the stress was measured with another apparatus function{name} than the given{other}"
    if not override:
        raise InputError(
            f"{text[0].upper()}{text[1:]}: their content digests differ.",
            why="The stress on the axis, centres and noise are those of the calibration by which "
            "they were measured.",
            cure="Give its artifact, or measure again with memscal apply. To go on all the same, "
            "override it (override=True; --override on the command line): that is recorded.",
        )
    told = Message("overridden", f"Overridden: {text}.", "warning")
    messages = (*measured.messages, told)
    return replace(
        measured,
        overridden=(*measured.overridden, text),
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
            else "Its uncertainty alone says nothing.",
            cure="Give macroscopic, such as from a measurement of sliding.",
        )


#: Calculated stresses reach this multiple of a scan's width.
_REACH = 1.5
_MM = 1e-3


@single_threaded()
def compare(
    contacts: Contacts,
    apparatus: ApparatusFunction | str | PathLike[str],
    *,
    friction: Sequence[float] | None = None,
    loading: str | Sequence[str] = ("incremental", "total"),
    references: Sequence[StressProfile] | None = None,
    macroscopic: float | None = None,
    macroscopic_uncertainty: float | None = None,
    interface: bool = False,
    override: bool = False,
    cache: CacheFolder = None,
    workers: int = 1,
) -> FrictionComparison:
    r"""Hold measured stress against calculated contacts, and find the friction that explains it.

    The calculated base stress of a sphere on the film is convolved with the sensor's G, and the
    voltages are held against it: :math:`U = A\,(G \otimes \sigma_\mu)` with centre, baseline and
    drift of each load free, and with the uncertainties of A G, film, sphere, loads and positions
    in the likelihood.  The effective friction coefficient is that of least chi-square; its
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
    macroscopic, macroscopic_uncertainty : float, optional
        A friction coefficient that was measured otherwise, and its standard uncertainty.
    interface : bool
        Whether to weigh laws of the interface against effective friction, at the macroscopic
        coefficient.
    override : bool
        Whether to accept an artifact of another sensor or film; that is recorded.
    cache : path, optional
        A folder in which calculated contacts are kept; without it nothing is written.
    workers : int
        Processes that calculate contacts; more than one needs a script's ``__main__`` guard.

    Returns
    -------
    FrictionComparison
        Its checks may have failed: see ``.passed``.

    Raises
    ------
    InputError
        If a scan is not a sphere's, scans differ in film or sphere, or artifact and scan do not
        belong together.
    FitError
        If a load determines no stress.

    Examples
    --------
    >>> import memscal
    >>> made = memscal.simulate_experiment(
    ...     friction=0.1, loads=[0.69], lubricated_loads=[0.69], seed=1
    ... )
    >>> apparatus = memscal.calibrate(made.rod, method="evidence").apparatus
    >>> found = compare(made.dry, apparatus, friction=(0, 0.1, 0.3, math.inf), loading="total")
    >>> found.joint["dry"]["total"].interval.low < 0.1
    True
    """
    opened, known = opened_contacts(contacts), opened_apparatus(apparatus)
    require_macroscopic(macroscopic, macroscopic_uncertainty, interface=interface)
    measured = _measured(opened, known, override)
    loadings = (loading,) if isinstance(loading, str) else tuple(loading)
    families = _families(measured, friction, loadings, references, cache, workers)
    given = None if macroscopic is None else (macroscopic, macroscopic_uncertainty)
    found = compare_measured(measured, known, families, macroscopic=given)
    if not interface:
        return found
    assert macroscopic is not None
    laws = compare_interface(
        measured.profiles,
        known,
        macroscopic=macroscopic,
        macroscopic_uncertainty=macroscopic_uncertainty,
        amontons=families.get("incremental") if references is None else None,
        cache=cache,
        workers=workers,
    )
    return replace(found, interface=laws, messages=(*found.messages, *laws.messages))


def _measured(
    contacts: Sequence[Scan | MeasuredStress], apparatus: ApparatusFunction, override: bool
) -> MeasuredStress:
    """Return the stress of all contacts, measured here where it was not before."""
    require_contacts(scans_of(contacts))
    scans = [item for item in contacts if isinstance(item, Scan)]
    if len(scans) == len(contacts):
        return measure_stress(scans, apparatus, override=override)
    parts = []
    for item in contacts:
        if isinstance(item, Scan):
            parts.append(measure_stress(item, apparatus, override=override))
            continue
        for profile in item.profiles:
            load_points(profile)  # refuses a file without points before anything is calculated
        parts.append(same_apparatus(item, apparatus, override=override))
    return joined_stress(parts)


def compare_measured(
    measured: MeasuredStress,
    apparatus: ApparatusFunction,
    families: Mapping[str, ProfileFamily],
    *,
    macroscopic: tuple[float, float | None] | None = None,
) -> FrictionComparison:
    """Compare measured stress with families that were calculated, by definition of the loading.

    Parameters are those of :func:`compare`; the families' loads hold every measured one.
    """
    points = [load_points(profile) for profile in measured.profiles]
    confronted = {
        name: _confronted(measured, apparatus, family, points) for name, family in families.items()
    }
    loads = {
        name: tuple(load_comparison(p, one, i) for i, p in enumerate(measured.profiles))
        for name, one in confronted.items()
    }
    joint = _joint(measured, confronted)
    loads, joint = _loading_counted(loads, joint)
    checks = (*measured.checks, *comparison_checks(loads, joint))
    return FrictionComparison(
        measured=measured,
        friction=next(iter(families.values())).values,
        loads=loads,
        joint=joint,
        dry_against_lubricated=_pairs(measured, next(iter(confronted.values()))),
        macroscopic=macroscopic,
        checks=checks,
        messages=comparison_messages(measured, families, joint, checks, macroscopic),
    )


def _families(
    measured: MeasuredStress,
    friction: Sequence[float] | None,
    loadings: Sequence[str],
    references: Sequence[StressProfile] | None,
    cache: CacheFolder,
    workers: int,
) -> dict[str, ProfileFamily]:
    """Return the calculated profiles at every load that was measured, by loading."""
    scan = measured.scans[0]
    loads = np.unique(measured.loads)
    # In whole millimetres.
    reach = math.ceil(_REACH * max(one.width for one in measured.scans) / _MM) * _MM
    assert isinstance(scan.indenter, Sphere)
    if references is not None:
        given = external_family(
            references,
            loads,
            reach=reach,
            film=scan.film,
            indenter=scan.indenter,
            cache=cache,
            workers=workers,
        )
        return {given.loading: given}
    values = FRICTIONS if friction is None else tuple(float(mu) for mu in friction)
    if len(values) < 2:
        raise InputError(
            "One friction coefficient is nothing to choose from.",
            cure="Give several, such as 0, 0.1, 0.3 and infinity.",
        )
    if not loadings:
        raise InputError('No loading was given: "incremental", "total", or both.')
    return {
        name: amontons_family(
            scan.film,
            scan.indenter,
            loads,
            friction=values,
            loading=name,
            reach=reach,
            cache=cache,
            workers=workers,
        )
        for name in dict.fromkeys(loadings)
    }


def _confronted(
    measured: MeasuredStress,
    apparatus: ApparatusFunction,
    family: ProfileFamily,
    points: Sequence[LoadPoints],
) -> Confrontation:
    sensor = sensor_of(apparatus, family, float(max(p.radius.max() for p in points)))
    return confront(family, sensor, points, _load_indices(measured, family.loads))


def _load_indices(measured: MeasuredStress, loads: FloatArray) -> list[int]:
    return [int(np.abs(loads - profile.load).argmin()) for profile in measured.profiles]


def _joint(
    measured: MeasuredStress, confronted: Mapping[str, Confrontation]
) -> dict[str, dict[str, EffectiveFriction]]:
    """Return the coefficient of all loads together, for each state of lubrication."""
    kinds = dict.fromkeys(profile.lubrication for profile in measured.profiles)
    chosen = {
        kind: [i for i, p in enumerate(measured.profiles) if p.lubrication == kind]
        for kind in kinds
    }
    return {
        kind: {name: one.effective(indices) for name, one in confronted.items()}
        for kind, indices in chosen.items()
    }


def _loading_counted(
    loads: Mapping[str, tuple[LoadComparison, ...]],
    joint: Mapping[str, Mapping[str, EffectiveFriction]],
) -> tuple[dict[str, tuple[LoadComparison, ...]], dict[str, dict[str, EffectiveFriction]]]:
    """Add to every budget what the other definition of the loading would have given."""
    names = tuple(loads)
    if len(names) != 2:
        return dict(loads), {kind: dict(by_loading) for kind, by_loading in joint.items()}
    other = dict(zip(names, reversed(names), strict=True))
    counted = {
        name: tuple(
            replace(
                mine,
                by_maximum=with_loading(mine.by_maximum, theirs.by_maximum),
                by_profile=with_loading(mine.by_profile, theirs.by_profile),
            )
            for mine, theirs in zip(loads[name], loads[other[name]], strict=True)
        )
        for name in names
    }
    together = {
        kind: {name: with_loading(by[name], by[other[name]]) for name in names}
        for kind, by in joint.items()
    }
    return counted, together


def _pairs(measured: MeasuredStress, confronted: Confrontation) -> tuple[DryAgainstLubricated, ...]:
    frictionless = members_of(confronted.family, confronted.family.values[:1])
    found = [
        dry_against_lubricated(
            (measured.profiles[i], measured.profiles[j]),
            (confronted.points[i], confronted.points[j]),
            confronted.sensor,
            frictionless,
            (confronted.loads[i], confronted.loads[j]),
            measured.conversion_constant_uncertainty / measured.conversion_constant,
        )
        for i, j in lubricated_pairs(measured.profiles)
    ]
    return tuple(one for one in found if one is not None)


@dataclass(frozen=True, eq=False)
class ShearComparison:
    """The friction that explains the shear at the base of a film.

    Parameters
    ----------
    measured : MeasuredStress
        The normal channel of the same scans: loads and centres.
    apparatus : ApparatusFunction
        The tangential channel.
    friction : ndarray, shape (m,)
        Friction coefficients of the calculated contacts.
    loads : mapping of str to tuple of EffectiveFriction
        One for each measured profile, in their order, by definition of the loading.
    joint : mapping of str to mapping of str to EffectiveFriction
        One for all loads together, by lubrication and definition of the loading.
    messages : tuple of Message
        What a user should know.
    """

    measured: MeasuredStress
    apparatus: ApparatusFunction
    friction: FloatArray
    loads: Mapping[str, tuple[EffectiveFriction, ...]]
    joint: Mapping[str, Mapping[str, EffectiveFriction]]
    messages: tuple[Message, ...]


@single_threaded()
def compare_shear(
    measured: MeasuredStress | str | PathLike[str],
    apparatus: ApparatusFunction | str | PathLike[str],
    *,
    friction: Sequence[float] = FRICTIONS,
    loading: str | Sequence[str] = ("incremental", "total"),
    cache: CacheFolder = None,
    workers: int = 1,
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
    cache : path, optional
        A folder in which calculated contacts are kept; without it nothing is written.
    workers : int
        Processes that calculate contacts.

    Returns
    -------
    ShearComparison

    Raises
    ------
    InputError
        If the artifact is of no tangential channel, or of another sensor, if a scan is not a
        sphere's, or if it holds no voltage of the channel with its noise.

    Examples
    --------
    >>> import math, memscal
    >>> made = memscal.simulate_experiment(
    ...     friction=0.1, loads=[1.37], lubricated_loads=[1.37], channels=("zz", "xz"), seed=1
    ... )
    >>> normal, shear = (
    ...     memscal.calibrate(made.rod, channel=channel, method="evidence").apparatus
    ...     for channel in ("zz", "xz")
    ... )
    >>> measured = memscal.measure_stress(made.dry, normal)
    >>> found = compare_shear(measured, shear, friction=(0, 0.1, 0.3, math.inf), loading="total")
    >>> found.joint["dry"]["total"].interval.low < 0.15
    True
    """
    known, measured = opened_apparatus(apparatus), opened_stress(measured)
    require_contacts(measured.scans)
    scan = measured.scans[0]
    _require_tangential(known, scan)
    points = [load_points(profile, known.sensor.channel) for profile in measured.profiles]
    loads = np.unique(measured.loads)
    reach = _REACH * max(one.width for one in measured.scans)
    names = (loading,) if isinstance(loading, str) else tuple(dict.fromkeys(loading))
    if not names:
        raise InputError('No loading was given: "incremental", "total", or both.')
    confronted = {}
    for name in names:
        family = amontons_family(
            scan.film,
            require_sphere(scan.indenter),
            loads,
            friction=friction,
            loading=name,
            reach=reach,
            cache=cache,
            workers=workers,
            order=1,
        )
        sensor = sensor_of(known, family, max(float(each.radius.max()) for each in points))
        index = [int(np.abs(loads - profile.load).argmin()) for profile in measured.profiles]
        confronted[name] = confront(family, sensor, points, index)
    kinds = [profile.lubrication for profile in measured.profiles]
    chosen = {kind: [i for i, own in enumerate(kinds) if own == kind] for kind in kinds}
    return ShearComparison(
        measured=measured,
        apparatus=known,
        friction=np.asarray(friction, dtype=np.float64),
        loads={
            name: tuple(one.effective([i]) for i in range(len(points)))
            for name, one in confronted.items()
        },
        joint={
            kind: {name: one.effective(indices) for name, one in confronted.items()}
            for kind, indices in chosen.items()
        },
        messages=tuple(_messages(scan, known)),
    )


def _require_tangential(apparatus: ApparatusFunction, scan: MeasuredScan) -> None:
    channel = apparatus.sensor.channel
    if channel not in TANGENTIAL:
        raise InputError(
            f"The artifact is of channel {channel}, not of a tangential one.",
            cure='Give the artifact of memscal.calibrate(scan, channel="xz", method="evidence"); '
            "compare the normal channel with memscal.compare().",
        )
    ours, theirs = scan.sensor.name, apparatus.sensor.name
    if ours and theirs and ours != theirs:
        raise InputError(
            f'The scan is of sensor "{ours}", the artifact of "{theirs}".',
            why="An apparatus function belongs to one sensor.",
            cure="Give the artifact of the scan's sensor.",
        )


def _messages(scan: MeasuredScan, apparatus: ApparatusFunction) -> Iterator[Message]:
    channel = apparatus.sensor.channel
    yield Message(
        "experimental",
        f"Channel {channel} is experimental: comparisons were tested on synthetic scans only.",
    )
    if scan.synthetic:
        yield SYNTHETIC_SCANS
