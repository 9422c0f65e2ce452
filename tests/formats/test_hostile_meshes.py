"""Meshes built to read, hang or exhaust something, or merely broken: refused in plain words."""

from __future__ import annotations

import base64
import os
import struct
import subprocess
import sys
import tracemalloc
import zlib
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import pytest
from meshes import section

from memscal.errors import FormatError, InputError, MemscalError, UnsafeFileError
from memscal.formats.mesh_reader import read_mesh

SMALL = section(radii=np.linspace(0.0, 8.0, 5), heights=np.array([0.0, 1.0]))
BOMB = "".join(
    f'<!ENTITY e{i} "{"".join([f"&e{i - 1};"] * 10) if i else "ha" * 10}">' for i in range(12)
)
SWEEP = """
import pathlib, sys
from memscal.errors import MemscalError
from memscal.formats.mesh_reader import read_mesh

path = pathlib.Path(sys.argv[1])
good = path.read_bytes()
read = refused = 0
for i in range(0, len(good), int(sys.argv[2])):
    for damaged in (good[:i], good[:i] + bytes([good[i] ^ 0x15]) + good[i + 1 :]):
        path.write_bytes(damaged)
        try:
            read_mesh(path)
            read += 1
        except MemscalError:
            refused += 1
print(read, refused)
"""


def small(path: Path, **options: Any) -> Path:
    """Save a small mesh with one stress."""
    mesh = meshio.Mesh(SMALL.points, SMALL.cells, point_data={"S9": SMALL.point_data["S9"]})
    {".vtu": meshio.vtu, ".vtk": meshio.vtk, ".xdmf": meshio.xdmf}[path.suffix].write(
        str(path), mesh, **options
    )
    return path


def edited(path: Path, old: str, new: str) -> Path:
    """Replace what stands exactly once in a text file."""
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    return path


