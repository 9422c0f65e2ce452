"""Transformations that make correlated noise white, without a matrix over all points."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from scipy.linalg import solve_triangular
from scipy.linalg.lapack import dtbtrs

from memscal.model.arrays import FloatArray, IndexArray, array_record
from memscal.model.correlation import is_banded


@array_record
class Decorrelation:
    r"""Makes noise of covariance :math:`(1 + S S^T) C` or :math:`C`, block by block, white."""

    # Points of each block, and the lower Cholesky factor of their correlation C, or its diagonals.
    blocks: tuple[tuple[IndexArray, FloatArray], ...]
    # One after the other, orthonormal columns (n, q) of what points have in common, after that,
    # and its growth (q,).
    common: tuple[tuple[Any, FloatArray], ...] = ()

    def apply(self, values: FloatArray) -> FloatArray:
        """Make columns (n,) or (n, m) white."""
        return _scaled(self.common, self._by_blocks(_solved, values), 1.0)

    def adjoint(self, values: FloatArray) -> FloatArray:
        """The transposed transformation of columns."""
        return self._by_blocks(_solved, _scaled(self.common[::-1], values, 1.0), transposed=True)

    def correlate(self, white: FloatArray) -> FloatArray:
        """Give white noise the correlation: the inverse of :meth:`apply`."""
        return self._by_blocks(_product, _scaled(self.common[::-1], white, -1.0))

    def correlate_adjoint(self, values: FloatArray) -> FloatArray:
        """The transposed of :meth:`correlate`."""
        return _scaled(self.common, self._by_blocks(_product, values, transposed=True), -1.0)

    def _by_blocks(
        self, change: Callable[..., FloatArray], values: FloatArray, *, transposed: bool = False
    ) -> FloatArray:
        """Change columns by the roots of the blocks."""
        changed = values.copy()
        for rows, root in self.blocks:
            changed[rows] = change(root, values[rows], transposed=transposed)
        return changed


def _scaled(
    common: Sequence[tuple[Any, FloatArray]], values: FloatArray, power: float
) -> FloatArray:
    """Divide what is along common columns by its growth, to a power."""
    for columns, growth in common:
        along = columns.T @ values
        values = values + columns @ (along.T * (growth**-power - 1)).T
    return values


@array_record
class SlowNoise:
    """What correlation along each pass is found in noise."""

    probability: float  # that the noise is correlated
    length: float  # if it is: steps over which that falls off, and share of the variance
    share: float
    covariance: Decorrelation  # averaged by probability, over the variance of white noise


def _solved(root: FloatArray, values: FloatArray, *, transposed: bool) -> FloatArray:
    """Solve L x = values, or L' x = values."""
    turned: Any = "T" if transposed else "N"
    if not is_banded(root):
        return solve_triangular(root, values, lower=True, trans=turned)
    solved, _ = dtbtrs(root, values, uplo="L", trans=turned)
    return np.reshape(solved, values.shape)


def _product(root: FloatArray, values: FloatArray, *, transposed: bool) -> FloatArray:
    """L times columns, or L' times them."""
    from scipy.sparse import dia_array

    lower: Any = root
    if is_banded(root):
        lower = dia_array((root, -np.arange(len(root))), shape=(len(values), len(values)))
    return np.asarray((lower.T if transposed else lower) @ values)
