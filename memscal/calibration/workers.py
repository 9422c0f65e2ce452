"""Processes that share work: started afresh on every system, with one thread of BLAS each."""

from __future__ import annotations

import os
from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from multiprocessing import get_context
from numbers import Integral
from typing import Any

from memscal.errors import InputError
from memscal.threads import THREAD_VARIABLES

__all__ = ["require_workers", "worker_pool"]

#: Systems refuse more, and no machine gains by them.
_MOST_WORKERS = 61


def require_workers(workers: Any) -> None:
    """Refuse a number of processes that makes no sense.

    Raises
    ------
    InputError
        If it is no whole number from 1 to 61.
    """
    if not isinstance(workers, Integral) or not 1 <= int(workers) <= _MOST_WORKERS:
        raise InputError(
            f"workers is {workers!r}, but it is a whole number from 1 to {_MOST_WORKERS}.",
            cure="Give one process per core, at the most.",
        )


@contextmanager
def worker_pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Yield a pool of processes.

    A process forked from one with threads may hang, so each is started afresh.  Matrices here are
    small: threads of BLAS in every process would only wait for each other.  Their number is read
    when a process starts, from the environment, which is put back afterwards.
    """
    unset = [name for name in THREAD_VARIABLES if name not in os.environ]
    os.environ.update(dict.fromkeys(unset, "1"))
    try:
        with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:
            yield pool
    finally:
        for name in unset:
            os.environ.pop(name, None)
