r"""Place and force of a contact on an array, frame by frame.

The readings are :math:`u = P\,[H(r) + q_x S_x(r) + q_y S_y(r)] + n` with the receptive fields
:mod:`~memscal.extensions.arrays.receptive_fields`, the ratios q of shear to normal force, and noise
of the array's covariance.  The largest :math:`z = h^T u / |h|` of whitened fields on a grid of
places tells whether there is a contact; damped Gauss-Newton steps from the three best places that
are a thickness apart minimise

.. math::

    |u - P\,(H + q \cdot S)|^2 + |q|^2/s^2

with the prior standard deviation s of the ratios, for shear moves the readings as another place
does.  A last step weighs the readings by their noise and the array's own errors, to first order.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import compress
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc

from memscal.errors import InputError
from memscal.extensions.arrays.array_data import ArrayData
from memscal.extensions.arrays.contacts import Contacts
from memscal.extensions.arrays.measured_fields import MeasuredFields
from memscal.extensions.arrays.receptive_fields import MARGIN, receptive_fields
from memscal.model.arrays import (
    ArrayPair,
    ArrayTriple,
    BoolArray,
    FloatArray,
    IndexArray,
    array_record,
    floats,
    frozen_array,
    require_non_negative,
    require_size,
    slices,
)
from memscal.model.checks import FALSE_ALARM
from memscal.model.indenter import Rod, RoundIndenter, Sphere

DETECTED = 5.0
"""A contact is seen where its amplitude is so many standard deviations of the noise."""

#: Step of the grid on which a contact is sought, in thicknesses; how many starts; frames at once.
_STEP = 0.25
_STARTS = 3
_BATCH = 200
#: Places of the grid count less where the sensors see a smaller share of what they see at most.
_SEEN = 1e-3
#: Steps of a fit; its damping at first, and by what factors it changes.
_STEPS = 30
_DAMPING = 1e-3
_LESS = 0.2
_MORE = 5.0
#: Sensors lie on a line if they are apart from it by less of the film's thickness.
_ON_A_LINE = 0.1
#: Prior standard deviation of the distance from the sensors' box, in thicknesses: by little noise a
#: huge force far outside is as likely as a contact.
_OUTSIDE = 0.5
#: Forces are above this, in N.
_LEAST = 1e-9

Touch = str | RoundIndenter
"""What presses: ``"point"``, a rod, or a sphere."""


@array_record
class Seeking:
    """How contacts are sought: fields, which of x and y they tell, the region in m, the noise.

    States (m, 5) are rows of x, y, force, and the shears over it in units of their prior.
    """

    fields: Any  # ReceptiveFields, or MeasuredFields
    axes: list[int]  # which of x and y the sensors tell; the other one is that of the row
    shear: float
    low: FloatArray  # (2,)
    high: FloatArray
    thickness: float
    near: float  # prior standard deviation of the distance from the sensors' box, in m
    whitener: FloatArray  # (s, n): makes white what s of the n sensors read

    @classmethod
    def on(cls, array: ArrayData, indenter: Touch, shear: float, margin: float = MARGIN) -> Seeking:
        """Return how contacts are sought on an array, up to so many thicknesses outside it."""
        require_non_negative("shear", shear)
        require_size("shear", shear)
        fields = fields_of(array, indenter)
        if array.kernel == "measured":
            # Only presses like those of the scan are known, and no place beyond it.
            h = fields.scale
            margin = 0.0
            shear = 0.0
        else:
            h = array.film.thickness
            _refuse_slanted(fields.centres, _ON_A_LINE * h)
        told = np.ptp(fields.centres, axis=0) > _ON_A_LINE * h
        told[0] |= not told[1]
        beyond = told * margin * h
        return cls(
            fields=fields,
            axes=np.flatnonzero(told).tolist(),
            shear=shear,
            low=fields.centres.min(axis=0) - beyond,
            high=fields.centres.max(axis=0) + beyond,
            thickness=h,
            near=_OUTSIDE * h,
            whitener=_whitener(array.noise, fields.sensors, fields.sensors),
        )

    def grid(self, step: float = _STEP) -> FloatArray:
        """Places on which contacts are sought first, so many thicknesses apart, (g, 2), in m."""
        counts = 1 + np.ceil((self.high - self.low) / (step * self.thickness)).astype(int)
        x, y = (np.linspace(*ends) for ends in zip(self.low, self.high, counts, strict=True))
        return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)

    def outside(self, places: FloatArray) -> FloatArray:
        """Distances (m) of places from the box of the sensors."""
        return floats(np.linalg.norm(self.beyond(places), axis=1))

    def beyond(self, places: FloatArray) -> FloatArray:
        """Offsets (m) of places from the box of the sensors, (m, 2)."""
        centres = self.fields.centres
        return places - np.clip(places, centres.min(axis=0), centres.max(axis=0))

    def contact(self, state: FloatArray) -> ArrayTriple:
        """Return places, forces and shears over forces of states."""
        return state[:, :2], state[:, 2], self.shear * state[:, 3:]

    def starts(
        self, u: FloatArray, grid: FloatArray, fields: FloatArray
    ) -> tuple[BoolArray, FloatArray, FloatArray]:
        """Return in which frames (m, s) a contact is seen, and three states of each to begin at.

        The third are the least chi-squares of these at places outside.
        """
        tuned = fields @ self.whitener.T
        size = np.linalg.norm(tuned, axis=1)
        size = np.maximum(size, _SEEN * size.max())
        score = u @ (tuned / size[:, None]).T
        seen = score.max(axis=1) > DETECTED
        score = score[seen]
        away = self.outside(grid)
        outside = score.max(axis=1, where=away > self.near, initial=0.0)
        states = np.zeros((len(score), _STARTS, 5))
        for i in range(_STARTS):
            # Far outside huge forces fit as well as a node that is beside the place: the first
            # start is among the sensors.
            sought = score if i else np.where(away > 0, -np.inf, score)
            best = sought.argmax(axis=1)
            states[:, i, :2] = grid[best]
            states[:, i, 2] = np.maximum(sought.max(axis=1) / size[best], _LEAST)
            apart = np.linalg.norm(grid - grid[best, None], axis=-1)
            score[apart < self.thickness] = -np.inf
        return seen, states, np.sum(u[seen] ** 2, axis=1) - outside**2

    def fitted(self, u: FloatArray, starts: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return the states of least chi-square of frames (m, s), by damped Gauss-Newton steps.

        And whether a state elsewhere is not excluded, worse by less than what a contact is seen by.
        """
        u = np.repeat(u, _STARTS, axis=0)
        state = starts.reshape(-1, 5)
        damping = np.full(len(state), _DAMPING)
        residual, slopes = self.rows(u, state)
        for _ in range(_STEPS):
            step, _ = steps(residual, slopes, damping)
            trial = self.moved(state, step)
            there, bent = self.rows(u, trial)
            better = np.sum(there**2, axis=1) < np.sum(residual**2, axis=1)
            damping *= np.where(better, _LESS, _MORE)
            state[better] = trial[better]
            residual[better] = there[better]
            slopes[better] = bent[better]
        square = np.sum(residual**2, axis=1).reshape(-1, _STARTS)
        states = state.reshape(-1, _STARTS, 5)
        best = states[np.arange(len(states)), square.argmin(axis=1)]
        apart = np.linalg.norm((states - best[:, None])[..., :2], axis=-1)
        close = square < square.min(axis=1, keepdims=True) + DETECTED**2
        return best, np.any(close & (apart > self.near), axis=1)

    def judged(self, u: FloatArray, state: FloatArray) -> ArrayTriple:
        """Return states, covariances (m, 3, 3) and chi-squares by noise and the array's errors."""
        residual, slopes = self.rows(u, state)
        errors = self.whitener @ self.fields.errors(*self.contact(state))
        s = u.shape[1]
        root = np.linalg.cholesky(np.eye(s) + errors @ errors.swapaxes(1, 2))
        both = np.concatenate([residual[..., None], slopes], axis=-1)
        both[:, :s] = np.linalg.solve(root, both[:, :s])
        residual, slopes = both[..., 0], both[..., 1:]
        step, inverse = steps(residual, slopes)
        square = np.sum((residual - np.einsum("mrf,mf->mr", slopes, step)) ** 2, axis=1)
        return self.moved(state, step), self.covariance(inverse), floats(square)

    def covariance(self, inverse: FloatArray) -> FloatArray:
        """Return covariances (m, 3, 3) of x, y and force; NaN where the sensors do not tell."""
        told = np.array([*self.axes, 2])
        covariance = np.full((len(inverse), 3, 3), np.nan)
        covariance[:, told[:, None], told] = inverse[:, : told.size, : told.size]
        return covariance

    def moved(self, state: FloatArray, step: FloatArray) -> FloatArray:
        """Return states after a step, in the region and with a force above zero."""
        moved = state.copy()
        moved[:, self._free] += step
        moved[:, :2] = np.clip(moved[:, :2], self.low, self.high)
        moved[:, 2] = np.maximum(moved[:, 2], _LEAST)
        return moved

    def rows(self, u: FloatArray, state: FloatArray) -> ArrayPair:
        """Return residuals (m, s + 4) of standard deviation one, and derivatives of what they miss.

        The last four are those of the priors: places near the box of the sensors, small shears.
        """
        value, slopes = self.fields.forward(*self.contact(state))
        slopes[..., 3:] *= self.shear
        away = np.column_stack([self.beyond(state[:, :2]) / self.near, state[:, 3:]])
        weight = np.ones_like(away)
        weight[:, :2] = (away[:, :2] != 0) / self.near
        prior = weight[..., None] * np.eye(5)[[0, 1, 3, 4]]
        slopes = np.concatenate([self.whitener @ slopes, prior], axis=1)
        residual = np.concatenate([u - value @ self.whitener.T, -away], axis=1)
        return residual, floats(slopes[..., self._free])

    @property
    def _free(self) -> list[int]:
        return [*self.axes, 2, 3, 4]


