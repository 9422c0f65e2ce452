"""What a restoration asks of a scan and of an apparatus function."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.errors import FitError, InputError
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.indenter import Rod
from memscal.model.scan import Scan

__all__ = ["SAME_LOAD", "require_covariance", "require_measurement", "restored_or_explained"]

#: Loads of a curved indenter may differ by this share: its stress is not proportional to them.
SAME_LOAD = 0.01


def require_measurement(scan: Scan, apparatus: ApparatusFunction) -> None:
    """Refuse a scan and an apparatus function that do not belong together.

    Raises
    ------
    InputError
        If their sensors differ, the artifact's uncertainty is no number, or a
        curved indenter was pressed at several loads.
    """
    _require_same_sensor(scan, apparatus)
    require_covariance(apparatus)
    load = scan.normal_load
    if load is None or isinstance(scan.indenter, Rod):
        return
    low, high = float(np.nanmin(load)), float(np.nanmax(load))
    if high - low > SAME_LOAD * scan.load:
        raise InputError(
            f"The loads of the scan go from {low:.4g} to {high:.4g} N.",
            why=f"The contact of a {scan.indenter.shape} grows with its load: each has a stress of "
            "its own.",
            cure="Give the scan of one load.",
        )


def restored_or_explained(estimate: Callable[[], ProfileEstimate]) -> ProfileEstimate:
    """Return an estimate; where there is none, say so of a stress, not of a calibration.

    Raises
    ------
    FitError
        If the scan does not determine a stress.
    """
    try:
        return estimate()
    except FitError as failure:
        if "centre" in failure.problem or "positions" in failure.problem:
            raise
        raise FitError(
            "The scan determines no stress at the base of the film.",
            why="Its voltage does not rise clear of noise and baseline as the indenter passes one "
            "centre, or the scan is too short to tell the profile's tail from the baseline.",
            cure="Check channel and positions; scan farther; raise the load or average repeats.",
        ) from failure


def _require_same_sensor(scan: Scan, apparatus: ApparatusFunction) -> None:
    ours, theirs = scan.sensor, apparatus.sensor
    other_name = bool(ours.name and theirs.name and ours.name != theirs.name)
    if other_name or ours.channel != theirs.channel:
        raise InputError(
            f"The scan is of sensor {ours.name or 'unnamed'} ({ours.channel}), the apparatus "
            f"function of sensor {theirs.name or 'unnamed'} ({theirs.channel}).",
            why="An apparatus function belongs to one sensor and channel.",
            cure="Give the artifact of the scan's sensor; check /entry/instrument/stress_sensor.",
        )


def require_covariance(apparatus: ApparatusFunction) -> None:
    """Refuse an apparatus function that does not say how well it is known.

    Raises
    ------
    InputError
        If the covariance of G or the uncertainty of A is missing or no number.
    """
    profile = apparatus.radial_profile
    known = (
        profile.g_covariance.shape == (profile.r.size, profile.r.size)
        and np.isfinite(profile.g_covariance).all()
        and np.isfinite(apparatus.parameters.uncertainty("conversion_constant"))
    )
    if not known:
        raise InputError(
            "The apparatus function does not state the covariance of G, or the uncertainty of A.",
            why="The restored stress would have no uncertainty that means anything.",
            cure="Calibrate again with memscal calibrate.",
        )
