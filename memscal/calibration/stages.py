"""Steps of the paper from scans to A and G, without their uncertainty.

:func:`solve` makes the two fields of a scan and its reference, and :func:`deconvolve` divides
them by the functions of :mod:`memscal.deconvolution.fourier_ratio`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import cached_property

import numpy as np
from scipy.special import j1

from memscal.axisymmetry.hankel import ACROSS
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.calibration.fields import Fields, GridChoice, LineFields, RasterFields, choose_grid
from memscal.deconvolution import fourier_ratio
from memscal.deconvolution.division import Method, WhiteNoise
from memscal.deconvolution.fourier_ratio import Field, Quotient
from memscal.deconvolution.widths import fit_gaussian
from memscal.errors import FitError, InputError, MemscalError
from memscal.estimation import points
from memscal.estimation.band import Band, beyond_zeros, find_band
from memscal.estimation.bayesian import Bayesian
from memscal.estimation.profile import ProfileEstimate, constrained_profile, estimate_profile
from memscal.estimation.reference_spectra import expected_spectra, reference_spectra
from memscal.estimation.runs import CentresApart, repeat_centres_test
from memscal.estimation.smoothing import SmoothedProfile, smooth_profile
from memscal.mechanics.contact import BaseStress
from memscal.model.arrays import ArrayPair, FloatArray, array_record, floats, value_record
from memscal.model.checks import FALSE_ALARM
from memscal.model.scan import Scan
from memscal.progress import done_with

#: Whose centre is fitted: a scan's, or each repeat's.
COMMON = "common"
PER_REPEAT = "per-repeat"
#: A shear's integral is summed out to this multiple of the scan's reach, at this many radii.
_FAR = 2.0
_RADII = 2001


def solve(
    scans: Sequence[Scan],
    stresses: Sequence[BaseStress],
    method: Method,
    channel: str = "zz",
    *,
    centre: str | None = COMMON,
    owners: Sequence[int] = (),
    per: str = "Pa",
) -> Solution:
    """Find A and G."""
    # ``centre``: of a scan, or of each of its repeats; ``None`` leaves it to a test. ``owners``:
    # the number of the scan that each is a part of. ``per``: the unit by which A divides.
    require_channel_method(channel, method)
    owners = owners or range(len(scans))
    apart = None
    if centre != PER_REPEAT:
        estimate = require_profile(scans, stresses, channel, owners, per)
        apart = repeat_centres_test(estimate)
    if centre == PER_REPEAT or (centre is None and apart and apart.p_value < FALSE_ALARM):
        try:
            separate, numbers = points.scans_of_repeats(scans, channel)
            of_repeats = [stresses[i] for i in numbers]
            parts = [owners[i] for i in numbers]
            estimate = require_profile(separate, of_repeats, channel, parts, per)
            scans = separate
            stresses = of_repeats
            owners = parts
        except MemscalError:
            # Repeats that cannot be fitted by themselves keep one centre, and fail its check.
            if centre == PER_REPEAT:
                raise
    solution = solved(scans, stresses, estimate, method)
    done_with("division")
    return replace(solution, owners=owners, apart=apart)


def solved(
    scans: Sequence[Scan],
    stresses: Sequence[BaseStress],
    estimate: ProfileEstimate,
    method: Method,
    of_grid: ProfileEstimate | None = None,
) -> Solution:
    """Find A and G from the estimate of the profile, or with the grid of another's width."""
    smoothed = None if estimate.points.order else smooth_profile(estimate)
    band = find_band(estimate, smoothed)
    choice = choose_grid(of_grid or estimate, band)
    fields = prepare_fields(estimate, smoothed, choice, divided=not isinstance(method, Bayesian))
    band = beyond_zeros(band, estimate, fields.grid.wavenumber, fields.voltage.transform)
    gaussian = _misfit(estimate, estimate.gaussian.predicted)
    steps = (scans, stresses, estimate, smoothed, band, choice, fields, method)
    return Solution(*steps, deconvolve(estimate, band, fields, method), gaussian)


