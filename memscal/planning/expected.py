"""Expected calibration of a planned scan: its estimate and covariance.

The Gaussian's parameters have the covariance of the inverse Fisher information at the true ones
(the bound of Cramer and Rao).  Departures are weighed as in :mod:`memscal.estimation.bayesian`,
with the expected squares of signal plus noise in place of the data's own.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers
from memscal.axisymmetry.kernels import GaussianMixture, RadialKernel
from memscal.calibration.drawn_scatter import drawn_scatter
from memscal.calibration.fields import choose_grid
from memscal.calibration.stages import Solution, deconvolve, prepare_fields
from memscal.calibration.uncertainty import Results, input_effects, propagate
from memscal.deconvolution.division import Method, chosen_method
from memscal.errors import InputError
from memscal.estimation import reference
from memscal.estimation.band import find_band
from memscal.estimation.bayesian import departure_basis, supported, weigh_departures
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import fit_gaussian_to_points
from memscal.estimation.points import measured_points
from memscal.estimation.profile import ProfileEstimate, require_significant
from memscal.estimation.smoothing import smooth_profile
from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import FloatArray, freeze_arrays, require_non_negative, require_positive
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.result import Result
from memscal.model.scan import Scan
from memscal.simulation.rod_scan import PAPER_FILM, PAPER_ROD, simulate

#: As many as a simulated scan may have.
MOST_POSITIONS = 4096
#: A range that is a whole number of steps but for rounding is one.
_ROUNDING = 1e-6
#: The film passes nothing beyond exp(-kh) of this.
_LARGEST_KH = 20.0


@dataclass(frozen=True, kw_only=True)
class Plan:
    """A line scan to be made; the attributes are the arguments of :func:`memscal.design`.

    ``load_uncertainty`` and ``noise`` are relative, to the load and to the signal with the rod
    right above the sensor; ``noise_voltage`` (V) replaces ``noise``.  Positions run from minus to
    plus ``half_range``, or to the last whole step within.
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

    def __post_init__(self) -> None:
        require_positive("step of the scan", self.step, "m")
        require_positive("half range of the scan", self.half_range, "m")
        require_positive("load", self.load, "N")
        require_positive("conversion constant", self.conversion_constant, "V/Pa")
        if self.load_uncertainty is not None:
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
        wavenumbers = Wavenumbers.covering(_LARGEST_KH / self.film.thickness, self.film.thickness)
        contact = reference.reference_contact(self.film, self.rod, self.load)
        spectrum = contact.base_spectrum(wavenumbers.k) * self.kernel.transform(wavenumbers.k)
        peak = RadialSpectrum(wavenumbers, spectrum).at(np.zeros(1))[0]
        return float(self.conversion_constant * peak)

    @property
    def point_noise(self) -> float:
        """Standard deviation of one voltage, in V."""
        return self.noise * self.signal if self.noise_voltage is None else self.noise_voltage

    def scan(self) -> Scan:
        """Return the expected mean of all repeats: without noise, whose size is stated."""
        count = self.positions
        scan = simulate(
            film=self.film,
            rod=self.rod,
            kernel=self.kernel,
            conversion_constant=self.conversion_constant,
            load=self.load,
            load_uncertainty=self.load_uncertainty,
            half_range=self.step * (count - 1) / 2,
            points=count,
            noise=0.0,
            centre=(self.centre, 0.0),
            baseline=0.0,
            drift=0.0,
        )
        noise = self.point_noise / math.sqrt(self.repeats)
        return replace(scan, title="Planned rod scan", u_zz_errors=np.full(count, noise))


def _expected_calibration(plan: Plan, method: Method) -> tuple[Solution, Results]:
    """Calibrate the planned scan, with expected squares in place of data: steps and results."""
    scan = plan.scan()
    reference.require_calibration_rod(scan)
    stress = reference.reference_contact(plan.film, plan.rod, plan.load)
    points = measured_points(scan)
    references = reference.reference_spectra([stress], [points], [plan.film.thickness])
    estimate = _expected_estimate(ForwardModel(points, references), plan.repeats)
    smoothed = smooth_profile(estimate)
    band = find_band(estimate, smoothed)
    choice = choose_grid(estimate, band)
    fields = prepare_fields(estimate, smoothed, choice)
    deconvolution = deconvolve(estimate, band, fields, method)
    solution = Solution(
        scans=(scan,),
        stresses=(stress,),
        estimate=estimate,
        smoothed=smoothed,
        band=band,
        choice=choice,
        fields=fields,
        method=method,
        deconvolution=deconvolution,
        other=None,
        gaussian_misfit=deconvolution.misfit,
    )
    effects = input_effects(solution.scans, solution.stresses, estimate)
    wavenumbers = fields.along_axis(deconvolution.quotient.window)[0]
    results = propagate(solution, deconvolution, wavenumbers, effects, {}, drawn_scatter(solution))
    return solution, results


def _expected_estimate(model: ForwardModel, repeats: int) -> ProfileEstimate:
    """Return the estimate from voltages without noise, at the noise that they state."""
    assert model.points.u_errors is not None
    weights = np.asarray(1 / model.points.u_errors**2)
    fit = fit_gaussian_to_points(model, weights, start=fit_gaussian_to_points(model, weights))
    basis = departure_basis(model, fit, weights)
    count = float(repeats * weights.size)
    weighed = weigh_departures(model, fit, basis, weights, count, expected_noise=1.0)
    ones = np.ones_like(weights)
    estimate = ProfileEstimate(model, fit, *supported(basis, weighed), weights, ones, basis)
    require_significant(estimate, "Plan a larger half range, more repeats, or a larger load.")
    return estimate


@dataclass(frozen=True, eq=False, repr=False)
class Design(Result):
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
    want: Mapping[str, float] = field(default_factory=dict)

    _summary: ClassVar[str] = "design"
    _figure: ClassVar[str] = "design.design_figure"

    def __post_init__(self) -> None:
        freeze_arrays(self, "r", "g", "g_errors", "k", "transfer", "transfer_errors")

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
    chosen = chosen_method(method, {}, seed=seed)
    solution, results = _expected_calibration(plan, chosen)
    deconvolution, fields = solution.deconvolution, solution.fields
    k, modulus = fields.along_axis(np.abs(fields.grid.transfer(deconvolution.quotient.values)))
    return Design(
        plan=plan,
        method=chosen.name,
        parameters=results.parameters,
        budget=results.budget,
        r=deconvolution.g.r,
        g=deconvolution.g.radial,
        g_errors=np.sqrt(np.diag(results.radial_covariance)),
        k=k,
        transfer=modulus / deconvolution.conversion_constant,
        transfer_errors=results.transfer_errors,
        resolved_wavenumber=solution.band.resolved,
    )
