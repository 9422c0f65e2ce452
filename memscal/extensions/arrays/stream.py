r"""Contacts in a stream of frames, while the baselines drift under them.

The baselines b are tracked in blocks of 0.2 s by a Kalman filter, in which a contact is a diffuse
nuisance.  With P the covariance of b, R that of the noise of a block's mean and H(r) the readings
per newton of a contact at r:

.. math::

    P \leftarrow P + Q, \quad S = P + R, \quad e = \bar u - b, \quad
    z(r) = \frac{H^T S^{-1} e}{\sqrt{H^T S^{-1} H}}

A frame has a contact if z exceeds 6 at a node of a grid of places; that of a block is kept out of
the baselines from 3.5 on.  With J = [H_x, H_y, H] where it stays, and M = S^-1 without a contact,

.. math::

    M = S^{-1} - S^{-1} J (J^T S^{-1} J)^{-1} J^T S^{-1}, \quad
    b \leftarrow b + P M e, \quad P \leftarrow P - P M P .

The place of J is a mean over all blocks in which a contact stays.  At that of each block by itself,
with its noise, the filter would believe to see more and more of what the contact hides.

Drift is common to all sensors and a contact is local: that separates them, and not a constant of
time.  The random walks have :math:`Q = q_c 1 1^T + q I`; the filter runs at several strengths of
them at once, and the one under which the readings are most probable holds.
"""

from __future__ import annotations

from collections.abc import Mapping
from copy import deepcopy
from dataclasses import replace
from enum import IntFlag
from types import SimpleNamespace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import chdtri

from memscal.errors import InputError
from memscal.extensions.arrays.array_data import ArrayData
from memscal.extensions.arrays.locate import (
    Seeking,
    Touch,
    at_an_end,
    columns_of,
    patterns,
)
from memscal.model.arrays import (
    ArrayPair,
    BoolArray,
    Columns,
    FloatArray,
    IndexArray,
    array_record,
    floats,
    frozen_array,
    require_non_negative,
    require_positive,
)
from memscal.model.checks import FALSE_ALARM

#: Duration of a block of the filter, in s.  A sensor is stuck if it is unchanged for longer than
#: the other time, and so many blocks, from the beginning of the block of its last change.
_BLOCK = 0.2
_PATIENCE = 1.1
_PATIENT_BLOCKS = 2.5
#: A sensor counts in a block if it reads in this share of the frames that any sensor reads in.
_FRAMES = 0.9
#: Contacts are sought so many thicknesses beyond the sensors, on a grid of this step; each of three
#: steps of Gauss-Newton from its best node is at most a step of the grid.
_MARGIN = 1.0
_STEP = 0.5
#: Slopes of the readings are taken to be the same of contacts whose places differ by less of a
#: thickness, and their forces of each other; digits of places and forces in one number.
_ALIKE = 1 / 32
_DIGITS = 2.0 ** np.array([0, 20, 40])
#: Significance at which a frame has a contact, which noise alone has in one of ten million, and at
#: which that of a block is kept out of the baselines: long before it is seen in a frame.
_FOUND = 6.0
_SPARED = 3.5
#: A contact has moved if its place differs from the mean by so many standard uncertainties.
_MOVED = 4.0
#: Random walks of single sensors in 1 s, over the array's largest reading; the common one over it.
#: The first holds until the readings tell.
_STRENGTHS = np.array([0.04, 0.008, 0.2]) / 100
_COMMON = 10.0
#: Share of the evidence for a strength that a block leaves: it fades in 10 minutes.
_KEPT = 1 - _BLOCK / 600
#: Share of chi-square that a contact need not explain: errors of the array, size and shear of it.
_MISFIT = 1e-3
#: Standard deviation of what is not known, baselines and readings, in largest readings.
_UNKNOWN = 100.0
#: Share of the blocks that one sensor alone contradicts, at which it is dropped; weight of the
#: newest in it: after most of a second.
_DROPPED = 0.5
_NEWEST = 0.2
#: How many sensors are tried by a fit without each, of those that one fit with all doubts most.
_SUSPECTS = 6


