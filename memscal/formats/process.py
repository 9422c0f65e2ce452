"""Process and quality groups of a result: what was done and how well it went."""

from __future__ import annotations

import re

from memscal.errors import InputError
from memscal.formats.fields import json_value
from memscal.formats.hdf5_reader import SafeFile
from memscal.formats.json_text import to_json
from memscal.formats.records import CHECK, PROCESS
from memscal.formats.tree import Group, Node
from memscal.model.apparatus import QualityCheck
from memscal.model.provenance import Process

__all__ = ["process_group", "quality_group", "read_process", "read_quality"]

_NOT_STATED = {"program": "", "version": "", "date": ""}


def process_group(process: Process) -> Group:
    """Return what was done as an NXprocess with its notes."""
    return PROCESS.write(process)


def read_process(file: SafeFile, path: str) -> Process:
    """Read what was done."""
    return Process(**PROCESS.read(file, path, defaults=_NOT_STATED))


def quality_group(checks: tuple[QualityCheck, ...]) -> Group:
    """Return the quality checks, one NXcollection each; ``names`` keeps their order."""
    children: dict[str, Node] = {}
    for check in checks:
        name = re.sub(r"[^a-z0-9_]+", "_", check.name.lower()).strip("_")
        if not name or name in children:
            raise InputError(f'Two quality checks would be stored as "{name}".')
        children[name] = CHECK.write(check)
    listed = to_json("quality checks", list(children))
    return Group("NXcollection", {"names": listed, **children})


def read_quality(file: SafeFile, path: str) -> tuple[QualityCheck, ...]:
    """Read the quality checks, in their order."""
    names = [str(name) for name in json_value(file, f"{path}/names", list, [])]
    return tuple(
        QualityCheck(**CHECK.read(file, f"{path}/{name}", defaults={"name": name, "meaning": ""}))
        for name in names
    )
