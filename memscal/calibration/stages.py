"""Steps of the paper from scans to A and G, without their uncertainty.

:func:`solve` makes the two fields of a scan and its reference, and :func:`deconvolve` divides
them by the functions of :mod:`memscal.deconvolution.fourier_ratio`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import j0, j1

from memscal.calibration.diagnosis import require_profile
from memscal.calibration.fields import (
    Fields,
    GridChoice,
    LineFields,
    RasterFields,
    choose_grid,
    constrained_kernel,
)
from memscal.deconvolution.division import Bayesian, Regulariser
from memscal.deconvolution.fourier_ratio import (
    Field,
    Quotient,
    divide,
    fit_gaussian,
    normalise,
    reconvolve,
)
from memscal.errors import InputError
from memscal.estimation.band import Band, find_band
from memscal.estimation.points import channel_order, measured_points
from memscal.estimation.profile import ProfileEstimate
from memscal.estimation.reference import reference_spectra
from memscal.mechanics.contact import Contact
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile

#: A shear's integral is summed out to this multiple of the scan's reach, at this many radii.
_FAR = 2.0
_RADII = 2001


def solve(
    scans: Sequence[Scan],
    stresses: Sequence[StressProfile | Contact],
    regulariser: Regulariser,
    channel: str = "zz",
) -> Solution:
    """Find A and G: profile of the scans, fields over the plane, and their division."""
    require_channel_method(channel, regulariser)
    points = [measured_points(scan, channel) for scan in scans]
    references = reference_spectra(stresses, points, [scan.film.thickness for scan in scans])
    estimate = require_profile(scans, stresses, points, references)
    band = find_band(estimate)
    choice = choose_grid(estimate, band)
    fields = prepare_fields(estimate, choice, divided=not isinstance(regulariser, Bayesian))
    return Solution(
        scans=tuple(scans),
        stresses=tuple(stresses),
        estimate=estimate,
        band=band,
        choice=choice,
        fields=fields,
        regulariser=regulariser,
        deconvolution=deconvolve(estimate, band, fields, regulariser),
        gaussian_misfit=_misfit(estimate, estimate.gaussian.predicted),
    )


def deconvolve(
    estimate: ProfileEstimate, band: Band, fields: Fields, regulariser: Regulariser
) -> Deconvolution:
    """Divide the fields, normalise, fit a Gaussian, and convolve back."""
    require_channel_method(estimate.points.channel, regulariser)
    # Eq. 2: A G.
    quotient = divide(
        fields.voltage,
        fields.stress,
        weakest=(band.weakest_reference, band.weakest_voltage),
        method=regulariser,
        posterior=constrained_kernel(estimate, fields),
    )
    quotient = replace(quotient, values=quotient.values * fields.confinement)
    # Eq. 3: A, and G of unit integral.
    a, g = normalise(fields.on_support(quotient.values, quotient.profile))
    sigma = fit_gaussian(g, estimate.gaussian.sigma)
    # Eq. 1: the voltage that A and G predict.
    predicted = _reconvolved(estimate, fields, quotient) + estimate.background
    return Deconvolution(quotient, a, g, sigma, predicted, _misfit(estimate, predicted))


def require_channel_method(channel: str, regulariser: Regulariser) -> None:
    """Refuse to divide the fields of a tangential channel, and a channel that does not exist."""
    if channel_order(channel) and not isinstance(regulariser, Bayesian):
        raise InputError(
            f"Channel {channel} cannot be calibrated by method {regulariser.name}.",
            why="It divides fields, and the transform of a shear is zero along a line and at "
            "k = 0, where A is read off.",
            cure='Use method="bayesian" (--method bayesian), which divides none.',
        )


def prepare_fields(
    estimate: ProfileEstimate, choice: GridChoice, *, divided: bool = True
) -> Fields:
    """Lift the profile of lines or several scans, or place a raster (evenly if it is divided)."""
    if estimate.points.as_raster:
        return RasterFields.place(estimate, choice, divided=divided)
    return LineFields.lift(estimate, choice)


@dataclass(frozen=True)
class Misfit:
    """Difference of a prediction from the scan."""

    relative_rms: float  # root-mean-square residual over the largest signal
    chi2_reduced: float  # chi-square against the noise per degree of freedom
    degrees: float


@dataclass(frozen=True, eq=False, repr=False)
class Deconvolution:
    """One division of the fields: A and G, and what they predict for the scan."""

    quotient: Quotient  # A G confined to the support, with its window
    conversion_constant: float  # in V/Pa
    g: Field  # on its support, in 1/m^2
    gaussian_sigma: float  # of the Gaussian nearest to G, in m
    predicted: FloatArray  # (n,): voltages at the measured points, in V
    misfit: Misfit


@dataclass(frozen=True, eq=False, repr=False)
class Solution:
    """Every step of a calibration."""

    scans: tuple[Scan, ...]
    stresses: tuple[StressProfile | Contact, ...]  # the reference of each scan
    estimate: ProfileEstimate  # centre, baseline, noise, outliers and profile
    band: Band  # signal and noise of the voltage's transform
    choice: GridChoice
    fields: Fields
    regulariser: Regulariser
    deconvolution: Deconvolution  # A and G by the division, and their misfit
    gaussian_misfit: Misfit  # the Gaussian fitted in data space against the scan

    @property
    def scan(self) -> Scan:
        """The first scan."""
        return self.scans[0]

    @property
    def stress(self) -> StressProfile | Contact:
        """The reference of the first scan, which the fields are made with."""
        return self.stresses[0]

    @property
    def window_at_nodes(self) -> FloatArray:
        """The regularisation's window at the estimate's nodes; zero beyond the grid."""
        k, window = self.fields.along_axis(self.deconvolution.quotient.window)
        return np.interp(self.estimate.model.k, k, window, right=0.0)

    @property
    def tail_share(self) -> float:
        """Share of the voltage's integral beyond the scan's reach R; of a shear, of its modulus."""
        spectrum, reach = self.estimate.spectrum, self.choice.support
        if spectrum.order:
            r = np.linspace(0.0, _FAR * reach, _RADII)
            flux = np.abs(spectrum.at(r)) * r
            return float(flux[r > reach].sum() / flux.sum())
        # Within R the integral is that of R U(k) J_1(kR) dk over all k.
        k = spectrum.wavenumbers.k
        dk = 2 * np.pi * spectrum.wavenumbers.weights / k
        inside = reach * float(np.sum(dk * spectrum.values * j1(k * reach)))
        return abs(1 - inside / spectrum.integral)


def _reconvolved(estimate: ProfileEstimate, fields: Fields, quotient: Quotient) -> FloatArray:
    """Signal of the deconvolved A G at the points, in V: each scan through its own reference."""
    model, profile = estimate.model, quotient.profile
    if profile is not None:
        geometry = model.geometry(estimate.centres)
        return np.asarray(model.signal(geometry, profile.transform(model.k)) + estimate.oval)
    if estimate.points.scans == 1:
        back = reconvolve(1.0, quotient, fields.stress)
        return fields.at_points(back.values) * estimate.points.load
    k, kernel = fields.along_axis(fields.grid.transfer(quotient.values).real)
    spectrum = np.interp(estimate.model.k, k, kernel, right=0.0)
    return estimate.model.signal(estimate.gaussian.geometry, spectrum)


def _misfit(estimate: ProfileEstimate, predicted: FloatArray) -> Misfit:
    """Compare a prediction with the scan, outliers at their reduced weight."""
    residual = estimate.points.u - predicted
    weight = estimate.outlier_weight
    stated = estimate.points.u_errors
    noise = estimate.noise if stated is None else stated
    degrees = float(weight.sum()) - estimate.gaussian.jacobian.shape[1]
    rms = float(np.sqrt(np.average(residual**2, weights=weight)) / estimate.largest_signal)
    return Misfit(rms, float(np.sum(weight * (residual / noise) ** 2) / degrees), degrees)


@dataclass(frozen=True, eq=False)
class FieldNoise:
    """What a raster's noise adds to the uncertainties."""

    conversion_constant: float  # in V/Pa
    radial: FloatArray  # (n, m): columns whose squares add up to the variance of G, in 1/m^2
    transfer: FloatArray  # (p,): standard uncertainty of single components


