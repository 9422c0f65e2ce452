"""Files of meshes with fields: VTU, legacy VTK and XDMF read, VTU written, all by meshio.

meshio does not check what a file claims.  It reads in a child process with limits of time and
memory, a copy without a name, and returns plain arrays, never pickles.
"""

import contextlib
import io
import json
import os
import re
import signal
import subprocess
import sys
import tempfile
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from memscal.errors import FormatError, InputError, OutputError, UnsafeFileError
from memscal.formats.files import FilePath, atomic_write_bytes, damage_named, read_bytes
from memscal.formats.hdf5.reader import open_hdf5
from memscal.formats.tables.sheets import installed
from memscal.formats.units import from_si
from memscal.model.arrays import Arrays, FloatArray, IndexArray, Values, array_record, floats
from memscal.model.field_mesh import FieldMesh
from memscal.model.notation import printable
from memscal.model.provenance import SourceFile, source_of
from memscal.version import __version__

_WORKER = Path(__file__).with_name("worker.py")
_MAX_ANSWER_BYTES = 512 * 2**20
# Of the child, and of its answer: for the libraries and a small mesh, and more for each byte of the
# file.
_MEMORY = 640 * 2**20
_MEMORY_PER_BYTE = 20
_ANSWER = 2**25
_ANSWER_PER_BYTE = 20
_SECONDS = 60.0
_BYTES_PER_SECOND = 2**20
# Whatever else is in the environment is not for a process that reads files of others.
_ENVIRONMENT = ("LD_LIBRARY_PATH", "DYLD_LIBRARY_PATH", "PATH", "SYSTEMROOT")
_MAX_REASON = 400
_MAX_SHOWN = 80
_HDF5_ENDINGS = (".h5", ".hdf5", ".hdf")
# The address of an array in another file, such as film.h5:/data0, where XDMF has numbers.
_ADDRESS = re.compile(rb"<DataItem\b[^<>]{0,1000}>\s{0,200}([^<>:]{0,200}):([^<>]{1,500})<")
ByName = dict[str, NDArray[Any]]
"""Arrays of a mesh file by their names."""
Numbers = list[NDArray[Any]]
"""The same by the numbers that a header gives them."""

_AS_VTU = (
    "Save it from ParaView as an unstructured grid (.vtu) in one piece, of data mode ASCII or "
    "Binary and without texts, or as legacy VTK (.vtk)."
)


def _addresses(data: bytes) -> Iterator[tuple[str, str]]:
    """Yield the name of the file and the path inside it of every array kept in another file."""
    for address in _ADDRESS.finditer(data):
        file_name, inside = (text.decode("utf-8", "replace").strip() for text in address.groups())
        yield file_name, "/" + inside.strip("/")


def with_drawn_in(path: Path) -> list[Path]:
    """Return a file that is imported and those that it draws in: none of them may be replaced."""
    if _KINDS.get(path.suffix.lower()) != "xdmf":
        return [path]
    names = {name for name, _ in _addresses(read_bytes(path)) if "\0" not in name}
    return [path, *(path.parent / name for name in sorted(names))]


def heavy_arrays(data: bytes, path: str) -> tuple[ByName, list[SourceFile]]:
    """Return the arrays that an XDMF file has in the HDF5 file beside it, by their addresses."""
    folder, name = os.path.split(path)
    stem = os.path.splitext(name)[0]
    arrays = {}
    files = {}
    with contextlib.ExitStack() as opened:
        for file_name, inside in _addresses(data):
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


def run_meshio(data: bytes, kind: str, name: str, heavy: ByName) -> tuple[Values, Numbers]:
    """Return what meshio makes of a mesh: a header, and the arrays that it numbers."""
    size = len(data) + sum(values.nbytes for values in heavy.values())
    seconds = _SECONDS + size / _BYTES_PER_SECOND
    packed = io.BytesIO()
    np.savez(packed, *heavy.values())
    request = {
        "kind": kind,
        "heavy": list(heavy),
        "packed": packed.tell(),
        "path": [os.path.abspath(folder) for folder in sys.path],
        "memory": _MEMORY + _MEMORY_PER_BYTE * size,
        "seconds": int(seconds) + 1,
        "output": min(_MAX_ANSWER_BYTES, _ANSWER + _ANSWER_PER_BYTE * size),
    }
    parts = (json.dumps(request).encode() + b"\n", packed.getbuffer(), data)
    answer = io.BytesIO(_run(parts, seconds, name))
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


