"""Design of a calibration: what a scan would tell, and what scan tells what is wanted."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel
from memscal.deconvolution.problem import Regulariser
from memscal.errors import FitError
from memscal.laboratory.rod_scan import PAPER_FILM, PAPER_ROD
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.planning.outcome import Design, evaluate
from memscal.planning.plan import Plan
from memscal.planning.wishes import least_design, require_wishes
from memscal.threads import single_threaded

__all__ = ["design", "varied_designs"]


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
    method: str | Regulariser = "evidence",
    seed: int = 0,
    want: Mapping[str, float] | None = None,
    vary: str | None = None,
) -> Design:
    r"""Predict the uncertainties of a calibration from a line scan that is not made yet.

    The covariance is that of the linear model about the expected apparatus function,

    .. math::

        \mathrm{cov} = (J^T J/\sigma^2)^{-1}

    for the Gaussian's parameters (the bound of Cramer and Rao); beside it, departures from a
    Gaussian are weighed as a calibration does, with the expected squares of its data.  No scan is
    simulated, and nothing is drawn.

    Parameters
    ----------
    film, rod : ElasticFilm, Rod
        What is pressed on what, with the uncertainties that are known of it; the paper's.
    kernel : RadialKernel, optional
        The apparatus function to expect; the paper's Gaussian of 561 um where absent.
    conversion_constant : float
        A to expect, in V/Pa.
    load, load_uncertainty : float
        Load in N and its relative standard uncertainty.
    step, half_range : float
        Distance of neighbouring positions, and how far they reach to either side, in m.
    repeats : int
        How often the line is scanned.
    noise : float
        Standard deviation of one voltage, as a share of the signal with the rod right above the
        sensor.
    noise_voltage : float, optional
        The same in V, in place of the share.
    centre : float
        Expected position of the sensor along the scan, in m.
    method : str or Regulariser
        How the scan would be evaluated.
    seed : int
        Seed of methods that draw random numbers.
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
        If a number is out of range, the scan would not pass over the sensor, or a wish is
        unknown.
    FitError
        If the scan would not determine the parameters, or a wish is out of reach: with the best
        that can be reached, and what stands in the way.

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
    wishes = require_wishes(want or {}, vary)
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
    return evaluated(plan) if vary is None else least_design(plan, wishes, vary, evaluated)


def varied_designs(planned: Design, vary: str, values: Sequence[float]) -> list[Design]:
    """Return the designs with one number of the plan replaced, those that determine anything.

    Parameters
    ----------
    planned : Design
        The design about which to vary.
    vary : str
        ``step``, ``half_range`` (m) or ``repeats``.
    values : sequence of float
        In place of the plan's own.

    Raises
    ------
    InputError
        If a value is out of range.
    """
    found = []
    for value in values:
        given = int(value) if vary == "repeats" else float(value)
        try:
            found.append(evaluate(_with(planned.plan, vary, given), planned.method))
        except FitError:
            continue
    return found


def _with(plan: Plan, name: str, value: float) -> Plan:
    changed: dict[str, float] = {name: value}
    return replace(plan, **changed)  # type: ignore[arg-type]
