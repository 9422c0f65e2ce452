r"""What explains a misfit: a G that is not Gaussian, or one thing that is not as stated.

A rival of a size d changes the reference, the positions or the voltages of a Gaussian sensor, whose
marginal likelihood p(u | d) is that of :mod:`memscal.estimation.bayesian`.  A check has failed, so
that a statement may be wrong: the prior of d about what is stated is a Cauchy distribution, whose
scale s is the stated standard uncertainty, or else the rival's own.  About the most probable size,
with the standard uncertainty u(d), the evidence is by Laplace's method

.. math::

    p(u) = p(u | d)\,\frac{\sqrt{2\pi}\,u(d)}{\pi s\,(1 + d^2/s^2)} .
"""

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from typing import Any

import numpy as np

from memscal.axisymmetry.hankel import RadialSpectrum
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.calibration.assumptions import OF_FILM, statement
from memscal.calibration.stages import Solution
from memscal.errors import FitError
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit, fit_gaussian_to_points
from memscal.estimation.influences import measured_by
from memscal.estimation.profile import gaussian_log_marginal
from memscal.estimation.reference_spectra import difference, law_at_once, spectrum_difference
from memscal.estimation.set_up import film_of
from memscal.mechanics.press_rod import is_tabulated, press_rod
from memscal.model.arrays import FloatArray, Values
from memscal.model.bayes_factor import POSITIVE, VERY_STRONG
from memscal.model.checks import QualityCheck, QualityChecks
from memscal.model.film import LINEAR, NEO_HOOKEAN
from memscal.model.notation import format_measured
from memscal.model.quantities import MM
from memscal.model.scan import Scan

_EVIDENCE = "gaussian_evidence"
_OF_GAUSSIAN = ("gaussian_misfit", _EVIDENCE)
#: Checks whose failure is explained.
MISFITS = (
    *_OF_GAUSSIAN,
    "width_agreement",
    "method_agreement",
    "reconvolution",
    "noise_as_stated",
    "chi_square",
    "residual_steps",
    "residual_correlation",
    "symmetry",
    "baseline_curvature",
)
DEPARTURE = "departure"
_BY_G = "a G that is not Gaussian"
#: By name: words, scale of the prior where no uncertainty is stated (of a thickness relative), and
#: unit of a size.
_RIVALS = {
    "thickness": ("a film of {}", 0.05, "mm"),
    "poisson_ratio": ("a Poisson's ratio of {}", 0.05, ""),
    "film_law": ("a film {} of the way from linear to neo-Hookean", 0.3, ""),
    "stage_scale": ("a stage scale of {}", 0.02, ""),
    "line_offset": ("a line {} beside the centre", 0.3e-3, "mm"),
    "baseline_curvature": ("a baseline that bends by {} of the largest signal", 0.02, ""),
    "gain_curvature": ("an amplifier of curvature {}", 0.05, ""),
    "lag": ("a lag of {} along the scan", 0.2e-3, "mm"),
}
#: The farthest size, and the step of derivatives, over the rival's scale.
_FARTHEST = 6.0
_STEP = 0.03
#: The loss of a size by which nothing fits the scan.
_IMPOSSIBLE = 1e6
#: What a size adds to the voltages is calculated again with the sensor found, where it is of them.
_ROUNDS = {"gain_curvature": 3, "lag": 3}
#: A mean over exponentially distributed delays is summed over so many.
_DELAYS = 10


def explained(
    solution: Solution, checks: Sequence[QualityCheck]
) -> tuple[QualityChecks, list[Values]]:
    """Weigh what explains a misfit; return the checks with what was found, and rows for files."""
    if not misfit(checks):
        return tuple(checks), []
    values = {check.name: check.value for check in checks}
    rows = _weighed(solution, values[_EVIDENCE])
    found = f" {explanation(rows)}"
    told = []
    for check in checks:
        failed = check.name in _OF_GAUSSIAN and not check.passed
        told.append(replace(check, meaning=check.meaning + found * failed))
    return tuple(told), rows


def misfit(checks: Sequence[QualityCheck]) -> bool:
    """Whether a check failed that asks for an explanation."""
    return any(check.name in MISFITS and not check.passed for check in checks)


def explanation(rows: Sequence[Mapping[str, Any]]) -> str:
    """Say what explains a scan that no Gaussian sensor explains with everything as stated."""
    named = {row["name"]: row["words"] for row in rows if row["named"]}
    by_g = named.pop(DEPARTURE, "")
    rivals = " or ".join(named.values())
    end = "or by a cause that is not listed."
    if by_g and rivals:
        return f"The scan is explained by {by_g}; as well explained by {rivals}, {end}"
    if by_g:
        return f"The scan is explained by {by_g}, {end}"
    if rivals:
        return f"The scan is explained by {rivals}, better than by {_BY_G}, {end}"
    return (
        f"The scan is explained by nothing that was weighed, but by larger or slower noise, {end}"
    )


