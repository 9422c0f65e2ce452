"""One measured load beside the calculated profiles: chi-square, maxima, bracketing, friction."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from scipy.special import chdtrc

from memscal.friction.bracketing import bracketed_share
from memscal.friction.effective import Confrontation, random_uncertainty
from memscal.friction.load_points import LoadPoints, single_point
from memscal.friction.predicted import Members, Sensor, members_of, predict
from memscal.friction.results import LoadComparison
from memscal.model.validation import FloatArray

if TYPE_CHECKING:
    from memscal.model.measured_stress import MeasuredProfile

__all__ = ["load_comparison"]


def load_comparison(
    profile: MeasuredProfile, confronted: Confrontation, index: int
) -> LoadComparison:
    """Compare a measured load with every calculated profile of a family.

    Parameters
    ----------
    profile : MeasuredProfile
        What was measured.
    confronted : Confrontation
        All measured loads against the family.
    index : int
        Which of them this one is.
    """
    family, load = confronted.family, confronted.loads[index]
    own = members_of(family, family.values)
    calculated, errors = _blurred(confronted.sensor, own, load, profile.r, confronted.points[index])
    top, top_errors = _blurred(confronted.sensor, own, load, np.zeros(1), confronted.points[index])
    chi_square = confronted.at(family.values, index)
    degrees = confronted.points[index].degrees
    ratio = profile.maximum / float(top[0, 0])
    return LoadComparison(
        profile=profile,
        loading=family.loading,
        s_max=profile.maximum,
        s_max_uncertainty=profile.maximum_uncertainty,
        p0_max=float(top[0, 0]),
        p0_max_uncertainty=float(top_errors[0, 0]),
        ratio=ratio,
        ratio_uncertainty=_ratio_uncertainty(profile, confronted, own, index) * ratio,
        calculated=calculated,
        calculated_errors=errors,
        p_max=top[:, 0],
        chi_square=chi_square,
        p_values=np.asarray(chdtrc(degrees, chi_square)),
        degrees=degrees,
        bracketed=bracketed_share(profile.s_zz, profile.s_zz_errors, calculated, errors),
        by_maximum=confronted.effective_of_maximum(profile, index),
        by_profile=confronted.effective([index]),
    )


def _blurred(
    sensor: Sensor, members: Members, load: int, r: FloatArray, like: LoadPoints
) -> tuple[FloatArray, FloatArray]:
    """Return G convolved with the base stress of each member at radii, and its uncertainty.

    That of A is not counted: it is the measured stress's.
    """
    places = _places(r, like)
    found = predict(places, sensor.of_shape, members, load)
    parts = [np.sum(column**2, axis=-1) for column in found.columns.values()]
    variance = np.sum(parts, axis=0) if parts else np.zeros_like(found.signal)
    a = sensor.conversion_constant
    return found.signal / a, np.sqrt(variance) / a


def _places(r: FloatArray, like: LoadPoints) -> LoadPoints:
    """Return radii as points of the nominal load, with the uncertainties of others."""
    nothing = np.zeros(r.size)
    return LoadPoints(
        u=nothing,
        offset=r,
        log_load=nothing,
        noise=nothing,
        load_errors=nothing,
        x_errors=nothing,
        flat=np.zeros((r.size, 0)),
        free_centre=False,
        load_share=like.load_share,
        position_share=like.position_share,
    )


def _ratio_uncertainty(
    profile: MeasuredProfile, confronted: Confrontation, members: Members, index: int
) -> float:
    """Relative uncertainty of measured over frictionless maximum: A and G err together."""
    top = single_point(0.0, 0.0, confronted.points[index])
    found = predict(top, confronted.sensor, members, confronted.loads[index])
    parts = [float(np.linalg.norm(column[0, 0])) for column in found.columns.values()]
    systematic = float(np.linalg.norm(parts)) / float(found.signal[0, 0])
    return float(np.hypot(systematic, random_uncertainty(profile.maximum_budget) / profile.maximum))
