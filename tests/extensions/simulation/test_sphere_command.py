"""``memscal simulate --experiment sphere``."""

from pathlib import Path

import numpy as np
import pytest
from helpers.console import Run, names, run_program

import memscal
from memscal.extensions.simulation.command import FILES

SPHERE = ("simulate", "--experiment", "sphere")
FEW = ("--load", 0.69, "--lubricated-load", 0.69, "--contacts", 9, "--spacing", 2)


def scans(folder: Path) -> dict[str, memscal.Scan]:
    return {name: memscal.read_scan(folder / name) for name in FILES}


def test_options_mean_their_units(run: Run, folder: Path):
    options = [
        *FEW, "--friction", 0.3, "--loading", "total", "--sphere-radius", 100, "--repeats", 2,
        "--sphere-radius-uncertainty", 0.2, "--load-scatter", 1, "--position-error", 5,
        "--points", 33, "--thickness", 3, "--gain", 1.05, "--thickness-factor", 0.95,
    ]  # fmt: skip
    done = run(*SPHERE, "-o", "run", *options, "--json").exits(0)
    rod, dry, lubricated = scans(folder / "run").values()
    assert rod.u_zz.shape == (33,)
    assert dry.u_zz.shape == lubricated.u_zz.shape == (2, 9)
    assert (dry.x[0], dry.x[-1]) == pytest.approx((-8e-3, 8e-3))
    assert dry.indenter == memscal.Sphere(radius=0.1, radius_uncertainty=0.2e-3)
    np.testing.assert_allclose(dry.x_errors, np.full(9, 5e-6))
    np.testing.assert_allclose(dry.normal_load_errors, np.full((2, 9), 0.0069))
    told = dry.synthetic
    assert (told["friction"], told["loading"], told["gain"]) == (0.3, "total", 1.05)
    assert (dry.film.thickness, told["thickness"]) == pytest.approx((3e-3, 2.85e-3))
    assert [item["scan"] for item in done.json["scans"]] == [f"run/{name}" for name in FILES]
    assert done.json["synthetic"] is True
    assert done.json["scans"][1]["truth"]["position_error"]["value"] == pytest.approx(5.0)


def test_existing_scans_are_replaced_only_if_it_is_asked_for(run: Run, folder: Path):
    assert run(*SPHERE, "-o", "run", *FEW).code == 0
    before = {name: (folder / "run" / name).read_bytes() for name in FILES}
    (folder / "run" / FILES[0]).unlink()
    run(*SPHERE, "-o", "run", *FEW, "--seed", 1).exits(4, "exists already")
    assert names(folder / "run") == sorted(FILES[1:])
    assert (folder / "run" / FILES[1]).read_bytes() == before[FILES[1]]
    (folder / "run" / "notes.txt").write_text("mine")
    assert run(*SPHERE, "-o", "run", *FEW, "--seed", 1, "--force").code == 0
    assert names(folder / "run") == sorted([*FILES, "notes.txt"])
    assert memscal.read_scan(f"run/{FILES[1]}").synthetic["seed"] == 1


def test_a_file_that_cannot_be_written_leaves_none_of_them(folder: Path):
    # The last file has a longer table of contacts than the first, which alone would fit.
    few = [*map(str, FEW), "--repeats", "40", "--load-scatter", "0"]
    done = run_program(*SPHERE, "-o", "run", *few, cwd=folder, limit=42_000)
    assert done.returncode == 4, done.stderr
    assert "sphere" in done.stderr
    assert "Traceback" not in done.stderr
    assert names(folder) == []
