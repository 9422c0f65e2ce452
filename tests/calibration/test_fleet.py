import os
import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from helpers.scans import simulated

import memscal
from memscal import FleetCalibration, Scan
from memscal.calibration import many as fleet
from memscal.parallel import worker_pool


def scans(count: int) -> list[Scan]:
    return [simulated(noise=0.004, points=33, seed=seed) for seed in range(count)]


def constant(result: FleetCalibration) -> float:
    assert result.parameters is not None, result.error
    return result.parameters["conversion_constant"]


@pytest.mark.parametrize("workers", [1, 2])
def test_every_scan_says_what_it_says_by_itself(workers: int) -> None:
    given = scans(5)
    found = memscal.calibrate_many(given, workers=workers, method="bayesian")
    assert [one.index for one in found] == list(range(5))
    for one, scan in zip(found, given, strict=True):
        alone = memscal.calibrate(scan, method="bayesian").apparatus
        assert constant(one) == pytest.approx(alone.conversion_constant, rel=1e-9)
        covariance, g = alone.parameters.covariance, alone.radial_profile.g
        np.testing.assert_allclose(one.parameters.covariance, covariance, rtol=1e-6, atol=1e-30)
        np.testing.assert_allclose(one.radial_profile.g, g, rtol=1e-9, atol=1e-9 * g.max())
        assert one.resolved_wavenumber == pytest.approx(alone.resolved_wavenumber, rel=1e-9)
        assert [check.name for check in one.checks] == [check.name for check in alone.checks]
        assert one.passed == alone.passed


@pytest.mark.parametrize("workers", [1, 2])
def test_a_bad_scan_has_its_error_in_place(workers: int, tmp_path: Path) -> None:
    good = scans(3)
    flat = replace(good[0], u_zz=np.zeros_like(good[0].u_zz))
    given = [good[0], flat, good[1], tmp_path / "missing.h5", good[2]]
    found = memscal.calibrate_many(given, workers=workers)
    assert [one.error is None for one in found] == [True, False, True, False, True]
    assert "Every voltage of the scan" in found[1].error.problem
    assert found[1].error.cure == "Check the channel."
    assert isinstance(found[1].error, memscal.MemscalError)
    assert "missing.h5" in found[3].error.problem
    assert not found[1].passed
    assert "Every voltage" in repr(found[1])
    assert constant(found[2]) == pytest.approx(1e-7, rel=0.1)


def test_what_is_no_error_of_ours_is_reported_as_such(monkeypatch: pytest.MonkeyPatch) -> None:
    def broken(scan: Scan, **_: object) -> object:
        raise ZeroDivisionError("float division by zero")

    monkeypatch.setattr(fleet, "calibrate", broken)
    found = memscal.calibrate_many(scans(2))
    assert all(one.error is not None and "ZeroDivisionError" in str(one.error) for one in found)


def test_files_and_joint_scans_are_calibrated(tmp_path: Path) -> None:
    first, second = scans(2)
    path = tmp_path / "scan.h5"
    memscal.write_scan(first, path)
    found = memscal.calibrate_many([path, [first, second]], method="bayesian")
    alone = memscal.calibrate(first, method="bayesian").apparatus
    joint = memscal.calibrate([first, second], method="bayesian").apparatus
    assert constant(found[0]) == pytest.approx(alone.conversion_constant, rel=1e-9)
    assert constant(found[1]) == pytest.approx(joint.conversion_constant, rel=1e-9)
    assert "A = " in repr(found[0])


@pytest.mark.parametrize(("options", "words"), [
    *[({"workers": workers}, "workers is") for workers in (0, -1, 1.5, 1000)],
    ({"method": "nonsense"}, "nonsense"), ({"method": "bayesian", "bogus": 1}, "bogus"),
])  # fmt: skip
def test_a_wrong_number_of_processes_method_or_option_is_refused_at_once(options, words) -> None:
    with pytest.raises(memscal.MemscalError, match=words):
        memscal.calibrate_many(scans(2), **options)


def test_one_scan_is_no_list_and_no_scans_are_no_results() -> None:
    assert memscal.calibrate_many([], workers=2) == []
    with pytest.raises(memscal.MemscalError, match="one scan"):
        memscal.calibrate_many(scans(1)[0])


def test_a_scan_survives_pickling() -> None:
    scan = replace(scans(1)[0], channels={"u_xz": np.zeros(33)})
    again = pickle.loads(pickle.dumps(scan))
    np.testing.assert_array_equal(again.u_zz, scan.u_zz)
    assert again.film == scan.film
    assert again.indenter == scan.indenter
    assert dict(again.channels).keys() == {"u_xz"}
    assert not again.u_zz.flags.writeable


def test_processes_are_told_one_thread_and_the_environment_is_put_back() -> None:
    before = dict(os.environ)
    with worker_pool(1) as pool:
        told = pool.submit(os.getenv, "OMP_NUM_THREADS").result()
    assert told == before.get("OMP_NUM_THREADS", "1")
    assert dict(os.environ) == before
