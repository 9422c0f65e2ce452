"""The calibration's chain of steps, up to A and G, without their uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import j0, j1

from memscal.calibration.fields import (
    Fields,
    GridChoice,
    LineFields,
    RasterFields,
    choose_grid,
    constrained_kernel,
)
from memscal.deconvolution.division import Regulariser
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
from memscal.estimation.points import channel_order, joined_points, measured_points
from memscal.estimation.profile import ProfileEstimate, estimate_profile
from memscal.estimation.reference import reference_spectra
from memscal.mechanics.contact import Contact
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile

__all__ = [
    "Deconvolution",
    "FieldNoise",
    "Misfit",
    "Solution",
    "deconvolve",
    "field_noise",
    "prepare_fields",
    "require_channel_method",
    "solve",
]

#: The spectra are resolved out to twice the scan's reach at the least.
_FAR = 2.0
_RADII = 2001


@dataclass(frozen=True)
class Misfit:
    """How well a prediction meets the scan.

    ``relative_rms``: root-mean-square residual over the largest signal; ``chi2_reduced``:
    chi-square against the noise per degree of freedom; ``degrees``: how many there are.
    """

    relative_rms: float
    chi2_reduced: float
    degrees: float


@dataclass(frozen=True, eq=False, repr=False)
class Deconvolution:
    """One division of the fields: A and G, and what they predict for the scan.

    ``quotient``: A G confined to the support, with its window; ``conversion_constant`` in V/Pa;
    ``g``: G on its support, in 1/m^2; ``gaussian_sigma`` in m: the Gaussian nearest to G;
    ``predicted`` (n,) in V, at the measured points.
    """

    quotient: Quotient
    conversion_constant: float
    g: Field
    gaussian_sigma: float
    predicted: FloatArray
    misfit: Misfit


@dataclass(frozen=True, eq=False, repr=False)
class Solution:
    """Every step of a calibration.

    Parameters
    ----------
    scans : tuple of Scan
        What was measured.
    stresses : tuple of StressProfile or Contact
        The reference of each scan.
    estimate : ProfileEstimate
        Centre, baseline, noise, outliers and profile.
    band : Band
        Signal and noise of the voltage's transform.
    choice : GridChoice
        The grid and the reasons for it.
    fields : Fields
        The two fields.
    regulariser : Regulariser
        How they were divided.
    deconvolution : Deconvolution
        A and G by the division, and their misfit.
    gaussian_misfit : Misfit
        The Gaussian fitted in data space against the scan.
    """

    scans: tuple[Scan, ...]
    stresses: tuple[StressProfile | Contact, ...]
    estimate: ProfileEstimate
    band: Band
    choice: GridChoice
    fields: Fields
    regulariser: Regulariser
    deconvolution: Deconvolution
    gaussian_misfit: Misfit

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
        """The regularisation's window at the quadrature nodes of the estimate.

        What the grid does not carry, beyond its last wavenumber, is as hidden as if windowed.
        """
        k, window = self.fields.along_axis(self.deconvolution.quotient.window)
        return np.interp(self.estimate.model.k, k, window, right=0.0)

    @property
    def tail_share(self) -> float:
        r"""Share of the voltage's integral beyond the scan's reach.

        Within a radius R the integral is
        :math:`R \int \hat U(k) J_1(kR)\,dk`, from the Hankel transform.  Of a tangential channel
        it is that of the radial component's modulus, of which it is summed over radii.
        """
        spectrum, reach = self.estimate.spectrum, self.choice.support
        if spectrum.order:
            r = np.linspace(0.0, _FAR * reach, _RADII)
            flux = np.abs(spectrum.at(r)) * r
            return float(flux[r > reach].sum() / flux.sum())
        k = spectrum.wavenumbers.k
        dk = 2 * np.pi * spectrum.wavenumbers.weights / k
        inside = reach * float(np.sum(dk * spectrum.values * j1(k * reach)))
        return abs(1 - inside / spectrum.integral)


def solve(
    scans: Sequence[Scan],
    stresses: Sequence[StressProfile | Contact],
    regulariser: Regulariser,
    channel: str = "zz",
) -> Solution:
    """Go through the paper's steps: profile, lift, transform, divide, normalise, reconvolve."""
    require_channel_method(channel, regulariser)
    parts = [measured_points(scan, channel) for scan in scans]
    thicknesses = [scan.film.thickness for scan in scans]
    references = reference_spectra(stresses, parts, thicknesses)
    estimate = estimate_profile(joined_points(parts), *references)
    band = find_band(estimate)
    choice = choose_grid(estimate, band)
    fields = prepare_fields(estimate, choice, divided=regulariser.name != "evidence")
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


def require_channel_method(channel: str, regulariser: Regulariser) -> None:
    """Refuse to divide the fields of a tangential channel.

    Raises
    ------
    InputError
        If the method is not evidence, or there is no such channel.
    """
    if channel_order(channel) and regulariser.name != "evidence":
        raise InputError(
            f"Channel {channel} cannot be calibrated by method {regulariser.name}.",
            why="It divides fields, and the transform of a shear is zero along a line and at "
            "k = 0, where A is read off.",
            cure='Use method="evidence" (--method evidence), which divides none.',
        )


def prepare_fields(
    estimate: ProfileEstimate, choice: GridChoice, *, divided: bool = True
) -> Fields:
    """Lift the profile of lines or of several scans, or place a raster as it was measured.

    ``divided``: whether a raster's field is divided, for which it needs an even lattice.
    """
    if estimate.points.as_raster:
        return RasterFields.place(estimate, choice, divided=divided)
    return LineFields.lift(estimate, choice)


def deconvolve(
    estimate: ProfileEstimate, band: Band, fields: Fields, regulariser: Regulariser
) -> Deconvolution:
    """Divide the fields, normalise, fit a Gaussian, and convolve back (Eq. 1 to 3)."""
    require_channel_method(estimate.points.channel, regulariser)
    quotient = divide(
        fields.voltage,
        fields.stress,
        weakest=(band.weakest_reference, band.weakest_voltage),
        method=regulariser,
        posterior=constrained_kernel(estimate, fields),
    )
    quotient = replace(quotient, values=quotient.values * fields.confinement)
    a, g = normalise(fields.on_support(quotient.values, quotient.profile))
    predicted = _reconvolved(estimate, fields, quotient) + estimate.background
    return Deconvolution(
        quotient=quotient,
        conversion_constant=a,
        g=g,
        gaussian_sigma=fit_gaussian(g, estimate.gaussian.sigma),
        predicted=predicted,
        misfit=_misfit(estimate, predicted),
    )


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
    return Misfit(
        relative_rms=float(
            np.sqrt(np.average(residual**2, weights=weight)) / estimate.largest_signal
        ),
        chi2_reduced=float(np.sum(weight * (residual / noise) ** 2) / degrees),
        degrees=degrees,
    )


@dataclass(frozen=True, eq=False)
class FieldNoise:
    """What a raster's noise adds to the uncertainties.

    ``conversion_constant`` in V/Pa; ``radial`` (n, m): columns whose squares add up to the
    variance of G, in 1/m^2; ``transfer`` (p,): standard uncertainty of single components.
    """

    conversion_constant: float
    radial: FloatArray
    transfer: FloatArray


def field_noise(solution: Solution, wavenumbers: FloatArray) -> FieldNoise | None:
    """Return what a raster's noise adds; ``None`` for a line scan, which adds nothing.

    Parameters
    ----------
    solution : Solution
        The calibration's steps.
    wavenumbers : ndarray, shape (p,)
        Where the transfer function is stated, in rad/m.
    """
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
