"""What is asked of a scan and of an artifact, and whether they belong together."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator

import numpy as np

from memscal.apparatus import ApparatusFunction
from memscal.errors import FitError, InputError
from memscal.estimation.profile_estimate import CentreError, ProfileEstimate
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.scan import Scan

__all__ = [
    "SAME_LOAD",
    "accept_mismatches",
    "mismatches",
    "require_covariance",
    "require_measurement",
    "restored_or_explained",
]

#: Loads of a curved indenter may differ by this share: its stress is not proportional to them.
SAME_LOAD = 0.01
#: Properties of one film agree within this share where no uncertainty is stated ...
_SAME = {"young_modulus": 0.02, "poisson_ratio": 0.02, "thickness": 0.02}
#: ... and within this many standard uncertainties of their difference where it is.
_COVERAGE = 2.0
_UNITS = {"young_modulus": ("MPa", 1e-6), "poisson_ratio": ("", 1.0), "thickness": ("mm", 1e3)}


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
    except CentreError:
        raise
    except FitError as failure:
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


def mismatches(scan: Scan, apparatus: ApparatusFunction) -> tuple[str, ...]:
    """Return in words what a scan and an artifact do not have in common."""
    return (*_sensors(scan, apparatus), *_films(scan.film, apparatus.film))


def accept_mismatches(
    scan: Scan, apparatus: ApparatusFunction, place: str, *, override: bool
) -> tuple[str, ...]:
    """Refuse a scan of another sensor, channel or film; or accept it, and return what differs.

    Raises
    ------
    InputError
        If something differs and ``override`` is false, or the artifact is of a tangential channel.
    """
    if apparatus.order:
        raise InputError(
            f"The artifact is of the tangential channel {apparatus.sensor.channel}, but {place} is "
            "to be read as normal stress.",
            why="A shear is no normal stress: this cannot be overridden.",
            cure="Give the artifact of channel zz; memscal.compare_shear() reads the shear.",
        )
    found = mismatches(scan, apparatus)
    if found and not override:
        raise InputError(
            f"{place} does not belong to the artifact: {'; '.join(found)}.",
            why="An apparatus function holds for one channel of one sensor, as it was calibrated "
            "under its film.",
            cure="Give the artifact of this sensor and film. If they are the same under other "
            "names, override it (override=True; --override on the command line): that is recorded.",
        )
    return tuple(f"{place}: {text}" for text in found)


def _sensors(scan: Scan, apparatus: ApparatusFunction) -> Iterator[str]:
    ours, theirs = scan.sensor, apparatus.sensor
    if ours.name and theirs.name and ours.name != theirs.name:
        yield f'sensor "{ours.name}" in the scan, "{theirs.name}" in the artifact'
    if ours.channel != theirs.channel:
        yield f"channel {ours.channel} in the scan, {theirs.channel} in the artifact"


def _films(ours: ElasticFilm, theirs: ElasticFilm) -> Iterator[str]:
    if ours.name and theirs.name and ours.name != theirs.name:
        yield f'film "{ours.name}" in the scan, "{theirs.name}" in the artifact'
    for name, share in _SAME.items():
        mine, its = getattr(ours, name), getattr(theirs, name)
        spreads = [getattr(film, f"{name}_uncertainty") or 0.0 for film in (ours, theirs)]
        allowed = max(share * its, _COVERAGE * math.hypot(*spreads))
        if abs(mine - its) > allowed:
            unit, factor = _UNITS[name]
            values = [f"{value * factor:.4g} {unit}".rstrip() for value in (mine, its)]
            words = name.replace("_", " ").replace("poisson ratio", "Poisson's ratio")
            yield f"film {words} {values[0]} in the scan, {values[1]} in the artifact"
