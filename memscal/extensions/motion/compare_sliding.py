r"""Friction from sliding: the coefficient by which sliding contacts explain measured profiles.

Sliding friction shifts and skews the stress at the base of a film.  A pass with a centre of its own
tells the coefficient by the skew; two passes against each other share the centre, but for the
stage's backlash b, and tell it by the shift, too:

.. math:: U(X) = A\,(G \otimes \sigma_\mu)(d\,(c + d\,b/2 - X)) + \text{baseline} + \text{drift},

with the direction d of each pass, +1 or -1: a sensor at c is ahead of an indenter that slides along
the positions while that is at a smaller X.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any

import numpy as np
from scipy.ndimage import map_coordinates

from memscal.apparatus import ApparatusFunction
from memscal.errors import InputError
from memscal.extensions.motion.sliding_family import SLIDING, LineNodes, sliding_family
from memscal.friction.checks import comparison_messages, reduced_check
from memscal.friction.effective import (
    EXPANDED,
    FrictionFit,
    fit_friction,
    unexplained,
    with_loading,
)
from memscal.friction.family import ProfileFamily
from memscal.friction.likelihood import (
    Channel,
    LoadPoints,
    Predicted,
    Readings,
    Sensor,
    changes_at,
    indicators,
    points_of,
    sensor_of,
    standardise,
)
from memscal.friction.results import BoundedEstimate, FrictionComparison
from memscal.measurement.restore import noise_unstated_message
from memscal.model.arrays import (
    ArrayPair,
    FloatArray,
    IndexArray,
    Values,
    keyword_array_record,
)
from memscal.model.checks import FAILED_CHECK, NOISE_UNSTATED, QualityCheck, check
from memscal.model.measured_stress import MeasuredProfile, MeasuredStress

#: Loads that differ by less than this share are one.
_SAME_LOAD = 0.05
#: Standard deviation of a centre that is not known, in m.
_ANYWHERE = 0.1
#: What a restoration tests, and finds, is of a round stress.
_OF_ROUND = (FAILED_CHECK, NOISE_UNSTATED)
#: Standard uncertainties by which two coefficients differ.
_APART = 3.0
_DIFFER = "The friction differs between the speeds."


@keyword_array_record
class SlidingPoints(LoadPoints):
    """Voltages of one pass; ``offset`` is from a place that all passes have in common."""

    # -1 where the indenter slid along the positions, and the sensor came from ahead; else +1.
    way: int
    start: float  # near the centre, in m
    sharing: FloatArray  # (c,): one where the pass shares a centre with others
    backlash: float  # standard uncertainty, in m


class SlidingChannel(Channel):
    """What a sensor reads of sliding contacts."""

    def readings(self, load: int) -> Readings:
        """Return the points of a pass, by its index, and what is predicted there."""
        points: Any = self.points[load]
        return points, _predicted(points, self.sensor, self.family, load)


def _predicted(
    points: SlidingPoints, sensor: Sensor, members: ProfileFamily, load: int
) -> Predicted:
    """Return what the sensor reads of members, each about the centre that fits it best."""
    nodes: Any = members.wavenumbers
    signal = sensor.transfer * members.spectra[:, load] @ nodes.waves.T
    slope = np.gradient(signal, nodes.line, axis=1)
    places, centre = _best_places(points, nodes, signal, slope)

    def at_points(spectra: FloatArray) -> FloatArray:
        return _read(spectra @ nodes.waves.T, places)

    by_centre = -points.way * _read(slope, places)
    from_axis = -by_centre * np.sign(points.offset)
    predicted = changes_at(points, sensor, members, load, at_points, from_axis)
    moved = by_centre[..., None] * points.sharing
    own = {
        "centre": _ANYWHERE * moved,
        "backlash": points.backlash / 2 * points.way * moved,
    }
    # Seen from the common place, in proportion to the distance.
    signal = predicted.signal - centre * by_centre
    return replace(predicted, signal=signal, columns={**predicted.columns, **own})


def _read(values: FloatArray, places: FloatArray) -> FloatArray:
    """Read values (V, m) at places (V, n) along the line, in its steps."""
    rows = np.broadcast_to(np.arange(len(values))[:, None], places.shape)
    return map_coordinates(values, [rows, places], mode="nearest")


#: Steps by which a centre is found, and the longest of them in those of the line.
_STEPS = 12
_LONGEST = 10


def _best_places(
    points: SlidingPoints, nodes: LineNodes, signal: FloatArray, slope: FloatArray
) -> ArrayPair:
    """Return where each reading lies in each member's contact, (V, n), and the centres (V, 1)."""
    step = nodes.line[1] - nodes.line[0]
    baseline = np.linalg.qr(points.flat / points.noise[:, None])[0]
    centre = np.full((len(signal), 1), points.start)
    moved = np.zeros_like(centre)
    for _ in range(_STEPS):
        centre = centre + np.clip(moved, -_LONGEST * step, _LONGEST * step)
        places = (points.way * (points.offset - centre) - nodes.line[0]) / step
        rest = (points.u - _read(signal, places)) / points.noise
        by_centre = -points.way * _read(slope, places) / points.noise
        by_centre -= by_centre @ baseline @ baseline.T
        moved = np.sum(by_centre * rest, 1, keepdims=True)
        moved /= np.sum(by_centre**2, 1, keepdims=True)
    return places, centre


