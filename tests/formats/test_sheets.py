"""Tables that are no text: workbooks, Parquet files, and columns in memory."""

import io
import re
import sys
import zipfile
from datetime import date
from pathlib import Path

import numpy as np
import openpyxl
import pandas as pd
import pyarrow as pa
import pytest
from helpers.tables import imported
from pyarrow import parquet

import memscal
from memscal.errors import FormatError, InputError
from memscal.formats.tables import sheets

X = [-8.0, 0.0, 8.0]
U = [0.1, 2.0, 0.2]


def workbook():
    """A cover, and a sheet with a title, merged heads, units, a time stamp and an error."""
    book = openpyxl.Workbook()
    book.active.title = "Info"
    book.active["A1"] = "A. N. Other, placeholder"
    sheet = book.create_sheet("Daten")
    sheet["A1"] = "# Rod 12"
    sheet.merge_cells("A1:C1")
    sheet["A2"] = "Position"
    sheet.merge_cells("A2:B2")
    for row in (["x", "t", "U"], ["[mm]", "s", "(mV)"]):
        sheet.append(row)
    for x, u in zip(X, U, strict=True):
        sheet.append([x, date(2024, 5, 12), u])
    sheet.append([9.0, None, "#N/A"])
    book.save("rod.xlsx")
    return "rod.xlsx"


def test_a_sheet_of_a_workbook_is_read_below_its_title_and_named_by_its_rows():
    book = workbook()
    scan = imported(book, sheet="Daten", x="x", u="U")
    np.testing.assert_allclose(scan.x, [-8e-3, 0, 8e-3, 9e-3])
    np.testing.assert_allclose(scan.u_zz, [0.1e-3, 2e-3, 0.2e-3, np.nan])
    assert "The table says: Rod 12" in scan.notes
    assert "u_zz is missing (NaN) in row 8." in scan.notes
    with pytest.raises(InputError, match=r"'Info' of rod\.xlsx has no row(.|\n)*Info, Daten"):
        imported(book, x="x", u="U")
    with pytest.raises(InputError, match=r"no sheet 'Data'(.|\n)*Info, Daten"):
        imported(book, sheet="Data", x="x", u="U")


def edited(change):
    """A hidden sheet and a visible one of x and U, which a change turns into another."""
    book = openpyxl.Workbook()
    for sheet, factor in ((book.active, 9), (book.create_sheet("new"), 1)):
        sheet.append(["x (mm)", "U (mV)", "note"])
        for x, u in zip(X, U, strict=True):
            sheet.append([x, factor * u, "ok"])
    book.active.sheet_state = "hidden"
    change(book["new"])
    book.save("a.xlsx")
    return "a.xlsx"


def hide(sheet):
    sheet.auto_filter.ref = "A1:C4"
    for row in (2, 4):
        sheet.row_dimensions[row].hidden = True


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda _: None, r"3 columns of the sheet 'new'"),
        (hide, r"Hidden, and read as all others: rows 2, 4\."),
        (lambda sheet: sheet.merge_cells("C2:C4"), "Read 3 rows"),
    ],
)
def test_the_first_visible_sheet_is_read_with_its_hidden_rows_named(change, words):
    scan = imported(edited(change), x="x", u="U")
    np.testing.assert_allclose(scan.u_zz, [1e-3 * u for u in U])
    assert re.search(words, scan.notes)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda sheet: sheet.merge_cells("B3:B4"), "rows 3 to 4 are merged"),
        (lambda sheet: sheet.merge_cells("A3:C3"), "rows 3 to 3 are merged"),
        (lambda sheet: sheet.__setitem__("B3", "=A3*2"), "row 3 .*without a stored result"),
        (
            lambda sheet: [sheet.__setitem__(f"{c}{r}", "=ROW()") for c in "AB" for r in (2, 3, 4)],
            "no row of numbers(.|\n)*results must be stored",
        ),
    ],
)
def test_merged_cells_and_formulas_without_results_are_refused(change, words):
    with pytest.raises(FormatError, match=words):
        imported(edited(change), x="x", u="U")


def test_a_formula_has_the_result_that_is_stored_and_an_empty_text_is_one():
    path = edited(lambda sheet: sheet.__setitem__("B3", "=A3"))
    for stored, u in ((b' t="str"><f>A3</f><v></v>', np.nan), (b"><f>A3</f><v>2</v>", 2e-3)):
        parts = io.BytesIO()
        with zipfile.ZipFile(path) as packed, zipfile.ZipFile(parts, "w") as written:
            for name in packed.namelist():
                text = packed.read(name).replace(b"><f>A3</f><v></v>", stored)
                written.writestr(name, text)
        Path("b.xlsx").write_bytes(parts.getvalue())
        scan = imported("b.xlsx", x="x", u="U")
        np.testing.assert_allclose(scan.u_zz[1], u)


SHEET = (
    b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>%s'
)
SHEET += b"</sheetData></worksheet>"
FAR = b'<row r="1"><c r="A1"><v>1</v></c></row><row r="999999999"><c r="A1"><v>1</v></c></row>'
DOCTYPE = b'<!DOCTYPE a [<!ENTITY b "bb">]>' + SHEET % b"&b;"


