r"""The calibration of a scan that is not made yet: its estimate and covariance, in expectation.

The Gaussian's parameters have the covariance of the inverse Fisher information at the true ones
(the bound of Cramer and Rao).  Departures are weighed as in :mod:`memscal.estimation.evidence`,
with the expected squares of the data, those of the signal plus those of the noise, in place of
the data's own.  Everything after that is the calibration's own code.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from memscal.calibration.fields import choose_grid
from memscal.calibration.inputs import InputEffect, input_effects
from memscal.calibration.solution import Solution, deconvolve, prepare_fields
from memscal.calibration.uncertainty import Results, propagate
from memscal.deconvolution.problem import Regulariser
from memscal.errors import FitError
from memscal.estimation.band import find_band
from memscal.estimation.departure import departure_basis
from memscal.estimation.evidence import weigh_departures
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian_fit import fit_gaussian
from memscal.estimation.points import measured_points
from memscal.estimation.profile_estimate import LEAST_SIGNIFICANCE, ProfileEstimate
from memscal.estimation.reference import (
    reference_contact,
    reference_spectra,
    require_calibration_rod,
)
from memscal.planning.plan import Plan

__all__ = ["Expected", "expected_calibration"]


@dataclass(frozen=True, eq=False, repr=False)
class Expected:
    """What a planned scan would give.

    ``solution``: every step of its calibration; ``results``: parameters, budget and covariances.
    """

    solution: Solution
    results: Results


def expected_calibration(plan: Plan, regulariser: Regulariser) -> Expected:
    """Calibrate the scan that is planned, with expected squares in place of data.

    Raises
    ------
    InputError
        If the rod is wider than the film is thick, or the kernel is no apparatus function.
    FitError
        If the scan would have fewer positions than parameters, or would not tell the conversion
        constant from zero.
    """
    scan = plan.scan()
    require_calibration_rod(scan)
    stress = reference_contact(plan.film, plan.rod, plan.load)
    points = measured_points(scan)
    references = reference_spectra([stress], [points], [plan.film.thickness])
    estimate = _expected_estimate(ForwardModel(points, references), plan.repeats)
    band = find_band(estimate)
    choice = choose_grid(estimate, band)
    fields = prepare_fields(estimate, choice)
    deconvolution = deconvolve(estimate, band, fields, regulariser)
    solution = Solution(
        scans=(scan,),
        stresses=(stress,),
        estimate=estimate,
        band=band,
        choice=choice,
        fields=fields,
        regulariser=regulariser,
        deconvolution=deconvolution,
        gaussian_misfit=deconvolution.misfit,
    )
    effects = input_effects(solution.scans, solution.stresses, estimate)
    return Expected(solution, _propagated(solution, effects))


def _expected_estimate(model: ForwardModel, repeats: int) -> ProfileEstimate:
    """Return the estimate from voltages without noise, at the noise that they state."""
    errors = model.points.u_errors
    assert errors is not None
    weights = np.asarray(1 / errors**2)
    fit = fit_gaussian(model, weights, start=fit_gaussian(model, weights))
    basis = departure_basis(model, fit)
    count = float(repeats * weights.size)
    weighed = weigh_departures(model, fit, basis, weights, count, expected_noise=1.0)
    estimate = ProfileEstimate(model, fit, basis, weighed, weights, np.ones_like(weights))
    variance = float(basis.integrals @ estimate.covariance @ basis.integrals)
    if not estimate.conversion_constant > LEAST_SIGNIFICANCE * np.sqrt(variance):
        raise FitError(
            f"The scan as planned would find a conversion constant of "
            f"({estimate.conversion_constant * 1e3:.2g} ± {np.sqrt(variance) * 1e3:.2g}) mV/Pa: "
            "not told apart from zero.",
            why="It is too short to tell the profile's tail from the baseline, or too noisy.",
            cure="Plan a larger half range, more repeats, or a larger load.",
        )
    return estimate


def _propagated(solution: Solution, effects: Mapping[str, InputEffect]) -> Results:
    return propagate(
        solution.estimate,
        solution.deconvolution,
        solution.window_at_nodes,
        solution.fields.along_axis(solution.deconvolution.quotient.window)[0],
        effects,
        {},
    )
