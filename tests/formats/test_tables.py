"""Tables as they leave an experiment or a FEM program, with everything that can be messy."""

import hashlib
import re
import warnings
from pathlib import Path

import numpy as np
import pytest
from helpers.builders import make_film
from helpers.tables import imported

from memscal import Rod, Scan, Sphere, TableLayout, import_table
from memscal.errors import FormatError, InputError, UnitWarning
from memscal.formats.tables.reference import read_reference_table
from memscal.formats.tables.stated import ScanConditions
from memscal.formats.tables.text_table import read_indenter_table
from memscal.model.checks import marked_texts


def scan_table(text, **options):
    """Import a table with the usual options."""
    table = Path("table.csv")
    table.write_text(text, encoding="utf-8")
    given = {"x": "x", "u": "u", "x_unit": "mm", "u_unit": "mV", "load": 1.0}
    given |= {"film": make_film(), "indenter": Rod(radius=0.25e-3), **options}
    return imported(table, **given)


def rows(*columns, header):
    """Write columns as text with full precision."""
    lines = [",".join(f"{v!r}" for v in row) for row in zip(*columns, strict=True)]
    return "\n".join([header, *lines])


def test_a_line_keeps_its_uneven_unsorted_positions():
    found = scan_table("x,u\n1.5,2\n-1,1\n0.25,3\n")
    assert found.kind == "line"
    assert found.x.tolist() == [1.5e-3, -1e-3, 0.25e-3]
    assert found.u_zz.tolist() == [2e-3, 1e-3, 3e-3]
    assert any("3 readings at 3 places" in note.text for note in found.messages)


@pytest.mark.parametrize(
    "text",
    [
        "x,u,n\n0,1,4\n1,2,4\n3,4,4\n3,4.4,7\n1,2.2,7\n0,1.1,7\n",
        "x,u,n\n3,4.4,7\n0,1,4\n1,2.2,7\n1,2,4\n0,1.1,7\n3,4,4\n",
    ],
    ids=["forth and back", "mixed"],
)
def test_repeats_over_the_same_positions_become_rows(text):
    found = scan_table(text, repeat="n")
    assert found.kind == "repeats"
    assert found.x.tolist() == [0.0, 1e-3, 3e-3]
    np.testing.assert_allclose(
        found.u_zz, [[1e-3, 2e-3, 4e-3], [1.1e-3, 2.2e-3, 4.4e-3]], rtol=1e-12
    )
    assert any("6 readings in 2 repeats at 3 places" in note.text for note in found.messages)


@pytest.mark.parametrize(
    "text",
    [
        "x,u,n\n0,1,1\n1,2,1\n3,4,1\n1.02,2.2,2\n-0.01,1.1,2\n2.99,4.4,2\n",
        "x,u,n\n0,1,1\n1,2,1\n3,4,1\n1,2.2,2\n0,1.1,2\n",
        "x,u,n\n0,1,1\n1,2,1\n3,4,1\n1,2.2,2\n0,1.1,2\n0,4.4,2\n",
    ],
    ids=["scattered positions", "a row that is missing", "a position read twice"],
)
def test_other_repeats_are_points_as_they_stand_in_the_table(text):
    found = scan_table(text, repeat="n")
    stated = np.loadtxt(text.splitlines(), delimiter=",", skiprows=1)
    assert found.kind == "points"
    np.testing.assert_allclose(found.x, stated[:, 0] * 1e-3, rtol=1e-12)
    np.testing.assert_allclose(found.u_zz, stated[:, 1] * 1e-3, rtol=1e-12)
    np.testing.assert_array_equal(found.passes, stated[:, 2] - 1)
    assert any("in 2 repeats at 3 places" in note.text for note in found.messages)


def test_a_raster_is_points_and_its_places_and_steps_are_named():
    """In random order, with three places missing and scattered positions."""
    rng = np.random.default_rng(3)
    place = rng.permutation(np.setdiff1d(np.arange(35), [4, 17, 30]))
    row, column = np.divmod(place, 7)
    x = -4.0 + 0.5 * column + 5e-3 * rng.uniform(-1, 1, 32)
    y = 100.0 + 0.25 * row + 5e-3 * rng.uniform(-1, 1, 32)
    text = rows(x.tolist(), y.tolist(), rng.normal(size=32).tolist(), header="x,y,u")
    found = scan_table(text, y="y")
    assert (found.kind, found.u_zz.shape) == ("points", (32,))
    np.testing.assert_allclose(found.y, y * 1e-3, rtol=1e-12)
    (note,) = [note.text for note in found.messages if "32 readings" in note.text]
    step_x, step_y = map(float, re.findall(r"typically (\S+) x (\S+) mm", note)[0])
    assert (step_x, step_y) == (pytest.approx(0.5, rel=0.01), pytest.approx(0.25, rel=0.01))


