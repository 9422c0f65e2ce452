"""Elliptic Gaussians: their ellipticity (e1, e2), their response, and what of them is not round."""

import numpy as np

from memscal.estimation.forward import ForwardModel, Geometry
from memscal.model.arrays import ArrayPair, FloatArray

#: Largest ellipticity, and steps of the centred differences by which the response is derived.
_LARGEST = 0.95
_STEP = 1e-4


def bounded(ellipticity: FloatArray) -> FloatArray:
    """Return an ellipticity (e1, e2) that an ellipse can have."""
    size = np.hypot(*ellipticity)
    return ellipticity * min(1.0, _LARGEST / size) if size > 0 else ellipticity


def elliptic_columns(
    model: ForwardModel, geometry: Geometry, sigma: float, ellipticity: FloatArray
) -> ArrayPair:
    """Response per A of an elliptic Gaussian and its derivatives by s, e1, e2; by the centre."""
    # Shapes (n, 4), and (2, n) of each point's own centre.
    here = np.append(sigma, ellipticity)
    steps = np.diag([_STEP * sigma, _STEP, _STEP])
    ellipses = np.vstack([here, here + steps, here - steps])
    for ellipse in ellipses:
        ellipse[1:] = bounded(ellipse[1:])
    responses, shift = model.elliptic(geometry, ellipses)
    slopes = (responses[1:4] - responses[4:]) / (2 * steps.sum(axis=1)[:, None])
    return np.vstack([responses[0], slopes]).T, shift


def elliptic_departure(
    x: FloatArray, y: FloatArray, sigma: float, ellipticity: FloatArray
) -> FloatArray:
    """Elliptic Gaussian of unit integral less the round one of the same s, on a grid (y, x)."""
    e1, e2 = bounded(ellipticity)
    plane_x, plane_y = np.meshgrid(x, y)
    determinant = 1 - e1**2 - e2**2
    square = (1 - e1) * plane_x**2 - 2 * e2 * plane_x * plane_y + (1 + e1) * plane_y**2
    elliptic = np.exp(-0.5 * square / (determinant * sigma**2)) / np.sqrt(determinant)
    round_ = np.exp(-0.5 * (plane_x**2 + plane_y**2) / sigma**2)
    departure: FloatArray = (elliptic - round_) / (2 * np.pi * sigma**2)
    return departure
