"""Linear algebra runs on one thread inside the public functions, and as before outside."""

import os
import subprocess
import sys

import pytest
from threadpoolctl import threadpool_info, threadpool_limits

import memscal
from memscal.parallel import THREAD_VARIABLES, single_threaded, worker_pool


def blas_threads():
    return {pool["num_threads"] for pool in threadpool_info() if pool["user_api"] == "blas"}


@pytest.fixture
def two_threads(monkeypatch):
    """A process whose BLAS runs two threads, and whose user asked for no number."""
    for name in THREAD_VARIABLES:
        monkeypatch.delenv(name, raising=False)
    with single_threaded():  # loads every BLAS
        pass
    with threadpool_limits(2, user_api="blas"):
        yield


@pytest.mark.usefixtures("two_threads")
def test_the_limit_holds_until_the_outermost_of_nested_calls_is_over():
    with single_threaded():
        with single_threaded():
            assert blas_threads() == {1}
        assert blas_threads() == {1}
    assert blas_threads() == {2}


@pytest.mark.usefixtures("two_threads")
def test_a_failed_call_lifts_the_limit_too():
    with pytest.raises(memscal.MemscalError):
        memscal.simulate(points=-1)
    assert blas_threads() == {2}


@pytest.mark.usefixtures("two_threads")
def test_the_user_s_own_number_stays(monkeypatch):
    monkeypatch.setenv("OMP_NUM_THREADS", "2")
    with single_threaded():
        assert blas_threads() == {2}


@pytest.mark.usefixtures("two_threads")
def test_the_limit_holds_while_a_pool_of_processes_is_open():
    with worker_pool(1), single_threaded():
        assert blas_threads() == {1}
    assert blas_threads() == {2}


@pytest.mark.usefixtures("two_threads")
def test_a_public_function_computes_on_one_thread():
    during = []

    class Watching(memscal.GaussianMixture):
        def __getattribute__(self, name):
            during.append(blas_threads())
            return super().__getattribute__(name)

    kernel = Watching((1.0,), (0.56e-3,))
    during.clear()
    memscal.simulate(kernel=kernel, seed=1)
    assert during
    assert set.union(*during) == {1}


PROGRAM = """
import os, sys
from memscal.cli import main
main(["inspect", "missing.h5"])
print(os.environ.get("OPENBLAS_NUM_THREADS"), os.environ.get("OMP_NUM_THREADS"))
"""


@pytest.mark.parametrize(("user", "printed"), [({}, "1 1"), ({"OMP_NUM_THREADS": "2"}, "None 2")])
def test_the_command_line_starts_one_thread(user, printed):
    environment = {k: v for k, v in os.environ.items() if k not in THREAD_VARIABLES} | user
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM], capture_output=True, text=True, check=True, env=environment
    )
    assert run.stdout.strip() == printed