@keyword_array_record
class SlidingComparison(FrictionComparison):
    """Measured stress against contacts that slide, with the friction that explains it.

    ``joint`` is of all passes of a lubrication together, unless it differs between speeds,
    ``by_shear`` of each measured profile by its skew, and ``speeds`` by lubrication and speed
    (m/s), where there are several.  ``curves`` (3, n) of each profile: position in m, measured and
    calculated stress as the sensor blurs it, in Pa.
    """

    speeds: Mapping[tuple[str, float], BoundedEstimate]
    curves: tuple[FloatArray, ...]
    backlash: float | None


def compare_sliding(
    measured: MeasuredStress,
    apparatus: ApparatusFunction,
    setting: Values,
    between_scan_gain: float,
    backlash: float | None,
) -> SlidingComparison:
    """Hold measured stress against sliding contacts; ``setting``: that of a family."""
    others = [note for note in measured.messages if note.kind not in _OF_ROUND]
    profiles = measured.profiles
    speeds = [(profile.lubrication, profile.scan.speed) for profile in profiles]
    keys = [*zip(speeds, _numbered(measured.loads).tolist(), strict=True)]

    family = sliding_family(setting)
    sensor = sensor_of(apparatus, family, setting["reach"], measured.scans)
    own = indicators(range(len(keys)))
    sharing = own if backlash is None else indicators(keys)
    if backlash is not None and sharing.shape == own.shape:
        raise InputError(
            "A backlash is given, and no load and speed has passes forth and back.",
            cure="Leave it out (--backlash).",
        )
    points = _points(profiles, sharing, between_scan_gain, backlash or 0.0)
    at_loads = family.only(np.searchsorted(family.loads, measured.loads).tolist())
    channel = SlidingChannel(points, sensor, at_loads)
    fit = fit_friction(channel)
    tested = measured.noise_stated
    if not tested:
        # Readings scatter by more than their noise about a round stress.
        scatter = {key: math.sqrt(e.least / e.degrees) for key, e in _by(keys, fit).items()}
        pairs = zip(points, keys, strict=True)
        points = [replace(p, noise=scatter[key] * p.noise) for p, key in pairs]
        channel = replace(channel, points=points)
        fit = fit_friction(channel)
        least = min(p.noise.min() for p in points)
        others.append(noise_unstated_message(measured.scans[0].reading.text(least)))
    process = replace(measured.process, messages=tuple(others))
    measured = replace(measured, checks=(), process=process)
    by_speed = _by(speeds, fit)
    each = _by(keys, fit)
    checks = [*_directions(speeds, fit), *_agreements(profiles, [each[key] for key in keys])]
    if tested:
        checks += _misfits(by_speed.values())
    if backlash is not None:
        apart = [replace(p, sharing=row) for p, row in zip(points, own, strict=True)]
        checks += _shifts(by_speed, _by(speeds, fit_friction(replace(channel, points=apart))))
    joint = _joint([profile.lubrication for profile in profiles], by_speed, fit, tested)
    by_pass = _told(_by(range(len(keys)), fit), tested)
    stated = {key: found for key, found in _told(by_speed, tested).items() if key[1]}
    return SlidingComparison(
        measured=measured,
        friction=family.values,
        loads={},
        by_shear={SLIDING: tuple(by_pass.values())},
        joint=joint,
        checks=tuple(checks),
        messages=comparison_messages(measured, {SLIDING: family}, joint, tuple(checks)),
        speeds=stated if len(stated) > 1 else {},
        curves=tuple(_curve(fit, i, each[key].best) for i, key in enumerate(keys)),
        backlash=backlash,
    )