def refused_cheaply(path: Path, words: str, kind: type[MemscalError] = UnsafeFileError) -> None:
    """The refusal names the file and a cure, and costs little memory."""
    tracemalloc.start()
    try:
        with pytest.raises(kind, match=words) as caught:
            read_mesh(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert path.name in caught.value.problem
    assert caught.value.cure
    assert peak < 10 * path.stat().st_size + 2**22


def compressed_vtu(path: Path, content: bytes, claimed: int) -> Path:
    """Write a mesh whose points are one block that claims a size."""
    block = zlib.compress(content, 9)
    header = struct.pack("<4I", 1, claimed, 0, len(block))
    points = (base64.b64encode(header) + base64.b64encode(block)).decode()
    path.write_text(
        '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian" '
        'compressor="vtkZLibDataCompressor"><UnstructuredGrid>'
        '<Piece NumberOfPoints="3" NumberOfCells="1"><Points>'
        '<DataArray type="Float64" Name="Points" NumberOfComponents="3" format="binary">'
        f"{points}</DataArray></Points><Cells>"
        '<DataArray type="Int64" Name="connectivity" format="ascii">0 1 2</DataArray>'
        '<DataArray type="Int64" Name="offsets" format="ascii">3</DataArray>'
        '<DataArray type="UInt8" Name="types" format="ascii">5</DataArray>'
        "</Cells></Piece></UnstructuredGrid></VTKFile>"
    )
    return path


@pytest.mark.parametrize("name", ["film.vtu", "film.xdmf"])
@pytest.mark.parametrize(
    "document_type",
    [
        f"<!DOCTYPE a [{BOMB}]>",
        '<!DOCTYPE a [<!ENTITY e11 SYSTEM "file:///etc/passwd">]>',
        '<!DOCTYPE a [<!ENTITY % e SYSTEM "file:///etc/passwd"> %e;]>',
        '<!DOCTYPE a SYSTEM "file:///etc/passwd">',
    ],
    ids=["laughs", "file", "parameter", "document type"],
)
def test_entities_are_refused_and_never_opened(tmp_path: Path, name: str, document_type: str):
    path = tmp_path / name
    root = {"film.vtu": "VTKFile", "film.xdmf": "Xdmf"}[name]
    path.write_text(f'<?xml version="1.0"?>{document_type}<{root}>&e11;</{root}>')
    refused_cheaply(path, "entity")


def test_the_document_type_that_xdmf_files_name_is_allowed(tmp_path: Path):
    path = small(tmp_path / "film.xdmf", data_format="XML")
    edited(path, "<Xdmf ", '<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []><Xdmf ')
    assert read_mesh(path).point_data["S9"].shape == (10, 9)


def test_xml_inside_the_text_of_xml_is_left_alone(tmp_path: Path):
    """meshio parses an Information a second time: a bomb would go off there."""
    path = small(tmp_path / "film.xdmf", data_format="XML")
    bomb = f"<!DOCTYPE a [{BOMB}]><a>&e11;</a>"
    edited(path, "<Geometry", f"<Information><![CDATA[{bomb}]]></Information><Geometry")
    assert read_mesh(path).point_data["S9"].shape == (10, 9)


@pytest.mark.parametrize("text", ["<a>" * 60 + "</a>" * 60, f"<a>{'<b/>' * 30_000}</a>"])
def test_absurd_xml_is_refused(tmp_path: Path, text: str):
    path = tmp_path / "film.vtu"
    path.write_text(text)
    with pytest.raises(UnsafeFileError, match="XML elements"):
        read_mesh(path)


def test_a_compressed_block_that_claims_a_gibibyte_is_refused_unread(tmp_path: Path):
    path = compressed_vtu(tmp_path / "film.vtu", bytes(2**24), claimed=2**30)
    refused_cheaply(path, "more than 536,870,912 bytes")


def test_a_compressed_block_is_inflated_no_further_than_it_claims(tmp_path: Path):
    path = compressed_vtu(tmp_path / "film.vtu", bytes(2**28), claimed=72)
    tracemalloc.start()
    read_mesh(path)  # nine zeros, and nobody sees the rest
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert peak < 2**24
    path = compressed_vtu(tmp_path / "film.vtu", bytes(72), claimed=80)
    with pytest.raises(FormatError, match="a block of 80 bytes has only 72"):
        read_mesh(path)


@pytest.mark.parametrize("binary", [True, False])
@pytest.mark.parametrize("version", ["4.2", "5.1"])
@pytest.mark.parametrize("section_name", ["POINTS", "CELLS", "CELL_TYPES", "POINT_DATA"])
def test_a_count_beyond_the_files_size_is_refused(
    tmp_path: Path, binary: bool, version: str, section_name: str
):
    path = small(tmp_path / "film.vtk", binary=binary, fmt_version=version)
    data = path.read_bytes()
    head, name, rest = data.partition(section_name.encode() + b" ")
    _, space, rest = rest.partition(b" " if section_name in ("POINTS", "CELLS") else b"\n")
    path.write_bytes(head + name + b"900000000000" + space + rest)
    refused_cheaply(path, f"claims {section_name} 900000000000")


@pytest.mark.parametrize(
    "line",
    [
        "DATASET STRUCTURED_POINTS",
        "dataset structured_points",
        "DATA\u017fET STRUCTURED_POINT\u017f",
        "DATASET\tRECTILINEAR_GRID",
        "0 0 0 DATASET STRUCTURED_GRID",
        "DATASET\u2003structured_points",
    ],
)
def test_a_few_bytes_that_stand_for_a_billion_points_are_refused(tmp_path: Path, line: str):
    path = tmp_path / "film.vtk"
    path.write_text(
        f"# vtk DataFile Version 3.0\nDATASET STRUCTURED_POINTS in a title\nASCII\n{line}\n"
        "DIMENSIONS 2000 2000 2000\nORIGIN 0 0 0\nSPACING 1 1 1\n"
    )
    refused_cheaply(path, "structured grid")


@pytest.mark.parametrize(
    ("kind", "words"),
    [("polygon", "the type 7"), ("VTK_LAGRANGE_TRIANGLE", "the type 69"), ("triangle", "")],
)
@pytest.mark.parametrize("binary", [True, False])
def test_cells_that_state_their_own_size_are_read_from_vtu_files_only(
    tmp_path: Path, binary: bool, kind: str, words: str
):
    mesh = meshio.Mesh(SMALL.points, [(kind, SMALL.cells[0].data[:, :3])])
    meshio.vtk.write(tmp_path / "film.vtk", mesh, binary=binary)
    meshio.vtu.write(tmp_path / "film.vtu", mesh, binary=binary)
    assert len(read_mesh(tmp_path / "film.vtu").solid[0].nodes) == 4
    if words:
        with pytest.raises(FormatError, match=words):
            read_mesh(tmp_path / "film.vtk")
    else:
        assert len(read_mesh(tmp_path / "film.vtk").solid[0].nodes) == 4


@pytest.mark.parametrize("offsets", ["3000000000 4", "-4 4", "0 4", "4 9", "4.0 8.0"])
def test_a_cell_with_billions_of_nodes_is_refused(tmp_path: Path, offsets: str):
    mesh = meshio.Mesh(SMALL.points, [("polygon", SMALL.cells[0].data[:2])])
    path = tmp_path / "film.vtu"
    meshio.vtu.write(path, mesh, binary=False)
    text = path.read_text()
    numbers = text.partition('Name="offsets"')[2].partition(">")[2].partition("<")[0]
    text = text.replace(numbers, offsets)
    if "." in offsets:
        text = text.replace('type="Int64" Name="offsets"', 'type="Float64" Name="offsets"')
    path.write_text(text)
    refused_cheaply(path, "cannot be", FormatError)


def test_polyhedra_are_refused(tmp_path: Path):
    path = small(tmp_path / "film.vtu", binary=False)
    text = path.read_text()
    types = text.partition('Name="types"')[2].partition(">")[2].partition("<")[0]
    path.write_text(text.replace(types, types.replace("9", "42", 1)))
    refused_cheaply(path, "polyhedra", FormatError)


@pytest.mark.parametrize(
    "address",
    [
        "/etc/passwd:/data1",
        "../film.h5:/data1",
        "./film.h5:/data1",
        "other.h5:/data1",
        "film.xdmf:/data1",
        "",
    ],
)
def test_an_xdmf_file_reaches_no_file_but_the_one_of_its_name(tmp_path: Path, address: str):
    path = small(tmp_path / "film.xdmf")
    edited(path, "film.h5:/data1", address)
    refused_cheaply(path, "only the HDF5 file of the same name in the same folder|which is not")


def test_an_xdmf_file_with_raw_binary_numbers_is_refused(tmp_path: Path):
    path = small(tmp_path / "film.xdmf")
    text = path.read_text().replace('Format="HDF"', 'Format="Binary"')
    path.write_text(text.replace("film.h5:/data1", "/etc/passwd"))
    refused_cheaply(path, "Any file could be read")


def test_the_hdf5_file_beside_an_xdmf_file_may_be_no_pipe(tmp_path: Path):
    path = small(tmp_path / "film.xdmf")
    (tmp_path / "film.h5").unlink()
    os.mkfifo(tmp_path / "film.h5")
    with pytest.raises(UnsafeFileError, match=r"film\.h5 is not a regular file"):
        read_mesh(path)


def test_the_hdf5_file_beside_an_xdmf_file_may_not_lead_on(tmp_path: Path):
    path = small(tmp_path / "film.xdmf")
    with h5py.File(tmp_path / "film.h5", "r+") as file:
        del file["data1"]
        file["data1"] = h5py.ExternalLink("/etc/passwd", "/x")
    with pytest.raises(UnsafeFileError, match=r"film\.h5: /data1 is reached through"):
        read_mesh(path)


def test_the_hdf5_files_checksum_is_noted(tmp_path: Path):
    (note,) = read_mesh(small(tmp_path / "film.xdmf")).notes
    assert "film.h5 (sha256 " in note


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('Dimensions="10 9"', 'Dimensions="100000000 900000000"', "claims 90,000,000,000,000,000"),
        ('Dimensions="10 9"', 'Dimensions="10 ten"', "without dimensions"),
        ('Dimensions="10 9"', 'Dimensions="10 9" Reference="/Xdmf/Domain/Grid"', "points to them"),
        ('Dimensions="10 9"', 'Dimensions="10 9" ItemType="Function"', "calculated from others"),
        ("<Domain>", "<Domain><Grid><Topology/></Grid>", "holds 2 grids"),
        ('Dimensions="10 9"', 'Dimensions="9 10"', "cannot be read as a mesh"),
    ],
)
def test_xdmf_that_is_more_than_a_mesh_with_numbers_is_refused(
    tmp_path: Path, old: str, new: str, words: str
):
    path = edited(small(tmp_path / "film.xdmf", data_format="XML"), old, new)
    with pytest.raises(FormatError, match=words) as caught:
        read_mesh(path)
    assert caught.value.cure


