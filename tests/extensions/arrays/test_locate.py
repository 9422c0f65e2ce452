"""Contacts on arrays, against readings of an independent layer; what is left out; the command."""

import csv
import json
from dataclasses import replace

import numpy as np
import openpyxl
import pytest
from helpers.arrays import FILM, ROD, known_array
from helpers.bounds import root_mean_square
from helpers.outside import FILM as TRUE_FILM
from helpers.schemas import faults
from helpers.true_arrays import TrueArray

import memscal
from memscal.extensions.arrays.frames import read_frames

RATE = 100
LINEAR = replace(FILM, law="linear")
SPHERE = memscal.Sphere(radius=5e-3)


def array_and_truth(rows, columns, **known):
    """An array of which everything is known, and what reads as it does."""
    array = replace(known_array(rows, columns, **known), film=LINEAR)
    true = TrueArray(
        centres=array.places,
        conversion_constants=array.conversion_constants,
        crosstalk=array.crosstalk,
        thickness=TRUE_FILM.thickness,
    )
    return array, true


ROW, TRUE_ROW = array_and_truth(1, 6, noise=1e-3)
GRID, TRUE_GRID = array_and_truth(4, 4, noise=1e-3)
ARRAYS = pytest.mark.parametrize(
    ("array", "true"), [(ROW, TRUE_ROW), (GRID, TRUE_GRID)], ids=["row", "grid"]
)


def drawn(array, rng, count=40):
    """Places among the sensors, and forces."""
    inside = np.abs(array.places).max(axis=0)
    return rng.uniform(-1, 1, (count, 2)) * inside, np.exp(rng.uniform(-0.7, 0.7, count))


def noise_of(array, rng, count):
    return rng.multivariate_normal(np.zeros(len(array.sensors)), array.noise, count)


@ARRAYS
@pytest.mark.parametrize("indenter", [None, ROD, SPHERE])
def test_without_noise_contacts_are_where_they_press(array, true, indenter, seed):
    places, forces = drawn(array, np.random.default_rng(seed), 12)
    u = true.readings(places, forces, indenter=indenter)
    found = array.locate(u, indenter=indenter or "point", shear=0.0)
    np.testing.assert_allclose(found.x, places[:, 0], atol=8e-6)
    np.testing.assert_allclose(found.y, places[:, 1], atol=8e-6)
    np.testing.assert_allclose(found.force, forces, rtol=3e-3)
    assert set(found.flags) == {""}


@ARRAYS
def test_stated_uncertainties_hold_with_shear_in_the_truth(array, true, seed):
    rng = np.random.default_rng(seed)
    count = 200
    places, forces = drawn(array, rng, count)
    shears = 0.3 * forces[:, None] * rng.normal(size=(count, 2))
    u = true.readings(places, forces, shears=shears) + noise_of(array, rng, count)
    found = array.locate(u, indenter=ROD)
    z = (np.stack([found.x, found.force]) - [places[:, 0], forces]).T / found.uncertainties[:, ::2]
    # The rms of 200 normal numbers lies within 0.05; linearisation and the tails add to that.
    rms = root_mean_square(z)
    assert np.all((rms > 0.8) & (rms < 1.25))
    # p-values are even: their mean over 200 frames lies within 0.29 / sqrt(200) of a half.
    assert abs(found.p_value.mean() - 0.5) < 4 * 0.0204


def test_the_bound_is_that_of_the_derivatives_of_what_is_predicted():
    """The inverse of J^T N^-1 J, J by differences of the predicted readings."""
    place = np.array([0.7e-3, -0.4e-3])
    steps = np.array([1e-5, 1e-5, 1e-3])
    columns = []
    for i in range(3):
        ahead = steps * np.eye(3)[i]
        more, less = (
            GRID.predict(place + sign * ahead[:2], 0.8 + sign * ahead[2]) for sign in (1, -1)
        )
        columns.append((more - less)[0] / (2 * steps[i]))
    jacobian = np.stack(columns, axis=1)
    expected = np.linalg.inv(jacobian.T @ np.linalg.inv(GRID.noise) @ jacobian)
    [found] = GRID.bound(place, 0.8, shear=0.0)
    scale = np.sqrt(np.outer(np.diag(expected), np.diag(expected)))
    np.testing.assert_allclose(found / scale, expected / scale, atol=5e-3)


