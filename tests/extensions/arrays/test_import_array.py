"""A table of an array: a column for each sensor, and a table of where they are."""

from pathlib import Path

import numpy as np
import pytest

import memscal
from memscal import ScanConditions, TableLayout, import_table, read_scan
from memscal.errors import InputError

TABLE = "x [mm],u_A [mV],u_C [V],u_B [mV],U2 [mV]\n-1,1,0.002,,9\n0,3,0.001,,9\n1,2,0.003,,9\n"
LAYOUT = """sensor,x [mm],y [mm],x_errors [um],y_errors [um]
u_B,0,0.5,10,1
u_A,-4,0,20,2
u_C,4,0,30,3
"""
PLACED = ScanConditions(layout="layout.csv")


@pytest.fixture(autouse=True)
def _tables(folder):
    """Write a row of three sensors, of which one is in V and one reads nothing."""
    Path("row.csv").write_text(TABLE)
    Path("layout.csv").write_text(LAYOUT)


def test_columns_become_sensors_in_their_order_with_their_places(run):
    words = "import row.csv -o scan.h5 --x x --u u_* --layout layout.csv --ceiling 2.5"
    run(*words.split()).exits(0)
    scan = read_scan("scan.h5")
    assert scan.sensors == ("u_A", "u_C", "u_B")
    nothing = np.full(3, np.nan)
    np.testing.assert_allclose(scan.u_zz, [[1e-3, 3e-3, 2e-3], [2e-3, 1e-3, 3e-3], nothing])
    np.testing.assert_allclose(scan.layout, [[-4e-3, 0], [4e-3, 0], [0, 5e-4]])
    np.testing.assert_allclose(scan.layout_uncertainty, [[2e-5, 2e-6], [3e-5, 3e-6], [1e-5, 1e-6]])
    np.testing.assert_allclose(scan.reading_high, 2.5e-3)
    assert "2 readings at the ceiling are left out" in scan.notes
    assert "Read from layout.csv (SHA-256 " in scan.notes
    run(*words.replace("2.5", "0.001").replace("scan", "all").split()).exits(3, "All 6 readings")
    words = "import row.csv -o two.h5 --x x --u u_C --u u_A --u-sign -1"
    run(*words.split()).exits(0)
    two = read_scan("two.h5")
    assert two.sensors == ("u_C", "u_A")
    np.testing.assert_array_equal(two.u_zz, -scan.u_zz[[1, 0]])
    assert import_table("row.csv", x="x", u="*_C").sensors == ()


@pytest.mark.parametrize(
    ("u", "layout", "words"),
    [
        (["u_A", "u_*"], LAYOUT, "u_A, u_A"),
        (["u_A", "v*"], LAYOUT, "'v.*'"),
        ("u_*", LAYOUT.replace("u_B,", "u_A,"), "3 rows for 3 sensors, .* exactly once: u_A, u_B"),
        ("u_*", LAYOUT.replace("u_B,", "u_D,"), "none of u_a, u_c, u_b, in line 2 .'u_D'"),
        ("u_*", LAYOUT.replace("u_A,", "0,"), "exactly once: u_A"),
        ("u_*", LAYOUT.replace("x [mm]", "x"), "no unit .*\n.*one head .sensor, 'x"),
        ("u_*", LAYOUT.replace("-4,", ","), "column .x. is empty in line 3"),
        ("u_A", LAYOUT, "scan states layout, board or range, but names no sensors"),
    ],
)
def test_what_is_no_array_or_not_its_layout_is_refused(u, layout, words):
    Path("layout.csv").write_text(layout)
    with pytest.raises(InputError, match=words):
        import_table("row.csv", x="x", u=u, conditions=PLACED)


def test_all_other_columns_are_sensors_and_their_numbers_are_matched_as_numbers():
    Path("layout.csv").write_text("sensor,x [mm],y [mm],board\n10,4,0,2\n2,1,0,1\n")
    table = {"x [mm]": [0, 1], "2 [mV]": [0, 1], "10 [mV]": [1, 0]}
    scan = import_table(table, x="x", u="*", conditions=PLACED)
    assert scan.sensors == ("2", "10")
    np.testing.assert_array_equal(scan.board, [1, 2])
    np.testing.assert_allclose(scan.layout[:, 0], [1e-3, 4e-3])


def test_holds_are_found_where_any_sensor_feels_the_press(seed):
    # Of each place ten rows lifted, twenty pressed: at either end two sensors read nothing.
    places = np.linspace(-9, 9, 19)
    pressed = np.tile(np.repeat([0.0, 1.0], [10, 20]), 19)
    log = {"x": np.repeat(places, 30)}
    rng = np.random.default_rng(seed)
    for centre, noise in ((-6, 4e-3), (0, 2e-3), (6, 1e-3)):
        signal = 3 * np.exp(-((log["x"] - centre) ** 2) / 8)
        log[f"u{centre}"] = pressed * signal + noise * rng.standard_normal(pressed.size)
    log["u9"] = np.full(pressed.size, np.nan)
    layout = TableLayout(x_unit="mm", u_unit="mV", holds=True)
    scan = import_table(log, x="x", u="u*", layout=layout)
    expected = 3e-3 * np.exp(-((places - 6) ** 2) / 8)
    # Means of ten rows or more: within six standard errors.
    np.testing.assert_allclose(scan.u_zz[2], expected, atol=6e-6 / 10**0.5)
    # Of twenty rows or fewer, which scatter by 4, 2 and 1 uV.
    of_means = 1e-6 * np.array([4, 2, 1]) / 20**0.5
    np.testing.assert_allclose(np.median(scan.u_zz_errors[:3], axis=1), of_means, rtol=0.4)
    assert np.isnan(scan.u_zz[3]).all()
    assert "Standard uncertainty of each reading: not stated" not in scan.notes


def test_a_long_array_is_held_against_the_width_of_one_sensor():
    # Together its sensors read over 60 mm, 30 thicknesses: no single sensor is so wide.
    x = np.linspace(-40, 40, 321)
    table = {f"s{i} [mV]": np.exp(-((x - i) ** 2) / 2.88) for i in range(-30, 31, 4)}
    film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    conditions = ScanConditions(film=film, indenter=memscal.Rod(radius=0.25e-3), load=1.0)
    scan = import_table({"x [mm]": x, **table}, x="x", u="s*", conditions=conditions)
    assert len(scan.sensors) == 16
