"""Whether a file still holds what was written into it."""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

from memscal.errors import FormatError
from memscal.formats.digest import DigestItem, content_digest
from memscal.formats.fields import json_value
from memscal.formats.hdf5_reader import SafeFile
from memscal.formats.schema import CONTENTS_PATH, DIGEST_ATTRIBUTE

__all__ = ["altered", "stored_items"]

_PATH = re.compile(r"/|(?:/[a-z][a-z0-9_]*)+")


def altered(file: SafeFile) -> str:
    """Return how a file differs from what was written, or ``""`` where it does not.

    A file without a digest counts as altered: every file of ours has one.  Of one that is not
    altered only what it lists can be read from here on; what was added is refused by its path.
    """
    stated = file.attribute("/", DIGEST_ATTRIBUTE)
    if stated is None:
        return f"its root attribute {DIGEST_ATTRIBUTE} is missing."
    contents = json_value(file, CONTENTS_PATH, dict, None)
    if contents is None:
        return f"the list of its contents ({CONTENTS_PATH}) is missing."
    missing = [path for path in contents if not (_PATH.fullmatch(path) and file.has(path))]
    if missing:
        return f"{missing[0]} is missing."
    if content_digest(stored_items(file, contents)) != stated:
        return "its content does not fit its digest."
    file.limit_to(contents)
    return ""


def stored_items(file: SafeFile, contents: dict[str, Any]) -> Iterator[DigestItem]:
    """Yield what the list of contents names, as it stands in the file."""
    for path, names in sorted(contents.items()):
        if not isinstance(names, list):
            raise FormatError(f"{file.where(CONTENTS_PATH)} does not list attributes for {path}.")
        attributes = {str(name): file.attribute(path, str(name)) for name in names}
        if file.is_group(path):
            yield path, None, attributes
        elif file.is_text(path):
            yield path, file.text(path), attributes
        else:
            yield path, file.array(path), attributes
