"""The guard around meshio: a child process with limits of time and memory that sees one file.

meshio does not check what a file claims.  It runs on a copy in a folder of its own and returns
plain arrays, never pickles.
"""

from __future__ import annotations

import contextlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from memscal.errors import FormatError, InputError, UnsafeFileError
from memscal.formats.files import read_bytes
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.model.notation import printable
from memscal.model.provenance import SourceFile

_WORKER = Path(__file__).with_name("worker.py")
_MAX_ANSWER_BYTES = 512 * 2**20
# Of the child: for the libraries and a small mesh, and more for each byte of the file.
_MEMORY, _MEMORY_PER_BYTE = 2**30, 20
_SECONDS, _BYTES_PER_SECOND = 60.0, 2**20
# Whatever else is in the environment is not for a process that reads files of others.
_ENVIRONMENT = ("LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "PATH", "SYSTEMROOT")
_MAX_REASON = 400
_MAX_SHOWN = 80
_HDF5_ENDINGS = (".h5", ".hdf5", ".hdf")
# The address of an array in another file, such as film.h5:/data0, where XDMF has numbers.
_ADDRESS = re.compile(rb"<DataItem\b[^<>]{0,1000}>\s{0,200}([^<>:]{0,200}):([^<>]{1,500})<")
_AS_VTU = (
    "Open it in ParaView and save it as an unstructured grid (.vtu), or get it again from where "
    "it came from."
)


def heavy_arrays(
    data: bytes, path: str
) -> tuple[dict[str, np.ndarray[Any, Any]], list[SourceFile]]:
    """Return the arrays that an XDMF file has in the HDF5 file beside it, by their addresses."""
    folder, name = os.path.split(path)
    stem = os.path.splitext(name)[0]
    arrays = {}
    files: dict[str, SafeFile] = {}
    with contextlib.ExitStack() as opened:
        for address in _ADDRESS.finditer(data):
            words = [text.decode("utf-8", "replace").strip() for text in address.groups()]
            file_name, inside = words[0], "/" + words[1].strip("/")
            file_stem, ending = os.path.splitext(file_name)
            if file_stem != stem or ending.lower() not in _HDF5_ENDINGS:
                raise UnsafeFileError(
                    f"{name} takes its numbers from {printable(file_name, _MAX_SHOWN)!r}, which is "
                    "not read.",
                    why="Any file could be read through it: only the HDF5 file of the same name "
                    "in the same folder is.",
                    cure=f"Name it {stem}.h5, here and in the XDMF file, or save the mesh in one "
                    "file (.vtu).",
                )
            if file_name not in files:
                files[file_name] = opened.enter_context(open_hdf5(os.path.join(folder, file_name)))
            arrays[f"{file_name}:{inside}"] = files[file_name].array(inside)
    return arrays, [file.source for file in files.values()]


def run_meshio(
    data: bytes, kind: str, name: str, heavy: Mapping[str, np.ndarray[Any, Any]]
) -> tuple[dict[str, Any], list[np.ndarray[Any, Any]]]:
    """Return what meshio makes of a mesh: a header, and the arrays that it numbers."""
    size = len(data) + sum(values.nbytes for values in heavy.values())
    seconds = _SECONDS + size / _BYTES_PER_SECOND
    request = {
        "kind": kind,
        "heavy": list(heavy),
        "path": [os.path.abspath(folder) for folder in sys.path],
        "memory": _MEMORY + _MEMORY_PER_BYTE * size,
        "seconds": int(seconds) + 1,
        "output": _MAX_ANSWER_BYTES,
    }
    with tempfile.TemporaryDirectory(prefix="memscal-") as folder:
        place = Path(folder)
        (place / f"mesh.{kind}").write_bytes(data)
        if heavy:
            np.savez(place / "heavy.npz", *heavy.values())
        _run(json.dumps(request), folder, seconds, name)
        answer = io.BytesIO(read_bytes(place / "answer", limit=_MAX_ANSWER_BYTES + 2**20))
    header = json.loads(np.load(answer, allow_pickle=False).tobytes())
    if "error" in header:
        kind_of_error = UnsafeFileError if header["unsafe"] else FormatError
        raise kind_of_error(
            f"{name} cannot be read as a mesh.",
            why=f"The reader says: {printable(header['error'], _MAX_REASON)}.",
            cure=_AS_VTU,
        )
    numbers = []
    while answer.tell() < len(answer.getbuffer()):
        numbers.append(np.load(answer, allow_pickle=False))
    return header, numbers


def _run(request: str, folder: str, seconds: float, name: str) -> None:
    """Run the worker to its end, in a folder, within a limit of time by the clock."""
    environment = {key: os.environ[key] for key in _ENVIRONMENT if key in os.environ}
    try:
        done = subprocess.run(
            # Isolated: the environment and the folder add no modules; the path is in the request.
            [sys.executable, "-I", "-B", str(_WORKER)],
            input=request.encode(),
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            cwd=folder,
            # Each thread of numpy's library would take its share of the limited memory.
            env={**environment, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
            timeout=seconds,
            check=False,
        )
        late = -done.returncode == getattr(signal, "SIGXCPU", None)
    except subprocess.TimeoutExpired:
        late = True
    except OSError as error:
        raise InputError(
            "A mesh is read by a process of its own, which cannot be started.",
            why=f"The system says: {error.strerror or error}.",
            cure="Run memscal where Python may start itself.",
        ) from error
    if late:
        raise UnsafeFileError(
            f"Reading {name} takes longer than {seconds:.3g} s.", why="It was ended.", cure=_AS_VTU
        )
    if done.returncode:
        raise UnsafeFileError(
            f"The process that read {name} was ended by an error ({done.returncode}).",
            why="The mesh is damaged, or larger than the memory that its file's size allows.",
            cure=_AS_VTU,
        )