def test_of_a_row_y_is_that_of_the_row_and_not_known():
    found = ROW.locate(TRUE_ROW.readings(np.array([[1e-3, 0.0]]), 1.0))
    assert found.y[0] == ROW.line_y
    assert np.isnan(found.covariance[0, 1]).all()
    assert np.isnan(found.covariance[0, :, 1]).all()
    assert np.isfinite(found.covariance[0][np.ix_([0, 2], [0, 2])]).all()
    assert "on the line of the row" in found.assumed
    assert "row" not in GRID.locate(TRUE_GRID.readings(np.zeros((1, 2)), 1.0)).assumed


def turned(array, degrees):
    """The same array turned about the origin, with known x and y of each sensor."""
    angle = np.deg2rad(degrees)
    axes = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return replace(array, centres=array.places @ axes)


@pytest.mark.parametrize(("count", "degrees"), [(6, 45.0), (6, 2.0), (6, 88.0), (2, -30.0)])
def test_a_row_along_neither_x_nor_y_is_refused(count, degrees):
    """Of it neither x nor y were known: places were 1.2 mm wrong, and forces by factors."""
    straight = known_array(1, count)
    array = turned(straight, degrees)
    at_rest = np.zeros((1, count))
    for work in (
        lambda: array.locate(at_rest),
        lambda: array.stream(RATE),
        lambda: array.bound(at_rest[:, :2]),
    ):
        with pytest.raises(memscal.MemscalError, match=f"row at {degrees:g} degrees to x"):
            work()
    middle = [[0.0, 0.0]]
    np.testing.assert_allclose(array.predict(middle), straight.predict(middle), rtol=1e-6)


@pytest.mark.parametrize(("degrees", "told"), [(0.5, 0), (89.5, 1)])
def test_a_row_nearly_along_an_axis_tells_the_place_along_it(degrees, told):
    array = turned(ROW, degrees)
    place = array.centres[2] + 0.5 * (array.centres[3] - array.centres[2])
    found = array.locate(array.predict([place]), shear=0.0)
    assert found.flags == ("",)
    at = np.array([found.x[0], found.y[0]])
    np.testing.assert_allclose(at, place, atol=0.05e-3)
    assert np.flatnonzero(np.isfinite(found.uncertainties[0, :2])).tolist() == [told]


def test_a_missing_frame_changes_no_other_one(seed):
    rng = np.random.default_rng(seed)
    places, forces = drawn(GRID, rng, 9)
    u = TRUE_GRID.readings(places, forces) + noise_of(GRID, rng, 9)
    alone = GRID.locate(u)
    found = GRID.locate(np.insert(u, 4, np.nan, axis=0))
    assert found.flags[4] == "no reading"
    for name in ("x", "y", "force", "covariance"):
        assert np.isnan(getattr(found, name)[4]).all()
    for name in ("x", "y", "force", "shear", "covariance", "p_value"):
        np.testing.assert_array_equal(
            np.delete(getattr(found, name), 4, axis=0), getattr(alone, name)
        )


def test_missing_readings_and_unused_sensors_are_left_out(seed):
    rng = np.random.default_rng(seed)
    places, forces = drawn(GRID, rng, 20)
    u = TRUE_GRID.readings(places, forces)
    missing = u.copy()
    missing[np.arange(20), rng.integers(0, 16, 20)] = np.nan
    used = np.arange(16) != 5
    dead = replace(
        GRID, used=used, conversion_constants=np.where(used, GRID.conversion_constants, np.nan)
    )
    silent = replace(TRUE_GRID, conversion_constants=used * TRUE_GRID.conversion_constants)
    wrong = silent.readings(places, forces)
    wrong[:, 5] = 1.0
    for found in (
        GRID.locate(missing, indenter=ROD, shear=0.0),
        dead.locate(wrong, indenter=ROD, shear=0.0),
    ):
        np.testing.assert_allclose(found.x, places[:, 0], atol=1e-5)
        np.testing.assert_allclose(found.force, forces, rtol=5e-3)
    assert GRID.locate(np.full((1, 16), np.nan)).flags == ("no reading",)
    few = np.full((1, 16), np.nan)
    few[0, :2] = u[0, :2]
    assert GRID.locate(few).flags == ("too few readings",)


