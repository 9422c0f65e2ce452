"""Meshes of finite-element programs: the stress at the base of the film, found and turned."""

import base64
import re
from pathlib import Path

import meshio
import numpy as np
import pytest
from helpers.folders import DATA
from helpers.meshes import HEIGHTS, RADII, block, pressure, section, tensor, write

from memscal import ElasticFilm
from memscal.errors import FormatError, InputError, UnitError
from memscal.extensions.meshes.mesh_files import read_mesh
from memscal.extensions.meshes.reference_mesh import read_reference_mesh
from memscal.mechanics.film_response import HankelField

pytestmark = pytest.mark.usefixtures("at_once", "folder")


class GaussianPressure:
    """1 N on the surface, spread as a Gaussian with a standard deviation of 1 mm."""

    radius = 6e-3

    def pressure_transform(self, k):
        return np.exp(-np.square(k * 1e-3) / 2) / (2 * np.pi)

    def shear_transform(self, k):
        return np.zeros_like(k)


def imported(path, sigma="S6", **options):
    """Import a mesh with the usual options."""
    given = {"r_unit": "mm", "sigma_unit": "MPa", "load": 1.0, **options}
    return read_reference_mesh(path, sigma=sigma, **given)


def saved(mesh, name="film.vtu", **options):
    """Save a mesh with meshio, whose XDMF knows no fields of four components."""
    if name.endswith(".xdmf"):
        for fields in (mesh.point_data, mesh.cell_data):
            for field in ("S4", "C4"):
                fields.pop(field, None)
    return write(mesh, Path(name), **options)


