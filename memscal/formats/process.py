"""What was done and how well it went: the process and quality groups of an artifact."""

from __future__ import annotations

import re
from collections.abc import Mapping
from typing import Any

from memscal.errors import InputError
from memscal.formats.fields import (
    json_value,
    optional_scalar,
    optional_text,
    require_scalar,
    require_text,
)
from memscal.formats.hdf5_reader import SafeFile
from memscal.formats.json_text import to_json
from memscal.formats.tree import Group, Node, count, note, si
from memscal.model.checks import QualityCheck, messages_from_json, messages_to_json
from memscal.model.provenance import Process, SourceFile

__all__ = ["process_group", "quality_group", "read_process", "read_quality"]

_JSON = "application/json"
_NOTES = {
    "configuration": "Every option with its value.",
    "environment": "Versions of Python and of the numerical libraries.",
}
_INPUTS = ("input_scan", "input_reference")


def process_group(process: Process) -> Group:
    """Return what was done as an NXprocess with its notes."""
    texts = {"program": process.program, "version": process.version, "date": process.date}
    children: dict[str, Node] = {name: text for name, text in texts.items() if text}
    for name, description in _NOTES.items():
        value: Mapping[str, Any] = getattr(process, name)
        text = to_json(name, value)
        children[name] = note(text, media_type=_JSON, description=description)
    messages = to_json("messages", messages_to_json(process.messages))
    children["messages"] = note(
        messages, media_type=_JSON, description="What the user was told while it ran."
    )
    for name in _INPUTS:
        source: SourceFile | None = getattr(process, name)
        if source is not None:
            children[name] = Group(
                "NXnote",
                {
                    "file_name": source.file_name,
                    "checksum": source.sha256,
                    "algorithm": "sha256",
                },
            )
    return Group("NXprocess", children)


def read_process(file: SafeFile, path: str) -> Process:
    """Read what was done."""
    return Process(
        program=optional_text(file, f"{path}/program"),
        version=optional_text(file, f"{path}/version"),
        date=optional_text(file, f"{path}/date"),
        configuration=json_value(file, f"{path}/configuration/data", dict, {}),
        environment=json_value(file, f"{path}/environment/data", dict, {}),
        messages=messages_from_json(json_value(file, f"{path}/messages/data", list, [])),
        input_scan=_read_input(file, f"{path}/input_scan"),
        input_reference=_read_input(file, f"{path}/input_reference"),
    )


def _read_input(file: SafeFile, path: str) -> SourceFile | None:
    if not file.has(path):
        return None
    return SourceFile(
        require_text(file, f"{path}/file_name"), require_text(file, f"{path}/checksum")
    )


def quality_group(checks: tuple[QualityCheck, ...]) -> Group:
    """Return the quality checks, one NXcollection each; ``groups`` keeps their order."""
    children: dict[str, Node] = {}
    for check in checks:
        name = re.sub(r"[^a-z0-9_]+", "_", check.name.lower()).strip("_")
        if not name or name in children:
            raise InputError(f'Two quality checks would be stored as "{name}".')
        found: dict[str, Node] = {
            "name": check.name,
            "value": si(check.value, "dimensionless"),
            "limit": si(check.limit, "dimensionless"),
            "passed": count(int(check.passed)),
            "meaning": check.meaning,
        }
        if check.p_value is not None:
            found["p_value"] = si(check.p_value, "dimensionless")
        children[name] = Group("NXcollection", found)
    listed = to_json("quality checks", list(children))
    return Group("NXcollection", {"names": listed, **children})


def read_quality(file: SafeFile, path: str) -> tuple[QualityCheck, ...]:
    """Read the quality checks, in their order."""
    checks = []
    for name in json_value(file, f"{path}/names", list, []):
        group = f"{path}/{name}"
        checks.append(
            QualityCheck(
                name=optional_text(file, f"{group}/name", str(name)),
                value=require_scalar(file, f"{group}/value", "dimensionless"),
                limit=require_scalar(file, f"{group}/limit", "dimensionless"),
                passed=bool(require_scalar(file, f"{group}/passed", "dimensionless")),
                meaning=optional_text(file, f"{group}/meaning"),
                p_value=optional_scalar(file, f"{group}/p_value", "dimensionless"),
            )
        )
    return tuple(checks)
