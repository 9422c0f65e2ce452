r"""Tests of what the model takes for granted: symmetry, linearity in load, a round sensor.

Each adds a few columns to the fitted model and asks by how much the misfit falls.  With
:math:`m` columns that should not be needed, the fall of chi-square follows the chi-square
distribution of :math:`m` degrees of freedom.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from memscal.estimation.evidence import HYPOTHESES
from memscal.estimation.forward import gaussian_transfer
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.validation import FloatArray

__all__ = [
    "Departure",
    "ExtraColumns",
    "axisymmetry_test",
    "departure_evidence",
    "linearity_test",
    "symmetry_test",
]

#: Loads must differ by this share of their mean before linearity can be tested.
_LOAD_CONTRAST = 0.05
#: Probabilities below this are not followed by the evidence.
_LEAST_PROBABILITY = 1e-4


@dataclass(frozen=True, eq=False)
class ExtraColumns:
    """Outcome of adding columns to the model.

    ``fall`` of chi-square for ``count`` columns; ``coefficients`` and their standard
    ``errors``; ``size``: largest voltage of the added part over the largest signal.
    """

    fall: float
    count: int
    coefficients: FloatArray
    errors: FloatArray
    size: float


@dataclass(frozen=True)
class Departure:
    """How far the scan speaks for a departure from a Gaussian G.

    ``log_bayes_factor``: natural logarithm of the evidence for departures over that for the
    Gaussian, the prior odds taken out, within -8.5 and 8.5; ``kind``: the most probable kind of
    departure, and its ``share`` of all departures' probability (zero where none has any).
    """

    log_bayes_factor: float
    kind: str
    share: float


def departure_evidence(estimate: ProfileEstimate) -> Departure:
    """Weigh departures of any kind against the Gaussian, by their evidence."""
    prior, weighed = HYPOTHESES[0].estimate, estimate.weighed
    posterior = np.clip(weighed.gaussian_probability, _LEAST_PROBABILITY, 1 - _LEAST_PROBABILITY)
    factor = (1 - posterior) / posterior * prior / (1 - prior)
    kinds: dict[str, float] = {}
    for hypothesis, probability in zip(HYPOTHESES[1:], weighed.probability[1:], strict=True):
        if hypothesis.shape is not None and hypothesis.estimate > 0:
            name = hypothesis.shape.name
            kinds[name] = kinds.get(name, 0.0) + float(probability)
    kind = max(kinds, key=lambda name: kinds[name])
    return Departure(float(np.log(factor)), kind, kinds[kind] / max(sum(kinds.values()), 1e-300))


def symmetry_test(estimate: ProfileEstimate) -> ExtraColumns:
    """Compare the left and right halves of a line scan.

    Is anything odd left over?  The columns are odd in the distance from the centre, at three
    widths of the profile.  A tangential channel's own signal is odd, and the columns are even.
    """
    points = estimate.points
    dx, dy = estimate.offset
    side = np.where(points.free[points.scan, 0], dx, dy)
    return _add(estimate, side[:, None] * _widened(estimate, (0.5, 1.0, 1.5)))


def axisymmetry_test(estimate: ProfileEstimate) -> ExtraColumns:
    """Ask whether a raster is elliptic: columns that vary as cos 2a and sin 2a."""
    dx, dy = estimate.offset
    quadrupole = np.stack([dx**2 - dy**2, 2 * dx * dy], axis=1)
    shapes = _widened(estimate, (0.5, 1.0))
    columns = [quadrupole * shape[:, None] for shape in shapes.T]
    return _add(estimate, np.concatenate(columns, axis=1))


def linearity_test(estimate: ProfileEstimate) -> ExtraColumns | None:
    r"""Test the paper's linearity in load: :math:`U \propto P (1 + \eta (P - \bar P)/\bar P)`.

    Returns
    -------
    ExtraColumns or None
        Its coefficient is eta; ``None`` where the loads do not differ enough.
    """
    load = estimate.points.load
    mean = float(load.mean())
    if np.ptp(load) < _LOAD_CONTRAST * mean:
        return None
    signal = estimate.predicted - estimate.background
    return _add(estimate, (signal * (load - mean) / mean)[:, None])


def _widened(estimate: ProfileEstimate, factors: tuple[float, ...]) -> FloatArray:
    """Profiles of Gaussians of several widths, shape (n, factors): smooth test functions."""
    model, fit = estimate.model, estimate.gaussian
    width = max(fit.sigma, 0.5 * estimate.points.step)
    kernels = [gaussian_transfer(model.k, factor * width) for factor in factors]
    return model.signal(fit.geometry, np.stack(kernels, axis=1))


def _add(estimate: ProfileEstimate, columns: FloatArray) -> ExtraColumns:
    """Fit the columns together with a round model to what that leaves over.

    The departures enter as explained: they are even, and absorb nothing odd or uneven.
    """
    weights = estimate.weights / estimate.noise_scale**2
    standardised = estimate.points.standardised
    scale = np.abs(columns).max(axis=0)
    columns = columns / scale
    round_ = estimate.gaussian.jacobian[:, : estimate.basis.flat - estimate.points.ellipse]
    jacobian = round_ / np.linalg.norm(round_, axis=0)
    base = np.linalg.qr(standardised(jacobian, weights))[0]
    scaled = standardised(columns, weights)
    residual = standardised(estimate.weighed.residual + estimate.oval, weights)
    residual = residual - base @ (base.T @ residual)
    free = scaled - base @ (base.T @ scaled)
    information = np.linalg.pinv(free.T @ free, hermitian=True)
    coefficients = information @ (free.T @ residual)
    fall = float(residual @ free @ coefficients)
    return ExtraColumns(
        fall=fall,
        count=columns.shape[1],
        coefficients=coefficients / scale,
        errors=np.sqrt(np.diag(information)) / scale,
        size=float(np.abs(columns @ coefficients).max() / estimate.largest_signal),
    )