def fields_of(array: ArrayData, indenter: Touch) -> Any:
    """Return the fields of an array under what presses."""
    if not (indenter == "point" or isinstance(indenter, Rod | Sphere)):
        raise InputError(
            f"The indenter is {indenter!r}.",
            why="Receptive fields are calculated under a point, a rod, or a sphere.",
            cure='Give "point", memscal.Rod(radius=...) or memscal.Sphere(radius=...).',
        )
    if array.kernel == "measured":
        return MeasuredFields(array)
    return receptive_fields(array, None if isinstance(indenter, str) else indenter)


def _refuse_slanted(centres: FloatArray, tolerance: float) -> None:
    """Refuse a row that is along neither x nor y, by more than a tolerance in m."""
    away = centres - centres.mean(axis=0)
    across, along = np.linalg.eigh(away.T @ away)[1].T
    if np.ptp(away @ across) < tolerance < np.ptp(away, axis=0).min():
        angle = np.degrees(np.arctan(along[1] / along[0]))
        raise InputError(
            f"The sensors that are used lie in a row at {angle:.3g} degrees to x.",
            why="A row does not tell how far beside it a contact presses: x and y are not known.",
            cure="Turn the coordinates x and y of the scan so that the row lies along one of them.",
        )


def _whitener(noise: FloatArray, sensors: IndexArray, read: IndexArray) -> FloatArray:
    """Return what makes white the noise of some of the sensors; what others read has no weight."""
    root = np.linalg.cholesky(noise[np.ix_(read, read)])
    return floats(np.linalg.solve(root, np.equal.outer(read, sensors)))


