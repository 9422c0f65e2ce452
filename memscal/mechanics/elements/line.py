"""Piecewise quartics along a straight side of the mesh: the film's surface, or its base."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from memscal.axisymmetry.quadrature import gauss_between
from memscal.model.validation import FloatArray

__all__ = ["QuarticLine", "hat_values", "smooth_even", "smooth_odd"]

_DEGREE = 4
_SMOOTH_DEGREE = 5
# Exact for the product of two quartics and r.
_ORDER = 5


@dataclass(frozen=True, eq=False)
class QuarticLine:
    """The functions that quartic triangles have on a straight side of their mesh.

    Parameters
    ----------
    r : ndarray, shape (4 m + 1,)
        Radii of the nodes on ``m`` sides of triangles, increasing: corners and the three
        nodes that quarter each side.

    Examples
    --------
    >>> line = QuarticLine(np.linspace(0.0, 2.0, 9))
    >>> bool(np.allclose(line.at(np.array([0.3, 1.7])) @ line.r**4, np.array([0.3, 1.7]) ** 4))
    True
    """

    r: FloatArray

    @property
    def corners(self) -> FloatArray:
        """Radii of the triangles' corners."""
        return self.r[::_DEGREE]

    def at(self, r: FloatArray) -> csr_array:
        """Return the matrix, shape (r.size, nodes), from nodal values to values at ``r``."""
        corners = self.corners
        side = np.clip(np.searchsorted(corners, r, side="right") - 1, 0, corners.size - 2)
        along = (r - corners[side]) / (corners[side + 1] - corners[side])
        columns = _DEGREE * side[:, None] + np.arange(_DEGREE + 1)
        rows = np.arange(0, columns.size + 1, _DEGREE + 1)
        return csr_array(
            (_quartics(along).ravel(), columns.ravel(), rows), shape=(r.size, self.r.size)
        )

    @cached_property
    def mass(self) -> csr_array:
        r"""Matrix :math:`\int N_i N_j\,r\,dr`."""
        nodes, weights = gauss_between(self.corners, _ORDER)
        values = self.at(nodes)
        return csr_array(values.T @ values.multiply((weights * nodes)[:, None]))

    def loads_of_hats(self, rings: FloatArray) -> csr_array:
        r"""Return :math:`\int N_i \phi_j\,r\,dr` of the rings' hats :math:`\phi_j`.

        Exact: no kink of a hat or of a quartic lies inside a panel of the quadrature.
        """
        knots = np.union1d(rings, self.corners[self.corners < rings[-1]])
        nodes, weights = gauss_between(knots, _ORDER)
        hats = hat_values(rings, nodes)
        return csr_array(self.at(nodes).T @ hats.multiply((weights * nodes)[:, None]))


def hat_values(rings: FloatArray, r: FloatArray) -> csr_array:
    """Return the matrix, shape (r.size, rings.size), of the rings' hats at ``r``."""
    element = np.clip(np.searchsorted(rings, r, side="right") - 1, 0, rings.size - 2)
    rising = (r - rings[element]) / (rings[element + 1] - rings[element])
    values = np.stack([1 - rising, rising], axis=1)
    columns = np.stack([element, element + 1], axis=1)
    rows = np.arange(0, columns.size + 1, 2)
    return csr_array((values.ravel(), columns.ravel(), rows), shape=(r.size, rings.size))


def smooth_even(line: QuarticLine, values: FloatArray) -> Callable[[FloatArray], FloatArray]:
    r"""Return the smooth even function of ``r`` that is nearest to a quartic's nodal values.

    A quintic spline with knots at the corners, nearest in :math:`\int(\cdot)^2\,r\,dr`: the
    integral :math:`\int(\cdot)\,r\,dr` stays what it is.
    """
    return _smooth(line, values, 1.0)


def smooth_odd(line: QuarticLine, values: FloatArray) -> Callable[[FloatArray], FloatArray]:
    """Return the smooth odd function of ``r`` nearest to nodal values; see :func:`smooth_even`."""
    return _smooth(line, values, -1.0)


def _smooth(
    line: QuarticLine, values: FloatArray, parity: float
) -> Callable[[FloatArray], FloatArray]:
    from scipy.interpolate import make_lsq_spline

    corners = line.corners
    r, weights = gauss_between(corners, _ORDER + 1)
    given, weights = line.at(r) @ values, np.sqrt(weights * r)
    ends = np.full(_SMOOTH_DEGREE + 1, corners[-1])
    halves = line.r[2:-1:2]
    knots = np.concatenate([-ends, -halves[::-1], halves, ends])
    # Mirrored about the axis, so that what is fitted has the right symmetry.
    spline = make_lsq_spline(
        np.concatenate([-r[::-1], r]),
        np.concatenate([parity * given[::-1], given]),
        knots,
        k=_SMOOTH_DEGREE,
        w=np.concatenate([weights[::-1], weights]),
    )
    return lambda radius: np.asarray(spline(radius))


def _quartics(along: FloatArray) -> FloatArray:
    """Return the five Lagrange quartics of a side, shape (n, 5), at ``along`` from 0 to 1."""
    nodes = np.arange(_DEGREE + 1) / _DEGREE
    values = np.ones((along.size, _DEGREE + 1))
    for i, node in enumerate(nodes):
        for other in np.delete(nodes, i):
            values[:, i] *= (along - other) / (node - other)
    return values
