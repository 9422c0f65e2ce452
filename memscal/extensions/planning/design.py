"""Planning of a scan that is not made yet: its expected uncertainties, and the least that suffices.

The Gaussian's parameters have the covariance of the inverse Fisher information at the true ones
(the bound of Cramer and Rao).  Departures are weighed as in :mod:`memscal.estimation.bayesian`,
with the expected squares of signal plus noise in place of the data's own.
"""

import math
from bisect import bisect_left
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import field, replace
from functools import partial

import numpy as np

from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel
from memscal.calibration.calibrate import uncertainties
from memscal.calibration.stages import Solution, solved
from memscal.calibration.uncertainty import Results, input_effects
from memscal.deconvolution.division import Method, MethodName, chosen_method
from memscal.errors import FitError, InputError
from memscal.estimation.bayesian import supported, weigh_departures
from memscal.estimation.departures import ReducedScan, departure_basis
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import fit_gaussian_to_points
from memscal.estimation.points import calibration_points
from memscal.estimation.profile import ProfileEstimate, require_significant
from memscal.estimation.reference_spectra import reference_spectra
from memscal.estimation.set_up import reference_profile
from memscal.extensions.simulation.rod_scan import PAPER_FILM, PAPER_ROD
from memscal.extensions.simulation.sensor import blurred_stress
from memscal.mechanics.press_rod import press_rod
from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import (
    FloatArray,
    FrozenArrays,
    Values,
    array_record,
    keyword_value_record,
    require_non_negative,
    require_positive,
)
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.result import Result
from memscal.model.scan import Scan
from memscal.parallel import single_threaded
from memscal.progress import Task, nobody, reported, reporting
from memscal.readings.mistaken_unit import require_plausible

Targets = Mapping[str, float]
"""What is wanted of a plan, by name."""

#: As many as a simulated scan may have.
MOST_POSITIONS = 4096
#: A range that is a whole number of steps but for rounding is one.
_ROUNDING = 1e-6
#: An apparatus function that takes less than this from every wave that a film passes is a point.
_A_POINT = 1e-3
#: The film passes nothing beyond exp(-kh) of this.
_LARGEST_KH = 20.0


