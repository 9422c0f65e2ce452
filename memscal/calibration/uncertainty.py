r"""First-order propagation: noise, what the window hides, and the inputs of the reference.

Every result is a linear function of the posterior of the profile's parameters (:math:`w`)
and of the Gaussian fit's (:math:`f`).  Their joint covariance follows from the linear
model: :math:`\mathrm{cov}(w, f)` is the Gaussian fit's own covariance in the parameters that
they share, and zero for the rings.  Inputs add one column each: the change of all results
by one standard uncertainty.  What the window hides is counted as an error of the size that
the profile's own continuation has there.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import j0

from memscal.calibration.field_noise import FieldNoise
from memscal.calibration.functionals import Functional, kernel_functionals
from memscal.calibration.normalise import NormalisedKernel
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.model.apparatus import ParameterSet
from memscal.model.validation import FloatArray

__all__ = ["Results", "propagate"]


@dataclass(frozen=True, eq=False)
class Results:
    """Everything a calibration states with an uncertainty.

    Parameters
    ----------
    parameters : ParameterSet
        Scalars with their joint covariance.
    budget : mapping
        Standard uncertainty of each budgeted parameter by source, in its SI unit.
    radial_covariance : ndarray, shape (n, n)
        Covariance of G(r), in 1/m^4.
    transfer_errors : ndarray, shape (m,)
        Standard uncertainty of the transfer function.
    """

    parameters: ParameterSet
    budget: Mapping[str, Mapping[str, float]]
    radial_covariance: FloatArray
    transfer_errors: FloatArray


#: Parameters whose uncertainty is broken down by source.
_BUDGETED = (
    "conversion_constant",
    "gaussian_sigma",
    "gaussian_sigma_deconvolved",
    "fwhm",
    "noise_equivalent_area",
)


@dataclass(frozen=True, eq=False)
class _Rows:
    """Derivatives of the results by (w, f), and what the window hides of each."""

    names: tuple[str, ...]
    values: FloatArray
    scalars: FloatArray
    radial: FloatArray
    transfer: FloatArray
    hidden_scalars: FloatArray
    hidden_radial: FloatArray
    hidden_transfer: FloatArray


def propagate(
    estimate: ProfileEstimate,
    kernel: NormalisedKernel,
    window: FloatArray,
    wavenumbers: FloatArray,
    changes: Mapping[str, FloatArray],
    relative: Mapping[str, float],
    raster: FieldNoise | None = None,
) -> Results:
    """Propagate all stated uncertainties to the results.

    Parameters
    ----------
    estimate : ProfileEstimate
        The scan's profile and its posterior.
    kernel : NormalisedKernel
        A and G.
    window : ndarray, shape of ``estimate.model.k``
        The regularisation's window at the quadrature nodes.
    wavenumbers : ndarray, shape (m,)
        Where the transfer function is stated, in rad/m.
    changes : mapping of str to ndarray
        Change of the reference's transform by one standard uncertainty of each source.
    relative : mapping of str to float
        Relative standard uncertainty of each source that scales A alone (the load).
    raster : FieldNoise, optional
        What the noise of a measured field adds.
    """
    rows = _rows(estimate, kernel, window, wavenumbers)
    covariance = _joint_covariance(estimate)
    scalars = {"noise": rows.scalars @ _root(covariance), "window": rows.hidden_scalars[:, None]}
    radial = [rows.radial @ _root(covariance), rows.hidden_radial[:, None]]
    transfer = [rows.transfer @ _root(covariance), rows.hidden_transfer[:, None]]
    for source, change in changes.items():
        shift = _shift(estimate, change)[:, None]
        scalars[source] = rows.scalars @ shift
        radial.append(rows.radial @ shift)
        transfer.append(rows.transfer @ shift)
    if raster is not None:
        scalars["raster_noise"] = _raster_columns(rows.names, kernel, raster)
        radial.append(raster.radial)
        transfer.append(raster.transfer[:, None])
    scales_a = np.array([name.startswith("conversion_constant") for name in rows.names])
    for source, share in relative.items():
        scalars[source] = (np.where(scales_a, rows.values, 0.0) * share)[:, None]
    total = sum(columns @ columns.T for columns in scalars.values())
    budget = {
        name: {
            source: float(np.linalg.norm(columns[rows.names.index(name)]))
            for source, columns in scalars.items()
        }
        for name in _BUDGETED
    }
    return Results(
        parameters=ParameterSet(rows.names, rows.values, np.asarray(total)),
        budget=budget,
        radial_covariance=np.asarray(sum(columns @ columns.T for columns in radial)),
        transfer_errors=np.sqrt(sum((columns**2).sum(axis=1) for columns in transfer)),
    )


def _rows(
    estimate: ProfileEstimate,
    kernel: NormalisedKernel,
    window: FloatArray,
    wavenumbers: FloatArray,
) -> _Rows:
    basis, k = estimate.basis, estimate.model.k
    a, r = kernel.conversion_constant, kernel.view.r
    fitted = estimate.gaussian.jacobian.shape[1]
    # Normalised: a change of A G by dK changes G by (dK - G dA) / A.
    synthesis = j0(np.multiply.outer(r, k)) * estimate.model.reference.wavenumbers.weights
    normalised = (basis.kernels(k) - np.outer(estimate.kernel / a, basis.integrals)) / a
    radial = (basis.radial(r) - np.outer(estimate.radial(r) / a, basis.integrals)) / a
    transfer = np.stack([np.interp(wavenumbers, k, column) for column in normalised.T], axis=1)
    hidden = (1 - window) * estimate.kernel / a
    opened = radial - synthesis @ ((1 - window)[:, None] * normalised)
    functionals = kernel_functionals(kernel)
    scalars, names, values = _scalar_rows(estimate, kernel, functionals, opened)
    hidden_scalars = np.zeros(len(names))
    for functional in functionals:
        hidden_scalars[names.index(functional.name)] = functional.row @ (synthesis @ hidden)
    pad = np.zeros((1, fitted))
    return _Rows(
        names=names,
        values=values,
        scalars=scalars,
        radial=np.hstack([radial, np.repeat(pad, r.size, axis=0)]),
        transfer=np.hstack([transfer, np.repeat(pad, wavenumbers.size, axis=0)]),
        hidden_scalars=hidden_scalars,
        hidden_radial=synthesis @ hidden,
        hidden_transfer=np.interp(wavenumbers, k, hidden),
    )


def _scalar_rows(
    estimate: ProfileEstimate,
    kernel: NormalisedKernel,
    functionals: tuple[Functional, ...],
    opened: FloatArray,
) -> tuple[FloatArray, tuple[str, ...], FloatArray]:
    count, fitted = estimate.basis.integrals.size, estimate.gaussian.jacobian.shape[1]
    planar = estimate.points.planar
    entries: list[tuple[str, float, FloatArray, int]] = [
        ("conversion_constant", kernel.conversion_constant, estimate.basis.integrals, 0),
        ("gaussian_sigma", estimate.gaussian.sigma, _unit(fitted, 1), count),
        *((f.name, f.value, f.row @ opened, 0) for f in functionals),
        ("centre", float(estimate.centre[0]), _unit(count, 2), 0),
        ("baseline", float(estimate.drift[0]), _unit(count, 4 if planar else 3), 0),
        # The drift is stated across the whole range; its coefficient spans half of it.
        ("drift", 2 * float(estimate.drift[1]), 2 * _unit(count, 5 if planar else 4), 0),
        (
            "conversion_constant_gaussian",
            estimate.gaussian.conversion_constant,
            _unit(fitted, 0),
            count,
        ),
    ]
    if planar:
        entries.append(("centre_y", float(estimate.centre[1]), _unit(count, 3), 0))
        entries.append(("drift_y", 2 * float(estimate.drift[2]), 2 * _unit(count, 6), 0))
    rows = np.zeros((len(entries), count + fitted))
    for row, (_, _, part, first) in zip(rows, entries, strict=True):
        row[first : first + part.size] = part
    names, values = tuple(e[0] for e in entries), np.array([e[1] for e in entries])
    return rows, names, values


def _raster_columns(
    names: tuple[str, ...], kernel: NormalisedKernel, raster: FieldNoise
) -> FloatArray:
    """Columns of the scalars for the noise of a measured field: A first, then those of G."""
    columns = np.zeros((len(names), 1 + raster.radial.shape[1]))
    columns[names.index("conversion_constant"), 0] = raster.conversion_constant
    for functional in kernel_functionals(kernel):
        columns[names.index(functional.name), 1:] = functional.row @ raster.radial
    return columns


def _unit(count: int, index: int) -> FloatArray:
    row = np.zeros(count)
    row[index] = 1.0
    return row


def _joint_covariance(estimate: ProfileEstimate) -> FloatArray:
    own, fitted = estimate.covariance, estimate.gaussian_covariance
    count, flat = own.shape[0], fitted.shape[0]
    joint = np.zeros((count + flat,) * 2)
    joint[:count, :count] = own
    joint[count:, count:] = fitted
    joint[:flat, count:] = fitted
    joint[count:, :flat] = fitted
    return joint


def _root(covariance: FloatArray) -> FloatArray:
    """A square root of a covariance that may be singular."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    safe = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(safe, safe))
    return np.asarray(safe[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))


def _shift(estimate: ProfileEstimate, change: FloatArray) -> FloatArray:
    """Change of (w, f) if the reference's transform is wrong by ``change``."""
    model = estimate.model
    relative = np.divide(
        change, model.reference.values, out=np.zeros_like(change), where=model.reference.values != 0
    )
    voltage = model.signal(estimate.gaussian.geometry, estimate.kernel * relative)
    return np.concatenate([estimate.weighed.gain @ voltage, estimate.gaussian_gain @ voltage])
