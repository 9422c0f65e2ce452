"""``memscal reference``."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from console import Run, names

import memscal


def test_json_has_one_object_per_load_in_the_contracts_names_and_units(run: Run) -> None:
    found = run("reference", "rod", "--load", 0.5, "--load", 2, "--json").json
    first, second = found["solutions"]
    units = {
        "load": "N", "depth": "um", "contact_radius": "mm", "stick_radius": "mm",
        "max_interface_stress": "Pa", "max_base_stress": "Pa", "friction_coefficient": "1",
        "convergence": "1",
    }  # fmt: skip
    assert {name: first[name]["unit"] for name in units} == units
    assert (first["loading"], first["backend"]) == ("incremental", "hankel")
    # The model is linear in the load.
    for name in ("load", "depth", "max_base_stress"):
        assert second[name]["value"] == pytest.approx(4 * first[name]["value"])
    assert first["contact_radius"]["value"] == pytest.approx(0.25)
    assert first["stick_radius"]["value"] == 0
    assert first["convergence"]["value"] < 1e-5


def test_the_papers_rod_has_the_known_stiffness(run: Run) -> None:
    (solution,) = run("reference", "rod", "--json").json["solutions"]
    assert solution["load"]["value"] == 1.0
    assert 1e3 / solution["depth"]["value"] == pytest.approx(1.704, abs=5e-4)


def test_the_unbounded_pressure_under_the_edge_is_null_and_explained(run: Run) -> None:
    found = run("reference", "rod", "--json").json
    assert found["solutions"][0]["max_interface_stress"]["value"] is None
    assert any("without bound" in warning for warning in found["warnings"])


def test_a_depth_gives_the_load_that_gives_the_depth(run: Run) -> None:
    (pressed,) = run("reference", "rod", "--depth", 100, "--json").json["solutions"]
    load = pressed["load"]["value"]
    (loaded,) = run("reference", "rod", "--load", load, "--json").json["solutions"]
    assert loaded["depth"]["value"] == pytest.approx(100)


def test_a_sticking_rod_says_so_without_writing_infinity(run: Run) -> None:
    (solution,) = run("reference", "rod", "--friction", "inf", "--json").json["solutions"]
    assert solution["sticking"] is True
    assert solution["friction_coefficient"]["value"] is None
    assert solution["stick_radius"] == solution["contact_radius"]


def test_the_table_shows_every_load(run: Run) -> None:
    lines = run("reference", "rod", "--load", 0.25, "--load", 0.75).out.splitlines()
    assert "frictionless rod of radius 0.25 mm" in lines[0]
    assert [line.split()[0] for line in lines[3:]] == ["0.25", "0.75"]


def test_options_of_the_film_and_the_rod_reach_the_file(run: Run, folder: Path) -> None:
    film = ["--young-modulus", 1.5, "--poisson-ratio", 0.45, "--thickness", 3]
    done = run("reference", "rod", "--radius", 0.4, *film, "--load", 0.7, "-o", "rod.h5")
    assert done.code == 0
    assert "Written: rod.h5" in done.err
    profile = memscal.read_reference("rod.h5")
    assert profile.film == memscal.ElasticFilm(
        young_modulus=1.5e6, poisson_ratio=0.45, thickness=3e-3
    )
    assert profile.indenter == memscal.Rod(radius=0.4e-3)
    assert profile.load == 0.7
    # The table carries the load, to what a sum by trapezia makes of it.
    assert profile.force == pytest.approx(0.7, rel=1e-3)
    assert np.all(np.diff(profile.r) > 0)


def test_a_file_is_for_one_load(run: Run, folder: Path) -> None:
    refused = run("reference", "rod", "--load", 1, "--load", 2, "-o", "rod.h5")
    assert refused.code == 2
    assert "one load" in refused.err
    assert names(folder) == []


def test_load_and_depth_exclude_each_other(run: Run) -> None:
    refused = run("reference", "rod", "--load", 1, "--depth", 2)
    assert refused.code == 2
    assert "not both" in refused.err


@pytest.mark.parametrize(
    ("arguments", "word"),
    [
        (["sphere"], "sphere"),
        (["rod", "--friction", "0.3"], "friction is 0.3"),
        (["rod", "--backend", "fem"], "fem"),
        (["rod", "--depth", "3000"], "would sink 3000 um"),
    ],
)
def test_what_this_version_cannot_solve_is_refused_plainly(
    run: Run, folder: Path, arguments: list[str], word: str
) -> None:
    refused = run("reference", *arguments, "-o", "out.h5")
    assert refused.code == 3
    assert word in refused.err
    assert names(folder) == []


def test_a_reference_is_not_replaced_unless_forced(run: Run, folder: Path) -> None:
    Path("rod.h5").write_bytes(b"old")
    assert run("reference", "rod", "-o", "rod.h5").code == 4
    assert Path("rod.h5").read_bytes() == b"old"
    assert run("reference", "rod", "-o", "rod.h5", "--force").code == 0
    assert memscal.read_reference("rod.h5").load == 1


def test_a_depth_beyond_linear_elasticity_is_pointed_out(run: Run) -> None:
    assert "29% of the film's thickness" in run("reference", "rod").err
    assert run("reference", "rod", "--depth", 100).err == ""