def _numbered(loads: FloatArray) -> IndexArray:
    """Return which of the loads each is, the smallest first."""
    ordered = np.sort(loads)
    larger = ordered[1:][np.diff(ordered) > _SAME_LOAD * ordered[:-1]]
    return np.searchsorted(larger, loads, "right")


def _joint(
    states: Sequence[str],
    by_speed: Mapping[tuple[str, float | None], BoundedEstimate],
    fit: FrictionFit,
    tested: bool,
) -> dict[str, dict[str, BoundedEstimate]]:
    """Return the coefficient of all passes of each state, if it does not differ by speed."""
    joint = {}
    for state, estimate in _told(_by(states, fit), tested).items():
        of_state = [found for (of, _), found in by_speed.items() if of == state]
        joint[state] = {SLIDING: estimate if _agree(of_state) else unexplained(estimate, _DIFFER)}
    return joint


def _groups(keys: Sequence[Any]) -> dict[Any, list[int]]:
    """Return which of the keys are alike."""
    groups: dict[Any, list[int]] = {}
    for i, key in enumerate(keys):
        groups.setdefault(key, []).append(i)
    return groups


def _by(keys: Sequence[Any], fit: FrictionFit) -> dict[Any, BoundedEstimate]:
    """Return the coefficient of the passes of each key."""
    return {key: fit.coefficient(chosen) for key, chosen in _groups(keys).items()}


def _told(found: Mapping[Any, BoundedEstimate], tested: bool) -> dict[Any, BoundedEstimate]:
    """Return coefficients; of what none explains nothing but the reason."""
    return {key: with_loading({SLIDING: e}, tested=tested)[SLIDING] for key, e in found.items()}


def _uncertainty(found: BoundedEstimate) -> float:
    """Return the standard uncertainty of a coefficient, which may be at the end of its range."""
    return max(found.interval.upper - found.best, found.best - found.interval.low) / EXPANDED


def _agree(estimates: Sequence[BoundedEstimate]) -> bool:
    """Whether coefficients differ by no more than their uncertainties make of them."""
    return all(
        abs(one.best - other.best) <= _APART * math.hypot(_uncertainty(one), _uncertainty(other))
        for one, other in combinations(estimates, 2)
    )


def _points(
    profiles: Sequence[MeasuredProfile],
    sharing: FloatArray,
    between_scan_gain: float,
    backlash: float,
) -> list[SlidingPoints]:
    """Return the points of each pass; ``sharing``: a row for each, one in the centre's column."""
    centres = np.array([profile.centre[profile.axis] for profile in profiles])
    middle = centres.mean()
    points = []
    for i, single in enumerate(points_of(profiles, between_scan_gain=between_scan_gain)):
        profile = profiles[i]
        if not profile.direction:
            raise InputError(
                f"{profile.label}: the direction of sliding is not stated.",
                why="Friction shifts the stress ahead of the indenter.",
                cure="State it (/entry/data/direction): memscal import --sliding forth or back.",
            )
        own = {
            "offset": single.offset + centres[i] - middle,
            # Outliers were told by a round stress.
            "noise": profile.points["zz"].noise,
            "free_centre": False,
            "way": -int(profile.direction),
            "start": centres[i] - middle,
            "sharing": sharing[i],
            "backlash": backlash,
        }
        points.append(SlidingPoints(**(vars(single) | own)))
    return points