def test_readings_at_a_ceiling_are_left_out_and_said():
    u = TRUE_GRID.readings(np.array([[0.3e-3, 0.2e-3]]), 1.0)
    limited = replace(GRID, reading_high=np.full(16, 0.5 * u.max()))
    clipped = np.minimum(u, 0.5 * u.max())
    found = limited.locate(clipped, indenter=ROD, shear=0.0)
    assert found.flags == ("saturated",)
    assert found.x[0] == pytest.approx(0.3e-3, abs=2e-5)
    as_read = GRID.locate(clipped, indenter=ROD, shear=0.0)
    assert abs(as_read.force[0] - 1) > 0.1
    # Also where the frames are tared, and the ceiling is on the scale of the scan.
    raised = replace(limited, baselines=np.full(16, 1e-3), reading_high=limited.reading_high + 1e-3)
    assert raised.locate(clipped, indenter=ROD, shear=0.0).flags == ("saturated",)


def test_a_dead_sensor_at_its_end_is_not_said():
    """It would be said of every frame."""
    array = replace(GRID, used=np.arange(16) != 5, reading_high=np.full(16, 1.0))
    u = TRUE_GRID.readings(np.array([[0.3e-3, 0.2e-3]]), 1.0)
    u[0, 5] = 1.0
    assert "saturated" not in array.locate(u).flags[0]


def test_readings_at_rest_are_subtracted_and_their_scatter_is_counted(seed):
    rng = np.random.default_rng(seed)
    offset = 1e-3 * rng.normal(size=16)
    u = TRUE_GRID.readings(np.array([[1e-3, 0.5e-3]]), 1.0) + noise_of(GRID, rng, 1)
    plain = GRID.locate(u, indenter=ROD, shear=0.0)
    rest = offset + noise_of(GRID, rng, 1000)
    many = GRID.locate(u + offset, indenter=ROD, shear=0.0, rest=rest)
    assert many.x[0] == pytest.approx(plain.x[0], abs=1e-6)
    assert many.uncertainties[0, 0] == pytest.approx(plain.uncertainties[0, 0], rel=0.01)
    # The variance of their mean is that of the frame itself, over how many they are: of 2 frames
    # their own scatter tells it in one direction of 16, which is nearly left out.
    for count in (1, 2, 4):
        few = GRID.locate(u + offset, indenter=ROD, shear=0.0, rest=rest[:count])
        expected = (1 + 1 / count) ** 0.5 * plain.uncertainties[0, 0]
        assert 0.96 * expected < few.uncertainties[0, 0] < 1.25 * expected
    # Where the rest is noisier than the scan, so is the mean.
    noisy = GRID.locate(u, indenter=ROD, shear=0.0, rest=10 * (rest[:2] - offset))
    assert noisy.uncertainties[0, 0] > 4 * plain.uncertainties[0, 0]


def test_missing_readings_at_rest_make_the_mean_less_sure(seed):
    rest = noise_of(GRID, np.random.default_rng(seed), 400)
    u = TRUE_GRID.readings(np.array([[1e-3, 0.5e-3]]), 1.0)
    rest[4:] = np.nan
    found, few = (GRID.locate(u, shear=0.0, rest=part) for part in (rest, rest[:4]))
    np.testing.assert_allclose(found.uncertainties, few.uncertainties)


def test_noise_alone_is_no_contact(seed):
    found = GRID.locate(noise_of(GRID, np.random.default_rng(seed), 1000))
    # Five standard deviations at some 50 independent places: 1.4e-5 a frame.
    assert found.flags.count("no contact") >= 998
    quiet = np.array([flag == "no contact" for flag in found.flags])
    assert np.isnan(found.x[quiet]).all()


def test_a_contact_outside_is_at_the_edge():
    places = np.array([[5.5e-3, 0.0], [3.5e-3, 0.0]])
    found = GRID.locate(TRUE_GRID.readings(places, 5.0), indenter=ROD, shear=0.0)
    np.testing.assert_allclose(found.x, places[:, 0], atol=0.1e-3)
    assert ["edge" in flag for flag in found.flags] == [True, False]


