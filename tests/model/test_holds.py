"""Holds in a log: found whatever the load cell shows, and averaged with what they scatter by."""

import numpy as np
import pytest

from memscal.errors import InputError
from memscal.model.notation import VOLTS
from memscal.readings.find_holds import find_holds

PLACES = np.linspace(-8e-3, 8e-3, 33)
SIGNAL = 15e-3 * np.exp(-((PLACES / 1.2e-3) ** 2))


def log(seed, correlation=0.0, *, creep=0.0):
    """Moves, presses with ramps and holds of 20 to 40 rows; noise of 2 uV."""
    rng = np.random.default_rng(seed)
    parts = []
    for x, before, u in zip(PLACES, [-9e-3, *PLACES[:-1]], SIGNAL, strict=True):
        moves = 6
        waits = int(rng.integers(8, 12))
        ramp = 4
        held = int(rng.integers(20, 40))
        up = np.linspace(0, 1, ramp, endpoint=False)
        load = [np.zeros(moves + waits), up, np.ones(held), up[::-1], np.zeros(5)]
        late = [np.zeros(moves + waits), up, 1 - creep * np.exp(-np.arange(held) / 8), up[::-1]]
        position = [np.linspace(before, x, moves), np.full(waits + 2 * ramp + held + 5, x)]
        parts.append(
            (*map(np.concatenate, (position, load)), u * np.concatenate([*late, load[-1]]))
        )
    x, load, u = (np.concatenate(part) for part in zip(*parts, strict=True))
    noise = rng.normal(size=x.size)
    for i in range(1, x.size):
        noise[i] = correlation * noise[i - 1] + np.sqrt(1 - correlation**2) * noise[i]
    load = load + rng.normal(size=x.size) * 2e-3
    return {"x": x + rng.normal(size=x.size) * 1e-6, "normal_load": load, "u_zz": u + 2e-6 * noise}


def found(columns, depth=None, **options):
    columns = {name: values for name, values in columns.items() if name != "depth"}
    return find_holds(columns, np.arange(columns["x"].size), VOLTS, depth=depth, **options)


@pytest.mark.parametrize("correlation", [0.0, 0.6])
@pytest.mark.parametrize("loads", [True, False], ids=["load", "no load"])
def test_the_means_of_holds_scatter_by_their_uncertainty(correlation, loads):
    """About the truth, 330 of them: their variance lies within 4 sd of 1, and a share of bias."""
    errors = []
    for seed in range(10):
        columns = log(seed, correlation)
        if not loads:
            del columns["normal_load"]
        holds = found(columns)
        assert holds.first.size == PLACES.size
        np.testing.assert_allclose(holds.mean["x"], PLACES, atol=2e-6)
        errors.append((holds.mean["u_zz"] - SIGNAL) / holds.u_errors)
    square = np.mean(np.square(errors))
    assert abs(square - 1) < 4 * np.sqrt(2 / np.size(errors)) + 0.1


def test_creep_within_holds_is_told():
    columns = log(1, creep=0.2)
    holds = found(columns)
    assert float(holds.notes[2].split("at most by ")[1].split()[0]) > 0.05


def test_what_is_no_log_is_refused_and_a_short_press_is_left_out():
    columns = log(2)
    first = int(np.argmax(columns["normal_load"] > 0.9))
    columns["normal_load"][first + 3 :][columns["x"][first + 3 :] < -7.8e-3] = 0.0
    holds = found(columns)
    assert holds.first.size == PLACES.size - 1
    assert "presses of fewer than 5 steady rows left out: 1" in holds.notes[0]
    with pytest.raises(InputError, match="The log has no hold"):
        found({n: v[::40] for n, v in columns.items()})