def _run(parts: Iterable[bytes | memoryview], seconds: float, name: str) -> bytes:
    """Run the worker on parts, in a file without a name, of which a kill leaves nothing."""
    environment = {key: os.environ[key] for key in _ENVIRONMENT if key in os.environ}
    try:
        with tempfile.TemporaryFile() as given:
            given.writelines(parts)
            given.seek(0)
            done = subprocess.run(
                # Isolated: environment and folder add no modules; the path is in the request.
                [sys.executable, "-I", "-B", _WORKER],
                stdin=given,
                stdout=subprocess.PIPE,
                stderr=subprocess.DEVNULL,
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
            cure="Run memscal where Python may start itself, with space in the temporary folder "
            "(TMPDIR) for a copy of the mesh.",
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
    return done.stdout


_KINDS = {".vtu": "vtu", ".vtk": "vtk", ".xdmf": "xdmf", ".xmf": "xdmf"}
# Known as meshes of other kinds, so that none is taken for a table.
_OTHERS = {
    *(".pvtu", ".pvd", ".vtp", ".vts", ".vtr", ".vti", ".vtm", ".msh", ".med", ".inp", ".frd"),
    *(".exo", ".e", ".bdf", ".unv", ".odb", ".rst", ".mph", ".ply", ".stl", ".obj"),
}
_CELLS = {3: "triangle", 6: "triangle6"}
_MAX_NAME = 80
_MAX_NOTES = 4000


def is_mesh(path: FilePath) -> bool:
    """Return whether a file's name says that it is a mesh and not a table."""
    ending = Path(path).suffix.lower()
    return ending in _KINDS or ending in _OTHERS


@array_record
class Cells:
    """Cells of one kind: their nodes, by rows, and the fields given for each of them."""

    dimension: int
    nodes: IndexArray
    data: Arrays


@array_record
class Mesh:
    """A mesh and its fields as stored."""

    points: FloatArray  # (n, 3)
    cells: tuple[Cells, ...]
    point_data: Arrays  # (n, components)
    sources: tuple[SourceFile, ...]
    notes: tuple[str, ...]
    tensor_order: bool  # whether six components are known to be a tensor's in VTK's order

    @property
    def source(self) -> SourceFile:
        """The file that was named."""
        return self.sources[0]

    @property
    def solid(self) -> tuple[Cells, ...]:
        """The cells of the highest dimension, which are the body and not its faces or edges."""
        highest = max((block.dimension for block in self.cells), default=0)
        return tuple(block for block in self.cells if block.dimension == highest)

    @property
    def used(self) -> IndexArray:
        """The nodes that belong to the body."""
        return np.unique(np.concatenate([block.nodes.ravel() for block in self.solid]))


def read_mesh(path: FilePath) -> Mesh:
    """Read a mesh and its fields from a VTU, legacy VTK or XDMF file."""
    name = Path(path).name
    kind = _KINDS.get(Path(path).suffix.lower())
    if kind is None:
        raise FormatError(
            f"{name} is not a mesh of a kind that is read.",
            why="Meshes are read from VTU (.vtu), legacy VTK (.vtk) and XDMF (.xdmf) files.",
            cure="Save it as .vtu from the program that wrote it or from ParaView, or export the "
            "stress at the base as a table (CSV).",
        )
    installed("meshio", "A mesh", "fem-io")
    data = read_bytes(path)
    if not data:
        raise FormatError(f"{name} is empty.", cure="Save the mesh again.")
    sources = [source_of(name, data)]
    heavy: ByName = {}
    if kind == "xdmf":
        heavy, drawn = heavy_arrays(data, os.fspath(path))
        sources += drawn
    with damage_named(f"{name} cannot be read as a mesh", why="Its reader gave no mesh back"):
        header, arrays = run_meshio(data, kind, name, heavy)
        return _checked(header, arrays, tuple(sources), tensor_order=kind != "xdmf")


def _checked(
    header: Values,
    arrays: Numbers,
    sources: tuple[SourceFile, ...],
    *,
    tensor_order: bool,
) -> Mesh:
    points = floats(arrays[header["points"]])
    if points.ndim != 2 or points.shape[1] not in (2, 3) or not len(points):
        raise _unusable(sources[0], f"points of shape {points.shape}")
    if points.shape[1] == 2:
        points = np.column_stack([points, np.zeros(len(points))])
    if not np.all(np.isfinite(points)):
        raise _unusable(sources[0], "a point whose coordinates are not finite")
    cells = tuple(_cells(header["cells"], arrays, len(points), sources[0]))
    if not cells:
        raise _unusable(sources[0], "no cells")
    heavy = sources[1:]
    notes = [f"Its numbers are those of {file.file_name} (sha256 {file.sha256})." for file in heavy]
    words = printable(header["printed"], _MAX_NOTES)
    if words:
        notes.append(f"meshio says: {words}")
    if not header["limited"]:
        notes.append("It was read without a limit of memory, which this system does not offer.")
    point_data = _fields({key: arrays[i] for key, i in header["point_data"].items()}, len(points))
    return Mesh(points, cells, point_data, sources, tuple(notes), tensor_order)


def _cells(
    blocks: list[Values], arrays: Numbers, points: int, source: SourceFile
) -> Iterator[Cells]:
    """Yield the blocks that have cells, with their nodes as whole numbers below ``points``."""
    for block in blocks:
        numbers = arrays[block["nodes"]]
        if not len(numbers):
            continue
        if not numbers.size:
            raise _unusable(source, "a cell without nodes")
        with np.errstate(invalid="ignore"):
            nodes = numbers.astype(np.int64)
        if nodes.ndim != 2 or not (
            np.array_equal(nodes, numbers) and 0 <= nodes.min() <= nodes.max() < points
        ):
            raise _unusable(source, "a cell with a node that is not there")
        fields = {key: arrays[i] for key, i in block["data"].items()}
        yield Cells(block["dimension"], nodes, _fields(fields, len(nodes)))


def _fields(fields: ByName, count: int) -> Arrays:
    """Return fields of numbers with one row each; a name is stripped of what does not print."""
    return {
        printable(name, _MAX_NAME): numbers.reshape(count, -1).astype(np.float64)
        for name, numbers in fields.items()
        if numbers.dtype.kind in "iuf" and numbers.shape[:1] == (count,) and numbers.size
    }


def _unusable(source: SourceFile, content: str) -> FormatError:
    return FormatError(
        f"{source.file_name} has {content}.",
        why="A stress at the base cannot be found in it.",
        cure="Save the mesh again, as an unstructured grid (.vtu).",
    )


def write_mesh(mesh: FieldMesh, path: FilePath, *, overwrite: bool = False) -> None:
    """Write displacement and stress on a mesh as a VTU file, whole or not at all."""
    # x is the radius and y the height, in mm; stress_Pa is in VTK's order, tension positive.
    meshio = installed("meshio", "A mesh", "fem-io")
    points, unit = from_si(np.pad(mesh.points, ((0, 0), (0, 1))), "length")
    moved, _ = from_si(np.pad(mesh.displacement, ((0, 0), (0, 1))), "length")
    stress = np.pad(mesh.stress, ((0, 0), (0, 2)))
    cells = [(_CELLS[mesh.triangles.shape[1]], mesh.triangles)]
    fields = {f"displacement_{unit}": moved, "stress_Pa": stress}
    written = meshio.Mesh(points, cells, point_data=fields)
    try:
        with tempfile.TemporaryDirectory(prefix="memscal-") as folder:
            plain = Path(folder, "mesh.vtu")
            # Not Mesh.write, which finds the format by the name, in any of forty.
            meshio.vtu.write(str(plain), written)
            data = plain.read_bytes()
    except OSError as error:
        raise OutputError(
            f"The mesh cannot be written to the temporary folder: {error.strerror}.",
            cure="Free some space there, or set TMPDIR.",
        ) from error
    head, grid, body = data.partition(b"<UnstructuredGrid>")
    words = (
        f"Written by memscal {__version__}: an axisymmetric section, x = radius and y = height "
        f"in mm, z = hoop direction. {printable(mesh.notes, _MAX_NOTES)}"
    )
    # A comment in XML may not hold two hyphens.
    comment = f"<!-- {words.replace('--', '- -').replace('--', '- -')} -->\n".encode()
    atomic_write_bytes(path, head + comment + grid + body, overwrite=overwrite)
