r"""The likelihood of calculated contacts: chi-square with everything that is uncertain beside them.

The voltages of one load are :math:`u = f(\theta) + F\beta + D(\theta)\xi + n`, with flat nuisances
:math:`\beta` of its own (baseline, drift, centre), systematic ones :math:`\xi` of unit variance
that all loads share (A G, film, sphere, balance, stage), and noise :math:`n` of covariance

.. math:: N = n_\mathrm{el}^2 + (A\,S'\,u(P_{ij})/P_j)^2 + (A\,\partial S/\partial R\;u(x))^2 .

Chi-square is the least over all nuisances,

.. math:: \chi^2(\theta) = \rho^T C^{-1} \rho, \qquad C = N + D D^T,

the flat ones projected out.  D changes with :math:`\theta`, as an error of A or of the load is one
in proportion to the stress that is calculated, not to the one that was measured.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from memscal.friction.marginal_likelihood import Tables
from memscal.friction.prediction import LoadPoints, Members, Predicted, Sensor, predict
from memscal.model.arrays import FloatArray

__all__ = ["Likelihood", "Standardised", "likelihood", "standardise"]


@dataclass(frozen=True, eq=False)
class Standardised:
    """One load at V values of the parameter, its noise independent and of unit variance.

    Parameters
    ----------
    residual : ndarray, shape (V, n)
        Measured less calculated voltage, flat nuisances projected out.
    slope : ndarray, shape (V, n)
        Derivative of what is calculated by the bounded coordinate, likewise.
    columns : mapping of str to ndarray, shape (V, n, q)
        Systematic changes by source, likewise.
    noises : mapping of str to ndarray, shape (V, n, n) or (V, n)
        Roots of the covariances of the kinds of noise, in these units; of shape (V, n) where
        they are diagonal.
    volume : ndarray, shape (V,)
        Logarithm of the determinants of N and of the flat nuisances' information.
    degrees : int
        Points less flat parameters.
    """

    residual: FloatArray
    slope: FloatArray
    columns: Mapping[str, FloatArray]
    noises: Mapping[str, FloatArray]
    volume: FloatArray
    degrees: int


def standardise(points: LoadPoints, found: Predicted) -> Standardised:
    """Divide by the noise, and project out what is flat."""
    kinds = {
        "noise": np.broadcast_to(points.noise, found.signal.shape),
        "load_scatter": np.abs(found.by_load) * points.load_errors,
        "position": np.abs(found.slope) * points.x_errors,
    }
    kinds = {name: kind for name, kind in kinds.items() if kind.any()}
    whitener = _whitener(points, kinds)
    flat = np.broadcast_to(points.flat, (*found.signal.shape, points.flat.shape[1]))
    if points.free_centre:
        flat = np.concatenate([flat, (found.slope * points.side)[..., None]], axis=-1)
    basis, triangle = np.linalg.qr(_times(whitener, flat))

    def projected(values: FloatArray) -> FloatArray:
        scaled = _times(whitener, values if values.ndim == 3 else values[..., None])
        left = scaled - basis @ (np.swapaxes(basis, -1, -2) @ scaled)
        return left if values.ndim == 3 else left[..., 0]

    diagonal = np.abs(np.diagonal(triangle, axis1=-2, axis2=-1))
    return Standardised(
        residual=projected(points.u - found.signal),
        slope=projected(found.by_coordinate),
        columns={source: projected(column) for source, column in found.columns.items()},
        noises={name: _scaled(whitener, points, name, kind) for name, kind in kinds.items()},
        volume=2 * np.log(diagonal).sum(axis=-1) - 2 * _log_determinant(whitener),
        degrees=points.degrees,
    )


def _whitener(points: LoadPoints, kinds: Mapping[str, FloatArray]) -> FloatArray:
    """Inverse root of N, shape (V, n) where it is diagonal, else (V, n, n)."""
    if points.correlation is None:
        return np.asarray(1 / np.sqrt(np.sum([kind**2 for kind in kinds.values()], axis=0)))
    covariance = np.outer(points.noise, points.noise) * points.correlation
    extra = np.sum([kind**2 for name, kind in kinds.items() if name != "noise"], axis=0)
    rows = np.broadcast_to(extra, kinds["noise"].shape)
    return np.linalg.inv(np.linalg.cholesky(covariance + rows[..., None] * np.eye(rows.shape[-1])))


def _times(whitener: FloatArray, values: FloatArray) -> FloatArray:
    return whitener[..., None] * values if whitener.ndim == 2 else whitener @ values


def _scaled(whitener: FloatArray, points: LoadPoints, name: str, kind: FloatArray) -> FloatArray:
    """Root of one kind of noise in the units of all of it."""
    if whitener.ndim == 2:
        return whitener * kind
    if name != "noise" or points.correlation is None:
        return whitener * kind[:, None, :]
    return whitener @ (points.noise[:, None] * np.linalg.cholesky(points.correlation))


def _log_determinant(whitener: FloatArray) -> FloatArray:
    diagonal = whitener if whitener.ndim == 2 else np.diagonal(whitener, axis1=-2, axis2=-1)
    return np.asarray(np.log(diagonal).sum(axis=-1))


@dataclass(frozen=True, eq=False)
class Likelihood:
    """Chi-square of one load or several along V values of one parameter.

    Parameters
    ----------
    values, coordinates : ndarray, shape (V,)
        The parameter, and its bounded coordinate.
    parts : tuple of Standardised
        The loads.
    """

    values: FloatArray
    coordinates: FloatArray
    parts: tuple[Standardised, ...]

    def only(self, chosen: Sequence[int]) -> Likelihood:
        """Return the likelihood of some of the loads."""
        return Likelihood(self.values, self.coordinates, tuple(self.parts[i] for i in chosen))

    @property
    def degrees(self) -> int:
        """Points less flat parameters; the parameter itself is not counted."""
        return sum(part.degrees for part in self.parts)

    @cached_property
    def chi_square(self) -> FloatArray:
        """Least chi-square over all nuisances, shape (V,)."""
        residual = self._joined([part.residual for part in self.parts])
        return np.asarray(np.einsum("vn,vn->v", residual, self._inverse_times(residual)))

    @cached_property
    def information(self) -> FloatArray:
        """Inverse variance of the bounded coordinate that the likelihood's slope tells, (V,)."""
        slope = self._joined([part.slope for part in self.parts])
        return np.asarray(np.einsum("vn,vn->v", slope, self._inverse_times(slope)))

    def budget(self, index: int) -> dict[str, float]:
        """Contribution of each source to the coordinate's uncertainty, at one of the values.

        The gain by which the best coordinate follows the voltages, times what each source does to
        them: the squares add up to the variance.
        """
        slope = self._joined([part.slope for part in self.parts])
        information = float(self.information[index])
        if not information > 0:
            return {}
        gain = self._inverse_times(slope)[index] / information
        parts: dict[str, float] = {}
        pieces = np.split(gain, np.cumsum([p.residual.shape[1] for p in self.parts])[:-1])
        for piece, part in zip(pieces, self.parts, strict=True):
            for name, root in part.noises.items():
                each = root[index] * piece if root.ndim == 2 else root[index].T @ piece
                parts[name] = float(np.hypot(parts.get(name, 0.0), np.linalg.norm(each)))
        for source, columns in self._columns.items():
            parts[source] = float(np.linalg.norm(gain @ columns[index]))
        return parts

    def tables(self) -> Tables:
        """Return what each load tells, as the evidence of laws of the interface is made of."""
        widths = {source: c.shape[-1] for source, c in self._columns.items()}
        each = [self._whole(part, widths) for part in self.parts]
        return Tables(
            squares=np.stack([np.sum(p.residual**2, axis=-1) for p in self.parts], axis=1),
            pulls=np.stack(
                [
                    np.einsum("vnq,vn->vq", d, p.residual)
                    for d, p in zip(each, self.parts, strict=True)
                ],
                axis=1,
            ),
            grips=np.stack([np.swapaxes(d, -1, -2) @ d for d in each], axis=1),
            volumes=np.stack([part.volume for part in self.parts], axis=1),
        )

    @cached_property
    def _columns(self) -> dict[str, FloatArray]:
        """Systematic columns over all points, zero in a load that does not know a source."""
        sources = dict.fromkeys(source for part in self.parts for source in part.columns)
        widths = {
            source: next(p.columns[source].shape[-1] for p in self.parts if source in p.columns)
            for source in sources
        }
        return {
            source: np.concatenate([self._of(part, source, width) for part in self.parts], axis=1)
            for source, width in widths.items()
        }

    @staticmethod
    def _of(part: Standardised, source: str, width: int) -> FloatArray:
        known = part.columns.get(source)
        return np.zeros((*part.residual.shape, width)) if known is None else known

    def _whole(self, part: Standardised, widths: Mapping[str, int]) -> FloatArray:
        columns = [self._of(part, source, width) for source, width in widths.items()]
        nothing = np.zeros((*part.residual.shape, 0))
        return np.concatenate([nothing, *columns], axis=-1)

    @staticmethod
    def _joined(parts: Sequence[FloatArray]) -> FloatArray:
        return np.concatenate(parts, axis=1)

    @cached_property
    def _systematic(self) -> tuple[FloatArray, FloatArray]:
        """Columns of all sources, shape (V, n, q), and the inverse of 1 + D^T D."""
        nothing = np.zeros((*self._joined([part.residual for part in self.parts]).shape, 0))
        columns = np.concatenate([nothing, *self._columns.values()], axis=-1)
        grip = np.swapaxes(columns, -1, -2) @ columns
        return columns, np.linalg.inv(grip + np.eye(columns.shape[-1]))

    def _inverse_times(self, values: FloatArray) -> FloatArray:
        """C^-1 times vectors (V, n), by Woodbury's identity."""
        columns, inverse = self._systematic
        pull = np.einsum("vnq,vn->vq", columns, values)
        return np.asarray(values - np.einsum("vnq,vqp,vp->vn", columns, inverse, pull))


def likelihood(
    points: Sequence[LoadPoints], sensor: Sensor, members: Members, loads: Sequence[int]
) -> Likelihood:
    """Return the likelihood of loads, each with the index of its load in the family.

    Parameters
    ----------
    points : sequence of LoadPoints
        What was measured.
    sensor, members
        With what, against what.
    loads : sequence of int
        The family's load of each of them.
    """
    parts = [
        standardise(each, predict(each, sensor, members, load))
        for each, load in zip(points, loads, strict=True)
    ]
    return Likelihood(members.values, members.coordinates, tuple(parts))