@pytest.mark.parametrize(
    ("xml", "words"),
    [
        (SHEET % (b" " * 2**20), "1,0.* bytes when it is unpacked"),
        (SHEET % (b"<c/>" * 1001), "tags of XML in its sheets"),
        (SHEET % FAR, "has 1,001 cells"),
        (SHEET % b"".join(b'<row><c r="XFD%d"/></row>' % i for i in range(9)), "cells"),
        (DOCTYPE, "declarations"),
        ((SHEET % b"").decode().encode("utf-16"), "encoding"),
        (b'<?xml version="1.0" encoding="cp037"?>' + SHEET % b"", "encoding"),
        (b"<a", "cannot be"),
    ],
)
def test_a_hostile_workbook_is_refused_before_it_takes_memory(monkeypatch, xml, words):
    limits = {"MOST_TAGS": 1000, "MOST_OTHER_TAGS": 1000, "MOST_FILE_BYTES": 2**20}
    for name, limit in limits.items():
        monkeypatch.setattr(sheets, name, limit)
    plain = io.BytesIO()
    book = openpyxl.Workbook()
    book.save(plain)
    path = Path("hostile.xlsx")
    with zipfile.ZipFile(plain) as source, zipfile.ZipFile(path, "w") as target:
        for name in source.namelist():
            target.writestr(name, xml if "sheet1" in name else source.read(name), 8)
    with pytest.raises(FormatError if words == "cannot be" else InputError, match=words):
        sheets.open_table(path)


def test_parquet_is_read_with_the_units_of_its_fields():
    fields = [pa.field("x", pa.float32(), metadata={"units": "mm"}), pa.field("U [uV]", pa.int64())]
    table = pa.table([pa.array(X, pa.float32()), pa.array([1, None, 3])], schema=pa.schema(fields))
    parquet.write_table(table, "rod.parquet")
    scan = imported("rod.parquet", x="x", u="U")
    np.testing.assert_allclose(scan.x, [-8e-3, 0, 8e-3])
    np.testing.assert_allclose(scan.u_zz, [1e-6, np.nan, 3e-6])
    assert scan.source.file_name == "rod.parquet"
    columns = [pa.array(np.arange(5.0) * factor) for factor in (1, 1, 2)]
    twice = pa.Table.from_arrays(columns, names=["x", "u", "u"])
    parquet.write_table(twice, "twice.parquet")
    third = imported("twice.parquet", x="x", u=3, x_unit="mm", u_unit="V")
    np.testing.assert_array_equal(third.u_zz, 2 * np.arange(5.0))
    Path("no.parquet").write_bytes(b"PAR1 and no more")
    with pytest.raises(FormatError, match=r"no\.parquet cannot be read"):
        imported("no.parquet", x="x", u="u")


@pytest.mark.parametrize(
    "frame",
    [
        pd.DataFrame({"x/mm": X, "U (mV)": U}),
        {"x [mm]": X, "U [mV]": np.array(U)},
        pd.DataFrame({"x/mm": ["-8,0", "0", "8"], "U (mV)": ["0,1", "2", "0,2"]}),
    ],
    ids=["data frame", "mapping", "text with decimal commas"],
)
def test_columns_in_memory_are_a_table(frame):
    scan = imported(frame, x="x", u="U", load=1.0)
    np.testing.assert_allclose(scan.x, [-8e-3, 0, 8e-3], rtol=1e-15)
    np.testing.assert_allclose(scan.u_zz, [0.1e-3, 2e-3, 0.2e-3], rtol=1e-15)
    assert scan.source is None


@pytest.mark.parametrize(("frame", "words"), [
    ({"x": [1, 2], "u": [1, 2, 3]}, r"shape \(3,\) in 2 rows"), ([1, 2], "no table with columns"),
    ({"x": [1, 2], "u": ["a", 1]}, "not a number in row 1 \\('a'\\)"),
])  # fmt: skip
def test_what_is_no_table_in_memory_is_refused(frame, words):
    with pytest.raises(InputError, match=words):
        imported(frame, x="x", u="u", x_unit="mm", u_unit="mV")


def test_scans_are_made_of_arrays_in_any_units():
    scan = memscal.Scan.from_arrays(X, [U, U], x_unit="mm", u_unit="mV", u_errors=0.01, load=1.0)
    assert (scan.kind, scan.load) == ("repeats", 1.0)
    np.testing.assert_allclose(scan.u_zz, np.array([U, U]) * 1e-3)
    np.testing.assert_allclose(scan.u_zz_errors, np.full((2, 3), 1e-5))
    raster = memscal.Scan.from_arrays(X, np.eye(3), y=np.array(X)[:, None], x_unit="mm")
    assert (raster.kind, raster.y[3], raster.u_zz[4]) == ("points", 0.0, 1.0)
    with pytest.raises(InputError, match=r"shape of u, \(3,\)"):
        memscal.Scan.from_arrays(X, U, repeat=[1, 2])


@pytest.mark.parametrize(
    ("name", "options", "words"),
    [
        ("a.xlsx", {"delimiter": ";"}, "delimiter.* no effect on a workbook"),
        ("a.parquet", {"skip_rows": 2}, "--skip-rows.* no effect on a Parquet"),
        ("a.csv", {"sheet": "A"}, "--sheet.* no effect on a text"),
        ("a.ods", {}, r"\.xlsx or as CSV"),
    ],
)
def test_an_option_that_a_kind_of_table_has_no_use_for_is_refused(name, options, words):
    with pytest.raises(InputError, match=words):
        imported(name, x="x", u="u", **options)


def test_a_workbook_without_openpyxl_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "openpyxl", None)
    Path("b.xlsx").write_bytes(b"PK")
    with pytest.raises(InputError, match=r"openpyxl(.|\n)*\.\[tables\]"):
        imported("b.xlsx", x="x", u="u")
