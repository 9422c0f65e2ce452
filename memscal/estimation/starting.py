"""Where the search for the best Gaussian begins: a grid of centres and widths, tried robustly."""

from __future__ import annotations

import numpy as np

from memscal.errors import FitError
from memscal.estimation.forward import ForwardModel, gaussian_transfer
from memscal.estimation.parity import require_parity
from memscal.model.validation import FloatArray

__all__ = ["robust_start", "smoothing_length", "undetermined"]

#: Widths from which the search starts, in units of the film's smoothing length.
_STARTING_WIDTHS = (0.1, 0.3, 0.8)


def robust_start(model: ForwardModel, weights: FloatArray) -> FloatArray:
    """Start each scan by itself, and A and the width at the medians of all.

    Parameters
    ----------
    model : ForwardModel
        Points and reference.
    weights : ndarray, shape (n,)
        Relative weights of the points.

    Returns
    -------
    ndarray, shape (p,)
        A, sigma, centres, drift and ellipticity, as in
        :func:`memscal.estimation.gaussian_fit.linearise`.

    Raises
    ------
    FitError
        If no Gaussian with a positive A comes near the scan.
    InputError
        If a tangential channel's voltage has the wrong parity or sign.
    """
    points = model.points
    parts = [
        _robust_start_of_one(model.only(i), weights[points.scan == i]) for i in range(points.scans)
    ]
    shape = np.median([part[:2] for part in parts], axis=0)
    free = points.free.sum(axis=1)
    centres = [part[2 : 2 + n] for part, n in zip(parts, free, strict=True)]
    drifts = [part[2 + n : 3 + 2 * n] for part, n in zip(parts, free, strict=True)]
    return np.concatenate([shape, *centres, *drifts, np.zeros(points.ellipse)])


def _robust_start_of_one(model: ForwardModel, weights: FloatArray) -> FloatArray:
    """Best of a grid of centres and widths, by the sum of absolute residuals.

    A single outlier can be the largest voltage of a scan: positions are tried, not read off.
    """
    points = model.points
    centres = _trial_centres(model)
    distances = np.hypot(points.x - centres[:, :1], points.y - centres[:, 1:])
    radii = np.linspace(0.0, 2 * np.ptp(points.x) + 2 * np.ptp(points.y), 400)
    widths = smoothing_length(model) * np.array(_STARTING_WIDTHS)
    kernels = np.stack([gaussian_transfer(model.k, float(width)) for width in widths])
    # Profiles per newton of every width, on a table for quick trials.
    spectra = (model.reference.values * kernels).T
    wavenumbers = model.reference.wavenumbers
    tables = wavenumbers.synthesise(spectra, radii, order=model.order).T
    root = np.sqrt(weights)
    data, drift = root * points.u, root[:, None] * model.drift_columns
    best, best_cost = np.zeros(0), np.inf
    odd: list[FloatArray] = []
    for sigma, table in zip(widths, tables, strict=True):
        shapes = np.interp(distances, radii, table) * (points.load * root)
        if model.order:
            shapes *= model.cosines(centres)
            odd.append(shapes)
        amplitudes, costs = _amplitudes(shapes, data, drift)
        i = int(np.argmin(np.where(amplitudes > 0, costs, np.inf)))
        if amplitudes[i] > 0 and costs[i] < best_cost:
            left = data - amplitudes[i] * shapes[i]
            baseline = np.linalg.lstsq(drift, left, rcond=None)[0]
            best = np.concatenate([[amplitudes[i], sigma], centres[i][points.free[0]], baseline])
            best_cost = float(costs[i])
    if model.order:
        # The potential of a shear looks much as the normal stress does.
        potentials = wavenumbers.synthesise(spectra / model.k[:, None], radii).T
        even = [np.interp(distances, radii, each) * (points.load * root) for each in potentials]
        require_parity(
            points,
            _amplitudes(np.concatenate(odd), data, drift),
            _amplitudes(np.concatenate(even), data, drift),
        )
    if not best.size:
        raise undetermined(model)
    return best


def _amplitudes(
    shapes: FloatArray, data: FloatArray, drift: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Fit each row of shapes beside the drift: its amplitude, the sum of absolute residuals."""
    base = np.linalg.qr(drift)[0]
    free = shapes - (shapes @ base) @ base.T
    rest = data - base @ (base.T @ data)
    square = np.sum(free**2, axis=1)
    amplitudes = np.divide(free @ rest, square, out=np.zeros_like(square), where=square > 0)
    return amplitudes, np.abs(rest - amplitudes[:, None] * free).sum(axis=1)


def _trial_centres(model: ForwardModel) -> FloatArray:
    """At most 40 candidates per axis: the positions themselves, less the outer tenth."""
    points = model.points

    def inner(positions: FloatArray) -> FloatArray:
        unique = np.unique(positions)
        margin = unique.size // 10
        kept = unique[margin : unique.size - margin]
        return kept[:: int(np.ceil(kept.size / (12 if points.planar else 40)))]

    along = [
        inner(positions) if free else np.zeros(1)
        for free, positions in zip(points.free[0], (points.x, points.y), strict=True)
    ]
    mesh = np.meshgrid(*along)
    return np.stack([axis.ravel() for axis in mesh], axis=1)


def smoothing_length(model: ForwardModel) -> float:
    r"""Length over which the film blurs: :math:`1/k` where the reference has fallen to half."""
    values = model.reference.scalar.values
    return float(1 / model.k[int(np.argmax(values / values[0] < 0.5))])


def undetermined(model: ForwardModel, conversion_constant: float | None = None) -> FitError:
    """Return the error for a scan that no Gaussian fits."""
    stopped = conversion_constant is not None
    found = f" (it stopped at A = {conversion_constant:.3g} V/Pa)" if stopped else ""
    return FitError(
        f"No Gaussian apparatus function fits the scan of {model.points.u.size} points{found}.",
        why="The voltage does not rise and fall with the distance from one centre.",
        cure="Look at the scan; check its channel, its positions and that it crosses the sensor.",
    )
