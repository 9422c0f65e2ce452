"""Monte Carlo propagation of distributions (JCGM 101:2008), compared with the first-order budget.

Each draw is a scan with new noise and other true inputs; it states the nominal ones.
"""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.special import ndtr, ndtri

from memscal.axisymmetry.hankel import RadialSpectrum, quotient
from memscal.calibration.calibrate import Calibration, uncertainties
from memscal.calibration.stages import Solution, solve
from memscal.calibration.uncertainty import (
    BUDGETED,
    CURVATURE,
    NOT_RANDOM,
    Correlations,
    Effects,
    correlation_matrix,
    drawn_about,
    expected_values,
    read_off,
)
from memscal.deconvolution.division import require_count
from memscal.errors import FitError, InputError, MemscalError
from memscal.estimation.points import measured_mask
from memscal.estimation.reference_spectra import RECTANGLE, law_at_once, rod_spectrum
from memscal.model.arrays import Arrays, FloatArray, array_record, value_record
from memscal.model.checks import OUTLIER_WEIGHT, Message
from memscal.model.notation import VOLTS, Reading
from memscal.model.result import Tabulated
from memscal.model.scan import Scan
from memscal.parallel import require_workers, shared, single_threaded
from memscal.progress import Listener, Task, reported


@value_record
class SolvedInput:
    """An uncertain property of the film or rod (``component``) that the rod is solved for."""

    source: str
    scans: tuple[int, ...]
    component: str
    attribute: str
    value: float
    u: float
    bounds: tuple[float, float]

    def truncated(self, standard: FloatArray) -> FloatArray:
        """Turn normal draws into those of the normal distribution without impossible values."""
        low, high = ndtr((np.array(self.bounds) - self.value) / self.u)
        return np.asarray(ndtri(low + (high - low) * ndtr(standard)))