ROWS = "\n0,1\n1,2\n2,1\n"
LINE = "\n".join(f"{x},{x % 3}" for x in range(-8, 9))
FORCES = "x,u,f\n0,1,0.050\n1,2,0.051\n2,2,0.049\n"
LONG = "x,u\n" + "\n".join(f"{x},{np.exp(-((x / 1e3) ** 2))}" for x in range(-8000, 8001, 250))
NO_UNITS = {"x_unit": None, "u_unit": None}


@pytest.mark.parametrize(
    ("text", "options", "words"),
    [
        *((f"x,u{ROWS}", {"u_unit": unit}, f'"{unit}"') for unit in ("parsnip", "degC", "9/")),
        *((f"x,u{ROWS}", {"u": u}, r"columns are: x, u\.") for u in ("volts", "0", "3", -1)),
        *((text, {}, r"table\.csv") for text in ("", "\n\n", "# a comment\n", "x,u\n", "\0\0\0")),
        (f"x,u{ROWS}", {"u_unit": None}, r"column 'u' states no unit(.|\n)*--u-unit"),
        (f"x,u{ROWS}", {"load": None, "load_scatter": 0.1}, "no load"),
        (f"x,u{ROWS}", {"u_sign": 2}, "Give 1 or -1"),
        (f"x,u{ROWS}", {"load_unit": "g"}, "80 g weigh"),
        (f"x,u{ROWS}", {"noise": 1, "u_errors": "x"}, "one uncert"),
        (f"x,u{ROWS}", {"noise": 1, "holds": True}, "one uncertainty"),
        (f"x,u{ROWS}", {"load": None, "load_uncertainty": 1.0}, "belongs to a load"),
        (f"x,u{ROWS}", {"load_column": "u", "load_unit": "g"}, 'unit "g", but it must be a force'),
        (f"x [um],u{ROWS}", {}, r"'x' states the unit 'um', but x_unit \(--x-unit\) is 'mm'"),
        (f"x,u (uV){ROWS}", {}, "'uV', but u_unit"),
        (f"x [mm],u/V{ROWS}", {"u_unit": "parsnip"}, "'V', but u_unit"),
        (f"x,u [channel 1]{ROWS}", {"u_unit": None}, "states no unit that is known"),
        ("x,u\n0,1\n1,3\n", {"branch": "u"}, r"table\.csv: column 'u' holds 3"),
        (
            "x,u,b\n0,1,down\n1,2,up\n",
            {"branch": "b"},
            r"none of approach, retreat, in line 2 \('down'",
        ),
        (
            FORCES,
            {"load": 0.5, "load_column": "f"},
            r"as 0\.5 N, but those recorded go from 0\.049",
        ),
        (FORCES, {"load": 0.05, "load_uncertainty": 5.0}, r"is 5 N, but the load is 0\.05"),
        (LONG, {"film": make_film(thickness=1.5e-3)}, r"step is 250 mm(.|\n)*um as mm\?"),
        (LONG, {"indenter": Sphere(radius=0.1)}, r"positions span 1\.6e\+04 mm"),
        ("x;u\n-8.000;0,05\n-500;0,1\n0;12,1\n500;0,1\n", {"decimal": ","}, r"'-8\.000'"),
        ("x/mm,u/mV\n" + LINE.replace(",", ",0,0,"), NO_UNITS, "line 2 has 4 cells, the header 2"),
        (f"x/mm,u/mV\n{LINE}\n9,ok,1\n", NO_UNITS, "line 19 has 3 cells"),
        ("x/mm u/mV t\n" + "0 1 2\n" * 9 + "1 2\n", NO_UNITS, "line 11 has 2"),
        ('x/mm,u/mV,n\n0,1,"5 inch\n1,2,n\n2,3,end"\n' + LINE, NO_UNITS, "no end in it"),
        (f"x [mm],u [mV]\nmm,V\n{LINE}", NO_UNITS, "'mV' in its head, and 'V'"),
        ("x (um);u (mV)\n-6,000;1\n-750;2\n0;3\n1,000;5\n", NO_UNITS, "may separate thousands"),
        (f"x/mm,u (mV),u (V)\n{LINE}", NO_UNITS, r"columns 'u': u \(mV\), u \(V\)"),
        *(
            (f"x,u,{head}\n{LINE.replace(chr(10), f',{cell}{chr(10)}')}", given, f"says {cell}")
            for head, cell, given in (
                ("unit", "mV", {"u_unit": "V"}),
                ("unit", "V", {}),
                ("t", "uT", {"u_unit": "nT"}),
                ("x_unit", "um", {}),
            )
        ),
    ],
)
def test_a_table_of_no_use_is_refused(text, options, words):
    with pytest.raises(InputError, match=words):
        scan_table(text, **options)


