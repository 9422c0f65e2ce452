"""What a comparison with calculated contacts asks of scans and options."""

from __future__ import annotations

from collections.abc import Sequence

from memscal.errors import InputError
from memscal.model.indenter import Sphere
from memscal.model.scan import Scan
from memscal.model.validation import require_non_negative

__all__ = ["contact_scans", "require_macroscopic"]


def contact_scans(scans: Sequence[Scan]) -> tuple[Scan, ...]:
    """Refuse what is no scan of a sphere's contacts, or not all on one film with one sphere."""
    if not scans:
        raise InputError("No scan was given.", cure="Give one contact scan or several.")
    for one in scans:
        if not isinstance(one, Scan):
            raise InputError(
                f"compare() was given a {type(one).__name__}, not a Scan.",
                cure="Read a scan file with memscal.read_scan(path).",
            )
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
    return tuple(scans)


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
