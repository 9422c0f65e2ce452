"""The way back: from a scan and a calibrated sensor to the stress at the base of the film."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike

import numpy as np
from scipy.special import chdtrc

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers
from memscal.estimation.assumptions import ExtraColumns, axisymmetry_test, symmetry_test
from memscal.estimation.points import ScanPoints, measured_points
from memscal.estimation.profile import ProfileEstimate, estimate_profile
from memscal.estimation.residuals import FEWEST_RESIDUALS, chi_square_test, residuals_of
from memscal.formats.opened import opened_scan
from memscal.measurement.posterior import reach_of, restore_posterior, sensor_transfer
from memscal.measurement.pressure import film_transfer
from memscal.measurement.restoration import (
    Expected,
    Restoration,
    require_measurement,
    restored_or_explained,
)
from memscal.model.arrays import FloatArray
from memscal.model.checks import (
    FAILED_CALIBRATION,
    NOISE_LIMIT,
    NOISE_UNSTATED,
    OUTLIER_LIMIT,
    OUTLIER_WEIGHT,
    Message,
    QualityCheck,
    check,
    chi_square_limit,
    failed_check_messages,
)
from memscal.model.scan import Scan
from memscal.parallel import single_threaded

__all__ = [
    "failed_calibration_messages",
    "gaussian_pressure",
    "noise_unstated_message",
    "restoration_checks",
    "restoration_messages",
    "restore",
    "restore_known",
]

_FORCE_LIMIT = 3.0
#: What the shapes of pressure themselves leave open of the force, however small the noise.
_NEGLIGIBLE_FORCE = 0.01
_SAME_FILM = 0.02


def restoration_checks(found: Restoration) -> tuple[QualityCheck, ...]:
    """Run every check that applies to the scan."""
    checks = [_reconvolution(found), _force(found), _film(found)]
    checks += _noise(found)
    checks.append(_symmetry(found))
    checks.append(_outliers(found))
    if found.comparison is not None:
        checks.append(_expected(found))
    return tuple(checks)


def _reconvolution(found: Restoration) -> QualityCheck:
    degrees = found.degrees
    return check(
        "reconvolution",
        found.chi_square / degrees,
        chi_square_limit(degrees) / degrees,
        "Reduced chi-square of the scan against the restored stress blurred again by A G. A "
        "failure means that no radial stress at the base of this film explains the scan through "
        "this apparatus function.",
    )


def _force(found: Restoration) -> QualityCheck:
    load = found.scan.load
    allowed = np.hypot(found.force_uncertainty, found.scan.load_uncertainty or 0.0)
    allowed = float(np.hypot(allowed, _NEGLIGIBLE_FORCE * load))
    return check(
        "restored_force",
        abs(found.force - load) / allowed,
        _FORCE_LIMIT,
        f"Difference of the restored stress's total force, {found.force:.4g} N, from the load of "
        f"{load:.4g} N, in their standard uncertainty. A failure means that A, the load or the "
        "unit of one of them is wrong, or that the film's Poisson's ratio, which decides how much "
        "lies beyond the scan, is.",
    )


def _film(found: Restoration) -> QualityCheck:
    ours, theirs = found.scan.film, found.apparatus.film
    spread = np.hypot(ours.thickness_uncertainty or 0.0, theirs.thickness_uncertainty or 0.0)
    limit = max(_SAME_FILM, 2 * float(spread) / theirs.thickness)
    return check(
        "film_agreement",
        abs(ours.thickness / theirs.thickness - 1),
        limit,
        f"Relative difference of the film's thickness, {ours.thickness * 1e3:.4g} mm, from that of "
        f"the calibration, {theirs.thickness * 1e3:.4g} mm. A failure means that the sensor was "
        "calibrated under another film; G may not be the same under this one.",
    )


def _noise(found: Restoration) -> list[QualityCheck]:
    if found.points.u_errors is None:
        return []
    checks = [
        check(
            "noise_as_stated",
            found.posterior.found_noise,
            NOISE_LIMIT,
            "Scatter about the fitted profile over the stated u_zz_errors. A failure means that "
            "something besides electronic noise scatters the scan, such as position or load; the "
            "uncertainties have been raised accordingly.",
        )
    ]
    residuals = residuals_of(found.posterior.estimate)
    if residuals.degrees >= FEWEST_RESIDUALS:
        size = chi_square_test(residuals)
        meaning = (
            "What no radial pressure on the film can explain of the scan, compared with the stated "
            f"noise: reduced chi-square of {residuals.degrees} degrees. A failure means that "
            "the noise is larger than stated, the contact is not round, or the baseline is no "
            "straight line."
        )
        checks.append(check("chi_square", size.value, size.limit, meaning, size.p_value))
    return checks


def _symmetry(found: Restoration) -> QualityCheck:
    estimate = found.posterior.estimate
    if found.points.planar:
        name, uneven = "axisymmetry", axisymmetry_test(estimate)
        meaning = "elliptic columns. A failure means that the contact, or the sensor, is not round."
    else:
        name, uneven = "symmetry", symmetry_test(estimate)
        meaning = (
            "odd columns. A failure means that the left and right halves differ: a tilted "
            "indenter, an uneven film, or a drifting load."
        )
    return _added(name, uneven, meaning)


def _added(name: str, found: ExtraColumns, meaning: str) -> QualityCheck:
    about = f"Fall of chi-square by {found.count} {meaning}"
    p_value = float(chdtrc(found.count, found.fall))
    return check(name, found.fall, chi_square_limit(found.count), about, p_value)


def _outliers(found: Restoration) -> QualityCheck:
    return check(
        "outliers",
        float(np.mean(found.posterior.estimate.outlier_weight < OUTLIER_WEIGHT)),
        OUTLIER_LIMIT,
        "Share of points whose weight was more than halved. A failure means that the noise is not "
        "what the uncertainties take it for: look at the residuals.",
    )


def _expected(found: Restoration) -> QualityCheck:
    compared = found.comparison
    assert compared is not None
    return check(
        "expected_stress",
        compared.chi_square,
        compared.limit,
        "Reduced chi-square of the scan against the expected stress blurred by A G, whose "
        "uncertainty counts, with centre and baseline fitted. The restored stress differs from the "
        f"expected one by up to {compared.difference:.1%} of the largest, and agrees within 95 % "
        f"bounds at {compared.within:.0%} of the radii. A failure means that the contact is not as "
        "it was calculated: friction, shape, film, or load.",
        compared.p_value,
    )


def restoration_messages(
    found: Restoration, checks: tuple[QualityCheck, ...]
) -> tuple[Message, ...]:
    """Return the messages that accompany a result, the gravest first."""
    estimate, points = found.posterior.estimate, found.points
    messages = failed_check_messages(checks)
    messages += failed_calibration_messages(found.apparatus)
    if points.missing:
        text = f"{points.missing} points of the scan are missing and were left out."
        messages.append(Message("missing_points", text))
    messages += [
        Message(
            "outlier",
            f"Outlier {found.distance[i] * 1e3:.4g} mm from the centre: {points.u[i] * 1e3:.4g} mV "
            f"instead of {found.predicted[i] * 1e3:.4g} mV.",
        )
        for i in (estimate.outlier_weight < OUTLIER_WEIGHT).nonzero()[0]
    ]
    if points.u_errors is None:
        messages.append(noise_unstated_message(float(found.noise.min())))
    if not found.apparatus.radial_profile.g_errors.any():
        text = "The artifact states no uncertainty of G: nothing is counted for it."
        messages.append(Message("uncertainty_unstated", text))
    film = found.scan.film
    unstated = {
        "film thickness": film.thickness_uncertainty,
        "Poisson's ratio": film.poisson_ratio_uncertainty,
        "load": found.scan.load_uncertainty,
    }
    names = [name for name, value in unstated.items() if value is None]
    if names:
        text = (
            f"No uncertainty is stated for {', '.join(names)}: nothing is counted for "
            f"{'it' if len(names) == 1 else 'them'}."
        )
        messages.append(Message("uncertainty_unstated", text))
    return tuple(messages)


def failed_calibration_messages(apparatus: ApparatusFunction) -> list[Message]:
    """Return one message if a check of the calibration had failed, else none."""
    text = "A quality check of the calibration itself had failed: see its artifact."
    return [] if apparatus.passed else [Message(FAILED_CALIBRATION, text)]


def noise_unstated_message(noise: float) -> Message:
    """Return the message for a scan without u_zz_errors, with the estimated noise in V."""
    text = f"u_zz_errors is absent: a noise of {noise * 1e3:.3g} mV was estimated from the scatter."
    return Message(NOISE_UNSTATED, text)


#: A film passes nothing of exp(-kh) beyond this: 2e-9 of the load.
_LARGEST_KH = 20.0
#: Radii of the table, from the axis to half the scan's width.
_RADII = 161


@single_threaded()
def restore(
    scan: Scan | str | PathLike[str],
    apparatus: ApparatusFunction | str | PathLike[str],
    *,
    expected: Expected = None,
) -> Restoration:
    r"""Restore the stress at the base of the film from a scan with a calibrated sensor.

    Solves :math:`U_{zz} = A\,G \otimes \sigma_{zz}` for the base stress, with a known A and G: what
    presses on the film is a pressure of any radial shape, weighed by evidence, and the film of the
    scan turns it into the stress at its base.  No contact is calculated.

    Parameters
    ----------
    scan : Scan or path
        Voltage against the indenter's position, at one load; a rod's loads may differ.
    apparatus : ApparatusFunction or path
        The calibrated sensor.
    expected : StressProfile, Contact or path, optional
        A calculated base stress to hold against the restored one: adds a check.

    Returns
    -------
    Restoration
        The stress with its uncertainty; its checks may have failed: see ``.passed``.

    Raises
    ------
    InputError
        If scan, artifact or expected stress cannot be used, or not together.
    FitError
        If the scan does not determine a stress.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1), method="bayesian").apparatus
    >>> restored = memscal.restore(memscal.simulate(seed=2), apparatus)
    >>> abs(restored.force - 1.0) < 3 * restored.force_uncertainty
    True
    """
    known, measured = opened_apparatus(apparatus), opened_scan(scan)
    require_measurement(measured, known)
    return restore_known(measured, known, expected)


def restore_known(scan: Scan, known: ApparatusFunction, expected: Expected = None) -> Restoration:
    """Restore a stress from a scan and an apparatus function that were proven to fit together.

    Parameters and errors are those of :func:`restore`.
    """
    points = measured_points(scan)
    estimate, transfer = gaussian_pressure(scan, known, points)
    wavenumbers = estimate.model.reference.wavenumbers
    posterior = restore_posterior(scan, known, estimate, transfer)
    nodes = posterior.nodes
    r = np.linspace(0.0, reach_of(points) / 3, _RADII)
    matrix = wavenumbers.synthesise(np.eye(nodes), r)
    found = Restoration(
        scan=scan,
        apparatus=known,
        posterior=posterior,
        r=r,
        sigma_zz=matrix @ posterior.state[:nodes],
        covariance=matrix @ posterior.covariance[:nodes, :nodes] @ matrix.T,
    )
    if expected is not None:
        found = replace(found, comparison=found.compare(expected))
    checks = restoration_checks(found)
    return replace(found, checks=checks, messages=restoration_messages(found, checks))


def gaussian_pressure(
    scan: Scan, known: ApparatusFunction, points: ScanPoints
) -> tuple[ProfileEstimate, FloatArray]:
    """Return the best Gaussian pressure on the film, departures allowed for, and A G's transform.

    Raises
    ------
    FitError
        If the scan does not determine a stress.
    """
    wavenumbers = Wavenumbers.covering(_LARGEST_KH / scan.film.thickness, reach_of(points))
    transfer = known.conversion_constant * sensor_transfer(known, wavenumbers.k)
    through = RadialSpectrum(wavenumbers, transfer * film_transfer(scan.film, wavenumbers.k))
    return restored_or_explained(lambda: estimate_profile(points, through)), transfer
