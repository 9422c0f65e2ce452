"""Design of a calibration: uncertainties to expect of a scan, and the scan for a given one."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel
from memscal.deconvolution.division import Regulariser
from memscal.errors import FitError, InputError
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.parallel import single_threaded
from memscal.planning.expected import Design, Plan, evaluate
from memscal.simulation.rod_scan import PAPER_FILM, PAPER_ROD

TARGETS = {
    "A": "conversion_constant",
    "sigma": "gaussian_sigma",
    "fwhm": "fwhm",
    "resolved": "resolved_wavenumber",
}
"""Short and full names of what ``want`` may state: relative uncertainties and a wavenumber."""

VARIED = ("step", "half_range", "repeats")
"""What can be varied to reach it."""

_MOST_REPEATS = 10_000
#: More positions take long to evaluate; repeats lower the noise as well.
_MOST_POSITIONS = 513
#: Farther away, in thicknesses of the film, the signal has decayed.
_FARTHEST = 20
#: A step of more Gaussian widths does not sample G: its width then follows from the prior alone.
_WIDEST_STEP = 2.0
_FEWEST_POSITIONS = 6
_GROWTH = 1.6

#: What lowers the contribution of a source that more scanning does not lower.
_CURES = {
    "thickness": "Measure the film's thickness better.",
    "poisson_ratio": "Determine the film's Poisson's ratio better.",
    "rod_radius": "Measure the rod's radius better.",
    "load": "Determine the load better.",
    "noise": "Lower the noise, or raise the load.",
    "regularisation": "It is what the film hides of G: a thinner film shows more of it, and so do "
    "less noise and a finer step.",
}


@dataclass(frozen=True)
class _Search:
    """A number to vary: its name, its least and most count, and the plan of a count."""

    name: str
    least: int
    most: int
    plan: Callable[[int], Plan]

    def words(self, plan: Plan) -> str:
        """Return the number that a plan has."""
        if self.name == "repeats":
            return f"{plan.repeats} repeats"
        length = plan.step if self.name == "step" else plan.half_range
        return f"a {self.name} of {length * 1e3:.4g} mm"


def require_targets(want: Mapping[str, float], vary: str | None) -> dict[str, float]:
    """Return the targets by their full names; refuse unknown ones, and those without ``vary``."""
    named = {}
    for name, value in want.items():
        full = TARGETS.get(name, name)
        if full not in TARGETS.values():
            raise InputError(
                f"The design is wanted to reach {name!r}, which is no known target.",
                cure=f"Choose from {', '.join(TARGETS)}.",
            )
        if not 0 < value < np.inf:
            raise InputError(f"The {name} that is wanted is {value:g}, but it must be above zero.")
        named[full] = float(value)
    if vary is not None and vary not in VARIED:
        raise InputError(
            f"The design is to vary {vary!r}, which cannot be varied.",
            cure=f"Choose from {', '.join(VARIED)}.",
        )
    if bool(named) != (vary is not None):
        raise InputError(
            "want and vary go together: a target needs something to vary.",
            cure=f"Give both want and vary (one of {', '.join(VARIED)}), or neither.",
        )
    return named


def least_design(
    plan: Plan, targets: Mapping[str, float], vary: str, evaluate: Callable[[Plan], Design]
) -> Design:
    """Find the coarsest step, the shortest range or the fewest repeats that reach the targets."""
    search = _search(plan, vary)
    tried: dict[int, Design | None] = {}

    def meets(count: int) -> bool:
        if count not in tried:
            tried[count] = _attempt(search.plan(count), evaluate)
        design = tried[count]
        return design is not None and all(_met(design, *target) for target in targets.items())

    fails, works = search.least - 1, search.least
    while not meets(works):
        if works == search.most:
            raise _out_of_reach(search, targets, [d for d in tried.values() if d is not None])
        fails, works = works, min(max(works + 1, round(_GROWTH * works)), search.most)
    while works - fails > 1:
        middle = (works + fails) // 2
        fails, works = (fails, middle) if meets(middle) else (middle, works)
    least = tried[works]
    assert least is not None
    return least


def _search(plan: Plan, vary: str) -> _Search:
    step, width, off = plan.step, 2 * plan.half_range, abs(plan.centre)
    if vary == "repeats":
        return _Search(vary, 1, _MOST_REPEATS, lambda count: replace(plan, repeats=count))
    least, most = _FEWEST_POSITIONS, _MOST_POSITIONS
    if vary == "step":
        return _Search(vary, least, most, lambda count: replace(plan, step=width / (count - 1)))
    # The sensor has to lie within.
    least = max(least, int(np.ceil(2 * off / step)) + 1)
    most = max(min(most, int(2 * (off + _FARTHEST * plan.film.thickness) / step) + 1), least)
    return _Search(
        "half range", least, most, lambda count: replace(plan, half_range=step * (count - 1) / 2)
    )


def _attempt(plan: Plan, evaluate: Callable[[Plan], Design]) -> Design | None:
    """Return the design, or nothing where the plan determines nothing, or does not sample G."""
    try:
        design = evaluate(plan)
    except FitError:
        return None
    return design if plan.step <= _WIDEST_STEP * design.parameters["gaussian_sigma"] else None


def _reached(design: Design, name: str) -> float:
    if name == "resolved_wavenumber":
        return design.resolved_wavenumber
    return design.relative_uncertainty(name)


def _met(design: Design, name: str, value: float) -> bool:
    reached = _reached(design, name)
    return reached >= value if name == "resolved_wavenumber" else reached <= value


def _in_words(name: str, value: float) -> str:
    if name == "resolved_wavenumber":
        return f"a resolved wavenumber of {value * 1e-3:.4g} rad/mm"
    short = next(key for key, full in TARGETS.items() if full == name)
    return f"a standard uncertainty of {short} of {value * 100:.3g} %"


def _out_of_reach(search: _Search, targets: Mapping[str, float], tried: list[Design]) -> FitError:
    """Return the error with the best that can be reached, and its limiting source."""
    if not tried:
        return FitError(
            f"No {search.name} makes a scan that can be calibrated with.",
            cure="Plan more repeats, less noise, a larger load or a larger half range.",
        )
    name = next(n for n, v in targets.items() if not _met(tried[-1], n, v))
    sign = -1 if name == "resolved_wavenumber" else 1
    best = min(tried, key=lambda design: sign * _reached(design, name))
    goal = f"{_in_words(name, targets[name])} is out of reach by the {search.name} alone"
    reached = f"{_in_words(name, _reached(best, name))}, with {search.words(best.plan)}"
    problem = f"{goal[0].upper()}{goal[1:]}: the best is {reached}."
    if name == "resolved_wavenumber":
        return _band_ends(best, problem)
    source = best.largest_source(name)
    share = best.budget[name][source] / abs(best.parameters[name])
    return FitError(
        problem,
        why=f"{source} alone contributes {share * 100:.3g} %.",
        cure=_CURES.get(source, "Reduce that contribution, or want less."),
    )


def _band_ends(best: Design, problem: str) -> FitError:
    step, sampled = best.plan.step * 1e3, np.pi / best.plan.step
    if best.resolved_wavenumber >= 0.99 * sampled:
        why = f"A step of {step:.4g} mm samples no more than {sampled * 1e-3:.4g} rad/mm."
        return FitError(problem, why=why, cure="Plan a finer step.")
    return FitError(
        problem,
        why=f"A film of {best.plan.film.thickness * 1e3:.4g} mm passes little of larger "
        "wavenumbers, and noise hides it.",
        cure="Plan less noise, a larger load, or a thinner film.",
    )


@single_threaded()
def design(
    *,
    film: ElasticFilm = PAPER_FILM,
    rod: Rod = PAPER_ROD,
    kernel: RadialKernel | None = None,
    conversion_constant: float = 1e-7,
    load: float = 1.0,
    load_uncertainty: float | None = 0.01,
    step: float = 0.25e-3,
    half_range: float = 8e-3,
    repeats: int = 1,
    noise: float = 0.005,
    noise_voltage: float | None = None,
    centre: float = 0.0,
    method: str | Regulariser = "bayesian",
    seed: int = 0,
    want: Mapping[str, float] | None = None,
    vary: str | None = None,
) -> Design:
    r"""Predict the uncertainties of a calibration from a line scan that is not made yet.

    The covariance of the Gaussian's parameters is :math:`(J^T J/\sigma^2)^{-1}` (the bound of
    Cramer and Rao); departures from a Gaussian are weighed as a calibration does.

    Parameters
    ----------
    film, rod : ElasticFilm, Rod
        Film and rod with their stated uncertainties; the paper's.
    kernel, conversion_constant : RadialKernel, float
        G to expect, the paper's Gaussian of 561 um where absent, and A in V/Pa.
    load, load_uncertainty : float
        Load in N and its relative standard uncertainty.
    step, half_range, repeats : float, float, int
        Distance of neighbouring positions, and how far they reach to either side, in m; how often
        the line is scanned.
    noise, noise_voltage : float
        Standard deviation of one voltage, as a share of the signal with the rod right above the
        sensor, or in V in place of the share.
    centre : float
        Expected position of the sensor along the scan, in m.
    method, seed : str or Regulariser, int
        How the scan would be evaluated; seed of methods that draw random numbers.
    want : mapping of str to float, optional
        Relative standard uncertainties wanted of ``A``, ``sigma`` and ``fwhm``, at most, and
        ``resolved`` wavenumber, in rad/m, at least.
    vary : str, optional
        What to vary for them: ``step``, ``half_range`` or ``repeats``.  Found is the coarsest
        step, the shortest range or the fewest repeats.

    Returns
    -------
    Design
        The plan with its expected uncertainties, their sources, and the resolved band.

    Raises
    ------
    InputError
        If a number is out of range, the scan misses the sensor, or a target is unknown.
    FitError
        If the scan would not determine the parameters, or a target is out of reach: with the best
        that can be reached, and its limiting source.

    Examples
    --------
    >>> import memscal
    >>> planned = memscal.design(noise=0.01)
    >>> round(planned.relative_uncertainty("gaussian_sigma"), 3)
    0.031
    >>> planned.largest_source("gaussian_sigma")
    'thickness'
    >>> finer = memscal.design(noise=0.01, want={"sigma": 0.027}, vary="repeats")
    >>> finer.plan.repeats
    3
    """
    targets = require_targets(want or {}, vary)
    plan = Plan(
        film=film,
        rod=rod,
        kernel=GaussianMixture() if kernel is None else kernel,
        conversion_constant=conversion_constant,
        load=load,
        load_uncertainty=load_uncertainty,
        step=step,
        half_range=half_range,
        repeats=repeats,
        noise=noise,
        noise_voltage=noise_voltage,
        centre=centre,
    )
    evaluated = partial(evaluate, method=method, seed=seed)
    planned = evaluated(plan) if vary is None else least_design(plan, targets, vary, evaluated)
    return replace(planned, want=dict(want or {}))


def varied_designs(planned: Design, vary: str, values: Sequence[float]) -> list[Design]:
    """Return the designs with one number of the plan (SI) replaced; unusable plans are left out."""
    designs = []
    for value in values:
        changes: dict[str, Any] = {vary: int(value) if vary == "repeats" else float(value)}
        with suppress(FitError):
            designs.append(evaluate(replace(planned.plan, **changes), planned.method))
    return designs
