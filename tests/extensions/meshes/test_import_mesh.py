"""``memscal import`` of the meshes of finite-element programs."""

import shutil
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest
from helpers.console import names
from helpers.folders import DATA
from helpers.meshes import RADII, block, pressure, section

import memscal

MESH = ["--format", "reference", "--r-unit", "mm", "--sigma-unit", "MPa", "--load", 1]


@pytest.fixture
def mesh(folder):
    """A section of a film, as another program saved it."""
    return Path(shutil.copy(DATA / "vtk_film.vtu", folder / "film.vtu"))


def test_lengths_on_the_command_line_are_in_mm(run, folder):
    film = section("yx", heights=np.linspace(3.0, 5.0, 4))
    film.point_data = {"p": -pressure(film.points[:, 1])}
    meshio.vtk.write("film.vtk", film)
    place = ["--sigma", "p", "--vertical", "x", "--base", 5]
    assert run("import", "film.vtk", "-o", "film.h5", *MESH, *place).code == 0
    found = memscal.read_reference("film.h5")
    np.testing.assert_allclose(found.sigma_zz, 1e6 * pressure(RADII), rtol=1e-12)
    solid = block(np.linspace(-8, 8, 41), np.linspace(-8, 8, 41), centre=(1.0, -0.5))
    meshio.vtu.write("film.vtu", solid)
    place = ["--sigma", "S6", "--centre", 1, -0.5]
    run("import", "film.vtu", "-o", "solid.h5", *MESH, *place).exits(0)
    assert memscal.read_reference("solid.h5").force == pytest.approx(1.0, abs=0.03)


def test_the_file_that_holds_the_numbers_of_a_mesh_is_an_input_too(run, folder):
    film = section()
    film.point_data = {"S33": film.point_data["S33"]}
    film.cell_data = {}
    meshio.xdmf.write("film.xdmf", film)
    before = Path("film.h5").read_bytes()
    (folder / "link.h5").symlink_to("film.h5")
    for output in ("film.h5", "link.h5"):
        options = [*MESH, "--sigma", "S33", "--force"]
        run("import", "film.xdmf", "-o", output, *options).exits(4, "also an input")
    assert Path("film.h5").read_bytes() == before
    assert names(folder) == ["film.h5", "film.xdmf", "link.h5"]


def test_without_meshio_it_is_named(run, mesh, monkeypatch):
    monkeypatch.setitem(sys.modules, "meshio", None)
    refused = run("import", mesh, "-o", "film.h5", *MESH, "--sigma", "S")
    refused.exits(3, 'pip install ".[fem-io]"')
