r"""Propagation of distributions (JCGM 101:2008, GUM Supplement 1), beside the first-order budget.

Each draw is a scan of the sensor that the calibration found: the voltages that it predicts, new
noise, and new values of every input whose uncertainty is stated, which the estimator does not
know of.  What scatters is compared with the same part of the budget: noise and inputs.  The rest
of a stated uncertainty, what regularisation hides, is an error that is the same in every draw:
it is counted, but no draw can show it.
"""

from __future__ import annotations

from dataclasses import dataclass
from numbers import Integral
from typing import TYPE_CHECKING, Any

from memscal.calibration.comparison import COVERAGE, TOLERANCE, Comparison, compared, judged
from memscal.calibration.coverage import shortest_interval, symmetric_interval
from memscal.calibration.disagreement import Blame
from memscal.calibration.draw_blocks import DrawModel, drawn_results
from memscal.calibration.replicate_results import REPLICATED
from memscal.calibration.workers import require_workers
from memscal.errors import InputError
from memscal.model.validation import FloatArray
from memscal.threads import single_threaded

if TYPE_CHECKING:
    from memscal.calibration.procedure import Calibration

__all__ = ["Comparison", "MonteCarlo", "monte_carlo"]

_METHODS = ("evidence", "white-noise", "tikhonov")
#: A point of less weight is an outlier.
_ORDINARY = 0.5


@dataclass(frozen=True, eq=False, repr=False)
class MonteCarlo:
    """Draws of a calibration; from :func:`monte_carlo`.

    Parameters
    ----------
    draws, seed : int
        How many there are, and their seed.
    sources : tuple of str
        What was drawn: noise, then the inputs whose uncertainty is stated.
    samples : ndarray, shape (draws, 5)
        A (V/Pa), both widths (m), full width at half maximum (m) and noise-equivalent area (m^2).
    comparisons : tuple of Comparison
        The same, summed up, beside the budget.
    r : ndarray, shape (n,)
        Radii of G, in m.
    g_mean, g_uncertainty : ndarray, shape (n,)
        Mean and standard deviation of G, in 1/m^2.
    g_symmetric, g_shortest : ndarray, shape (2, n)
        Coverage intervals of 95 % at each radius, in 1/m^2.
    g_first_order : ndarray, shape (n,)
        Standard uncertainty of G to first order in noise and inputs, in 1/m^2.
    messages : tuple of str
        What the numbers rest on.
    """

    draws: int
    seed: int
    sources: tuple[str, ...]
    samples: FloatArray
    comparisons: tuple[Comparison, ...]
    r: FloatArray
    g_mean: FloatArray
    g_uncertainty: FloatArray
    g_symmetric: FloatArray
    g_shortest: FloatArray
    g_first_order: FloatArray
    messages: tuple[str, ...]

    def __repr__(self) -> str:
        """Return what was drawn in place of the draws."""
        apart = [each.name for each in self.comparisons if not each.agrees]
        verdict = f"the budget does not do for {', '.join(apart)}" if apart else "the budget agrees"
        return f"<MonteCarlo: {self.draws} draws of {', '.join(self.sources)}; {verdict}>"

    @property
    def agrees(self) -> bool:
        """Whether every parameter agrees with its budget."""
        return all(each.agrees for each in self.comparisons)

    def __getitem__(self, name: str) -> Comparison:
        """Return the comparison of one parameter."""
        for each in self.comparisons:
            if each.name == name:
                return each
        raise InputError(f"{name} is not drawn.", cure=f"There are {', '.join(REPLICATED)}.")