def field_noise(solution: Solution, wavenumbers: FloatArray) -> FieldNoise | None:
    """Return what a raster's noise adds at wavenumbers (rad/m); ``None`` for a line scan."""
    # Noise N of a component becomes w N/sigma in A G; over a lattice of area L^2 the mean of G over
    # directions has cov(r, r') = 1/(2 pi L^2) int (w N/sigma)^2 J_0(kr) J_0(kr') k dk.
    estimate, deconvolution = solution.estimate, solution.deconvolution
    if not estimate.points.planar or estimate.points.scans > 1:
        return None
    k, weights = estimate.model.k, estimate.model.reference.wavenumbers.weights
    fields = solution.fields
    # Where both vanish, window and reference are divided on the grid, not interpolated apart.
    axis, window = fields.along_axis(deconvolution.quotient.window)
    reference = fields.along_axis(np.abs(fields.grid.forward(fields.stress.values)))[1]
    ratio = np.divide(window, reference, out=np.zeros_like(window), where=window > 0)
    amplified = solution.band.noise * np.interp(k, axis, ratio, right=0.0)
    area = fields.grid.cell_area * fields.voltage.values.size
    columns = j0(np.multiply.outer(deconvolution.g.r, k)) * (np.sqrt(weights / area) * amplified)
    return FieldNoise(
        conversion_constant=float(amplified[0]),
        radial=columns / deconvolution.conversion_constant,
        transfer=np.interp(wavenumbers, k, amplified) / deconvolution.conversion_constant,
    )
