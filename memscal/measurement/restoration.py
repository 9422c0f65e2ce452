"""Restored stress: the stress at the base of the film that explains a scan, and its comparison."""

import math
from collections.abc import Mapping
from os import PathLike

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import hankel_transform
from memscal.errors import InputError
from memscal.estimation.points import ScanPoints
from memscal.formats.reference import read_reference
from memscal.measurement.posterior import Posterior, reach_of, sensor_changes
from memscal.mechanics.contact import BaseStress, Contact
from memscal.model.arrays import FloatArray, array_record, floats
from memscal.model.checks import (
    OVERRIDE,
    Checked,
    Messages,
    QualityChecks,
    chi_square_limit,
    state_of_checks,
)
from memscal.model.indenter import Rod
from memscal.model.notation import format_measured
from memscal.model.result import Result
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile

#: Loads of a curved indenter may differ by this share: its stress is not proportional to them.
SAME_LOAD = 0.01

Expected = BaseStress | str | PathLike[str] | None
"""A base stress to compare with, or the path of a file that holds one."""

#: Coverage factor of 95 %.
_EXPANDED = 1.96
#: Differences below this share of the largest stress are negligible.
_NEGLIGIBLE = 1e-3


@array_record
class StressComparison:
    """How a calculated stress agrees with a scan and with the stress restored from it."""

    stress: BaseStress
    sigma_zz: FloatArray  # (n,): calculated, at the restoration's radii, in Pa
    chi_square: float  # reduced, of the scan against the calculated stress convolved with A G
    degrees: int
    limit: float  # exceeded by chance once in a thousand
    p_value: float
    difference: float  # largest, over the largest stress
    within: float  # share of the radii at which they agree within 1.96 standard uncertainties