class FrameFlag(IntFlag):
    """What is to be said of a frame; the flags add up."""

    NO_READING = 1
    """Too few sensors with a known baseline to find a contact."""
    MISSING = 2
    """A reading is NaN."""
    SATURATED = 4
    """A reading is at an end of its range, and left out."""
    EDGE = 8
    """The contact is outside the sensors."""
    DROPPED = 16
    """A sensor is left out: dead in the calibration, stuck, or it contradicts all others."""
    TWO_CONTACTS = 32
    """One contact does not explain the readings."""


#: What is known of a frame.
FRAME = np.dtype(
    {
        "names": ["t", "contact", "x", "y", "force", "covariance", "chi2", "flags"],
        "formats": ["f8", "?", "f8", "f8", "f8", "(3,3)f8", "f8", "i8"],
    }
)


@array_record
class _Fit:
    """What readings (m, n) say of one contact each; f of them have one, of c parameters."""

    rows: IndexArray  # (f,): which
    node: IndexArray  # (f,): of the grid, near the place
    place: FloatArray  # (f, 2), in m
    force: FloatArray  # (f,), in N
    chi2: FloatArray  # (m,)
    covariance: FloatArray  # (f, c, c): of force times x (and y), and of force


class Stream:
    """Contacts in frames that arrive; made by :meth:`SensorArray.stream`."""

    Flag = FrameFlag
    """Names of the bits of the field ``flags`` of a record."""

    def __init__(
        self,
        array: ArrayData,
        rate: float,
        limit: tuple[ArrayLike, ArrayLike] | None,
        drift: tuple[float, float] | None,
        indenter: Touch,
    ) -> None:
        require_positive("rate", rate, "Hz")
        if limit is not None:
            low, high = _limits(limit, len(array.sensors))
            array = replace(array, reading_low=low, reading_high=high)
        self._array = array
        self._rate = rate
        self._length = max(1, round(_BLOCK * rate))
        self._patience = max(_PATIENCE, _PATIENT_BLOCKS * self._length / rate)
        self._seeking = Seeking.on(array, indenter, 0.0, _MARGIN)
        self._told = np.array([*self._seeking.axes, 2])
        self._sensors = self._seeking.fields.sensors
        if self._sensors.size <= self._told.size:
            raise InputError(
                f"{self._sensors.size} sensors of the array work, too few for a stream.",
                why="With as many as a contact has unknowns any drift is one.",
                cure="Use locate with readings at rest.",
            )
        self._nodes = self._seeking.grid(_STEP)
        self._grid = self._slopes(self._nodes, array.load)
        self._errors: dict[int, ArrayPair] = {}
        self._noise = array.noise[np.ix_(self._sensors, self._sensors)]
        peak = array.load * self._grid[:, -1].max()
        self._unknown = (_UNKNOWN * peak) ** 2
        walks = peak * np.multiply.outer([_COMMON, 1.0], _STRENGTHS)
        if drift is not None:
            walks = _drift(drift)[:, None]
        common, own = walks[..., None, None] ** 2 * self._length / rate
        n = self._sensors.size
        self._walk = common + own * np.eye(n)
        fields = self._grid.sum(), self._noise.sum()
        ends = np.full((2, len(array.sensors)), [[-np.inf], [np.inf]])
        for end, stated in zip(ends, (array.reading_low, array.reading_high), strict=True):
            end[:] = end if stated is None else stated
        self._now = SimpleNamespace(
            made=np.array([rate, *fields, *walks.sum(axis=1), *ends.ravel()]),
            frames=np.array(0),
            last=np.zeros(n),
            # Of the current block.
            sums=np.zeros(n),
            counts=np.zeros(n),
            # Seconds, and the share of blocks that a sensor alone contradicts.
            unchanged=np.zeros(n),
            doubt=np.zeros(n),
            # Mean place of a contact that stays, and 1 over its variance; 0 without one.
            place=np.zeros(2),
            sureness=np.array(0.0),
            # By strength of the drift; a baseline that is not known is NaN.
            baselines=np.full((own.size, n), np.nan),
            covariance=np.zeros((own.size, n, n)),
            evidence=np.zeros(own.size),
        )

    @property
    def left_out(self) -> dict[str, str]:
        """Why sensors are left out at present, by their names."""
        sensors = self._array.sensors
        reasons = np.full(len(sensors), "dead in the calibration")
        stuck = self._stuck
        reason = np.where(stuck, "unchanged for 1 s", "contradicts all others")
        reasons[self._sensors] = np.where(self._dropped, reason, "")
        return {
            name: reason for name, reason in zip(sensors, reasons.tolist(), strict=True) if reason
        }

    def push(self, block: ArrayLike) -> NDArray[Any]:
        """Take frames, and return what presses in each of them.

        Parameters
        ----------
        block : array_like, shape (m, n)
            Readings of the n sensors of the array in their order, in V; NaN is missing.  Any m.

        Returns
        -------
        ndarray, shape (m,)
            A record a frame: ``t`` (s, since the first frame), ``contact``, ``x`` and ``y`` (m;
            NaN without a contact), ``force`` (N; 0 without), ``covariance`` (3, 3) of x, y and
            force by noise, baselines and array, ``chi2``, and ``flags``
            (:class:`FrameFlag`).

        Raises
        ------
        InputError
            If the block does not have a column for each sensor.
        """
        readings = columns_of(self._array, block, "block")
        records = np.zeros(len(readings), FRAME)
        start = 0
        while start < len(readings):
            stop = start + self._length - self._now.frames % self._length
            self._take(readings[start:stop], records[start:stop])
            if self._now.frames % self._length == 0:
                self._finish_block()
            start = stop
        return records

    def state(self) -> Columns:
        """Return what the stream remembers, as arrays by their names."""
        return deepcopy(vars(self._now))

    def restore(self, state: Columns) -> None:
        """Continue where a stream of the same array and arguments had this state.

        Raises
        ------
        InputError
            If the state is not of such a stream.
        """
        now = vars(self._now)
        stated: Any = state
        stated = stated if isinstance(stated, Mapping) else {}
        given: Any = {name: frozen_array(stated.get(name, [[]])) for name in now}
        fits = all(given[name].shape == value.shape for name, value in now.items())
        # What it was made with: rate, fields, noise, drift and limits.
        if not (fits and given["frames"] >= 0) or not np.allclose(
            given["made"], self._now.made, rtol=1e-6, atol=0.0, equal_nan=True
        ):
            raise InputError("The state is not of a stream of this array and these arguments.")
        for name, value in now.items():
            value[...] = given[name]

    @property
    def _dropped(self) -> BoolArray:
        """Which of the used sensors are left out."""
        dropped: BoolArray = self._stuck | (self._now.doubt >= _DROPPED)
        return dropped

    @property
    def _stuck(self) -> BoolArray:
        """Which of the used sensors have not changed for too long."""
        stuck: BoolArray = self._now.unchanged > self._patience
        return stuck

    def _take(self, given: FloatArray, records: NDArray[Any]) -> None:
        """Fill the records of frames within one block of the filter."""
        now = self._now
        saturated = at_an_end(self._array, given, tared=False)[:, self._sensors]
        readings = given[:, self._sensors]
        missing = ~np.isfinite(readings)
        valid = ~(missing | saturated)
        # At an end of its range a sound sensor does not change, and keeps its baseline.
        changed = (saturated | (readings != np.vstack([now.last, readings[:-1]]))).any(axis=0)
        now.unchanged[changed] = 0.0
        now.last[:] = readings[-1]
        now.sums += np.where(valid, readings, 0.0).sum(axis=0)
        now.counts += valid.sum(axis=0)

        records["t"] = (now.frames + np.arange(len(records))) / self._rate
        now.frames += len(records)
        for name in ("x", "y", "covariance"):
            records[name] = np.nan
        best = now.evidence.argmax()
        known = np.isfinite(now.baselines[best])
        records["flags"] = (
            FrameFlag.MISSING * missing.any(axis=1)
            + FrameFlag.SATURATED * saturated.any(axis=1)
            + FrameFlag.DROPPED * bool(self._dropped.any() or not self._array.used.all())
        )
        covariance = now.covariance[best] + self._walk[best] + self._noise
        deviations = readings - now.baselines[best]
        for seen, frames in patterns(valid & known):
            freedom = seen.sum() - self._told.size
            # Of as few the baselines do not follow either.
            if freedom < 1:
                records["flags"][frames] |= FrameFlag.NO_READING
                records["force"][frames] = np.nan
                continue
            weight = floats(np.linalg.inv(covariance + self._unknown * np.diag(~seen)))
            fit = self._fit(np.where(seen, deviations[frames], 0.0), weight, _FOUND)
            records["chi2"][frames] = fit.chi2
            rows = frames[fit.rows]
            records["contact"][rows] = True
            records["x"][rows], records["y"][rows] = fit.place.T
            records["force"][rows] = fit.force
            # Of force times place, and of force; then of place.
            force = fit.force[:, None, None]
            nodes, of = np.unique(fit.node, return_inverse=True)
            shares = [self._errors_at(node)[1] for node in nodes]
            by_array = np.reshape(shares, (-1, *fit.covariance.shape[1:]))[of]
            total = fit.covariance + by_array * force**2
            explained = fit.force**2 / total[:, -1, -1]
            limit = np.maximum(chdtri(freedom, FALSE_ALARM), _MISFIT * explained)
            total[:, :-1] /= force
            total[..., :-1] /= force
            records["covariance"][np.ix_(rows, self._told, self._told)] = total
            two = FrameFlag.TWO_CONTACTS * (fit.chi2[fit.rows] > limit)
            records["flags"][rows] |= two + FrameFlag.EDGE * (self._seeking.outside(fit.place) > 0)

    def _slopes(self, place: FloatArray, force: FloatArray | float) -> FloatArray:
        """Return changes of readings by force times x (and y), and by force, (m, c, n)."""
        slopes = self._seeking.fields.normal(place, force)[self._told]
        return floats(slopes.swapaxes(0, 1))

    def _fit(self, deviations: FloatArray, weight: FloatArray, threshold: float) -> _Fit:
        """Find one contact in each of some deviations from the baselines."""
        grid = self._grid[:, -1]
        filtered = grid @ weight
        size = np.sqrt(np.sum(filtered * grid, axis=1))
        significance = deviations @ filtered.T / size
        node = significance.argmax(axis=1)
        rows = np.flatnonzero(significance.max(axis=1) > threshold)
        node = node[rows]
        force = significance[rows, node] / size[node]
        least = force / 10
        found = deviations[rows]
        nodes, like = np.unique(node, return_inverse=True)
        _, step = _linear_step(self._grid[nodes], like, weight, found)
        place, force = self._moved(self._nodes[node], step, least)
        start, like = self._alike(place, force)
        jacobian = self._slopes(*start)
        covariance, step = _linear_step(jacobian, like, weight, found)
        place, force = self._moved(start[0][like], step, least)
        # Of the last step the readings are those of its place, and the slopes of one like it.
        residual = deviations.copy()
        residual[rows] -= force[:, None] * self._seeking.fields.value(place, force)
        weighted = residual @ weight
        slope = np.einsum("fin,fn->fi", jacobian[like], weighted[rows])
        step = np.einsum("fij,fj->fi", covariance, slope)
        chi2 = np.sum(weighted * residual, axis=1)
        chi2[rows] -= np.sum(step * slope, axis=1)
        step[:, -1] += force
        place, force = self._moved(place, step, least)
        return _Fit(rows, node, place, force, chi2, covariance)

    def _alike(self, place: FloatArray, force: FloatArray) -> tuple[ArrayPair, IndexArray]:
        """Return the places and forces that are not alike, and which of them is like each one."""
        low = self._seeking.low
        cell = _ALIKE * self._seeking.thickness
        contacts = np.round(np.column_stack([(place - low) / cell, np.log(force) / _ALIKE]))
        # One number is sorted ten times faster than three.
        _, first, like = np.unique(contacts @ _DIGITS, return_index=True, return_inverse=True)
        x, y, level = contacts[first].T
        return (low + cell * np.stack([x, y], axis=1), np.exp(_ALIKE * level)), like

    def _moved(self, place: FloatArray, step: FloatArray, least: FloatArray) -> ArrayPair:
        """Return places and forces after steps of force times x (and y), to a force."""
        force = np.maximum(step[:, -1], least)
        longest = _STEP * self._seeking.thickness
        moved = place.copy()
        moved[:, self._seeking.axes] += np.clip(step[:, :-1] / force[:, None], -longest, longest)
        return np.clip(moved, self._seeking.low, self._seeking.high), force

    def _errors_at(self, node: int) -> ArrayPair:
        """Return what errors of the array do to a contact of 1 N at a node of the grid.

        Covariances of readings in V^2, (n, n), and of x (and y) in m and force in N, (c, c).
        """
        if node not in self._errors:
            contact = self._nodes[[node]], np.ones(1), np.zeros((1, 2))
            [root] = self._seeking.fields.errors(*contact)
            slopes = self._grid[node].T
            weighted = np.linalg.solve(self._noise, slopes)
            moved = np.linalg.solve(slopes.T @ weighted, weighted.T @ root)
            self._errors[node] = root @ root.T, moved @ moved.T
        return self._errors[node]

    def _finish_block(self) -> None:
        """Move the baselines by the means of a block."""
        now = self._now
        counts = np.maximum(now.counts, 1)
        mean = now.sums / counts
        now.unchanged += self._length / self._rate
        dropped = self._dropped
        now.baselines[:, dropped] = np.nan
        # A mean over other frames than those of the others would be of another force.
        least = max(_FRAMES * now.counts.max(), self._length / 2)
        seen = ~dropped & (now.counts >= least)
        begin = seen & np.isnan(now.baselines[0])
        now.baselines[:, begin] = mean[begin]
        now.covariance += self._walk
        now.covariance *= np.multiply.outer(~begin, ~begin)
        now.covariance += self._unknown * np.diag(begin)
        if seen.sum() > self._told.size:
            noise = self._noise / np.sqrt(np.multiply.outer(counts, counts))
            self._update(np.where(seen, mean - now.baselines, 0.0), noise, seen)
        now.sums[:] = 0.0
        now.counts[:] = 0.0

    def _update(self, deviations: FloatArray, noise: FloatArray, seen: BoolArray) -> None:
        """Move the baselines by deviations (strengths, n) from them."""
        now = self._now
        best = now.evidence.argmax()
        summed = now.covariance + noise + self._unknown * np.diag(~seen)
        fit = self._fit(deviations[[best]], np.linalg.inv(summed[best]), _SPARED)
        # Slopes of a place nearby would let what they miss into the baselines, block by block.
        jacobian = self._slopes(self._stays(fit), fit.force).reshape(-1, seen.size)
        for node in fit.node:
            summed += fit.force**2 * self._errors_at(node)[0]
        weight = np.linalg.inv(summed)
        filtered = weight @ jacobian.T
        information = jacobian @ filtered
        weight -= filtered @ np.linalg.inv(information) @ filtered.swapaxes(1, 2)
        pulls = np.einsum("sij,sj->si", weight, deviations)
        chi2 = np.sum(pulls * deviations, axis=1)

        freedom = seen.sum() - len(jacobian)
        limit = chdtri(freedom, FALSE_ALARM)
        # What chi-square loses without one of the sensors.
        alone = pulls[best] ** 2 / np.diag(weight[best])
        now.doubt[seen] *= 1 - _NEWEST
        if chi2[best] < limit:
            determinants = np.linalg.slogdet(summed)[1] + np.linalg.slogdet(information)[1]
            now.evidence = _KEPT * now.evidence - (chi2 + determinants) / 2
        elif freedom > 1:
            self._doubt(deviations[[best]], summed[best], alone.argsort()[-_SUSPECTS:], limit)

        # What one contact does not explain moves the baselines less.
        share = (limit / np.maximum(chi2, limit))[:, None, None]
        gain = share * now.covariance @ weight
        now.baselines += np.einsum("sij,sj->si", gain, deviations)
        now.covariance -= gain @ now.covariance
        # By rounding alone it would grow asymmetric, from block to block.
        now.covariance = (now.covariance + now.covariance.swapaxes(1, 2)) / 2

    def _doubt(
        self, deviations: FloatArray, summed: FloatArray, suspects: IndexArray, limit: float
    ) -> None:
        """Doubt the sensor without which one contact, fitted anew, explains the deviations best."""
        left = np.zeros(suspects.size)
        for i, suspect in enumerate(suspects):
            without = summed.copy()
            without[suspect, suspect] += self._unknown
            left[i] = self._fit(deviations, floats(np.linalg.inv(without)), _SPARED).chi2[0]
        if left.min() < limit:
            self._now.doubt[suspects[left.argmin()]] += _NEWEST

    def _stays(self, fit: _Fit) -> FloatArray:
        """Return the mean place of a block's contact and what it was before, (f, 2), f = 0 or 1."""
        now = self._now
        if fit.rows.size == 0:
            now.sureness[...] = 0.0
            return fit.place
        variance = np.trace(fit.covariance[0, :-1, :-1]) / fit.force[0] ** 2
        [away] = fit.place - now.place
        if away @ away > _MOVED**2 * variance:
            now.sureness[...] = 0.0
        now.sureness += 1 / variance
        now.place += away / (variance * now.sureness)
        return floats(now.place[None].copy())


