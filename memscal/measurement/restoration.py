"""The way back: the stress at the base of the film, restored from a scan and a calibration."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from os import PathLike
from typing import TypeAlias

import numpy as np
from numpy.typing import ArrayLike

from memscal.apparatus import ApparatusFunction, load_apparatus
from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers, hankel_transform
from memscal.errors import InputError
from memscal.estimation.points import ScanPoints, measured_points
from memscal.estimation.profile_estimate import estimate_profile
from memscal.measurement.comparison import Comparison, compare_stress
from memscal.measurement.posterior import Posterior, restore_posterior
from memscal.measurement.pressure import film_transfer
from memscal.measurement.requirements import require_measurement, restored_or_explained
from memscal.measurement.restoration_checks import restoration_checks, restoration_messages
from memscal.mechanics.contact import Contact
from memscal.model.apparatus import QualityCheck
from memscal.model.notation import format_measured
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.model.validation import FloatArray

__all__ = ["Expected", "Restoration", "restore"]

Expected: TypeAlias = StressProfile | Contact | str | PathLike[str] | None
"""A base stress to compare with, or the path of a file that holds one."""

#: A film passes nothing of exp(-kh) beyond this: 2e-9 of the load.
_LARGEST_KH = 20.0
_REACH = 1.5
#: Radii of the table, a scan's half width in all.
_RADII = 161


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
    messages : tuple of str
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
    messages: tuple[str, ...] = ()

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
    def degrees(self) -> float:
        """Points less parameters without prior: outliers count by their weight."""
        estimate = self.posterior.estimate
        parameters = 2 + int(self.points.free.sum()) + estimate.model.drift_columns.shape[1]
        return float(estimate.outlier_weight.sum() - parameters)

    @property
    def chi_square(self) -> float:
        """Sum of the squared residuals over the noise, outliers at their weight."""
        stated = self.points.u_errors
        noise = self.noise if stated is None else stated
        weight = self.posterior.estimate.outlier_weight
        return float(np.sum(weight * (self.residual / noise) ** 2))

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
            self._synthesis(r) @ (_transfer(self.apparatus, k) * self.posterior.state[:nodes])
        )

    def compare(self, expected: Expected) -> Comparison:
        """Compare with a calculated stress, blurred by G (the direct way) and restored."""
        return compare_stress(self.posterior, self.scan, _profile(expected), self.r)

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
        reach = _REACH * _span(self.points)
        if not np.all(radii <= reach):
            raise InputError(
                f"A radius is {np.max(radii) * 1e3:.4g} mm.",
                why=f"The stress was restored out to {reach * 1e3:.4g} mm.",
                cure="Give radii in metres, within 1.5 times the scan's width.",
            )
        known = self.posterior.estimate.model.reference.wavenumbers
        return known.synthesise(np.eye(known.k.size), radii)


def restore(
    scan: Scan,
    apparatus: ApparatusFunction | str | PathLike[str],
    *,
    expected: Expected = None,
) -> Restoration:
    r"""Restore the stress at the base of the film from a scan with a calibrated sensor.

    Solves :math:`U_{zz} = A\,G \otimes \sigma_{zz}` for the base stress, with a known A and G: what
    presses on the film is a pressure of any radial shape, weighed by evidence, and the film of the
    scan turns it into the stress at its base.  No contact is calculated.

    Parameters
    ----------
    scan : Scan
        Voltage against the indenter's position, at one load; a rod's loads may differ.
    apparatus : ApparatusFunction or path
        The calibrated sensor.
    expected : StressProfile, Contact or path, optional
        A calculated base stress to hold against the restored one: adds a check.

    Returns
    -------
    Restoration
        The stress with its uncertainty; its checks may have failed: see ``.passed``.

    Raises
    ------
    InputError
        If scan, artifact or expected stress cannot be used, or not together.
    FitError
        If the scan does not determine a stress.

    Examples
    --------
    >>> import memscal
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1), method="evidence").apparatus
    >>> restored = memscal.restore(memscal.simulate(seed=2), apparatus)
    >>> abs(restored.force - 1.0) < 3 * restored.force_uncertainty
    True
    """
    known = apparatus if isinstance(apparatus, ApparatusFunction) else load_apparatus(apparatus)
    require_measurement(scan, known)
    points = measured_points(scan)
    wavenumbers = Wavenumbers.covering(_LARGEST_KH / scan.film.thickness, _REACH * _span(points))
    transfer = known.conversion_constant * _transfer(known, wavenumbers.k)
    through = RadialSpectrum(wavenumbers, transfer * film_transfer(scan.film, wavenumbers.k))
    estimate = restored_or_explained(lambda: estimate_profile(points, through))
    posterior = restore_posterior(scan, known, estimate, transfer)
    nodes = posterior.nodes
    r = np.linspace(0.0, _span(points) / 2, _RADII)
    matrix = wavenumbers.synthesise(np.eye(nodes), r)
    found = Restoration(
        scan=scan,
        apparatus=known,
        posterior=posterior,
        r=r,
        sigma_zz=matrix @ posterior.state[:nodes],
        covariance=matrix @ posterior.covariance[:nodes, :nodes] @ matrix.T,
    )
    if expected is not None:
        found = replace(found, comparison=found.compare(expected))
    checks = restoration_checks(found)
    return replace(found, checks=checks, messages=restoration_messages(found, checks))


def _transfer(apparatus: ApparatusFunction, k: FloatArray) -> FloatArray:
    """Transform of G, as :meth:`ApparatusFunction.convolve` has it."""
    return hankel_transform(apparatus.radial_profile.r, apparatus.radial_profile.g, k)


def _span(points: ScanPoints) -> float:
    return float(np.hypot(np.ptp(points.x), np.ptp(points.y)))


def _profile(expected: Expected) -> StressProfile | Contact:
    if isinstance(expected, str | PathLike):
        from memscal.formats.reference import read_reference

        return read_reference(expected)
    if isinstance(expected, StressProfile | Contact):
        return expected
    raise InputError(
        f"The expected stress is a {type(expected).__name__}.",
        cure="Give a contact from memscal.indent(), a StressProfile, or the path of a file.",
    )
