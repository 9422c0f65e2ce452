r"""The readings of an array linearised in everything that is common, and in each sensor's own.

Of all sensors at once the model is

.. math::

    u_i(t) = b_i + d_i\tau_t + \sum_j C_{ij}\,g_j\,P_t\,(K_j \otimes \sigma)(|r_t - c_j|) + n_i(t),
    \qquad n(t) \sim N(0,\; D + V_t V_t^T)

with one kernel K of all, or changes of it of each sensor's own; the columns V of what is common to
the readings of one press are those of the electronics of a board, of the place of the rod and of
its load.  Only the normal equations are kept: of 64 sensors and 4,225 presses the derivatives are
a gigabyte.
"""

from __future__ import annotations

from dataclasses import replace
from functools import cached_property

import numpy as np

from memscal.estimation.departures import departure_basis
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import GaussianFit
from memscal.extensions.arrays.presses import Presses, Waves
from memscal.model.arrays import BoolArray, FloatArray, IndexArray, array_record


@array_record
class ArrayState:
    """Where the model is linearised: all numbers of m sensors."""

    gain: FloatArray  # (m,): of each, over that of the largest one
    centres: FloatArray  # (m, 2), in m
    crosstalk: FloatArray  # (m, m), with ones on the diagonal
    drift: FloatArray  # (m, d), in V
    kernel: FloatArray  # (f,): of all, by its combination of the waves, in V/Pa
    own: FloatArray  # (m, o): sizes of each sensor's own changes of it


@array_record
class Noise:
    """Noise of m sensors: each one's own, and what the sensors of a board have in common."""

    own: FloatArray  # (m,): variance, in V^2
    common: FloatArray  # (m, m): covariance of sensors of one board, in V^2

    @property
    def covariance(self) -> FloatArray:
        """Covariance of one reading of each, (m, m), in V^2."""
        return np.diag(self.own) + self.common


@array_record
class Layout:
    """Places of the parameters: ln g of all but the largest, centres, c, drifts, own changes.

    Those of sensors that are not used are -1.
    """

    count: int
    near: BoolArray  # (m, m): neighbours, whose crosstalk has a mean of its own
    gains: IndexArray  # (m,): -1 of the largest, too
    centres: IndexArray  # (2, m): -1 across a line, too
    crosstalk: IndexArray  # (m, m): -1 where not estimated
    drift: IndexArray  # (m, d)
    own: IndexArray  # (m, o)

    @classmethod
    def of(
        cls, presses: Presses, scaled: BoolArray, pairs: BoolArray, near: BoolArray, own: int
    ) -> Layout:
        """Count the parameters of an array with gains (m,) and crosstalk (m, m) of some."""
        used = presses.used
        free = [
            scaled,
            used & np.isin([[0], [1]], presses.axes),
            pairs,
            # A sensor may have no readings in a pass.
            presses.keep.astype(float) @ (presses.drift != 0) > 0,
            np.tile(used[:, None], own),
        ]
        places = []
        count = 0
        for mask in free:
            numbers = np.full(mask.shape, -1)
            numbers[mask] = np.arange(count, count + mask.sum())
            count += int(mask.sum())
            places.append(numbers)
        return cls(count, near, *places)

    def moved(self, state: ArrayState, change: FloatArray) -> ArrayState:
        """Return a state changed by the parameters (p,)."""
        return replace(
            state,
            gain=state.gain * np.exp(taken(change, self.gains)),
            centres=state.centres + taken(change, self.centres).T,
            crosstalk=state.crosstalk + taken(change, self.crosstalk),
            drift=state.drift + taken(change, self.drift),
            own=state.own + taken(change, self.own),
        )


def taken(rows: FloatArray, numbers: IndexArray) -> FloatArray:
    """Return rows (p, ...) of an array by their numbers, and zero for those of -1."""
    return np.concatenate([rows, np.zeros_like(rows[:1])])[numbers]