@array_record
class DrawnScans:
    """Model that turns random numbers into scans of a calibrated sensor, and calibrates them."""

    solution: Solution
    effects: Effects
    correlations: Correlations
    seed: int

    def result(self, index: int) -> FloatArray | str:
        """Parameters and G of a draw, in one row, or why it failed."""
        try:
            first = self.solution
            channel = first.estimate.points.channel
            drawn = solve(self.draw(index), first.stresses, first.method, channel)
            return self._results_of(drawn) + self._shift_by_law(index)
        except MemscalError as failure:
            return failure.problem

    def draw(self, index: int) -> list[Scan]:
        """Return the scans of one draw."""
        rng, standard = self._random(index)
        estimate = self.solution.estimate
        points = estimate.points
        noise = rng.standard_normal(points.u.size)
        if estimate.correlation is not None:
            noise = estimate.correlation.correlate(noise)
        deviations = points.curvature[points.curved]
        curvatures = deviations * rng.standard_normal(deviations.size)
        curved = estimate.model.curvature_columns @ curvatures
        residual = points.u - drawn_about(self.solution)
        stray = np.where(estimate.outlier_weight < OUTLIER_WEIGHT, residual, 0.0)
        voltages = self.voltages(standard) + curved + stray + estimate.noise * noise
        return [
            _with_voltages(scan, points.channel, voltages[points.scan == i])
            for i, scan in enumerate(self.solution.scans)
        ]

    def _random(self, index: int) -> tuple[np.random.Generator, Arrays]:
        """Return the generator of a draw, and its inputs' errors over their uncertainties."""
        # The same child as SeedSequence(seed).spawn() gives, whichever process asks for it.
        rng = np.random.default_rng(np.random.SeedSequence(self.seed, spawn_key=(index,)))
        return rng, self.standardised(rng.standard_normal(len(self.effects)))

    def _shift_by_law(self, index: int) -> FloatArray | float:
        """Change of a draw's results by the law: between the calibrations by either."""
        effect = self.effects.get("model_form")
        if effect is None or effect.exact is None:
            return 0.0
        share = RECTANGLE * self._random(index)[1]["model_form"]
        return share * (self._results_of(effect.exact) - self._results_of(self.solution))

    def standardised(self, normal: FloatArray) -> Arrays:
        """Turn normal draws, (inputs, ...), into each input's error over its uncertainty."""
        matrix = correlation_matrix(list(self.effects), self.correlations)
        values, vectors = np.linalg.eigh(matrix)
        # By the symmetric root every input keeps its draw where there are no correlations.
        root = (vectors * np.sqrt(np.maximum(values, 0.0))) @ vectors.T
        joined = dict(zip(self.effects, root @ normal, strict=True))
        if "model_form" in joined:
            joined["model_form"] = np.sqrt(3) * (2 * ndtr(joined["model_form"]) - 1)
        return joined | {item.source: item.truncated(joined[item.source]) for item in self.solved}

    def voltages(self, standard: Arrays) -> FloatArray:
        """Voltages without noise (n,), in V: A G convolved with the stress of the true inputs."""
        estimate = self.solution.estimate
        voltages = drawn_about(self.solution)
        signal = voltages - estimate.background
        solved = {item.source for item in self.solved}
        for source, effect in self.effects.items():
            # An effect is that of a larger value in the analysis, so its sign is turned.
            if source not in solved and effect.exact is None:
                voltages = voltages - standard[source] * (effect.voltage + effect.scaling * signal)
        if solved:
            model = replace(estimate.model, references=self._reference_changes(standard))
            voltages = voltages + model.signal(model.geometry(estimate.centres), estimate.kernel)
        return voltages

    @cached_property
    def solved(self) -> tuple[SolvedInput, ...]:
        """Stated properties of each distinct film and rod, named as their effects are."""
        scans = self.solution.scans
        inputs = []
        for name, component, attribute in (
            ("thickness", "film", "thickness"),
            ("poisson_ratio", "film", "poisson_ratio"),
            ("rod_radius", "indenter", "radius"),
        ):
            owners = [getattr(scan, component) for scan in scans]
            for number, owner in enumerate(dict.fromkeys(owners), start=1):
                value = getattr(owner, attribute, 0.0)
                u = getattr(owner, f"{attribute}_uncertainty", 0.0)
                source = name if number == 1 else f"{name}_{number}"
                if u and source in self.effects:
                    bounds = (0.0, 0.5) if name == "poisson_ratio" else (value / 2, np.inf)
                    places = tuple(i for i, other in enumerate(owners) if other == owner)
                    item = SolvedInput(source, places, component, attribute, value, u, bounds)
                    inputs.append(item)
        return tuple(inputs)

    @cached_property
    def _nominal(self) -> list[FloatArray]:
        scans = self.solution.scans
        return self._rods([replace(scan, film=scan.film and scan.film.expected) for scan in scans])

    def _rods(self, scans: Sequence[Scan]) -> list[FloatArray]:
        """Transform of each scan's rod, by the law of its own; zero where there is no film."""
        spectra = []
        references = self.solution.estimate.model.references
        for scan, own, reference in zip(scans, self.solution.scans, references, strict=True):
            spectrum = np.zeros_like(reference.values)
            if own.film is not None:
                spectrum = rod_spectrum(scan.set_up, reference, law_at_once(own.set_up))
            spectra.append(spectrum)
        return spectra

    def _reference_changes(self, standard: Arrays) -> tuple[RadialSpectrum, ...]:
        """True reference of each scan less the nominal one, by the ratio of the rod's solutions."""
        scans = list(self.solution.scans)
        for item in self.solved:
            value = np.clip(item.value + item.u * standard[item.source], *item.bounds)
            for i in item.scans:
                owner = getattr(scans[i], item.component)
                owner = replace(owner, **{item.attribute: value})
                scans[i] = replace(scans[i], **{item.component: owner})
        references = self.solution.estimate.model.references
        changes = []
        for true, nominal, own in zip(self._rods(scans), self._nominal, references, strict=True):
            changes.append(replace(own, values=(true - nominal) * quotient(own.values, nominal)))
        return tuple(changes)

    def _results_of(self, solution: Solution) -> FloatArray:
        numbers, g = read_off(solution.deconvolution, self.solution.deconvolution.g.r)
        numbers["gaussian_sigma"] = solution.estimate.gaussian.sigma
        return np.array([*(numbers[name] for name in BUDGETED), *g])


