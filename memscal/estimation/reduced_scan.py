"""Scan and linear model beside a Gaussian fit, reduced to as few rows as the model has columns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from memscal.estimation.angular import AngularRings
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit
from memscal.estimation.voltage_map import SINGLE, Tall, VoltageMap, orthonormalised
from memscal.model.arrays import FloatArray


@dataclass(frozen=True, eq=False)
class ReducedScan:
    """Standardised voltages and their derivatives, Q' times those at the points (n), (r, ...)."""

    # Q is orthonormal and spans voltages and all columns, so that sums of squares are those of the
    # points.  Of few points it is the unit matrix.
    model: ForwardModel
    fit: GaussianFit
    data: FloatArray  # (r,): voltages that the fit leaves over
    flat: FloatArray  # (r, p): by the parameters of the fit
    rings: FloatArray  # (r, a): of angular rings
    weights: FloatArray  # (n,)
    synthesis: FloatArray | None  # (r, nodes): of kernels by their transforms
    right: Tall | None  # (n, r): the transposed standardisation of Q

    @classmethod
    def of(
        cls,
        model: ForwardModel,
        fit: GaussianFit,
        weights: FloatArray,
        rings: AngularRings | None = None,
    ) -> ReducedScan:
        """Reduce a scan with weights (n,), with angular rings or without."""
        points, count = model.points, fit.jacobian.shape[1]
        beside = [(points.u - fit.predicted)[:, None], fit.jacobian]
        beside += [rings.signal(model, fit.centre)] if rings else []
        columns, mix = model.framed(fit.geometry, beside)
        columns, right = points.standardise(columns, weights), None
        last, synthesis = columns.shape[1], None
        if mix is not None:
            columns, reduced = orthonormalised(columns)
            last -= len(mix)
            synthesis, right = reduced[:, last:] @ mix, points.unstandardise(columns, weights)
            right = right.astype(np.float32) if len(right) > SINGLE else right
            columns = reduced
        parts = columns[:, 0], columns[:, 1 : 1 + count], columns[:, 1 + count : last]
        return cls(model, fit, *parts, weights, synthesis, right)

    def signal(self, kernels: FloatArray) -> FloatArray:
        """Voltages (r, m) of round kernels by their transforms, (nodes, m)."""
        if self.synthesis is not None:
            return np.asarray(self.synthesis @ kernels)
        voltages = self.model.signal(self.fit.geometry, kernels)
        return self.model.points.standardised(voltages, self.weights)

    def summed(self, share: FloatArray) -> FloatArray:
        """Factors (r,) whose products with reduced columns are sums of shares (n,) of columns."""
        root, factor = np.sqrt(self.weights), self.model.points.decorrelation
        shares = share / root if factor is None else factor.correlate_adjoint(share / root)
        if self.right is None:
            return np.asarray(shares)
        shares = shares if factor is None else factor.correlate(shares)
        return np.asarray(self.right.T @ (shares / root))

    def by_voltages(self, gain: FloatArray) -> VoltageMap:
        """Derivatives by the voltages (m, n) of numbers with these by the reduced data, (m, r)."""
        if self.right is not None:
            return VoltageMap(((gain, self.right),))
        return VoltageMap(((self.model.points.unstandardise(gain.T.copy(), self.weights).T, None),))
