"""NeXus definitions with our own among them, and what nexusformat finds against them in a file."""

import logging
import os
import shutil
from importlib.resources import files
from importlib.util import find_spec
from pathlib import Path

from memscal.formats.hdf5.writer import Group, walk

OURS = Path(str(files("memscal.formats"))) / "definitions"


def definitions_folder(folder: Path, package="nexusformat") -> Path:
    """Lay the definitions that a package brings, and ours, in a folder."""
    spec = find_spec(package)
    assert spec is not None
    assert spec.origin is not None
    theirs = Path(spec.origin).parent / "definitions"
    for kind in ("base_classes", "contributed_definitions"):
        shutil.copytree(theirs / kind, folder / kind)
    for schema in theirs.glob("*.xsd"):
        shutil.copy(schema, folder)
    shutil.copytree(OURS, folder / "applications", ignore=shutil.ignore_patterns("*.py"))
    return folder


def violations(path: Path, definitions: Path) -> list[str]:
    """Warnings and errors of a file against the application definition that it names."""
    from nexusformat.nexus.validate import logger, validate_application

    found = []
    handler = logging.Handler(logging.WARNING)
    handler.emit = lambda record: found.append(f"{record.levelname}: {record.getMessage()}")
    handlers = logger.handlers
    logger.handlers = [handler]
    logger.propagate = False
    try:
        counts = validate_application(os.fspath(path), definitions=os.fspath(definitions))
    finally:
        logger.handlers = handlers
    # It returns nothing where it cannot begin, and logs its own headings as critical.
    kept = [line for line in found if not line.startswith("CRITICAL")]
    return kept if counts == (0, 0) or kept else [f"{counts} warnings and errors"]


def structure(root: Group) -> frozenset[str]:
    """Paths and classes of a tree: files that differ in their numbers alone have the same."""
    return frozenset(
        f"{path} {node.nx_class if isinstance(node, Group) else type(node).__name__}"
        for path, node in walk(root)
    )
