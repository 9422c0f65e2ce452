r"""First-order propagation: noise, what regularisation hides, and uncertain inputs.

Every result is a linear function of the posterior of the profile's parameters (:math:`w`)
and of the Gaussian fit's (:math:`f`).  What scatters of them from scan to scan, by their
derivatives by the voltages, is ``noise``; the rest of the expected squared error of :math:`w`,
which does not scatter, is ``regularisation``: what the estimate cannot know.  What a window hides
beyond that is counted as an error of the size that the profile's own continuation has there.
Inputs add one column each, the change of all results by one standard uncertainty, and their
correlations combine these.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.special import j0

from memscal.calibration.functionals import Functional, kernel_functionals
from memscal.calibration.inputs import InputEffect, correlation_matrix
from memscal.calibration.stages import Deconvolution, FieldNoise
from memscal.estimation.profile import ProfileEstimate
from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import FloatArray

__all__ = ["BUDGETED", "NOT_RANDOM", "Results", "propagate"]

#: What sums of squares lose to rounding.
_ROUNDING = 1e-9


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
    cross_covariance : ndarray, shape (n, p)
        Covariance of G(r) with the parameters, in their units.
    transfer_errors : ndarray, shape (m,)
        Standard uncertainty of the transfer function.
    radial_scatter : ndarray, shape (n,)
        Standard uncertainty by what scatters of G(r) as it is given back, in 1/m^2.
    """

    parameters: ParameterSet
    budget: Mapping[str, Mapping[str, float]]
    radial_covariance: FloatArray
    cross_covariance: FloatArray
    transfer_errors: FloatArray
    radial_scatter: FloatArray


#: Parameters whose uncertainty is broken down by source.
BUDGETED = (
    "conversion_constant",
    "gaussian_sigma",
    "gaussian_sigma_deconvolved",
    "fwhm",
    "noise_equivalent_area",
)


#: Sources that are the same error in every scan.
NOT_RANDOM = ("regularisation", "window")


@dataclass(frozen=True, eq=False)
class _Rows:
    """Derivatives of all results by (w, f), and what the window hides of each.

    The results are the parameters, ``names`` with ``values``, then G at its radii, then the
    transfer function at its wavenumbers: the rows of ``matrix`` and ``hidden``.  ``opened`` are the
    rows of G as it is given back, through the window.
    """

    names: tuple[str, ...]
    values: FloatArray
    radii: int
    matrix: FloatArray
    hidden: FloatArray
    opened: FloatArray

    @property
    def stored(self) -> int:
        """How many results have a covariance: parameters and G."""
        return len(self.names) + self.radii


def propagate(
    estimate: ProfileEstimate,
    deconvolution: Deconvolution,
    window: FloatArray,
    wavenumbers: FloatArray,
    effects: Mapping[str, InputEffect],
    correlations: Mapping[tuple[str, str], float],
    raster: FieldNoise | None = None,
) -> Results:
    """Propagate all stated uncertainties to the results.

    Parameters
    ----------
    estimate : ProfileEstimate
        The scan's profile and its posterior.
    deconvolution : Deconvolution
        A and G.
    window : ndarray, shape of ``estimate.model.k``
        The regularisation's window at the quadrature nodes.
    wavenumbers : ndarray, shape (m,)
        Where the transfer function is stated, in rad/m.
    effects : mapping of str to InputEffect
        What one standard uncertainty of each input does.
    correlations : mapping
        Correlation coefficients of pairs of inputs; none where absent.
    raster : FieldNoise, optional
        What the noise of a measured field adds.
    """
    rows = _rows(estimate, deconvolution, window, wavenumbers)
    random, fixed = _noise_roots(estimate)
    columns = {
        "noise": rows.matrix @ random,
        "regularisation": rows.matrix @ fixed,
        "window": rows.hidden[:, None],
    }
    if raster is not None:
        columns["raster_noise"] = _raster_columns(rows, deconvolution, raster)
    independent = list(columns.values())
    columns |= {name: _input_column(rows, estimate, effect) for name, effect in effects.items()}
    if effects:
        together = np.hstack([columns[name] for name in effects])
        joined = _root(correlation_matrix(list(effects), correlations))
        independent.append(together @ joined)
    everything = np.hstack(independent)
    stored = everything[: rows.stored] @ everything[: rows.stored].T
    count = len(rows.names)
    scatter = [rows.opened @ random[: rows.opened.shape[1]]]
    if effects:
        moved = estimate.weighed.gain @ np.stack([e.voltage for e in effects.values()], axis=1)
        scatter.append(rows.opened @ moved @ joined)
    if raster is not None:
        scatter.append(raster.radial)
    return Results(
        parameters=ParameterSet(rows.names, rows.values, stored[:count, :count]),
        budget={name: _budget(rows, columns, stored, name) for name in BUDGETED},
        radial_covariance=stored[count:, count:],
        cross_covariance=stored[count:, :count],
        transfer_errors=np.linalg.norm(everything[rows.stored :], axis=1),
        radial_scatter=np.linalg.norm(np.hstack(scatter), axis=1),
    )


