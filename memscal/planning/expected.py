"""Expected calibration of a planned scan: its estimate and covariance.

The Gaussian's parameters have the covariance of the inverse Fisher information at the true ones
(the bound of Cramer and Rao).  Departures are weighed as in :mod:`memscal.estimation.bayesian`,
with the expected squares of signal plus noise in place of the data's own.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from memscal.calibration.drawn_scatter import drawn_scatter
from memscal.calibration.fields import choose_grid
from memscal.calibration.stages import Solution, deconvolve, prepare_fields
from memscal.calibration.uncertainty import Results, input_effects, propagate
from memscal.deconvolution.division import Method, chosen_method
from memscal.estimation.bayesian import departure_basis, supported, weigh_departures
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import fit_gaussian_to_points
from memscal.estimation.points import measured_points
from memscal.estimation.profile import ProfileEstimate, require_significant
from memscal.estimation.reference import (
    reference_profile,
    reference_spectra,
    require_calibration_rod,
)
from memscal.estimation.smoothing import find_band, smooth_profile
from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import FloatArray, freeze_arrays
from memscal.model.result import Result
from memscal.planning.plan import Plan


@dataclass(frozen=True, eq=False, repr=False)
class Expected:
    """Steps and results (parameters, budget, covariances) of a planned scan's calibration."""

    solution: Solution
    results: Results


def expected_calibration(plan: Plan, method: Method) -> Expected:
    """Calibrate the planned scan, with expected squares in place of data."""
    scan = plan.scan()
    require_calibration_rod(scan)
    stress = reference_profile(scan, None)
    points = measured_points(scan)
    references = reference_spectra([stress], [points], [plan.film.thickness])
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
    return Expected(solution, results)


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
    expected = expected_calibration(plan, chosen)
    solution, results = expected.solution, expected.results
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