def _with_voltages(scan: Scan, channel: str, voltages: FloatArray) -> Scan:
    """Return the scan with other voltages of a channel at its measured points, shape (n,)."""
    u = np.full(scan.u_zz.shape, np.nan)
    u[measured_mask(scan, channel)] = voltages
    if channel == "zz":
        return replace(scan, u_zz=u)
    return replace(scan, channels={**scan.channels, f"u_{channel}": u})


_COVERAGE = 0.95
_TAILS = ((1 - _COVERAGE) / 2, (1 + _COVERAGE) / 2)
#: Shares of u by which the standard uncertainties may differ, and by which the mean may be off.
_TOLERANCE = 0.1
_LARGEST_SHIFT = 0.25


@array_record
class BudgetComparison:
    """One parameter by draws and by the first-order budget, in its SI unit."""

    name: str
    value: float  # the calibration's
    expected: float  # of the draws' mean, to first order
    mean: float  # of the draws, like the next four
    uncertainty: float  # standard deviation
    sampling_error: float  # standard uncertainty of ``uncertainty`` for the number of draws
    symmetric: tuple[float, float]  # coverage intervals of 95 %
    shortest: tuple[float, float]
    first_order: float  # the budget's standard uncertainty by what was drawn
    stated: float  # the same with what regularisation and window hide
    reason: str = ""  # why draws and budget do not agree, or empty

    @property
    def ratio(self) -> float:
        """Standard uncertainty of the draws over that of the budget."""
        return self.uncertainty / self.first_order if self.first_order > 0 else np.nan

    @property
    def agrees(self) -> bool:
        """Whether the budget may be used in place of draws."""
        return not self.reason


@array_record
class MonteCarlo(Tabulated):
    """Draws of a calibration, from :func:`monte_carlo`; ``to_dataframe()`` holds them.

    Parameters
    ----------
    draws, seed : int
        How many there are, and their seed.
    sources : tuple of str
        What was drawn: noise, curvatures of baselines, then the inputs whose uncertainty is stated.
    samples : ndarray, shape (m, 5)
        A (V/Pa), both widths (m), full width at half maximum (m) and noise-equivalent area (m^2)
        of the m draws that could be calibrated.
    comparisons : tuple of BudgetComparison
        The same, summed up, beside the budget.
    r : ndarray, shape (n,)
        Radii of G, in m.
    g_mean, g_uncertainty : ndarray, shape (n,)
        Mean and standard deviation of G, in 1/m^2.
    g_symmetric, g_shortest : ndarray, shape (2, n)
        Coverage intervals of 95 % at each radius, in 1/m^2.
    g_first_order : ndarray, shape (n,)
        Standard uncertainty of G to first order in what was drawn, in 1/m^2.
    messages : tuple of Message
        What was drawn, and what was not.

    Examples
    --------
    >>> import memscal
    >>> calibration = memscal.calibrate(memscal.simulate(seed=1))
    >>> drawn = memscal.monte_carlo(calibration, draws=4)
    >>> drawn.samples.shape
    (4, 5)
    """

    draws: int
    seed: int
    sources: tuple[str, ...]
    samples: FloatArray
    comparisons: tuple[BudgetComparison, ...]
    r: FloatArray
    g_mean: FloatArray
    g_uncertainty: FloatArray
    g_symmetric: FloatArray
    g_shortest: FloatArray
    g_first_order: FloatArray
    messages: tuple[Message, ...]
    reading: Reading = VOLTS

    def __repr__(self) -> str:
        """Return what was drawn, and whether the budget agrees."""
        names = ", ".join(comparison.name for comparison in self.comparisons if comparison.reason)
        verdict = f"the budget does not agree for {names}" if names else "the budget agrees"
        return f"<MonteCarlo: {self.draws} draws of {', '.join(self.sources)}; {verdict}>"

    @property
    def agrees(self) -> bool:
        """Whether every parameter agrees with its budget."""
        return all(comparison.agrees for comparison in self.comparisons)

    def __getitem__(self, name: str) -> BudgetComparison:
        """Return the comparison of one parameter."""
        if name not in BUDGETED:
            raise InputError(f"{name} is not drawn.", cure=f"There are {', '.join(BUDGETED)}.")
        return self.comparisons[BUDGETED.index(name)]


