"""Processes that share work, each with one thread of the linear algebra library."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from numbers import Integral
from typing import TYPE_CHECKING, Any

from memscal.errors import InputError

if TYPE_CHECKING:
    from concurrent.futures import ProcessPoolExecutor

    from threadpoolctl import ThreadpoolController

#: What OpenBLAS, OpenMP, MKL and Accelerate read when they are loaded.
THREAD_VARIABLES = (
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


#: Those of them that an open pool has set, which the user has not.
_SET_BY_POOL: set[str] = set()


def _set_by_user() -> bool:
    return any(name in os.environ for name in THREAD_VARIABLES if name not in _SET_BY_POOL)


def one_thread_per_process() -> None:
    """Have BLAS start one thread, unless the user set a number or numpy is loaded already."""
    if "numpy" not in sys.modules and not _set_by_user():
        os.environ.update(dict.fromkeys(THREAD_VARIABLES, "1"))


@cache
def _controller() -> ThreadpoolController:
    """Return the handle on the loaded libraries, which takes milliseconds to find."""
    import scipy.linalg  # noqa: F401 - scipy brings a BLAS of its own, which has to be loaded
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def single_threaded() -> Iterator[None]:
    """Run BLAS on one thread, also as a decorator; a number that the user set stays."""
    # On matrices of a few hundred rows, waiting threads cost ten times the work's processor time.
    if _set_by_user():
        yield
    else:
        with _controller().limit(limits=1, user_api="blas"):  # some 25 us
            yield


#: Windows refuses more.
_MOST_WORKERS = 61


def require_workers(workers: Any) -> None:
    """Refuse a number of processes that is not whole, or out of range."""
    if not isinstance(workers, Integral) or not 1 <= int(workers) <= _MOST_WORKERS:
        problem = f"workers is {workers!r}, but it is a whole number from 1 to {_MOST_WORKERS}."
        raise InputError(problem, cure="Give one process per core, at the most.")


@contextmanager
def worker_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of processes, started afresh: one forked from one with threads may hang."""
    # BLAS reads its number of threads, one, from the environment, which is put back afterwards.
    from concurrent.futures import ProcessPoolExecutor
    from multiprocessing import get_context

    unset = [name for name in THREAD_VARIABLES if name not in os.environ]
    os.environ.update(dict.fromkeys(unset, "1"))
    _SET_BY_POOL.update(unset)
    try:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            yield pool
    finally:
        _SET_BY_POOL.difference_update(unset)
        for name in unset:
            os.environ.pop(name, None)


#: Items that a process takes at a time.
_LARGEST_CHUNK = 16


def in_processes(function: Callable[..., Any], items: Sequence[Any], workers: int) -> Iterator[Any]:
    """Yield what a function returns for each item, in their order; one worker is this process."""
    workers = min(workers, len(items))
    if workers < 2:
        yield from map(function, items)
        return
    chunk = max(1, min(_LARGEST_CHUNK, len(items) // (4 * workers)))
    with worker_pool(workers) as pool:
        yield from pool.map(function, items, chunksize=chunk)
