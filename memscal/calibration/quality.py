"""The quality checks of a calibration: value, limit, and what a failure means."""

from __future__ import annotations

import numpy as np
from scipy.special import chdtrc

from memscal.calibration.model_checks import model_checks
from memscal.calibration.solution import Misfit, Solution
from memscal.deconvolution.evidence import Evidence
from memscal.estimation.band import RESOLVED
from memscal.estimation.forward import gaussian_transfer
from memscal.estimation.free_model import free_model
from memscal.estimation.reference import carried_force
from memscal.model.apparatus import ParameterSet
from memscal.model.checks import (
    OUTLIER_LIMIT,
    OUTLIER_WEIGHT,
    QualityCheck,
    check,
    chi_square_limit,
)

__all__ = ["quality_checks"]

_BASELINE_DRIFT_LIMIT = 0.05
_TAIL_LIMIT = 0.05
#: A shear falls off more slowly: of the paper's rod 6.5 % lie beyond four film thicknesses.
_SHEAR_TAIL_LIMIT = 0.10
_BAND_LIMIT = 0.5
_FORCE_LIMIT = 0.01
_WIDTH_LIMIT = 3.0
_NEGLIGIBLE_DIFFERENCE = 0.002


def quality_checks(solution: Solution, parameters: ParameterSet) -> tuple[QualityCheck, ...]:
    """Run every check that applies to the scan."""
    return (
        *_reconvolutions(solution),
        *_constraint(solution),
        *_agreements(solution, parameters),
        *_set_up(solution),
        *model_checks(solution.estimate),
    )


def _reconvolutions(solution: Solution) -> list[QualityCheck]:
    evidence = solution.regulariser.name == "evidence"
    removed = (
        "the posterior mean of G misses something that the scan shows"
        if evidence
        else "the regularisation has removed something that the scan shows (see method evidence)"
    )
    stated = solution.estimate.points.u_errors is not None
    return [
        _chi_square(
            "reconvolution",
            solution.deconvolution.misfit,
            "Reduced chi-square of the scan against the found G convolved with the reference. A "
            f"failure means that {removed}, or that the scan is no convolution of the reference: "
            "look at chi_square, which does not depend on G.",
        ),
        _chi_square(
            "gaussian_misfit",
            solution.gaussian_misfit,
            "Reduced chi-square of the scan against the fitted Gaussian convolved with the "
            "reference. A failure means that G is not Gaussian at this noise: use the found G, "
            "not gaussian_sigma.",
            exact=stated,
        ),
    ]


def _constraint(solution: Solution) -> list[QualityCheck]:
    """Compare a G that was kept from falling below zero, or from rising, with the free one."""
    regulariser, estimate = solution.regulariser, solution.estimate
    if not (isinstance(regulariser, Evidence) and regulariser.constrained):
        return []
    weights = estimate.weights / estimate.noise_scale**2
    misfits = [
        float(np.sum(estimate.points.standardised(estimate.points.u - u, weights) ** 2))
        for u in (solution.deconvolution.predicted, estimate.predicted)
    ]
    # As many directions of G as the scan tells apart, and which the constraint may cost.
    told = free_model(estimate).design.shape[1] - estimate.basis.flat
    return [
        check(
            "constraint",
            max(misfits[0] - misfits[1], 0.0),
            chi_square_limit(max(told, 1)),
            "Rise of chi-square by the constraint on G (nonnegative, monotone) over the free "
            "estimate. A failure means that the scan contradicts it: leave it out.",
        )
    ]


