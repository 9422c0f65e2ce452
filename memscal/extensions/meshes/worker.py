"""The child process that reads a mesh with meshio, within limits, and sees no other file.

It imports nothing of memscal.  Request and mesh come on standard input; the answer is a sequence of
arrays in numpy's format, the first of which is text in JSON.
"""

import builtins
import contextlib
import io
import json
import os
import re
import sys
import types
import warnings
from collections.abc import Mapping
from typing import Any

_MOST_FILES = 32
_MOST_PRINTED = 300
_FORBIDDEN = {"ctypes", "ftplib", "pickle", "pty", "shutil", "socket", "subprocess", "urllib"}
# What an import does: modules that are needed late, such as an encoding, may still be loaded.
_ALLOWED = {"os.listdir", "os.scandir"}


def main() -> None:
    """Read the mesh of a request and write the answer."""
    given = sys.stdin.buffer
    request = json.loads(given.readline())
    limited = _limit(request["memory"], request["seconds"])
    sys.path[:] = request["path"]
    import numpy as np

    packed = io.BytesIO(given.read(request["packed"]))
    with np.load(packed, allow_pickle=False) as stored:
        heavy = {address: stored[f"arr_{i}"] for i, address in enumerate(request["heavy"])}
    _stand_in_for_h5py(heavy)
    import meshio

    # numpy takes what has a file's methods for a file, in which it would have to seek.
    answer = types.SimpleNamespace(write=open(os.dup(1), "wb").write)  # noqa: SIM115 - to the end
    arrays: list[Any] = []
    _forbid_files()
    try:
        printed, mesh = _read(meshio, request["kind"], given)
        header = {**_described(mesh, arrays), "printed": printed, "limited": limited}
        if sum(values.nbytes for values in arrays) > request["output"]:
            raise MemoryError
    except BaseException as error:  # noqa: BLE001 - meshio ends the program on some files
        arrays = []
        header = _failure(error, request["memory"])
    np.save(answer, np.frombuffer(json.dumps(header).encode(), np.uint8))
    for values in arrays:
        np.save(answer, values, allow_pickle=False)


def _failure(error: BaseException, memory: int) -> dict[str, Any]:
    """Return why a mesh was not read, and whether the file tried what no mesh needs."""
    if isinstance(error, MemoryError):
        return {"error": f"its numbers take more than {memory // 2**20:,} MB", "unsafe": True}
    words = " ".join(str(error).split())[:_MOST_PRINTED]
    if isinstance(error, ValueError | PermissionError) and words:
        return {"error": words, "unsafe": isinstance(error, PermissionError)}
    form = f"{type(error).__name__}: {words}" if words else "it is of a form that is not known"
    return {"error": form, "unsafe": False}


def _limit(memory: int, seconds: int) -> bool:
    """Limit what this process may take; return whether the system limits memory at all."""
    try:
        import resource
    except ImportError:
        return False
    limited = sys.platform != "darwin"  # which accepts a limit and does not keep to it
    for name, value in (
        ("RLIMIT_CORE", 0),
        ("RLIMIT_CPU", seconds),
        ("RLIMIT_FSIZE", 0),
        ("RLIMIT_NOFILE", _MOST_FILES),
        ("RLIMIT_AS", memory),
    ):
        kind = getattr(resource, name)
        hard = resource.getrlimit(kind)[1]
        soft = value if hard == resource.RLIM_INFINITY else min(value, hard)
        try:
            # A hard limit of time at the soft one would kill without a word of the reason.
            resource.setrlimit(kind, (soft, soft + 1 if name == "RLIMIT_CPU" else soft))
        except (ValueError, OSError):
            limited = limited and name != "RLIMIT_AS"
    return limited


