"""Our files before the judges of NeXus files, as their command lines and readers are used."""

import os
import subprocess
import sys
import warnings
from dataclasses import replace

import pytest
from helpers.folders import SHIPPED
from helpers.nexus import definitions_folder, violations

import memscal
from memscal.extensions.certificate.laboratory import read_laboratory
from memscal.model.scan import STATED_ERRORS


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A file of each kind as a user writes it, with all that it may hold."""
    folder = tmp_path_factory.mktemp("written")
    files = {
        name: folder / f"{name}.h5"
        for name in (
            "line",
            "raster",
            "reference",
            "artifact",
            "compact",
            "of_raster",
            "stress",
            "named",
        )
    }
    experiment = SHIPPED / "sphere_experiment"
    contacts = [memscal.read_scan(experiment / f"sphere_{k}.h5") for k in ("dry", "lubricated")]
    scan = memscal.read_scan(experiment / "rod_scan.h5")
    raster = SHIPPED / "rod_scan_raster.h5"
    apparatus = memscal.calibrate(scan).apparatus
    # NeXus has another meaning of names that end with "_offset".
    names = [name for name in STATED_ERRORS if name != "line_offset"]
    stated = {f"{name}_uncertainty": 1e-3 for name in names}
    memscal.write_scan(replace(scan, position_errors_by_repeat=True, **stated), files["line"])
    memscal.write_scan(memscal.read_scan(raster), files["raster"])
    run = [sys.executable, "-m", "memscal", "reference", "rod", "--load", "1"]
    subprocess.run([*run, "-o", files["reference"]], check=True)
    apparatus.save(files["artifact"])
    apparatus.compact().save(files["compact"])
    memscal.calibrate(raster).apparatus.save(files["of_raster"])
    memscal.measure_stress(contacts, apparatus).save(files["stress"])
    unnamed = replace(scan, sensor=memscal.StressSensor(), load_cell=memscal.LoadCell())
    additions = read_laboratory(SHIPPED / "lab.toml").additions(unnamed)
    memscal.calibrate(replace(unnamed, **additions)).apparatus.save(files["named"])
    return files


def test_chexus_finds_no_violation(written):
    for path in written.values():
        run = ["chexus", "--exit-on-fail", os.fspath(path)]
        outcome = subprocess.run(run, check=False, capture_output=True, text=True)
        assert outcome.returncode == 0, outcome.stdout


def test_nxvalidate_and_nxlint_find_nothing(written, tmp_path):
    folder = definitions_folder(tmp_path / "definitions")
    found = {name: violations(path, folder) for name, path in written.items()}
    assert {name: lines for name, lines in found.items() if lines} == {}
    for definition in sorted((folder / "applications").glob("NXmemscal_*")):
        run = ["nxlint", "-d", os.fspath(folder), os.fspath(definition)]
        outcome = subprocess.run(run, check=False, capture_output=True, text=True)
        assert "Total number of errors: 0" in outcome.stdout + outcome.stderr, outcome.stdout


def test_pynx_finds_every_file_valid(written, tmp_path):
    folder = definitions_folder(tmp_path / "definitions", "pynxtools")
    environment = {**os.environ, "NEXUS_DEF_PATH": os.fspath(folder)}
    for path in written.values():
        # The attributes of HDF5's dimension scales are documented in no definition.
        run = ["pynx", "validate", "--ignore-undocumented", os.fspath(path)]
        outcome = subprocess.run(run, check=False, capture_output=True, text=True, env=environment)
        said = outcome.stdout + outcome.stderr
        assert "is valid according to" in said, said
        assert "WARNING" not in said, said


def test_scippnexus_loads_every_group_as_it_is_meant(written):
    import scippnexus

    def load(group):
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            group[()]
        for child in group.values():
            if isinstance(child, scippnexus.Group):
                load(child)

    for path in written.values():
        with scippnexus.File(path) as file:
            load(file)
            assert file["entry"].attrs["NX_class"] == "NXentry"
