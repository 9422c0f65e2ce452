"""Calibration of many scans, in processes: a result or an error for each."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import partial
from os import PathLike
from typing import Any, ClassVar

from memscal.calibration.calibrate import calibrate
from memscal.deconvolution.division import chosen_method
from memscal.errors import InputError, MemscalError
from memscal.formats.opened import Scans
from memscal.model.apparatus import ApparatusRadial, ParameterSet
from memscal.model.checks import Message, QualityCheck
from memscal.model.result import Result
from memscal.model.scan import Scan
from memscal.parallel import in_processes, require_workers


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class FleetCalibration(Result):
    """The calibration of one scan of many, without its fields, or its error.

    ``pandas.concat(result.to_dataframe() for result in results)`` is the table of all scans.

    Parameters
    ----------
    index : int
        Its place among the scans.
    parameters : ParameterSet or None
        A and all other parameters with their covariance, in SI units.
    radial_profile : ApparatusRadial or None
        G with its standard uncertainty.
    resolved_wavenumber : float or None
        Up to which wavenumber the scan determines G, in rad/m.
    budget : mapping
        Standard uncertainties by source.
    checks : tuple of QualityCheck
        Quality checks.
    messages : tuple of Message
        Notes and warnings.
    error : MemscalError or None
        Why there is no result.
    """

    _summary: ClassVar[str] = "fleet"

    index: int
    parameters: ParameterSet | None = None
    radial_profile: ApparatusRadial | None = None
    resolved_wavenumber: float | None = None
    budget: Mapping[str, Mapping[str, float]]
    checks: tuple[QualityCheck, ...] = ()
    messages: tuple[Message, ...] = ()
    error: MemscalError | None = None

    def __repr__(self) -> str:
        """Return A, or the error."""
        if self.parameters is None:
            problem = self.error.problem if self.error is not None else "no result"
            return f"<FleetCalibration {self.index}: {problem}>"
        a = self.parameters.reading.constant(self.parameters["conversion_constant"])
        return f"<FleetCalibration {self.index}: A = {a}>"

    @property
    def passed(self) -> bool:
        """Whether there is a result, and every quality check passed."""
        return self.error is None and all(check.passed for check in self.checks)


def calibrate_many(
    scans: Iterable[Scans], *, workers: int = 1, **options: Any
) -> list[FleetCalibration]:
    """Calibrate with many scans, each by itself.

    Parameters
    ----------
    scans : iterable of Scan, path, or sequence of them
        Scans or their files; a sequence within counts as one, and is fitted together.
    workers : int, default 1
        Processes that share the work.  Where these are more than one, a script needs the usual
        ``if __name__ == "__main__":``.
    **options
        Options of :func:`memscal.calibrate`, the same for all.

    Returns
    -------
    list of FleetCalibration
        One for each scan, in their order.  A scan that cannot be used has its error in place.

    Raises
    ------
    InputError
        If the method, one of its options, or the number of processes is wrong.

    Examples
    --------
    >>> import memscal
    >>> scans = [memscal.simulate(noise=0.005, seed=seed) for seed in range(3)]
    >>> results = memscal.calibrate_many([*scans, "missing.h5"], method="bayesian")
    >>> [result.passed for result in results]
    [True, True, True, False]
    """
    require_workers(workers)
    if isinstance(scans, Scan | str | PathLike):
        cure = "Give a list of scans; calibrate one with memscal.calibrate(scan)."
        raise InputError("calibrate_many() was given one scan.", cure=cure)
    method, seed = options.get("method", "white-noise"), options.get("seed", 0)
    others = ("reference", "alternative", "channel", "method", "correlations", "seed", "relative")
    of_method = {name: value for name, value in options.items() if name not in others}
    chosen_method(method, of_method, seed=seed)
    task = partial(_calibrated, options=options)
    return list(in_processes(task, list(enumerate(scans)), workers))


def _calibrated(item: tuple[int, Scans], options: Mapping[str, Any]) -> FleetCalibration:
    """Calibrate one scan; an error is part of its result."""
    index, scan = item
    try:
        apparatus = calibrate(scan, **options).apparatus
    except MemscalError as failure:
        return FleetCalibration(index=index, budget={}, error=failure)
    except Exception as failure:  # noqa: BLE001 - the rest must go on
        error = MemscalError(
            f"Scan {index} met {type(failure).__name__}: {failure}",
            why="This should have been refused with a reason.",
            cure="Please report it, with the scan.",
        )
        return FleetCalibration(index=index, budget={}, error=error)
    return FleetCalibration(
        index=index,
        parameters=apparatus.parameters,
        radial_profile=apparatus.radial_profile,
        resolved_wavenumber=apparatus.resolved_wavenumber,
        budget=apparatus.budget,
        checks=apparatus.checks,
        messages=apparatus.process.messages,
    )
