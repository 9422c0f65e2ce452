"""Scans of contacts, or the stress measured of them, as objects or as the paths of their files."""

from collections.abc import Sequence
from os import PathLike
from typing import TypeAlias

from memscal.formats.files import FilePath
from memscal.formats.hdf5.reader import open_hdf5
from memscal.formats.hdf5.writer import SCHEMA_ATTRIBUTE, STRESS_SCHEMA
from memscal.formats.opened import contents_of, listed_items, opened_scan, require_different
from memscal.formats.scan import scan_from
from memscal.formats.stress import stress_from
from memscal.model.measured_stress import MeasuredStress
from memscal.model.scan import Scan

Contacts: TypeAlias = Scan | MeasuredStress | FilePath | Sequence[Scan | MeasuredStress | FilePath]
"""Scans, or the stress that was measured of them; each itself or as the path of its file."""


def opened_contacts(
    contacts: Contacts, *, accept_altered: bool = False
) -> tuple[Scan | MeasuredStress, ...]:
    """Return scans and measured stresses that are given themselves or as paths, at least one."""
    opened: list[Scan | MeasuredStress] = []
    for item in listed_items(contacts):
        if isinstance(item, MeasuredStress):
            opened.append(item)
        elif isinstance(item, str | PathLike):
            with open_hdf5(item, accept_altered=accept_altered) as file:
                is_stress = file.attribute("/", SCHEMA_ATTRIBUTE) == STRESS_SCHEMA
                opened.append(stress_from(file) if is_stress else scan_from(file))
        else:
            opened.append(opened_scan(item))
    if len(opened) > 1:
        require_different(contents_of(item) for item in opened if isinstance(item, Scan))
    return tuple(opened)