@array_record
class JointModel:
    """Readings of an array of which pairs have crosstalk, with own changes of the kernels."""

    presses: Presses
    waves: Waves
    layout: Layout
    own_kernels: FloatArray  # (nodes, o): transforms of changes of a sensor's own kernel, in V/Pa
    gaussian: GaussianFit  # of the strongest sensor alone: shapes of G are departures from it
    forward: ForwardModel  # of that sensor

    @cached_property
    def gaussian_kernels(self) -> FloatArray:
        """Changes of the Gaussian's transform by A and by its width, (nodes, 2)."""
        return departure_basis(self.gaussian).kernels(self.forward.k)[:, :2]

    @property
    def start(self) -> FloatArray:
        """The Gaussian by its combination of the waves, (f,), in V/Pa."""
        kernel = self.waves.mix @ self.gaussian_kernels[:, 0]
        return np.asarray(self.gaussian.conversion_constant * kernel)

    @property
    def own(self) -> FloatArray:
        """These changes by their combinations of the waves, (f, o)."""
        return self.waves.mix @ self.own_kernels

    def distances(self, state: ArrayState) -> tuple[FloatArray, FloatArray]:
        """Distances of the presses from each centre, (m, t), and their slopes by it, (2, m, t)."""
        offset = self.presses.places[:, None] - state.centres.T[:, :, None]
        radius = np.hypot(*offset)
        return radius, -offset / np.where(radius > 0, radius, 1.0)

    def signals(self, state: ArrayState) -> tuple[FloatArray, FloatArray]:
        """What each sensor would read without crosstalk, (m, t), and its slope by the distance."""
        radius, _ = self.distances(state)
        kernels = state.kernel + state.own @ self.own.T
        signals = np.empty(radius.shape)
        slopes = np.empty(radius.shape)
        for j, distance in enumerate(radius):
            profile = self.waves.profiles(kernels[j])
            factor = state.gain[j] * self.presses.load
            signals[j] = factor * profile(distance)
            slopes[j] = factor * profile(distance, 1)
        return signals, slopes

    def predicted(self, state: ArrayState) -> FloatArray:
        """All readings, (m, t), in V."""
        signals, _ = self.signals(state)
        return state.crosstalk @ signals + state.drift @ self.presses.drift.T

    def residual(self, state: ArrayState) -> FloatArray:
        """Readings that are not explained, (m, t), in V; zero where not kept."""
        presses = self.presses
        return np.where(presses.keep, presses.u - self.predicted(state), 0.0)

    def information(self, state: ArrayState, noise: Noise, data: FloatArray) -> FloatArray:
        """Linearise about a state, with any kernel (f,) of all sensors, for residuals (m, t).

        Weighted sums of products of the residuals, of p parameters and of the kernel: one matrix.
        """
        presses = self.presses
        layout = self.layout
        p = layout.count
        q = len(self.waves.mix)
        radius, towards = self.distances(state)
        signals, slopes = self.signals(state)
        by_kernel = self.waves.profiles(np.hstack([np.eye(q), self.own]))(radius)
        by_kernel *= (state.gain[:, None] * presses.load)[:, :, None]
        # By what is each sensor's own, whichever sensors read it.
        sources = np.vstack(
            [signals[None], slopes * towards, np.moveaxis(by_kernel[..., q:], 2, 0)]
        )
        numbers = np.vstack([layout.gains, layout.centres, layout.own.T])
        common = self._common(noise, self.press_errors(state))
        gram = np.zeros((1 + p + q, 1 + p + q))
        shared = np.zeros((len(common), presses.load.size, 1 + p + q))
        for i in np.flatnonzero(presses.used):
            row = state.crosstalk[i]
            near = np.flatnonzero((row != 0) | (layout.crosstalk[i] >= 0))
            read = row[near, None] * sources[:, near]
            changes = np.vstack([presses.drift.T, signals[near], *read])
            of_all = np.tensordot(row[near], by_kernel[near, :, :q], 1)
            places = [layout.drift[i], layout.crosstalk[i, near], numbers[:, near].ravel()]
            parameters = np.concatenate(places)
            known = parameters >= 0
            root = presses.keep[i] / np.sqrt(noise.own[i])
            block = root[:, None] * np.column_stack([data[i], changes[known].T, of_all])
            index = np.concatenate([[0], 1 + parameters[known], np.arange(1 + p, 1 + p + q)])
            gram[np.ix_(index, index)] += block.T @ block
            for level, change in zip(shared, common, strict=True):
                level[:, index] += (root * change[i])[:, None] * block
        return gram - self._in_common(common, noise, shared)

    def by_press(self, state: ArrayState) -> FloatArray:
        """Derivatives of kept readings by the place along the scan and by ln load, (2, m, t)."""
        signals, slopes = self.signals(state)
        along = -slopes * self.distances(state)[1][self.presses.axes[0]]
        return np.stack([state.crosstalk @ along, state.crosstalk @ signals]) * self.presses.keep

    def press_errors(self, state: ArrayState) -> FloatArray:
        """What one standard deviation of the place and of the load of each press do, (2, m, t)."""
        stated = np.stack([self.presses.place_errors, self.presses.load_errors])
        return self.by_press(state) * stated[:, None]

    def _common(self, noise: Noise, errors: FloatArray) -> FloatArray:
        """What one deviation of each thing in common to a press does, (c, m, t), in V."""
        board = self.presses.board
        deviation = np.sqrt(np.diag(noise.common))
        boards = deviation * np.equal.outer(np.unique(board), board)
        at_each = np.repeat(boards[:, :, None], errors.shape[2], axis=2)
        changes = np.concatenate([at_each, errors])
        return changes[changes.any(axis=(1, 2))]

    def _in_common(self, common: FloatArray, noise: Noise, shared: FloatArray) -> FloatArray:
        """What readings of a press that share their errors tell less, by Woodbury's identity."""
        weight = self.presses.keep / noise.own[:, None]
        inner = np.einsum("amt,bmt,mt->tab", common, common, weight) + np.eye(len(common))
        root = np.linalg.cholesky(inner)
        columns = np.linalg.solve(root, np.moveaxis(shared, 0, 1))
        flat = columns.reshape(-1, shared.shape[2])
        return flat.T @ flat
