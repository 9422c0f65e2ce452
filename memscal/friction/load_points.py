"""The measured points of one load, as the comparison with calculated contacts uses them."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from memscal.errors import InputError
from memscal.model.measured_stress import MeasuredProfile
from memscal.model.validation import FloatArray

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


def load_points(profile: MeasuredProfile, channel: str = "zz") -> LoadPoints:
    """Return the points of a measured profile, with the noise that is stated, or was estimated.

    A stated noise is taken at its word: raised by a misfit, it would hide it.

    Raises
    ------
    InputError
        If the profile holds no points of the channel, or not their noise.
    """
    points = profile.points.get(channel)
    if points is None:
        raise _missing(profile, channel)
    if points.noise is None:
        raise InputError(
            f"{profile.label}: u_{channel} is there, but not its noise, u_{channel}_errors.",
            why="Contacts are told apart by a chi-square.",
            cure=f"State the electronic noise of u_{channel}.",
        )
    position = (points.x, points.y)[profile.axis]
    return LoadPoints(
        u=points.u,
        offset=position - float(profile.centre[profile.axis]),
        log_load=np.log(points.load / profile.load),
        noise=np.asarray(points.noise / np.sqrt(points.weight)),
        load_errors=points.load_errors / profile.load,
        x_errors=points.x_errors,
        flat=np.stack([np.ones_like(position), _unit_range(position)], axis=1),
        load_share=(profile.load_uncertainty or 0.0) / profile.load,
        position_share=profile.scan.position_scale_uncertainty or 0.0,
        correlation=points.correlation,
    )


def _missing(profile: MeasuredProfile, channel: str) -> InputError:
    """Say why a profile holds no points of a channel."""
    if not profile.points:
        return InputError(
            f"{profile.label}: the measured stress holds no measured points.",
            why="Its file is of version 1.0, which kept the profiles alone.",
            cure="Make it again with memscal apply, or give the scans.",
        )
    return InputError(
        f"{profile.label}: the measured stress holds no usable voltage u_{channel}.",
        why="The scan has none, or it does not change, or the scan does not run along "
        f"{channel[0]}: across it the shear is zero.",
        cure=f"Give a line scan along {channel[0]} through the sensor, with u_{channel}.",
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


def _unit_range(position: FloatArray) -> FloatArray:
    middle = (position.max() + position.min()) / 2
    return np.asarray((position - middle) / (np.ptp(position) / 2))