def _agreements(solution: Solution, parameters: ParameterSet) -> list[QualityCheck]:
    """Compare the found G with the Gaussian; the two are fitted to the same noise."""
    if solution.regulariser.name == "evidence":
        found = "of the free G in data space"
        else_ = ""
    else:
        found = "of the G by division of the fields"
        else_ = ", or that the method of division failed: compare method evidence"
    return [
        _agreement(
            parameters,
            ("conversion_constant", "conversion_constant_gaussian"),
            "method_agreement",
            f"Difference of the conversion constant {found} from the Gaussian fit's, in its "
            "standard uncertainty. A failure means that the Gaussian's is biased, as when G has "
            f"tails that a Gaussian lacks{else_}.",
        ),
        _agreement(
            parameters,
            ("gaussian_sigma_deconvolved", "gaussian_sigma"),
            "width_agreement",
            f"Difference of the width {found} from the one fitted to the scan, in its standard "
            "uncertainty. A failure means that G is not Gaussian, so that its width depends on how "
            f"it is read off{else_}. Look at both reconvolutions.",
        ),
    ]


def _set_up(solution: Solution) -> list[QualityCheck]:
    """Film, band, reach, baseline and reference."""
    estimate = solution.estimate
    resolved = solution.band.resolved
    return [
        check(
            "width_over_thickness",
            estimate.gaussian.sigma / solution.scan.film.thickness,
            _WIDTH_LIMIT,
            "Width of G over the film's thickness. A failure means that the unit of the positions "
            "or of the film's thickness should be looked at.",
        ),
        check(
            "resolved_band",
            float(gaussian_transfer(np.array(resolved), estimate.gaussian.sigma)),
            _BAND_LIMIT,
            "Transfer function of the fitted Gaussian at the resolved wavenumber, here "
            f"{resolved * 1e-3:.3g} rad/mm: up to there, the posterior standard uncertainty of G's "
            f"transfer function is less than 1/{RESOLVED:g} of it, whatever the method of "
            "division; beyond, the prior speaks and not the scan. A failure means that noise hides "
            "more than half of G's spectrum: average repeats or raise the load.",
        ),
        check(
            "tail_share",
            solution.tail_share,
            _SHEAR_TAIL_LIMIT if estimate.model.order else _TAIL_LIMIT,
            "Share of the voltage's integral that lies beyond the scan and is extrapolated. A "
            "failure means that A rests on the extrapolation: scan farther.",
        ),
        check(
            "baseline_drift",
            2 * float(np.abs(estimate.drift[1:]).max()) / estimate.largest_signal,
            _BASELINE_DRIFT_LIMIT,
            "Change of the baseline across the scan over the largest signal. It is fitted and "
            "removed as a straight line; a failure means that what is left of it may bias A.",
        ),
        check(
            "reference_force",
            abs(carried_force(solution.stress, estimate.model.reference) - 1.0),
            _FORCE_LIMIT,
            "Relative difference of the reference's total force from the load. A failure means "
            "that the reference was made for another load, or that its table ends too early; A is "
            "wrong by as much.",
        ),
        check(
            "outliers",
            float(np.mean(estimate.outlier_weight < OUTLIER_WEIGHT)),
            OUTLIER_LIMIT,
            "Share of points whose weight was more than halved. A failure means that the noise is "
            "not what the uncertainties take it for: look at the points that the messages name.",
        ),
    ]


def _chi_square(name: str, misfit: Misfit, meaning: str, *, exact: bool = False) -> QualityCheck:
    """Check a misfit; its p-value is known where the noise is, for a plain fit."""
    limit = chi_square_limit(misfit.degrees) / misfit.degrees
    p_value = float(chdtrc(misfit.degrees, misfit.chi2_reduced * misfit.degrees))
    return check(name, misfit.chi2_reduced, limit, meaning, p_value if exact else None)


def _agreement(
    parameters: ParameterSet, names: tuple[str, str], name: str, meaning: str
) -> QualityCheck:
    i, j = (parameters.names.index(name) for name in names)
    c, values = parameters.covariance, parameters.values
    variance = max(c[i, i] + c[j, j] - 2 * c[i, j], 0.0)
    # Differences below a fifth of a percent matter to nobody, however small their noise.
    allowed = np.hypot(np.sqrt(variance), _NEGLIGIBLE_DIFFERENCE * values[j])
    return check(name, abs(values[i] - values[j]) / allowed, 3.0, meaning)