def test_a_time_series_of_one_step_is_read_as_fenics_writes_it(tmp_path: Path):
    path = small(tmp_path / "film.xdmf")
    text = path.read_text()
    head, grid, rest = text.partition("<Grid")
    grid, end, rest = (grid + rest).partition("</Grid>")
    collection = '<Grid GridType="Collection" CollectionType="Temporal">'
    time = '<Time Value="0" />'
    inner = grid.replace("<Topology", time + "<Topology") + end
    path.write_text(head + collection + inner + "</Grid>" + rest)
    assert read_mesh(path).point_data["S9"].shape == (10, 9)


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ('type="UnstructuredGrid"', 'type="PolyData"', "it holds PolyData"),
        ("<Piece", '<Piece NumberOfPoints="0" NumberOfCells="0"/><Piece', "2 pieces"),
        ('Name="Points" NumberOfComponents="3"', 'Name="Points" NumberOfComponents="5"', "mesh"),
        ('byte_order="LittleEndian"', 'byte_order="Middle"', "Middle"),
        ('NumberOfPoints="10"', 'NumberOfPoints="11"', "cannot be read as a mesh"),
        ('Name="connectivity"', 'Name="joints"', "numbers of nodes cannot be"),
    ],
)
def test_a_vtu_file_of_another_shape_is_refused(tmp_path: Path, old: str, new: str, words: str):
    path = edited(small(tmp_path / "film.vtu"), old, new)
    with pytest.raises(FormatError, match=words):
        read_mesh(path)


