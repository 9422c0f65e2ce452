"""The one HDF5 writer, its schemas and their version; a tree becomes bytes, and they a file."""

import hashlib
import json
import math
import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import field, replace
from io import BytesIO
from typing import Any

import h5py
import numpy as np
from numpy.typing import ArrayLike, NDArray

from memscal.errors import InputError
from memscal.formats.files import FilePath, atomic_write_bytes
from memscal.formats.hdf5.limits import most_held
from memscal.formats.units import from_si
from memscal.model.arrays import Axes, Values, array_record
from memscal.model.notation import printable
from memscal.model.sizes import too_large

SCAN_SCHEMA = "memscal-scan"
REFERENCE_SCHEMA = "memscal-reference"
ARTIFACT_SCHEMA = "memscal-artifact"
STRESS_SCHEMA = "memscal-stress"
ARRAY_SCHEMA = "memscal-array"
SCHEMA_VERSION = "1.2.0"
#: Those with an application definition, in ``formats/definitions``.
DEFINED = (SCAN_SCHEMA, REFERENCE_SCHEMA, ARTIFACT_SCHEMA, STRESS_SCHEMA, ARRAY_SCHEMA)

SCHEMA_ATTRIBUTE = "memscal_schema"
VERSION_ATTRIBUTE = "memscal_schema_version"
DIGEST_ATTRIBUTE = "memscal_content_sha256"

# The list of what was written: a reader can follow it without ever listing a group.
CONTENTS_PATH = "/entry/contents/data"

Attributes = Mapping[str, str | int | Axes]


@array_record
class Number:
    """A scalar or array in the unit of the file; ``axes`` names its axes, found in its group."""

    values: NDArray[np.float64] | NDArray[np.int64]
    units: str
    axes: Axes = ()
    attributes: Attributes = field(default_factory=dict)


@array_record
class Text:
    """A string with attributes; one without is a plain ``str``."""

    value: str
    attributes: Attributes


@array_record
class Group:
    """A NeXus group: its class, children by name, and attributes."""

    nx_class: str
    children: Mapping[str, "Node"]
    attributes: Attributes = field(default_factory=dict)


Node = Group | Number | Text | str

Nodes = dict[str, Node]
"""Nodes of a group by their names."""


def si(values: ArrayLike, dimension: str, axes: Axes = ()) -> Number:
    """Return SI values as a number in the unit that our files use for their dimension."""
    return Number(*from_si(values, dimension), axes)


def count(value: int) -> Number:
    """Return a whole number, or a truth value as 0 or 1."""
    return Number(np.asarray(value, dtype=np.int64), "1")


def index_axis(name: str, size: int) -> Number:
    """Return an axis that only counts: repeats, or the parameters of a covariance."""
    return Number(np.arange(size, dtype=np.int64), "1", (name,))


def note(text: str, *, media_type: str = "text/plain", description: str = "") -> Group:
    """Return text as an NXnote."""
    children = {"type": media_type, "data": text}
    if description:
        children["description"] = description
    return Group("NXnote", children)


def to_json(value: Any, subject: str = "A list") -> str:
    """Write plain values as JSON; numbers that are not finite become strings."""
    return json.dumps(_json_value(subject, value), sort_keys=True, allow_nan=False)


