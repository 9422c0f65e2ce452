"""Dry less lubricated stress at one load, in which errors of A and G nearly cancel."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np
from scipy.special import chdtrc

from memscal.friction.effective import random_uncertainty
from memscal.friction.likelihood import (
    Channel,
    LoadPoints,
    Predicted,
    Readings,
    points_at,
    predict,
    standardise,
)
from memscal.friction.marginal_likelihood import log_likelihood
from memscal.friction.results import DryAgainstLubricated
from memscal.model.arrays import ArrayPair, FloatArray, IndexArray
from memscal.model.measured_stress import MeasuredProfile, MeasuredStress

#: Loads that differ by less than this share are one.
_SAME_LOAD = 0.05
#: Places that are nearer than this share of a step are one.
_CLOSE = 0.25
_FEWEST_PLACES = 6
#: Arrays with one entry for each point.
_BY_POINT = ("u", "offset", "log_load", "noise", "load_errors", "x_errors", "flat")


def lubricated_pairs(profiles: Sequence[MeasuredProfile]) -> list[tuple[int, int]]:
    """Return the indices of dry and lubricated profiles of one load."""
    return [
        (i, j)
        for (i, dry), (j, lubricated) in product(enumerate(profiles), repeat=2)
        if (dry.lubrication, lubricated.lubrication) == ("dry", "lubricated")
        and abs(dry.load / lubricated.load - 1) < _SAME_LOAD
    ]


def dry_against_lubricated(
    measured: MeasuredStress,
    frictionless: Channel,  # points of all profiles, and how voltages change with load and place
    pair: tuple[int, int],  # the dry and the lubricated profile
) -> DryAgainstLubricated | None:
    """Compare the dry and the lubricated profile of one load; None of too few places in common."""
    # Errors of A, G and film nearly cancel in the difference: noise, the scatter of the loads, and
    # each scan's own baseline, drift and centre are left.
    sensor = frictionless.sensor
    averaged = [_averaged(frictionless.points[i]) for i in pair]
    places = _common_places(averaged[0].offset, averaged[1].offset)
    if places[0].size < _FEWEST_PLACES:
        return None
    dry, lubricated = map(_at_places, averaged, places)
    dry_contact = predict(dry, sensor, frictionless.family, pair[0])
    lubricated_contact = predict(lubricated, sensor, frictionless.family, pair[1])

    # Voltages: what the frictionless contact says of other places and loads is taken off both.
    voltage = dry.u - dry_contact.signal[0] - (lubricated.u - lubricated_contact.signal[0])
    noise, correlation = _noise_of_difference((dry, dry_contact), (lubricated, lubricated_contact))
    by_centre = -dry_contact.slope[0] * np.sign(dry.offset)
    flat = np.column_stack([dry.flat, by_centre])
    apart = points_at(dry.offset, dry, voltage, noise)
    apart = replace(apart, flat=flat, correlation=correlation)
    nothing = np.zeros((1, noise.size))
    # Of what all scans share only the difference is left; the rest is each scan's own.
    columns = {
        source: column - lubricated_contact.columns[source]
        for source, column in dry_contact.columns.items()
    }
    standardised = standardise(apart, Predicted(nothing, nothing, nothing, nothing, columns))
    _, (chi_square,) = log_likelihood(standardised.statistics)

    # Stresses, at the places and the load of the dry scan.
    dry_profile, lubricated_profile = (measured.profiles[i] for i in pair)
    conversion_share = measured.conversion_constant_uncertainty / measured.conversion_constant
    dry_stress, dry_variance = _stress_at(dry_profile, places[0])
    lubricated_stress, lubricated_variance = _stress_at(lubricated_profile, places[1])
    farther = lubricated_contact.slope[0] * (dry.radius - lubricated.radius)
    heavier = lubricated_contact.by_load[0] * math.log(dry_profile.load / lubricated_profile.load)
    moved = (farther + heavier) / sensor.conversion_constant
    difference = dry_stress - lubricated_stress - moved
    variance = dry_variance + lubricated_variance + (conversion_share * difference) ** 2
    maximum = dry_profile.maximum - lubricated_profile.maximum
    budgets = (dry_profile.maximum_budget, lubricated_profile.maximum_budget)
    # What each scan has for itself, its gain and load, on the axis as nearest to it.
    own = np.concatenate([columns["between_scan_gain"], columns["load"]], axis=-1)[0]
    by_scan = np.linalg.norm(own, axis=1) / sensor.conversion_constant
    on_axis = by_scan[dry.radius.argmin()]
    maximum_uncertainty = math.hypot(
        conversion_share * maximum, on_axis, *map(random_uncertainty, budgets)
    )
    return DryAgainstLubricated(
        load=dry_profile.load,
        r=dry.radius,
        difference=difference,
        difference_errors=np.sqrt(variance + by_scan**2),
        chi_square=float(chi_square),
        degrees=apart.degrees,
        p_value=float(chdtrc(apart.degrees, chi_square)),
        maximum=maximum,
        maximum_uncertainty=maximum_uncertainty,
        relative=maximum / lubricated_profile.maximum,
        relative_uncertainty=maximum_uncertainty / lubricated_profile.maximum,
    )


def _at_places(points: LoadPoints, chosen: IndexArray) -> LoadPoints:
    """Return some of the points, with their correlation."""
    arrays = {name: getattr(points, name)[chosen] for name in _BY_POINT}
    if points.correlation is not None:
        arrays["correlation"] = points.correlation[np.ix_(chosen, chosen)]
    return replace(points, **arrays)


def _averaged(points: LoadPoints) -> LoadPoints:
    """Return the mean of the repeats at each position, sorted by position."""
    rounded = points.offset.round(12)
    order = np.argsort(rounded, kind="stable")
    places, starts, counts = np.unique(rounded[order], return_index=True, return_counts=True)

    def mean(values: FloatArray) -> FloatArray:
        """Mean of the repeats, along the first axis."""
        sums = np.add.reduceat(values[order], starts, axis=0)
        return (sums.T / counts).T

    noise = np.sqrt(mean(points.noise**2) / counts)
    x_errors = mean(points.x_errors)
    if points.places is None:
        # They are new in every repeat.
        x_errors = np.sqrt(mean(points.x_errors**2) / counts)
    correlation = None
    if points.correlation is not None:
        single = np.outer(points.noise, points.noise) * points.correlation
        covariance = mean(mean(single).T)
        noise = np.sqrt(np.diag(covariance))
        correlation = covariance / np.outer(noise, noise)
    return replace(
        points,
        u=mean(points.u),
        offset=places,
        log_load=mean(points.log_load),
        noise=noise,
        load_errors=np.sqrt(mean(points.load_errors**2) / counts),
        x_errors=x_errors,
        places=None,
        flat=mean(points.flat),
        correlation=correlation,
    )


def _common_places(dry: FloatArray, lubricated: FloatArray) -> tuple[IndexArray, IndexArray]:
    """Return the indices of places that both scans measured, a quarter of a step apart at most."""
    middles = (lubricated[1:] + lubricated[:-1]) / 2
    nearest = np.searchsorted(middles, dry)
    step = np.median(np.diff(dry)) if dry.size > 1 else 0.0
    close = np.flatnonzero(abs(dry - lubricated[nearest]) < _CLOSE * step)
    matched, first = np.unique(nearest[close], return_index=True)
    return close[first], matched


def _stress_at(profile: MeasuredProfile, places: IndexArray) -> ArrayPair:
    """Return the stress at places of the sorted line, and its variance without that of A."""
    order = np.argsort((profile.x, profile.y)[profile.axis])[places]
    sources = [source for source in profile.roots if source != "conversion_constant"]
    return profile.s_zz[order], profile.errors_by(*sources)[order] ** 2


def _noise_of_difference(
    *readings: Readings,
) -> tuple[FloatArray, FloatArray | None]:
    """Noise of a difference, in V, without what both scans share, and its correlation if any."""
    variance = np.zeros(())
    shared = None
    for points, predicted in readings:
        by_load = predicted.by_load[0] * points.load_errors
        by_place = predicted.slope[0] * points.x_errors
        variance = variance + points.noise**2 + by_load**2 + by_place**2
        if points.correlation is not None:
            apart = points.correlation - np.eye(points.u.size)
            covariance = np.outer(points.noise, points.noise) * apart
            shared = covariance if shared is None else shared + covariance
    noise = np.sqrt(variance)
    if shared is None:
        return noise, None
    return noise, np.eye(noise.size) + shared / np.outer(noise, noise)