def steps(residual: FloatArray, slopes: FloatArray, damping: FloatArray | float = 0.0) -> ArrayPair:
    """Return damped Gauss-Newton steps (m, f) of rows, and inverses of the normal equations."""
    normal = slopes.swapaxes(1, 2) @ slopes
    more = np.reshape(damping, (-1, 1, 1)) * np.eye(normal.shape[1])
    inverse = floats(np.linalg.inv(normal * (1 + more)))
    return np.einsum("mfg,mrg,mr->mf", inverse, slopes, residual, optimize=True), inverse


def locate(
    array: ArrayData,
    u: ArrayLike,
    indenter: Touch = "point",
    shear: float = 0.3,
    rest: ArrayLike | None = None,
) -> Contacts:
    """Find place and force of a contact in each frame: :meth:`SensorArray.locate`."""
    seeking = Seeking.on(array, indenter, shear)
    fields = seeking.fields
    readings = columns_of(array, u, "u")
    zero, scatter = _zero(array, rest, readings)
    saturated = at_an_end(array, readings, tared=rest is None)
    values = np.where(saturated, np.nan, readings - zero)[:, fields.sensors]
    state = np.full((len(values), 5), np.nan)
    covariance = np.full((len(values), 3, 3), np.nan)
    p_value = np.full(len(values), np.nan)
    outside, ambiguous, sought = np.zeros((3, len(values)), bool)
    grid = seeking.grid()
    on_grid = fields.value(grid)
    for kept, frames in patterns(np.isfinite(values)):
        if kept.sum() <= len(seeking.axes):
            continue
        sought[frames] = True
        read = fields.sensors[kept]
        whitener = _whitener(array.noise + scatter, fields.sensors, read)
        some = replace(seeking, whitener=whitener)
        for part in slices(frames.size, _BATCH):
            u = np.nan_to_num(values[frames[part]]) @ whitener.T
            seen, starts, elsewhere = some.starts(u, grid, on_grid)
            of = frames[part][seen]
            best, ambiguous[of] = some.fitted(u[seen], starts)
            state[of], covariance[of], square = some.judged(u[seen], best)
            # Not excluded is what is worse by less than what a contact is seen by.
            outside[of] = elsewhere < square + DETECTED**2
            # Of as many readings as there are unknowns chi-square says nothing.
            p_value[of] = chdtrc((kept.sum() - len(seeking.axes) - 1) or np.nan, square)
    places, force, ratios = seeking.contact(state)
    blank = ~np.isfinite(readings).any(axis=1)
    said = {
        "no reading": blank,
        "too few readings": ~sought & ~blank,
        "no contact": sought & np.isnan(force),
        "saturated": saturated[:, fields.sensors].any(axis=1),
        "edge": outside | (seeking.outside(places) > seeking.near),
        "strong": force > fields.most,
        "ambiguous": ambiguous,
        "misfit": p_value < FALSE_ALARM,
    }
    rows = np.transpose([*said.values()])
    return Contacts(
        x=places[:, 0],
        y=places[:, 1],
        force=force,
        radius=fields.radius(force),
        shear=force[:, None] * ratios,
        covariance=covariance,
        p_value=p_value,
        flags=tuple("; ".join(compress(said, row)) for row in rows),
        assumed_shear=float(seeking.shear),
        indenter=None if isinstance(indenter, str) else indenter,
        frame=np.arange(len(values)),
        unit=fields.unit,
    )


