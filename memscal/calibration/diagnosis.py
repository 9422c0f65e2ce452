"""Cause of a scan that determines no width: the stated length that has to be another.

Film and rod blur the sensor, so no voltage is narrower than the reference.  Where one is, the
Gaussian's width goes to zero, and A and G lose their meaning.  Each stated length in turn is then
scaled, the rod solved again, and a Gaussian fitted, to find the value at which the scan fits.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import cached_property
from itertools import chain

import numpy as np

from memscal.errors import FitError, InputError, MemscalError
from memscal.estimation.forward import forward_model
from memscal.estimation.gaussian import GaussianFit, fit_gaussian_to_points
from memscal.estimation.outliers import robust_scale
from memscal.estimation.points import ScanPoints, channel_order, clipped_looks, joined_points
from memscal.estimation.profile import LEAST_SIGNIFICANCE, ProfileEstimate, stated_weights
from memscal.estimation.reference_spectra import reference_spectra
from memscal.mechanics.contact import BaseStress, Contact, stress_table
from memscal.mechanics.press_rod import press_rod
from memscal.model.arrays import TINY, FloatArray, array_record
from memscal.model.checks import at_ceiling_text
from memscal.model.film import LINEAR
from memscal.model.indenter import Rod
from memscal.model.scan import Scan
from memscal.model.stress import IDEAL
from memscal.readings.mistaken_unit import mistaken_unit

#: Residuals of this share of the largest signal, and twice the stated noise, are a misfit.
_MISFIT = 0.03
#: A length is at fault if another value lowers chi-square by this much, in which residuals beyond
#: so many standard deviations count linearly; values up to the last rise fit as well as the best.
_CLEARLY = 25.0
_KNEE = 3.0
_AS_GOOD = 4.0
#: Factors are tried by this ratio, on so many points, until the misfit has risen by this factor.  A
#: length is followed up if a factor leaves less than this share of the misfit.
_RATIO = 1.4
_MOST_POINTS = 200
_RISEN = 1.05
_PROMISING = 0.9
_HALVINGS = 7
#: Lengths are scaled until the scan spans so many thicknesses of the film, and a rod until its
#: radius is so small a share of the thickness that it acts as a point.
_LONGEST_SPAN = 60.0
_USUAL_SPAN = 8.0
_THINNEST = 0.02
#: A ceiling that is named lies so far below the readings that it takes in their last digits.
_BELOW = 1e-5
#: Load of the rods that are tried, in N: the reference per newton does not depend on it.
_LOAD = 1e-6
_RADII = "/entry/reference/r"


@contextmanager
def naming_ceiling(scans: Sequence[Scan], channel: str) -> Iterator[None]:
    """Say in a refusal which readings look clipped, or are left out at a ceiling."""
    try:
        yield
    except (FitError, InputError) as error:
        causes = "\n".join(filter(None, map(_clipped, scans)))
        if not causes or channel_order(channel):
            raise
        cure = f"{causes}\n{error.cure}".strip()
        raise type(error)(error.problem, why=error.why, cure=cure) from error


def _clipped(scan: Scan) -> str:
    """Say which readings of a scan look clipped, or how many are left out; nothing where none."""
    if scan.at_ceiling:
        text = at_ceiling_text(round(scan.at_ceiling))
        return f"{text} The others may not tell A: measure with a lower gain or load."
    top = clipped_looks(scan.u_zz[np.isfinite(scan.u_zz)])
    if top.size:
        lowest = top[-1] - np.ptp(top) - _BELOW * abs(top[-1])
        ceiling = scan.reading.text(lowest, ".6g")
        return (
            f"{top.size} readings look clipped: they agree at {scan.reading.text(top[0], '.4g')}. "
            "If amplifier or converter was at its end there, leave them out (memscal import "
            f"--ceiling VALUE, {ceiling}), or measure with a lower gain or load."
        )
    return ""


def diagnosed(
    scans: Sequence[Scan],
    stresses: Sequence[BaseStress],
    points: Sequence[ScanPoints],
    outcome: ProfileEstimate | Exception,
) -> Exception:
    """Return why the profile of scans has no width, or cannot be fitted at all."""
    # The search takes some of the points, evenly, without correlations.
    some = []
    for measured in points:
        step = -(-measured.u.size // _MOST_POINTS)
        some.append(measured.selected(np.arange(0, measured.u.size, step)))
    search = _Search(scans, stresses, some)
    error = search.error()
    if error:
        return error
    if isinstance(outcome, ProfileEstimate):
        return _hidden(outcome, search)
    if isinstance(outcome, FitError):
        return outcome
    return FitError(
        "No apparatus function of any width fits the scan.",
        cure="Look at the scan; check the values and units of positions, film and rod.",
    )


def _hidden(estimate: ProfileEstimate, search: _Search) -> FitError:
    """Return the error for a sensor too narrow for its film: no stated length is at fault."""
    model = estimate.model
    fit = estimate.gaussian
    # Near zero the voltage changes with the square of the width, whose uncertainty is finite.
    slope = fit.jacobian.copy()
    slope[:, 1] = model.signal(fit.geometry, -0.5 * fit.conversion_constant * model.k**2)
    squared = replace(fit, jacobian=slope).covariance(estimate.weights, estimate.noise_scale)
    widest = np.sqrt(2 * np.sqrt(squared[1, 1]))
    stated = estimate.points.u_errors
    noise = 0.0 if stated is None else np.median(stated) / estimate.largest_signal
    residual = np.median(estimate.noise) / estimate.largest_signal
    why = (
        "Film and rod, or the source, blur the image. A sensor of a Gaussian width below "
        f"{widest * 1e3:.2g} mm is hidden by the noise, and G is not determined."
    )
    if residual > max(_MISFIT, 2 * noise):
        why = (
            f"The nearest fit leaves residuals of {residual:.1%} of the largest signal: the "
            "voltage does not rise and fall with the distance from one centre."
        )
    places = ", ".join(length.place for length in search.lengths)
    return FitError(
        f"The scan is as narrow as its reference, {_reference(search.stresses)}: the width of the "
        "apparatus function would be zero.",
        why=why,
        cure=f"Look at the scan for a second peak; check the values and units of {places}. If they "
        "are right, use a thinner film, a narrower rod or source, or average more repeats.",
    )


def _reference(stresses: Sequence[BaseStress]) -> str:
    form = getattr(stresses[0], "form", None)
    return f"the {form}" if form else "the stress at the base of the film"


@array_record
class _Trial:
    """Gaussian fitted to the scans with one length scaled; none where the fit fails."""

    factor: float
    fit: GaussianFit | None
    residual: FloatArray  # (n,): over the stated noise, or in V; infinite without a fit
    weights: FloatArray

    def loss(self, noise: float) -> float:
        """Chi-square of the residuals, linear beyond the knee."""
        root = np.sqrt(1 + (self.residual / (noise * _KNEE)) ** 2)
        return np.sum(2 * _KNEE**2 * (root - 1))

    def explains(self, noise: float) -> bool:
        """Whether a sensor of some width fits, with a signal."""
        if not self.fit or not self.fit.has_width(self.weights, noise):
            return False
        variance = self.fit.covariance(self.weights, noise)[0, 0]
        return self.fit.conversion_constant > LEAST_SIGNIFICANCE * float(np.sqrt(variance))


@array_record
class _Length:
    """One stated length that can be scaled."""

    name: str
    path: str
    stated: float  # in m, of the first scan; 1 where the length is no single value
    factors: FloatArray  # (m,): the factors to try, the first of them 1

    @property
    def place(self) -> str:
        return f"{self.name} ({self.path})"

    def scaled(self, factor: float, limit: str = "") -> str:
        """Name the length and the value that the factor gives."""
        meant = "" if limit else mistaken_unit(factor)
        unit = f" ({meant}?)" if meant else ""
        if self.stated == 1.0:
            return f"{self.place} {limit}{factor:.3g} times as large{unit}"
        value = factor * self.stated * 1e3
        stated = self.stated * 1e3
        return f"{self.place} of {limit}{value:.3g} mm in place of {stated:.4g} mm{unit}"


@array_record
class _Search:
    """Scans whose stated lengths are scaled, one at a time."""

    scans: Sequence[Scan]
    stresses: Sequence[BaseStress]
    points: Sequence[ScanPoints]

    @cached_property
    def lengths(self) -> Sequence[_Length]:
        """Lengths that make the reference narrower than the scan."""
        span = max(max(np.ptp(p.x), np.ptp(p.y)) for p in self.points)
        h = min(scan.film.thickness if scan.film else span / _USUAL_SPAN for scan in self.scans)
        stretch = _grid(_LONGEST_SPAN * h / span)
        positions = _Length("positions", "/entry/data/x", 1.0, stretch)
        ideal = getattr(self.stresses[0], "ideal", None)
        if ideal:
            words = f"a {IDEAL[ideal.shape]} of the {ideal.shape}"
            return _Length(words, "--reference", ideal.size, 1 / stretch), positions
        if not all(isinstance(s, Contact) and isinstance(s.indenter, Rod) for s in self.stresses):
            return _Length("radii of the reference", _RADII, 1.0, 1 / stretch), positions
        a = self.scans[0].set_up.indenter.radius
        # A calibration asks for a rod no wider than its film is thick.
        thinner = _grid(min(_LONGEST_SPAN * h / span, h / (2 * a)))
        return (
            _Length("a film thickness", "/entry/sample/film/thickness", h, 1 / thinner),
            _Length("a rod radius", "/entry/indenter/radius", a, 1 / _grid(a / (_THINNEST * h))),
            positions,
        )

    def error(self) -> FitError | None:
        """Return the error that names the lengths at fault; ``None`` if none is."""
        trials = {length: self._coarse(length) for length in self.lengths}
        fitted = [trial for trial in chain(*trials.values()) if trial.fit]
        if not fitted:
            return None
        # Where no noise is stated, it is that of the best fit.
        noise = 1.0
        if not self.points[0].noise_stated:
            noise = min(robust_scale(trial.residual, TINY) for trial in fitted)
        best = {length: self._refined(length, tried, noise) for length, tried in trials.items()}
        least = min(trial.loss(noise) for trial in best.values())
        unscaled = trials[self.lengths[0]][0].loss(noise)
        per_degree = max(1.0, least / fitted[0].residual.size)
        most = min(unscaled - _CLEARLY * per_degree, 2 * least + _CLEARLY)
        wider = noise * np.sqrt(per_degree)
        causes = []
        others = []
        for length, trial in best.items():
            if trial.loss(noise) <= most and trial.explains(wider):
                causes.append(self._cause(length, trials[length], trial, noise))
            else:
                others.append(length.place)
        if not causes:
            return None
        beyond = f" No other value of {' or '.join(others)} makes it fit." if others else ""
        source = self.scans[0].source
        file = f"{source.file_name}: the " if source else "The "
        cause = "; or with ".join(causes)
        return FitError(
            f"{file}scan is narrower than its reference, {_reference(self.stresses)} as stated.",
            why="Blurred by a sensor, no voltage is narrower than the reference: the width of the "
            "apparatus function would be zero, and A any number.",
            cure=f"Check the stated lengths. The scan would fit with {cause}.{beyond}",
        )

    def _coarse(self, length: _Length) -> list[_Trial]:
        """Try the factors of a length until the misfit has risen twice."""
        trials = []
        for factor in length.factors:
            trials.append(self._trial(length, factor))
            losses = [trial.loss(1.0) for trial in trials]
            if len(losses) > 2 and min(losses[-2:]) > _RISEN * min(losses):
                break
        return trials

    def _refined(self, length: _Length, trials: list[_Trial], noise: float) -> _Trial:
        """Return the best trial of a length, between the neighbours of the best factor."""
        from scipy.optimize import minimize_scalar

        tried = [min(trials, key=lambda trial: trial.loss(noise))]
        if not tried[0].loss(noise) < _PROMISING * trials[0].loss(noise):
            return tried[0]

        def loss(exponent: float) -> float:
            tried.append(self._trial(length, np.exp(exponent)))
            return min(tried[-1].loss(noise), 1e300)

        middle = np.log(tried[0].factor)
        reach = np.log(_RATIO)
        bounds = (middle - reach, middle + reach)
        minimize_scalar(loss, bounds=bounds, options={"xatol": 5e-3, "maxiter": 15})
        return min(tried, key=lambda trial: trial.loss(noise))

    def _cause(self, length: _Length, trials: list[_Trial], best: _Trial, noise: float) -> str:
        """Name a length with its best value, or with its limit if any value beyond fits too."""
        enough = best.loss(noise) + _AS_GOOD
        if trials[-1].loss(noise) > enough or len(trials) < length.factors.size:
            return length.scaled(best.factor)
        near = 1.0
        far = best.factor
        for _ in range(_HALVINGS):
            middle = np.sqrt(near * far)
            fits = self._trial(length, middle).loss(noise) <= enough
            near, far = (near, middle) if fits else (middle, far)
        return length.scaled(far, "at most " if far < 1 else "at least ")

    def _trial(self, length: _Length, factor: float) -> _Trial:
        points = self.points
        stresses = self.stresses
        if length.path == "/entry/data/x":
            points = [replace(p, x=p.x * factor, y=p.y * factor) for p in points]
        else:
            stresses = [_scaled(stress, length.path, factor) for stress in stresses]
        joined = joined_points(points)
        weights = stated_weights(joined)
        with np.errstate(all="ignore"), suppress(MemscalError, np.linalg.LinAlgError):
            model = forward_model(joined, reference_spectra(stresses, points))
            fit = fit_gaussian_to_points(model, weights)
            residual = (joined.u - fit.predicted) * np.sqrt(weights)
            if np.isfinite(residual).all():
                return _Trial(factor, fit, residual, weights)
        return _Trial(factor, None, np.full(1, np.inf), weights)


def _scaled(stress: BaseStress, path: str, factor: float) -> BaseStress:
    """Return the linear rod with one length scaled, or a profile at scaled radii."""
    if isinstance(stress, Contact) and isinstance(stress.indenter, Rod) and path != _RADII:
        film = stress.film
        rod = stress.indenter
        if path == "/entry/indenter/radius":
            rod = replace(rod, radius=rod.radius * factor)
        else:
            film = replace(film, thickness=film.thickness * factor)
        return press_rod(replace(film, law=LINEAR, mooney_rivlin_ratio=None), rod, _LOAD)
    profile = stress_table(stress)
    ideal = profile.ideal
    if ideal:
        return replace(profile, ideal=replace(ideal, size=ideal.size * factor))
    field = profile.field
    if field:
        return replace(profile, field=replace(field, x=field.x * factor, y=field.y * factor))
    shear = None if profile.sigma_rz is None else profile.sigma_rz / factor**2
    zz = profile.sigma_zz / factor**2
    return replace(profile, r=profile.r * factor, sigma_zz=zz, sigma_rz=shear)


def _grid(most: float) -> FloatArray:
    return _RATIO ** np.arange(int(np.log(max(most, 1.0)) / np.log(_RATIO)) + 1.0)