@keyword_value_record
class Plan:
    """A line scan to be made; the attributes are the arguments of :func:`memscal.design`.

    ``load_uncertainty`` and ``noise`` are relative, to the load and to the signal with the rod
    right above the sensor; ``noise_voltage`` (V) replaces ``noise``.  Positions run from minus to
    plus ``half_range``, or to the last whole step within.  What is ``None``
    the scan will not state.

    >>> Plan(step=0.5e-3, repeats=2).positions
    33
    """

    film: ElasticFilm = PAPER_FILM
    rod: Rod = PAPER_ROD
    kernel: RadialKernel = field(default_factory=GaussianMixture)
    conversion_constant: float = 1e-7
    load: float = 1.0
    load_uncertainty: float | None = 0.01
    step: float = 0.25e-3
    half_range: float = 8e-3
    repeats: int = 1
    noise: float = 0.005
    noise_voltage: float | None = None
    centre: float = 0.0
    rod_friction: float | None = None
    position_scale_uncertainty: float | None = None
    line_offset_uncertainty: float | None = None
    roundness_uncertainty: float | None = None

    def __post_init__(self) -> None:
        require_positive("step of the scan", self.step, "m")
        require_positive("half range of the scan", self.half_range, "m")
        require_positive("load", self.load, "N")
        require_positive("conversion constant", self.conversion_constant, "V/Pa")
        require_non_negative("relative standard uncertainty of the load", self.load_uncertainty)
        if self.repeats < 1 or self.repeats != int(self.repeats):
            raise InputError(
                f"The scan would be repeated {self.repeats} times.",
                cure="Give a whole number of repeats, one or more.",
            )
        noise = self.noise if self.noise_voltage is None else self.noise_voltage
        if not 0 < noise < math.inf:
            raise InputError(
                f"The noise of the planned scan is {noise:g}.",
                why="Without noise there is no uncertainty to expect, and no scan is without.",
                cure="Give its standard deviation: a share of the largest signal (0.005: half a "
                "percent), or a voltage; measure it with the rod at rest.",
            )
        k = _LARGEST_KH / self.film.thickness
        if abs(1 - self.kernel.transform(np.array([k]))[0]) < _A_POINT:
            raise InputError(
                f"The apparatus function is a point to a film of {self.film.thickness * 1e3:.4g} "
                "mm: it blurs nothing of what the film passes.",
                why="No scan would tell its width.",
                cure="Check its unit: widths are in metres (um on the command line).",
            )
        if not abs(self.centre) <= self.half_range:
            raise InputError(
                f"The scan would reach {self.half_range * 1e3:.4g} mm to either side, but the "
                f"sensor is expected at {self.centre * 1e3:.4g} mm.",
                why="A sensor that is not passed over is not calibrated.",
                cure="Scan farther, or about the sensor.",
            )
        if self.positions > MOST_POSITIONS:
            raise InputError(
                f"A step of {self.step * 1e3:.4g} mm over {self.half_range * 1e3:.4g} mm to either "
                f"side makes {self.positions} positions; at most {MOST_POSITIONS} are planned.",
                cure="Give the step and the half range in metres (mm on the command line).",
            )

    @property
    def positions(self) -> int:
        """How many positions the line has."""
        return math.floor(2 * self.half_range / self.step * (1 + _ROUNDING)) + 1

    @property
    def signal(self) -> float:
        """Voltage to expect with the rod right above the sensor, in V."""
        return float(self._voltages(np.array([0.0, self.half_range]))[0])

    @property
    def point_noise(self) -> float:
        """Standard deviation of one voltage, in V."""
        return self.noise * self.signal if self.noise_voltage is None else self.noise_voltage

    def _voltages(self, distance: FloatArray) -> FloatArray:
        """Voltages to expect at distances (m) of the rod from the sensor, in V."""
        contact = press_rod(self.film.expected, self.rod, self.load, self.rod_friction)
        stress = blurred_stress([contact], self.kernel, distance)[0]
        return np.asarray(self.conversion_constant * stress)

    def scan(self) -> Scan:
        """Return the expected mean of all repeats: without noise, whose size is stated."""
        count = self.positions
        x = np.linspace(-1.0, 1.0, count) * self.step * (count - 1) / 2
        scan = Scan(
            x=x,
            u_zz=np.zeros(count),
            film=self.film,
            indenter=self.rod,
            load=self.load,
            load_uncertainty=self.load_uncertainty and self.load_uncertainty * self.load,
            rod_friction=self.rod_friction,
            position_scale_uncertainty=self.position_scale_uncertainty,
            line_offset_uncertainty=self.line_offset_uncertainty,
            roundness_uncertainty=self.roundness_uncertainty,
            title="Planned rod scan",
        )
        require_plausible(scan)
        noise = self.point_noise / math.sqrt(self.repeats)
        voltages = self._voltages(np.abs(x - self.centre))
        return replace(scan, u_zz=voltages, u_zz_errors=np.full(count, noise))


def expected_calibration(plan: Plan, method: Method) -> tuple[Solution, Results]:
    """Calibrate the planned scan, with expected squares in place of data: steps and results."""
    scan = plan.scan()
    stress = reference_profile(scan, None)
    points = calibration_points(scan)
    model = ForwardModel(points, reference_spectra([stress], [points]))
    assert points.u_errors is not None  # the plan's: the voltages themselves have none
    weights = 1 / points.u_errors**2
    fit = fit_gaussian_to_points(model, weights, start=fit_gaussian_to_points(model, weights))
    reduced = ReducedScan.of(model, fit, weights)
    basis = departure_basis(fit, reduced)
    count = plan.repeats * weights.size
    weighed = weigh_departures(reduced, basis, count, expected_noise=1.0).average()
    ones = np.ones_like(weights)
    estimate = ProfileEstimate(model, fit, *supported(basis, weighed), weights, ones, basis)
    require_significant(estimate, "Plan a larger half range, more repeats, or a larger load.")
    solution = solved([scan], [stress], estimate, method)
    effects = input_effects([scan], [stress], estimate)
    return solution, uncertainties(solution, solution.deconvolution, effects, {})


