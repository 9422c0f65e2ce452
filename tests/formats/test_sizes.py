"""Large tables and scans: read in blocks with the same result, or refused before any work."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
from helpers import scans as made
from helpers.builders import make_film
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import memscal
from memscal import import_table
from memscal.calibration import calibrate as calibration
from memscal.calibration import prepare
from memscal.errors import InputError
from memscal.estimation import points
from memscal.formats.hdf5.reader import SafeFile
from memscal.formats.tables import columns, text_table
from memscal.formats.tables.columns import Wanted
from memscal.formats.tables.text_table import TextTable
from memscal.friction import compare as compare_module
from memscal.model.scan import BRANCHES
from memscal.readings import find_places as places_module
from memscal.readings.find_places import places_of

COLUMNS = {"x": Wanted("x", "mm", "length"), "u": Wanted("u"), "n": Wanted("n", words=BRANCHES)}


def content(path, names, decimal, delimiter):
    """Columns and notes of a table, or the words of its error."""
    try:
        table = TextTable(path, decimal=decimal, delimiter=delimiter)
        columns = table.columns({name: COLUMNS[name] for name in names})
        return {name: values.tolist() for name, values in columns.items()}, table.notes
    except InputError as error:
        return str(error)


CELLS = st.one_of(
    st.floats(-1e6, 1e6).map(repr),
    st.integers(-99, 99).map(str),
    st.sampled_from(["", "nan", "-", "1D-3", "2e5", " 7", "7 ", "+.5", "3.", "inf", "1_0", "é"]),
    st.sampled_from(['"5"', '"a"', "approach", "word", "#", "1 2", "0x1", "1,5", "1.5.5"]),
)
PLAIN = st.integers(-9999, 9999).map(lambda number: f"{number / 64}")
ROWS = st.one_of(
    *(st.lists(cells, min_size=3, max_size=3) for cells in (PLAIN, PLAIN, PLAIN, CELLS)),
    st.lists(PLAIN, min_size=2, max_size=5),
    st.sampled_from([[], ["# 1", "2", "3"], [" ", "", ""], ["% 1"]]),
)


@settings(max_examples=100)
@given(
    table=st.lists(ROWS, max_size=30),
    delimiter=st.sampled_from(";,\t| "),
    decimal=st.sampled_from(".,"),
    end=st.sampled_from(["\n", "\r\n", "\r"]),
    encoding=st.sampled_from(["utf-8", "latin-1"]),
    names=st.sampled_from(["xun", "u"]),
)
def test_blocks_give_what_the_whole_table_gives(
    tmp_path_factory, table, delimiter, decimal, end, encoding, names
):
    """In small blocks, of which those of bare numbers take another way, and in one."""
    regular = [["0.5", "1", "2"]] * 40
    lines = [delimiter.join(row).replace(".", decimal) for row in regular + table + regular * 3]
    text = end.join([delimiter.join("xun"), *lines])
    path = tmp_path_factory.mktemp("t") / "table.csv"
    path.write_bytes(text.encode(encoding, "replace"))
    whole = content(path, names, decimal, delimiter)
    for block in (64, 256):
        with pytest.MonkeyPatch.context() as patch:
            for name, value in (("_SAMPLE", 3), ("_BLOCK", block)):
                patch.setattr(text_table, name, value)
            found = content(path, names, decimal, delimiter)
        if isinstance(whole, str):
            # Of several wrong cells that of the first block is named.
            assert found == whole or "data row" in found
        else:
            np.testing.assert_equal(found, whole)


def big_table(path, rows):
    x = np.linspace(-8.0, 8.0, rows)
    lines = [f"{place:.6f},{np.exp(-place * place):.6f}" for place in x.tolist()]
    path.write_text("\n".join(["x/mm,u/mV", *lines]))
    return path


def test_a_column_that_no_row_has_is_missing_throughout(tmp_path):
    path = tmp_path / "t.txt"
    path.write_text("x,u,n,m\n" + "1,2,3\n" * 20_000)
    found = TextTable(path, delimiter=",").columns({"u": Wanted("u"), "m": Wanted("m")})
    assert (found["u"].sum(), found["m"].size) == (40_000, 20_000)
    assert np.isnan(found["m"]).all()


IMPORT = """
import resource, sys
from memscal.formats.scan import write_scan
from memscal.formats.tables.scan import import_table
found = import_table(sys.argv[1], x="x", u="u")
write_scan(found, sys.argv[1] + ".h5")
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""


def test_a_million_rows_take_little_memory(tmp_path):
    """Ten arrays of 2.4 million bytes: text and cells are never held as a whole."""
    pytest.importorskip("resource")

    def kilobytes(rows):
        table = big_table(tmp_path / f"{rows}.csv", rows)
        command = [sys.executable, "-c", IMPORT, str(table)]
        peak = subprocess.run(command, capture_output=True, text=True, check=True).stdout
        return int(peak) // (1024 if sys.platform == "darwin" else 1)

    assert kilobytes(300_000) - kilobytes(100) < 40_000


@pytest.mark.parametrize("pairs", [0, 20_000_000], ids=["rounded", "by pairs"])
def test_places_along_a_line_are_those_along_the_same_line_in_the_plane(monkeypatch, pairs):
    monkeypatch.setattr(places_module, "_MOST_PAIRS", pairs)
    rng = np.random.default_rng(0)
    passes = np.repeat(np.arange(30), 40)
    along = np.tile(np.arange(40) * 1e-4, 30) + rng.normal(0, 1e-6, passes.size)
    shuffled = rng.permutation(passes.size)
    along = along[shuffled]
    passes = passes[shuffled]
    line = places_of(along, np.zeros_like(along), passes)
    plane = places_of(0.6 * along, 0.8 * along, passes)
    assert line.count == 40
    np.testing.assert_array_equal(line.index, plane.index)