def _curve(fit: FrictionFit, index: int, friction: float) -> FloatArray:
    """Return positions of a pass, its stress without baseline and drift, and the fit, (3, n)."""
    channel = fit.channel.at(friction)
    points: Any
    points, predicted = channel.readings(index)
    reduced = standardise(points, predicted)
    _, (projection,), (information,), _ = reduced.statistics
    systematic = np.linalg.solve(information + np.eye(len(information)), projection)
    fitted = predicted.signal + np.concatenate([*predicted.columns.values()], 2) @ systematic
    order, _ = points.shared_noise()
    x, noise, fitted = np.stack([points.offset, points.noise, fitted[0]])[:, order]
    rest = noise * (reduced.residual - reduced.columns @ systematic)[0]
    a = channel.sensor.conversion_constant
    return np.stack([x, (fitted + rest) / a, fitted / a])


def _misfits(by_speed: Iterable[BoundedEstimate]) -> Iterator[QualityCheck]:
    """Yield the checks of chi-square."""
    for i, found in enumerate(by_speed, start=1):
        yield reduced_check(
            f"joint_chi_square_{i}",
            [found],
            "Reduced chi-square of all passes of a speed against the sliding friction that "
            "explains them best. A failure means that none does: friction changes with the load, "
            "the noise is larger than stated, or shape, film, gain or load are not as stated.",
        )


def _directions(keys: Sequence[Any], fit: FrictionFit) -> Iterator[QualityCheck]:
    """Yield the checks that the friction of the passes of each key is not below zero."""
    for i, chosen in enumerate(_groups(keys).values(), start=1):
        along = fit.whole.only(chosen)
        (step, *_), (rise, *_) = np.diff(along.coordinates), np.diff(along.deviance)
        information = along.slope_fit()[0][0]
        # A parabola by its first values and its curvature.
        below = (rise / step - information * step) / (2 * math.sqrt(information))
        yield _check_in_u(
            f"negative_friction_{i}",
            max(below, 0.0),
            "How far the friction that explains the passes of a speed best would be below zero, "
            "in its standard uncertainty. A failure means that the direction of sliding or of the "
            "positions is not as stated, that the backlash is larger, or that the sensor lags.",
        )


def _shifts(
    found: Mapping[Any, BoundedEstimate], alone: Mapping[Any, BoundedEstimate]
) -> Iterator[QualityCheck]:
    """Yield the checks of coefficients by shift and skew against those by the skew alone."""
    for i, (key, both) in enumerate(found.items(), start=1):
        by_skew = alone[key]
        u = _uncertainty(by_skew)
        yield _check_in_u(
            f"skew_and_shift_{i}",
            abs(by_skew.best - both.best) / u,
            f"Difference of the friction by the skew alone, {by_skew.best:.3g}, from that by skew "
            f"and shift, {both.best:.3g}, in its standard uncertainty of {u:.2g}. A failure means "
            "that the backlash is larger than stated, or that the sensor lags.",
        )


def _agreements(
    profiles: Sequence[MeasuredProfile], frictions: Sequence[BoundedEstimate]
) -> Iterator[QualityCheck]:
    """Yield the checks of the coefficient of each pass against what is known otherwise."""
    for i, (profile, found) in enumerate(zip(profiles, frictions, strict=True), start=1):
        scan = profile.scan
        known = {"sliding_friction": (scan.sliding_friction, scan.sliding_friction_uncertainty)}
        if profile.tangential_load is not None:
            ratio = abs(profile.tangential_load) / profile.load
            known["tangential_load"] = (
                ratio,
                ratio * (profile.load_uncertainty or 0.0) / profile.load,
            )
        for name, (value, u_value) in known.items():
            if value is None:
                continue
            u = math.hypot(_uncertainty(found), u_value or 0.0)
            yield _check_in_u(
                f"{name}_{i}",
                abs(found.best - value) / u,
                f"Difference of the sliding friction at {profile.label}, {found.best:.3g}, from "
                f"{value:.3g}, in its standard uncertainty of {u:.2g}. A failure means that a load "
                "cell, the film or the direction is not as stated, or that the shear is not in "
                "proportion to the pressure.",
            )


def _check_in_u(name: str, off: float, meaning: str) -> QualityCheck:
    """Return the check of a difference in standard uncertainties."""
    return check(name, off, _APART, meaning, math.erfc(off / math.sqrt(2)))
