r"""A calculated base stress against a scan: blurred by the sensor, and beside the restored one.

The direct way is the paper's: the calculated stress is convolved with A G and held against the
voltages.  Centre, baseline and drift are fitted, and the uncertainty of A and G counts beside the
noise: with columns D of what their standard uncertainties do, the residuals have the covariance
:math:`C = N + D D^T`, and :math:`\rho^T C^{-1} \rho` follows the chi-square distribution.
"""

from __future__ import annotations

from dataclasses import dataclass
from os import PathLike
from typing import TypeAlias

import numpy as np
from scipy.special import chdtrc

from memscal.axisymmetry.hankel import hankel_transform
from memscal.errors import InputError
from memscal.measurement.posterior import Posterior
from memscal.measurement.pressure import film_transfer
from memscal.measurement.requirements import SAME_LOAD
from memscal.mechanics.contact import Contact
from memscal.model.checks import chi_square_limit
from memscal.model.indenter import Rod
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile
from memscal.model.validation import FloatArray

__all__ = ["Comparison", "Expected", "compare_stress", "read_expected"]

Expected: TypeAlias = StressProfile | Contact | str | PathLike[str] | None
"""A base stress to compare with, or the path of a file that holds one."""


#: Coverage factor of 95 %.
_EXPANDED = 1.96
#: Below this share of the largest stress a difference matters to nobody.
_NEGLIGIBLE = 1e-3


@dataclass(frozen=True, eq=False)
class Comparison:
    """How a calculated stress agrees with what was measured.

    Parameters
    ----------
    stress : StressProfile or Contact
        What was calculated.
    sigma_zz : ndarray, shape (n,)
        It, at the restoration's radii, in Pa.
    chi_square, degrees, limit, p_value : float
        The direct way: reduced chi-square of the scan against the calculated stress convolved with
        A G, its degrees of freedom, what it exceeds by chance once in a thousand, its p-value.
    difference : float
        Largest difference of the restored from the calculated stress, over the largest stress.
    within : float
        Share of the radii at which they agree within 1.96 standard uncertainties.
    """

    stress: StressProfile | Contact
    sigma_zz: FloatArray
    chi_square: float
    degrees: int
    limit: float
    p_value: float
    difference: float
    within: float


def compare_stress(
    posterior: Posterior, scan: Scan, stress: StressProfile | Contact, r: FloatArray
) -> Comparison:
    """Compare a calculated stress, scaled to the scan's load, with scan and restoration.

    Raises
    ------
    InputError
        If the stress of a curved indenter was calculated for another load.
    """
    if not isinstance(scan.indenter, Rod) and abs(stress.load / scan.load - 1) > SAME_LOAD:
        raise InputError(
            f"The expected stress is that of {stress.load:.4g} N, the scan of {scan.load:.4g} N.",
            why=f"The contact of a {scan.indenter.shape} grows with its load: stress is not "
            "proportional to it.",
            cure="Calculate the stress for the scan's load.",
        )
    estimate, nodes = posterior.estimate, posterior.nodes
    model = estimate.model
    spectrum = _per_newton(stress, model.k)
    synthesis = model.reference.wavenumbers.synthesise(np.eye(nodes), r)
    calculated = scan.load * (synthesis @ spectrum)
    covariance = synthesis @ posterior.covariance[:nodes, :nodes] @ synthesis.T
    peak = float(np.abs(calculated).max())
    allowed = np.hypot(_EXPANDED * np.sqrt(np.maximum(np.diag(covariance), 0)), _NEGLIGIBLE * peak)
    apart = np.abs(synthesis @ posterior.state[:nodes] - calculated)
    chi_square, degrees = _direct(posterior, scan, spectrum)
    return Comparison(
        stress=stress,
        sigma_zz=calculated,
        chi_square=chi_square / degrees,
        degrees=degrees,
        limit=chi_square_limit(degrees) / degrees,
        p_value=float(chdtrc(degrees, chi_square)),
        difference=float(apart.max()) / peak,
        within=float(np.mean(apart <= allowed)),
    )


def _per_newton(stress: StressProfile | Contact, k: FloatArray) -> FloatArray:
    if isinstance(stress, Contact):
        return stress.base_spectrum(k) / stress.load
    return hankel_transform(stress.r, stress.sigma_zz, k) / stress.load


def _direct(posterior: Posterior, scan: Scan, spectrum: FloatArray) -> tuple[float, int]:
    """Return chi-square of the scan against a calculated stress, and its degrees of freedom."""
    estimate = posterior.estimate
    model, points = estimate.model, estimate.points
    free = points.free
    centres = np.zeros(free.shape)
    centres[free] = posterior.state[posterior.nodes : posterior.nodes + free.sum()]
    geometry = model.geometry(centres)
    pressure = spectrum / film_transfer(scan.film, model.k)
    signal = model.signal(geometry, pressure)
    columns = [model.centre_derivative(geometry, pressure), model.drift_columns]
    # The film is not part of the direct way: the calculated stress is at its base already.
    added = np.hstack([posterior.shifts["apparatus"], posterior.shifts["position_scale"]])
    if scan.load_uncertainty is not None:
        share = scan.load_uncertainty / scan.load
        added = np.column_stack([added, share * signal])
    # A stated noise is taken at its word: raised by a misfit, it would hide it.
    stated = points.u_errors is not None
    root = estimate.noise_root * (1 / estimate.noise_scale if stated else posterior.noise_ratio)
    covariance = root @ root.T + added @ added.T
    whiten = np.linalg.inv(np.linalg.cholesky(covariance))
    flat = np.linalg.qr(whiten @ np.hstack(columns))[0]
    left = whiten @ (points.u - signal)
    left = left - flat @ (flat.T @ left)
    return float(left @ left), left.size - flat.shape[1]


def read_expected(expected: Expected) -> StressProfile | Contact:
    """Return a stress to compare with, read from its file where it is one."""
    if isinstance(expected, str | PathLike):
        from memscal.formats.reference import read_reference

        return read_reference(expected)
    if isinstance(expected, StressProfile | Contact):
        return expected
    raise InputError(
        f"The expected stress is a {type(expected).__name__}.",
        cure="Give a contact from memscal.indent(), a StressProfile, or the path of a file.",
    )