def require_profile(
    scans: Sequence[Scan],
    stresses: Sequence[BaseStress],
    channel: str,
    owners: Sequence[int],
    per: str,
) -> ProfileEstimate:
    """Estimate the profile of scans; refuse one that is as narrow as its reference."""
    measured = [points.calibration_points(scan, channel) for scan in scans]
    references = expected_spectra(scans, stresses, reference_spectra(stresses, measured))
    joined = points.joined_points(measured, owners)
    joined = replace(joined, reading=replace(joined.reading, per=per))
    ordinary = points.ordinary_readings(joined)
    outcome: ProfileEstimate | Exception
    # A few wild readings draw the first fit to themselves, which nothing but a failure tells.
    for begin_with in (np.ones_like(ordinary), ordinary):
        try:
            # At a width of zero the slopes by the width vanish, and no later step is defined.
            with np.errstate(all="ignore"):
                outcome = estimate_profile(joined, *references, angular=True, begin_with=begin_with)
            if outcome.gaussian.has_width(outcome.weights, outcome.noise_scale):
                return outcome
        except (FitError, np.linalg.LinAlgError) as failure:
            outcome = failure
        if ordinary.all():
            break
    # Imported here, for it searches only where something is wrong.
    from memscal.calibration.diagnosis import diagnosed

    raise diagnosed(scans, stresses, measured, outcome) from None


def deconvolve(
    estimate: ProfileEstimate, band: Band, fields: Fields, method: Method
) -> Deconvolution:
    """Find A and G by a method: divide the fields, or take the posterior's; convolve back."""
    require_channel_method(estimate.points.channel, method)
    stress = fields.stress
    posterior = None
    # Eq. 2: A G, by a division or of the posterior, as constrained.
    if isinstance(method, Bayesian):
        posterior = constrained_profile(
            estimate, nonnegative=method.nonnegative, monotone=method.monotone
        )
        window = np.ones_like(stress.transform.real)
        quotient = Quotient(fields.grid, fields.kernel(posterior.radial), window)
    else:
        weakest = (band.weakest_reference, band.weakest_voltage)
        both = [fields.voltage, stress]
        if band.blur:
            factor = gaussian_transfer(stress.grid.wavenumber, band.blur)
            both = [replace(f, values=f.grid.filtered(f.values, factor)) for f in both]
        quotient = fourier_ratio.divide(*both, weakest=weakest, method=method)
    quotient = replace(quotient, values=quotient.values * fields.confinement)
    # Eq. 3: A, and G of unit integral.
    a, g = fourier_ratio.normalise(fields.on_support(quotient.values, posterior))
    sigma = fit_gaussian(g, estimate.gaussian.sigma)
    # Eq. 1: the voltage that A and G predict, of each scan through its own reference.
    model = estimate.model
    data = estimate.points
    in_place = data.scans == 1 and not data.in_motion and model.reference.order != ACROSS
    if posterior:
        signal = model.signal(model.geometry(estimate.centres), posterior.kernel) + estimate.oval
    elif in_place:
        signal = fields.convolved(quotient) * data.load
    else:
        k, kernel = fields.grid.axis_transfer(quotient.values)
        spectrum = np.interp(model.k, k, kernel.real, right=0.0)
        signal = model.signal(estimate.gaussian.geometry, spectrum) + estimate.oval
    predicted = signal + estimate.background
    misfit = _misfit(estimate, predicted)
    # What the window takes from the estimate of G, that of the posterior.
    passed = np.interp(model.k, fields.grid.wavenumber_axis, quotient.window[0], right=0.0)
    lost = (np.zeros_like(passed) if posterior else 1 - passed) * estimate.kernel / a
    hidden = model.reference.wavenumbers.synthesise(lost, g.r)
    return Deconvolution(quotient, a, g, sigma, hidden, predicted, misfit, posterior is None)


def require_channel_method(channel: str, method: Method) -> None:
    """Refuse to divide the fields of a tangential channel, and a channel that does not exist."""
    if points.channel_order(channel) and not isinstance(method, Bayesian):
        raise InputError(
            f"Channel {channel} cannot be calibrated by method {method.name}.",
            why="It divides fields, and the transform of a shear is zero along a line and at "
            "k = 0, where A is read off.",
            cure='Use method="bayesian" (--method bayesian), which divides none.',
        )


def prepare_fields(
    estimate: ProfileEstimate,
    smoothed: SmoothedProfile | None,
    choice: GridChoice,
    *,
    divided: bool = True,
) -> Fields:
    """Lift the profile of lines or several scans, or place a raster (evenly if it is divided)."""
    data = estimate.points
    if smoothed and (data.as_raster or (data.planar and not divided)):
        return RasterFields.place(estimate, smoothed, choice, divided)
    if divided and not (estimate.model.round_references or data.as_raster):
        raise InputError(
            "The reference is a field that is not round, which a line does not show.",
            why="A division needs the voltage over the plane, as one raster has it.",
            cure='Use method="bayesian" (--method bayesian), or scan one raster.',
        )
    return LineFields.lift(estimate, (smoothed or estimate).spectrum, choice)