@single_threaded()
def monte_carlo(
    calibration: Calibration, *, draws: int = 1000, seed: int = 0, workers: int = 1
) -> MonteCarlo:
    r"""Propagate the distributions of noise and inputs through a calibration.

    The estimator is expanded about the calibration's own scan
    (:class:`memscal.estimation.replicates.ReplicateEstimator`); the reference of each draw is
    that of its film and rod, solved exactly on a grid of their values.  Inputs are normal, cut
    off where no film is (a Poisson's ratio above 1/2), or rectangular (the model's form).

    Parameters
    ----------
    calibration : Calibration
        From :func:`memscal.calibrate`, by method evidence, white-noise or tikhonov; of lines, or
        of several scans.
    draws : int, default 1000
        How many; two or more.  The 95 % interval's ends are known to about
        :math:`3/\sqrt{M}` standard uncertainties.
    seed : int, default 0
        Every draw has a seed of its own, spawned from this one.
    workers : int, default 1
        Processes that share the draws; the draws do not depend on it.

    Returns
    -------
    MonteCarlo
        Means, standard uncertainties and coverage intervals beside the budget's.

    Raises
    ------
    InputError
        If a number is out of range, the method is not linear in the fields, or the scan is a
        raster.

    Examples
    --------
    >>> import memscal
    >>> calibration = memscal.calibrate(memscal.simulate(noise=0.003, seed=2), method="evidence")
    >>> found = memscal.monte_carlo(calibration, draws=400)
    >>> 0.8 < found["gaussian_sigma"].ratio < 1.25
    True
    """
    _check(calibration, draws, seed, workers)
    model = DrawModel.of(calibration)
    samples, g = drawn_results(model, draws, seed, workers)
    apparatus = calibration.apparatus
    comparisons = compared(apparatus.parameters, apparatus.budget, samples)
    blame = Blame(
        lambda only: drawn_results(model, draws, seed, workers, only=only)[0], model.table
    )
    sources = ("noise", *model.inputs.sources)
    return MonteCarlo(
        draws=draws,
        seed=seed,
        sources=sources,
        samples=samples,
        comparisons=tuple(
            judged(each, i, apparatus.budget[each.name], sources, draws, blame)
            for i, each in enumerate(comparisons)
        ),
        r=model.results.r,
        g_mean=g.mean(axis=0),
        g_uncertainty=g.std(axis=0, ddof=1),
        g_symmetric=symmetric_interval(g, COVERAGE),
        g_shortest=shortest_interval(g, COVERAGE),
        g_first_order=model.first_order(),
        messages=_messages(calibration, model, comparisons),
    )


def _check(calibration: Calibration, draws: Any, seed: Any, workers: int) -> None:
    for name, value, least in (("draws", draws, 2), ("seed", seed, 0)):
        if not isinstance(value, Integral) or int(value) < least:
            raise InputError(
                f"{name} is {value!r}, but it is a whole number from {least} on.",
                cure=f"Give {name}={least} or more.",
            )
    require_workers(workers)
    solution = calibration.solution
    name, points = solution.regulariser.name, solution.estimate.points
    if name not in _METHODS:
        raise InputError(
            f"The calibration is by method {name}; its draws would be divided one by one.",
            why="A draw is estimated at once with all others, without fields.",
            cure="Calibrate with method='evidence'.",
        )
    if points.planar and points.scans == 1:
        raise InputError(
            "The calibration is of a raster, whose G is read off the raster's own lattice.",
            why="Draws are of the profile, whose widths are not those of a coarse lattice.",
            cure="Draw a line of it, or use the first-order budget.",
        )


def _messages(
    calibration: Calibration, model: DrawModel, comparisons: list[Comparison]
) -> tuple[str, ...]:
    """What was drawn, and what no draw shows."""
    messages = []
    if not model.inputs.sources:
        messages.append("No input states an uncertainty: the draws are of noise alone.")
    elif len(calibration.solution.scans) > 1:
        messages.append(
            "Inputs of several scans are drawn by their first-order effects on the voltages."
        )
    hidden = [
        f"{1 - (each.first_order / each.stated) ** 2:.0%} of {each.name}"
        for each in comparisons
        if each.first_order < (1 - TOLERANCE) * each.stated
    ]
    if hidden:
        messages.append(
            "Not all of the stated uncertainty scatters: of its square, what regularisation hides "
            f"makes up {', '.join(hidden)}. It is the same error in every draw, so it is counted, "
            "but not drawn; the comparison is with the rest."
        )
    if (calibration.solution.estimate.outlier_weight < _ORDINARY).any():
        messages.append("Outliers keep their reduced weight in every draw.")
    return tuple(messages)
