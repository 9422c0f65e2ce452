"""Damaged inputs, drawn by hypothesis: each is read or refused, in little time and memory.

The whole campaign, of 100,000 inputs, is ``nox --session robustness``.
"""

import contextlib
import io
import resource
import time
import warnings
from pathlib import Path

import pytest
from helpers.builders import make_artifact, make_profile, make_scan
from helpers.console import names
from helpers.folders import DATA, SHIPPED
from helpers.scans import simulate
from hypothesis import HealthCheck, Phase, given, settings
from hypothesis import strategies as st
from robustness.campaign import SHARE, count, number
from robustness.damage import (
    BYTES,
    EDITS,
    TABLE,
    Edit,
    change_bytes,
    change_table,
    edit_hdf5,
)

import memscal
from memscal import write_reference, write_scan
from memscal.cli import main
from memscal.errors import UnitWarning
from memscal.formats.artifact import write_artifact

#: Documented exit codes: done, a check failed, usage, input refused, output not written.
CODES = {0, 1, 2, 3, 4}
SECONDS = 20.0
GIBIBYTE = 2**30


def drawn(reduced, whole):
    """Settings of a test that draws so many inputs."""
    return settings(
        max_examples=number(reduced, whole),
        deadline=None,
        database=None,
        derandomize=not SHARE,  # a run that looks for what is new is one of the campaign
        phases=(Phase.explicit, Phase.generate),  # to shrink a failure takes longer than to read it
        suppress_health_check=list(HealthCheck),
    )


@contextlib.contextmanager
def little_memory():
    """Bound what this process may take beyond what it holds."""
    soft, hard = resource.getrlimit(resource.RLIMIT_AS)
    held = int(Path("/proc/self/statm").read_text().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (held + GIBIBYTE, hard))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))


class Good(dict[str, bytes]):
    """The bytes of a good file of each kind, which a failing example does not print."""

    def __repr__(self):
        return "good"


@pytest.fixture(scope="module")
def good(tmp_path_factory):
    """The bytes of a good file of each kind."""
    folder = tmp_path_factory.mktemp("good")
    experiment = SHIPPED / "sphere_experiment"
    # Of a linear film a rod that is not in the table is solved in milliseconds.
    film = memscal.ElasticFilm(
        young_modulus=2.2e6, poisson_ratio=0.48, thickness=2e-3, law="linear"
    )
    scan = simulate(noise=0.005, seed=1, points=33, film=film)
    apparatus = memscal.calibrate(scan).apparatus
    contact = memscal.read_scan(experiment / "sphere_dry.h5")
    memscal.measure_stress(contact, apparatus, override=True).save(folder / "stress")
    write_scan(scan, folder / "scan")
    write_scan(make_scan("raster"), folder / "raster")
    write_scan(make_scan("points"), folder / "points")
    write_reference(make_profile(), folder / "reference")
    write_artifact(make_artifact(), folder / "artifact")
    apparatus.compact().save(folder / "compact")
    rows = zip(scan.x * 1e3, scan.u_zz * 1e3, strict=True)
    lines = ["x (mm),u_zz (mV)", *(f"{x:.4f},{u:.6f}" for x, u in rows)]
    (folder / "table").write_text("\n".join(lines))
    (folder / "mesh").write_bytes((DATA / "getfem_film.vtu").read_bytes())
    return Good({path.name: path.read_bytes() for path in folder.iterdir()})


