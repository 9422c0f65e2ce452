"""Linear functions of the voltages of a scan, and orthonormal columns over its points.

A scan may have a million points.  Matrices over them are kept as they are up to :data:`DENSE`
points; of more, as products of a small matrix and few columns over the points.
"""

from __future__ import annotations

import contextlib
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csr_array

from memscal.estimation.decorrelation import Decorrelation
from memscal.model.arrays import ArrayPair, FloatArray, IndexArray, array_record, floats, slices

#: Points up to which matrices over the points are not taken apart.
DENSE = 400
#: Points from which on columns of derivatives, which only uncertainties need, have seven digits.
SINGLE = 250_000
#: Rows of the blocks in which tall matrices are worked on.
BLOCK = 8_192
#: Columns are dependent where their singular value is below this share of the largest.
_DEPENDENT = 1e-12

Tall = FloatArray | csr_array
"""Columns over the points, (n, r)."""


@array_record
class VoltageMap:
    """Derivatives (m, n) of m numbers by n voltages: a sum of products L R'."""

    parts: tuple[tuple[FloatArray, Tall], ...]  # (m, r) and (n, r) each
    #: So that numpy leaves ``array @ map`` to this class.
    __array_ufunc__ = None

    @classmethod
    def stacked(cls, maps: Sequence[VoltageMap]) -> VoltageMap:
        """Put maps below each other; those of the same columns share them."""
        stacked = cls(())
        ends = np.cumsum([len(each) for each in maps])
        for each, rows in zip(maps, np.split(np.eye(ends[-1]), ends[:-1], axis=1), strict=True):
            stacked += rows @ each
        return stacked

    def __len__(self) -> int:
        """How many numbers there are."""
        return len(self.parts[0][0])

    def __getitem__(self, rows: slice | IndexArray | list[int]) -> VoltageMap:
        """Some of the numbers."""
        return VoltageMap(tuple((left[rows], right) for left, right in self.parts))

    def __matmul__(self, values: FloatArray) -> FloatArray:
        """Changes (m,) or (m, q) of the numbers for changes (n,) or (n, q) of the voltages."""
        return floats(sum(left @ _gram(right, values) for left, right in self.parts))

    def __rmatmul__(self, rows: FloatArray) -> VoltageMap:
        """Linear combinations of the numbers, by rows (l, m)."""
        return VoltageMap(tuple((rows @ left, right) for left, right in self.parts))

    def __mul__(self, factors: float | FloatArray) -> VoltageMap:
        """Multiply all numbers by one factor, or each by its own, (m,)."""
        return VoltageMap(tuple(((left.T * factors).T, right) for left, right in self.parts))

    def __add__(self, other: VoltageMap) -> VoltageMap:
        """Add two maps to the same numbers."""
        merged = {id(right): (left, right) for left, right in self.parts}
        for left, right in other.parts:
            known = merged.get(id(right))
            merged[id(right)] = (known[0] + left if known else left, right)
        return VoltageMap(tuple(merged.values()))

    def __sub__(self, other: VoltageMap) -> VoltageMap:
        """Subtract a map to the same numbers."""
        return self + other * -1.0

    def dense(self) -> FloatArray:
        """All derivatives, (m, n)."""
        return floats(sum((right @ left.T).T for left, right in self.parts))

    def over(self, factors: FloatArray, rows: IndexArray, count: int) -> VoltageMap:
        """Derivatives by ``count`` voltages, of which these, times factors (n,), are ``rows``."""
        placing: Any = csr_array((factors, (rows, np.arange(rows.size))), shape=(count, rows.size))
        return VoltageMap(tuple((left, placing @ right) for left, right in self.parts))

    def covariance(self, noise: FloatArray, factor: Decorrelation | None = None) -> FloatArray:
        """Covariance (m, m) of the numbers, for voltages of a noise (n,) and its correlation."""
        parts = []
        for left, right in self.parts:
            columns = right
            if factor:
                dense = right if isinstance(right, np.ndarray) else right.toarray()
                columns = factor.correlate_adjoint(noise[:, None] * dense)
            parts.append((left, columns))
        scale = None if factor else noise
        total = np.zeros((len(self), len(self)))
        for i, (left, right) in enumerate(parts):
            total += left @ _gram(right, right, scale) @ left.T
            for other, columns in parts[:i]:
                product = left @ _gram(right, columns, scale) @ other.T
                total += product + product.T
        return total


def _gram(first: Any, second: Any, scale: FloatArray | None = None) -> FloatArray:
    """Products of all columns, both times a scale (n,), by blocks of rows."""
    total = np.zeros((first.shape[1], *second.shape[1:]))
    for rows in slices(first.shape[0], BLOCK):
        left = first[rows]
        right = second[rows]
        if scale is not None:
            left = scale[rows, None] * left
            # Of one array numpy makes half of a symmetric product.
            right = left if first is second else scale[rows, None] * right
        total = total + left.T @ right
    return total


def evenly(rows: NDArray[Any], most: int) -> NDArray[Any]:
    """At most so many of the rows, evenly chosen."""
    return rows[np.linspace(0, rows.size - 1, min(rows.size, most)).astype(np.intp)]


def triangular(columns: FloatArray) -> FloatArray:
    """Triangular factor R of the QR decomposition of tall columns (n, f), block by block."""
    root: Any = columns[:0]
    for rows in slices(len(columns), BLOCK):
        root = np.linalg.qr(np.vstack([root, columns[rows]]), mode="r")
    return floats(root)


def orthonormalised(
    columns: FloatArray, size: FloatArray | None = None, dependent: float = _DEPENDENT
) -> ArrayPair:
    """Orthonormal columns Q (n, r) of the same span, and R (r, f): the columns are Q R.

    The columns are overwritten by Q; what is dependent is judged by their ``size`` or norms, (f,).
    """
    root = triangular(columns)
    scale = np.linalg.norm(root, axis=0) if size is None else size
    scale = np.where(scale > 0, scale, 1.0)
    _, singular, right = np.linalg.svd(root / scale, full_matrices=False)
    right = right[singular > dependent * singular[0]]
    singular = singular[: len(right)]
    turn = (right / singular[:, None] / scale).T
    for rows in slices(len(columns), BLOCK):
        block = columns[rows]
        block[:, : len(right)] = block @ turn
    return columns[:, : len(right)], singular[:, None] * right * scale


def square_root(covariance: FloatArray, variances: FloatArray | None = None) -> FloatArray:
    """A square root of a covariance that may be singular, scaled by the given variances."""
    scale = np.maximum(np.diag(covariance) if variances is None else variances, 0.0)
    safe = np.where(scale > 0, np.sqrt(scale), 1.0)
    scaled = covariance / np.outer(safe, safe)
    with contextlib.suppress(np.linalg.LinAlgError):
        return safe[:, None] * np.linalg.cholesky(scaled)
    values, vectors = np.linalg.eigh(scaled)
    return floats(safe[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