@pytest.mark.parametrize(
    ("unit", "si", "factor"),
    [
        ("uT", "T", 1e-6),
        ("counts", "1", 1.0),
        ("a.u.", "1", 1.0),
        ("percent", "1", 0.01),
        ("mV", "V", 1e-3),
        ("mV/s", "kg*m^2/A/s^4", 1e-3),
    ],
)
@pytest.mark.parametrize("head", ["u/{}", "u ({})", "u[{}]"])
def test_readings_of_any_unit_state_it_in_their_head(unit, si, factor, head):
    text = f"x,{head.format(unit)}\n0,1\n1,2\n"
    found = scan_table(text, u_unit=None, film=None, indenter=None, load=None)
    assert found.unit == si
    np.testing.assert_allclose(found.u_zz, [factor, 2 * factor], rtol=1e-15)
    assert (found.film, found.indenter, found.load) == (None, None, None)


def test_the_load_comes_from_the_option_or_the_median_of_its_column():
    text = "x,u,f\n0,1,990\n1,2,1000\n2,2,1030\n"
    found = scan_table(text, load=None, load_column="f", load_unit="mN")
    assert found.load == 1.0
    np.testing.assert_allclose(found.normal_load, [0.99, 1.0, 1.03])
    assert scan_table(text, load=None).load is None
    assert scan_table(text, load_column="f", load_unit="mN").load == 1.0


@pytest.mark.parametrize("seed", range(3))
def test_a_line_at_several_loads_is_numbered_by_them(seed):
    rng = np.random.default_rng(seed)
    loads = rng.permutation(np.repeat([0.02, 0.05, 0.1], 11)) * rng.normal(1, 0.01, 33)
    x = np.tile(np.arange(11.0), 3)
    text = rows(x.tolist(), loads.tolist(), loads.tolist(), header="x,u,f")
    scan = scan_table(text, load=None, load_column="f")
    medians = [np.median(scan.normal_load[scan.passes == i]) for i in range(3)]
    np.testing.assert_allclose(medians, [0.02, 0.05, 0.1], rtol=0.02)
    assert "3 lines: one for each of the loads of 0.0" in scan.notes
    one = scan_table(text.replace("x,u,f", "x,f,u"), load=None)
    assert not one.passes.any()


def test_rows_without_a_position_are_left_out_and_named_and_a_header_may_be():
    found = scan_table("0,9,1\n,7,7\n1,8,\n", x="1", u=3)
    np.testing.assert_array_equal(found.u_zz, [1e-3, np.nan])
    assert any("they have no position: line" in note.text for note in found.messages)


@pytest.mark.parametrize(
    ("text", "options"),
    [
        ("x;u\n0,5;1,25\n1,5;2,5\n", {}),
        ("x\tu\n0.5\t1.25\n1.5\t2.5\n", {}),
        ("x u\n0.5   1.25\n 1.5 2.5\n", {}),
        ("# made by a stage\n% in mm\nx,u\n0.5,1.25\n1.5,2.5\n", {}),
        ('"x","u"\n"0.5","1.25"\n"1.5","2.5"\n', {}),
        ("\ufeffx,u\r\n0.5,1.25\r\n1.5,2.5\r\n", {}),
        ("x|u\n5D-1|1.25\n1.5|2.5d0\n", {}),
        ("Rate;10\nLoad;1,0\nx;u\n0,5;1,25\n1,5;2,5\n", {}),
        ("x u\n0,5 1,25\n1,5 2,5\n", {}),
        ("# rod\n# x/mm u/mV\n0.5 1.25\n1.5 2.5\n", {"x_unit": None, "u_unit": None}),
        ("7,8\n9,9\nx,u\n0.5,1.25\n1.5,2.5\n", {"skip_rows": 2}),
        ("t,x,u\n12:01,0.5,1.25\n12:02,1.5,2.5\n", {}),
        ('a,b,c\n"2 m/s","",""\nt,x,u\ns,mm,mV\n0,.5,1.25\n1,1.5,2.5\n', {"x_unit": None}),
    ],
)
def test_every_dialect_gives_the_same_numbers(text, options):
    found = scan_table(text, film=None, **options)
    assert found.x.tolist() == [0.5e-3, 1.5e-3]
    assert found.u_zz.tolist() == [1.25e-3, 2.5e-3]


EXPORT = (
    "Protokoll;;\nLabor Nord;;\nLast;1,0;N\n;;\nWeg x;Spannung (µV);Nr\n[um];;-\n"
    "-8000;100,5;1\n-7000;n.a.;2\n;7;3\n0;-9999;4\n8000;200;5\n"
)