@reported
@single_threaded()
def monte_carlo(
    calibration: Calibration,
    *,
    draws: int = 1000,
    seed: int = 0,
    workers: int = 1,
    progress: Listener = None,  # noqa: ARG001 - @reported
) -> MonteCarlo:
    r"""Propagate the distributions of noise and inputs through a calibration.

    Every draw is calibrated by the same method.  Its voltages are those of the calibration's A
    and G under the drawn film, rod, load and positions, on a baseline of drawn curvature, with new
    noise.  Inputs are normal, cut off
    where no film is (a Poisson's ratio above 1/2), or rectangular (the model's form).

    Parameters
    ----------
    calibration : Calibration
        From :func:`memscal.calibrate`: of lines, a raster or several scans, by any method.
    draws : int, default 1000
        How many; two or more.  The 95 % interval's ends are known to about
        :math:`3/\sqrt{M}` standard uncertainties.
    seed : int, default 0
        Every draw has a seed of its own, spawned from this one.
    workers : int, default 1
        Processes that share the draws.
    progress : callable or True, optional
        Told how many draws are done: :class:`memscal.Progress`.

    Returns
    -------
    MonteCarlo
        Means, standard uncertainties and coverage intervals beside the budget's.

    Raises
    ------
    InputError
        If a number is out of range.
    FitError
        If fewer than two draws can be calibrated.

    Examples
    --------
    >>> import memscal
    >>> calibration = memscal.calibrate(memscal.simulate(seed=2), method="bayesian")
    >>> drawn = memscal.monte_carlo(calibration, draws=20)
    >>> 0.4 < drawn["gaussian_sigma"].ratio < 1.6
    True
    """
    require_count("monte_carlo", "draws", draws, 2)
    require_count("monte_carlo", "seed", seed, 0)
    require_workers(workers)
    solution = calibration.solution
    effects = calibration.effects
    model = DrawnScans(solution, effects, calibration.correlations, seed)
    rows = []
    failures = []
    results = shared(model.result, range(draws), workers=workers)
    for result in Task("draws", draws).counted(results):
        if isinstance(result, str):
            failures.append(result)
        else:
            rows.append(result)
    if len(rows) < 2:
        raise FitError(
            f"{len(failures)} of {draws} draws could not be calibrated.",
            why=f"The first one: {failures[0]}",
            cure="The scan is close to failing, too; measure with less noise.",
        )
    samples, g = np.split(np.array(rows), [len(BUDGETED)], axis=1)
    expected = expected_values(solution)
    deconvolution = solution.deconvolution
    comparisons = [
        _compared(calibration, name, expected[name], column)
        for name, column in zip(BUDGETED, samples.T, strict=True)
    ]
    first_order = uncertainties(solution, deconvolution, effects, calibration.correlations)
    curved = [CURVATURE] if solution.estimate.points.curved.size else []
    return MonteCarlo(
        draws=draws,
        seed=seed,
        sources=("noise", *curved, *effects),
        samples=samples,
        comparisons=tuple(comparisons),
        r=deconvolution.g.r,
        g_mean=g.mean(axis=0),
        g_uncertainty=g.std(axis=0, ddof=1),
        g_symmetric=np.quantile(g, _TAILS, axis=0),
        g_shortest=shortest_interval(g),
        g_first_order=first_order.radial_scatter,
        messages=tuple(_messages(calibration, comparisons, failures, draws)),
        reading=calibration.apparatus.reading,
    )


