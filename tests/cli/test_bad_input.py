"""What cannot be calibrated: plain words, the right exit code, and the old output still there."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.console import Run, names

import memscal

OLD = b"an artifact from last week"


@pytest.fixture
def refused(run: Run, folder: Path) -> Callable[..., str]:
    """Calibrate with --force over an old output; return the message of the refusal."""
    out = folder / "out.h5"
    out.write_bytes(OLD)

    def refused_(*arguments: object, code: int = 3) -> str:
        before = names(folder)
        done = run("calibrate", *arguments, "-o", out, "--force").exits(code)
        assert done.out == ""
        assert done.err.startswith("Error: ")
        assert "Traceback" not in done.err
        assert out.read_bytes() == OLD
        assert names(folder) == before
        return done.err

    return refused_


def edited(scan: Path, edit: Callable[[h5py.File], None]) -> Path:
    with h5py.File(scan, "r+") as file:
        edit(file)
    return scan


def written(path: Path, **changes: object) -> Path:
    memscal.write_scan(replace(memscal.simulate(seed=1), **changes), path)  # type: ignore[arg-type]
    return path


def test_a_voltage_without_units_is_refused_by_its_path(refused: Callable[..., str], scan: Path):
    def edit(file: h5py.File) -> None:
        del file["/entry/data/u_zz"].attrs["units"]

    message = refused(edited(scan, edit))
    assert "scan.h5: /entry/data/u_zz" in message
    assert "unit" in message


def test_a_scan_of_missing_points_is_refused(refused: Callable[..., str], scan: Path):
    def edit(file: h5py.File) -> None:
        file["/entry/data/u_zz"][...] = np.nan

    assert "missing (NaN)" in refused(edited(scan, edit))


def test_fewer_points_than_parameters_are_refused(refused: Callable[..., str], folder: Path):
    scan = memscal.simulate(points=5, seed=1)
    memscal.write_scan(scan, folder / "scan.h5")
    message = refused("scan.h5")
    assert "5 measured positions" in message
    assert "Scan more positions" in message


def test_a_rod_wider_than_the_film_is_thick_is_refused(refused: Callable[..., str], folder: Path):
    message = refused(written(folder / "scan.h5", indenter=memscal.Rod(radius=1.2e-3)))
    assert "2.4 mm wide" in message
    assert "2 mm thick" in message


def test_a_voltage_of_the_wrong_sign_is_refused(refused: Callable[..., str], folder: Path):
    turned = -memscal.simulate(seed=1).u_zz
    message = refused(written(folder / "scan.h5", u_zz=turned))
    assert "falls by" in message
    assert "sign of u_zz" in message
    assert "--u-sign -1" in message


def test_a_reference_shorter_than_the_scan_is_refused(
    refused: Callable[..., str], scan: Path, folder: Path
):
    film = memscal.simulate(seed=1).film
    r = np.linspace(0.0, 2e-3, 100)
    profile = memscal.indent(film, memscal.Rod(radius=0.25e-3), load=1.0).profile(r)
    memscal.write_reference(profile, folder / "short.h5")
    message = refused(scan, "--reference", "short.h5")
    assert "ends at r = 2 mm" in message
    assert "Extend the reference" in message


def test_a_scan_in_the_place_of_a_reference_is_refused(refused: Callable[..., str], scan: Path):
    assert "memscal-reference" in refused(scan, "--reference", scan)


def test_a_scan_with_a_sphere_is_no_calibration_scan(refused: Callable[..., str], folder: Path):
    message = refused(written(folder / "scan.h5", indenter=memscal.Sphere(radius=0.1288)))
    assert "made with a sphere" in message
    assert "needs a rod" in message


def external_link(file: h5py.File) -> None:
    del file["/entry/data/u_zz"]
    file["/entry/data/u_zz"] = h5py.ExternalLink("/proc/self/fd/0", "/entry/data/u_zz")


def test_a_hostile_file_is_refused_unread(refused: Callable[..., str], scan: Path):
    assert "/entry/data/u_zz" in refused(edited(scan, external_link))


def test_a_scan_that_is_missing_is_named(refused: Callable[..., str], folder: Path):
    assert "missing.h5 cannot be read: No such file" in refused("missing.h5")


def test_a_name_that_would_steer_the_terminal_is_shown_without_its_controls(run: Run, folder: Path):
    done = run("calibrate", "\x1b[2Jscan.h5").exits(3)
    assert "\x1b" not in done.err