@pytest.mark.parametrize("encoding", ["utf-8", "utf-8-sig", "utf-16", "utf-16-be", "cp1252"])
@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
def test_an_export_with_preamble_and_units_is_read_as_it_is(encoding, ends):
    content = EXPORT.replace("\n", ends).encode(encoding)
    mark = b"\xfe\xff" if encoding == "utf-16-be" else b""
    Path("t.csv").write_bytes(mark + content)
    layout = TableLayout(missing=["N.A.", "-9999"])
    scan = import_table("t.csv", x="Weg x", u="Spannung", layout=layout)
    np.testing.assert_allclose(scan.x, [-8e-3, -7e-3, 0, 8e-3])
    np.testing.assert_allclose(scan.u_zz, [100.5e-6, np.nan, np.nan, 200e-6])
    for words in (
        "The table says: Last;1,0;N\n",
        "header is line 5, a row of units below it",
        "u_zz in µV, x in um",
        "u_zz is missing (NaN) in lines 8, 10.",
        "Left out, for they have no position: line 9.",
    ):
        assert words in scan.notes, scan.notes
    if mark:
        assert scan.source.sha256 == hashlib.sha256(mark + content).hexdigest()


@pytest.mark.parametrize("seed", range(8))
def test_wrong_cells_are_counted_and_the_first_five_named_by_their_lines(seed):
    """Wherever they stand, the first row of numbers included, and in blocks read in either way."""
    rng = np.random.default_rng(seed)
    lines = [f"{i},{i}" for i in range(40_000)]
    wrong = np.sort(rng.choice(len(lines), 12, replace=False))
    wrong[0] = 0
    for i in wrong:
        lines[i] = f"{i},OVL"
    lines.insert(int(wrong[3]), "# comment")
    named = [i + 4 + (k >= 3) for k, i in enumerate(wrong[:5])]
    text = "made by hand\n\nx,u\n" + "\n".join(lines)
    expected = ", ".join(f"{n} \\('OVL'\\)" for n in named) + " and 7 more"
    with pytest.raises(FormatError, match=expected):
        scan_table(text, film=None)


def test_the_same_unit_in_other_letters_does_not_contradict():
    text = "x (µm),u [millivolt]\n0,1\n1e3,2\n2e3,1\n"
    scan = scan_table(text, x_unit="um")
    np.testing.assert_allclose(scan.x, [0, 1e-3, 2e-3])


def test_uncertainties_are_a_column_or_one_number_in_the_unit_of_the_readings():
    text = "x,u,e [uV]\n0,1,30\n1,2,40\n2,1,50\n"
    column = scan_table(text, u_errors="e")
    np.testing.assert_allclose(column.u_zz_errors, [3e-5, 4e-5, 5e-5])
    assert "uncertainty of each reading: 0.04 mV (median)" in column.notes
    np.testing.assert_allclose(scan_table(text, noise=0.04).u_zz_errors, np.full(3, 4e-5))


@pytest.mark.parametrize(
    ("options", "direction"),
    [
        ({"x": "b", "y": "a"}, "y"),
        ({"x": "a", "y": "b"}, "x"),
        ({"x": None, "y": "a"}, "y"),
    ],
)
def test_a_line_of_two_columns_runs_along_the_one_that_spreads(options, direction):
    scan = scan_table("a,b,u\n-2,5.001,1\n0,5,2\n3,4.999,1\n", **options)
    assert (scan.kind, scan.direction) == ("line", direction)
    np.testing.assert_allclose(scan.x, [-2e-3, 0, 3e-3])


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"thickness": 1.5}, "1.5 m. Probably 1.5 mm was meant"),
        ({"thickness": 2e3}, "2000 um"),
    ],
)
def test_a_film_that_none_has_is_warned_of_with_the_unit_that_was_meant(changes, words):
    with pytest.warns(UnitWarning, match=words):
        Scan(x=[0, 1e-3], u_zz=[0, 1], film=make_film(**changes))


def reference_table(text, **options):
    """Import a FEM table with the usual options."""
    table = Path("fem.csv")
    table.write_text(text)
    given = {"r": "r", "sigma": "s", "r_unit": "mm", "sigma_unit": "MPa", "load": 1.0, **options}
    return read_reference_table(table, **given)


def test_a_fem_table_is_sorted_and_converted_and_its_force_reported():
    r = np.linspace(0, 8, 401)
    s = np.exp(-(r**2) / 2) / (2 * np.pi)  # 1 N with r in mm and s in MPa
    order = np.random.default_rng(1).permutation(r.size)
    found = reference_table(rows(r[order].tolist(), (-s[order]).tolist(), header="r,s"), sign=-1)
    np.testing.assert_allclose(found.profile.r, r * 1e-3, rtol=1e-14)
    np.testing.assert_allclose(found.profile.sigma_zz, s * 1e6, rtol=1e-14)
    assert any("sorted by radius" in note.text for note in found.notes)
    assert any("carries 1 N of the load of 1 N" in note.text for note in found.notes)


