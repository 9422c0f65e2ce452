"""The shipped data are what their README says: synthetic, in order, and made by its commands."""

import contextlib
import hashlib
import importlib.util
import math
import re
import shlex
from dataclasses import asdict, replace

import numpy as np
import pytest
from helpers.bounds import assert_as_stated, cramer_rao
from helpers.folders import SHIPPED
from helpers.scans import EXACT_FILM
from numpy.testing import assert_allclose

import memscal
from memscal.cli import main
from memscal.formats.inspection import check
from memscal.formats.tables.reference import read_reference_table
from memscal.mechanics.press_rod import press_rod

README = (SHIPPED / "README.md").read_text(encoding="utf-8")
SCANS = [f"rod_scan_{name}.h5" for name in ("33", "65", "three_loads", "raster", "light")]
EXPERIMENT = [
    f"sphere_experiment/{name}.h5" for name in ("rod_scan", "sphere_dry", "sphere_lubricated")
]
OWN = [f"tables/{name}.csv" for name in ("rod", "sphere_dry", "sphere_lubricated")]
TABLES = ["rod_scan_messy.csv", "rod_reference_fem.csv", *OWN]
ARTIFACT = "rod_scan_65.apparatus.h5"
SETTINGS = {
    SCANS[2]: {"load": (0.1, 0.3, 1.0)},
    SCANS[3]: {"raster": True},
    SCANS[4]: {"load": 0.05},
}


def commands(block):
    """Arguments of the memscal commands in the README's code blocks of one kind."""
    blocks = re.findall(rf"^```{block}\n(.*?)^```$", README, flags=re.MULTILINE | re.DOTALL)
    lines = [shlex.split(line) for line in "".join(blocks).splitlines()]
    return [arguments for program, *arguments in lines if program == "memscal"]


def run_all(argument_lists, folder):
    with contextlib.chdir(folder), pytest.MonkeyPatch.context() as patch:
        patch.setenv("SOURCE_DATE_EPOCH", "0")
        for arguments in argument_lists:
            assert main(arguments) == 0, f"memscal {shlex.join(arguments)}"


@pytest.fixture(scope="module")
def rebuilt(tmp_path_factory):
    """A folder in which the README's recipe was followed."""
    folder = tmp_path_factory.mktemp("rebuilt")
    run_all(commands("sh"), folder)
    return folder


@pytest.fixture(scope="module")
def imported(tmp_path_factory):
    """A folder in which the README's examples with the tables were followed."""
    folder = tmp_path_factory.mktemp("imported")
    (folder / "calibration_data").symlink_to(SHIPPED)
    run_all(commands("console"), folder)
    return folder


@pytest.fixture(scope="module")
def calibrations():
    rods = [*SCANS, EXPERIMENT[0]]
    return {name: memscal.calibrate(memscal.read_scan(SHIPPED / name)) for name in rods}