@array_record
class Design(Result, FrozenArrays):
    """A planned scan and its expected results, with standard uncertainties (k = 1).

    Parameters
    ----------
    plan, method : Plan, str
        The scan, and how it would be evaluated.
    parameters : ParameterSet
        What a calibration states, in expectation: ``conversion_constant`` (V/Pa),
        ``gaussian_sigma``, ``fwhm`` (m) and more, with their joint covariance.
    budget : mapping
        Standard uncertainty of A and of the widths by source, in SI units.  ``noise`` scatters
        from scan to scan; ``regularisation`` is what no repeated scan would show: the shapes of G
        that the film hides.
    r, g, g_errors : ndarray, shape (n,)
        G to expect, in 1/m^2, at radii in m.
    k, transfer, transfer_errors : ndarray, shape (m,)
        Its transfer function at wavenumbers in rad/m; the scan would determine G up to
        ``resolved_wavenumber``.
    want : mapping of str to float
        What the plan was varied to reach.

    Examples
    --------
    >>> import memscal
    >>> planned = memscal.design(noise=0.01, repeats=2)
    >>> planned.largest_source("gaussian_sigma")
    'thickness'
    """

    plan: Plan
    method: str
    parameters: ParameterSet
    budget: Mapping[str, Mapping[str, float]]
    r: FloatArray
    g: FloatArray
    g_errors: FloatArray
    k: FloatArray
    transfer: FloatArray
    transfer_errors: FloatArray
    resolved_wavenumber: float
    want: Targets = field(default_factory=dict)

    def __repr__(self) -> str:
        """Return the plan and its main numbers in place of arrays."""
        shares = ", ".join(
            f"u({symbol})/{symbol} = {self.relative_uncertainty(name):.2%}"
            for symbol, name in (("A", "conversion_constant"), ("sigma", "gaussian_sigma"))
        )
        return (
            f"<Design of {self.plan.positions} positions every {self.plan.step * 1e3:.4g} mm, "
            f"{self.plan.repeats} repeat{'s' if self.plan.repeats > 1 else ''}: {shares}>"
        )

    def relative_uncertainty(self, name: str) -> float:
        """Return the standard uncertainty of a parameter over its value."""
        return abs(self.parameters.uncertainty(name) / self.parameters[name])

    def largest_source(self, name: str) -> str:
        """Return the source that contributes most to a budgeted parameter."""
        return max(self.budget[name], key=self.budget[name].__getitem__)


def evaluate(plan: Plan, method: str | Method = "bayesian", seed: int = 0) -> Design:
    """Return what to expect of a plan by a method; ``seed`` for one that draws random numbers."""
    chosen = chosen_method(method, seed=seed)
    solution, results = expected_calibration(plan, chosen)
    deconvolution = solution.deconvolution
    k, transfer = solution.transfer
    return Design(
        plan=plan,
        method=chosen.name,
        parameters=results.parameters,
        budget=results.budget,
        r=deconvolution.g.r,
        g=deconvolution.g.radial,
        g_errors=np.sqrt(np.diag(results.radial_covariance)),
        k=k,
        transfer=transfer,
        transfer_errors=results.transfer_errors,
        resolved_wavenumber=solution.band.resolved,
    )


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
    "rod_friction": "State whether the film sticks under the rod, or lower the load.",
    "noise": "Lower the noise, or raise the load.",
    "regularisation": "It is what the film hides of G: a thinner film shows more of it, and so do "
    "less noise and a finer step.",
}


def require_targets(want: Targets, vary: str | None) -> dict[str, float]:
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
        if value >= 1 and full != TARGETS["resolved"]:
            raise InputError(
                f"The {name} is wanted to {value:.0%}, which is no uncertainty of use.",
                cure="Give the relative uncertainty: 0.01 is 1 %.",
            )
        named[full] = value
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
    plan: Plan, targets: Targets, vary: str, evaluate: Callable[[Plan], Design]
) -> Design:
    """Find the coarsest step, the shortest range or the fewest repeats that reach the targets."""
    what, fewest, most, plan_of = _search(plan, vary)
    tried: dict[int, Design | None] = {}
    # As many as it can take to pass the number that is searched, and to close in on it.
    task = Task("plans", math.ceil(math.log(most / fewest, _GROWTH) + math.log2(most)))

    def meets(count: int) -> bool:
        if count not in tried:
            # None where the plan determines nothing, or does not sample G.
            tried[count] = None
            attempt = plan_of(count)
            with suppress(FitError), reporting(nobody):
                design = evaluate(attempt)
                samples = attempt.step <= _WIDEST_STEP * design.parameters["gaussian_sigma"]
                tried[count] = design if samples else None
            task.tell(len(tried))
        found = tried[count]
        return found is not None and all(
            _progress(found, *target) >= 1 for target in targets.items()
        )

    fails = fewest - 1
    works = fewest
    while not meets(works):
        if works == most:
            raise _out_of_reach(what, targets, [d for d in tried.values() if d is not None])
        fails = works
        works = min(max(works + 1, round(_GROWTH * works)), most)
    works = fails + 1 + bisect_left(range(fails + 1, works), True, key=meets)
    least = tried[works]
    assert least is not None  # it meets the targets
    return least


