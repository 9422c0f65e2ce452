"""Tables that could be read in two ways, or hold more than readings: refused, or said."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from helpers.tables import imported

from memscal.errors import InputError, UnitWarning

N = 15
X = [f"{x:.2f}" for x in np.arange(N) - 7.0]
U = [f"{0.02 + 1.5 * np.exp(-((float(x) / 2) ** 2)):.4f}" for x in X]
V = [f"{2 * float(u):.4f}" for u in U]
NUMBERS = [str(i + 1) for i in range(N)]
WHOLE = [str(i - 7) for i in range(N)]
COUNTS = [f"{12_000 + 4 * i:,}" for i in range(N)]
POINTS = [count.replace(",", ".") for count in COUNTS]
NONE = [""] * N
UNITS = ["uV"] * 9 + ["mV"] + ["uV"] * 5
WITH_UNITS = [f"{x} mm" for x in X]
LABELS = [*NUMBERS[:-2], "Mean", "Max"]
LARGE = [*U[:6], "-9.9E37", *U[7:]]
BY_NUMBER = {"x": 1, "u": 2, "x_unit": "mm", "u_unit": "mV"}
AFTER_INDEX = {**BY_NUMBER, "x": 2, "u": 3}
NO_UNITS = {"x_unit": "mm", "u_unit": "mV"}


def table(head: str, *columns: list[str], by: str = ",") -> str:
    """Columns as text below a head."""
    return "\n".join([head, *map(by.join, zip(*columns, strict=True))]) + "\n"


def scan_of(folder: Path, text: str, **options: Any) -> Any:
    (folder / "t.csv").write_text(text, encoding="utf-8")
    return imported(folder / "t.csv", **{"x": "x", "u": "U", **options})


TWICE = table("x (mm),U (mV)", X, U)
LVM = "Channels\t2\t\nX0\t0.0\t0.0\n***End_of_Header***\t\t\n"


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        (table("x  mean U  V", X, U, V, by=" "), NO_UNITS, "line 1 has 4 words, the rows 3 cells"),
        (table("x / mm U / mV", X, U, by=" "), {}, "6 words"),
        (table("x U V W", X, U, V, by="\t").replace(" ", "\t"), NO_UNITS, "4 names"),
        (table("x U", NUMBERS, X, U, by=" "), NO_UNITS, "2 words"),
        (table("x U", NUMBERS, X, U, by=" "), BY_NUMBER, "names of rows"),
        (table("n x U\nmm mV", NUMBERS, X, U, by=" "), {}, "2 words"),
        (table("# x (mm) U (mV)", X, U, V, V, by=" "), {}, "no column 'U'"),
        (table("0,1", X, U), BY_NUMBER, r"line 1 \(0, 1\) looks(.|\n)*rows 1, or --skip-rows 0"),
        (table("1;2", X, U, by=";"), BY_NUMBER, "numbers of columns"),
        (table("# rod\n,0,1", NUMBERS, X, U), AFTER_INDEX, "line 2 .*numbers of columns"),
        (table("no,0,1", NUMBERS, X, U), AFTER_INDEX, "numbers of columns"),
        (table("# 0 1", X, U, by=" "), BY_NUMBER, "columns are: 0, 1"),
        (table("x (mm)\tU (1)", WHOLE, COUNTS, by="\t"), {}, r"thousands(.|\n)*--decimal ,"),
        (table("x (mm)\tU (1)\tV", WHOLE, COUNTS, COUNTS, by="\t"), {}, "thousands"),
        (table("x (mm);U (1)", WHOLE, POINTS, by=";"), {}, r"thousands(.|\n)*--decimal \."),
        (table("x,U (mV)", [x.replace(".", "_") for x in X], U), {"x_unit": "mm"}, "'-7_00'"),
        (table("x (mm),U (mV)", [f"1D{i}" for i in range(N)], U), {}, "'1D0'"),
        (table("no,x (mm),U (mV)", LABELS, X, U), {}, r"15 \('Mean'\), 16 \('Max'\)"),
        (table("no,x (mm),U (mV)", X, U, NONE), {}, "3 names, but no row more than 2 cells"),
        (table("no;x (mm);U (mV);T", X, U, V, NONE, by=";"), {}, "4 names"),
        (table("x (mm),U (mV)", X, NONE), {"delimiter": ","}, "No row of the table has a reading"),
        (table("x (mm),U (mV)", X, LARGE), {}, r"line 8 \('-9.9E37'\)(.|\n)*overload"),
        (table("x (mm),U (mV),F", X, U, LARGE), {"load_column": "F"}, "overload"),
        (table("x (mm),U (mV)", [*X[:-1], "inf"], U), {}, r"line 16 \('inf'\)"),
        (table("x (mm),U,unit", X, U, UNITS), {"u_unit": "uV"}, r"11 \('mV'\)(.|\n)*Units change"),
        (table("x,U", WITH_UNITS, U), NO_UNITS, r"line 2 \('-7.00 mm'\)(.|\n)*Units stand"),
        (table("x,U", WITH_UNITS, [f"{u}mV" for u in U]), {}, "Units stand in its cells"),
        (TWICE * 3, {}, "head of the table stands again in lines 17, 33"),
        (("# rod\n# " + TWICE) * 2, {}, "again in line 19"),
        (table("# x,U,V", X, U, V) + table("# U,x,V", U, X, V), NO_UNITS, "again in line 17"),
    ],
)  # fmt: skip
def test_what_two_readings_of_a_table_could_mean_is_asked(tmp_path: Path, text, options, words):
    with pytest.raises(InputError, match=words):
        scan_of(tmp_path, text, **options)


@pytest.mark.parametrize(
    ("text", "options"),
    [
        (table("x (mm)  U (mV)  T [degC]", X, U, V, by="  "), {}),
        (table("# x (mm) U [mV]", X, U, by=" "), {}),
        (table("x U\n(mm) (mV)", X, U, by=" "), {}),
        (table("A title of five words", X, U, by=" "), BY_NUMBER),
        (table("x U", NUMBERS, X, U, by=" "), {**AFTER_INDEX, "skip_rows": 1}),
        (table("0,1", X, U), {**BY_NUMBER, "skip_rows": 1}),
        (table("x (mm)\tF\tU (mV)", X, NONE, U, by="\t"), {}),
        (table("F\tx (mm)\tU (mV)", NONE, X, U, by="\t"), {}),
        (table("n\tF\tx (mm)\tU (mV)", [f"P {i}" for i in NUMBERS], NONE, X, U, by="\t"), {}),
        (table(f"{LVM}t\tx (mm)\tU (mV)\tComment", NONE, X, U, by="\t"), {}),
        (table(f"{LVM}t\tx (mm)\tU (mV)\tComment", NUMBERS, X, U, by="\t"), {}),
        (table("x (mm)\tU (mV)\tF", X, U, NONE, by="\t"), {"delimiter": "TAB"}),
        (table("x (mm);U (mV);", X, U, NONE, by=";"), {}),
        (table("x (mm),U (mV)", X, U, NONE), {}),
        (table("x\t U  V", [f"{x}\t" for x in X], U, V, by="  "), NO_UNITS),
        (table("x (mm),U (mV)", X, [f"{u}D+00" for u in U]), {}),
        (
            table("", *([v.replace(".", ",") for v in c] for c in (X, U)), ["S"] * N, by=" "),
            BY_NUMBER,
        ),
        (table("x (mm),U (mV),T", X, U, ["21", "err"] + ["21"] * 13), {}),
        (table("x (mm),U (mV),side", X, U, ["N"] * 9 + ["S"] * 6), {}),
        (TWICE + "# U jumps here\n", {}),
    ],
)
def test_what_reads_well_is_read(tmp_path: Path, text, options):
    scan = scan_of(tmp_path, text, **options)
    np.testing.assert_allclose(scan.x, [float(x) * 1e-3 for x in X], rtol=1e-12)
    np.testing.assert_allclose(scan.u_zz, [float(u) * 1e-3 for u in U], rtol=1e-12)


def test_an_option_settles_what_was_asked(tmp_path: Path):
    decimal = scan_of(tmp_path, table("x (mm)\tU (1)", WHOLE, COUNTS, by="\t"), decimal=",")
    assert decimal.u_zz[1] == 12.004
    assert scan_of(tmp_path, table("0,1", X, U), **BY_NUMBER, skip_rows=0).x.size == N + 1
    left = scan_of(tmp_path, table("x (mm),U (mV)", X, LARGE), missing=["-9.9E37"])
    assert np.flatnonzero(np.isnan(left.u_zz)).tolist() == [6]


def test_of_columns_that_are_named_by_numbers_none_is_counted():
    frame = {0: np.arange(5.0), 1: np.arange(5.0) * 2, 2: np.ones(5)}
    scan = imported(frame, x=1, u="2", **NO_UNITS)
    np.testing.assert_allclose([scan.x[1], scan.u_zz[1]], 2e-3 / np.array([1, 2]))
    for columns in (frame, {"t": frame[0], "1": frame[1], "2": frame[2]}):
        with pytest.raises(InputError, match="no column 3"):
            imported(columns, x=1, u=3, **NO_UNITS)
    assert imported({"x": frame[0], "300": frame[1]}, x=1, u=2, **NO_UNITS).u_zz[1] == 2e-3


@pytest.mark.parametrize(
    ("head", "factor", "noise", "words"),
    [
        ("x (mm),U (MV)", 1, None, "mV meant"),
        ("x (mm),U (V)", 4e3, None, "uV"),
        ("x (mm),U (V)", 1, 6.0, "noise: up to 6 V"),
        ("x (Mm),U (mV)", 1, None, "mm meant"),
    ],
)
def test_a_unit_of_a_size_that_nobody_has_is_asked_about(
    tmp_path: Path, head, factor, noise, words
):
    text = table(head, X, [str(factor * float(u)) for u in U])
    with pytest.warns(UnitWarning, match=words):
        scan_of(tmp_path, text, noise=noise)


@pytest.mark.parametrize("scatter", [0.0, 2e-3])
def test_two_readings_at_each_place_of_a_repeat_are_named_with_what_differs(
    tmp_path: Path, scatter
):
    rng = np.random.default_rng(1)
    x = [f"{place:.4f}" for place in np.tile(np.arange(N), 4) + scatter * rng.normal(size=4 * N)]
    depth = [
        f"{d:.3f}" for d in np.tile(np.repeat([0.3, 0.6], N), 2) + scatter * rng.normal(size=4 * N)
    ]
    text = table(
        "x,depth,U,pass,lab", x, depth, U * 4, ["1"] * 2 * N + ["2"] * 2 * N, ["a"] * 4 * N
    )
    named = "2 readings at each place of each repeat. Other columns that differ: depth."
    assert named in scan_of(tmp_path, text, repeat="pass", **NO_UNITS).notes
    if not scatter:
        assert (
            "at each place"
            not in scan_of(tmp_path, text, repeat=["pass", "depth"], **NO_UNITS).notes
        )