@array_record
class Restoration(Result, Checked):
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
    comparison : StressComparison, optional
        With an expected stress, where one was given.
    checks : tuple of QualityCheck
        Quality checks.
    messages : tuple of Message
        What a user should know.

    Examples
    --------
    >>> import memscal
    >>> film = memscal.ElasticFilm(
    ...     young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3, law="linear"
    ... )
    >>> scan = memscal.simulate(film=film, seed=2)
    >>> restored = memscal.restore(scan, memscal.calibrate(scan).apparatus)
    >>> bool(restored.sigma_zz[0] > 1e5)  # Pa
    True
    """

    scan: Scan
    apparatus: ApparatusFunction
    posterior: Posterior
    r: FloatArray
    sigma_zz: FloatArray
    covariance: FloatArray
    comparison: StressComparison | None = None
    checks: QualityChecks = ()
    messages: Messages = ()

    def __repr__(self) -> str:
        """Return the main numbers in place of thousands of array elements."""
        force = format_measured(self.force, self.force_uncertainty, "N")
        state = state_of_checks(self.checks)
        return f"<Restoration: force {force}, {self.r.size} radii, {state}>"

    @property
    def points(self) -> ScanPoints:
        """The measured points."""
        return self.posterior.estimate.points

    @property
    def _sigma_zz_errors(self) -> FloatArray:
        """Standard uncertainty of ``sigma_zz``, in Pa."""
        return np.sqrt(np.maximum(np.diag(self.covariance), 0.0))

    def stress(self, r: ArrayLike) -> FloatArray:
        """Return the restored stress at radii ``r`` (m, any shape), in Pa.

        Raises
        ------
        InputError
            If a radius is beyond 1.5 times the scan's width, where nothing was computed.
        """
        return floats(self._synthesis(r) @ self.posterior.stress)

    def stress_uncertainty(self, r: ArrayLike) -> FloatArray:
        """Return the standard uncertainty (k = 1) of :meth:`stress`, in Pa."""
        matrix = self._synthesis(r)
        nodes = self.posterior.nodes
        covariance = self.posterior.covariance[:nodes, :nodes]
        variance = np.einsum("...j,jk,...k->...", matrix, covariance, matrix)
        return floats(np.sqrt(np.maximum(variance, 0.0)))

    @property
    def force(self) -> float:
        """Integral of the restored stress over the plane, in N."""
        return float(self._at_zero @ self.posterior.stress)

    @property
    def force_uncertainty(self) -> float:
        """Standard uncertainty of :attr:`force`, in N."""
        return math.hypot(*self.force_budget.values())

    @property
    def force_budget(self) -> Mapping[str, float]:
        """Standard uncertainty of the force by source, in N."""
        row = self._at_zero
        n = self.posterior.nodes
        return {
            name: math.sqrt(max(float(row @ covariance[:n, :n] @ row), 0.0))
            for name, covariance in self.posterior.covariances.items()
        }

    @property
    def centre(self) -> FloatArray:
        """Centre (x0, y0) of the sensor, in m; zero across a line."""
        return self._along_free(self.posterior.state)

    @property
    def centre_uncertainty(self) -> FloatArray:
        """Standard uncertainty of :attr:`centre`, in m; zero across a line."""
        return self._along_free(np.sqrt(np.diag(self.posterior.covariance)))

    @property
    def baseline(self) -> float:
        """Baseline in the middle of the scan, in V."""
        return float(self.posterior.drift[0])

    @property
    def baseline_uncertainty(self) -> float:
        """Standard uncertainty of :attr:`baseline`, in V."""
        i = self.posterior.first_drift
        return math.sqrt(self.posterior.covariance[i, i])

    @property
    def resolved_wavenumber(self) -> float:
        """Wavenumber up to which the scan determines the stress, in rad/m."""
        return self.posterior.resolved_wavenumber

    @property
    def distance(self) -> FloatArray:
        """Distance of each point from the centre, shape (points,), in m."""
        return floats(np.hypot(*self.posterior.estimate.model.offset(self.centre)))

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
    def degrees(self) -> float:
        """Points less parameters without prior: outliers count by their weight."""
        estimate = self.posterior.estimate
        parameters = self.points.centres.stop + estimate.model.drift_columns.shape[1]
        return float(estimate.outlier_weight.sum() - parameters)

    @property
    def chi_square(self) -> float:
        """Sum of the squared residuals over the noise, outliers at their weight.

        A stated noise is used as it is, with what uncertain positions add to it.
        """
        estimate = self.posterior.estimate
        noise = self.noise
        if self.points.noise_stated:
            noise = estimate.noise / estimate.noise_scale
        return float(np.sum(estimate.outlier_weight * (self.residual / noise) ** 2))

    @property
    def measured_stress(self) -> FloatArray:
        """Measured stress S_zz = U/A at each point, less baseline, for the nominal load, in Pa."""
        background = self.posterior.estimate.model.drift_columns @ self.posterior.drift
        signal = self.points.u - background
        return self.apparatus.stress(signal * self.scan.stated_load / self.points.load)

    def blurred_stress(self, r: ArrayLike) -> FloatArray:
        r"""Return the restored stress blurred again, :math:`G \otimes \sigma_{zz}`, in Pa."""
        transfer, _ = sensor_changes(self.apparatus, self.posterior.estimate.model.k)
        return floats(self._synthesis(r) @ (transfer * self.posterior.stress))

    def compare(self, expected: Expected) -> StressComparison:
        """Compare a calculated stress with the scan, blurred by G, and with the restored one.

        Raises
        ------
        InputError
            If it is no stress.
        """
        if isinstance(expected, str | PathLike):
            expected = read_reference(expected)
        if isinstance(expected, BaseStress):
            return _compared(self, expected)
        raise InputError(
            f"The expected stress is of type {type(expected).__name__}.",
            cure="Give a contact from memscal.indent(), a StressProfile, or the path of a file.",
        )

    def profile(self) -> StressProfile:
        """Return the restored stress as a table with its uncertainty, as a file holds it."""
        overridden = (message.text for message in self.messages if message.kind == OVERRIDE)
        return StressProfile(
            r=self.r,
            sigma_zz=self.sigma_zz,
            sigma_zz_errors=self._sigma_zz_errors,
            load=self.scan.stated_load,
            film=self.scan.film,
            indenter=self.scan.indenter,
            solver="memscal, restored from a scan",
            notes=" ".join(
                ["Measured, not calculated: restored with an apparatus function.", *overridden]
            ),
        )

    @property
    def scalar_covariance(self) -> FloatArray:
        """Joint covariance of force, stress on the axis, centre and baseline, in SI units.

        Of the centre only the coordinates that the scan determines: shape (4, 4) or (5, 5).
        """
        posterior = self.posterior
        nodes = posterior.nodes
        first_drift = posterior.first_drift
        rows = np.zeros((2 + first_drift + 1 - nodes, posterior.state.size))
        rows[0, :nodes] = self._at_zero
        rows[1, :nodes] = self._synthesis(0.0)
        rows[2:, nodes : first_drift + 1] = np.eye(first_drift + 1 - nodes)
        return rows @ posterior.covariance @ rows.T

    @property
    def _at_zero(self) -> FloatArray:
        """Row that reads a transform at k = 0: by a parabola in k^2, as :class:`RadialSpectrum`."""
        return self.posterior.wavenumbers.integrals(np.eye(self.posterior.nodes))

    def _along_free(self, values: FloatArray) -> FloatArray:
        centre = np.zeros(2)
        centre[self.points.free[0]] = values[self.posterior.nodes : self.posterior.first_drift]
        return centre

    def _synthesis(self, r: ArrayLike) -> FloatArray:
        """Matrix from the transform at the nodes to values at radii."""
        radii = abs(floats(r))
        reach = reach_of(self.points)
        if not np.all(radii <= reach):
            raise InputError(
                f"A radius is {radii.max() * 1e3:.4g} mm.",
                why=f"The stress was restored out to {reach * 1e3:.4g} mm.",
                cure="Give radii in metres, within 1.5 times the scan's width.",
            )
        return self.posterior.wavenumbers.synthesise(np.eye(self.posterior.nodes), radii)


def _compared(restored: Restoration, stress: BaseStress) -> StressComparison:
    """Compare a calculated stress, scaled to a rod's load, with scan and restoration."""
    scan = restored.scan
    _, indenter, load, _ = scan.set_up
    if not isinstance(indenter, Rod) and abs(stress.load / load - 1) > SAME_LOAD:
        raise InputError(
            f"The expected stress is that of {stress.load:.4g} N, the scan of {scan.load:.4g} N.",
            why=f"The contact of a {indenter.shape} grows with its load: stress is not "
            "proportional to it.",
            cure="Calculate the stress for the scan's load.",
        )
    wavenumbers = restored.posterior.wavenumbers
    if isinstance(stress, Contact):
        spectrum = stress.base_spectrum(wavenumbers.k) / stress.load
    else:
        spectrum = hankel_transform(stress.r, stress.sigma_zz, wavenumbers.k) / stress.load
    calculated = scan.stated_load * wavenumbers.synthesise(spectrum, restored.r)
    peak = abs(calculated).max()
    apart = abs(restored.sigma_zz - calculated)
    chi_square, degrees = _direct(restored, spectrum)
    return StressComparison(
        stress=stress,
        sigma_zz=calculated,
        chi_square=chi_square / degrees,
        degrees=degrees,
        limit=chi_square_limit(degrees) / degrees,
        p_value=float(chdtrc(degrees, chi_square)),
        difference=float(apart.max()) / peak,
        within=float(
            np.mean(apart <= np.hypot(_EXPANDED * restored._sigma_zz_errors, _NEGLIGIBLE * peak))
        ),
    )


