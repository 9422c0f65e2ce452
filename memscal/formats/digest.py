"""The content digest, which shows whether a file still holds what was written into it.

Beside the data every file of ours lists what it holds (``/entry/contents``): each path with
the names of its attributes.  The digest goes over the paths in alphabetical order, one line
of JSON for each: path, type, shape, attributes, and the SHA-256 of the values as little-endian
64-bit numbers or UTF-8 text.  A reader can follow the list by known paths, without listing a
group.  What other programs add under names that the reader does not know stays unread; at a path
that it knows but the list lacks, it is refused.  The digest shows accidents and careless edits; it
is not a signature.
"""

from __future__ import annotations

import hashlib
import json
from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from memscal.formats.text import printable
from memscal.formats.tree import Group, Node, Number, walk

__all__ = ["DigestItem", "content_digest", "contents_of", "tree_items"]

# Path, value (None for a group) and attributes.
DigestItem = tuple[str, "np.ndarray[Any, Any] | str | None", Mapping[str, Any]]


def content_digest(items: Iterable[DigestItem]) -> str:
    """Return the SHA-256 over paths, values and attributes, as hexadecimal text."""
    total = hashlib.sha256()
    for path, value, attributes in items:
        kind, shape, data = _canonical(value)
        plain = {name: _plain(attribute) for name, attribute in attributes.items()}
        line = json.dumps(
            [path, kind, shape, plain, hashlib.sha256(data).hexdigest()],
            sort_keys=True,
            separators=(",", ":"),
        )
        total.update(line.encode("ascii") + b"\n")
    return total.hexdigest()


def contents_of(root: Group) -> dict[str, list[str]]:
    """Return each path of a tree with the names of its attributes."""
    return {path: sorted(_attributes(node)) for path, node in walk(root)}


def tree_items(root: Group) -> Iterable[DigestItem]:
    """Yield what :func:`content_digest` needs from a tree that is about to be written."""
    for path, node in sorted(walk(root), key=lambda item: item[0]):
        if isinstance(node, Group):
            yield path, None, _attributes(node)
        elif isinstance(node, Number):
            yield path, node.values, _attributes(node)
        else:
            yield path, node, {}


def _attributes(node: Node) -> dict[str, Any]:
    if isinstance(node, Group):
        return node.all_attributes
    if isinstance(node, Number):
        return {"units": node.units, **node.attributes}
    return {}


def _canonical(value: Any) -> tuple[str, list[int], bytes]:
    if value is None:
        return "group", [], b""
    if isinstance(value, str):
        return "text", [], printable(value, len(value)).encode("utf-8", "replace")
    kind = "integer" if value.dtype.kind in "iu" else "float"
    stored = np.ascontiguousarray(value, dtype="<i8" if kind == "integer" else "<f8")
    return kind, list(value.shape), stored.tobytes()


def _plain(attribute: Any) -> Any:
    if isinstance(attribute, str):
        return printable(attribute, len(attribute))
    return list(attribute) if isinstance(attribute, tuple) else attribute