def _forbid_files() -> None:
    """Refuse from now on whatever is not a Python module: files, network, programs."""
    folders = tuple(os.path.join(os.path.abspath(folder), "") for folder in sys.path)

    def watch(event: str, arguments: tuple[Any, ...]) -> None:
        if event == "open":
            path, mode, flags = arguments
            if isinstance(path, int):
                return
            name = os.fsdecode(path)
            reading = not flags & (os.O_WRONLY | os.O_RDWR) and not set(mode or "r") & set("wax+")
            module = name.endswith((".py", ".pyc")) and name.startswith(folders)
            if not (reading and module):
                raise PermissionError(f"it asks for the file {name}, which no mesh needs")
        elif event.partition(".")[0] in _FORBIDDEN or (
            event.startswith("os.") and event not in _ALLOWED
        ):
            raise PermissionError(f"it asks for {event}, which no mesh needs")

    sys.addaudithook(watch)


def _stand_in_for_h5py(heavy: Mapping[str, Any]) -> None:
    """Let meshio find, where it looks for h5py, the arrays that were read for it beforehand."""

    class Node:
        def __init__(self, path: str) -> None:
            self.path = path

        def __getitem__(self, key: str | tuple[()]) -> Any:
            if isinstance(key, str):
                return Node(f"{self.path}/{key}")
            if self.path not in heavy:
                raise PermissionError(f"it takes its numbers from {self.path}, which is not read")
            return heavy[self.path]

    module = types.ModuleType("h5py")
    module.__dict__["File"] = lambda path, *_: Node(f"{os.path.basename(path)}:")
    sys.modules["h5py"] = module


def _read(meshio: Any, kind: str, given: Any) -> tuple[str, Any]:
    """Return what meshio prints about a mesh, and the mesh."""
    printed = io.StringIO()
    with (
        warnings.catch_warnings(),
        contextlib.redirect_stdout(printed),
        contextlib.redirect_stderr(printed),
    ):
        warnings.simplefilter("ignore")
        # numpy only warns of text that is not a number, and cuts the array short.
        warnings.filterwarnings("error", message="string or file could not be read")
        path = f"mesh.{kind}"
        # The mesh has no name: it is what stands in the standard input. numpy reads binary VTK
        # from a file alone, and a VTU file is opened a second time where it holds raw bytes.
        data = b"" if kind == "vtk" else given.read()
        _require_plain(data)
        opener = builtins.open

        def stand_in(file: Any, *arguments: Any, **options: Any) -> Any:
            if file != path:
                return opener(file, *arguments, **options)
            return given if kind == "vtk" else io.BytesIO(data)

        vars(builtins)["open"] = stand_in
        try:
            mesh = getattr(meshio, kind).read(path)
        except SystemExit as error:
            raise ValueError(printed.getvalue()) from error
    return " ".join(printed.getvalue().split())[:_MOST_PRINTED], mesh


def _require_plain(data: bytes) -> None:
    """Refuse XML that declares entities, and pieces, of which meshio would keep the last one."""
    if b"<!ENTITY" in data:
        raise PermissionError("it declares entities, which no mesh needs")
    pieces = len(re.findall(rb"<Piece\s", data))
    if pieces > 1:
        raise ValueError(f"it holds {pieces} pieces, and only a mesh in one piece is read")


def _described(mesh: Any, arrays: list[Any]) -> dict[str, Any]:
    """Put the numbers of a mesh into arrays, and return which of them is what."""
    import numpy as np

    def add(values: Any) -> int:
        arrays.append(np.asarray(values))
        return len(arrays) - 1

    def fields(named: Mapping[str, Any]) -> dict[str, int]:
        return {name: add(v) for name, v in named.items() if np.asarray(v).dtype.kind in "iuf"}

    if any(block.type.startswith("polyhedron") for block in mesh.cells):
        raise ValueError("it has polyhedra for cells: cut them into tetrahedra")
    cells = []
    for i, block in enumerate(mesh.cells):
        data = fields({name: blocks[i] for name, blocks in mesh.cell_data.items()})
        cells.append({"dimension": int(block.dim), "nodes": add(block.data), "data": data})
    return {"points": add(mesh.points), "point_data": fields(mesh.point_data), "cells": cells}


if __name__ == "__main__":
    main()
