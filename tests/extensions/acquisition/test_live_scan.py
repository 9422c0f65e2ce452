"""A scan that is calibrated while it grows: documents of a run, and what must not stop one."""

import numpy as np
import pytest
from helpers.scans import simulate

import memscal
from memscal.acquire import LiveScan, positions

RUN = {"uid": "d1", "run_start": "r1", "data_keys": {"stage": {}, "sensor": {}, "other": {}}}
MADE = simulate(seed=3, points=33)
ROWS = list(zip(1e3 * MADE.x, 1e3 * MADE.u_zz, strict=True))
STATED = {"film": MADE.film, "indenter": MADE.indenter, "load": MADE.load}


def live_scan(**options):
    live = LiveScan("stage", "sensor", x_unit="mm", u_unit="mV", **STATED, **options)
    live("descriptor", RUN)
    return live


def event(x, u, descriptor="d1"):
    """An event at a time of x seconds, or the columns of a page."""
    data = {"stage": x, "sensor": u}
    return {"descriptor": descriptor, "data": data, "timestamps": {"sensor": x}}


def test_the_documents_of_a_run_make_the_scan_and_its_calibration():
    live = live_scan(every=20)
    live("descriptor", {"uid": "d2", "run_start": "r1", "data_keys": {"stage": {}}})
    for x, u in ROWS[:25]:
        live("event", event(x, u))
        live("event", event(x, u, descriptor="d2"))
    live("event", event(0.0, None))
    assert live.error == ""
    live("event_page", event(*zip(*ROWS[25:], strict=True)))
    live("stop", {"run_start": "r1"})
    scan = live.scan()
    np.testing.assert_allclose([scan.x, scan.u_zz], [MADE.x, MADE.u_zz], rtol=1e-12)
    np.testing.assert_allclose(scan.time, 1e3 * (MADE.x - MADE.x[0]), atol=1e-9)
    assert live.error == ""
    expected = memscal.calibrate(scan).apparatus.conversion_constant
    assert live.result.apparatus.conversion_constant == expected
    u = live.result.apparatus.parameters.uncertainty("conversion_constant") / expected
    assert live.reached(A=1.01 * u, resolved=1e3)
    assert not live.reached(A=0.99 * u)
    live("descriptor", RUN | {"uid": "d3", "run_start": "r2"})
    assert live.result is None
    with pytest.raises(memscal.MemscalError, match="No reading of stage and sensor"):
        live.scan()


def test_a_misspelt_key_is_named_at_the_end_with_the_keys_there_are():
    live = LiveScan("stge", "sensor", x_unit="mm", u_unit="mV", **STATED)
    live("descriptor", RUN)
    live("event", event(1.0, 2.0))
    live("stop", {"run_start": "r1"})
    assert live.result is None
    assert "No stream of the run has stge." in live.error
    assert "Did you mean stage? Choose from other, sensor, stage." in live.error


def test_a_lifted_rod_read_before_and_after_the_run_is_no_reading():
    live = LiveScan("stage", "sensor", x_unit="mm", u_unit="mV", **STATED)
    live("descriptor", RUN | {"uid": "d0", "name": "baseline"})
    live("event", event(-9.0, 0.0, descriptor="d0"))
    live("descriptor", RUN | {"name": "primary"})
    live("event", event(1.0, 2.0))
    live("event", event(9.0, 0.0, descriptor="d0"))
    assert live.scan().x.tolist() == [1e-3]


@pytest.mark.parametrize("reading", [(np.nan, 1.0), (1.0, np.inf), (None, 1.0), ("a", 1.0)])
def test_what_is_added_and_no_number_is_left_out_and_said(reading):
    live = live_scan()
    live.add(1.0, 2.0)
    live.add(*reading)
    assert f"The reading {reading[1]!r} at {reading[0]!r} is left out" in live.error
    assert live.scan().x.size == 1


def test_without_a_target_nothing_is_reached():
    with pytest.raises(memscal.MemscalError, match="No target is given"):
        live_scan().reached()


@pytest.mark.parametrize("document", [None, {"descriptor": "d1"}, event(0.0, "volts")])
def test_no_document_stops_the_run(document, caplog):
    live = live_scan()
    live("event", document)
    assert live.error in caplog.text
    live("event", event(1.0, 2.0))
    assert live.scan().u_zz.tolist() == [2e-3]


def test_a_calibration_that_fails_is_no_result_yet_and_raises_only_where_it_is_asked_for():
    live = live_scan(every=1, calibrate=lambda scan: 1 / (scan.u_zz.size - 2))
    live.add(1.0, 2.0, load=0.9)
    assert (live.result, live.error) == (-1, "")
    live.add(2.0, 2.0, load=1.1)
    assert (live.result, live.reached(A=0.5)) == (None, False)
    assert "No result yet of 2 readings: division" in live.error
    with pytest.raises(ZeroDivisionError):
        live.calibrate()
    live.add(3.0, 2.0, time=7.0)
    assert (live.result, live.error) == (1, "")
    assert live.scan().normal_load.tolist()[:2] == [0.9, 1.1]


def test_half_a_scan_from_left_to_right_is_no_result_and_half_an_interleaved_one_is():
    along = live_scan(every=15)
    interleaved = live_scan(every=17)
    for row in ROWS[:15]:
        along.add(*row)
    for row in ROWS[::2]:
        interleaved.add(*row)
    assert along.result is None
    assert interleaved.result is not None


WRONG = [{"x_unit": "V"}, {"u_unit": "furlong^"}, {"lod": 1.0}]
WRONG += [{"every": -1}, {"every": 2.5}, {"every": "a"}]


@pytest.mark.parametrize("wrong", WRONG)
def test_what_is_misspelt_is_refused_before_the_run(wrong):
    with pytest.raises(memscal.MemscalError):
        LiveScan("stage", "sensor", **({"x_unit": "mm", "u_unit": "mV"} | wrong))


def test_the_order_refines_the_field_block_by_block_and_reads_blanks_between():
    planned = memscal.design(step=1e-3, half_range=4e-3, repeats=2)
    block = [[-4, 0, 4], [5, 6], [-2, 2], [5, 6], [-3, -1, 1, 3]]
    expected = 1e-3 * np.concatenate([*block, [5, 6], *block])
    np.testing.assert_allclose(positions(planned, blanks=2), expected, atol=1e-12)
    for wrong in (0.5, -1, "a"):
        with pytest.raises(memscal.MemscalError, match="The number of blanks"):
            positions(planned, blanks=wrong)
