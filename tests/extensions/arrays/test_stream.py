"""Streams: what presses in each frame, which sensors are left out, and how a stream continues."""

import json
from dataclasses import replace

import numpy as np
import pytest
from helpers.arrays import known_array
from helpers.true_arrays import TrueArray

import memscal
from memscal.extensions.arrays.stream import FrameFlag

RATE = 50
#: A stream of 9 sensors 2 mm apart whose noise is 1 % of their largest reading.
ARRAY = known_array(3, 3, noise=0.005)
ARRAY = replace(ARRAY, film=replace(ARRAY.film, law="linear"))
TRUE = TrueArray(ARRAY.places, ARRAY.conversion_constants, ARRAY.crosstalk)
FEWER = known_array(2, 2)
WIDER = known_array(3, 3, pitch=4e-3)
PLACE = np.array([[0.4e-3, -0.7e-3]])
TOUCH = TRUE.readings(PLACE, 1.0, indenter=None)


def frames(seed, seconds, signal=0.0):
    """Frames of noise and a signal."""
    count = round(seconds * RATE)
    noise = np.random.default_rng(seed).normal(size=(count, 9)) * np.sqrt(ARRAY.noise[0, 0])
    return noise + signal


def resting(seed, array=ARRAY, **arguments):
    """A stream that has seen 2 s without a contact."""
    stream = array.stream(RATE, **arguments)
    stream.push(frames(seed, 2) + 1.0)
    return stream


def test_a_contact_is_where_an_independent_layer_has_it_and_rest_is_rest(seed):
    stream = resting(seed)
    before, during, after = (
        stream.push(frames([seed, i], 4, 1 + touch)) for i, touch in enumerate((0, TOUCH, 0))
    )
    assert during["contact"].all()
    assert not np.concatenate([before, after])["contact"].any()
    found = np.stack([during["x"], during["y"], during["force"]], axis=1)
    truth = [*PLACE[0], 1.0]
    # 200 frames of a known baseline: their mean is 14 times as sure as each.
    error = found.mean(axis=0) - truth
    stated = np.sqrt(np.diagonal(during["covariance"].mean(axis=0)))
    assert np.all(np.abs(error) < stated)
    np.testing.assert_allclose(found.std(axis=0), stated, rtol=0.4)
    np.testing.assert_allclose(np.diff(during["t"]), 1 / RATE)


def test_records_do_not_depend_on_how_a_stream_is_cut(seed):
    readings = np.concatenate([frames(seed, 3), frames([seed, 1], 2, TOUCH)])
    readings[20:30, 4] = np.nan
    whole, single, odd = (
        np.concatenate(list(map(ARRAY.stream(RATE).push, np.array_split(readings, pieces))))
        for pieces in (1, len(readings), 7)
    )
    for name in whole.dtype.names:
        np.testing.assert_allclose(single[name], whole[name], rtol=1e-6, atol=1e-9)
        np.testing.assert_allclose(odd[name], whole[name], rtol=1e-6, atol=1e-9)


def test_a_restored_stream_continues_exactly(seed):
    first = resting(seed)
    first.push(frames([seed, 1], 1.5, 1 + TOUCH))
    text = json.dumps({name: value.tolist() for name, value in first.state().items()})
    second = ARRAY.stream(RATE)
    second.restore(json.loads(text))
    more = frames([seed, 2], 1, 1 + TOUCH)
    assert first.push(more).tobytes() == second.push(more).tobytes()


def test_a_stuck_sensor_is_left_out_and_returns_when_it_changes(seed):
    stream = resting(seed)
    readings = frames([seed, 1], 8, 1 + TOUCH)
    readings[: 4 * RATE, 4] = readings[0, 4]
    stuck = stream.push(readings[: 4 * RATE])
    assert stream.left_out == {"T04": "unchanged for 1 s"}
    back = stream.push(readings[4 * RATE :])
    assert stream.left_out == {}
    assert np.all(stuck[RATE + 10 :]["flags"] & FrameFlag.DROPPED)
    for late in (stuck[RATE + 10 :], back[RATE:]):
        assert abs(late["force"].mean() - 1) < 4 * np.sqrt(late["covariance"][0, 2, 2])


def test_at_a_low_rate_a_stuck_sensor_alone_is_left_out(seed):
    stream = ARRAY.stream(0.5)
    readings = frames(seed, 0.4, 1.0)
    stream.push(readings)
    assert stream.left_out == {}
    readings[:, 4] = 1.0
    stream.push(readings)
    assert stream.left_out == {"T04": "unchanged for 1 s"}


def test_a_sensor_whose_reading_jumps_is_left_out(seed):
    stream = resting(seed)
    jumped = frames([seed, 1], 4, 1.0)
    # At a corner it could be a contact outside.
    jumped[:, 4] += 0.5 * TOUCH.max()
    found = stream.push(jumped)
    assert stream.left_out == {"T04": "contradicts all others"}
    assert not found[2 * RATE :]["contact"].any()


@pytest.mark.parametrize("sensor", [1, 4, 5])
def test_a_sensor_that_dies_under_a_contact_is_left_out(seed, sensor):
    stream = resting(seed)
    stream.push(frames([seed, 1], 2, 1 + TOUCH))
    found = stream.push(frames([seed, 2], 4, 1 + np.where(np.arange(9) == sensor, 0.0, TOUCH)))
    assert stream.left_out == {f"T0{sensor}": "contradicts all others"}
    late = found[2 * RATE :]
    assert abs(late["force"].mean() - 1) < 4 * np.sqrt(late["covariance"][0, 2, 2])


