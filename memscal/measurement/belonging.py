"""Whether a scan and an artifact belong together: sensor, channel and film."""

from __future__ import annotations

import math
from collections.abc import Iterator

from memscal.apparatus import ApparatusFunction
from memscal.errors import InputError
from memscal.model.film import ElasticFilm
from memscal.model.scan import Scan

__all__ = ["accept_mismatches", "mismatches"]

#: Properties of one film agree within this share where no uncertainty is stated ...
_SAME = {"young_modulus": 0.02, "poisson_ratio": 0.02, "thickness": 0.02}
#: ... and within this many standard uncertainties of their difference where it is.
_COVERAGE = 2.0
_UNITS = {"young_modulus": ("MPa", 1e-6), "poisson_ratio": ("", 1.0), "thickness": ("mm", 1e3)}


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