@pytest.mark.parametrize(("shear", "exact"), [(0.0, 1.0), (0.3, 0.9)])
def test_a_contact_among_four_sensors_is_found_among_them(shear, exact, seed):
    """Far outside a force of 200 N fits as well as a node of the grid beside the place.

    Four readings do not determine place, force and shear: by chance another place fits as well.
    """
    four = replace(known_array(2, 2, noise=1e-3), film=LINEAR)
    places = np.random.default_rng(seed).uniform(-0.9e-3, 0.9e-3, (60, 2))
    found = four.locate(four.predict(places, 1.0), shear=shear)
    away = np.hypot(found.x - places[:, 0], found.y - places[:, 1])
    assert away.max() < 1e-3
    assert np.mean((away < 1.5e-5) & (abs(found.force - 1) < 1e-3)) >= exact


def test_what_is_unflagged_outside_of_the_sensors_holds(seed):
    """By little signal a weak contact inside and a strong one outside look alike."""
    noisy = replace(GRID, noise=100 * GRID.noise)
    rng = np.random.default_rng(seed)
    places = np.stack([rng.uniform(3.5e-3, 9e-3, 300), rng.uniform(-3e-3, 3e-3, 300)], axis=1)
    forces = np.exp(rng.uniform(-1, 3, 300))
    u = noisy.predict(places, forces) + noise_of(noisy, rng, 300)
    found = noisy.locate(u, shear=0.0)
    bad = abs(found.x - places[:, 0]) > 4 * found.uncertainties[:, 0]
    # 32 of them by 60 seeds, with a standard deviation of 5: enough that flags are tested.
    assert bad.sum() > 5
    assert sum(flag == "" for flag in np.array(found.flags)[bad]) <= 0.02 * 300


def test_a_place_beside_the_only_sensors_that_read_is_ambiguous(seed):
    """Sensors in one line do not tell the side; with the others they do."""
    places, forces = drawn(GRID, np.random.default_rng(seed))
    places[:, 1] = GRID.places[4, 1] + np.copysign(1.2e-3, places[:, 1])
    u = GRID.predict(places, forces)
    assert set(GRID.locate(u).flags) == {""}
    u[:, abs(GRID.places[:, 1] - GRID.places[4, 1]) > 0.1e-3] = np.nan
    found = GRID.locate(u)
    beside = abs(found.y - places[:, 1]) > 1e-3
    assert np.sum(beside) > 5
    ambiguous = np.array(["ambiguous" in flag for flag in found.flags])
    assert np.mean(ambiguous[beside]) >= 0.9


def test_a_pull_is_no_sound_press(seed):
    places, forces = drawn(GRID, np.random.default_rng(seed))
    found = GRID.locate(TRUE_GRID.readings(places, -forces))
    assert "" not in found.flags


def test_the_summary_counts_what_is_wrong_and_leaves_it_out_of_uncertainties():
    u = TRUE_GRID.readings(np.array([[0.3e-3, 0.2e-3], [5.5e-3, 0.0]]), 1.0)
    wrong = u[0] + 0.3 * u.max() * (np.arange(16) % 5 == 0)
    frames = np.vstack([u, 100 * wrong, 0 * u[0]])
    found = GRID.locate(frames, indenter=ROD, shear=0.0)
    said = found.answer()
    assert "3 contacts in 4 frames." in said
    assert all(f"{flag} (1)" in said for flag in ("edge", "misfit", "no contact"))
    alone = GRID.locate(u[:1], indenter=ROD, shear=0.0).answer()
    [line] = [line for line in alone.splitlines() if "uncertainties" in line]
    assert line in said


def test_a_contact_of_another_size_is_a_misfit():
    u = TRUE_GRID.readings(np.zeros((1, 2)), 2.0, indenter=memscal.Sphere(radius=50e-3))
    assert "misfit" in GRID.locate(u, shear=0.0).flags[0]


def test_the_error_of_the_load_is_one_of_the_force_alone():
    """A load that is 2 % too large makes all A 2 % too small, and forces 2 % too large."""
    effect = np.zeros(len(GRID.root))
    effect[:16] = -0.02
    array = replace(GRID, noise=1e-6 * GRID.noise, effects={"load": effect})
    found = array.locate(
        TRUE_GRID.readings(np.array([[1e-3, 0.2e-3]]), 1.5), indenter=ROD, shear=0.0
    )
    assert found.uncertainties[0, 2] == pytest.approx(0.03, rel=0.02)
    assert found.uncertainties[0, 0] < 1e-6