def _weighed(solution: Solution, departure: float) -> list[Values]:
    """Weigh each rival beside a G that is not Gaussian, by falling evidence."""
    gaussian = solution.estimate.weighed.log_marginals[0]
    found = [(departure, DEPARTURE, _BY_G, 0.0)]
    for name in _applicable(solution):
        value, u, evidence, a = _fitted(solution, name)
        words, _, unit = _RIVALS[name]
        # Of a length the sign says nothing.
        size = (abs(value) / MM, u / MM) if unit else (value, u)
        words = words.format(format_measured(*size, unit))
        change = a / solution.deconvolution.conversion_constant - 1
        found.append((evidence - gaussian, name, words, change))
    found.sort(reverse=True)
    least = max(found[0][0] - VERY_STRONG / 2, POSITIVE / 2)
    keys = ("log_bayes_factor", "name", "words", "relative_change_of_a")
    return [dict(zip(keys, row, strict=True)) | {"named": bool(row[0] >= least)} for row in found]


def _applicable(solution: Solution) -> list[str]:
    """Names of the rivals that scans of lines can have."""
    points = solution.estimate.points
    if points.order or points.planar:
        return []
    left_out = list(measured_by(points))
    if solution.stress.form or not solution.on_films:
        left_out += OF_FILM
    elif not all(is_tabulated(*scan.set_up.under(NEO_HOOKEAN)) for scan in solution.scans):
        left_out.append("film_law")
    return [name for name in _RIVALS if name not in left_out]


def _fitted(solution: Solution, name: str) -> tuple[float, float, float, float]:
    """Value of a rival, its standard uncertainty, the logarithm of its evidence, and A by it."""
    from scipy.optimize import minimize_scalar

    estimate = solution.estimate
    stated, u = _statement(solution, name)
    usual = _RIVALS[name][1] * (stated if name == "thickness" else 1.0)
    scale = u or usual
    unit = max(scale, usual)

    def fitted(size: float) -> GaussianFit:
        fit = estimate.gaussian
        for _ in range(_ROUNDS.get(name, 1)):
            model = _changed(solution, name, size, fit)
            fit = fit_gaussian_to_points(model, estimate.weights, start=fit)
        return fit

    def loss(number: float) -> float:
        size = number * unit
        prior = -math.log(math.pi * scale / unit * (1 + (size / scale) ** 2))
        with suppress(FitError):
            return min(-prior - gaussian_log_marginal(estimate, fitted(size)), _IMPOSSIBLE)
        return _IMPOSSIBLE

    best = minimize_scalar(loss, bounds=(-_FARTHEST, _FARTHEST), options={"xatol": _STEP / 5})
    bend = (loss(best.x + _STEP) + loss(best.x - _STEP) - 2 * best.fun) / _STEP**2
    width = max(bend, _FARTHEST**-2) ** -0.5
    size = unit * best.x
    evidence = math.log(math.sqrt(2 * math.pi) * width) - best.fun
    value = min(stated + size, 0.5) if name == "poisson_ratio" else stated + size
    return value, width * unit, evidence, fitted(size).conversion_constant


def _statement(solution: Solution, name: str) -> tuple[float, float | None]:
    """Value of a rival by what is stated, and its standard uncertainty if one is stated."""
    scan = solution.scan
    if name == "film_law":
        film = film_of(solution.stress)
        return float(film is None or film.law != LINEAR), None
    owner = scan.set_up.expected.film if name in OF_FILM else scan
    return getattr(owner, name, float(name == "stage_scale")), statement(owner, name)


def _changed(solution: Solution, name: str, size: float, fit: GaussianFit) -> ForwardModel:
    """Model of scans where one thing is off by a size, without what that adds to the voltages."""
    model = solution.estimate.model
    points = model.points
    place = points.positions
    signal = fit.predicted - model.drift_columns @ fit.drift
    added: FloatArray | float = 0.0
    if name in OF_FILM:
        pairs = zip(solution.scans, model.references, strict=True)
        model = replace(model, references=tuple(_reference(*pair, name, size) for pair in pairs))
    elif name == "stage_scale":
        place = (1 + size) * place
    elif name == "line_offset":
        place = place + size * ~points.free[points.scan].T
    elif name == "baseline_curvature":
        added = size * solution.estimate.largest_signal * model.parabola
    elif name == "gain_curvature":
        added = -size * signal * abs(signal) / abs(signal).max()
    else:
        # The reading is a mean over where the indenter was; what it lags on average is no error.
        kernel = fit.conversion_constant * gaussian_transfer(model.k, fit.sigma)
        added = -signal
        for delay, weight in zip(*np.polynomial.laguerre.laggauss(_DELAYS), strict=True):
            geometry = model.geometry(fit.centre + (delay - 1) * size * points.free)
            added = added + weight * model.signal(geometry, kernel)
    return replace(model, points=replace(points, x=place[0], y=place[1], u=points.u - added))


def _reference(scan: Scan, reference: RadialSpectrum, name: str, size: float) -> RadialSpectrum:
    """Transform of the base stress on a film of another thickness, Poisson's ratio or law."""
    set_up = scan.set_up.expected
    if name == "film_law":
        rods = (press_rod(*set_up.under(law)) for law in (NEO_HOOKEAN, LINEAR))
        change = size * spectrum_difference(reference, *rods)
    else:
        value = getattr(set_up.film, name) + size
        if name == "poisson_ratio":
            value = min(value, 0.5)
        varied = set_up._replace(film=replace(set_up.film, **{name: value}))
        # Beyond the table a film takes long: there the change is that of a linear one.
        law = law_at_once(varied)
        own = set_up.under(law)
        change = difference(own, reference, varied.under(law), own)
    return replace(reference, values=reference.values + change)