def _direct(restored: Restoration, spectrum: FloatArray) -> tuple[float, int]:
    """Return chi-square of the scan against a calculated stress, and its degrees of freedom."""
    scan = restored.scan
    posterior = restored.posterior
    estimate = posterior.estimate
    points = estimate.points
    model = estimate.model
    # Repeats share the centre, which is zero across a line.
    geometry = model.geometry(restored.centre)
    pressure = spectrum / posterior.film
    signal = model.signal(geometry, pressure)
    # One load cell errs alike under the rod, which changes A, and under the contact.
    by_load = (scan.load_uncertainty or 0.0) / scan.stated_load * signal[:, None]
    by_load = by_load + posterior.shifts.get("load", 0.0)
    # The film is not part of the direct way: the calculated stress is at its base already.
    names = ("apparatus", "position_scale", "dynamics")
    shifts = [by_load, *(posterior.shifts[name] for name in names if name in posterior.shifts)]
    # The stated noise as it is: raised by a misfit, it would hide it.
    noise = posterior.noise_ratio * estimate.noise_scale
    if points.noise_stated:
        noise = 1.0
    weights = estimate.weights / noise**2
    points, _ = points.sharing(points.standardised(np.hstack(shifts), weights))
    columns = np.hstack([model.centre_derivative(geometry, pressure), model.drift_columns])
    flat = np.linalg.qr(points.standardised(columns, weights))[0]
    left = points.standardised(points.u - signal, weights)
    left = left - flat @ (flat.T @ left)
    return float(left @ left), left.size - flat.shape[1]
