"""The stress at the base of the film as a scan tells it, and everything that goes with it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import RadialSpectrum
from memscal.errors import InputError
from memscal.estimation.points import ScanPoints
from memscal.measurement.comparison import (
    Comparison,
    Expected,
    compare_stress,
    read_expected,
)
from memscal.measurement.posterior import Posterior, reach_of, sensor_transfer
from memscal.model.checks import Message, QualityCheck
from memscal.model.notation import format_measured
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.model.validation import FloatArray

__all__ = ["Restoration"]


@dataclass(frozen=True, eq=False, repr=False)
class Restoration:
    r"""The stress at the film's base that explains a scan, with its uncertainty.

    Parameters
    ----------
    scan, apparatus
        What was measured, and with what.
    posterior : Posterior
        The base stress in wavenumbers, with centre and baseline, and their covariance by source.
    r : ndarray, shape (n,)
        Radii from the axis to half the scan's width, in m.
    sigma_zz : ndarray, shape (n,)
        Stress at the base there, in Pa, positive in compression.
    covariance : ndarray, shape (n, n)
        Its covariance, in Pa^2: noise, what regularisation hides, and uncertain inputs.
    comparison : Comparison, optional
        With an expected stress, where one was given.
    checks : tuple of QualityCheck
        Quality checks.
    messages : tuple of Message
        What a user should know.
    """

    scan: Scan
    apparatus: ApparatusFunction
    posterior: Posterior
    r: FloatArray
    sigma_zz: FloatArray
    covariance: FloatArray
    comparison: Comparison | None = None
    checks: tuple[QualityCheck, ...] = ()
    messages: tuple[Message, ...] = ()

    def __repr__(self) -> str:
        """Return the main numbers in place of thousands of array elements."""
        force = format_measured(self.force, self.force_uncertainty, "N")
        failed = [check.name for check in self.checks if not check.passed]
        state = f"failed: {', '.join(failed)}" if failed else "all checks passed"
        return f"<Restoration: force {force}, {self.r.size} radii, {state}>"

    @property
    def passed(self) -> bool:
        """Whether every quality check passed."""
        return all(check.passed for check in self.checks)

    @property
    def points(self) -> ScanPoints:
        """The measured points."""
        return self.posterior.estimate.points

    def stress(self, r: ArrayLike) -> FloatArray:
        """Return the restored stress at radii ``r`` (m, any shape), in Pa.

        Raises
        ------
        InputError
            If a radius is beyond 1.5 times the scan's width, where nothing was computed.
        """
        nodes = self.posterior.nodes
        return np.asarray(self._synthesis(r) @ self.posterior.state[:nodes])

    def stress_uncertainty(self, r: ArrayLike) -> FloatArray:
        """Return the standard uncertainty (k = 1) of :meth:`stress`, in Pa."""
        matrix, nodes = self._synthesis(r), self.posterior.nodes
        covariance = self.posterior.covariance[:nodes, :nodes]
        variance = np.einsum("...j,jk,...k->...", matrix, covariance, matrix)
        return np.asarray(np.sqrt(np.maximum(variance, 0.0)))

    @property
    def force(self) -> float:
        """Integral of the restored stress over the plane, in N."""
        return float(self._at_zero @ self.posterior.state[: self.posterior.nodes])

    @property
    def force_uncertainty(self) -> float:
        """Standard uncertainty of :attr:`force`, in N."""
        return float(np.linalg.norm(list(self.force_budget.values())))

    @property
    def force_budget(self) -> Mapping[str, float]:
        """Standard uncertainty of the force by source, in N."""
        row, n = self._at_zero, self.posterior.nodes
        parts = self.posterior.covariances.items()
        variances = {name: float(row @ c[:n, :n] @ row) for name, c in parts}
        return {name: float(np.sqrt(max(v, 0.0))) for name, v in variances.items()}

    @property
    def centre(self) -> FloatArray:
        """Centre (x0, y0) of the sensor, in m; zero where a line does not tell."""
        return self._along_free(self.posterior.state)

    @property
    def centre_uncertainty(self) -> FloatArray:
        """Standard uncertainty of :attr:`centre`, in m; zero where a line does not tell."""
        return self._along_free(np.sqrt(np.diag(self.posterior.covariance)))

    @property
    def baseline(self) -> float:
        """Baseline in the middle of the scan, in V."""
        return float(self.posterior.state[self._first_drift])

    @property
    def baseline_uncertainty(self) -> float:
        """Standard uncertainty of :attr:`baseline`, in V."""
        i = self._first_drift
        return float(np.sqrt(self.posterior.covariance[i, i]))

    @property
    def resolved_wavenumber(self) -> float:
        """Wavenumber up to which the scan determines the stress, in rad/m."""
        return self.posterior.resolved_wavenumber

    @property
    def distance(self) -> FloatArray:
        """Distance of each point from the centre, shape (points,), in m."""
        dx, dy = self.points.x - self.centre[0], self.points.y - self.centre[1]
        return np.asarray(np.hypot(dx, dy))

    @property
    def predicted(self) -> FloatArray:
        """Voltage of each point as the restored stress explains it, in V."""
        return self.points.u - self.residual

    @property
    def residual(self) -> FloatArray:
        """Measured minus predicted voltage of each point, in V."""
        return self.posterior.residual

    @property
    def noise(self) -> FloatArray:
        """Standard uncertainty of each voltage, in V."""
        return self.posterior.noise_ratio * self.posterior.estimate.noise

    @property
    def noise_root(self) -> FloatArray:
        """Square root of the voltages' covariance, shape (n, n), in V; outliers' raised."""
        return self.posterior.noise_ratio * self.posterior.estimate.noise_root

    @property
    def degrees(self) -> float:
        """Points less parameters without prior: outliers count by their weight."""
        estimate = self.posterior.estimate
        parameters = 2 + int(self.points.free.sum()) + estimate.model.drift_columns.shape[1]
        return float(estimate.outlier_weight.sum() - parameters)

    @property
    def chi_square(self) -> float:
        """Sum of the squared residuals over the noise, outliers at their weight.

        A noise that is stated is taken at its word, with what uncertain positions add to it.
        """
        estimate = self.posterior.estimate
        stated = self.points.u_errors is not None
        noise = estimate.noise / estimate.noise_scale if stated else self.noise
        return float(np.sum(estimate.outlier_weight * (self.residual / noise) ** 2))

    @property
    def measured_stress(self) -> FloatArray:
        """Measured stress S_zz = U/A at each point, less baseline, for the nominal load, in Pa."""
        drift = self.posterior.state[self._first_drift :]
        signal = self.points.u - self.posterior.estimate.model.drift_columns @ drift
        return self.apparatus.stress(signal * self.scan.load / self.points.load)

    def blurred_stress(self, r: ArrayLike) -> FloatArray:
        r"""Return the restored stress blurred again, :math:`G \otimes \sigma_{zz}`, in Pa."""
        k, nodes = self.posterior.estimate.model.k, self.posterior.nodes
        return np.asarray(
            self._synthesis(r) @ (sensor_transfer(self.apparatus, k) * self.posterior.state[:nodes])
        )

    def compare(self, expected: Expected) -> Comparison:
        """Compare a calculated stress with the scan, blurred by G, and with the restored one.

        Raises
        ------
        InputError
            If it is no stress.
        """
        return compare_stress(self.posterior, self.scan, read_expected(expected), self.r)

    def profile(self) -> StressProfile:
        """Return the restored stress as a table with its uncertainty, as a file holds it."""
        return StressProfile(
            r=self.r,
            sigma_zz=self.sigma_zz,
            sigma_zz_errors=np.sqrt(np.maximum(np.diag(self.covariance), 0.0)),
            load=self.scan.load,
            film=self.scan.film,
            indenter=self.scan.indenter,
            solver="memscal, restored from a scan",
            notes="Measured, not calculated: restored with an apparatus function.",
        )

    @property
    def _first_drift(self) -> int:
        return self.posterior.nodes + int(self.points.free.sum())

    @property
    def _at_zero(self) -> FloatArray:
        """Row that reads a transform at k = 0: by a parabola in k^2, as :class:`RadialSpectrum`."""
        known = self.posterior.estimate.model.reference.wavenumbers
        row = np.zeros(known.k.size)
        row[:3] = [RadialSpectrum(known, unit).integral for unit in np.eye(3, known.k.size)]
        return row

    def _along_free(self, values: FloatArray) -> FloatArray:
        found = np.zeros(2)
        found[self.points.free[0]] = values[self.posterior.nodes : self._first_drift]
        return found

    def _synthesis(self, r: ArrayLike) -> FloatArray:
        """Matrix from the transform at the nodes to values at radii."""
        radii = np.abs(np.asarray(r, dtype=np.float64))
        reach = reach_of(self.points)
        if not np.all(radii <= reach):
            raise InputError(
                f"A radius is {np.max(radii) * 1e3:.4g} mm.",
                why=f"The stress was restored out to {reach * 1e3:.4g} mm.",
                cure="Give radii in metres, within 1.5 times the scan's width.",
            )
        known = self.posterior.estimate.model.reference.wavenumbers
        return known.synthesise(np.eye(known.k.size), radii)
