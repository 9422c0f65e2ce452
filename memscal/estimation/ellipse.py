r"""An elliptic Gaussian apparatus function: its response to a round stress, by harmonics.

With second moments :math:`s^2\begin{pmatrix}1+e_1&e_2\\e_2&1-e_1\end{pmatrix}`,
:math:`e = \sqrt{e_1^2+e_2^2}` and :math:`\tan 2\alpha = e_2/e_1`, the transform is
:math:`\exp(-\tfrac12 s^2k^2)\,\exp(-z\cos 2(\varphi-\alpha))` with
:math:`z = \tfrac12 s^2k^2e`.  By the Jacobi-Anger expansion (DLMF 10.35.2) its response at
distance R in direction :math:`\theta` is

.. math::

    \sum_{m\ge0} \varepsilon_m \cos 2m(\theta-\alpha)\,\frac{1}{2\pi}\int
    e^{-s^2k^2/2}\,I_m(z)\,\hat\sigma(k)\,J_{2m}(kR)\,k\,dk ,
    \qquad \varepsilon_0 = 1,\ \varepsilon_m = 2 .

The principal widths are :math:`s\sqrt{1\pm e}`, the larger one in the direction :math:`\alpha`.
"""

from __future__ import annotations

import numpy as np
from scipy.special import ive

from memscal.estimation.forward import ForwardModel, Geometry
from memscal.model.validation import FloatArray

__all__ = ["elliptic_columns", "elliptic_departure"]

_HARMONICS = 5
_LARGEST = 0.95
_STEP = 1e-4


def elliptic_columns(
    model: ForwardModel, geometry: Geometry, sigma: float, ellipticity: FloatArray
) -> FloatArray:
    """Response per A of an elliptic Gaussian, and its derivatives by s, e1 and e2.

    Parameters
    ----------
    model, geometry
        The forward model, and the points about their centres.
    sigma : float
        Root of the mean second moment, in m.
    ellipticity : ndarray, shape (2,)
        e1 (along x against y) and e2 (along the diagonals).

    Returns
    -------
    ndarray, shape (n, 4)
        In V per V/Pa; per m in the second column.
    """
    steps = np.array([[0.0, 0.0, 0.0], [_STEP * sigma, 0.0, 0.0], [0, _STEP, 0], [0, 0, _STEP]])
    here = np.concatenate([[sigma], ellipticity])
    harmonics = _bessel(geometry.bessel0, geometry.bessel1, geometry.radius, model.k)
    columns = [_response(model, geometry, harmonics, here)]
    for step in steps[1:]:
        above = _response(model, geometry, harmonics, here + step)
        below = _response(model, geometry, harmonics, here - step)
        columns.append((above - below) / (2 * step.sum()))
    return np.stack(columns, axis=1)


def elliptic_departure(
    x: FloatArray, y: FloatArray, sigma: float, ellipticity: FloatArray
) -> FloatArray:
    """Elliptic Gaussian of unit integral less the round one of the same s, on a grid (y, x)."""
    e1, e2 = _bounded(ellipticity)
    plane_x, plane_y = np.meshgrid(x, y)
    determinant = 1 - e1**2 - e2**2
    round_ = plane_x**2 + plane_y**2
    form = (1 - e1) * plane_x**2 - 2 * e2 * plane_x * plane_y + (1 + e1) * plane_y**2
    scale = 1 / (2 * np.pi * sigma**2)
    elliptic = np.exp(-0.5 * form / (determinant * sigma**2)) / np.sqrt(determinant)
    return np.asarray(scale * (elliptic - np.exp(-0.5 * round_ / sigma**2)))


def _bounded(ellipticity: FloatArray) -> FloatArray:
    size = float(np.hypot(*ellipticity))
    return np.asarray(ellipticity * min(1.0, _LARGEST / size) if size > 0 else ellipticity)


def _response(
    model: ForwardModel, geometry: Geometry, harmonics: list[FloatArray], place: FloatArray
) -> FloatArray:
    sigma, (e1, e2) = float(place[0]), _bounded(place[1:])
    e = float(np.hypot(e1, e2))
    half = 0.5 * (sigma * model.k) ** 2
    # The derivatives of the radius by the centre point to it: their angle is the direction's.
    direction = np.arctan2(-geometry.towards[1], -geometry.towards[0])
    angle = direction - 0.5 * np.arctan2(e2, e1)
    total = np.zeros_like(geometry.radius)
    for m, bessel in enumerate(harmonics):
        kernel = ive(m, half * e) * np.exp(-half * (1 - e))
        part = model.signal(Geometry(geometry.radius, geometry.towards, bessel, bessel), kernel)
        total += (1 if m == 0 else 2) * np.cos(2 * m * angle) * part
    return total


def _bessel(
    bessel0: FloatArray, bessel1: FloatArray, radius: FloatArray, k: FloatArray
) -> list[FloatArray]:
    """Bessel functions of even order, by recurrence upwards from orders zero and one.

    Where the argument is small the recurrence loses digits and the function is nothing: its
    power series' first term decides.
    """
    # Repeats share their positions.
    unique, first, back = np.unique(radius, return_index=True, return_inverse=True)
    x = np.multiply.outer(unique, k)
    even, below, above = [bessel0], bessel0[first], bessel1[first]
    factorial = 1.0
    for order in range(2, 2 * _HARMONICS):
        small = x < 0.1 * order
        safe = np.where(small, 1.0, x)
        factorial *= order
        series = (x / 2) ** order / factorial
        upward = 2 * (order - 1) / safe * above - below
        below, above = above, np.where(small, series, upward)
        if order % 2 == 0:
            even.append(above[back])
    return even