def test_what_vtk_writes_today_is_read_where_meshio_alone_would_not(tmp_path: Path):
    path = edited(small(tmp_path / "film.vtu"), 'version="0.1"', 'version="2.3"')
    names = '<DataArray type="String" Name="names" format="ascii">104 105 0</DataArray>'
    edited(path, "<PointData>", f"<PointData>{names}")
    edited(path, "<UnstructuredGrid>", f"<UnstructuredGrid><FieldData>{names}</FieldData>")
    assert list(read_mesh(path).point_data) == ["S9"]


def test_a_field_of_the_wrong_length_is_refused(tmp_path: Path):
    path = small(tmp_path / "film.vtu", binary=False)
    text = path.read_text()
    array = '<DataArray type="Float64" Name="half" format="ascii">1 2 3</DataArray>'
    path.write_text(text.replace("<PointData>", f"<PointData>{array}"))
    with pytest.raises(FormatError, match="half"):
        read_mesh(path)


@pytest.mark.parametrize(("name", "before"), [("film.vtu", 'Name="S9"'), ("film.vtk", "POINTS")])
def test_words_among_numbers_are_refused_and_not_cut_short(tmp_path: Path, name: str, before: str):
    path = small(tmp_path / name, binary=False)
    head, mark, rest = path.read_text().partition(before)
    line, _, numbers = rest.partition("\n" if name == "film.vtk" else ">")
    ended = "\n" if name == "film.vtk" else ">"
    path.write_text(head + mark + line + ended + "overload " + numbers)
    with pytest.raises(FormatError, match="string or file could not be read"):
        read_mesh(path)


