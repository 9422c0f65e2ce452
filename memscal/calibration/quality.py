"""The quality checks of a calibration: value, limit, and what a failure means."""

from __future__ import annotations

import numpy as np

from memscal.calibration.solution import Misfit, Solution
from memscal.estimation.forward import gaussian_transfer
from memscal.estimation.hypotheses import (
    axisymmetry_test,
    chi_square_limit,
    linearity_test,
    symmetry_test,
)
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.apparatus import ParameterSet, QualityCheck

__all__ = ["quality_checks"]

_BASELINE_DRIFT_LIMIT = 0.05
_TAIL_LIMIT = 0.05
_BAND_LIMIT = 0.5
_FORCE_LIMIT = 0.01
_OUTLIER_LIMIT = 0.10
_NOISE_LIMIT = 1.5
_WIDTH_LIMIT = 3.0
_NEGLIGIBLE_DIFFERENCE = 0.002


def quality_checks(solution: Solution, parameters: ParameterSet) -> tuple[QualityCheck, ...]:
    """Run every check that applies to the scan."""
    estimate, quotient = solution.estimate, solution.quotient
    checks = [
        _chi_square(
            "reconvolution",
            quotient.misfit,
            "Reduced chi-square of the scan against the deconvolved G convolved with the "
            "reference. A failure means that the regularisation has removed something that the "
            "scan shows, or that the scan is no convolution of the reference.",
        ),
        _chi_square(
            "gaussian_misfit",
            solution.gaussian_misfit,
            "Reduced chi-square of the scan against the fitted Gaussian convolved with the "
            "reference. A failure means that G is not Gaussian at this noise: use the "
            "deconvolved G, not gaussian_sigma.",
        ),
        _agreement(
            parameters,
            ("conversion_constant", "conversion_constant_gaussian"),
            "method_agreement",
            "Difference of the conversion constants by deconvolution and by the Gaussian fit, in "
            "its standard uncertainty. A failure means that one of them is biased, as when G has "
            "tails that a Gaussian lacks, or when the method of division failed.",
        ),
        _agreement(
            parameters,
            ("gaussian_sigma_deconvolved", "gaussian_sigma"),
            "width_agreement",
            "Difference of the widths fitted to the deconvolved G and to the scan, in its standard "
            "uncertainty. A failure means that G is not Gaussian, or that the method of division "
            "failed: look at both reconvolutions.",
        ),
        _check(
            "width_over_thickness",
            estimate.gaussian.sigma / solution.scan.film.thickness,
            _WIDTH_LIMIT,
            "Width of G over the film's thickness. A failure means that the unit of the positions "
            "or of the film's thickness should be looked at.",
        ),
        _check(
            "resolved_band",
            float(gaussian_transfer(np.array(solution.band.resolved), estimate.gaussian.sigma)),
            _BAND_LIMIT,
            "Transfer function of the fitted Gaussian at the resolved wavenumber. A failure means "
            "that noise hides more than half of G's spectrum: average repeats or raise the load.",
        ),
        _check(
            "tail_share",
            solution.tail_share,
            _TAIL_LIMIT,
            "Share of the voltage's integral that lies beyond the scan and is extrapolated. A "
            "failure means that A rests on the extrapolation: scan farther.",
        ),
        _drift(estimate),
        _check(
            "reference_force",
            abs(estimate.model.reference.integral - 1.0),
            _FORCE_LIMIT,
            "Relative difference of the reference's total force from the load. A failure means "
            "that the reference was made for another load, or that its table ends too early; A is "
            "wrong by as much.",
        ),
        _check(
            "outliers",
            float(np.mean(estimate.outlier_weight < 0.5)),
            _OUTLIER_LIMIT,
            "Share of points whose weight was more than halved. A failure means that the noise is "
            "not what the uncertainties take it for.",
        ),
    ]
    return tuple(checks + _noise_check(estimate) + _hypotheses(estimate))


def _chi_square(name: str, misfit: Misfit, meaning: str) -> QualityCheck:
    limit = chi_square_limit(misfit.degrees) / misfit.degrees
    return _check(name, misfit.chi2_reduced, limit, meaning)


def _check(name: str, value: float, limit: float, meaning: str) -> QualityCheck:
    return QualityCheck(name, float(value), float(limit), bool(value <= limit), meaning)


def _agreement(
    parameters: ParameterSet, names: tuple[str, str], check: str, meaning: str
) -> QualityCheck:
    i, j = (parameters.names.index(name) for name in names)
    c, values = parameters.covariance, parameters.values
    variance = max(c[i, i] + c[j, j] - 2 * c[i, j], 0.0)
    # Differences below a fifth of a percent matter to nobody, however small their noise.
    allowed = np.hypot(np.sqrt(variance), _NEGLIGIBLE_DIFFERENCE * values[j])
    return _check(check, abs(values[i] - values[j]) / allowed, 3.0, meaning)


def _drift(estimate: ProfileEstimate) -> QualityCheck:
    return _check(
        "baseline_drift",
        2 * float(np.abs(estimate.drift[1:]).max()) / estimate.largest_signal,
        _BASELINE_DRIFT_LIMIT,
        "Change of the baseline across the scan over the largest signal. It is fitted and removed "
        "as a straight line; a failure means that what is left of it may bias A.",
    )


def _noise_check(estimate: ProfileEstimate) -> list[QualityCheck]:
    if estimate.points.u_errors is None:
        return []
    return [
        _check(
            "noise_as_stated",
            estimate.weighed.noise,
            _NOISE_LIMIT,
            "Scatter about the fitted profile over the stated u_zz_errors. A failure means that "
            "something besides electronic noise scatters the scan, such as position or load; the "
            "uncertainties have been raised accordingly.",
        )
    ]


def _hypotheses(estimate: ProfileEstimate) -> list[QualityCheck]:
    checks = []
    if estimate.points.planar:
        uneven = axisymmetry_test(estimate)
        checks.append(
            _check(
                "axisymmetry",
                uneven.fall,
                chi_square_limit(uneven.count),
                f"Fall of chi-square by {uneven.count} columns of an elliptic sensor, which then "
                f"make up {uneven.size:.2%} of the largest signal. A failure means that the radial "
                "profile is only a mean over directions: use the field.",
            )
        )
    else:
        odd = symmetry_test(estimate)
        checks.append(
            _check(
                "symmetry",
                odd.fall,
                chi_square_limit(odd.count),
                f"Fall of chi-square by {odd.count} odd columns, which then make up {odd.size:.2%} "
                "of the largest signal. A failure means that the left and right halves differ: a "
                "tilted rod, an uneven film, or a drifting load.",
            )
        )
    linear = linearity_test(estimate)
    if linear is not None:
        checks.append(
            _check(
                "load_linearity",
                linear.fall,
                chi_square_limit(1),
                f"Fall of chi-square by a conversion constant that changes with the load, here by "
                f"{float(linear.coefficients[0]):.2%} per mean load. A failure means that the "
                "output is not linear in the load, and that one A does not serve all loads.",
            )
        )
    return checks