def _budget(
    rows: _Rows, columns: Mapping[str, FloatArray], covariance: FloatArray, name: str
) -> dict[str, float]:
    """Contribution of each source; of correlations with the sign of what they add."""
    row = rows.names.index(name)
    parts = {source: float(np.linalg.norm(column[row])) for source, column in columns.items()}
    variance = float(covariance[row, row])
    excess = variance - sum(part**2 for part in parts.values())
    if abs(excess) > _ROUNDING * variance:
        parts["correlations"] = float(np.copysign(np.sqrt(abs(excess)), excess))
    return parts


def _input_column(rows: _Rows, estimate: ProfileEstimate, effect: InputEffect) -> FloatArray:
    shift = np.concatenate(
        [estimate.weighed.gain @ effect.voltage, estimate.gaussian_gain @ effect.voltage]
    )
    column = rows.matrix @ shift
    scales = np.array([name.startswith("conversion_constant") for name in rows.names])
    column[: scales.size] += np.where(scales, rows.values, 0.0) * effect.scaling
    return np.asarray(column[:, None])


def _rows(
    estimate: ProfileEstimate,
    deconvolution: Deconvolution,
    window: FloatArray,
    wavenumbers: FloatArray,
) -> _Rows:
    basis, k = estimate.basis, estimate.model.k
    a, r = deconvolution.conversion_constant, deconvolution.g.r
    fitted = estimate.gaussian.jacobian.shape[1]
    # Normalised: a change of A G by dK changes G by (dK - G dA) / A.
    synthesis = j0(np.multiply.outer(r, k)) * estimate.model.reference.wavenumbers.weights
    normalised = (basis.kernels(k) - np.outer(estimate.kernel / a, basis.integrals)) / a
    radial = (basis.radial(r) - np.outer(estimate.radial(r) / a, basis.integrals)) / a
    transfer = _interpolated(wavenumbers, k, normalised)
    hidden = (1 - window) * estimate.kernel / a
    hidden_radial = synthesis @ hidden
    opened = radial - synthesis @ ((1 - window)[:, None] * normalised)
    functionals = kernel_functionals(deconvolution.g, deconvolution.gaussian_sigma)
    scalars, names, values = _scalar_rows(estimate, deconvolution, functionals, opened)
    hidden_scalars = np.zeros(len(names))
    for functional in functionals:
        hidden_scalars[names.index(functional.name)] = functional.row @ hidden_radial
    profiles = np.vstack([radial, transfer])
    return _Rows(
        names=names,
        values=values,
        radii=r.size,
        matrix=np.vstack([scalars, np.pad(profiles, ((0, 0), (0, fitted)))]),
        hidden=np.concatenate([hidden_scalars, hidden_radial, np.interp(wavenumbers, k, hidden)]),
        opened=opened,
    )


def _interpolated(places: FloatArray, nodes: FloatArray, columns: FloatArray) -> FloatArray:
    """Interpolate every column linearly, its ends continued: np.interp for all at once."""
    left = np.clip(np.searchsorted(nodes, places) - 1, 0, nodes.size - 2)
    share = np.clip((places - nodes[left]) / (nodes[left + 1] - nodes[left]), 0.0, 1.0)[:, None]
    return np.asarray((1 - share) * columns[left] + share * columns[left + 1])