def test_cells_with_nodes_that_are_not_there_are_refused(tmp_path: Path):
    mesh = meshio.Mesh(SMALL.points, [("quad", SMALL.cells[0].data + 100)])
    path = tmp_path / "film.vtu"
    meshio.vtu.write(path, mesh)
    with pytest.raises(FormatError, match="a node that is not there"):
        read_mesh(path)


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_points_that_are_nowhere_are_refused(tmp_path: Path, value: float):
    path = tmp_path / "film.vtu"
    points = SMALL.points.copy()
    points[3, 1] = value
    meshio.vtu.write(path, meshio.Mesh(points, SMALL.cells))
    with pytest.raises(FormatError, match="not finite"):
        read_mesh(path)


def test_text_from_a_mesh_cannot_steer_the_terminal(tmp_path: Path):
    mesh = meshio.Mesh(SMALL.points, SMALL.cells, point_data={"S\x9b[2J": np.zeros(10)})
    meshio.vtu.write(tmp_path / "film.vtu", mesh)
    assert list(read_mesh(tmp_path / "film.vtu").point_data) == ["S[2J"]


@pytest.mark.parametrize("ending", [".vtu", ".vtk", ".xdmf"])
def test_what_is_no_file_with_something_in_it_is_refused(tmp_path: Path, ending: str):
    path = tmp_path / f"film{ending}"
    with pytest.raises(InputError, match="No such file"):
        read_mesh(path)
    path.write_bytes(b"")
    with pytest.raises(FormatError, match="is empty"):
        read_mesh(path)
    path.write_bytes(b"\0\1\2 not a mesh at all")
    with pytest.raises(FormatError, match="film") as caught:
        read_mesh(path)
    assert caught.value.cure
    path.unlink()
    os.mkfifo(path)
    with pytest.raises(UnsafeFileError, match="not a regular file"):
        read_mesh(path)
    path.unlink()
    path.mkdir()
    with pytest.raises(UnsafeFileError, match="not a regular file"):
        read_mesh(path)


def test_meshio_neither_prints_nor_ends_the_program(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
):
    """It warns on the terminal of a cell that it does not know; here this is a note."""
    path = small(tmp_path / "film.vtu", binary=False)
    text = path.read_text()
    cells = text.partition('Name="types"')[2].partition("</DataArray>")[0]
    path.write_text(text.replace(cells, cells.replace("9", "4", 1)))
    capfd.readouterr()  # meshio warned of writing text, too
    notes = read_mesh(path).notes
    assert any("meshio says" in note and "cannot handle" in note for note in notes)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("name", "options", "step"),
    [
        ("film.vtu", {"binary": False}, 41),
        ("film.vtu", {}, 11),
        ("film.vtk", {}, 11),
        ("film.vtk", {"binary": False, "fmt_version": "4.2"}, 23),
        ("film.xdmf", {}, 11),
        ("film.xdmf", {"data_format": "XML"}, 29),
        ("vtk_film.vtu", {}, 61),
    ],
)
def test_damage_is_refused_or_harmless_wherever_it_is(
    tmp_path: Path, name: str, options: dict[str, Any], step: int
):
    path = tmp_path / name
    if name.startswith("film"):
        small(path, **options)
    else:
        path.write_bytes((Path(__file__).with_name("data") / name).read_bytes())
    done = subprocess.run(
        [sys.executable, "-c", SWEEP, str(path), str(step)],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert done.stderr == ""
    read, refused = map(int, done.stdout.split())
    assert read + refused > 50
    assert refused > read / 2
