"""Meshes built to read, hang or exhaust something, or merely broken: refused in plain words."""

import base64
import contextlib
import errno
import os
import re
import struct
import subprocess
import tempfile
import zlib
from pathlib import Path

import h5py
import meshio
import numpy as np
import pytest
from helpers.folders import DATA
from helpers.meshes import section, write

from memscal.errors import FormatError, InputError, UnsafeFileError
from memscal.extensions.meshes import mesh_files
from memscal.extensions.meshes.mesh_files import Mesh, read_mesh

pytestmark = pytest.mark.usefixtures("folder")
AT_ONCE = pytest.mark.usefixtures("at_once")
SMALL = section(radii=np.linspace(0.0, 8.0, 5), heights=np.array([0.0, 1.0]))
BOMB = "".join(
    f'<!ENTITY e{i} "{"".join([f"&e{i - 1};"] * 10) if i else "ha" * 10}">' for i in range(12)
)
POINTS = (
    '<VTKFile type="UnstructuredGrid" version="0.1" byte_order="LittleEndian" '
    'compressor="vtkZLibDataCompressor"><UnstructuredGrid>'
    '<Piece NumberOfPoints="3" NumberOfCells="0"><Points>'
    '<DataArray type="Float64" Name="Points" NumberOfComponents="3" format="binary">'
    "{}</DataArray></Points></Piece></UnstructuredGrid></VTKFile>"
)


def small(name, **options):
    """Save a small mesh with one stress."""
    mesh = meshio.Mesh(SMALL.points, SMALL.cells, point_data={"S9": SMALL.point_data["S9"]})
    return write(mesh, Path(name), **options)


def edited(path, old, new):
    """Replace what stands exactly once in a text file."""
    text = path.read_text()
    assert text.count(old) == 1
    path.write_text(text.replace(old, new))
    return path


def numbers_of(path, name):
    """Return the text of an array of a VTU file."""
    return path.read_text().partition(f'Name="{name}"')[2].partition(">")[2].partition("<")[0]


def refused(path, words="cannot be read", kind=FormatError):
    """Return a refusal, which names the file and a cure."""
    with pytest.raises(kind, match=words) as caught:
        read_mesh(path)
    assert path.name in caught.value.problem
    assert caught.value.cure
    return str(caught.value)


@pytest.mark.parametrize(
    ("name", "document_type"),
    [
        ("film.vtu", f"<!DOCTYPE a [{BOMB}]>"),
        ("film.xdmf", f"<!DOCTYPE a [{BOMB}]>"),
        ("film.vtu", '<!DOCTYPE a [<!ENTITY e11 SYSTEM "{}">]>'),
        ("film.xdmf", '<!DOCTYPE a [<!ENTITY % e SYSTEM "{}"> %e;]>'),
        ("film.vtu", '<!DOCTYPE a SYSTEM "{}">'),
    ],
)
def test_entities_neither_grow_nor_open_a_file(folder, name, document_type):
    (folder / "other").write_text('<!ENTITY e11 "a secret">')
    path = folder / name
    head = document_type.replace("{}", (folder / "other").as_uri())
    root = {"film.vtu": "VTKFile", "film.xdmf": "Xdmf"}[name]
    path.write_text(f'<?xml version="1.0"?>{head}<{root} type="&e11;">&e11;</{root}>')
    assert "secret" not in refused(path)


@pytest.mark.parametrize("text", ["<a>" * 10**5, f"<VTKFile>{'<b/>' * 10**5}</VTKFile>"])
@AT_ONCE
def test_absurd_xml_is_refused(text):
    path = Path("film.vtu")
    path.write_text(text)
    refused(path)


def test_compressed_blocks_of_gigabytes_meet_the_limits_and_leave_nothing(folder, monkeypatch):
    """Eighty blocks of 16 MiB."""
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    block = zlib.compress(bytes(2**24), 9)
    header = struct.pack("<83I", 80, 2**24, 0, *[len(block)] * 80)
    path = folder / "film.vtu"
    blocks = base64.b64encode(header) + base64.b64encode(block * 80)
    path.write_text(POINTS.format(blocks.decode()))
    refused(path, r"more than 6\d\d MB", UnsafeFileError)
    assert list(folder.iterdir()) == [path]


