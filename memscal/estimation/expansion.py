r"""The Gaussian fit expanded about itself, to fit thousands of replicates of a scan at once.

The voltages of a Gaussian are linear in A and the drift.  In width, centre and ellipticity, by
:math:`\delta`, they are expanded to third order,

.. math::

    A\,S(\delta) = A \sum_e S_e\,\frac{\delta^e}{e!}, \qquad |e| \le 3 ,

and the weighted columns :math:`S_e` have an orthonormal basis of a dozen vectors.  A replicate is
its data along these; Gauss-Newton steps in that small space are the fit.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian_fit import GaussianFit, linearise
from memscal.model.validation import FloatArray

__all__ = ["GaussianExpansion", "GaussianFits"]

_STEPS = 5
#: Derivatives are differences over this many standard uncertainties, and this share of the width.
_SPREAD = 2.0
_LEAST_SHARE = 0.04
_MOST_SHARE = 0.2


@dataclass(frozen=True, eq=False)
class GaussianFits:
    """Gaussian fits of many replicates.

    Parameters
    ----------
    parameters : ndarray, shape (replicates, p)
        A, sigma, centres, drift and ellipticity of each, in the order of the Jacobian's columns.
    residual : ndarray, shape (replicates, n)
        Standardised data less the fit.
    """

    parameters: FloatArray
    residual: FloatArray


@dataclass(frozen=True, eq=False)
class GaussianExpansion:
    """A Gaussian fit's model about its best parameters.

    Parameters
    ----------
    start : ndarray, shape (p,)
        The best parameters.
    scale : ndarray, shape (p,)
        Their typical sizes.
    bent, straight : ndarray of int, shape (q,) and (p - 1 - q,)
        Which parameters the voltages are expanded in, and which are the drift's.
    exponents : ndarray of int, shape (m, q)
        Powers of the former in each term of the expansion.
    terms : ndarray, shape (n, m)
        Standardised voltages of each term, divided by its factorials.
    drift : ndarray, shape (n, p - 1 - q)
        Standardised columns of the drift.
    """

    start: FloatArray
    scale: FloatArray
    bent: NDArray[np.intp]
    straight: NDArray[np.intp]
    exponents: NDArray[np.intp]
    terms: FloatArray
    drift: FloatArray

    @classmethod
    def about(
        cls, model: ForwardModel, fit: GaussianFit, weights: FloatArray, noise: float
    ) -> GaussianExpansion:
        """Expand a fit; ``noise`` (V, at weight one) says how far replicates go from it.

        Parameters
        ----------
        model, fit
            The forward model, and its best Gaussian.
        weights : ndarray, shape (n,)
            Relative weights of the points.
        noise : float
            Noise of a point of weight one.
        """
        points = model.points
        centres = fit.centre[points.free]
        ellipse = fit.ellipticity[: points.ellipse]
        shape = [fit.conversion_constant, fit.sigma]
        theta = np.concatenate([shape, centres, fit.drift, ellipse])
        last = theta.size - ellipse.size
        bent = np.r_[1 : 2 + centres.size, last : theta.size]
        lengths = np.full(1 + centres.size, fit.sigma)
        sizes = np.concatenate([lengths, np.ones(ellipse.size)])
        errors = np.sqrt(np.diag(fit.covariance(weights, noise)))[bent]
        steps = np.clip(_SPREAD * errors, _LEAST_SHARE * sizes, _MOST_SHARE * sizes)
        columns = _derivatives(model, theta, bent, steps)
        factorials = np.array([math.prod(map(math.factorial, e)) for e in columns])
        terms = np.stack(list(columns.values()), axis=1) / factorials
        largest = np.full(fit.drift.size, float(np.abs(fit.predicted).max()))
        return cls(
            start=theta,
            scale=np.concatenate([theta[:1], lengths, largest, np.ones(ellipse.size)]),
            bent=bent,
            straight=np.r_[2 + centres.size : last],
            exponents=np.array(list(columns), dtype=np.intp),
            terms=points.standardised(terms, weights),
            drift=points.standardised(model.drift_columns, weights),
        )

    def fit(self, data: FloatArray) -> GaussianFits:
        """Fit replicates of the standardised data, shape (replicates, n)."""
        basis, triangle = np.linalg.qr(np.hstack([self.terms, self.drift]))
        terms, drift = np.hsplit(triangle, [self.terms.shape[1]])
        along = data @ basis
        theta = np.tile(self.start, (len(data), 1))
        jacobian = np.empty((len(data), theta.shape[1], len(triangle)))
        jacobian[:, self.straight] = drift.T
        for _ in range(_STEPS):
            value, slopes = self._monomials(theta)
            jacobian[:, 0] = value @ terms.T
            jacobian[:, self.bent] = theta[:, :1, None] * (slopes @ terms.T)
            predicted = theta[:, :1] * jacobian[:, 0] + theta[:, self.straight] @ drift.T
            scaled = jacobian * self.scale[:, None]
            right = scaled @ (along - predicted)[:, :, None]
            step = np.linalg.solve(scaled @ scaled.transpose(0, 2, 1), right)[:, :, 0]
            theta = theta + step * self.scale
        shape = self._monomials(theta)[0] @ self.terms.T
        predicted = theta[:, :1] * shape + theta[:, self.straight] @ self.drift.T
        return GaussianFits(theta, data - predicted)

    def _monomials(self, theta: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Powers of the moved parameters, (replicates, m), and their slopes, (..., q, m)."""
        moved = theta[:, self.bent] - self.start[self.bent]
        powers = moved[:, None, :] ** self.exponents
        value = powers.prod(axis=2)
        slopes = []
        for i in range(self.exponents.shape[1]):
            own = self.exponents[:, i]
            less = own * moved[:, i, None] ** np.maximum(own - 1, 0)
            slopes.append(less * np.delete(powers, i, axis=2).prod(axis=2))
        return value, np.stack(slopes, axis=1)


def _derivatives(
    model: ForwardModel, theta: FloatArray, bent: NDArray[np.intp], steps: FloatArray
) -> dict[tuple[int, ...], FloatArray]:
    """Derivatives of the voltages by bent parameters at A = 1, by differences of Jacobians.

    Mixed ones of three different parameters, which are tiny, are left out.
    """
    count = steps.size

    def slopes(shift: FloatArray) -> tuple[FloatArray, FloatArray]:
        place = theta.copy()
        place[bent] += shift
        fit = linearise(model, place)
        return fit.jacobian[:, 0], fit.jacobian[:, bent] / theta[0]

    def exponent(*parameters: int) -> tuple[int, ...]:
        return tuple(parameters.count(i) for i in range(count))

    value, first = slopes(np.zeros(count))
    found = {exponent(): value} | {exponent(i): first[:, i] for i in range(count)}
    shifts = np.diag(steps)
    above = [slopes(shift)[1] for shift in shifts]
    below = [slopes(-shift)[1] for shift in shifts]
    for i, j in combinations_with_replacement(range(count), 2):
        # Either may be the one that is moved: the mean of both is symmetric.
        pairs = [(above[a][:, b] - below[a][:, b]) / (2 * steps[a]) for a, b in ((i, j), (j, i))]
        found[exponent(i, j)] = (pairs[0] + pairs[1]) / 2
    for i in range(count):
        for j in range(count):
            third = (above[i][:, j] - 2 * first[:, j] + below[i][:, j]) / steps[i] ** 2
            found[exponent(i, i, j)] = third
    return found
