"""Batches: shards that prove their work, resumption, failures as rows, and their summary."""

import json
import shutil
import signal
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path

import numpy as np
import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq
import pytest
from helpers.scans import simulated
from scipy.stats import binom

import memscal
from memscal.cli import main
from memscal.extensions.fleet.results import FleetResults
from memscal.extensions.fleet.results_summary import outliers

COUNT = 10
SHARD = 2
FLAT = 2
DRIFTING = 3
NONSENSE = 5
MISSING = 6
LARGE = 9


@pytest.fixture(scope="module", autouse=True)
def _a_thread_calibrates():
    """Start no processes in this one: those of a batch belong to the batches that are killed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("memscal.parallel.worker_pool", ThreadPoolExecutor)
        yield


@pytest.fixture(scope="module")
def fleet(tmp_path_factory):
    """A folder of scans, of which some cannot be used, and a manifest with places on a wafer."""
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "scans").mkdir()
    lines = ["# a wafer", "path, wafer_x (mm), wafer_y (mm), operator"]
    for i in range(COUNT):
        options = {"drift": 0.3 if i == DRIFTING else 0.0}
        a = 1.5e-7 if i == LARGE else 1e-7
        scan = simulated(noise=0.004, points=33, seed=i, conversion_constant=a, **options)
        sensor = memscal.StressSensor(name=f"S{i}", serial_number=f"W7-{i:03}")
        scan = replace(scan, sensor=sensor, u_zz=scan.u_zz * (i != FLAT))
        lines.append(f"scans/s{i:02}.h5, {i % 4}, {i // 4}, me")
        if i != MISSING:
            memscal.write_scan(scan, folder / "scans" / f"s{i:02}.h5")
    (folder / "scans" / f"s{NONSENSE:02}.h5").write_text("nonsense")
    (folder / "wafer.csv").write_text("\n".join(lines))
    return folder


@pytest.fixture(scope="module")
def results(fleet):
    """The results of an uninterrupted batch."""
    assert main(arguments(fleet / "wafer.csv", fleet / "results")) == 1
    return fleet / "results"


@pytest.fixture
def copy(results, fleet, folder):
    """A folder with the scans, their manifest and results, to be spoilt."""
    shutil.copytree(fleet, folder / "fleet")
    return folder / "fleet"


def arguments(source, results, *further):
    sizes = ["--shard-size", str(SHARD), "--workers", "1", *further]
    return ["batch", str(source), "-o", str(results), *sizes]


def shards_of(outcome):
    """How many shards were written, and how many kept."""
    return outcome.json["shards_written"], outcome.json["shards_kept"]


def batch(*given):
    """Start a batch as a process of its own."""
    return subprocess.Popen([sys.executable, "-m", "memscal", *arguments(*given)])


def tables(results):
    return pd.read_parquet(results / "shards").drop(columns="calibrated_at")


def test_a_row_says_what_a_calibration_says(results, fleet):
    rows = tables(results)
    assert list(rows["place"]) == list(range(COUNT))
    path = fleet / "scans" / "s01.h5"
    row = rows.iloc[1]
    alone = memscal.calibrate(path).apparatus
    assert row["path"] == "../scans/s01.h5"
    assert (row["sensor"], row["serial_number"]) == ("S1", "W7-001")
    assert row["input_sha256"] == alone.process.input_scan.sha256
    assert (row["wafer_x"], row["wafer_y"], row["passed"]) == (1, 0, alone.passed)
    u = alone.parameters.uncertainty
    expected = {
        "conversion_constant": alone.conversion_constant * 1e3,
        "conversion_constant_errors": u("conversion_constant") * 1e3,
        "gaussian_sigma": alone.gaussian_sigma * 1e3,
        "fwhm_errors": u("fwhm") * 1e3,
        "noise_equivalent_area": alone.parameters["noise_equivalent_area"] * 1e6,
        "resolved_wavenumber": alone.resolved_wavenumber * 1e-3,
    }
    assert dict(row[list(expected)]) == pytest.approx(expected, rel=1e-9)
    np.testing.assert_allclose(row["g"], alone.radial_profile.g * 1e-6, rtol=1e-6, atol=1e-9)
    np.testing.assert_allclose(row["r"], alone.radial_profile.r * 1e3, rtol=1e-6)
    names = list(row["correlated"])
    covariance = alone.parameters.only(row["correlated"]).covariance
    pairs = list(zip(*np.triu_indices(len(names), 1), strict=True))
    with_sigma = pairs.index((0, names.index("gaussian_sigma")))
    expected_r = covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])
    assert row["correlation"][with_sigma] == pytest.approx(expected_r, rel=1e-5)
    of_a = {b["source"]: b["errors"] for b in row["budget"] if b["quantity"] == names[0]}
    assert of_a["noise"] == pytest.approx(alone.budget[names[0]]["noise"] * 1e3, rel=1e-6)
    for stored, check in zip(row["checks"], alone.checks, strict=True):
        assert (stored["name"], stored["passed"]) == (check.name, check.passed)
        assert stored["value"] == pytest.approx(check.value, rel=1e-6)


def test_units_and_versions_stand_in_the_schema(results):
    schema = pq.read_schema(results / "shards" / "shard-000000.parquet")
    units = {f.name: (f.metadata or {}).get(b"units", b"").decode() for f in schema}
    assert (units["conversion_constant"], units["gaussian_sigma_errors"]) == ("mV/Pa", "mm")
    assert (units["g"], units["wafer_x"], units["baseline"]) == ("1/mm^2", "mm or die", "mV")
    assert schema.metadata[b"memscal_schema"] == b"memscal-fleet"
    assert len(list((results / "shards").iterdir())) == COUNT / SHARD


def test_what_fails_is_a_row_and_failed_checks_have_an_artifact(results):
    rows = tables(results)
    errors = rows[rows["error"].notna()]
    assert list(errors["place"]) == [FLAT, NONSENSE, MISSING]
    assert list(errors["error_class"]) == ["InputError", "FormatError", "InputError"]
    assert "Every voltage of the scan" in errors["error"][FLAT]
    assert errors["sensor"][FLAT] == f"S{FLAT}"
    kept = rows[rows["artifact"].notna()]
    assert not kept["passed"].any()
    assert set(kept["place"]) == set(rows["place"][~rows["passed"]]) - set(errors["place"])
    apparatus = memscal.load_apparatus(results / kept["artifact"][DRIFTING])
    assert apparatus.plane is None
    assert apparatus.conversion_constant * 1e3 == pytest.approx(
        kept["conversion_constant"][DRIFTING], rel=1e-9
    )


def test_a_batch_that_is_killed_loses_what_is_under_way_and_resumes(fleet, results, run, folder):
    halfway = folder / "results"
    process = batch(fleet / "wafer.csv", halfway)
    while not (done := list(halfway.glob("shards/*.parquet"))):
        assert process.poll() is None
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    assert len(done) < COUNT / SHARD
    resumed = run(*arguments(fleet / "wafer.csv", halfway, "--resume", "--json"))
    assert shards_of(resumed.exits(1))[1] >= 1
    with_paths = tables(halfway).assign(path=tables(results)["path"])
    pd.testing.assert_frame_equal(with_paths, tables(results), rtol=1e-9)


def test_a_shard_is_done_anew_unless_it_opens_and_its_digest_agrees(copy, run, monkeypatch):
    monkeypatch.setattr("memscal.cli.output._IN_LINES", (0.001, 0.02))
    shards = sorted((copy / "results" / "shards").iterdir())
    line = arguments(copy / "wafer.csv", copy / "results", "--resume", "--json")
    assert shards_of(run(*line)) == (0, 5)
    shards[0].write_bytes(shards[0].read_bytes()[:-1000])
    flipped = bytearray(shards[1].read_bytes())
    flipped[100] ^= 1
    shards[1].write_bytes(flipped)
    changed = replace(memscal.read_scan(copy / "scans" / "s07.h5"), load_uncertainty=0.5)
    memscal.write_scan(changed, copy / "scans" / "s07.h5", overwrite=True)
    assert shards_of(run(*line)) == (3, 2)
    rows = tables(copy / "results")
    assert list(rows["place"]) == list(range(COUNT))
    assert rows["conversion_constant_errors"][7] > 5 * rows["conversion_constant_errors"][8]
    before = {path: path.read_bytes() for path in copy.rglob("*.*")}
    other = [*line, "--method", "bayesian"]
    run(*other).exits(3, "method: white-noise, now bayesian")
    assert {path: path.read_bytes() for path in copy.rglob("*.*")} == before
    rate = (" of 10 scans, ", " s left, ", " a second", "1 of FormatError, as ../scans/s05.h5: ")
    anew = run(*other, "--force").exits(1, *rate)
    assert shards_of(anew) == (5, 0)


def test_results_are_not_replaced_and_wrong_batches_are_refused(copy, run):
    manifest = copy / "wafer.csv"
    old = copy / "results"
    run(*arguments(manifest, old)).exits(4, "results exists", "--resume")
    other = arguments(manifest, old, "--resume")
    other[other.index(str(SHARD))] = "4"
    run(*other).exits(3, "results of other scans", "--shard-size")
    before = {path: path.read_bytes() for path in old.rglob("*.*")}
    text = manifest.read_text(encoding="utf-8")
    manifest.write_text(text.replace("s03", "s0x").replace("s05", "s03"), encoding="utf-8")
    run(*arguments(manifest, old, "--resume")).exits(3, "results of other scans", "s03.h5")
    assert {path: path.read_bytes() for path in old.rglob("*.*")} == before
    (copy / "empty").mkdir()
    run(*arguments(copy / "empty", copy / "new")).exits(3, "holds no scans")
    assert not (copy / "new").exists()


def test_a_folder_is_listed_by_name_and_a_list_may_have_commas(fleet, folder):
    from memscal.extensions.fleet.shards import manifest_scans

    for name in ("b/1.h5", "b/1.apparatus.h5", "b/notes.txt", "a.h5", "c,d.nxs"):
        (folder / name).parent.mkdir(exist_ok=True)
        (folder / name).touch()
    assert [scan.path for scan in manifest_scans([folder])] == ["a.h5", "c,d.nxs", "b/1.h5"]
    (folder / "list.txt").write_text("\ufeff# scans\nc,d.nxs\n\n'a.h5'\n", encoding="utf-8")
    listed = [scan.path for scan in manifest_scans([folder / "list.txt"])]
    assert listed == ["c,d.nxs", "'a.h5'"]


@pytest.mark.parametrize(
    ("module", "line"),
    [
        ("pyarrow", "batch {scans} -o new"),
        ("pyarrow", "summary {results}"),
        ("distributed", "batch {scans} -o new --scheduler tcp://127.0.0.1:9"),
    ],
)
def test_a_missing_extra_is_named(module, line, monkeypatch, fleet, results, folder, run):
    monkeypatch.setitem(sys.modules, module, None)
    words = line.format(scans=fleet / "scans", results=results).split()
    run(*words).exits(3, "is not installed", 'pip install ".[fleet]"')


def test_a_scheduler_that_does_not_answer_is_an_error(monkeypatch, fleet, folder, run):
    monkeypatch.setattr("memscal.parallel._CONNECTING", 0.5)
    line = ["batch", fleet / "scans", "-o", "results", "--scheduler"]
    run(*line, "tcp://127.0.0.1:9").exits(3, "No scheduler answers at tcp://127.0.0.1:9")


def test_ctrl_c_ends_a_batch_at_once(fleet, folder):
    process = batch(fleet / "wafer.csv", "results")
    while not Path("results", "shards").exists():
        time.sleep(0.01)
    process.send_signal(signal.SIGINT)
    assert process.wait(timeout=300) == 130


def test_the_report_of_a_batch_is_its_summary(copy, folder, run):
    line = arguments(copy / "wafer.csv", copy / "results", "--resume", "--report")
    page = copy / "results" / "page.html"
    run(*line, str(page)).exits(1, "Written")
    run("summary", copy / "results", "-o", "page.html").exits(0)
    assert page.read_text(encoding="utf-8") == (folder / "page.html").read_text(encoding="utf-8")
    run(*line, str(page)).exits(4, "exists already")


def test_a_summary_as_json_is_that_of_the_tables(results, folder, run):
    told = run("summary", results, "-o", "page.html", "--json").exits(0).json
    rows = tables(results)
    a = rows["conversion_constant"]
    assert told["conversion_constant"]["median"] == pytest.approx(a.median())
    spread = 1.4826 * (a - a.median()).abs().median()
    assert told["conversion_constant"]["robust_deviation"] == pytest.approx(spread)
    assert (told["sensors"], told["errors"]) == (COUNT, 3)
    assert told["error_classes"] == {"InputError": 2, "FormatError": 1}
    failed = [c["name"] for checks in rows["checks"].dropna() for c in checks if not c["passed"]]
    assert told["checks"] == {name: failed.count(name) for name in failed}
    (reason,) = [o["reason"] for o in told["outliers"] if o["path"] == f"../scans/s{LARGE:02}.h5"]
    z = (a[LARGE] - a.median()) / spread
    assert reason.startswith(f"A {z:.1f} deviations above the median")
    provenance = told["provenance"]
    assert provenance["method"] == ["white-noise"]
    assert provenance["calibrated"] == sorted(provenance["calibrated"])
    page = (folder / "page.html").read_text(encoding="utf-8")
    assert provenance["inputs_sha256"] in page
    assert "white-noise" in page
    assert {"problem", "cure"} <= told["error_groups"][0].keys()
    assert json.dumps(told)


def test_a_summary_of_several_units_is_refused(copy, run):
    path = copy / "results" / "shards" / "shard-000001.parquet"
    table = pq.read_table(path)
    place = table.schema.get_field_index("unit")
    units = pa.array(["nA/Pa"] * len(table))
    pq.write_table(table.set_column(place, table.schema.field(place), units), path)
    run("summary", copy / "results").exits(3, "are in mV/Pa and nA/Pa")
    path.write_bytes(b"PAR1")
    run("summary", copy / "results").exits(3, "is damaged", "--resume")


def fleet_of(a, sigma, error):
    """Return results of sensors without places, of these A and widths."""
    errors = error * np.ones(a.size)
    blank = np.full(a.size, np.nan)
    return FleetResults(
        paths=["scan.h5"] * a.size,
        sensors=["S"] * a.size,
        conversion_constant=a,
        conversion_constant_errors=errors,
        gaussian_sigma=sigma,
        gaussian_sigma_errors=errors,
        wafer_x=blank,
        wafer_y=blank,
        failed={},
        errors={},
        unit="mV/Pa",
    )


@pytest.mark.parametrize("count", [4, 8, 20, 100])
def test_sensors_that_scatter_by_chance_are_no_outliers(count):
    rng = np.random.default_rng(count)
    batches = 400
    drawn = [rng.normal(1.0, 0.02, (2, count)) for _ in range(batches)]
    alarms = sum(bool(outliers(fleet_of(*values, 0.02))) for values in drawn)
    assert alarms <= binom.ppf(1 - 1e-3, batches, 0.02)
    a, sigma = drawn[-1]
    assert outliers(fleet_of(np.append(a[1:], 9.0), sigma, 0.02))


def test_a_summary_says_what_is_missing_mixed_repeated_and_overridden(copy, run, folder):
    shard = copy / "results" / "shards" / "shard-000000.parquet"
    table = pq.read_table(shard)
    rows = table.to_pylist()
    override = {"kind": "override", "text": "Overridden: rod radius 0.25 mm."}
    rows[0] |= {"messages": [override], "options_sha256": "0" * 64}
    pq.write_table(pa.Table.from_pylist(rows, table.schema), shard)
    again = copy / "results" / "shards" / "shard-000002.parquet"
    shutil.copy(copy / "results" / "shards" / "shard-000001.parquet", again)
    (copy / "results" / "shards" / "shard-000004.parquet").unlink()
    outcome = run("summary", copy / "results", "--json")
    outcome.exits(0, "8 of 10 scans are done", "2 different options", "content of another one")
    assert "Overridden: rod radius 0.25 mm." in outcome.err
    assert len(json.loads(outcome.out)["warnings"]) == 4
    assert "8 of 10 scans are done" in (copy / "results" / "summary.html").read_text()


def test_artifacts_are_those_of_the_rows(copy, run):
    results = copy / "results"
    source = copy / "wafer.csv"
    written = sorted((results / "artifacts").rglob("*.h5"))
    assert written
    written[0].unlink()
    stale = results / "artifacts" / written[0].parent.name / "0000099-gone.apparatus.h5"
    stale.write_text("of another scan")
    run(*arguments(source, results, "--resume")).exits(1)
    assert sorted((results / "artifacts").rglob("*.h5")) == written


@pytest.mark.parametrize("text", ["[" * 9000, '{"scans": 10, "shard_size": 1e9}', "{}"])
def test_what_a_batch_states_of_itself_may_be_damaged(copy, run, text):
    (copy / "results" / "batch.json").write_text(text)
    run("summary", copy / "results").exits(0)