@pytest.mark.parametrize(("text", "options", "words"), [
    ("r,s\n0,-2\n1,-1\n2,-0.1\n", {}, r"mostly negative(.|\n)*sign=-1"),
    ("r,s\n0,2\n1,1\n2,0.1\n", {"sign": -1}, "mostly negative"),
    ("r,s\n0,2\n1,\n2,1\n", {}, "sigma_zz is not a number in data row 2"),
    ("r,s\n0,2\nnan,3\n,1\n", {}, "r is not a number in data row 2 and 1 more"),
    ("r,s\n-1,2\n0,3\n1,2\n", {}, "negative radius"),
    ("r,s\n0,2\n1,1\n", {"load": 3.0, "sign": 0}, "Give 1 or -1"),
    ("r,s\n0,2\n1,1\n", {"load": 3.0, "shear_sign": 0}, "Give 1 or -1"),
])  # fmt: skip
def test_a_fem_table_that_cannot_be_used_is_refused(text, options, words):
    with pytest.raises(InputError, match=words):
        reference_table(text, **options)


def test_nodes_given_twice_are_averaged_and_reported():
    found = reference_table("r,s\n0,2\n1,1.1\n1,0.9\n2,0.1\n", load=7.0)
    assert found.profile.sigma_zz.tolist() == [2e6, 1e6, 0.1e6]
    assert any("1 rows repeat" in note.text and "0.05" in note.text for note in found.notes)
    steps = reference_table("r,s\n0,2\n1,1\n2,0.1\n0,1\n1,0.5\n2,0.05\n", load=7.0)
    assert [note.severity for note in steps.notes if "repeat" in note.text] == ["warning"]


def test_the_shear_sign_turns_the_stress_component_into_the_traction_on_the_film():
    """Traction is stress times normal; the film's lower face has the normal -z."""
    shear = 0.3
    table = f"r,s,t\n0,-2,0\n1,-1,{shear}\n"
    kept = reference_table(table, sign=-1, shear="t", load=3.0).profile
    assert kept.sigma_rz.tolist() == [0.0, 0.3e6]
    stress = np.array([[0, 0, shear], [0, 0, 0], [shear, 0, -1.0]])
    traction = stress @ [0, 0, -1.0]
    found = reference_table(table, sign=-1, shear="t", shear_sign=-1, load=3.0)
    assert found.profile.sigma_rz[1] == pytest.approx(traction[0] * 1e6)
    # The base pushes up on what is compressed: the traction is the (positive) pressure.
    assert found.profile.sigma_zz[1] == pytest.approx(traction[2] * 1e6)


def gaussian_table(reach, factor=1.0):
    """1 N, with r in mm and s in MPa, up to a radius, on radii like those of a mesh."""
    r = reach * np.linspace(0.02, 1, 120) ** 1.5
    s = factor * np.exp(-(r**2) / 2) / (2 * np.pi)
    return rows(r.tolist(), s.tolist(), header="r,s")


def test_the_force_of_a_table_is_as_good_as_its_radii():
    found = reference_table(gaussian_table(8.0))
    assert found.profile.force == pytest.approx(1.0, abs=1e-6)
    assert not any(note.severity == "warning" for note in found.notes)
    assert found.profile.notes.splitlines() == marked_texts(found.notes)


@pytest.mark.parametrize("factor", [1e-6, 1e-3, 0.4, 2.5, 1e3])
def test_a_force_far_from_the_load_is_refused_as_a_wrong_unit(factor):
    with pytest.raises(InputError, match=r"times the load(.|\n)*\"MPa\"(.|\n)*\"mm\"(.|\n)*sign"):
        reference_table(gaussian_table(8.0, factor))


def test_a_table_that_ends_early_is_warned_of_and_not_refused():
    """Within one standard deviation a Gaussian carries 1 - exp(-1/2) of its force."""
    found = reference_table(gaussian_table(1.0))
    assert found.profile.force == pytest.approx(1 - np.exp(-0.5), rel=1e-6)
    (note,) = [note for note in found.notes if note.severity == "warning"]
    assert "ends with 60.7% of its maximum left: extend it" in note.text
    with pytest.raises(InputError, match="times the load"):
        reference_table(gaussian_table(1.0), load=0.1)


def test_a_voltage_that_falls_under_compression_can_be_turned():
    found = scan_table("x,u,s\n0,-1,5\n1,-2,6\n", u_sign=-1, u_xz="s")
    assert found.u_zz.tolist() == [1e-3, 2e-3]
    assert found.channels["u_xz"].tolist() == [5e-3, 6e-3]
    assert "The sign of u_zz was changed." in found.notes