def survives(folder, data, *commands, name="in.h5"):
    """Run commands on a damaged file, and look at what each leaves."""
    for path in folder.iterdir():
        path.unlink()
    (folder / name).write_bytes(data)
    for command in commands:
        said = io.StringIO()
        shown = io.StringIO()
        start = time.process_time()
        with warnings.catch_warnings(), contextlib.chdir(folder), little_memory():
            # What a user would see of numpy, scipy or h5py; of a wrong unit they are to see it.
            warnings.simplefilter("error")
            warnings.simplefilter("default", UnitWarning)
            with contextlib.redirect_stderr(said), contextlib.redirect_stdout(shown):
                code = main(command.split())
        words = said.getvalue() + shown.getvalue()
        count(f"inputs of `{command.split()[0]}`", f"exit {code}")
        assert code in CODES, f"{command}: exit {code}\n{words[-3000:]}"
        assert "Traceback" not in words, words[-3000:]
        assert "\x1b" not in words, words[-1000:]
        assert time.process_time() - start < SECONDS, f"{command} took too long"
        assert (folder / name).read_bytes() == data
        written = {*names(folder)} - {name}
        assert not written or code in (0, 1), f"{command} left {written}"
        for path in written:
            (folder / path).unlink()


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder for the damaged file and what is made of it."""
    return tmp_path_factory.mktemp("damaged")


LOOKED_AT = ("check in.h5", "inspect in.h5 --json")
USED = {
    **dict.fromkeys(("reference", "artifact", "compact", "stress"), LOOKED_AT),
    **dict.fromkeys(("raster", "points"), (*LOOKED_AT, "calibrate in.h5 --dry-run")),
    "scan": (*LOOKED_AT, "calibrate in.h5 -o out.h5"),
}


@drawn(8, 30_000)
@given(kind=st.sampled_from(sorted(USED)), changes=BYTES)
def test_damaged_bytes_are_read_or_refused(good, folder, kind, changes):
    survives(folder, change_bytes(good[kind], changes), *USED[kind])


_U = "/entry/data/u_zz"
_X = "/entry/data/x"
_LIMIT = "/entry/quality/reconvolution/limit"
_OPTIONS = "/entry/process/configuration/data"
#: Edits with which commands once crashed, hung, ran out of memory or printed what is no JSON.
CORPUS = (
    ("scan", Edit("scale", _U, 1e303)),
    ("scan", Edit("scale", _U, 1e-297)),
    ("scan", Edit("fill", _X, 1e308)),
    ("scan", Edit("units", _X, unit="furlong")),
    ("scan", Edit("units", _X, unit="m")),
    ("scan", Edit("scale", _X, 1e200)),
    ("scan", Edit("sparse", _U)),
    ("scan", Edit("sparse", _X, dtype="i1")),
    ("scan", Edit("fill", "/entry/sample/film/poisson_ratio", 5e-324)),
    ("raster", Edit("fill", "/entry/data/normal_load", float("nan"))),
    ("raster", Edit("scale", "/entry/sample/film/young_modulus", 1e-9)),
    ("artifact", Edit("text", _OPTIONS, text='{"A": NaN}')),
    ("artifact", Edit("text", _OPTIONS, text="[1e999]")),
    ("artifact", Edit("fill", _LIMIT, float("inf"))),
    ("artifact", Edit("replace", "/entry/parameters/centre_errors", shape=(0,))),
    ("compact", Edit("replace", "/entry/radial_profile/r", shape=(1, 7))),
    ("stress", Edit("text", "/entry/profiles", text='["a", "a"]')),
)


@pytest.mark.parametrize(("kind", "edit"), CORPUS)
@pytest.mark.parametrize("digest", [True, False] if SHARE else [True])
def test_inputs_that_once_failed_are_read_or_refused(good, folder, kind, edit, digest):
    survives(folder, edit_hdf5(good[kind], [edit], digest=digest), *USED[kind])


@drawn(8, 50_000)
@given(kind=st.sampled_from(sorted(USED)), edits=EDITS, digest=st.booleans())
def test_edited_values_are_read_or_refused(good, folder, kind, edits, digest):
    data = edit_hdf5(good[kind], edits, digest=digest)
    survives(folder, data, *USED[kind])


@drawn(12, 19_000)
@given(changes=st.one_of(TABLE, BYTES))
def test_damaged_tables_are_read_or_refused(good, folder, changes):
    change = change_table if type(changes[0]).__name__ == "CellChange" else change_bytes
    run = "import in.csv -o out.h5 --x x --u u_zz --load 1"
    survives(folder, change(good["table"], changes), run, name="in.csv")


@drawn(1, 1000)
@given(changes=st.one_of(BYTES, TABLE))
def test_damaged_meshes_are_read_or_refused(good, folder, changes):
    # Each is read by a process of its own.
    change = change_table if type(changes[0]).__name__ == "CellChange" else change_bytes
    reference = "--format reference --r-unit mm --sigma S --sigma-unit MPa --load 1"
    run = f"import in.vtu -o out.h5 {reference}"
    survives(folder, change(good["mesh"], changes), run, name="in.vtu")