@value_record
class Misfit:
    """Difference of a prediction from the scan."""

    relative_rms: float  # root-mean-square residual over the largest signal
    chi2_reduced: float  # chi-square against the noise per degree of freedom
    degrees: float


@array_record
class Deconvolution:
    """A and G by one route, a division of the fields or the posterior, and what they predict."""

    quotient: Quotient  # A G confined to the support, with its window
    conversion_constant: float  # in V/Pa
    g: Field  # on its support, in 1/m^2
    gaussian_sigma: float  # of the Gaussian nearest to G, in m
    hidden: FloatArray  # (m,): what the window takes from G at its radii, in 1/m^2
    predicted: FloatArray  # (n,): voltages at the measured points, in V
    misfit: Misfit
    divided: bool  # by a division of the fields; else the posterior's


@array_record
class Solution:
    """Every step of a calibration."""

    scans: Sequence[Scan]
    stresses: Sequence[BaseStress]  # the reference of each scan
    estimate: ProfileEstimate  # centre, baseline, noise, and the posterior of the profile
    smoothed: SmoothedProfile | None  # the profile that is divided; none of a shear
    band: Band  # signal and noise of the voltage's transform
    choice: GridChoice
    fields: Fields
    method: Method
    deconvolution: Deconvolution  # A and G by the method, and their misfit
    gaussian_misfit: Misfit  # the Gaussian fitted in data space against the scan
    owners: Sequence[int] = (0,)  # which of the scans that were given each is, or is a repeat of
    apart: CentresApart | None = None  # test of a common centre for the repeats, where it was made

    @property
    def comparable(self) -> bool:
        """Whether the fields can be divided, so that both routes are open."""
        round_fields = self.estimate.model.round_references or self.estimate.points.as_raster
        return self.smoothed is not None and self.fields.even and round_fields

    @cached_property
    def other(self) -> Deconvolution | None:
        """A and G by the other route, if it is open: Bayesian beside a division, or back."""
        if not self.comparable:
            return None
        other = WhiteNoise() if isinstance(self.method, Bayesian) else Bayesian()
        return deconvolve(self.estimate, self.band, self.fields, other)

    @property
    def transfer(self) -> ArrayPair:
        """Wavenumbers along an axis, in rad/m, and the modulus of the transfer function there."""
        k, spectrum = self.fields.grid.axis_transfer(self.deconvolution.quotient.values)
        return k, floats(abs(spectrum) / self.deconvolution.conversion_constant)

    @property
    def on_films(self) -> bool:
        """Whether every scan has a film that counts."""
        return all(scan.film for scan in self.scans)

    @property
    def per_repeat(self) -> bool:
        """Whether the scans are repeats, each with a centre of its own."""
        return len(set(self.owners)) < len(self.owners)

    @property
    def scan(self) -> Scan:
        """The first scan."""
        return self.scans[0]

    @property
    def stress(self) -> BaseStress:
        """The reference of the first scan, which the fields are made with."""
        return self.stresses[0]

    @property
    def tail_share(self) -> float:
        """Share of the voltage's integral beyond the scan's reach R; of a shear, of its modulus."""
        spectrum = self.estimate.spectrum
        reach = self.choice.support
        if spectrum.order:
            r = np.linspace(0.0, _FAR * reach, _RADII)
            flux = abs(spectrum.at(r)) * (r if spectrum.order > 0 else 1.0)
            return float(flux[r > reach].sum() / flux.sum())
        # Within R the integral is that of R U(k) J_1(kR) dk over all k.
        k = spectrum.wavenumbers.k
        dk = 2 * np.pi * spectrum.wavenumbers.weights / k
        inside = reach * np.sum(dk * spectrum.values * j1(k * reach))
        return abs(1 - inside / spectrum.integral)


def _misfit(estimate: ProfileEstimate, predicted: FloatArray) -> Misfit:
    """Compare a prediction with the scan, outliers at their reduced weight."""
    data = estimate.points
    residual = data.u - predicted
    weight = estimate.outlier_weight
    degrees = weight.sum() + data.curved.size - estimate.gaussian.jacobian.shape[1]
    rms = float(np.sqrt(np.average(residual**2, weights=weight)) / estimate.largest_signal)
    # As stated, uncertain positions and correlations included, where anything is stated.
    noise = 1.0 if data.noise_stated else estimate.noise_scale
    square = np.sum(data.standardised(residual, estimate.weights) ** 2)
    return Misfit(rms, square / noise**2 / degrees, degrees)