def columns_of(array: ArrayData, readings: ArrayLike, name: str) -> FloatArray:
    """Return readings as frames; refuse another number of columns than that of the sensors."""
    frames = np.atleast_2d(frozen_array(readings, name=name))
    require_size(name, frames, smallest=0.0)
    count = len(array.sensors)
    if frames.ndim != 2 or frames.shape[1] != count:
        raise InputError(
            f"{name} has {frames.shape[-1]} columns, but the array has {count} sensors; of its "
            f"shape, {frames.shape}, the first is the frame and the second the sensor.",
            why="Each frame is one reading of every sensor, also of those that are not used.",
            cure="Give the columns in the order of array.sensors, NaN where a reading is missing.",
        )
    return frames


def _zero(array: ArrayData, rest: ArrayLike | None, readings: FloatArray) -> ArrayPair:
    """Return what readings are without contact (n,), and the covariance of their error (n, n).

    Of few frames that of the readings is known in few directions: the scan's, in size no smaller
    and that of the rest, counts as much as so many frames as there are sensors.
    """
    if rest is None:
        return np.zeros(len(array.noise)), np.zeros_like(array.noise)
    frames = np.ma.masked_invalid(columns_of(array, rest, "rest"))
    zero = frames.mean(axis=0)
    silent = array.used & (frames.count(axis=0) == 0) & np.isfinite(readings).any(axis=0)
    if silent.any():
        raise InputError(
            f"rest holds no reading of {', '.join(np.array(array.sensors)[silent])}.",
            why="Without its reading at rest none of a sensor's readings is that of a contact.",
            cure="Give frames without contact in which it reads, or mark its readings as missing.",
        )
    away = (frames - zero).filled(0.0)
    used = array.used
    free = np.maximum(frames.count(axis=0), 1) - 1
    ratio = np.sum((away**2 / np.diag(array.noise))[:, used]) / max(free[used].sum(), 1)
    known = used.sum()
    products = away.T @ away + known * max(ratio, 1.0) * array.noise
    share = ~np.ma.getmaskarray(frames) / ((free + 1) * np.sqrt(free + known))
    return zero.filled(np.nan), products * (share.T @ share)


def at_an_end(array: ArrayData, readings: FloatArray, *, tared: bool) -> BoolArray:
    """Return which readings are at an end of a sensor's range, and none."""
    # Where readings are tared their baselines may have been those of the scan, or none.
    baseline = np.nan_to_num(array.baselines) * tared
    low = -np.inf if array.reading_low is None else array.reading_low - np.minimum(baseline, 0.0)
    high = np.inf if array.reading_high is None else array.reading_high - np.maximum(baseline, 0.0)
    return (readings <= low) | (readings >= high)


def patterns(seen: BoolArray) -> Iterator[tuple[BoolArray, IndexArray]]:
    """Yield which sensors read, and the frames of which that is so."""
    frames: dict[bytes, list[int]] = {}
    for frame, packed in enumerate(np.packbits(seen, axis=1)):
        frames.setdefault(packed.tobytes(), []).append(frame)
    for alike in frames.values():
        yield seen[alike[0]], np.array(alike)
