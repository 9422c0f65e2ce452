"""Calibration of many scans, in processes: a result or an error for each."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence, Sized
from concurrent.futures import Executor
from dataclasses import dataclass
from functools import partial
from os import PathLike
from typing import Any, Literal, TypedDict, TypeVar, Unpack

from memscal.apparatus import ApparatusFunction
from memscal.calibration.calibrate import calibrate
from memscal.calibration.prepare import References
from memscal.calibration.uncertainty import Correlations
from memscal.deconvolution.division import Method, MethodName, chosen_method
from memscal.errors import InputError, MemscalError, require_names
from memscal.formats.opened import Scans
from memscal.model.film import FilmLaw
from memscal.model.scan import Scan
from memscal.parallel import cores, shared
from memscal.progress import Listener, Task, reporting

_Result = TypeVar("_Result")


class CalibrationOptions(TypedDict, total=False):
    """Options of :func:`memscal.calibrate` that many calibrations share."""

    reference: References
    alternative: References
    film_law: FilmLaw | None
    mooney_rivlin_ratio: float | None
    rod_friction: float | None
    channel: Literal["zz", "xz", "yz"]
    method: MethodName | Method
    options: Mapping[str, Any] | None
    centre: Literal["common", "per-repeat"] | None
    correlations: Correlations | None
    pixel_size: float | None
    free: Literal["thickness"] | Sequence[Literal["thickness"]]
    creep: Any
    seed: int
    override: bool
    accept_altered: bool
    relative: bool


@dataclass(frozen=True)
class FleetCalibration:
    """The calibration of one scan of many, or its error.

    Parameters
    ----------
    index : int
        Its place among the scans.
    apparatus : ApparatusFunction or None
        The result, compact: without G over the plane where that is round.
    error : MemscalError or None
        Why there is no result.

    Examples
    --------
    >>> import memscal
    >>> [result] = memscal.calibrate_many([memscal.simulate(seed=1)])
    >>> result.passed, result.apparatus.parameters.names[0]
    (True, 'conversion_constant')
    """

    index: int
    apparatus: ApparatusFunction | None
    error: MemscalError | None = None

    def __repr__(self) -> str:
        """Return A, or the error."""
        if self.apparatus is None:
            return f"<FleetCalibration {self.index}: {self.error and self.error.problem}>"
        return f"<FleetCalibration {self.index}: {self.apparatus!r}>"

    @property
    def passed(self) -> bool:
        """Whether there is a result, and every quality check passed."""
        return self.apparatus is not None and self.apparatus.passed


def calibrate_many(
    scans: Iterable[Scans],
    executor: Executor | None = None,
    *,
    progress: Listener = None,
    **options: Unpack[CalibrationOptions],
) -> Iterator[FleetCalibration]:
    """Calibrate with many scans, each by itself.

    Scans are taken as workers become free, a few at a time, so that their number does not count
    in memory.  A script needs no ``if __name__ == "__main__":``.

    Parameters
    ----------
    scans : iterable of Scan, path, or sequence of them
        Scans or their files, which a generator may yield; a sequence within counts as one, and is
        fitted together.
    executor : concurrent.futures.Executor, optional
        What calibrates: a pool of processes or threads, or that of a cluster, such as
        ``dask.distributed.Client(...).get_executor()``.  By default a process for each core.
    progress : callable or True, optional
        Told how many scans are done, where their number is known: :class:`memscal.Progress`.
    **options
        Options of :func:`memscal.calibrate`, the same for all.

    Returns
    -------
    iterator of FleetCalibration
        One for each scan, in their order.  A scan that cannot be used has its error in place.

    Raises
    ------
    InputError
        If the method, one of its options, or the executor is wrong.
    MemscalError
        From the iterator, if a worker process is killed.

    Examples
    --------
    >>> import memscal
    >>> scans = [memscal.simulate(seed=seed) for seed in range(3)]
    >>> results = memscal.calibrate_many([*scans, "missing.h5"], method="bayesian")
    >>> [result.passed for result in results]
    [True, True, True, False]
    """
    if isinstance(scans, Scan | str | PathLike):
        raise InputError(
            "calibrate_many() was given one scan.",
            cure="Give a list of scans; calibrate one with memscal.calibrate(scan).",
        )
    if not (executor is None or callable(getattr(executor, "submit", None))):
        raise InputError(
            f"The executor is of type {type(executor).__name__}, which takes no tasks.",
            cure="Give a concurrent.futures.Executor, or leave it out.",
        )
    known = CalibrationOptions.__annotations__
    require_names("calibrate_many() has no argument", options, known)
    method = options.get("method", "white-noise")
    chosen_method(method, options.get("options"), seed=options.get("seed", 0))
    task = partial(_calibrated, options=options)
    items = enumerate(scans)
    sized = list(items) if isinstance(scans, Sized) else items
    with reporting(progress):
        results = shared(task, sized, workers=cores(), executor=executor)
        return Task("scans", len(sized)).counted(results) if isinstance(sized, list) else results


def attempted(name: str, work: Callable[[], _Result]) -> _Result | MemscalError:
    """Return a result, or the error of the scan of that name, which is a result too."""
    try:
        return work()
    except MemscalError as failure:
        return failure
    except Exception as failure:  # noqa: BLE001 - the rest must go on
        return MemscalError(
            f"{name} met {type(failure).__name__}: {failure}",
            why="This should have been refused with a reason.",
            cure="Please report it, with the scan.",
        )


def _calibrated(item: tuple[int, Scans], options: CalibrationOptions) -> FleetCalibration:
    """Calibrate one scan; an error is part of its result."""
    index, scan = item
    found = attempted(f"Scan {index}", lambda: calibrate(scan, other=False, **options))
    if isinstance(found, MemscalError):
        return FleetCalibration(index, None, found)
    return FleetCalibration(index, found.apparatus.compact())