def _scalar_rows(
    estimate: ProfileEstimate,
    deconvolution: Deconvolution,
    functionals: tuple[Functional, ...],
    opened: FloatArray,
) -> tuple[FloatArray, tuple[str, ...], FloatArray]:
    count, fitted = estimate.basis.integrals.size, estimate.gaussian.jacobian.shape[1]
    gaussian = estimate.gaussian
    entries: list[tuple[str, float, FloatArray, int]] = [
        ("conversion_constant", deconvolution.conversion_constant, estimate.basis.integrals, 0),
        ("gaussian_sigma", gaussian.sigma, _unit(fitted, 1), count),
        *_ellipse(estimate),
        *((f.name, f.value, f.row @ opened, 0) for f in functionals),
        *_nuisances(estimate),
        ("conversion_constant_gaussian", gaussian.conversion_constant, _unit(fitted, 0), count),
    ]
    rows = np.zeros((len(entries), count + fitted))
    for row, (_, _, part, first) in zip(rows, entries, strict=True):
        row[first : first + part.size] = part
    return rows, tuple(e[0] for e in entries), np.array([e[1] for e in entries])


def _nuisances(estimate: ProfileEstimate) -> list[tuple[str, float, FloatArray, int]]:
    """Centre, baseline and drift of each scan; the second scan's end in ``_2``, and so on."""
    count, free = estimate.basis.integrals.size, estimate.points.free
    centres = [("centre", "centre_y")[axis] + _number(scan) for scan, axis in np.argwhere(free)]
    drifts: list[tuple[str, float]] = []
    for scan, directions in enumerate(free):
        # The drift is stated across the whole range; its coefficient spans half of it.
        along = [("drift", "drift_y")[axis] for axis in np.flatnonzero(directions)]
        drifts += [("baseline" + _number(scan), 1.0), *((n + _number(scan), 2.0) for n in along)]
    entries = [
        (name, float(value), _unit(count, 2 + i), 0)
        for i, (name, value) in enumerate(zip(centres, estimate.centres[free], strict=True))
    ]
    first = 2 + len(centres)
    for i, ((name, scale), value) in enumerate(zip(drifts, estimate.drifts, strict=True)):
        entries.append((name, scale * float(value), scale * _unit(count, first + i), 0))
    return entries


def _ellipse(estimate: ProfileEstimate) -> list[tuple[str, float, FloatArray, int]]:
    """The Gaussian's ellipticity: a round departure beside it would be read as less of both."""
    count, fitted = estimate.basis.integrals.size, estimate.basis.flat
    names, values = ("ellipticity", "ellipticity_diagonal"), estimate.gaussian.ellipticity
    first = fitted - estimate.points.ellipse
    return [
        (names[i], float(values[i]), _unit(fitted, first + i), count)
        for i in range(estimate.points.ellipse)
    ]


def _number(scan: int) -> str:
    return "" if scan == 0 else f"_{scan + 1}"


def _raster_columns(rows: _Rows, deconvolution: Deconvolution, raster: FieldNoise) -> FloatArray:
    """Noise of a measured field: a column for A, then those of G, then each of the transfer's."""
    count, components = len(rows.names), raster.transfer.size
    columns = np.zeros((rows.hidden.size, 1 + raster.radial.shape[1] + components))
    columns[rows.names.index("conversion_constant"), 0] = raster.conversion_constant
    inner = slice(1, 1 + raster.radial.shape[1])
    for functional in kernel_functionals(deconvolution.g, deconvolution.gaussian_sigma):
        columns[rows.names.index(functional.name), inner] = functional.row @ raster.radial
    columns[count : rows.stored, inner] = raster.radial
    columns[rows.stored :, inner.stop :] = np.diag(raster.transfer)
    return columns


def _unit(count: int, index: int) -> FloatArray:
    row = np.zeros(count)
    row[index] = 1.0
    return row


def _noise_roots(estimate: ProfileEstimate) -> tuple[FloatArray, FloatArray]:
    """Square roots of the joint covariance of (w, f): what scatters, and what does not.

    A Gaussian fit has no prior: all of its error scatters.
    """
    own, random = estimate.covariance, estimate.weighed.gain @ estimate.noise_root
    fitted = estimate.gaussian_gain @ estimate.noise_root
    fixed = _root(own - random @ random.T, np.sqrt(np.maximum(np.diag(own), 0.0)))
    return np.vstack([random, fitted]), np.pad(fixed, ((0, fitted.shape[0]), (0, 0)))


def _root(covariance: FloatArray, scale: FloatArray | None = None) -> FloatArray:
    """A square root of a covariance that may be singular, its rows of the given sizes."""
    if scale is None:
        scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    safe = np.where(scale > 0, scale, 1.0)
    values, vectors = np.linalg.eigh(covariance / np.outer(safe, safe))
    return np.asarray(safe[:, None] * vectors * np.sqrt(np.maximum(values, 0.0)))