def presses(sensor, waits, drift=0.0):
    """13 places, presses of 137 rows to 0.1 mm; before some the raised indenter waits longer."""
    x, depth = [], []
    for i, place in enumerate(np.linspace(-6e-3, 6e-3, 13)):
        rows = [np.full(20 + waits.get(i, 0), -50e-3 if i in waits else -1e-3)]
        rows += [np.full(9, -1e-5), np.full(137, 1e-4), np.full(15, -1e-3)]
        depth += rows
        x.append(np.full(sum(map(len, rows)), place))
    columns = {"x": np.concatenate(x), "depth": np.concatenate(depth)}
    signal = 15e-3 * np.exp(-(((columns["x"] - sensor) / 1.5e-3) ** 2) / 2)
    noise = 2e-6 * np.random.default_rng(3).normal(size=signal.size)
    steps = drift * np.floor((columns["x"] + 6e-3) / 1e-3)
    columns["u_zz"] = signal * (columns["depth"] > 0) + noise + steps
    return columns


WAITS = [{}, {0: 500}, {6: 500}, {0: 60, 9: 90}, {7: 300, 8: 600, 9: 500, 10: 200}]


@pytest.mark.parametrize("waits", WAITS)
@pytest.mark.parametrize("kind", ["depth", "flag", "none", "before each"])
def test_a_wait_above_the_film_is_no_reading(waits, kind):
    """By the depth, by a flag and by two levels of the readings; with a drift of 9 mV, too."""
    columns = presses(3e-3, waits, drift=9e-3 / 12 if kind == "before each" else 0.0)
    depth = {"none": None, "flag": columns["depth"] > 0}.get(kind, columns["depth"])
    depth = depth if depth is None else depth.astype(float)
    if kind == "none" and 0 in waits:  # no reading shows the press
        with pytest.raises(InputError, match=r"when the indenter presses in lines \d+ to \d+"):
            found(columns)
        return
    holds = found(columns, depth, baseline=kind == "before each")
    truth = 15e-3 * np.exp(-(((holds.mean["x"] - 3e-3) / 1.5e-3) ** 2) / 2)
    assert holds.first.size == 13
    assert np.all(holds.stop - holds.first >= 130)
    z = (holds.mean["u_zz"] - truth) / holds.u_errors
    assert np.sqrt(np.mean(z**2)) < 2
    assert bool(waits or depth is not None) == (len(holds.notes) > 3)


@pytest.mark.parametrize("column", ["height", "still", "time"])
def test_a_column_that_does_not_tell_the_presses_is_refused(column):
    columns = presses(0.0, {0: 500})
    rows = np.arange(columns["x"].size) * 1.0
    depth = {"height": -columns["depth"], "still": 0 * rows, "time": rows}[column]
    with pytest.raises(InputError, match="does not tell when"):
        found(columns, depth)


def test_a_press_without_rows_before_it_has_no_baseline():
    columns = presses(0.0, {})
    later = {name: values[29:] for name, values in columns.items()}
    with pytest.raises(InputError, match="hold of lines 0 to 136 has no baseline"):
        found(later, later["depth"], baseline=True)


def test_a_plateau_at_a_lesser_depth_is_no_baseline():
    columns = presses(0.0, {})
    times = np.where(columns["depth"] == -1e-5, 8, 1)
    columns = {name: np.repeat(values, times) for name, values in columns.items()}
    half = columns["depth"] == -1e-5
    columns["depth"][half] = -0.5e-3
    columns["u_zz"][half] += 7e-3
    holds = found(columns, columns["depth"], baseline=True)
    truth = 15e-3 * np.exp(-((holds.mean["x"] / 1.5e-3) ** 2) / 2)
    np.testing.assert_allclose(holds.mean["u_zz"], truth, atol=1e-5)


def test_the_figure_says_that_the_readings_of_an_array_are_added_up():
    columns = log(1)
    labels = {}
    for further in ({}, {"u_zz of A": columns["u_zz"]}):
        figure = found(columns | further).plot()
        labels[len(further)] = {axes.get_ylabel() for axes in figure.axes}
    assert "reading (mV)" in labels[0]
    assert "sum of all readings (mV)" in labels[1]
