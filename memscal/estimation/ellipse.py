"""Elliptic Gaussians: their ellipticity (e1, e2), their response, and what of them is not round."""

import numpy as np

from memscal.estimation.forward import ForwardModel, Geometry
from memscal.model.arrays import FloatArray

#: Largest ellipticity, and steps of the centred differences by which the response is derived.
_LARGEST = 0.95
_STEP = 1e-4


def bounded(ellipticity: FloatArray) -> FloatArray:
    """Return an ellipticity (e1, e2) that an ellipse can have."""
    size = float(np.hypot(*ellipticity))
    return ellipticity * min(1.0, _LARGEST / size) if size > 0 else ellipticity


def elliptic_columns(
    model: ForwardModel, geometry: Geometry, sigma: float, ellipticity: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Response per A of an elliptic Gaussian and its derivatives by s, e1, e2; by the centre."""
    # Shapes (n, 4), and (2, n) of each point's own centre.
    here = np.concatenate([[sigma], ellipticity])
    steps = np.diag([_STEP * sigma, _STEP, _STEP])
    places = [here, *(here + step for step in steps), *(here - step for step in steps)]
    ellipses = [np.append(place[0], bounded(place[1:])) for place in places]
    (values, *others), shift = model.elliptic(geometry, ellipses)
    slopes = [
        (above - below) / (2 * step.sum())
        for above, below, step in zip(others[:3], others[3:], steps, strict=True)
    ]
    return np.stack([values, *slopes], axis=1), shift


def elliptic_departure(
    x: FloatArray, y: FloatArray, sigma: float, ellipticity: FloatArray
) -> FloatArray:
    """Elliptic Gaussian of unit integral less the round one of the same s, on a grid (y, x)."""
    e1, e2 = bounded(ellipticity)
    plane_x, plane_y = np.meshgrid(x, y)
    round_ = plane_x**2 + plane_y**2
    determinant = 1 - e1**2 - e2**2
    form = (1 - e1) * plane_x**2 - 2 * e2 * plane_x * plane_y + (1 + e1) * plane_y**2
    scale = 1 / (2 * np.pi * sigma**2)
    elliptic = np.exp(-0.5 * form / (determinant * sigma**2)) / np.sqrt(determinant)
    return np.asarray(scale * (elliptic - np.exp(-0.5 * round_ / sigma**2)))