def _limits(limit: tuple[ArrayLike, ArrayLike], count: int) -> ArrayPair:
    """Return the lowest and the highest readings, each of all sensors."""
    try:
        low, high = (np.broadcast_to(floats(end), count) for end in limit)
    except (TypeError, ValueError):
        raise InputError(
            f"The limits are {limit}, but two are needed, each of one or of {count} numbers."
        ) from None
    if not np.all(low < high):
        raise InputError(f"The limits are {low} and {high}; the lower one is needed first.")
    return low, high


def _drift(drift: tuple[float, float]) -> FloatArray:
    """Return the drift in common and of each sensor, (2,)."""
    try:
        walks = floats(drift)
    except (TypeError, ValueError):
        walks = np.zeros(0)
    if walks.shape != (2,):
        raise InputError(f"The drift is {drift}, but two numbers are needed: common, and own.")
    for walk in walks:
        require_non_negative("A drift", walk)
    return walks


def _linear_step(
    jacobian: FloatArray, like: IndexArray, weight: FloatArray, deviations: FloatArray
) -> ArrayPair:
    """Return covariances (f, c, c) and changes (f, c), by force times x (and y), and by force.

    Of deviations (f, n) whose slopes (u, c, n) are those of the contact that each is like.
    """
    filtered = jacobian @ weight
    covariance = floats(np.linalg.inv(filtered @ jacobian.swapaxes(1, 2)))[like]
    # A product with one large matrix is faster than one with each small one.
    slopes = deviations @ filtered.reshape(-1, len(weight)).T
    slope = slopes.reshape(len(like), *jacobian.shape[:2])[np.arange(like.size), like]
    return covariance, floats(np.einsum("fij,fj->fi", covariance, slope))
