"""What a comparison with calculated contacts asks of scans and options."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from memscal.apparatus import ApparatusFunction
from memscal.errors import InputError
from memscal.model.checks import Message
from memscal.model.indenter import Sphere
from memscal.model.measured_stress import MeasuredScan, MeasuredStress
from memscal.model.scan import Scan
from memscal.model.validation import require_non_negative

__all__ = ["require_contacts", "require_macroscopic", "same_apparatus", "scans_of"]


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
