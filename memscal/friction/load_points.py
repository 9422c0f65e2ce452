"""The measured points of one load, as the comparison with calculated contacts uses them."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from memscal.estimation.points import ScanPoints, measured_points
from memscal.model.scan import Scan
from memscal.model.validation import FloatArray

if TYPE_CHECKING:
    from memscal.measurement.measured_stress import MeasuredProfile

__all__ = ["LoadPoints", "load_points", "single_point"]


@dataclass(frozen=True, eq=False)
class LoadPoints:
    """Voltages of one load of one scan, and what is known about each.

    Parameters
    ----------
    u : ndarray, shape (n,)
        Voltage, in V.
    offset : ndarray, shape (n,)
        Position from the centre that was found, along the scan, in m.
    log_load : ndarray, shape (n,)
        Logarithm of the point's load over the nominal one.
    noise : ndarray, shape (n,)
        Standard deviation of the electronic noise, in V; outliers' is larger.
    load_errors : ndarray, shape (n,)
        Standard uncertainty of each load over the nominal one, independent from point to point.
    x_errors : ndarray, shape (n,)
        Standard uncertainty of each position, in m.
    flat : ndarray, shape (n, d)
        Columns of baseline and drift: of unknown size.
    free_centre : bool
        Whether the centre is to be found with them.
    load_share, position_share : float
        Relative standard uncertainty of all loads, and of the stage's scale.
    correlation : ndarray, shape (n, n), or None
        Correlation of the electronic noise.
    """

    u: FloatArray
    offset: FloatArray
    log_load: FloatArray
    noise: FloatArray
    load_errors: FloatArray
    x_errors: FloatArray
    flat: FloatArray
    free_centre: bool = True
    load_share: float = 0.0
    position_share: float = 0.0
    correlation: FloatArray | None = None

    @property
    def radius(self) -> FloatArray:
        """Distance from the centre, in m."""
        return np.abs(self.offset)

    @property
    def side(self) -> FloatArray:
        """Change of the distance for a shift of the centre: one, minus one, or zero."""
        return -np.sign(self.offset)

    @property
    def degrees(self) -> int:
        """Points less flat parameters."""
        return int(self.u.size - self.flat.shape[1]) - int(self.free_centre)

    def averaged(self) -> LoadPoints:
        """Return the mean of the repeats at each position, sorted by position."""
        places, back = np.unique(np.round(self.offset, 12), return_inverse=True)
        mean = np.zeros((places.size, self.u.size))
        mean[back, np.arange(self.u.size)] = 1.0
        mean /= mean.sum(axis=1, keepdims=True)
        inner = np.eye(self.u.size) if self.correlation is None else self.correlation
        covariance = mean @ (np.outer(self.noise, self.noise) * inner) @ mean.T
        noise = np.sqrt(np.diag(covariance))
        return replace(
            self,
            u=mean @ self.u,
            offset=places,
            log_load=mean @ self.log_load,
            noise=noise,
            load_errors=np.sqrt(mean**2 @ self.load_errors**2),
            # The stage errs alike in every repeat.
            x_errors=mean @ self.x_errors,
            flat=mean @ self.flat,
            correlation=None if self.correlation is None else covariance / np.outer(noise, noise),
        )


def load_points(profile: MeasuredProfile) -> LoadPoints:
    """Return the points of a measured profile, with the noise that is stated, or was found.

    A stated noise is taken at its word: raised by a misfit, it would hide it.
    """
    scan, found = profile.part.scan, profile.restoration
    points = measured_points(scan)
    along, position = (0, points.x) if points.free[0, 0] else (1, points.y)
    outlier = found.posterior.estimate.outlier_weight
    kept = _kept(scan)
    return LoadPoints(
        u=points.u,
        offset=position - float(found.centre[along]),
        log_load=np.log(points.load / profile.load),
        noise=np.asarray(profile.electronic_noise[kept] / np.sqrt(outlier)),
        load_errors=_load_errors(scan, kept) / profile.load,
        x_errors=points.x_errors,
        flat=np.stack([np.ones_like(position), _unit_range(position)], axis=1),
        load_share=(scan.load_uncertainty or 0.0) / scan.load,
        position_share=scan.position_scale_uncertainty or 0.0,
        correlation=_correlation(points),
    )


def single_point(u: float, noise: float, like: LoadPoints) -> LoadPoints:
    """Return the signal on the axis as the only point, with the uncertainties of others."""
    nothing = np.zeros(1)
    return LoadPoints(
        u=np.array([u]),
        offset=nothing,
        log_load=nothing,
        noise=np.array([noise]),
        load_errors=nothing,
        x_errors=nothing,
        flat=np.zeros((1, 0)),
        free_centre=False,
        load_share=like.load_share,
        position_share=like.position_share,
    )


def _kept(scan: Scan) -> NDArray[np.bool_]:
    """Which points were measured, shape of ``u_zz``."""
    kept: NDArray[np.bool_] = np.isfinite(scan.u_zz)
    for other in (scan.normal_load, scan.u_zz_errors):
        if other is not None:
            kept &= np.isfinite(other)
    return kept


def _load_errors(scan: Scan, kept: NDArray[np.bool_]) -> FloatArray:
    """Uncertainty of each load of the points that were measured, in N."""
    if scan.normal_load_errors is None:
        return np.zeros(int(kept.sum()))
    return np.nan_to_num(scan.normal_load_errors[kept])


def _unit_range(position: FloatArray) -> FloatArray:
    middle = (position.max() + position.min()) / 2
    return np.asarray((position - middle) / (np.ptp(position) / 2))


def _correlation(points: ScanPoints) -> FloatArray | None:
    if points.decorrelation is None:
        return None
    root = np.linalg.inv(points.decorrelation)
    return np.asarray(root @ root.T)
