"""Codec between records and groups of a file: it writes, reads and lists what a table declares."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from memscal.errors import FormatError
from memscal.formats.hdf5.reader import SafeFile
from memscal.formats.hdf5.writer import Attribute, Group, Node, count, index_axis, note, si, to_json
from memscal.formats.values import json_value, require_array, require_scalar, require_text
from memscal.model.checks import messages_from_json, messages_to_json
from memscal.model.provenance import SourceFile
from memscal.model.quantities import Quantity, Record

_NOTHING: Mapping[str, Any] = MappingProxyType({})


@dataclass(frozen=True)
class Kind:
    """How a quantity that is no number is written (if not empty, or ``always``) and read."""

    write: Callable[[Quantity, Any], Node]
    read: Callable[[SafeFile, str], Any]
    always: bool = False
    inside: str = ""


def _write_json_note(quantity: Quantity, value: Any) -> Group:
    text = to_json(quantity.name, value)
    return note(text, media_type="application/json", description=quantity.words)


def write_source(source: SourceFile) -> Group:
    """Return the name and the checksum of a file that was read as an NXnote."""
    named = {"file_name": source.file_name, "checksum": source.sha256, "algorithm": "sha256"}
    return Group("NXnote", named)


def read_source(file: SafeFile, path: str) -> SourceFile:
    """Read the name and the checksum of a file that was read."""
    name, checksum = (require_text(file, f"{path}/{key}") for key in ("file_name", "checksum"))
    return SourceFile(name, checksum)


KINDS = {
    "text": Kind(lambda _, text: str(text), require_text),
    "note": Kind(lambda _, text: note(text), require_text, inside="/data"),
    "truth": Kind(
        lambda _, truth: count(int(truth)),
        lambda file, path: bool(require_scalar(file, path, "dimensionless")),
        always=True,
    ),
    "mapping": Kind(
        _write_json_note, lambda file, path: json_value(file, path, dict, {}), True, "/data"
    ),
    "messages": Kind(
        lambda quantity, messages: _write_json_note(quantity, messages_to_json(messages)),
        lambda file, path: messages_from_json(json_value(file, path, list, [])),
        True,
        "/data",
    ),
    "file": Kind(lambda _, source: write_source(source), read_source),
}
"""Kinds of quantity beside the numbers, by :attr:`Quantity.dimension`."""


def write_record(record: Record, stated: object, **others: Node) -> Group:
    """Return the group of an object or a mapping; an axis that is no quantity counts from 0."""
    children: dict[str, Node] = {}
    keys = {quantity.key for quantity in record.quantities}
    for quantity in record.quantities:
        name = quantity.name
        value = stated[name] if isinstance(stated, Mapping) else getattr(stated, name)
        kind = KINDS.get(quantity.dimension)
        if value is not None and kind is None:
            for axis, size in zip(quantity.axes, np.shape(value), strict=True):
                if axis not in keys:
                    children.setdefault(axis, index_axis(axis, size))
            children[quantity.key] = si(value, quantity.dimension, quantity.axes)
        elif value is not None and kind is not None and (value or kind.always):
            children[quantity.key] = kind.write(quantity, value)
    plot: dict[str, Attribute] = {}
    if record.signal:
        plot = {"signal": record.signal, "axes": record.axes}
    return Group(record.nx_class, children | others, plot)


def read_record(
    record: Record,
    file: SafeFile,
    path: str,
    *,
    defaults: Mapping[str, Any] = _NOTHING,
    sizes: Mapping[str, int] = _NOTHING,
) -> dict[str, Any]:
    """Return the values at a path, in SI units, by name; ``sizes`` are of axes known before."""
    values = dict(defaults)
    lengths = dict(sizes)
    for at, quantity in _paths(record, path):
        if file.has(at) or (quantity.required and quantity.name not in defaults):
            values[quantity.name] = _read(file, at, quantity, lengths)
    return values


def listed(record: Record, file: SafeFile, path: str) -> Iterator[tuple[str, Quantity]]:
    """Yield the path of each quantity that a file holds, with its declaration."""
    return ((at, quantity) for at, quantity in _paths(record, path) if file.has(at))


def _paths(record: Record, path: str) -> Iterator[tuple[str, Quantity]]:
    """Yield where each quantity stands; an attribute that is stored twice is read once."""
    names: set[str] = set()
    for quantity in record.quantities:
        if quantity.name not in names:
            names.add(quantity.name)
            kind = KINDS.get(quantity.dimension)
            yield f"{path}/{quantity.key}{kind.inside if kind else ''}", quantity


def _read(file: SafeFile, at: str, quantity: Quantity, lengths: dict[str, int]) -> Any:
    kind = KINDS.get(quantity.dimension)
    if kind is not None:
        return kind.read(file, at)
    if not quantity.axes:
        return require_scalar(file, at, quantity.dimension)
    values = require_array(file, at, quantity.dimension, ndim=len(quantity.axes))
    axes = [axis.removesuffix("_prime") for axis in quantity.axes]
    shape = tuple(lengths.setdefault(a, n) for a, n in zip(axes, values.shape, strict=True))
    if values.shape != shape:
        raise FormatError(
            f"{file.where(at)} has shape {values.shape}, but its axes give {shape}.",
            cure="Write the file again.",
        )
    return values


def origins(file: SafeFile, paths: Iterable[tuple[str, Quantity]]) -> dict[str, Any]:
    """Return the origin of a file as its quantities state it, by their names; JSON notes last."""
    texts: dict[str, Any] = {}
    notes: dict[str, Any] = {}
    for at, quantity in paths:
        value = KINDS[quantity.dimension].read(file, at)
        if isinstance(value, SourceFile):
            texts |= {quantity.origin: value.file_name, f"{quantity.origin}_sha256": value.sha256}
        elif isinstance(value, str):
            texts[quantity.origin] = value
        else:
            of_messages = quantity.dimension == "messages"
            notes[quantity.origin] = [item.text for item in value] if of_messages else value
    return texts | notes
