"""Tables that could be read in two ways, or hold more than readings: refused, or said."""

from contextlib import nullcontext
from pathlib import Path

import numpy as np
import pytest
from helpers.tables import imported

from memscal.errors import InputError, UnitWarning

TABLE = Path("t.csv")
N = 15
X = np.arange(N) - 7.0
U = np.round(0.02 + 1.5 * np.exp(-((X / 2) ** 2)), 4)
#: Cells by their names in the templates of rows.
CELLS = {
    "X": [f"{x:.2f}" for x in X],
    "U": [f"{u:.4f}" for u in U],
    "V": [f"{2 * u:.4f}" for u in U],
    "N": list(range(1, N + 1)),
    "WHOLE": list(range(-7, 8)),
    "COUNT": [f"{12_000 + 4 * i:,}" for i in range(N)],
    "LABEL": [*range(1, N - 1), "Mean", "Max"],
    "ABOVE": ["Mean", "SD", *range(1, N - 1)],
    "LARGE": [*U[:6], "-9.9E37", *U[7:]],
    "END": [*X[:-1], "inf"],
    "UNIT": ["uV"] * 9 + ["mV"] + ["uV"] * 5,
    "SIDE": ["N"] * 9 + ["S"] * 6,
    "T": ["21", "err"] + ["21"] * 13,
    "WARM": ["err"] + ["21.5"] * 14,
    "COMMA": ["21,5"] * N,
}
CELLS["GROUPED"] = [f"{500 * i:,}".replace(",", ".") for i in range(N)]
CELLS["POINT"] = [count.replace(",", ".") for count in CELLS["COUNT"]]
CELLS["LOW"] = [x.replace(".", "_") for x in CELLS["X"]]
CELLS["XC"], CELLS["UC"] = ([c.replace(".", ",") for c in CELLS[name]] for name in "XU")
BY_NUMBER = {"x": 1, "u": 2, "x_unit": "mm", "u_unit": "mV"}
AFTER_INDEX = {**BY_NUMBER, "x": 2, "u": 3}
NO_UNITS = {"x_unit": "mm", "u_unit": "mV"}


def scan_of(tables, **options):
    """Import tables, parted by &: a head, ~, and the template of a row."""
    text = ""
    for table in tables.split("&"):
        head, _, row = table.partition("~")
        rows = zip(*CELLS.values(), strict=True)
        lines = [row.format(**dict(zip(CELLS, cells, strict=True))) for cells in rows]
        text += "\n".join([head, *lines]) + "\n"
    TABLE.write_text(text, encoding="utf-8")
    return imported(TABLE, **{"x": "x", "u": "U", **options})


LVM = "Channels\t2\t\nX0\t0.0\t0.0\n***End_of_Header***\t\t\nt\tx (mm)\tU (mV)\tComment~"