def test_what_the_table_says_at_its_head_travels_with_the_scan():
    head = "# SYNTHETIC: made up\x1b[2J\n%  rod 3\n#\n" + "# " + "z" * 5000 + "\n" + "# more\n" * 40
    found = scan_table(head + "x,u\n0,1\n# within the table\n1,2\n")
    lines = found.notes.splitlines()
    assert lines == marked_texts(found.messages)
    assert found.source.sha256 in lines[0]
    assert "The table says: SYNTHETIC: made up[2J" in lines
    assert "The table says: rod 3" in lines
    assert "24 more lines above the table were left out." in lines
    assert "within the table" not in found.notes
    assert max(map(len, lines)) < 400


def test_an_error_of_a_spreadsheet_is_a_cell_and_a_comment_among_rows_is_told():
    errors = "t,x,u\n" + "\n".join(f"{'#N/A' if x % 2 else x},{x},1" for x in range(9))
    assert scan_table(errors).x.size == 9
    found = scan_table("x,u\n0,1\n1,2\n#2,3\n3,4\n4,5\n")
    assert found.x.size == 4
    assert any("Left out as comments: line 4." in text for text in marked_texts(found.messages))


@pytest.mark.parametrize(("apex", "lowest"), [(0.0, 0.0), (3.0, 3.0), (0.4, 0.5), (6.0, 6.0)])
def test_a_tip_that_is_lowest_away_from_its_axis_is_warned_of(apex, lowest):
    r = np.arange(0.0, 6.5, 0.5)
    table = Path("tip.csv")
    heights = 5e-3 * (r - apex) ** 2
    table.write_text(rows((1e3 * r).tolist(), heights.tolist(), header="r (um),z_mm"))
    with warnings.catch_warnings(record=True) as seen:
        warnings.simplefilter("always")
        profile = read_indenter_table(table, r_unit=None, z_unit=None)
    np.testing.assert_allclose(
        [profile.r[-1], profile.z[-1]], [6e-3, (heights[-1] - heights.min()) * 1e-3]
    )
    assert [f"lowest height is {lowest:g} mm from" in str(each.message) for each in seen] == [
        True
    ] * (apex > 0)


@pytest.mark.parametrize(
    ("indenter", "load", "fitting"),
    [
        (Rod(radius=0.25e-3), 1.0, ""),
        (Rod(radius=0.25e-3), 3.0, ""),
        (Rod(radius=0.25e-3), 147.1, r"147.1 mN \(0.1471 N\) or of 147.1 gf \(1.443 N\)"),
        (Rod(radius=0.25e-3), 2000.0, r"2000 mN \(2 N\)"),
        (Rod(radius=0.25e-3), 1e9, "Check the load"),
        (Sphere(radius=60e-3), 30.0, ""),
        (Sphere(radius=60e-3), 2750.0, r"2750 mN \(2.75 N\)"),
    ],
)
@pytest.mark.parametrize("column", [False, True])
def test_a_load_that_would_sink_the_indenter_through_the_film_is_refused(
    indenter, load, fitting, column
):
    x = np.linspace(-8e-3, 8e-3, 33)
    table = {"x": x, "u": np.exp(-(x**2) / 8e-6), "F": np.full(33, load)}
    given = {"load_column": "F"} if column else {"load": load}
    given |= {"x_unit": "m", "u_unit": "mV", "film": make_film(), "indenter": indenter}
    if not fitting:
        assert imported(table, x="x", u="u", **given).load == load
        return
    with pytest.raises(InputError, match=f"would sink by (.|\n)*{fitting}"):
        imported(table, x="x", u="u", **given)


@pytest.mark.parametrize(("value", "load"), [(None, 1.0), (3.0, 3.0)])
@pytest.mark.parametrize("unit", ["s (MPa)", "s"])
def test_a_reference_without_a_load_is_scaled_by_its_own_integral(unit, value, load):
    def read(reach, value):
        Path("p.csv").write_text(gaussian_table(reach).replace("r,s", f"r (mm),{unit}"))
        return read_reference_table("p.csv", r="r", sigma="s", value=value)

    if value is None and unit == "s":
        with pytest.raises(InputError, match="states no unit"):
            read(8.0, value)
        return
    found = read(8.0, value).profile
    assert found.load == pytest.approx(load, rel=1e-5)
    sigma = np.exp(-((1e3 * found.r) ** 2) / 2) / (2 * np.pi)
    np.testing.assert_allclose(found.sigma_zz, 1e6 * load * sigma, rtol=1e-5)
    cut = read(1.8, value or 1.0)
    assert any("19.8% of the largest stress is left" in n.text for n in cut.notes)


