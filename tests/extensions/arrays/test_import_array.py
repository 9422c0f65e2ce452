"""A table of an array: a column for each sensor, and a table of where they are."""

from pathlib import Path

import numpy as np
import pytest

import memscal
from memscal import ScanConditions, TableLayout, import_table, read_scan
from memscal.errors import InputError

X = np.linspace(-12, 12, 97)
PEAKS = {"u_A": -4, "u_C": 4, "u_B": 0}
FILM = "--load 1 --radius 0.25 --young-modulus 2.2 --poisson-ratio 0.5 --thickness 2"


def signal(centre, x=X):
    return 3 * np.exp(-((x - centre) ** 2) / 2.88)


def write(path, **columns):
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(str, row)) for row in rows)]
    Path(path).write_text("\n".join([*lines, ""]), encoding="utf-8")


@pytest.fixture
def row(folder):
    """A row of three sensors, of which one is in V and one reads nothing."""
    values = {name: signal(centre) for name, centre in PEAKS.items()}
    values |= {"u_C": values["u_C"] / 1000, "u_B": np.full(97, "")}
    units = {"u_A": "mV", "u_C": "V", "u_B": "mV"}
    columns = {f"{name} [{units[name]}]": values[name] for name in PEAKS}
    write("row.csv", **{"x [mm]": X, **columns, "U2 [mV]": X})
    layout = {"sensor": ["u_B", "u_A", "u_C"], "x [mm]": [0, -4, 4], "y [mm]": [0.5, 0, 0]}
    write("layout.csv", **layout, **{"x_errors [um]": [10, 20, 30], "y_errors [um]": [1, 2, 3]})
    return "row.csv"


def test_columns_become_sensors_in_their_order_with_their_places(row, run):
    words = ("--x", "x", "--u", "u_*", "--layout", "layout.csv", "--ceiling", "2.5", *FILM.split())
    run("import", row, "-o", "scan.h5", *words).exits(0)
    scan = read_scan("scan.h5")
    assert scan.sensors == ("u_A", "u_C", "u_B")
    np.testing.assert_allclose(scan.u_zz[:2] * 1e3, [signal(-4), signal(4)], rtol=1e-9)
    assert np.isnan(scan.u_zz[2]).all()
    np.testing.assert_allclose(scan.layout * 1e3, [[-4, 0], [4, 0], [0, 0.5]])
    np.testing.assert_allclose(scan.layout_uncertainty * 1e6, [[20, 2], [30, 3], [10, 1]])
    np.testing.assert_allclose(scan.reading_high, 2.5e-3)
    run("import", row, "-o", "two.h5", "--x", "x", "--u", "u_C", "--u", "u_A").exits(0)
    two = read_scan("two.h5")
    assert two.sensors == ("u_C", "u_A")
    np.testing.assert_array_equal(two.u_zz, scan.u_zz[[1, 0]])


def test_one_column_is_a_single_sensor(row):
    single = import_table(row, x="x", u=["u_C"])
    assert single.sensors == ()
    np.testing.assert_array_equal(single.u_zz, import_table(row, x="x", u="*_C").u_zz)


@pytest.mark.parametrize(
    ("u", "words"),
    [
        (["u_A", "u_*"], "u_A, u_A"),
        (["u_A", "v_*"], r"no column 'v_\*'"),
        (["u_A", "u_D"], "no column 'u_D'"),
    ],
)
def test_columns_that_name_no_array_are_refused(row, u, words):
    with pytest.raises(InputError, match=words):
        import_table(row, x="x", u=u)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"sensor": ["u_A", "u_A", "u_C"]}, "exactly once"),
        ({"sensor": ["u_A", "u_B", "u_D"]}, "'u_D'"),
        ({"x": [0, 1, 2]}, "no unit"),
        ({"x [kg]": [0, 1, 2]}, "kg"),
        ({"x [mm]": [0, 1, "nan"]}, "finite"),
    ],
)
def test_a_layout_that_does_not_fit_is_refused(row, change, words):
    table = {"sensor": ["u_A", "u_B", "u_C"], "x [mm]": [0, 1, 2], "y [mm]": [0, 0, 0]}
    if {"x", "x [kg]"} & change.keys():
        del table["x [mm]"]
    conditions = ScanConditions(layout={**table, **change})
    with pytest.raises(InputError, match=words):
        import_table(row, x="x", u="u_*", conditions=conditions)
    with pytest.raises(InputError, match="single sensor has no layout"):
        import_table(row, x="x", u="u_A", conditions=conditions)


def test_names_that_are_numbers_are_matched_as_numbers(folder):
    write("row.csv", **{"x [mm]": X, "2 [mV]": signal(0), "10 [mV]": signal(4)})
    write("layout.csv", **{"sensor": [10, 2], "x [mm]": [4, 0], "y [mm]": [0, 0]})
    conditions = ScanConditions(layout="layout.csv")
    scan = import_table("row.csv", x="x", u=["2", "10"], conditions=conditions)
    assert scan.sensors == ("2", "10")
    np.testing.assert_allclose(scan.layout[:, 0], [0, 4e-3])


def test_holds_are_found_where_any_sensor_feels_the_press(seed):
    # Of each place ten rows lifted, twenty pressed: at either end one sensor reads nothing.
    places = np.linspace(-9, 9, 19)
    x = np.repeat(places, 30)
    pressed = np.tile(np.repeat([0.0, 1.0], [10, 20]), places.size)
    rng = np.random.default_rng(seed)
    log = {"x": x}
    for name, centre in (("a", -5), ("b", 0), ("c", 5)):
        noise = 1e-3 * rng.standard_normal(x.size)
        log[name] = pressed * 3 * np.exp(-((x - centre) ** 2) / 8) + noise
    layout = TableLayout(x_unit="mm", u_unit="mV", holds=True)
    scan = import_table(log, x="x", u=["a", "b", "c"], layout=layout)
    assert scan.u_zz.shape == (3, 19)
    expected = 3 * np.exp(-((places - 5) ** 2) / 8)
    # Means of up to twenty rows: within five standard errors of the mean.
    np.testing.assert_allclose(1e3 * scan.u_zz[2], expected, atol=5e-3 / np.sqrt(10))
    assert scan.u_zz_errors is None


def test_a_long_array_is_held_against_the_width_of_one_sensor(folder):
    # Together its sensors read over 60 mm, 30 thicknesses: no single sensor is so wide.
    x = np.linspace(-40, 40, 321)
    centres = np.arange(-30, 31, 4)
    table = {f"s{i} [mV]": signal(centre, x) for i, centre in enumerate(centres)}
    film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    conditions = ScanConditions(film=film, indenter=memscal.Rod(radius=0.25e-3), load=1.0)
    scan = import_table({"x [mm]": x, **table}, x="x", u="s*", conditions=conditions)
    assert len(scan.sensors) == 16