@pytest.mark.parametrize(
    ("tables", "options", "words"),
    [
        ("x  mean U  V~{X} {U} {V}", NO_UNITS, "line 1 has 4 words, the rows 3 cells"),
        ("x / mm U / mV~{X} {U}", {}, "6 words"),
        ("x\tU\tV\tW~{X}\t{U}\t{V}", NO_UNITS, "4 names"),
        ("x U~{N} {X} {U}", NO_UNITS, "2 words"),
        ("x U~{N} {X} {U}", BY_NUMBER, "names of rows"),
        ("n x U\nmm mV~{N} {X} {U}", {}, "2 words"),
        ("# x (mm) U (mV)~{X} {U} {V} {V}", {}, "no column 'U'"),
        ("0,1~{X},{U}", BY_NUMBER, r"line 1 \(0, 1\) looks(.|\n)*rows 1, or --skip-rows 0"),
        ("1;2~{X};{U}", BY_NUMBER, "numbers of columns"),
        ("# rod\n,0,1~{N},{X},{U}", AFTER_INDEX, "line 2 .*numbers of columns"),
        ("no,0,1~{N},{X},{U}", AFTER_INDEX, "numbers of columns"),
        ("# 0 1~{X} {U}", BY_NUMBER, "columns are: 0, 1"),
        ("x (mm)\tU (1)~{WHOLE}\t{COUNT}", {}, r"thousands(.|\n)*--decimal ,"),
        ("x (mm)\tU (1)\tV~{WHOLE}\t{COUNT}\t{COUNT}", {}, "thousands"),
        ("x (mm);U (1)~{WHOLE};{POINT}", {}, r"thousands(.|\n)*--decimal \."),
        ("x (um);U (uV)~{GROUPED};{GROUPED}", {}, r"thousands(.|\n)*--decimal \."),
        ("x_mm;U in mV~{X};{U}", {"u_unit": "V"}, "states the unit 'mV'"),
        ("x (px);U (mV)~{X};{U}", {}, "no unit that is known"),
        ("x (mm),U (mV)~{LOW},{U}", {}, "'-7_00'"),
        ("x (mm),U (mV)~1D{N},{U}", {}, "'1D1'"),
        ("no,x (mm),U (mV)~{LABEL},{X},{U}", {}, r"15 \('Mean'\), 16 \('Max'\)"),
        ("no,x (mm),U (mV)~{X},{U},", {}, "3 names, but no row more than 2 cells"),
        ("no;x (mm);U (mV);T~{X};{U};{V};", {}, "4 names"),
        ("x (mm),U (mV)~{X},", {"delimiter": ","}, "No row of the table has a reading"),
        ("x (mm),U (mV)~{X},{LARGE}", {}, r"line 8 \('-9.9E37'\)(.|\n)*overload"),
        ("x (mm),U (mV),F~{X},{U},{LARGE}", {"load_column": "F"}, "overload"),
        ("x (mm),U (mV)~{END},{U}", {}, r"line 16 \('inf'\)"),
        ("x (mm),U,e~{X},{U},{UNIT}", {"u_unit": "uV"}, r"11 \('mV'\)(.|\n)*Units change"),
        ("x,U~{X} mm,{U}", NO_UNITS, r"line 2 \('-7.00 mm'\)(.|\n)*Units stand"),
        ("x,U~{X} mm,{U}mV", {}, "Units stand in its cells"),
        ("x,U~{X},{U}&x,U~{X},{U}&x,U~{X},{U}", NO_UNITS, "stands again in lines 17, 33"),
        ("# rod\n# x,U~{X},{U}&# rod\n# x,U~{X},{U}", NO_UNITS, "again in line 19"),
        ("# x (mm) U (mV)~{X} {U}&# x (mm) U (uV)~{X} {U}", {}, "again in line 17"),
        ("n,x,U~{ABOVE},{X},{U}", NO_UNITS, r"line 2 \('Mean'\), 3"),
        ("x (mm),U (mV),F~{X},{U},-1", {"load_column": "F"}, "not above zero"),
        ("# x,U,V~{X},{U},{V}&# U,x,V~{U},{X},{V}", NO_UNITS, "again in line 17"),
    ],
)
def test_what_two_readings_of_a_table_could_mean_is_asked(tables, options, words):
    with pytest.raises(InputError, match=words):
        scan_of(tables, **options)