def _json_value(subject: str, value: Any) -> Any:
    if value is None or isinstance(value, (str, bool, int)):
        return value
    if isinstance(value, (np.generic, np.ndarray)):
        return _json_value(subject, value.tolist())
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    if isinstance(value, Mapping):
        return {str(key): _json_value(subject, item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_json_value(subject, item) for item in value]
    raise InputError(
        f"{subject} holds a value of type {type(value).__name__}, which JSON cannot hold.",
        cure="Give numbers, text, truth values, lists and mappings.",
    )


def walk(node: Node, path: str = "") -> Iterator[tuple[str, Node]]:
    """Yield every node with its path, parents first, the root as ``"/"``."""
    yield path or "/", node
    if isinstance(node, Group):
        for name, child in node.children.items():
            yield from walk(child, f"{path}/{name}")


# Path, value (None for a group) or node, and attributes.
DigestItem = tuple[str, "np.ndarray[Any, Any] | str | Node | None", Values]


def content_digest(items: Iterable[DigestItem]) -> str:
    """Return the SHA-256 over paths, values and attributes: it shows accidents, no forgery."""
    total = hashlib.sha256()
    for path, value, attributes in items:
        kind, shape, data = _canonical(value)
        texts = {n: printable(v, len(v)) for n, v in attributes.items() if isinstance(v, str)}
        item = [path, kind, shape, attributes | texts, hashlib.sha256(data).hexdigest()]
        line = json.dumps(item, sort_keys=True, separators=(",", ":"))
        total.update(line.encode("ascii") + b"\n")
    return total.hexdigest()


def _attributes(node: Node) -> Values:
    """Return the attributes; a group's begin with its class, an NXdata's end with its axes."""
    if isinstance(node, str):
        return {}
    if isinstance(node, Number):
        return {"units": node.units, **node.attributes}
    if isinstance(node, Text):
        return dict(node.attributes)
    axes = node.attributes.get("axes", ())
    assert isinstance(axes, tuple)
    indices = {f"{axis}_indices": i for i, axis in enumerate(axes)}
    return {"NX_class": node.nx_class, **node.attributes, **indices}


def _canonical(value: Any) -> tuple[str, list[int], bytes | memoryview]:
    if value is None or isinstance(value, Group):
        return "group", [], b""
    if isinstance(value, (str, Text)):
        return "text", [], _plain_text(value)
    value = value.values if isinstance(value, Number) else value
    kind = "integer" if value.dtype.kind in "iu" else "float"
    stored = np.ascontiguousarray(value, dtype="<i8" if kind == "integer" else "<f8")
    return kind, list(value.shape), stored.reshape(-1).data


_NAME = re.compile(r"[a-z][a-z0-9_]*")
_CONTENTS = "Every path that was written, with its attributes; memscal_content_sha256 covers them."
# Of variable length in UTF-8, as most programs write it.
_TEXT = h5py.string_dtype("utf-8")
# Below this a chunked and compressed dataset is larger than a plain one.
_COMPRESS_ABOVE = 4096
_COMPRESSION = {"compression": "gzip", "shuffle": True, "fletcher32": True, "chunks": True}


def file_tree(schema: str, entry: Group) -> Group:
    """Return the root of a file around its entry: schema, definition, contents and digest."""
    schemas = {SCHEMA_ATTRIBUTE: schema, VERSION_ATTRIBUTE: SCHEMA_VERSION}
    if schema in DEFINED:
        definition = Text(f"NX{schema.replace('-', '_')}", {"version": SCHEMA_VERSION})
        entry = replace(entry, children={"definition": definition, **entry.children})
    listed = _with_contents(entry, schemas, "")
    # The list names itself, so it is made once with a place for itself and once in full.
    contents = {path: sorted(_attributes(node)) for path, node in walk(listed)}
    listed = _with_contents(entry, schemas, to_json(contents))
    nodes = sorted(walk(listed), key=lambda item: item[0])
    digest = content_digest((path, node, _attributes(node)) for path, node in nodes)
    return replace(listed, attributes={**listed.attributes, DIGEST_ATTRIBUTE: digest})


def write_tree(root: Group, path: FilePath, *, overwrite: bool = False) -> None:
    """Write a tree as one HDF5 file, whole or not at all."""
    atomic_write_bytes(path, tree_to_bytes(root), overwrite=overwrite)


def tree_to_bytes(root: Group) -> bytes:
    """Return the HDF5 file of a tree; the same tree always gives the same bytes."""
    memory = BytesIO()
    with h5py.File(memory, "w", libver=("earliest", "v110")) as file:
        _write_group(file, root)
        _attach_scales(file, root)
    data = memory.getvalue()
    numbers = (node.values for _, node in walk(root) if isinstance(node, Number))
    held = max(len(data), sum(8 * np.size(values) for values in numbers))
    most = most_held(len(data))
    if held > most:
        raise too_large(
            "What is to be written",
            held,
            most,
            "bytes",
            why="The file could not be read again.",
            cure="Write fewer scans, loads or points into one file.",
        )
    return data


def _with_contents(entry: Group, schemas: dict[str, str], text: str) -> Group:
    listing = note(text, media_type="application/json", description=_CONTENTS)
    entry = replace(entry, children={**entry.children, "contents": listing})
    return Group("NXroot", {"entry": entry}, {"default": "entry", **schemas})


def _write_group(group: Any, node: Group) -> None:
    _write_attributes(group, node)
    for name, child in node.children.items():
        if not _NAME.fullmatch(name):
            raise InputError(
                f"{name!r} cannot be written into {group.name}: a name is lower-case ASCII.",
                cure="Use the letters a to z, digits and underscores.",
            )
        if isinstance(child, Group):
            _write_group(group.create_group(name), child)
        else:
            _write_dataset(group, name, child)


def _write_dataset(group: Any, name: str, node: Number | Text | str) -> None:
    # The dataset is closed on return: while it is open HDF5 lays the next ones out otherwise.
    if isinstance(node, Number):
        compressed = _COMPRESSION if node.values.nbytes > _COMPRESS_ABOVE else {}
        dataset = group.create_dataset(name, data=node.values, track_times=False, **compressed)
    else:
        text = _plain_text(node)
        dataset = group.create_dataset(name, data=text, dtype=_TEXT, track_times=False)
    _write_attributes(dataset, node)


def _write_attributes(item: Any, node: Node) -> None:
    for name, value in _attributes(node).items():
        if isinstance(value, int):
            item.attrs.create(name, value, dtype=np.int64)
        elif isinstance(value, tuple):
            texts = [_plain_text(text) for text in value]
            item.attrs.create(name, np.array(texts, dtype=object), dtype=_TEXT)
        else:
            item.attrs.create(name, _plain_text(value), dtype=_TEXT)


def _plain_text(text: str | Text) -> bytes:
    text = text.value if isinstance(text, Text) else text
    return printable(text, len(text)).encode("utf-8", "replace")


def _attach_scales(file: Any, root: Group) -> None:
    """Make every axis an HDF5 dimension scale and attach it to the arrays that run along it."""
    numbers = [(path.rpartition("/"), n.axes) for path, n in walk(root) if isinstance(n, Number)]
    for (folder, _, name), axes in numbers:
        if axes == (name,):
            file[f"{folder}/{name}"].make_scale(name)
    for (folder, _, name), axes in numbers:
        for i, axis in enumerate(axes if axes != (name,) else ()):
            file[f"{folder}/{name}"].dims[i].attach_scale(file[f"{folder}/{axis}"])
