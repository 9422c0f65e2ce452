"""Threads of the linear algebra library (BLAS): one, because the matrices here are small."""

from __future__ import annotations

import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from functools import cache
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from threadpoolctl import ThreadpoolController

__all__ = ["THREAD_VARIABLES", "one_thread_per_process", "single_threaded"]

#: What OpenBLAS, OpenMP, MKL and Accelerate read when they are loaded.
THREAD_VARIABLES = (
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def _set_by_user() -> bool:
    return any(name in os.environ for name in THREAD_VARIABLES)


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
    """Run BLAS on one thread, also as a decorator; a number that the user set stays.

    Threads spin while they wait for each other.  On the matrices here, of a few hundred rows, that
    costs ten times the processor time of the work itself.
    """
    if _set_by_user():
        yield
    else:
        with _controller().limit(limits=1, user_api="blas"):  # some 25 us
            yield