@pytest.mark.parametrize(
    ("tables", "options"),
    [
        ("x (mm)  U (mV)  T [degC]~{X}  {U}  {V}", {}),
        ("# x (mm) U [mV]~{X} {U}", {}),
        ("x U\n(mm) (mV)~{X} {U}", {}),
        ("A title of five words~{X} {U}", BY_NUMBER),
        ("x U~{N} {X} {U}", {**AFTER_INDEX, "skip_rows": 1}),
        ("0,1~{X},{U}", {**BY_NUMBER, "skip_rows": 1}),
        ("x_mm;U, mV~{X};{U}", {}),
        ("x (mm);U (mV);T~{X};{U};21\n;;21.125", {}),
        ("x (mm)\tF\tU (mV)~{X}\t\t{U}", {}),
        ("F\tx (mm)\tU (mV)~\t{X}\t{U}", {}),
        ("n\tF\tx (mm)\tU (mV)~P {N}\t\t{X}\t{U}", {}),
        (LVM + "\t{X}\t{U}", {}),
        (LVM + "{N}\t{X}\t{U}", {}),
        ("x (mm)\tU (mV)\tF~{X}\t{U}\t", {"delimiter": "TAB"}),
        ("x (mm);U (mV);~{X};{U};", {}),
        ("x (mm),U (mV)~{X},{U},", {}),
        ("x\t U  V~{X}\t  {U}  {V}", NO_UNITS),
        ("x (mm),U (mV)~{X},{U}D+00", {}),
        ("~{XC} {UC} S", BY_NUMBER),
        ("x (mm),U (mV),T~{X},{U},{T}", {}),
        ("x (mm),U (mV),side~{X},{U},{SIDE}", {}),
        ("x (mm),U (mV),T~{X},{U},{WARM}", {}),
        ("x (mm),U (mV)~{X},{U}\n# U here", {}),
    ],
)
def test_what_reads_well_is_read(tables, options):
    scan = scan_of(tables, **options)
    np.testing.assert_allclose(scan.x, X * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(scan.u_zz, U * 1e-3, rtol=1e-12)


def test_an_option_settles_what_was_asked():
    decimal = scan_of("x (mm)\tU (1)~{WHOLE}\t{COUNT}", decimal=",")
    assert decimal.u_zz[1] == 12.004
    assert scan_of("0,1~{X},{U}", **BY_NUMBER, skip_rows=0).x.size == N + 1
    left = scan_of("x (mm),U (mV)~{X},{LARGE}", missing=["-9.9E37"])
    assert np.flatnonzero(np.isnan(left.u_zz)).tolist() == [6]


def test_of_columns_that_are_named_by_numbers_none_is_counted():
    frame = {0: np.arange(5.0), 1: np.arange(5.0) * 2, 2: np.ones(5)}
    scan = imported(frame, x=1, u="2", **NO_UNITS)
    np.testing.assert_allclose([scan.x[1], scan.u_zz[1]], 2e-3 / np.array([1, 2]))
    for columns in (frame, {"t": frame[0], "1": frame[1], "2": frame[2]}):
        with pytest.raises(InputError, match="no column 3"):
            imported(columns, x=1, u=3, **NO_UNITS)
    assert imported({"x": frame[0], "300": frame[1]}, x=1, u=2, **NO_UNITS).u_zz[1] == 2e-3


@pytest.mark.parametrize("name", ["ABOVE", "LABEL", "UNIT", "T", "WARM", "COMMA", "SIDE"])
def test_other_columns_of_a_table_in_memory_are_looked_at(name):
    frame = {"x": X, "U": U, "ragged": [[0]] * 14 + [[1, 2]], "made": "2026"}
    assert imported(frame, x="x", u="U", **NO_UNITS).x.size == N
    with pytest.raises(InputError) if name in ("ABOVE", "LABEL", "UNIT") else nullcontext():
        imported({**frame, "other": CELLS[name]}, x="x", u="U", **NO_UNITS)


@pytest.mark.parametrize(
    ("tables", "noise", "words"),
    [
        ("x (mm),U (MV)~{X},{U}", None, "mV meant"),
        ("x (mm),U (V)~{X},2{U}", None, "uV"),
        ("x (mm),U (V)~{X},{U}", 6.0, "noise: up to 6 V"),
        ("x (Mm),U (mV)~{X},{U}", None, "mm meant"),
    ],
)
def test_a_unit_of_a_size_that_nobody_has_is_asked_about(tables, noise, words):
    with pytest.warns(UnitWarning, match=words):
        scan_of(tables, noise=noise)


@pytest.mark.parametrize("scatter", [0.0, 2e-3])
def test_two_readings_at_each_place_of_a_repeat_are_named_with_what_differs(scatter):
    rng = np.random.default_rng(1)
    x = np.tile(X, 4) + scatter * rng.normal(size=4 * N)
    depth = np.tile(np.repeat([0.3, 0.6], N), 2)
    columns = [x, depth, np.tile(U, 4), np.repeat([1, 2], 2 * N), np.ones(4 * N)]
    names = ["x", "depth", "U", "pass", "lab"]
    np.savetxt(TABLE, np.transpose(columns), delimiter=",", header=",".join(names))
    frame = dict(zip(names[:4], columns, strict=False))
    options = {"x": "x", "u": "U", **NO_UNITS}
    named = "2 readings at each place of each repeat. Other columns that differ: depth."
    for source in (frame, TABLE):
        assert named in imported(source, repeat="pass", **options).notes
        assert "at each" not in imported(source, repeat=["pass", "depth"], **options).notes