@AT_ONCE
def test_what_a_reader_answers_is_bounded_by_the_size_of_the_mesh(monkeypatch):
    path = small("film.vtu")
    monkeypatch.setattr(mesh_files, "_ANSWER", 0)
    size = path.stat().st_size
    values = sum(a.nbytes for a in (SMALL.points, SMALL.cells[0].data, SMALL.point_data["S9"]))
    for per_byte, enough in ((values // size, False), (values // size + 1, True)):
        monkeypatch.setattr(mesh_files, "_ANSWER_PER_BYTE", per_byte)
        with contextlib.nullcontext() if enough else pytest.raises(UnsafeFileError):
            read_mesh(path)


def test_a_reader_that_is_killed_leaves_nothing_and_a_full_folder_is_no_damage(
    tmp_path, monkeypatch
):
    path = small("film.vtk")
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    run = subprocess.run

    def watched(*arguments, **options):
        assert os.listdir(folder) == []  # nor would a kill leave anything
        return run(*arguments, **options)

    monkeypatch.setattr(subprocess, "run", watched)
    assert list(read_mesh(path).point_data) == ["S9"]

    def full(*_, **__):
        raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    monkeypatch.setattr(tempfile, "TemporaryFile", full)
    with pytest.raises(InputError, match=r"No space left(.|\n)*temporary folder"):
        read_mesh(path)


@pytest.mark.parametrize(
    ("section_name", "options"),
    [
        ("POINTS", {"binary": True, "fmt_version": "5.1"}),
        ("POINTS", {"binary": False, "fmt_version": "4.2"}),
        ("CELLS", {"binary": True, "fmt_version": "5.1"}),
        ("CELLS", {"binary": False, "fmt_version": "5.1"}),
        ("CELL_TYPES", {"binary": True, "fmt_version": "4.2"}),
    ],
)
@AT_ONCE
def test_a_count_beyond_the_files_size_is_refused(section_name, options):
    path = small("film.vtk", **options)
    head, name, rest = path.read_bytes().partition(section_name.encode() + b" ")
    rest = re.sub(rb"^\d+", b"900000000000", rest)
    path.write_bytes(head + name + rest)
    refused(path)


def test_a_few_bytes_that_stand_for_a_billion_points_are_refused():
    path = Path("film.vtk")
    path.write_text(
        "# vtk DataFile Version 3.0\na title\nASCII\nDATASET STRUCTURED_POINTS\n"
        "DIMENSIONS 2000 2000 2000\nORIGIN 0 0 0\nSPACING 1 1 1\nPOINT_DATA 8000000000\n"
    )
    refused(path, "more than 64", UnsafeFileError)


@pytest.mark.parametrize("kind", ["polygon", "VTK_LAGRANGE_TRIANGLE"])
@AT_ONCE
def test_cells_that_state_their_own_size_are_read(kind):
    mesh = meshio.Mesh(SMALL.points, [(kind, SMALL.cells[0].data[:, :3])])
    meshio.vtk.write("film.vtk", mesh)
    meshio.vtu.write("film.vtu", mesh)
    for name in ("film.vtk", "film.vtu"):
        (cells,) = read_mesh(name).solid
        np.testing.assert_array_equal(cells.nodes, SMALL.cells[0].data[:, :3])


@pytest.mark.parametrize("offsets", ["3000000000 4", "-4 4", "0 4", "4 9", "4.0 8.0"])
@AT_ONCE
def test_a_cell_with_billions_of_nodes_is_refused(offsets):
    path = Path("film.vtu")
    mesh = meshio.Mesh(SMALL.points, [("polygon", SMALL.cells[0].data[:2])])
    meshio.vtu.write(path, mesh, binary=False)
    edited(path, numbers_of(path, "offsets"), offsets)
    if "." in offsets:
        edited(path, 'type="Int64" Name="offsets"', 'type="Float64" Name="offsets"')
    refused(path, "cannot be read|a cell without nodes")


@pytest.mark.parametrize(
    "address",
    [
        "/etc/passwd:/data1",
        "../film.h5:/data1",
        "other.h5:/data1",
        "film.xdmf:/data1",
        "<!-- -->other.h5:/data1",
        "<![CDATA[/other/film.h5:/data9]]>",
    ],
)
@AT_ONCE
def test_an_xdmf_file_reaches_no_file_but_the_one_of_its_name(address):
    path = edited(small("film.xdmf"), "film.h5:/data1", address)
    with h5py.File("film.h5", "r") as file, h5py.File("other.h5", "w") as to:
        file.copy("data1", to)
    refused(path, "takes its numbers from", UnsafeFileError)


def test_an_xdmf_file_with_raw_binary_numbers_is_refused():
    path = small("film.xdmf", data_format="XML")
    head, _, rest = path.read_text().partition('Format="XML"')
    rest = rest.partition("</DataItem>")[2]
    path.write_text(f'{head}Format="Binary">/etc/passwd</DataItem>{rest}')
    refused(path, "asks for the file /etc/passwd", UnsafeFileError)


@AT_ONCE
def test_the_hdf5_file_of_an_xdmf_file_is_a_source_and_read_safely():
    path = small("film.xdmf")
    mesh = read_mesh(path)
    assert [source.file_name for source in mesh.sources] == ["film.xdmf", "film.h5"]
    assert any(f"film.h5 (sha256 {mesh.sources[1].sha256})" in note for note in mesh.notes)
    with h5py.File("film.h5", "r+") as file:
        del file["data1"]
        file["data1"] = h5py.ExternalLink("/etc/passwd", "/x")
    with pytest.raises(UnsafeFileError, match=r"film\.h5: /data1 is reached through"):
        read_mesh(path)
    Path("film.h5").unlink()
    os.mkfifo("film.h5")
    with pytest.raises(UnsafeFileError, match=r"film\.h5 is not a regular file"):
        read_mesh(path)


TEXTS = '<DataArray type="String" Name="names" format="ascii">104 105 0</DataArray>'
FIELDS = f"<FieldData>{TEXTS}</FieldData>"
READ = r"(.|\n)*data mode ASCII or Binary and without texts"
DIMENSIONS = 'Dimensions="10 9"'
VTU_EDITS = [
    ('type="UnstructuredGrid"', 'type="PolyData"', "found PolyData"),
    ("<Piece", '<Piece NumberOfPoints="0" NumberOfCells="0"/><Piece', "2 pieces"),
    ('Name="Points" NumberOfComponents="3"', 'Name="Points" NumberOfComponents="5"', "mesh"),
    ('byte_order="LittleEndian"', 'byte_order="Middle"', "Middle"),
    ('NumberOfPoints="10"', 'NumberOfPoints="11"', "cannot be read as a mesh"),
    ('Name="connectivity"', 'Name="joints"', "connectivity"),
    ('version="0.1"', 'version="2.3"', f"Unknown VTU file version '2.3'{READ}"),
    ("<PointData>", f"<PointData>{TEXTS}", f"String{READ}"),
    ("<UnstructuredGrid>", f"<UnstructuredGrid>{FIELDS}", f"String{READ}"),
]
XDMF_EDITS = [
    (DIMENSIONS, 'Dimensions="100000000 900000000"', "reshape"),
    (DIMENSIONS, f'{DIMENSIONS} Reference="/Xdmf/Domain/Grid"', "cannot be read"),
    (f'{DIMENSIONS} Format="XML"', f'{DIMENSIONS} ItemType="Function"', "Format"),
    ("<Domain>", "<Domain><Grid><Topology/></Grid>", "one grid"),
    (DIMENSIONS, 'Dimensions="10 ten"', "cannot be read"),
    (DIMENSIONS, 'Dimensions="9 10"', "cannot be read"),
]


@pytest.mark.parametrize(
    ("name", "edit"),
    [
        *(("film.vtu", edit) for edit in VTU_EDITS),
        *(("film.xdmf", edit) for edit in XDMF_EDITS),
    ],
)
@AT_ONCE
def test_a_file_of_another_shape_than_a_mesh_with_numbers_is_refused(name, edit):
    old, new, words = edit
    options = {"data_format": "XML"} if name == "film.xdmf" else {}
    refused(edited(small(name, **options), old, new), words)


@AT_ONCE
def test_a_series_of_xdmf_is_refused_and_a_document_type_as_fenics_writes_it_is_not():
    path = small("film.xdmf")
    edited(path, "<Xdmf ", '<!DOCTYPE Xdmf SYSTEM "Xdmf.dtd" []><Xdmf ')
    assert read_mesh(path).point_data["S9"].shape == (10, 9)
    edited(path, "<Topology", '<Time Value="0" /><Topology')
    refused(path, "Unknown section 'Time'")
    text = path.read_text().replace('<Time Value="0" />', "").replace("</Grid>", "</Grid></Grid>")
    path.write_text(text.replace("<Grid", '<Grid GridType="Collection"><Grid'))
    refused(path, "Unknown section 'Grid'")


@AT_ONCE
def test_entities_in_the_text_of_xml_do_not_grow():
    """meshio parses the text of an element again, as XML."""
    path = small("film.xdmf")
    bomb = f"<Information><![CDATA[<!DOCTYPE a [{BOMB}]><a>&e11;</a>]]></Information>"
    refused(edited(path, "<Topology", f"{bomb}<Topology"), "declares entities", UnsafeFileError)


@AT_ONCE
def test_polyhedra_and_fields_of_the_wrong_length_are_refused():
    path = small("film.vtu", binary=False)
    text = path.read_text()
    types = numbers_of(path, "types")
    path.write_text(text.replace(types, types.replace("9", "42", 1)))
    refused(path)
    array = '<DataArray type="Float64" Name="half" format="ascii">1 2 3</DataArray>'
    path.write_text(text.replace("<PointData>", f"<PointData>{array}"))
    refused(path, "half")


@pytest.mark.parametrize(("name", "before"), [("film.vtu", 'Name="S9"'), ("film.vtk", "POINTS")])
@AT_ONCE
def test_words_among_numbers_are_refused_and_not_cut_short(name, before):
    path = small(name, binary=False)
    head, mark, rest = path.read_text().partition(before)
    ended = "\n" if name == "film.vtk" else ">"
    line, _, numbers = rest.partition(ended)
    path.write_text(head + mark + line + ended + "overload " + numbers)
    refused(path, "string or file could not be read")


@AT_ONCE
def test_nodes_that_are_not_there_or_nowhere_are_refused():
    path = Path("film.vtu")
    meshio.vtu.write(path, meshio.Mesh(SMALL.points, [("quad", SMALL.cells[0].data + 100)]))
    refused(path, "a node that is not there")
    points = SMALL.points.copy()
    points[3, 1] = np.nan
    meshio.vtu.write(path, meshio.Mesh(points, SMALL.cells))
    refused(path, "not finite")


@AT_ONCE
def test_text_from_a_mesh_cannot_steer_the_terminal():
    mesh = meshio.Mesh(SMALL.points, SMALL.cells, point_data={"S\x9b[2J": np.zeros(10)})
    meshio.vtu.write("film.vtu", mesh)
    assert list(read_mesh("film.vtu").point_data) == ["S[2J"]


@pytest.mark.parametrize("ending", [".vtu", ".vtk", ".xdmf"])
@AT_ONCE
def test_what_is_no_file_with_something_in_it_is_refused(ending):
    path = Path(f"film{ending}")
    with pytest.raises(InputError, match="No such file"):
        read_mesh(path)
    path.write_bytes(b"")
    refused(path, "is empty")
    path.write_bytes(b"\0\1\2 not a mesh at all")
    refused(path)
    for make in (os.mkfifo, Path.mkdir):
        path.unlink()
        make(path)
        refused(path, "not a regular file", UnsafeFileError)


@AT_ONCE
def test_meshio_does_not_print_to_the_terminal(capfd):
    """It warns on the terminal of a cell that it does not know; here this is a note."""
    path = small("film.vtu", binary=False)
    types = numbers_of(path, "types")
    edited(path, types, types.replace("9", "4", 1))
    capfd.readouterr()  # meshio warned of writing text, too
    assert any("meshio says" in note and "cannot handle" in note for note in read_mesh(path).notes)
    assert capfd.readouterr() == ("", "")


HOSTILE = """
import types

def read(path):
    import ctypes, os, pickle, socket, subprocess, sys
    import numpy as np
    {}

NONE = dict(point_data=dict(), cell_data=dict())
vtk = types.SimpleNamespace(read=read)
"""


@pytest.fixture
def hostile(tmp_path, monkeypatch):
    """A mesh whose reader does, in the place of meshio, what a damaged one could be made to do."""

    def with_reader(code):
        folder = tmp_path / "modules" / "meshio"
        folder.mkdir(parents=True)
        folder.joinpath("__init__.py").write_text(HOSTILE.format(code.replace("\n", "\n    ")))
        monkeypatch.syspath_prepend(folder.parent)
        return small("film.vtk")

    return with_reader


def test_the_reader_of_a_mesh_sees_no_other_file_and_starts_nothing(tmp_path, hostile, monkeypatch):
    secret = tmp_path / "secret"
    secret.write_text("a secret")
    monkeypatch.setenv("A_SECRET", "a secret")
    actions = [
        f"open({str(secret)!r})",
        f"os.open({str(secret)!r}, os.O_RDONLY)",
        f"np.fromfile({str(secret)!r}, np.uint8)",
        f"os.remove({str(secret)!r})",
        "open('more', 'w')",
        "open(os.path.join(np.__path__[0], 'version.py'), 'a')",
        "socket.socket().connect(('127.0.0.1', 9))",
        "subprocess.run(['true'])",
        "os.system('true')",
        "os.fork()",
        "os.execv('/bin/true', ['true'])",
        "os.kill(os.getppid(), 0)",
        "ctypes.CDLL(None)",
        "pickle.loads(b'cos\\nsystem\\n.')",
        "os.environ['A_SECRET']",
    ]
    path = hostile(
        f"for action in {actions!r}:\n"
        "    try:\n        exec(action)\n"
        "    except (PermissionError, KeyError):\n        pass\n"
        "    else:\n        print(action)\n"
        "raise ValueError('allowed was: ' + sys.stdout.getvalue())"
    )
    assert "The reader says: allowed was:.\n" in refused(path)
    assert secret.read_text() == "a secret"


@pytest.mark.parametrize(("code", "words"), [
    ("bytearray(2**34)", "more than 64"),
    ("raise SystemExit('the end')", "cannot be read as a mesh"), ("os._exit(0)", "cannot be read"),
    ("os.abort()", "ended by an error"),
    ("return types.SimpleNamespace(cells=[],points=np.zeros((2**27,1)),**NONE)", "cannot be read"),
    ("import meshio.other", "No module named"),
    ("return types.SimpleNamespace(cells=[], points=[[print]], **NONE)", "ended by an error"),
])  # fmt: skip
def test_whatever_ends_the_reader_is_an_error_of_ours(hostile, code, words):
    refused(hostile(code), words)


def test_an_endless_reader_ends(hostile, monkeypatch):
    monkeypatch.setattr(mesh_files, "_SECONDS", 0.5)
    refused(hostile("while True:\n    pass"), "takes longer than 0.5", UnsafeFileError)


@pytest.mark.parametrize("name", ["film.vtu", "film.vtk", "film.xdmf", "vtk_film.vtu"])
@AT_ONCE
def test_damage_is_refused_or_harmless_wherever_it_is(name):
    path = Path(name)
    if name == "vtk_film.vtu":
        path.write_bytes((DATA / name).read_bytes())
    else:
        small(name)
    good = path.read_bytes()
    for i in np.linspace(20, len(good) - 20, 2).astype(int):
        path.write_bytes(good[:i])
        refused(path)
        path.write_bytes(good[:i] + bytes([good[i] ^ 0x15]) + good[i + 1 :])
        with contextlib.suppress(FormatError):
            assert isinstance(read_mesh(path), Mesh)