@pytest.mark.parametrize(
    ("line", "words"),
    [
        (";,\t|" * 9_000, "9,001 columns"),
        ("# a comment", "holds no table"),
    ],
    ids=["endless lines", "comments"],
)
def test_a_head_is_looked_at_no_further_than_a_block(tmp_path, monkeypatch, line, words):
    """Of 20 MB of endless lines 419 MB were held: all of them were cut into cells at once."""
    path = tmp_path / "t.csv"
    path.write_text(f"{line}\n" * (2_000_000 // len(line)))
    lines = TextTable._numbered
    monkeypatch.setattr(text_table, "_LONGEST", 2**18)

    def watched(table, block):
        assert len(block) <= 2 * text_table._LONGEST
        return lines(table, block)

    monkeypatch.setattr(TextTable, "_numbered", watched)
    with pytest.raises(InputError, match=words):
        TextTable(path)


def test_what_is_too_large_is_refused_with_size_limit_and_cure(tmp_path, monkeypatch):
    monkeypatch.setattr(columns, "MOST_ROWS", 100)
    with pytest.raises(InputError, match=r"has 120 lines of 2 columns, but at most 100(.|\n)*Aver"):
        import_table(big_table(tmp_path / "t.csv", 120), x="x", u="u")
    Image.new("L", (2049, 9)).save(tmp_path / "field.png")
    with pytest.raises(InputError, match=r"2,049 pixels along a side, but at most 2,048"):
        memscal.read_reference(tmp_path / "field.png", pixel_size=1e-6)
    correlation = np.broadcast_to(0.0, (4001, 4001))
    with pytest.raises(InputError, match=r"4,001 points, but at most 4,000(.|\n)*average"):
        replace(memscal.simulate(points=4001), u_zz_correlation=correlation)


def test_a_contact_of_too_many_points_does_nothing():
    apparatus = memscal.calibrate(memscal.simulate(), method="bayesian").apparatus
    scan = memscal.simulate(points=2001)
    band = np.outer(np.ones(2001), [1.0, 0.2])
    band[-1, 1] = 0
    correlated = replace(scan, u_zz_correlation=band)
    large = memscal.simulate(points=100_001)
    for measured, wrong in (
        (memscal.measure_stress, large),
        (memscal.restore, large),
        (memscal.measure_stress, correlated),
    ):
        with pytest.raises(InputError, match=rf"{wrong.x.size:,} points of one load(.|\n)*Average"):
            measured(wrong, apparatus)
    assert memscal.restore(correlated, apparatus).points.u.size == 2001


def went_on(*_, **__):
    pytest.fail("it went on")


def test_a_comparison_of_too_many_points_does_nothing(monkeypatch):
    apparatus = made.known_apparatus()
    ones = np.ones(len(made.LOADS))
    none = dict.fromkeys(("u_zz_errors", "x_errors", "normal_load_errors"))
    plain = replace(made.contact_scan(), **none)
    monkeypatch.setattr(compare_module, "measure_stress", went_on)

    def refused(count, words, **options):
        x = np.linspace(-5e-3, 5e-3, count)
        u = np.outer(ones, np.exp(-(x**2) / 1e-6))
        load = np.outer(made.LOADS, np.ones(count))
        correlation = np.eye(count) if options.pop("correlated", False) else None
        scan = replace(plain, x=x, u_zz=u, normal_load=load, u_zz_correlation=correlation)
        with pytest.raises(InputError, match=rf"{words}(.|\n)*Average"):
            memscal.compare(scan, apparatus, **options)

    refused(25_000 // ones.size + 1, "What is compared has 25,00. readings, but at most 25,000")
    refused(501, "0.34 N, dry has 501 readings that share noise", correlated=True)
    sheared = replace(apparatus, sensor=replace(apparatus.sensor, channel="xz"))
    refused(251, "0.34 N, dry has 502 readings that share noise", shear=sheared)


def test_a_file_of_too_many_points_is_refused_before_its_arrays_are_read(tmp_path, monkeypatch):
    memscal.write_scan(memscal.simulate(points=65), tmp_path / "scan.h5")
    monkeypatch.setattr(calibration, "MOST_OF_LINES", 64)
    monkeypatch.setattr(SafeFile, "array", went_on)
    with pytest.raises(InputError, match=r"scan.h5 has 65 points, but at most 64(.|\n)*Average"):
        memscal.calibrate(tmp_path / "scan.h5")


@pytest.mark.parametrize(
    ("limit", "words"),
    [
        ("MOST_OF_LINES", "130 points on lines, but at most 129"),
        ("MOST_OF_RASTER", "1,089 points in a plane, but at most 129"),
    ],
)
def test_a_calibration_of_too_many_points_does_nothing(monkeypatch, limit, words):
    scans = [memscal.simulate(points=65, seed=seed) for seed in (1, 2)]
    if limit == "MOST_OF_RASTER":
        axis = np.linspace(-4e-3, 4e-3, 33)
        film = make_film()
        rod = memscal.Rod(radius=0.25e-3)
        u = np.exp(-np.add.outer(axis**2, axis**2) / 1e-6)
        scans = memscal.Scan(x=axis, y=axis, u_zz=u, load=1.0, film=film, indenter=rod)
    monkeypatch.setattr(points, limit, 129)
    monkeypatch.setattr(prepare, "reference_profile", went_on)
    with pytest.raises(InputError, match=rf"{words}(.|\n)*Average neighbouring readings"):
        memscal.calibrate(scans)
