"""Averaged repeats: what an outlier may do to them, and what honest noise must not suffer."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from builders import make_film
from hypothesis import given
from hypothesis import strategies as st

from memscal.errors import InputError
from memscal.formats.averaging import Average, average
from memscal.formats.table import ImportedScan, read_scan_table
from memscal.model.indenter import Rod

NOISE = 0.06
CHANCE = 0.01
"""Share of tables of Gaussian readings that may lose one: what the docstring promises."""


def imported(path: Path, columns: dict[str, Any], **options: Any) -> ImportedScan:
    """Import columns in mm and mV, averaged."""
    table = path / "table.csv"
    lines = [
        ",".join(columns),
        *(",".join(map(repr, row)) for row in zip(*columns.values(), strict=True)),
    ]
    table.write_text("\n".join(lines), encoding="utf-8")
    given = {"x_unit": "mm", "u_unit": "mV", "load": 1.0, "repeats": "average", **options}
    rod = Rod(radius=0.25e-3)
    return read_scan_table(table, x="x", u="u", film=make_film(), indenter=rod, **given)


def repeated_line(seed: int, *, jitter: float = 0.0) -> dict[str, Any]:
    """Three repeats of 33 places, 0.5 mm apart."""
    rng = np.random.default_rng(seed)
    places = np.tile(np.linspace(-8, 8, 33), 3)
    return {
        "n": np.repeat([1, 2, 3], 33).tolist(),
        "x": (places + jitter * rng.uniform(-1, 1, 99)).tolist(),
        "u": (12 * np.exp(-(places**2) / 2) + NOISE * rng.normal(size=99)).tolist(),
    }


def gaussian_tables(places: int, repeats: int, tables: int) -> tuple[list[Average], int]:
    place = np.tile(np.arange(places), repeats)
    rng = np.random.default_rng(places)
    readings = rng.normal(size=(tables, place.size))
    return [average(values, place, places) for values in readings], place.size - places


@pytest.mark.parametrize(("places", "repeats"), [(33, 3), (33, 2), (10, 5), (4, 4)])
def test_without_outliers_the_pooled_spread_is_unbiased(places: int, repeats: int) -> None:
    """The plain s^2 is unbiased, with a relative variance of 2/f for f degrees of freedom.

    Where one reading is lost, s^2 falls by t^2/f at most, t the deviation that is allowed at most
    (below 9 for these sizes); that happens to one table in a hundred.
    """
    tables = 1000
    found, freedom = gaussian_tables(places, repeats, tables)
    variance = np.mean([one.spread**2 for one in found])
    bias = CHANCE * 9**2 / freedom
    assert abs(variance - 1) < bias + 5 * np.sqrt(2 / freedom / tables)


@pytest.mark.parametrize(("places", "repeats"), [(33, 3), (33, 2), (10, 5), (4, 4), (2, 3)])
def test_tables_of_gaussian_readings_are_left_alone(places: int, repeats: int) -> None:
    tables = 1000
    found, _ = gaussian_tables(places, repeats, tables)
    touched = sum(bool((~one.kept).any() or one.disagreeing.any()) for one in found)
    assert touched < CHANCE * tables + 5 * np.sqrt(CHANCE * tables)


@given(seed=st.integers(0, 2**32 - 1), size=st.floats(1.0, 1e6), victim=st.integers(0, 98))
def test_an_outlier_moves_neither_its_mean_nor_the_spread(
    seed: int, size: float, victim: int
) -> None:
    """One of three readings is off by 100 standard deviations or more."""
    rng = np.random.default_rng(seed)
    place = np.tile(np.arange(33), 3)
    clean = rng.normal(size=99)
    spoilt = clean.copy()
    spoilt[victim] += 100.0 * size
    found = average(spoilt, place, 33)
    assert not found.kept[victim]
    rest = np.where(found.kept, clean, np.nan).reshape(3, 33)
    np.testing.assert_allclose(found.mean, np.nanmean(rest, axis=0), rtol=1e-12)
    assert found.errors is not None
    assert found.errors[place[victim]] == pytest.approx(found.spread / np.sqrt(2))
    # Chi-square with 65 degrees of freedom lies within these limits but for 1e-7 of all tables.
    assert 0.5 < found.spread < 1.6


def test_a_tenth_of_outliers_leaves_the_spread() -> None:
    rng = np.random.default_rng(3)
    place = np.tile(np.arange(200), 5)
    values = rng.normal(size=1000)
    bad = rng.choice(200, 100, replace=False)
    values[bad] += 50.0
    found = average(values, place, 200)
    np.testing.assert_array_equal(np.flatnonzero(~found.kept), np.sort(bad))
    assert found.freedom == 700
    assert found.spread == pytest.approx(1.0, abs=5 / np.sqrt(2 * 700))


def test_a_pair_that_disagrees_is_averaged_with_its_own_spread() -> None:
    rng = np.random.default_rng(4)
    values = np.concatenate([rng.normal(size=60), [0.0, 200.0]])
    place = np.concatenate([np.tile(np.arange(30), 2), [30, 30]])
    found = average(values, place, 31)
    assert found.kept.all()
    assert np.flatnonzero(found.disagreeing).tolist() == [30]
    assert found.errors is not None
    assert (found.mean[30], found.errors[30]) == (100.0, pytest.approx(100.0))
    assert found.spread == pytest.approx(1.0, abs=5 / np.sqrt(60))


def test_the_minority_of_a_place_never_outvotes_the_majority() -> None:
    rng = np.random.default_rng(5)
    split = [0.0, 0.0, 900.0, 900.0]
    values = np.concatenate([rng.normal(size=80), split])
    place = np.concatenate([np.tile(np.arange(20), 4), np.full(4, 20)])
    found = average(values, place, 21)
    assert found.kept.all()
    assert found.disagreeing[20]
    assert found.mean[20] == 450.0


def test_noise_that_grows_with_the_signal_is_not_taken_for_outliers() -> None:
    """On the flanks the noise is ten times that of the tail, where most places are."""
    place = np.tile(np.arange(60), 3)
    signal = np.where(place < 12, 1000.0, 0.0)
    tables, touched = 300, 0
    rng = np.random.default_rng(6)
    for _ in range(tables):
        noise = rng.normal(size=place.size) * np.where(signal > 0, 10.0, 1.0)
        touched += not average(signal + noise, place, 60).kept.all()
    # Two readings in a hundred would go in every table if one spread served all places.
    assert touched < 0.1 * tables


def test_steps_of_the_converter_are_not_outliers() -> None:
    """Where most repeats give the same code, a reading one code further is no outlier."""
    place = np.tile(np.arange(40), 5)
    values = place * 7.0
    values[[3, 50, 121]] += 1.0
    found = average(values, place, 40)
    assert found.kept.all()


def test_an_outlier_is_reported_by_place_value_and_repeat(tmp_path: Path) -> None:
    columns = repeated_line(1)
    columns["u"][70] += 5.0  # x = -6 mm of the third repeat
    found = imported(tmp_path, columns, repeat="n")
    (note,) = [note for note in found.notes if "left out" in note.text]
    assert f"{columns['u'][70]:.4g} mV at x = -6 mm, repeat 3" in note.text
    assert note.text in found.scan.notes
    others = np.mean([columns["u"][4], columns["u"][37]]) * 1e-3
    assert found.scan.u_zz[4] == pytest.approx(others, rel=1e-12)
    assert found.scan.u_zz_errors is not None
    # 65 degrees of freedom: five standard deviations of s are 44 %.
    expected = NOISE * 1e-3 / np.sqrt(np.where(np.arange(33) == 4, 2, 3))
    np.testing.assert_allclose(found.scan.u_zz_errors, expected, rtol=0.44)


def test_the_load_of_a_reading_that_is_left_out_is_left_out_too(tmp_path: Path) -> None:
    columns = repeated_line(1)
    columns["u"][70] += 5.0
    columns["f"] = [1.0] * 99
    columns["f"][70] = 1.6
    found = imported(tmp_path, columns, repeat="n", load_column="f")
    assert found.scan.normal_load is not None
    np.testing.assert_array_equal(found.scan.normal_load, 1.0)


def test_readings_that_do_not_repeat_at_all_are_warned_of(tmp_path: Path) -> None:
    columns = repeated_line(2)
    for i in range(0, 33, 2):  # every second place of the first repeat
        columns["u"][i] += 3.0
    found = imported(tmp_path, columns, repeat="n")
    assert any("noise is not one and the same" in note.text for note in found.notes)


@pytest.mark.parametrize("numbered", [True, False])
def test_the_step_of_jittered_places_is_that_of_their_lattice(
    tmp_path: Path, numbered: bool
) -> None:
    columns = repeated_line(1, jitter=0.003)
    found = imported(tmp_path, columns, repeat="n" if numbered else None)
    assert found.scan.u_zz.shape == (33,)
    assert any("33 places, 0.5 mm apart" in note.text for note in found.notes)


def test_uneven_places_are_reported_by_their_range(tmp_path: Path) -> None:
    x = [-4.0, -1.0, -0.5, 0.0, 0.5, 1.0, 4.0] * 2
    found = imported(tmp_path, {"x": x, "u": [1.0] * 14})
    assert any("7 places, 0.5 to 3 mm apart" in note.text for note in found.notes)


def test_a_line_that_is_dense_in_the_middle_keeps_its_places(tmp_path: Path) -> None:
    """0.1 mm is a tenth of the usual spacing, but not the jitter of one place."""
    x = np.concatenate([np.arange(-10.0, 0), np.arange(0, 1.05, 0.1), np.arange(2.0, 12)])
    columns = {"n": [1] * x.size + [2] * x.size, "x": [*x, *(x + 0.001)], "u": [1.0] * 2 * x.size}
    columns["x"] = [float(v) for v in columns["x"]]
    for options in ({"repeat": "n"}, {}):
        found = imported(tmp_path, columns, grid_tolerance=0.06, **options)
        np.testing.assert_allclose(found.scan.x, (x + 0.0005) * 1e-3, atol=1e-9)


def test_two_readings_of_a_position_in_one_repeat_are_averaged_and_noted(tmp_path: Path) -> None:
    columns = {"n": [1, 1, 1, 1, 2, 2, 2], "x": [0, 1, 1, 2, 0, 1.001, 2]}
    columns["u"] = [1.0, 2.0, 2.2, 3.0, 1.2, 2.4, 3.2]
    found = imported(tmp_path, columns, repeat="n")
    np.testing.assert_allclose(found.scan.u_zz, [1.1e-3, 2.2e-3, 3.1e-3], rtol=1e-12)
    assert any("1 readings share their place" in note.text for note in found.notes)
    with pytest.raises(InputError, match="--repeats average"):
        imported(tmp_path, columns, repeat="n", repeats="keep")


def test_a_line_whose_positions_cluster_is_told_of_its_repeats(tmp_path: Path) -> None:
    columns = repeated_line(1, jitter=0.003)
    found = imported(tmp_path, columns, repeats="keep")
    assert found.scan.kind == "line"
    (note,) = [note for note in found.notes if "--repeat COLUMN" in note.text]
    assert "66 of 99 positions" in note.text


@given(seed=st.integers(0, 2**16), spread=st.floats(0.0, 0.4))
def test_a_single_line_is_not_told_of_repeats(
    tmp_path_factory: pytest.TempPathFactory, seed: int, spread: float
) -> None:
    rng = np.random.default_rng(seed)
    x = np.arange(33.0) + spread * rng.uniform(-1, 1, 33)
    columns = {"x": rng.permutation(x).tolist(), "u": [1.0] * 33}
    found = imported(tmp_path_factory.mktemp("t"), columns, repeats="keep")
    assert not any("--repeat COLUMN" in note.text for note in found.notes)


def test_what_the_table_says_at_its_head_travels_with_the_scan(tmp_path: Path) -> None:
    table = tmp_path / "table.csv"
    head = "# SYNTHETIC: made up\x1b[2J\n%  rod 3\n#\n" + "# " + "z" * 5000 + "\n" + "# more\n" * 40
    table.write_text(head + "x,u\n0,1\n# within the table\n1,2\n", encoding="utf-8")
    found = read_scan_table(
        table, x="x", u="u", x_unit="mm", u_unit="mV", load=1.0,
        film=make_film(), indenter=Rod(radius=0.25e-3),
    )  # fmt: skip
    lines = found.scan.notes.splitlines()
    assert "The table says: SYNTHETIC: made up[2J" in lines
    assert "The table says: rod 3" in lines
    assert "24 more lines of comment were left out." in lines
    assert "within the table" not in found.scan.notes
    assert max(map(len, lines)) < 400