def test_the_assumed_shear_is_always_said():
    u = TRUE_GRID.readings(np.zeros((1, 2)), 1.0)
    found = GRID.locate(u, indenter=ROD)
    assert found.assumed_shear == 0.3
    assert "shear over normal force of 0 ± 0.3" in found.answer()
    assert "no shear" in GRID.locate(u, indenter=ROD, shear=0.0).answer()
    assert found.to_dict()["assumed_shear"] == 0.3


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"u": np.zeros((2, 15))}, ["15 columns", "16 sensors"]),
        ({"u": np.zeros((2, 16)), "rest": np.zeros(3)}, ["rest has 3 columns", "16 sensors"]),
        ({"u": np.zeros((2, 16)), "indenter": "rod"}, ["'rod'"]),
        ({"u": np.zeros((2, 16)), "shear": -1.0}, ["shear is -1"]),
        ({"u": np.zeros((1, 2, 16))}, ["(1, 2, 16), the first is the frame"]),
        ({"u": "text"}, ["u is no array of numbers"]),
        ({"u": np.full((2, 16), 1e160)}, ["u is 1e+160", "no quantity"]),
        ({"u": np.zeros((2, 16)), "shear": "0.3"}, ["shear is '0.3'", "one number"]),
        ({"u": np.zeros((2, 16)), "shear": 1e200}, ["shear is 1e+200"]),
        (
            {"u": np.zeros((2, 16)), "rest": np.where(np.arange(16) == 3, np.nan, 0.0)},
            ["rest holds no reading of T03"],
        ),
    ],
)
def test_what_makes_no_sense_is_refused(arguments, words):
    with pytest.raises(memscal.MemscalError) as refused:
        GRID.locate(**arguments)
    assert all(word in str(refused.value) for word in words)


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (lambda: GRID.predict([[np.nan, 0.0]]), "not finite"),
        (lambda: GRID.predict([[0.0, 0.0]], np.nan), "not finite"),
        (lambda: GRID.predict([[0.0, 0.0]], [1.0, 1.0, 1.0]), r"forces have shape \(3,\)"),
        (lambda: GRID.predict(np.zeros((2, 2)), shear=np.ones((3, 2))), r"shears \(3, 2\)"),
        (lambda: GRID.predict([["a", "b"]]), "places is no array of numbers"),
        (lambda: GRID.bound([[0.0, 0.0]], [1.0, 1.0]), r"forces have shape \(2,\)"),
        (lambda: GRID.bound([[0.0, 0.0]], shear=[0.1, 0.2]), "one number is needed"),
        (lambda: GRID.bound([[0.0, 0.0]], 0.0), "force is 0 N"),
        (lambda: GRID.bound(np.zeros((2, 2)), [1.0, -1.0]), "force is -1 N"),
    ],
)
def test_no_contact_is_predicted(work, words):
    with pytest.raises(memscal.MemscalError, match=words):
        work()


def test_far_away_sensors_read_nothing_and_tell_nothing():
    far = [[0.05, 0.0], [1e3, 0.0]]
    near = GRID.predict([[0.0, 0.0]]).max()
    np.testing.assert_allclose(GRID.predict(far) / near, 0.0, atol=1e-9)
    assert np.all(np.sqrt(GRID.bound(far)[:, 2, 2]) > 1e6)  # N


@pytest.fixture
def files(tmp_path):
    """An array, and a table of two frames whose columns are in another order."""
    ROW.save(tmp_path / "array.h5")
    u = TRUE_ROW.readings(np.array([[0.5e-3, 0.0], [-1e-3, 0.0]]), 1.0) * 1e3
    with (tmp_path / "frames.csv").open("w") as file:
        names = [*reversed(ROW.sensors)]
        file.write("frame," + ",".join(f"{name} [mV]" for name in names) + "\n")
        for number, row in zip((20261128000001, 20261128000002), u, strict=True):
            file.write(f"{number}," + ",".join(map(str, row[::-1])) + "\n")
        file.write("11" + "," * len(names) + "\n")
    return tmp_path


