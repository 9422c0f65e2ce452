import os
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from contextlib import nullcontext
from dataclasses import replace
from functools import partial
from multiprocessing import get_context

import numpy as np
import pytest
from helpers.scans import simulated

import memscal
from memscal.extensions.fleet import many as fleet
from memscal.parallel import shared, worker_pool


def scans(count):
    return [simulated(noise=0.004, points=33, seed=seed) for seed in range(count)]


def constant(result):
    assert result.apparatus is not None, result.error
    return result.apparatus.conversion_constant


EXECUTORS = {
    "default": nullcontext,
    "threads": partial(ThreadPoolExecutor, 2),
    "processes": partial(ProcessPoolExecutor, 1, mp_context=get_context("spawn")),
}


@pytest.mark.parametrize("kind", EXECUTORS)
def test_every_scan_says_what_it_says_by_itself_and_a_bad_one_why(kind, tmp_path):
    good = [replace(scan, channels={"u_xz": scan.u_zz}) for scan in scans(3)]
    flat = replace(good[0], u_zz=np.zeros_like(good[0].u_zz))
    given = [good[0], flat, good[1], tmp_path / "missing.h5", good[2]]
    with EXECUTORS[kind]() as executor:
        found = list(memscal.calibrate_many(given, executor, method="bayesian"))
    assert [result.index for result in found] == list(range(5))
    assert [result.error is None for result in found] == [True, False, True, False, True]
    assert "Every voltage of the scan" in found[1].error.problem
    assert found[1].error.cure == "Check the channel."
    assert isinstance(found[1].error, memscal.MemscalError)
    assert "missing.h5" in found[3].error.problem
    assert not found[1].passed
    assert "Every voltage" in repr(found[1])
    for result, scan in zip(found[::2], good, strict=True):
        alone = memscal.calibrate(scan, method="bayesian").apparatus
        own = result.apparatus
        assert constant(result) == pytest.approx(alone.conversion_constant, rel=1e-9)
        covariance = alone.parameters.covariance
        g = alone.radial_profile.g
        np.testing.assert_allclose(own.parameters.covariance, covariance, rtol=1e-6, atol=1e-30)
        np.testing.assert_allclose(own.radial_profile.g, g, rtol=1e-9, atol=1e-9 * g.max())
        assert own.resolved_wavenumber == pytest.approx(alone.resolved_wavenumber, rel=1e-9)
        assert [check.name for check in own.checks] == [check.name for check in alone.checks]
        assert own.plane is None
        assert result.passed == alone.passed


class Counting(ThreadPoolExecutor):
    """Threads that count the tasks they are given."""

    tasks = 0

    def submit(self, *arguments, **options):
        self.tasks += 1
        return super().submit(*arguments, **options)


def test_scans_are_taken_as_workers_become_free_and_several_are_a_task(monkeypatch):
    monkeypatch.setattr(fleet, "attempted", lambda *_: memscal.MemscalError("not needed"))
    taken = 0

    def endless():
        nonlocal taken
        while True:
            taken += 1
            yield "scan.h5"

    with Counting(2) as executor:
        results = memscal.calibrate_many(endless(), executor)
        assert taken == 0
        assert [next(results).index for _ in range(1000)] == list(range(1000))
        assert 1000 <= taken < 1200
        assert executor.tasks < taken / 10
        results.close()
        list(memscal.calibrate_many(["scan.h5"] * 20, executor))
        assert executor.tasks < taken / 10 + 20


SCRIPT = """
import memscal
from memscal.deconvolution.division import Tikhonov

class Half(Tikhonov):
    pass

print("The script runs.")
scans = (memscal.simulate(points=33, seed=seed) for seed in range(3))
print([result.error for result in memscal.calibrate_many(scans, method=Half())])
"""


def test_a_script_needs_no_guard(tmp_path):
    script = tmp_path / "script.py"
    script.write_text(SCRIPT)
    run = subprocess.run(
        [sys.executable, script], capture_output=True, text=True, timeout=300, check=False
    )
    assert (run.returncode, run.stderr) == (0, "")
    assert run.stdout == "The script runs.\n[None, None, None]\n"


def test_what_is_no_error_of_ours_is_reported_as_such(monkeypatch):
    def broken(scan, **_):
        raise ZeroDivisionError("float division by zero")

    monkeypatch.setattr(fleet, "calibrate", broken)
    with ThreadPoolExecutor(2) as executor:
        found = list(memscal.calibrate_many(scans(2), executor))
    assert all(one.error is not None and "ZeroDivisionError" in str(one.error) for one in found)


def test_files_and_joint_scans_are_calibrated(tmp_path):
    first, second = scans(2)
    path = tmp_path / "scan.h5"
    memscal.write_scan(first, path)
    found = list(memscal.calibrate_many([path, [first, second]], method="bayesian"))
    alone = memscal.calibrate(first, method="bayesian").apparatus
    joint = memscal.calibrate([first, second], method="bayesian").apparatus
    assert constant(found[0]) == pytest.approx(alone.conversion_constant, rel=1e-9)
    assert constant(found[1]) == pytest.approx(joint.conversion_constant, rel=1e-9)
    assert "A = " in repr(found[0])


@pytest.mark.parametrize(("options", "words"), [
    ({"executor": 2}, "executor is of type int"), ({"film_law": "linear", "bogus": 1}, "bogus"),
    ({"method": "nonsense"}, "nonsense"), ({"method": "bayesian", "film_laws": "a"}, "film_laws"),
])  # fmt: skip
def test_a_wrong_executor_method_or_option_is_refused_at_once(options, words):
    with pytest.raises(memscal.MemscalError, match=words):
        memscal.calibrate_many(scans(2), **options)


def test_one_scan_is_no_list_and_no_scans_are_no_results():
    assert list(memscal.calibrate_many([])) == []


def test_what_a_generator_gave_before_it_failed_is_calibrated():
    def failing():
        yield from scans(3)
        raise OSError("the detector died")

    with ThreadPoolExecutor(2) as executor:
        results = memscal.calibrate_many(failing(), executor, method="bayesian")
        assert [next(results).error for _ in range(3)] == [None] * 3
        with pytest.raises(OSError, match="the detector died"):
            next(results)


def test_workers_end_when_their_parent_is_killed():
    program = """
import os, signal, time
from memscal.parallel import worker_pool
with worker_pool(2) as pool:
    first = [pool.submit(os.getpid) for _ in range(2)][0].result(60)
    sleeping = [pool.submit(time.sleep, 600) for _ in range(4)]
    print(first, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
"""
    # The pipe would stay open, and run() wait, if a worker went on.
    command = [sys.executable, "-c", program]
    run = subprocess.run(command, stdout=subprocess.PIPE, timeout=300, check=False)
    assert run.returncode == -9
    assert int(run.stdout)


def test_a_worker_that_is_killed_is_an_error_of_ours():
    with pytest.raises(memscal.MemscalError, match="A worker process ended"):
        list(shared(os._exit, range(8), workers=2))


def test_processes_are_told_one_thread_and_the_environment_is_put_back():
    before = dict(os.environ)
    with worker_pool(1) as pool:
        told = pool.submit(os.getenv, "OMP_NUM_THREADS").result()
    assert told == before.get("OMP_NUM_THREADS", "1")
    assert dict(os.environ) == before