@pytest.fixture(scope="module")
def generator():
    spec = importlib.util.spec_from_file_location("make_tables", SHIPPED / "make_tables.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def numbers(table):
    rows = [line for line in table.read_text().splitlines() if not line.startswith("#")]
    return np.genfromtxt(rows, delimiter=",", skip_header=1)


def stated(item):
    """Values of a film or an indenter, without those that are not stated."""
    return {name: value for name, value in asdict(item).items() if value is not None}


def test_the_folder_holds_what_its_readme_lists_and_is_small():
    listed = set(re.findall(r"^\| `([^`]+)`", README, flags=re.MULTILINE))
    paths = [path for path in SHIPPED.rglob("*") if path.suffix in {".h5", ".csv", ".toml"}]
    shipped = {path.relative_to(SHIPPED).as_posix() for path in paths}
    assert shipped == listed == {*SCANS, *EXPERIMENT, *TABLES, ARTIFACT, "lab.toml"}
    assert sum(path.stat().st_size for path in SHIPPED.rglob("*") if path.is_file()) < 1_180_000


@pytest.mark.parametrize("name", [*SCANS, *EXPERIMENT, ARTIFACT])
def test_every_hdf5_file_is_in_order(name):
    assert [finding for finding in check(SHIPPED / name) if not finding.passed] == []


def test_every_file_says_that_it_is_synthetic():
    for name in (*SCANS, *EXPERIMENT):
        scan = memscal.read_scan(SHIPPED / name)
        assert scan.synthetic
        assert "synthetic" in scan.title.lower()
    for name in TABLES:
        assert (SHIPPED / name).read_text(encoding="utf-8").startswith("# SYNTHETIC")
    messages = memscal.load_apparatus(SHIPPED / ARTIFACT).process.messages
    assert any("synthetic" in message.text for message in messages)


@pytest.mark.parametrize("name", [*SCANS, EXPERIMENT[0]])
def test_a_calibration_finds_the_stored_truth_within_its_uncertainty(name, calibrations):
    calibration = calibrations[name]
    assert calibration.passed
    scan = memscal.read_scan(SHIPPED / name)
    truth = scan.synthetic
    assert truth["gaussian_sigma"] == 561e-6
    found = calibration.apparatus.parameters
    film = replace(EXACT_FILM, law=scan.film.law or "linear")
    setting = {"points": scan.x.size, "film": film} | SETTINGS.get(name, {})
    bounds = dict(cramer_rao(0.005, inexact=True, **setting))
    # A straight line's slope, in closed form: from even points, over the whole range.
    bounds["drift"] = truth["noise"] * np.sqrt(12 / scan.u_zz.size)
    if scan.normal_load is not None:
        # Each load has a centre, a baseline and a drift of its own.
        bounds = {name: bounds[name] for name in ("conversion_constant", "gaussian_sigma")}
    assert_as_stated(found, truth, bounds)
    assert found["gaussian_sigma_deconvolved"] == pytest.approx(truth["gaussian_sigma"], rel=0.1)


@pytest.mark.parametrize("name", [*SCANS, *EXPERIMENT])
def test_the_readmes_commands_make_the_shipped_scans(name, rebuilt):
    shipped = memscal.read_scan(SHIPPED / name)
    made = memscal.read_scan(rebuilt / name)
    for field in ("x", "y", "x_errors", "u_zz", "u_zz_errors", "normal_load", "normal_load_errors"):
        expected = getattr(shipped, field)
        found = getattr(made, field)
        assert (expected is None) == (found is None), field
        if expected is not None:
            assert_allclose(found, expected, rtol=0, atol=1e-9 * np.abs(expected).max())
    same = ("load", "load_uncertainty", "lubrication", "lubricant", "sensor", "title", "notes")
    for field in same:
        assert getattr(made, field) == getattr(shipped, field), field
    for field in ("film", "indenter"):
        assert stated(getattr(made, field)) == pytest.approx(stated(getattr(shipped, field)))
    assert made.synthetic.keys() == shipped.synthetic.keys()
    for name, value in shipped.synthetic.items():
        expected = value if isinstance(value, str) else pytest.approx(value, rel=1e-9)
        assert made.synthetic[name] == expected, name


def test_the_shipped_artifact_is_what_calibrate_makes_now(rebuilt):
    shipped, made = (memscal.load_apparatus(folder / ARTIFACT) for folder in (SHIPPED, rebuilt))
    assert made.conversion_constant == pytest.approx(shipped.conversion_constant, rel=1e-9)
    assert made.gaussian_sigma == pytest.approx(shipped.gaussian_sigma, rel=1e-9)
    assert made.parameters.names == shipped.parameters.names
    source = shipped.process.input_scan
    assert source.sha256 == hashlib.sha256((SHIPPED / source.file_name).read_bytes()).hexdigest()
    assert [c.name for c in made.checks] == [c.name for c in shipped.checks]
    assert_allclose(made.radial_profile.g, shipped.radial_profile.g, atol=1e-6 * made.field.g.max())
    assert_allclose(
        made.radial_profile.g_errors,
        shipped.radial_profile.g_errors,
        rtol=1e-4,
        atol=1e-6 * made.field.g.max(),
    )


def test_the_tables_are_what_their_generator_makes(generator, tmp_path):
    generator.messy_scan(tmp_path / "rod_scan_messy.csv")
    generator.own_experiment(tmp_path / "tables")
    for name in ("rod_scan_messy.csv", *OWN):
        # A last digit may be rounded the other way by another version of a library.
        assert_allclose(numbers(tmp_path / name), numbers(SHIPPED / name), rtol=0, atol=1.1e-5)


@pytest.mark.accuracy
def test_the_table_of_finite_elements_is_what_its_generator_makes(generator, tmp_path):
    made = tmp_path / "rod_reference_fem.csv"
    generator.finite_element_reference(made)
    assert_allclose(numbers(made), numbers(SHIPPED / made.name), rtol=0, atol=1e-7)


def test_the_table_of_dry_contacts_becomes_a_scan_with_a_line_for_each_load_and_pass(imported):
    scan = memscal.read_scan(imported / "dry.h5")
    # One reading is empty, and one row is missing.
    assert (scan.kind, scan.u_zz.size, scan.lubrication) == ("points", 6 * 33 - 1, "dry")
    assert np.isnan(scan.u_zz).sum() == 1
    for i, load in enumerate([0.4, 0.4, 0.8, 0.8, 1.6, 1.6]):
        assert_allclose(scan.only_passes(i).normal_load, load)


def test_the_messy_table_is_messy_and_still_gives_its_truth(imported):
    scan = memscal.read_scan(imported / "messy.h5")
    # Three rows were never taken, and four readings are empty.
    assert (scan.kind, scan.u_zz.size) == ("points", 3 * 33 - 3)
    assert np.isnan(scan.u_zz).sum() == 4
    apparatus = memscal.load_apparatus(imported / "messy.apparatus.h5")
    assert [m.kind for m in apparatus.process.messages].count("outlier") == 1
    truth = {"conversion_constant": 1e-7, "gaussian_sigma": 561e-6, "centre": -0.23e-3}
    bounds = cramer_rao(0.005, inexact=True, points=33, repeats=3, centre=(truth["centre"], 0.0))
    assert_as_stated(apparatus.parameters, truth, {name: bounds[name] for name in truth})


def test_the_finite_element_table_moves_the_result_by_less_than_its_error_allows(
    imported, calibrations
):
    """Bound the shift of A and sigma by what the table changes in the predicted voltages.

    To first order the fit changes as if the scan had changed by that, e_i: by Cauchy and Schwarz by
    at most the uncertainty from noise s_i times the root of sum e_i^2 / s_i^2.  As G has unit
    integral, e_i is at most A times the largest error of the table, 2e-3 of the maximum.
    """
    ours = calibrations["rod_scan_65.h5"].apparatus
    theirs = memscal.load_apparatus(imported / "fem.apparatus.h5")
    table = memscal.read_reference(imported / "fem.h5")
    contact = press_rod(ours.film, ours.indenter, 1.0, math.inf)
    scan = memscal.read_scan(SHIPPED / "rod_scan_65.h5")
    largest = np.max(np.abs(table.sigma_zz - contact.base_stress(table.r)))
    assert largest < 2e-3 * contact.base_stress(0.0)
    shear = contact.base_shear(table.r)  # the table's S13 is for the third axis upward
    units = {"r": "r (mm)", "r_unit": "mm", "sigma": "S33 (MPa)", "sigma_unit": "MPa"}
    signs = {"shear": "S13 (MPa)", "sign": -1, "shear_sign": -1}
    sheared = read_reference_table(SHIPPED / TABLES[1], load=1.0, **units, **signs).profile
    assert_allclose(sheared.sigma_rz, shear, atol=4e-3 * np.abs(shear).max())
    assert table.force == pytest.approx(1.0, abs=1e-4)

    def voltage(stress):
        distance = np.abs(scan.x - ours.parameters["centre"])
        return np.interp(distance, table.r, ours.predict(table.r, stress))

    moved = voltage(table.sigma_zz) - voltage(contact.base_stress(table.r))
    # The deconvolved G dips below zero a little, so that the bound by its integral is not sharp.
    assert np.max(np.abs(moved)) < 1.2 * ours.conversion_constant * largest
    root_chi_square = float(np.linalg.norm(moved / scan.u_zz_errors))
    assert root_chi_square < 0.5
    for name in ("conversion_constant", "gaussian_sigma"):
        noise = ours.budget[name]["noise"]
        shift = abs(theirs.parameters[name] - ours.parameters[name])
        assert shift < 1.1 * root_chi_square * noise, name
