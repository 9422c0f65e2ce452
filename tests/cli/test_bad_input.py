"""What cannot be calibrated: plain words, the right exit code, and the old output still there."""

from __future__ import annotations

import os
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
        done = run("calibrate", *arguments, "-o", out, "--force")
        assert done.code == code, done.err
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


def test_a_voltage_without_units_is_refused_by_its_path(
    refused: Callable[..., str], scan: Path
) -> None:
    def edit(file: h5py.File) -> None:
        del file["/entry/data/u_zz"].attrs["units"]

    message = refused(edited(scan, edit))
    assert "scan.h5: /entry/data/u_zz" in message
    assert "unit" in message


@pytest.mark.parametrize(
    ("path", "unit"),
    [
        ("/entry/data/u_zz", "N"),
        ("/entry/data/x", "mV"),
        ("/entry/indenter/load", "kg"),
        ("/entry/sample/film/thickness", "furlongs per mV"),
    ],
)
def test_a_wrong_unit_is_refused_by_its_path_and_name(
    refused: Callable[..., str], scan: Path, path: str, unit: str
) -> None:
    def edit(file: h5py.File) -> None:
        file[path].attrs["units"] = unit

    message = refused(edited(scan, edit))
    assert f"scan.h5: {path}" in message
    assert unit in message


def test_a_scan_of_missing_points_is_refused(refused: Callable[..., str], scan: Path) -> None:
    def edit(file: h5py.File) -> None:
        file["/entry/data/u_zz"][...] = np.nan

    assert "missing (NaN)" in refused(edited(scan, edit))


def test_fewer_points_than_parameters_are_refused(
    refused: Callable[..., str], folder: Path
) -> None:
    scan = memscal.simulate(points=5, seed=1)
    memscal.write_scan(scan, folder / "scan.h5")
    message = refused("scan.h5")
    assert "5 measured positions" in message
    assert "Scan more positions" in message


def test_a_rod_wider_than_the_film_is_thick_is_refused(
    refused: Callable[..., str], folder: Path
) -> None:
    message = refused(written(folder / "scan.h5", indenter=memscal.Rod(radius=1.2e-3)))
    assert "2.4 mm wide" in message
    assert "2 mm thick" in message


def test_a_load_of_zero_is_refused(refused: Callable[..., str], scan: Path) -> None:
    def edit(file: h5py.File) -> None:
        file["/entry/indenter/load"][()] = 0.0

    message = refused(edited(scan, edit))
    assert "0 N" in message
    assert "/entry/indenter/load" in message


def test_a_voltage_of_the_wrong_sign_is_refused(refused: Callable[..., str], folder: Path) -> None:
    turned = -memscal.simulate(seed=1).u_zz
    message = refused(written(folder / "scan.h5", u_zz=turned))
    assert "falls by" in message
    assert "sign of u_zz" in message
    assert "--u-sign -1" in message


def test_a_reference_that_does_not_cover_the_scan_is_refused(
    refused: Callable[..., str], scan: Path, folder: Path
) -> None:
    film = memscal.simulate(seed=1).film
    r = np.linspace(0.0, 2e-3, 100)
    profile = memscal.indent(film, memscal.Rod(radius=0.25e-3), load=1.0).profile(r)
    memscal.write_reference(profile, folder / "short.h5")
    message = refused(scan, "--reference", "short.h5")
    assert "ends at r = 2 mm" in message
    assert "Extend the reference" in message


def test_a_scan_in_the_place_of_a_reference_is_refused(
    refused: Callable[..., str], scan: Path
) -> None:
    assert "memscal-reference" in refused(scan, "--reference", scan)


def test_a_scan_with_a_sphere_is_no_calibration_scan(
    refused: Callable[..., str], folder: Path
) -> None:
    message = refused(written(folder / "scan.h5", indenter=memscal.Sphere(radius=0.1288)))
    assert "made with a sphere" in message
    assert "needs a rod" in message


def test_a_truncated_file_is_refused(refused: Callable[..., str], scan: Path) -> None:
    data = scan.read_bytes()
    scan.write_bytes(data[: len(data) // 2])
    message = refused(scan)
    assert "damaged or incomplete" in message
    assert "Get the file again" in message


def test_a_file_of_another_kind_is_refused(refused: Callable[..., str], folder: Path) -> None:
    (folder / "scan.h5").write_text("x,u\n0,1\n")
    assert "not an HDF5 file" in refused("scan.h5")


def test_a_file_of_a_future_version_is_refused(refused: Callable[..., str], scan: Path) -> None:
    def edit(file: h5py.File) -> None:
        file.attrs["memscal_schema_version"] = "2.0.0"

    assert "2.0.0" in refused(edited(scan, edit))


def external_link(file: h5py.File) -> None:
    del file["/entry/data/u_zz"]
    file["/entry/data/u_zz"] = h5py.ExternalLink("/proc/self/fd/0", "/entry/data/u_zz")


def soft_link(file: h5py.File) -> None:
    file.move("/entry/data/u_zz", "/entry/data/elsewhere")
    file["/entry/data/u_zz"] = h5py.SoftLink("/entry/data/elsewhere")


def external_storage(file: h5py.File) -> None:
    del file["/entry/data/u_zz"]
    storage = [("/etc/hostname", 0, h5py.h5f.UNLIMITED)]
    dataset = file.create_dataset("/entry/data/u_zz", (65,), "f8", external=storage)
    dataset.attrs["units"] = "mV"


def virtual(file: h5py.File) -> None:
    del file["/entry/data/u_zz"]
    layout = h5py.VirtualLayout((65,), "f8")
    layout[:] = h5py.VirtualSource("missing.h5", "/u", (65,))
    file.create_virtual_dataset("/entry/data/u_zz", layout).attrs["units"] = "mV"


def huge(file: h5py.File) -> None:
    del file["/entry/data/u_zz"]
    shape = (1 << 45,)
    dataset = file.create_dataset("/entry/data/u_zz", shape, "f8", chunks=(1 << 16,))
    dataset.attrs["units"] = "mV"


@pytest.mark.parametrize("edit", [external_link, soft_link, external_storage, virtual, huge])
def test_a_hostile_file_is_refused_unread(
    refused: Callable[..., str], scan: Path, edit: Callable[[h5py.File], None]
) -> None:
    assert "/entry/data/u_zz" in refused(edited(scan, edit))


def test_a_pipe_in_the_place_of_a_scan_does_not_keep_the_program_waiting(
    refused: Callable[..., str], folder: Path
) -> None:
    os.mkfifo(folder / "pipe.h5")
    assert "not a regular file" in refused("pipe.h5")


def test_a_scan_that_is_missing_is_named(refused: Callable[..., str], folder: Path) -> None:
    assert "missing.h5 cannot be read: No such file" in refused("missing.h5")


def test_a_folder_in_the_place_of_a_scan_is_refused(
    refused: Callable[..., str], folder: Path
) -> None:
    (folder / "data.h5").mkdir()
    assert "not a regular file" in refused("data.h5")


def test_a_name_that_would_steer_the_terminal_is_shown_without_its_controls(
    run: Run, folder: Path
) -> None:
    done = run("calibrate", "\x1b[2Jscan.h5")
    assert done.code == 3
    assert "\x1b" not in done.err