def _compared(
    calibration: Calibration, name: str, expected: float, column: FloatArray
) -> BudgetComparison:
    """Compare the draws of a parameter, shape (m,), with its budget."""
    parameters = calibration.apparatus.parameters
    budget = calibration.apparatus.budget[name]
    mean = float(column.mean())
    spread = float(column.std(ddof=1))
    # Of the inputs and noise; a correlation's contribution has a sign.
    parts = np.array([u for source, u in budget.items() if source not in NOT_RANDOM])
    u = float(np.sqrt(max(parts @ np.abs(parts), 0.0)))
    # The standard uncertainty of the standard deviation, by the kurtosis of the draws.
    square = (column - mean) ** 2
    kurtosis = np.mean(square**2) / np.mean(square) ** 2 if spread > 0 else 1.0
    error = spread * float(np.sqrt(max(kurtosis - 1, 0.0) / (4 * column.size)))
    # Beyond what the number of draws allows: two standard errors.
    same_mean = abs(mean - expected) <= _LARGEST_SHIFT * u + 2 * spread / np.sqrt(column.size)
    reason = ""
    if not (same_mean and abs(spread - u) <= _TOLERANCE * u + 2 * error):
        reason = (
            f"The draws scatter by {spread / u:.2f} u, and their mean is "
            f"{(mean - expected) / u:+.2f} u off. The calibration is not "
            "linear in the noise or an input over its uncertainty."
        )
    return BudgetComparison(
        name=name,
        value=parameters[name],
        expected=expected,
        mean=mean,
        uncertainty=spread,
        sampling_error=error,
        symmetric=tuple(np.quantile(column, _TAILS).tolist()),
        shortest=tuple(shortest_interval(column).tolist()),
        first_order=u,
        stated=parameters.uncertainty(name),
        reason=reason,
    )


def shortest_interval(draws: FloatArray) -> FloatArray:
    """Shortest interval that holds 95 % of the draws (JCGM 101, 7.7.4), shape (2, ...)."""
    ordered = np.sort(draws, axis=0)
    held = min(int(np.rint(_COVERAGE * len(draws))), len(draws) - 1)
    first = np.argmin(ordered[held:] - ordered[:-held], axis=0)[None]
    lower = np.take_along_axis(ordered, first, axis=0)
    return np.concatenate([lower, np.take_along_axis(ordered, first + held, axis=0)])


def _messages(
    calibration: Calibration,
    comparisons: Sequence[BudgetComparison],
    failures: list[str],
    draws: int,
) -> Iterator[Message]:
    if not calibration.effects:
        text = "No input states an uncertainty: the draws are of noise alone."
        yield Message("uncertainty_unstated", text)
    hidden = []
    for comparison in comparisons:
        if comparison.first_order < (1 - _TOLERANCE) * comparison.stated:
            share = comparison.first_order / comparison.stated
            hidden.append(f"{1 - share**2:.0%} of {comparison.name}")
    if hidden:
        text = (
            "Not all of the stated uncertainty scatters: of its square, what regularisation or "
            "window hides, or a Gaussian that misfits changes with the positions, makes up "
            f"{', '.join(hidden)}. It is the same error in every draw, so it is counted, but not "
            "drawn; the comparison is with the rest."
        )
        yield Message("regularisation", text)
    if (calibration.solution.estimate.outlier_weight < OUTLIER_WEIGHT).any():
        yield Message("outlier", "Outliers keep their distance from the prediction in every draw.")
    if failures:
        text = f"{len(failures)} of {draws} draws could not be calibrated and are left out."
        yield Message("failed_draws", f"{text} The first one: {failures[0]}", "warning")
