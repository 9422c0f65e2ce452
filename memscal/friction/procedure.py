"""From contact scans and a calibrated sensor to the friction that explains what it measured."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from os import PathLike

import numpy as np

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.errors import InputError
from memscal.formats.opened import Contacts, opened_contacts
from memscal.friction.amontons import FRICTIONS, amontons_family
from memscal.friction.cache import CacheFolder
from memscal.friction.checks import comparison_checks
from memscal.friction.compliance import compare_interface
from memscal.friction.dry_against_lubricated import dry_against_lubricated, lubricated_pairs
from memscal.friction.effective import Confrontation, confront, with_loading
from memscal.friction.external import external_family
from memscal.friction.family import ProfileFamily
from memscal.friction.load_comparison import load_comparison
from memscal.friction.load_points import LoadPoints, load_points
from memscal.friction.messages import comparison_messages
from memscal.friction.predicted import members_of, sensor_of
from memscal.friction.requirements import (
    require_contacts,
    require_macroscopic,
    same_apparatus,
    scans_of,
)
from memscal.friction.results import (
    DryAgainstLubricated,
    EffectiveFriction,
    FrictionComparison,
    LoadComparison,
)
from memscal.measurement.application import joined_stress, measure_stress
from memscal.model.indenter import Sphere
from memscal.model.measured_stress import MeasuredStress
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.model.validation import FloatArray
from memscal.threads import single_threaded

__all__ = ["compare", "compare_measured"]

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
