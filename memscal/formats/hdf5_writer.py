"""The one HDF5 writer: a tree becomes bytes in memory, and the bytes a file in one step."""

from __future__ import annotations

import os
import re
from collections.abc import Iterable
from dataclasses import replace
from io import BytesIO
from typing import Any

import numpy as np

from memscal.errors import InputError
from memscal.formats.atomic import atomic_write_bytes, ensure_writable
from memscal.formats.digest import content_digest, contents_of, tree_items
from memscal.formats.json_text import to_json
from memscal.formats.schema import (
    DIGEST_ATTRIBUTE,
    SCHEMA_ATTRIBUTE,
    SCHEMA_VERSION,
    VERSION_ATTRIBUTE,
)
from memscal.formats.text import printable
from memscal.formats.tree import Attribute, Group, Number, note, walk

__all__ = ["ensure_writable", "file_tree", "tree_to_bytes", "write_tree"]

_NAME = re.compile(r"[a-z][a-z0-9_]*")
_CONTENTS = "Every path that was written, with its attributes; memscal_content_sha256 covers them."
# Below this a chunked and compressed dataset is larger than a plain one.
_COMPRESS_ABOVE = 4096


def file_tree(schema: str, entry: Group) -> Group:
    """Return the root of a file around its entry: schema, contents list and digest."""
    root = Group(
        "NXroot",
        {"entry": entry},
        {"default": "entry", SCHEMA_ATTRIBUTE: schema, VERSION_ATTRIBUTE: SCHEMA_VERSION},
    )
    listed = _with_contents(root, "")
    # The list names itself, so it is made once with a place for itself and once in full.
    listed = _with_contents(root, to_json("contents", contents_of(listed)))
    digest = content_digest(tree_items(listed))
    return replace(listed, attributes={**listed.attributes, DIGEST_ATTRIBUTE: digest})


def write_tree(
    root: Group,
    path: str | os.PathLike[str],
    *,
    overwrite: bool = False,
    inputs: Iterable[str | os.PathLike[str]] = (),
) -> None:
    """Write a tree as one HDF5 file, whole or not at all.

    Raises
    ------
    OutputError
        If the file exists (and ``overwrite`` is false), is an input, or cannot be written.
    """
    atomic_write_bytes(path, tree_to_bytes(root), overwrite=overwrite, inputs=inputs)


def tree_to_bytes(root: Group) -> bytes:
    """Return the HDF5 file of a tree; the same tree always gives the same bytes."""
    from memscal.formats.hdf5_library import h5py

    memory = BytesIO()
    with h5py.File(memory, "w", libver=("earliest", "v110")) as file:
        for path, node in walk(root):
            if isinstance(node, Group):
                _check_names(path, node)
                group = file if path == "/" else file.create_group(path)
                for name, value in node.all_attributes.items():
                    _write_attribute(group, name, value)
            elif isinstance(node, Number):
                _write_number(file, path, node)
            else:
                _write_text(file, path, node)
        _attach_scales(file, root)
    return memory.getvalue()


def _check_names(path: str, group: Group) -> None:
    for name in group.children:
        if not _NAME.fullmatch(name):
            raise InputError(
                f"{name!r} cannot be written into {path}: a name is lower-case ASCII.",
                cure="Use the letters a to z, digits and underscores.",
            )


def _with_contents(root: Group, text: str) -> Group:
    entry = root.children["entry"]
    assert isinstance(entry, Group)
    listing = note(text, media_type="application/json", description=_CONTENTS)
    entry = replace(entry, children={**entry.children, "contents": listing})
    return replace(root, children={**root.children, "entry": entry})


def _write_number(file: Any, path: str, node: Number) -> None:
    storage: dict[str, Any] = {}
    if node.values.nbytes > _COMPRESS_ABOVE:
        storage = {"compression": "gzip", "shuffle": True, "fletcher32": True, "chunks": True}
    dataset = file.create_dataset(path, data=node.values, track_times=False, **storage)
    for name, value in {"units": node.units, **node.attributes}.items():
        _write_attribute(dataset, name, value)


def _write_text(file: Any, path: str, text: str) -> None:
    file.create_dataset(path, data=_plain_text(text), dtype=_text_type(), track_times=False)


def _write_attribute(item: Any, name: str, value: Attribute) -> None:
    if isinstance(value, int):
        item.attrs.create(name, value, dtype=np.int64)
    elif isinstance(value, tuple):
        texts = [_plain_text(text) for text in value]
        item.attrs.create(name, np.array(texts, dtype=object), dtype=_text_type())
    else:
        item.attrs.create(name, _plain_text(value), dtype=_text_type())


def _text_type() -> Any:
    """Text of variable length in UTF-8, as most programs write it."""
    from memscal.formats.hdf5_library import h5py

    return h5py.string_dtype("utf-8")


def _plain_text(text: str) -> bytes:
    return printable(text, len(text)).encode("utf-8", "replace")


def _attach_scales(file: Any, root: Group) -> None:
    """Make every axis an HDF5 dimension scale and attach it to the arrays that run along it."""
    arrays = [(p, n) for p, n in walk(root) if isinstance(n, Number) and n.axes]
    for path, node in arrays:
        folder, _, name = path.rpartition("/")
        if node.axes == (name,):
            file[path].make_scale(name)
    for path, node in arrays:
        folder, _, name = path.rpartition("/")
        if node.axes != (name,):
            for i, axis in enumerate(node.axes):
                file[path].dims[i].attach_scale(file[f"{folder}/{axis}"])