@pytest.mark.parametrize(
    ("dead", "left", "place"),
    [
        ([], 0, ""),
        ([np.s_[-1]], 9, r"y from 4 to 4 mm"),
        ([np.s_[:2]], 18, r"y from -4 to -3 mm"),
        ([np.s_[:, -1]], 9, r"x from 4 to 4 mm"),
        ([np.s_[0], np.s_[:, 0]], 17, r"y from -4 to -4 mm(.|\n)*x from -4 to -4 mm"),
        ([np.s_[4]], 0, ""),
        ([np.s_[::8], np.s_[1, :4], np.s_[1, 6:]], 9, "y from 4 to 4 mm"),  # a signal that ends
        ([np.s_[-1, 2:]], 0, ""),
    ],
)
@pytest.mark.parametrize("passes", [1, 2])
def test_dead_rows_at_the_edge_of_a_raster_are_left_out_and_named(dead, left, place, passes):
    side = np.arange(-4.0, 5.0)
    x, y = np.meshgrid(side, side)
    u = np.random.default_rng(1).normal(np.exp(-(x**2 + y**2) / 8), 0.01)
    for rows_of_zeros in dead:
        u[rows_of_zeros] = 0.0
    columns = {"x": x, "y": y, "u": u, "r": np.zeros_like(x)}
    table = {name: np.tile(values.ravel(), passes) for name, values in columns.items()}
    table["r"] = np.repeat(np.arange(passes), u.size)
    found = imported(table, x="x", y="y", u="u", repeat="r", x_unit="mm", u_unit="mV")
    assert found.u_zz.size == passes * (u.size - left)
    assert re.search(place, found.notes)
    assert ("rows of zeros" in found.notes) is bool(left)


def test_a_typographic_minus_is_one_and_d_begins_a_power_of_ten():
    found = scan_table("x,u\n−1,1\n0,1D5\n1,2\n2,3\n", missing=["1d5"])
    assert found.x[0] == -1e-3
    assert np.isnan(found.u_zz).sum() == 1


TIMED = {"t (ms)": 1e12 + 125 * np.arange(4.0), "x (mm)": [1, 0, 0, 1], "n": [1, 1, 2, 2]}
TIMED |= {"U (mV)": np.arange(4.0), "back (s)": [0, 2, 1, 3]}


def test_times_stay_with_their_readings_and_make_positions_of_a_speed():
    moved = import_table(TIMED, u="U", time="t", layout=TableLayout(speed=-2e-3))
    np.testing.assert_allclose(moved.x, -0.25e-3 * np.arange(4), atol=1e-9)
    rows = import_table(TIMED, x="x", u="U", time="t", repeat="n")
    np.testing.assert_allclose(rows.time, [[0.125, 0], [0.25, 0.375]])
    np.testing.assert_allclose(rows.only_passes(1).time, [[0.25, 0.375]])


@pytest.mark.parametrize(
    ("named", "layout", "cure"),
    [
        ("time=t", {}, "--speed"),
        ("", {"speed": 1.0}, "--time"),
        ("time=t x=x", {"speed": 1.0}, "leave out"),
        ("time=t repeat=n", {"speed": 1.0}, "--repeat"),
        ("time=back", {"speed": 1.0}, "back in row 3"),
        ("time=n x=x", {}, "--time-unit"),
        ("", {"step": 1e-3}, "--x COLUMN"),
        ("x=x", {"step": 1e-3}, "dimensionless"),
    ],
)
def test_a_log_without_positions_is_refused_with_the_option_that_makes_them(named, layout, cure):
    columns = dict(text.split("=") for text in named.split())
    with pytest.raises(InputError, match=cure):
        import_table(TIMED, u="U", **columns, layout=TableLayout(**layout))


@pytest.mark.parametrize(
    ("unit", "ceiling", "sign", "left"),
    [("mV", 2.0, 1, 3), ("mV", 3.0, 1, 1), ("mV", 3.5, 1, 0), ("V", 2.0, 1, 3), ("mV", 2.0, -1, 3)],
)
def test_readings_at_the_ceiling_are_left_out_and_counted(unit, ceiling, sign, left):
    u = np.array([0.0, 1.0, 2.0, 3.0, 2.0, 1.9999, 0.0])
    layout = TableLayout(x_unit="mm", u_unit=unit, ceiling=ceiling, u_sign=sign)
    table = {"x": np.arange(7.0), "U": sign * u}
    scan = import_table(table, x="x", u="U", layout=layout)
    np.testing.assert_array_equal(np.isnan(scan.u_zz), u >= ceiling)
    are = "reading at the ceiling is" if left == 1 else "readings at the ceiling are"
    assert f"{left} {are} left out." in scan.notes
    assert scan.at_ceiling == left