def test_the_command_writes_the_table_of_contacts(files, run):
    arguments = ["locate", files / "array.h5", files / "frames.csv", "-o", files / "c.csv"]
    done = run(*arguments, "--indenter", "rod:0.25", "--shear", "0", "--json")
    assert done.code == 0
    assert faults("locate", json.loads(done.out)) == []
    lines = (files / "c.csv").read_text().splitlines()
    assert any(line.startswith("#") and "no shear" in line for line in lines)
    rows = [*csv.DictReader(line for line in lines if not line.startswith("#"))]
    assert [*rows[0]][:8] == [
        "frame",
        "x [mm]",
        "x_errors [mm]",
        "y [mm]",
        "y_errors [mm]",
        "force [N]",
        "force_errors [N]",
        "flags",
    ]
    assert [row["frame"] for row in rows] == ["20261128000001", "20261128000002", "11"]
    assert float(rows[0]["x [mm]"]) == pytest.approx(0.5, abs=0.01)
    assert float(rows[1]["force [N]"]) == pytest.approx(1.0, abs=0.01)
    assert rows[0]["y_errors [mm]"] == ""
    assert (rows[2]["x [mm]"], rows[2]["flags"]) == ("", "no reading")
    assert run(*arguments).code == 4
    run(*arguments[:4], files / "c.xlsx").exits(2, "does not end in .csv")
    run(*arguments[:3], "--indenter", "rod").exits(2, "'rod' is not point, rod:MM")


@pytest.mark.parametrize("delimiter", [",", "\t"])
@pytest.mark.parametrize("word", ["", "nan"])
@pytest.mark.parametrize("empty", [[0, 1], [1], [0, 1, 2]])
def test_empty_frames_are_kept_wherever_they_stand(tmp_path, delimiter, word, empty):
    """At the beginning they were taken for a part of the head."""
    rows = [[word] * 6 if i in empty else [f"{i}.5"] * 6 for i in range(3)]
    rows.insert(0, [f"{name} [mV]" for name in ROW.sensors])
    (tmp_path / "f.csv").write_text("".join(delimiter.join(row) + "\n" for row in rows))
    found, _ = read_frames(ROW, tmp_path / "f.csv")
    expected = [np.nan if i in empty else 1e-3 * (i + 0.5) for i in range(3)]
    np.testing.assert_allclose(found, np.tile(expected, (6, 1)).T)


def test_empty_rows_of_a_workbook_are_frames(tmp_path):
    book = openpyxl.Workbook()
    for row in ([f"{name} [mV]" for name in ROW.sensors], [], [1.5] * 6, [], [2.5] * 6):
        book.active.append(row)
    book.save(tmp_path / "f.xlsx")
    found, _ = read_frames(ROW, tmp_path / "f.xlsx")
    np.testing.assert_allclose(found[:, 0], [np.nan, 1.5e-3, np.nan, 2.5e-3])


def test_frames_of_another_array_are_refused_and_nothing_is_written(files, run):
    table = files / "frames.csv"
    stated = table.read_text()
    cases = {
        stated.replace("T03", "X03"): ["T03", "X03", "6 columns", "6 sensors"],
        "\n".join(line.rpartition(",")[0] for line in stated.splitlines()): ["5 columns", "T00"],
        stated.replace(" [mV]", ""): ["unit"],
    }
    for text, words in cases.items():
        table.write_text(text)
        done = run("locate", files / "array.h5", table, "-o", files / "c.csv")
        assert done.code == 3
        assert all(word in done.err for word in words)
        assert not (files / "c.csv").exists()


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("\n11,", "\n11,OL", "'OL'"),
        ("\n11,", "\n11,9.9E37", "9.9E37"),
        (" [mV]", "", "no unit"),
        ("T00 [mV]", "T00 [mV],T00 [V]", "several columns 'T00'"),
    ],
)
def test_what_cures_a_table_is_in_it_not_an_option_of_import(files, run, old, new, words):
    table = files / "frames.csv"
    table.write_text(table.read_text().replace(old, new))
    done = run("locate", files / "array.h5", table)
    assert done.code == 3
    assert words in done.err
    assert "Correct the table" in done.err
    assert "--" not in done.err


def test_the_artifact_of_one_sensor_is_no_array(files, run):
    memscal.calibrate(memscal.simulate(seed=1)).apparatus.save(files / "one.h5")
    done = run("locate", files / "one.h5", files / "frames.csv", "-o", files / "c.csv")
    assert done.code == 3
    assert "is the artifact of a single sensor, not of an array" in done.err
