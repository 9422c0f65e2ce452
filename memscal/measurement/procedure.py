"""The way back: from a scan and a calibrated sensor to the stress at the base of the film."""

from __future__ import annotations

from dataclasses import replace
from os import PathLike

import numpy as np

from memscal.apparatus import ApparatusFunction, opened_apparatus
from memscal.axisymmetry.hankel import RadialSpectrum, Wavenumbers
from memscal.estimation.points import ScanPoints, measured_points
from memscal.estimation.profile_estimate import ProfileEstimate, estimate_profile
from memscal.formats.opened import opened_scan
from memscal.measurement.comparison import Expected
from memscal.measurement.posterior import reach_of, restore_posterior, sensor_transfer
from memscal.measurement.pressure import film_transfer
from memscal.measurement.requirements import require_measurement, restored_or_explained
from memscal.measurement.restoration import Restoration
from memscal.measurement.restoration_checks import restoration_checks, restoration_messages
from memscal.model.scan import Scan
from memscal.model.validation import FloatArray
from memscal.threads import single_threaded

__all__ = ["gaussian_pressure", "restore", "restore_known"]

#: A film passes nothing of exp(-kh) beyond this: 2e-9 of the load.
_LARGEST_KH = 20.0
#: Radii of the table, from the axis to half the scan's width.
_RADII = 161


@single_threaded()
def restore(
    scan: Scan | str | PathLike[str],
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
    scan : Scan or path
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
    known, measured = opened_apparatus(apparatus), opened_scan(scan)
    require_measurement(measured, known)
    return restore_known(measured, known, expected)


def restore_known(scan: Scan, known: ApparatusFunction, expected: Expected = None) -> Restoration:
    """Restore a stress from a scan and an apparatus function that were proven to fit together.

    Parameters and errors are those of :func:`restore`.
    """
    points = measured_points(scan)
    estimate, transfer = gaussian_pressure(scan, known, points)
    wavenumbers = estimate.model.reference.wavenumbers
    posterior = restore_posterior(scan, known, estimate, transfer)
    nodes = posterior.nodes
    r = np.linspace(0.0, reach_of(points) / 3, _RADII)
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


def gaussian_pressure(
    scan: Scan, known: ApparatusFunction, points: ScanPoints
) -> tuple[ProfileEstimate, FloatArray]:
    """Return the best Gaussian pressure on the film, departures allowed for, and A G's transform.

    Raises
    ------
    FitError
        If the scan does not determine a stress.
    """
    wavenumbers = Wavenumbers.covering(_LARGEST_KH / scan.film.thickness, reach_of(points))
    transfer = known.conversion_constant * sensor_transfer(known, wavenumbers.k)
    through = RadialSpectrum(wavenumbers, transfer * film_transfer(scan.film, wavenumbers.k))
    return restored_or_explained(lambda: estimate_profile(points, through)), transfer