def assert_is_the_section(found, *, turned=1):
    profile = found.profile
    np.testing.assert_allclose(profile.r, RADII * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(profile.sigma_zz, 1e6 * pressure(RADII), rtol=1e-12)
    shear = -turned * 1e6 * tensor(RADII, 0.0)[:, 3]
    np.testing.assert_allclose(profile.sigma_rz, shear, rtol=1e-12, atol=1e-9)


def test_another_programs_film_has_the_stress_that_hankel_transforms_give():
    """GetFEM's mesh is coarse: 0.19 % and 0.39 % of the maxima are its own error.

    With half the steps and a wider film they fall to 0.05 % and 0.06 %.
    """
    found = imported(DATA / "getfem_film.vtu", "stress").profile
    film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    field = HankelField(film, GaussianPressure())
    normal = field.base(found.r, 0)
    shear = field.base(found.r, 1)
    np.testing.assert_allclose(found.sigma_zz, normal, atol=3e-3 * normal.max())
    np.testing.assert_allclose(found.sigma_rz, shear, atol=6e-3 * np.abs(shear).max())
    assert shear.min() < 0  # the base holds back a film that is squeezed outward
    assert found.force == pytest.approx(1.0, abs=2e-3)


def test_a_mesh_as_paraview_writes_it_is_read_at_its_nodes_and_in_its_cells():
    assert_is_the_section(imported(DATA / "vtk_film.vtu", "S"), turned=-1)
    found = imported(DATA / "vtk_film.vtu", "S33")
    middles = (RADII[1:] + RADII[:-1]) / 2
    np.testing.assert_allclose(found.profile.r, 1e-3 * middles, rtol=1e-12)
    np.testing.assert_allclose(found.profile.sigma_zz, 1e6 * pressure(middles), rtol=1e-12)
    assert found.profile.sigma_rz is None


@pytest.mark.parametrize(("name", "options"), [
    ("film.vtu", {}), ("film.vtu", {"compression": "lzma"}), ("film.vtu", {"compression": None}),
    ("film.vtu", {"header_type": "UInt64"}), ("film.vtk", {}), ("film.vtk", {"fmt_version": "4.2"}),
    ("film.xdmf", {}), ("film.xdmf", {"data_format": "XML"}),
])  # fmt: skip
def test_every_kind_of_file_gives_the_same_stress(name, options):
    assert_is_the_section(imported(saved(section(), name, **options), "S9"))


@pytest.mark.parametrize("compression", [None, "zlib"])
def test_appended_raw_bytes_are_read_as_paraview_writes_them(compression):
    path = saved(section(), compression=compression, header_type="UInt64")
    raw = b""

    def append(array):
        nonlocal raw
        begin = len(raw)
        # Header and numbers are encoded apart.
        raw += b"".join(map(base64.b64decode, re.findall("[A-Za-z0-9+/]+={0,2}", array[1])))
        return f'format="appended" offset="{begin}"/>'

    text = re.sub(r'format="binary">([^<]*)</DataArray>', append, path.read_text())
    head, end, _ = text.partition("</VTKFile>")
    appended = b'<AppendedData encoding="raw">\n _' + raw + b"\n</AppendedData>"
    path.write_bytes(head.encode() + appended + end.encode())
    assert_is_the_section(imported(path, "S9"))


@pytest.mark.parametrize(
    ("sigma", "plane"), [("S4", "xy"), ("S4", "yz"), ("S6", "xz"), ("S6", "yz"), ("S9", "xz")]
)
def test_the_components_of_a_tensor_are_found_in_every_plane(sigma, plane):
    assert_is_the_section(imported(saved(section(plane)), sigma))


@pytest.mark.parametrize(("plane", "order", "shear"), [
    ("xz", [0, 1, 2, 3, 5, 4], "S6:5"),  # of Abaqus: xy, xz, yz
    ("xy", [0, 1, 2, 4, 5, 3], "S6:6"),  # of Voigt: yz, xz, xy
    ("yz", [0, 1, 2, 4, 5, 3], "S6:4"),
])  # fmt: skip
@pytest.mark.parametrize("kept", ["point_data", "cell_data"])
def test_shears_of_a_section_in_another_order_are_refused_unless_named(plane, order, shear, kept):
    mesh = section(plane)
    six = mesh.point_data["S6"][:, order]
    mesh.point_data = {"S6": six} if kept == "point_data" else {}
    mesh.cell_data = {"S6": [six[mesh.cells[0].data].mean(axis=1)]} if kept == "cell_data" else {}
    path = saved(mesh)
    with pytest.raises(InputError, match=f"'{shear}' is not zero(.|\n)*--shear \"{shear}"):
        imported(path, "S6")
    found = imported(path, "S6", shear=shear).profile
    assert np.abs(found.sigma_rz).max() > 0.05 * found.sigma_zz.max()


def test_the_axis_across_the_film_can_be_named():
    path = saved(section("yx"))  # y is the radius, x the height
    (warning,) = [note for note in imported(path).notes if note.kind == "vertical_axis"]
    assert "8 mm along y but 2 mm along x" in warning.text
    assert_is_the_section(imported(path, vertical="x"))
    with pytest.raises(InputError, match="extends along x and y"):
        imported(path, vertical="z")


def test_one_value_or_one_component_is_taken_as_it_is_named():
    mesh = section()
    mesh.point_data["S:2"] = mesh.point_data["S33"]
    path = saved(mesh)
    assert_is_the_section(imported(path, "S:2", shear="S13"))
    assert imported(path, "S33").profile.sigma_rz is None
    assert_is_the_section(imported(path, "S33", shear="S13"))
    assert_is_the_section(imported(path, "S9:5", shear="S6:4"))
    assert_is_the_section(imported(path, "S33", shear="S13", shear_sign=1), turned=-1)
    with pytest.raises(InputError, match="no component 7"):
        imported(path, "S6:7")


def test_a_film_hanging_from_its_base_has_its_shear_turned():
    mesh = section(heights=HEIGHTS - 2.0)
    # The stress of the base, now at y = 0, is that of the highest nodes.
    assert_is_the_section(imported(saved(mesh), base=0.0), turned=-1)


def test_what_lies_below_the_base_of_the_film_is_left_out():
    """Film and substrate share no nodes where the radial stress jumps, as programs save it."""
    film = section()
    substrate = section(heights=np.linspace(-1.0, 0.0, 3))
    count = len(film.points)
    mesh = meshio.Mesh(
        np.concatenate([film.points, substrate.points]),
        [("quad", film.cells[0].data), ("quad", substrate.cells[0].data + count)],
        point_data={"S6": np.concatenate([film.point_data["S6"], np.full((count - 41, 6), 9.0)])},
        cell_data={"C33": [*film.cell_data["C33"], np.full(80, 9.0)]},
    )
    path = saved(mesh)
    assert_is_the_section(imported(path, base=0.0))
    found = imported(path, "C33", base=0.0).profile
    np.testing.assert_allclose(found.sigma_zz, 1e6 * pressure(1e3 * found.r), rtol=1e-12)


def test_a_rigid_bodys_own_node_and_the_faces_of_the_mesh_do_not_count():
    mesh = section()
    lone = np.concatenate([mesh.points, [[0.0, -5.0, 0.0]]])
    fields = {"S6": np.concatenate([mesh.point_data["S6"], np.full((1, 6), np.nan)])}
    base = np.flatnonzero(mesh.points[:, 1] == 0)
    sides = np.stack([base[:-1], base[1:]], axis=1)
    cells = [("quad", mesh.cells[0].data), ("line", sides), ("vertex", [[len(mesh.points)]])]
    values = [mesh.cell_data["C33"][0], np.full(40, 7.0), np.full(1, 7.0)]
    path = saved(meshio.Mesh(lone, cells, point_data=fields, cell_data={"C33": values}))
    assert_is_the_section(imported(path))
    assert imported(path, "C33").profile.force == pytest.approx(1.0, rel=1e-3)


def test_values_given_for_each_element_are_averaged_at_shared_nodes():
    mesh = section()
    corners = mesh.cells[0].data
    stress = mesh.point_data["S33"][corners] * [0.9, 1.1, 1.0, 1.0]
    apart = meshio.Mesh(
        mesh.points[corners.ravel()],
        [("quad", np.arange(corners.size).reshape(-1, 4))],
        point_data={"S33": stress.ravel()},
    )
    found = imported(saved(apart), "S33")
    np.testing.assert_allclose(found.profile.r, 1e-3 * RADII, atol=1e-12)
    inner = found.profile.sigma_zz[1:-1]
    np.testing.assert_allclose(inner, 1e6 * pressure(RADII[1:-1]), rtol=1e-12)
    assert any("39 nodes repeat a radius" in note.text for note in found.notes)


@pytest.mark.parametrize(
    ("x", "y", "centre"),
    [
        (np.linspace(0, 8, 41), np.linspace(0, 8, 41), (0.0, 0.0)),
        (np.linspace(-8, 8, 81), np.linspace(-8, 8, 81), (0.0, 0.0)),
        (np.linspace(-8, 8, 81), np.linspace(0, 8, 41), (0.5, 0.0)),
    ],
    ids=["quarter", "whole", "half, off the centre"],
)
def test_a_film_in_3d_is_averaged_over_circles(x, y, centre):
    """Linear interpolation on squares of 0.2 mm costs at most 0.2² / 4 of the curvature."""
    place = (1e-3 * centre[0], 1e-3 * centre[1]) if any(centre) else None
    found = imported(saved(block(x, y, centre=centre)), centre=place).profile
    exact = 1e6 * pressure(1e3 * found.r)
    np.testing.assert_allclose(found.sigma_zz, exact, atol=0.011 * exact.max())
    assert found.force == pytest.approx(1.0, abs=0.01)


def test_units_and_signs_are_those_that_are_given():
    mesh = section()
    mesh.points = mesh.points * 1e-3
    mesh.point_data = {"p": -1e3 * mesh.point_data["S33"]}
    path = saved(mesh)
    found = imported(path, "p", r_unit="m", sigma_unit="kPa", sign=1)
    np.testing.assert_allclose(found.profile.sigma_zz, 1e6 * pressure(RADII), rtol=1e-12)
    with pytest.raises(InputError, match=r"sign=1; --sign 1"):
        imported(path, "p", r_unit="m", sigma_unit="kPa")
    with pytest.raises(InputError, match='"Pa"'):
        imported(path, "p", r_unit="m", sigma_unit="Pa", sign=1)
    with pytest.raises(UnitError, match=r"film\.vtu"):
        imported(path, "p", r_unit="kPa", sigma_unit="kPa", sign=1)


def test_a_mesh_without_fields_is_refused():
    path = saved(meshio.Mesh(section().points, section().cells))
    with pytest.raises(InputError, match="no fields at all"):
        imported(path, "Stress")


def test_a_field_that_may_mean_several_things_is_not_guessed_at():
    with pytest.raises(InputError, match=r'"S6:2"'):
        imported(saved(section(), "film.xdmf"), "S6")
    assert imported(Path("film.xdmf"), "S6:2").profile.sigma_rz is None
    mesh = section()
    mesh.point_data["plane"] = mesh.point_data["S9"][:, [0, 1, 3, 4]]  # xx, xy, yx, yy
    path = saved(mesh)
    for name in ("plane", "u"):
        with pytest.raises(InputError, match="components, and which of them is meant"):
            imported(path, name)
    assert imported(path, "plane:4").profile.force == pytest.approx(1.0, rel=1e-5)
    with pytest.raises(InputError, match="at the nodes and the other in the cells"):
        imported(path, "S33", shear="C33")


@pytest.mark.parametrize(
    ("mesh", "options", "words"),
    [
        (section(), {"base": 0.1e-3}, "nearest node is at 0 mm"),
        (section(heights=[0.0, 1.0]), {"vertical": "x"}, "too few nodes on its film's base: 2"),
        (section(), {"centre": (0.0, 0.0)}, "--centre"),
        (section(radii=np.linspace(-8, 8, 41)), {}, "negative radius"),
        (block(RADII, RADII), {"shear": "S33"}, "sections only"),
        (meshio.Mesh(section().points, [("vertex", [[0], [1]])]), {}, "a line or a point"),
        (section(radii=RADII[:3]), {}, "too few nodes on its film's base: 3"),
        (section(radii=[0.0, 1.0, 1.0 + 1e-9, 1.0 + 2e-9]), {}, "too few radii: 2"),
        (meshio.Mesh(section().points[:, ::2], [("line", [[0, 1]])]), {}, "a line or a point"),
    ],
)
def test_a_mesh_without_a_base_that_can_be_used_is_refused(mesh, options, words):
    path = saved(mesh, "film.vtk")
    with pytest.raises(InputError, match=words) as caught:
        imported(path, **options)
    assert caught.value.cure


def test_a_value_that_is_no_number_is_refused_only_where_it_matters():
    mesh = section()
    inside = int(np.flatnonzero(mesh.points[:, 1] > 0)[5])
    mesh.point_data["S6"][inside] = np.nan
    assert_is_the_section(imported(saved(mesh)))
    mesh.point_data["S6"][4 * 3] = np.inf
    with pytest.raises(InputError, match="sigma_zz is not a number in base node 4"):
        imported(saved(mesh))
    solid = block(RADII, RADII)
    solid.point_data["S33"][0] = np.nan
    with pytest.raises(InputError, match="sigma_zz is not a number in base node 1"):
        imported(saved(solid), "S33")


def test_a_mesh_of_another_kind_is_refused_with_those_that_are_read():
    for name in ("film.msh", "film.frd", "film.pvtu", "film", "film.csv"):
        with pytest.raises(FormatError, match=r"\.vtu") as caught:
            read_mesh(name)
        assert "ParaView" in caught.value.cure
