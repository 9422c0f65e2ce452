"""Processes that share work, each with one thread of the linear algebra library."""

from __future__ import annotations

import os
import sys
from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sized
from contextlib import ExitStack, contextmanager
from functools import cache
from itertools import chain, islice, repeat
from numbers import Integral
from threading import Thread
from typing import TYPE_CHECKING, Any

from memscal.errors import InputError, MemscalError

if TYPE_CHECKING:
    from concurrent.futures import Executor, Future
    from multiprocessing.connection import Connection

    from threadpoolctl import ThreadpoolController

#: What OpenBLAS, OpenMP, MKL and Accelerate read when they are loaded.
THREAD_VARIABLES = (
    "OPENBLAS_NUM_THREADS",
    "OMP_NUM_THREADS",
    "MKL_NUM_THREADS",
    "VECLIB_MAXIMUM_THREADS",
)


def one_thread_per_process() -> None:
    """Have BLAS start one thread, unless the user set a number or numpy is loaded already."""
    if "numpy" not in sys.modules and not os.environ.keys() & THREAD_VARIABLES:
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
    if os.environ.keys() & THREAD_VARIABLES:
        yield
    else:
        with _controller().limit(limits=1, user_api="blas"):  # some 25 us
            yield


_MOST_WORKERS = 512


def cores() -> int:
    """Return how many cores this process may use, of which a machine can have more."""
    available = getattr(os, "sched_getaffinity", None)
    return min(len(available(0)) if available else os.cpu_count() or 1, _MOST_WORKERS)


def require_workers(workers: Any) -> None:
    """Refuse a number of processes that is not whole, or out of range."""
    if not isinstance(workers, Integral) or not 1 <= int(workers) <= _MOST_WORKERS:
        raise InputError(
            f"workers is {workers!r}, but it is a whole number from 1 to {_MOST_WORKERS}.",
            cure="Give one process per core, at the most.",
        )


@contextmanager
def worker_pool(workers: int) -> Iterator[Executor]:
    """Yield a pool of processes; they end with this one, however it ends."""
    import signal
    from multiprocessing import Pipe, resource_tracker

    from loky import ProcessPoolExecutor

    # loky starts them afresh, for one forked from one with threads may hang, and without this
    # one's script, which needs no guard then.  A worker that grows by a large scan does not leak.
    environment = {name: "1" for name in THREAD_VARIABLES if name not in os.environ}
    environment["LOKY_MAX_MEMORY_LEAK_SIZE"] = "1e18"
    watched, lifeline = Pipe(duplex=False)
    pool = ProcessPoolExecutor(workers, initializer=_watch, initargs=(watched,), env=environment)
    try:
        # Ctrl-C is this process's affair: workers inherit that it is blocked while they start.
        resource_tracker.ensure_running()  # at its own start it would lift the block
        blocked = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
        try:
            pool.submit(int)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, blocked)
        with workers_that_last():
            yield pool
            pool.shutdown()
    finally:
        lifeline.close()  # ends the workers at once, where their work is not wanted any more
        pool.shutdown()
        watched.close()


def _watch(lifeline: Connection) -> None:
    """Have a worker end with its parent, whose end of the pipe closes with it."""

    def end() -> None:
        try:
            lifeline.poll(None)
        finally:
            os._exit(1)

    Thread(target=end, daemon=True).start()


#: Items that a task has at the most; tasks in flight for each worker.
_LARGEST_CHUNK = 16
_TASKS = 4
#: Workers of an executor that does not say how many it has; seconds that a cluster has to answer.
_WORKERS = 64
_CONNECTING = 30


def shared(
    function: Callable[[Any], Any],
    items: Iterable[Any],
    *,
    workers: int,
    executor: Executor | None = None,
) -> Iterator[Any]:
    """Yield what a function returns for each item, in their order; one worker is this process."""
    # Items are taken as workers become free, so that neither they nor results pile up.
    source = iter(items)
    tasks = deque["Future[list[Any]]"]()
    if executor is not None:
        workers = getattr(executor, "_max_workers", None) or _WORKERS
    size = _LARGEST_CHUNK
    first = list[int]()
    if isinstance(items, Sized):
        size = max(2, min(size, len(items) // (4 * workers)))
        workers = min(workers, -(-len(items) // size))
    else:  # the first tasks are small, for there may be no more
        first = sorted([1, 2, 4, 8] * workers)
    failed: list[BaseException] = []
    chunks = _chunks(source, chain(first, repeat(size)), failed)
    if executor is None and workers < 2:
        yield from map(function, source)
        return
    with ExitStack() as stack:
        stack.enter_context(workers_that_last())
        pool = executor or stack.enter_context(worker_pool(workers))
        try:
            while True:
                some = islice(chunks, _TASKS * workers - len(tasks))
                tasks.extend(pool.submit(_each, function, chunk) for chunk in some)
                if not tasks:
                    break
                yield from tasks.popleft().result()
        finally:
            for task in tasks:
                task.cancel()
        if failed:
            raise failed[0]


def _chunks(
    source: Iterator[Any], sizes: Iterable[int], failed: list[BaseException]
) -> Iterator[list[Any]]:
    """Cut items into chunks; what the source raises is kept until those before it are done."""
    for size in sizes:
        chunk = []
        try:
            for item in islice(source, size):
                chunk.append(item)  # noqa: PERF402 - what there is before the source fails
        except Exception as failure:  # noqa: BLE001 - raised when the rest is done
            failed.append(failure)
        if chunk:
            yield chunk
        if failed or len(chunk) < size:
            return


def _each(function: Callable[[Any], Any], items: list[Any]) -> list[Any]:
    return [function(item) for item in items]


@contextmanager
def cluster(address: str) -> Iterator[tuple[Executor, Callable[[], int]]]:
    """Yield the executor of a Dask cluster, and how many tasks keep its threads busy just now."""
    try:
        from distributed import Client

        client = Client(address, timeout=_CONNECTING)
    except ModuleNotFoundError as error:
        raise MemscalError(
            "Dask (distributed) is not installed.",
            cure='Install it with the extra "fleet": pip install ".[fleet]".',
        ) from error
    except (OSError, ValueError) as error:
        raise InputError(
            f"No scheduler answers at {address}: {error}",
            cure="Give the address that the scheduler states, such as tcp://node1:8786.",
        ) from error
    with client:
        executor = client.get_executor()
        try:
            yield executor, lambda: 2 * sum(client.nthreads().values()) + 8
        finally:
            executor.shutdown(wait=False)  # takes back what waits


@contextmanager
def workers_that_last() -> Iterator[None]:
    """Say in our words that a worker has ended before its work was done."""
    from concurrent.futures import BrokenExecutor

    try:
        yield
    except BrokenExecutor as failure:
        raise MemscalError(
            "A worker process ended before its work was done.",
            why="It was killed, ran out of memory, or could not load a class of your script.",
            cure="Give fewer workers, and keep classes of your own in a module that it imports.",
        ) from failure
