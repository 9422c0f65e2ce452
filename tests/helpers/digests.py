"""Digests of files that a test has changed."""

from pathlib import Path

import h5py

from memscal.formats.digest import stored_items
from memscal.formats.hdf5.reader import open_hdf5
from memscal.formats.hdf5.writer import CONTENTS_PATH, DIGEST_ATTRIBUTE, content_digest


def rewrite_digest(path: Path):
    """Give a file the digest that a program which wrote its contents would have written."""
    with open_hdf5(path) as safe:
        digest = content_digest(stored_items(safe, safe.json_value(CONTENTS_PATH, dict, {})))
    with h5py.File(path, "r+") as file:
        file.attrs[DIGEST_ATTRIBUTE] = digest