def test_missing_saturated_and_dead_sensors_move_nothing_else(seed):
    used = np.arange(9) != 6
    stream = resting(seed, replace(ARRAY, used=used), limit=(0.0, 1 + 0.8 * TOUCH.max()))
    readings = frames([seed, 1], 1, 1 + TOUCH)
    readings[5, 2] = readings[7] = np.nan
    found = stream.push(readings)
    assert stream.left_out == {"T06": "dead in the calibration"}
    assert np.all(found["flags"] & FrameFlag.DROPPED)
    assert np.all(found["flags"][:5] & FrameFlag.SATURATED)
    assert np.flatnonzero(found["flags"] & FrameFlag.MISSING).tolist() == [5, 7]
    assert np.flatnonzero(np.isnan(found["force"])).tolist() == [7]
    assert found["flags"][7] & FrameFlag.NO_READING


def test_a_sensor_at_its_end_is_not_stuck_and_keeps_its_baseline(seed):
    highest = 1 + 0.8 * TOUCH.max()
    stream = resting(seed, limit=(0.0, highest))
    during = stream.push(np.minimum(frames([seed, 1], 4, 1 + TOUCH), highest))
    assert during["flags"][0] & FrameFlag.SATURATED
    assert stream.left_out == {}
    after = stream.push(frames([seed, 2], 4, 1.0))
    for found in (during, after):
        assert not np.any(found["flags"] & FrameFlag.DROPPED)
    assert not after["contact"].any()


def test_a_sensor_that_returns_while_a_contact_leaves_has_the_right_baseline(seed):
    stream = resting(seed)
    # It has no baseline after this.
    readings = frames([seed, 1], 2, 1.0)
    readings[:, 4] = 1.0
    stream.push(readings)
    # A block is 10 frames.
    readings = frames([seed, 2], 4, 1.0)
    readings[:55] += TOUCH
    readings[:55, 4] = np.nan
    stream.push(readings)
    assert stream.left_out == {}
    assert not stream.push(frames([seed, 3], 1, 1.0))["contact"].any()


def test_before_a_baseline_is_known_no_sensor_is_said_to_be_left_out(seed):
    stream = ARRAY.stream(RATE)
    first, second = np.split(stream.push(frames(seed, 0.4)), 2)
    assert stream.left_out == {}
    assert np.all(first["flags"] == FrameFlag.NO_READING)
    assert np.all(second["flags"] == 0)


def test_too_few_sensors_say_so_in_each_frame(seed):
    readings = frames(seed, 2)
    readings[:, 3:] = np.nan
    found = ARRAY.stream(RATE).push(readings)
    assert np.all(found["flags"] & FrameFlag.NO_READING)
    assert np.isnan(found["force"]).all()


def test_two_contacts_and_one_outside_are_flagged(seed):
    stream = resting(seed)
    two = TRUE.readings(np.array([[-2e-3, -2e-3], [2e-3, 2e-3]]), 1.0, indenter=None).sum(axis=0)
    outside = TRUE.readings(np.array([[2.8e-3, 0.0]]), 1.0, indenter=None)
    for signal, flag in ((two, FrameFlag.TWO_CONTACTS), (outside, FrameFlag.EDGE)):
        found = stream.push(frames([seed, flag], 0.1, 1 + signal))
        assert np.all(found["flags"] & flag)


@pytest.mark.parametrize(
    ("work", "words"),
    [
        (lambda: ARRAY.stream(0.0), "rate is 0 Hz"),
        (lambda: ARRAY.stream(RATE).restore({}), "state is not of a stream"),
        (
            lambda: ARRAY.stream(RATE).restore(FEWER.stream(RATE).state()),
            "state is not of a stream",
        ),
        (lambda: ARRAY.stream(RATE).push(np.zeros((5, 8))), "8 columns, but the array has 9"),
        (lambda: ARRAY.stream(RATE, indenter="pen"), "indenter is 'pen'"),
        (lambda: ARRAY.stream(2 * RATE).restore(ARRAY.stream(RATE).state()), "not of a stream"),
        (lambda: ARRAY.stream(RATE).restore(WIDER.stream(RATE).state()), "not of a stream"),
        (lambda: ARRAY.stream(RATE).restore(None), "state is not of a stream"),
        (
            lambda: ARRAY.stream(RATE).restore(ARRAY.stream(RATE).state() | {"frames": np.nan}),
            "state is not of a stream",
        ),
        (
            lambda: ARRAY.stream(RATE, limit=(0, 1)).restore(ARRAY.stream(RATE).state()),
            "state is not of a stream",
        ),
        (lambda: ARRAY.stream(RATE, limit=(1.0, 0.0)), "lower one is needed first"),
        (lambda: ARRAY.stream(RATE, limit=(np.nan, 1.0)), "lower one is needed first"),
        (lambda: ARRAY.stream(RATE, limit=5), "limits are 5, but two are needed"),
        (lambda: ARRAY.stream(RATE, limit=(0.0, np.ones(8))), "of one or of 9 numbers"),
        (lambda: ARRAY.stream(RATE, drift=5.0), "drift is 5.0, but two numbers are needed"),
        (lambda: ARRAY.stream(RATE, drift=(1e-4, np.inf)), "drift is inf"),
        (lambda: ARRAY.stream(RATE, drift=(1e-4, -1e-4)), "drift is -0.0001"),
        (lambda: known_array(1, 2).stream(RATE), "2 sensors of the array work"),
        (lambda: replace(FEWER, used=np.arange(4) > 0).stream(RATE), "3 sensors of the array work"),
    ],
)
def test_what_is_no_stream_is_refused(work, words):
    with pytest.raises(memscal.MemscalError, match=words):
        work()
