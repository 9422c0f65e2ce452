r"""Dry against lubricated stress at one load: what friction adds, without A.

The difference of the voltages at the same places is held against none.  An error of A scales
a difference that is small, an error of G or of the film changes both alike: what is left is noise,
the scatter of the loads, and each scan's own baseline, drift and centre.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from memscal.friction.effective import random_uncertainty
from memscal.friction.prediction import LoadPoints, Members, Predicted, Sensor, predict
from memscal.friction.results import DryAgainstLubricated
from memscal.model.arrays import FloatArray

if TYPE_CHECKING:
    from memscal.model.measured_stress import MeasuredProfile

__all__ = ["dry_against_lubricated", "lubricated_pairs"]

#: Loads that differ by less than this share are one.
_SAME_LOAD = 0.05
#: Places that are nearer than this share of a step are one.
_CLOSE = 0.25
_FEWEST_PLACES = 6


def lubricated_pairs(profiles: Sequence[MeasuredProfile]) -> list[tuple[int, int]]:
    """Return the indices of dry and lubricated profiles of one load."""
    kinds = [profile.lubrication for profile in profiles]
    return [
        (i, j)
        for i, dry in enumerate(profiles)
        for j, wet in enumerate(profiles)
        if (kinds[i], kinds[j]) == ("dry", "lubricated")
        and abs(dry.load / wet.load - 1) < _SAME_LOAD
    ]


def dry_against_lubricated(
    profiles: tuple[MeasuredProfile, MeasuredProfile],
    points: tuple[LoadPoints, LoadPoints],
    sensor: Sensor,
    frictionless: Members,
    loads: tuple[int, int],
    conversion_share: float,
) -> DryAgainstLubricated | None:
    """Compare the dry and the lubricated profile of one load.

    Parameters
    ----------
    profiles, points
        The dry and the lubricated load.
    sensor : Sensor
        The sensor.
    frictionless : Members
        The calculated contact without friction: it says how voltages change with load and place
        where those of the two scans differ.
    loads : tuple of int
        Its loads of the two.
    conversion_share : float
        Relative standard uncertainty of A.

    Returns
    -------
    DryAgainstLubricated or None
        ``None`` if the two scans have too few places in common.
    """
    sides = [each.averaged() for each in points]
    kept = _common(sides[0].offset, sides[1].offset)
    if kept[0].size < _FEWEST_PLACES:
        return None
    found = [
        predict(each, sensor, frictionless, load) for each, load in zip(sides, loads, strict=True)
    ]
    # What the frictionless contact says of other places and loads is taken off both.
    dry, wet = (
        (side.u - of_side.signal[0])[places]
        for side, of_side, places in zip(sides, found, kept, strict=True)
    )
    covariance = sum(
        _covariance(side, of_side)[np.ix_(places, places)]
        for side, of_side, places in zip(sides, found, kept, strict=True)
    )
    flat = np.column_stack([sides[0].flat, found[0].slope[0] * sides[0].side])[kept[0]]
    chi_square = _chi_square(dry - wet, np.asarray(covariance), flat)
    degrees = kept[0].size - flat.shape[1]
    difference, errors = _difference(profiles, sides, found, kept, sensor, conversion_share)
    top = profiles[0].maximum - profiles[1].maximum
    u_top = float(
        np.hypot(
            conversion_share * top,
            math.hypot(*(random_uncertainty(each.maximum_budget) for each in profiles)),
        )
    )
    return DryAgainstLubricated(
        load=profiles[0].load,
        r=sides[0].radius[kept[0]],
        difference=difference,
        difference_errors=errors,
        chi_square=chi_square,
        degrees=degrees,
        p_value=float(chdtrc(degrees, chi_square)),
        maximum=top,
        maximum_uncertainty=u_top,
        relative=top / profiles[1].maximum,
        relative_uncertainty=u_top / profiles[1].maximum,
    )


def _common(dry: FloatArray, wet: FloatArray) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices of places that both scans measured, a quarter of a step apart at most."""
    nearest = np.abs(np.subtract.outer(dry, wet)).argmin(axis=1)
    step = float(np.median(np.diff(dry))) if dry.size > 1 else 0.0
    close = np.abs(dry - wet[nearest]) < _CLOSE * step
    first, where = np.unique(nearest[close], return_index=True)
    return close.nonzero()[0][where], first


def _covariance(points: LoadPoints, found: Predicted) -> FloatArray:
    """Covariance of the voltages, without what both scans share, in V^2."""
    noise = np.outer(points.noise, points.noise)
    noise = np.diag(np.diag(noise)) if points.correlation is None else noise * points.correlation
    scatter = (found.by_load[0] * points.load_errors) ** 2
    moved = (found.slope[0] * points.x_errors) ** 2
    return np.asarray(noise + np.diag(scatter + moved))


def _chi_square(values: FloatArray, covariance: FloatArray, flat: FloatArray) -> float:
    root = np.linalg.cholesky(covariance)
    basis = np.linalg.qr(np.linalg.solve(root, flat))[0]
    left = np.linalg.solve(root, values)
    left = left - basis @ (basis.T @ left)
    return float(left @ left)


def _difference(
    profiles: tuple[MeasuredProfile, MeasuredProfile],
    sides: Sequence[LoadPoints],
    found: Sequence[Predicted],
    kept: tuple[NDArray[np.intp], NDArray[np.intp]],
    sensor: Sensor,
    conversion_share: float,
) -> tuple[FloatArray, FloatArray]:
    """Return dry minus lubricated stress at the dry scan's places, and its uncertainty, in Pa."""
    orders = [np.argsort(profile.x) for profile in profiles]
    stresses = [
        profile.s_zz[order][places]
        for profile, order, places in zip(profiles, orders, kept, strict=True)
    ]
    farther = sides[0].radius[kept[0]] - sides[1].radius[kept[1]]
    heavier = math.log(profiles[0].load / profiles[1].load)
    moved = found[1].slope[0][kept[1]] * farther + found[1].by_load[0][kept[1]] * heavier
    difference = stresses[0] - stresses[1] - moved / sensor.conversion_constant
    variance = (conversion_share * difference) ** 2
    for profile, order, places in zip(profiles, orders, kept, strict=True):
        for source, covariance in profile.covariances.items():
            if source != "conversion_constant":
                variance = variance + np.diag(covariance)[order][places]
    return difference, np.sqrt(variance)