def _search(plan: Plan, vary: str) -> tuple[str, int, int, Callable[[int], Plan]]:
    """Return what to vary in words, its least and most count, and the plan of a count."""
    step = plan.step
    width = 2 * plan.half_range
    off = abs(plan.centre)
    if vary == "repeats":
        return vary, 1, _MOST_REPEATS, lambda count: replace(plan, repeats=count)
    least = _FEWEST_POSITIONS
    most = _MOST_POSITIONS
    if vary == "step":
        return vary, least, most, lambda count: replace(plan, step=width / (count - 1))
    # The sensor has to lie within.
    least = max(least, int(np.ceil(2 * off / step)) + 1)
    most = max(min(most, int(2 * (off + _FARTHEST * plan.film.thickness) / step) + 1), least)
    return "half range", least, most, lambda n: replace(plan, half_range=step * (n - 1) / 2)


def _reached(design: Design, name: str) -> float:
    if name == "resolved_wavenumber":
        return design.resolved_wavenumber
    return design.relative_uncertainty(name)


def _progress(design: Design, name: str, value: float) -> float:
    """Return how near a target is, or by how much it is surpassed: 1 where it is just met."""
    reached = _reached(design, name)
    return reached / value if name == "resolved_wavenumber" else value / reached


def _in_words(name: str, value: float) -> str:
    if name == "resolved_wavenumber":
        return f"a resolved wavenumber of {value * 1e-3:.4g} rad/mm"
    short = next(key for key, full in TARGETS.items() if full == name)
    return f"a standard uncertainty of {short} of {value * 100:.3g} %"


def _out_of_reach(what: str, targets: Targets, tried: list[Design]) -> FitError:
    if not tried:
        return FitError(
            f"No {what} makes a scan that can be calibrated with.",
            cure="Plan more repeats, less noise, a larger load or a larger half range.",
        )
    name = next(n for n, v in targets.items() if _progress(tried[-1], n, v) < 1)
    best = max(tried, key=partial(_progress, name=name, value=targets[name]))
    goal = _in_words(name, targets[name])
    reached = _in_words(name, _reached(best, name))
    count = f"{best.plan.repeats} repeats"
    if what != "repeats":
        length = best.plan.step if what == "step" else best.plan.half_range
        count = f"a {what} of {length * 1e3:.4g} mm"
    problem = (
        f"{goal[0].upper()}{goal[1:]} is out of reach by the {what} alone: the best is {reached}, "
        f"with {count}."
    )
    if name == "resolved_wavenumber":
        step = best.plan.step
        sampled = np.pi / step
        if best.resolved_wavenumber >= 0.99 * sampled:
            return FitError(
                problem,
                why=f"A step of {step * 1e3:.4g} mm samples no more than {sampled * 1e-3:.4g} "
                "rad/mm.",
                cure="Plan a finer step.",
            )
        return FitError(
            problem,
            why=f"A film of {best.plan.film.thickness * 1e3:.4g} mm passes little of larger "
            "wavenumbers, and noise hides it.",
            cure="Plan less noise, a larger load, or a thinner film.",
        )
    source = best.largest_source(name)
    share = best.budget[name][source] / abs(best.parameters[name])
    return FitError(
        problem,
        why=f"{source} alone contributes {share * 100:.3g} %.",
        cure=_CURES.get(source, "Reduce that contribution, or want less."),
    )


@reported
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
    rod_friction: float | None = None,
    position_scale_uncertainty: float | None = None,
    line_offset_uncertainty: float | None = None,
    roundness_uncertainty: float | None = None,
    method: MethodName | Method = "bayesian",
    seed: int = 0,
    want: Targets | None = None,
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
    rod_friction : float, optional
        What the scan will state: 0, the film slides under the rod; ``inf``, it sticks.
    position_scale_uncertainty, line_offset_uncertainty, roundness_uncertainty : float, optional
        Likewise, as of a :class:`memscal.Scan`.
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
    0.036
    >>> planned.largest_source("gaussian_sigma")
    'thickness'
    >>> finer = memscal.design(noise=0.01, want={"sigma": 0.0335}, vary="repeats")
    >>> finer.plan.repeats
    2
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
        rod_friction=rod_friction,
        position_scale_uncertainty=position_scale_uncertainty,
        line_offset_uncertainty=line_offset_uncertainty,
        roundness_uncertainty=roundness_uncertainty,
    )
    evaluated = partial(evaluate, method=method, seed=seed)
    planned = evaluated(plan) if vary is None else least_design(plan, targets, vary, evaluated)
    return replace(planned, want=dict(want or {}))


def varied_designs(planned: Design, vary: str, values: Sequence[float]) -> list[Design]:
    """Return the designs with one number of the plan (SI) replaced; unusable plans are left out."""
    designs = []
    for value in Task("plans", len(values)).counted(values):
        changes: Values = {vary: value}
        with suppress(FitError), reporting(nobody):
            designs.append(evaluate(replace(planned.plan, **changes), planned.method))
    return designs
