"""Process and quality groups of a result: what was done and how well it went."""

from __future__ import annotations

import re

from memscal.errors import InputError
from memscal.formats.codec import read_record, write_record
from memscal.formats.fields import json_value
from memscal.formats.hdf5_reader import SafeFile
from memscal.formats.json_text import to_json
from memscal.formats.tree import Group, Node
from memscal.model import records
from memscal.model.checks import QualityCheck
from memscal.model.provenance import Process

__all__ = ["process_group", "quality_group", "read_process", "read_quality"]

_NOT_STATED = {"program": "", "version": "", "date": ""}


def process_group(process: Process) -> Group:
    """Return what was done as an NXprocess with its notes."""
    return write_record(records.PROCESS, process)


def read_process(file: SafeFile, path: str) -> Process:
    """Read what was done."""
    return Process(**read_record(records.PROCESS, file, path, defaults=_NOT_STATED))


def quality_group(checks: tuple[QualityCheck, ...]) -> Group:
    """Return the quality checks, one NXcollection each; ``names`` keeps their order."""
    children: dict[str, Node] = {}
    for check in checks:
        name = re.sub(r"[^a-z0-9_]+", "_", check.name.lower()).strip("_")
        if not name or name in children:
            raise InputError(f'Two quality checks would be stored as "{name}".')
        children[name] = write_record(records.CHECK, check)
    listed = to_json("quality checks", list(children))
    return Group("NXcollection", {"names": listed, **children})


def read_quality(file: SafeFile, path: str) -> tuple[QualityCheck, ...]:
    """Read the quality checks, in their order."""
    names = [str(name) for name in json_value(file, f"{path}/names", list, [])]
    return tuple(
        QualityCheck(
            **read_record(
                records.CHECK, file, f"{path}/{name}", defaults={"name": name, "meaning": ""}
            )
        )
        for name in names
    )