@pytest.mark.parametrize("baseline", [None, "before-each"])
@pytest.mark.parametrize("stated", [True, False])
@pytest.mark.parametrize("ceiling", [3.5, 9.0])
@pytest.mark.parametrize("digit", [1e-9, 1e-3, 0.1])
def test_a_hold_of_which_a_row_is_at_the_ceiling_is_left_out(digit, ceiling, stated, baseline):
    """Rows at the largest reading tell the ceiling by themselves, where noise spreads others."""
    place = np.repeat(np.arange(5.0), 60)
    pressed = np.arange(300) % 60 >= 30
    noise = np.random.default_rng(1).normal(0, 3e-3, 300)
    # Less the reading before its press the fourth hold is above the ceiling, which it was not.
    u = pressed * np.array([1.0, 2.0, 4.0, 3.8, 1.0]).repeat(60) + noise - 0.5
    given = ceiling if stated else None
    layout = TableLayout(x_unit="mm", u_unit="mV", holds=True, ceiling=given, baseline=baseline)
    table = {"x": place, "U": np.minimum(np.round(u / digit) * digit, ceiling), "F": 1.0 * pressed}
    scan = import_table(table, x="x", u="U", load_column="F", layout=layout)
    left_out = ceiling == 3.5 and (stated or digit < 0.1)
    np.testing.assert_array_equal(np.isnan(scan.u_zz), (np.arange(5) == 2) & left_out)
    assert scan.at_ceiling == left_out
    assert ("a ceiling" in scan.notes) == (left_out and not stated)


# Forth, a turn without a direction, and back, at 2 mm/s.
SLID = {"U (mV)": np.arange(7.0), "way": ["Forth", "forth", "forth", "", "back", "back", "back"]}
MOVED = {"u": "U", "time": "t", "layout": TableLayout(speed=2e-3)}


@pytest.mark.parametrize(
    ("times", "x"),
    [
        ([0, 1, 2, 3, 4, 5, 6], [0, 2, 4, 0, 2, 4]),
        # From a reading forth to the turn half of the time is forth, of 2 s 2 mm.
        ([0, 1, np.nan, 3, 4, 5, 6], [0, 2, 3, 1, -1]),
    ],
)
def test_a_sliding_log_goes_back_where_it_turns_and_each_way_is_a_pass(times, x):
    scan = import_table({**SLID, "t (s)": times}, **MOVED, sliding="way")
    np.testing.assert_allclose(scan.positions[0].flat, 1e-3 * np.array(x), atol=1e-12)
    np.testing.assert_array_equal(scan.sliding_direction, 1 - 2 * scan.passes)
    assert (scan.motion, scan.speed) == ("sliding", 2e-3)


def test_one_direction_is_that_of_all_readings():
    scan = import_table({**SLID, "t (s)": np.arange(7.0)}, **MOVED, sliding="back")
    np.testing.assert_allclose(scan.x, -2e-3 * np.arange(7.0), atol=1e-12)
    given = Scan.from_arrays(scan.x, scan.u_zz, sliding="back", speed=1e-3)
    assert given.directions == scan.directions == ("back",)
    assert (given.kind, given.speed) == ("line", 1e-3)


@pytest.mark.parametrize(
    ("way", "words"), [(2, "has the direction 2"), ("up", "none of forth, back")]
)
def test_what_is_no_direction_is_refused(way, words):
    with pytest.raises(InputError, match=words):
        import_table({"U (mV)": [1], "t (s)": [0], "way": [way]}, **MOVED, sliding="way")


def test_rows_at_rest_are_left_out_of_a_sliding_log():
    ways = [1, 1, 1, 0, -1, -1, -1]
    scan = import_table({**SLID, "way": ways, "t (s)": np.arange(7.0)}, **MOVED, sliding="way")
    assert scan.sliding_direction.tolist() == [[1, 1, 1], [-1, -1, -1]]
    assert "no position or direction: row 4" in str(scan.notes)


@pytest.mark.parametrize(
    ("stated", "message"),
    [
        ({"sliding": "forth", "layout": TableLayout(holds=True)}, r"slides .* is not held"),
        ({"sliding": "forth", "conditions": ScanConditions(dwell_time=1.0)}, "is not held"),
        ({"tangential_load": "Q"}, "belongs to an indenter that slides"),
        ({"sliding": "way", "time": "t"}, "not in the order of time"),
    ],
)
def test_what_does_not_go_with_sliding_is_refused(stated, message):
    table = {
        "U (mV)": np.arange(4.0),
        "x (mm)": np.arange(4.0),
        "Q (N)": np.ones(4),
        "way": [1, -1, 1, -1],
        "t (s)": [0, 3, 1, 2],
    }
    with pytest.raises(InputError, match=message):
        import_table(table, u="U", x="x", **stated)
