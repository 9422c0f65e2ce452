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
    require_non_negative,
    slices,
    unmasked,
)
from memscal.model.checks import FALSE_ALARM
from memscal.model.indenter import Rod, RoundIndenter, Sphere

DETECTED = 5.0
"""A contact is seen where its amplitude is so many standard deviations of the noise."""

#: Step of the grid on which a contact is sought, in thicknesses; how many starts; frames at once.
_STEP = 0.25
_STARTS = 3
_BATCH = 200
#: Places of the grid that the sensors hardly see are left out.
_SEEN = 1e-3
#: Steps of a fit; its damping at first, where it gives up, and by what factors it changes; the rise
#: of chi-square that is left where it has settled.
_STEPS = 60
_DAMPING = 1e-3
_STUCK = 1e8
_LESS = 0.2
_MORE = 5.0
_SETTLED = 1e-6
#: Sensors lie on a line if they are apart from it by less of the film's thickness.
_ON_A_LINE = 0.1
#: Prior standard deviations of the distance from the sensors' box, in thicknesses, and of ln force,
#: by which starts are compared: by little noise a huge force far outside is as likely as a contact.
_OUTSIDE = 0.5
_FORCES = 1.5
#: Forces are above this, in N; what is fixed has this standard deviation, in SI units.
_LEAST = 1e-9
_FIXED = 1e-12
#: A force of a larger relative uncertainty is weak.
_WEAK = 0.2

Touch = str | RoundIndenter
"""What presses: ``"point"``, a rod, or a sphere."""


@array_record
class Seeking:
    """How contacts are sought: fields, which of x and y they tell, and the region in m."""

    fields: Any  # ReceptiveFields, or MeasuredFields
    axes: list[int]  # which of x and y the sensors tell; the other one is that of the row
    shear: float
    low: FloatArray  # (2,)
    high: FloatArray
    thickness: float
    near: float  # prior standard deviation of the distance from the sensors' box, in m

    @classmethod
    def on(cls, array: ArrayData, indenter: Touch, shear: float, margin: float = MARGIN) -> Seeking:
        """Return how contacts are sought on an array, up to so many thicknesses outside it."""
        require_non_negative("shear", shear)
        if not (indenter == "point" or isinstance(indenter, Rod | Sphere)):
            raise InputError(
                f"The indenter is {indenter!r}.",
                why="Receptive fields are calculated under a point, a rod, or a sphere.",
                cure='Give "point", memscal.Rod(radius=...) or memscal.Sphere(radius=...).',
            )
        if array.kernel == "measured":
            # Only presses like those of the scan are known, and no place beyond it.
            fields: Any = MeasuredFields(array)
            h = fields.scale
            margin = 0.0
            shear = 0.0
        else:
            fields = receptive_fields(array, None if isinstance(indenter, str) else indenter)
            h = array.film.thickness
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


@array_record
class Sight:
    """What the same s sensors read in some frames: their noise made white."""

    seeking: Seeking
    kept: BoolArray  # (n,)
    whitener: FloatArray  # (s, s)

    @classmethod
    def of(cls, seeking: Seeking, noise: FloatArray, kept: BoolArray) -> Sight:
        """Return the sight of some of the n sensors, in noise of all of the array."""
        some = seeking.fields.sensors[kept]
        root = np.linalg.cholesky(noise[np.ix_(some, some)])
        return cls(seeking, kept, floats(np.linalg.inv(root)))

    def starts(self, u: FloatArray, grid: FloatArray, fields: FloatArray) -> FloatArray:
        """Return the best places of frames (m, s), (m, 3, 2); NaN where no contact is seen."""
        tuned = fields[:, self.kept] @ self.whitener.T
        size = np.linalg.norm(tuned, axis=1)
        seen = size > _SEEN * size.max()
        places = grid[seen]
        score = u @ (tuned[seen] / size[seen, None]).T
        detected = score.max(axis=1) > DETECTED
        starts = np.full((len(u), _STARTS, 2), np.nan)
        for i in range(_STARTS):
            best = places[score.argmax(axis=1)]
            starts[detected, i] = best[detected]
            apart = np.linalg.norm(places - best[:, None], axis=-1)
            score[apart < self.seeking.thickness] = -np.inf
        return starts

    def fitted(self, u: FloatArray, starts: FloatArray) -> FloatArray:
        """Return the state of least chi-square of frames (m, s), (m, 5)."""
        several = starts.shape[1]
        u = np.repeat(u, several, axis=0)
        state = np.zeros((len(u), 5))
        state[:, :2] = starts.reshape(-1, 2)
        state[:, 2] = 1.0
        fields = u - self.rows(u, state)[0][:, : u.shape[1]]
        force = np.sum(fields * u, axis=1) / np.sum(fields**2, axis=1)
        state[:, 2] = np.maximum(force, _LEAST)
        cost = self._settle(u, state)
        # Of contacts that are as likely the one of a more usual force is taken.
        cost += (np.log(state[:, 2] / self.seeking.fields.array.load) / _FORCES) ** 2
        best = cost.reshape(-1, several).argmin(axis=1)
        return floats(state.reshape(-1, several, 5)[np.arange(best.size), best])

    def _settle(self, u: FloatArray, state: FloatArray) -> FloatArray:
        """Move states (m, 5) to their least chi-square by damped Gauss-Newton steps; return it."""
        damping = np.full(len(state), _DAMPING)
        residual, slopes = self.rows(u, state)
        cost = np.sum(residual**2, axis=1)
        active = np.arange(len(state))
        for _ in range(_STEPS):
            step, _ = steps(residual[active], slopes[active], damping[active])
            trial = state[active] + step
            trial[:, :2] = np.clip(trial[:, :2], self.seeking.low, self.seeking.high)
            trial[:, 2] = np.maximum(trial[:, 2], _LEAST)
            there, bent = self.rows(u[active], trial)
            fall = cost[active] - np.sum(there**2, axis=1)
            better = fall >= 0
            damping[active] *= np.where(better, _LESS, _MORE)
            good = active[better]
            state[good] = trial[better]
            residual[good] = there[better]
            slopes[good] = bent[better]
            cost[good] -= fall[better]
            settled = better & (fall < _SETTLED) & (damping[active] < 1)
            active = active[~settled & (damping[active] < _STUCK)]
            if not active.size:
                break
        return floats(cost)

    def judged(self, u: FloatArray, state: FloatArray) -> ArrayTriple:
        """Return states, covariances (m, 3, 3) and p-values by noise and the array's errors."""
        residual, slopes = self.rows(u, state)
        of_array = self.whitener @ self.seeking.fields.errors(*_parts(state))[:, self.kept]
        s = u.shape[1]
        root = np.linalg.cholesky(np.eye(s) + of_array @ of_array.swapaxes(1, 2))
        both = np.concatenate([residual[..., None], slopes], axis=-1)
        both[:, :s] = np.linalg.solve(root, both[:, :s])
        residual, slopes = both[..., 0], both[..., 1:]
        step, inverse = steps(residual, slopes, np.zeros(len(u)))
        moved = state + step
        moved[:, :2] = np.clip(moved[:, :2], self.seeking.low, self.seeking.high)
        square = np.sum(residual**2, axis=1) - np.einsum("mrf,mr,mf->m", slopes, residual, step)
        freedom = s - len(self.seeking.axes) - 1
        p_value = chdtrc(freedom, square) if freedom else np.full(len(u), np.nan)
        return moved, self.covariance(inverse), floats(p_value)

    def covariance(self, inverse: FloatArray) -> FloatArray:
        """Return covariances (m, 3, 3) of x, y and force; NaN where the sensors do not tell."""
        untold = [i for i in (0, 1) if i not in self.seeking.axes]
        covariance = inverse[:, :3, :3].copy()
        covariance[:, untold] = np.nan
        covariance[:, :, untold] = np.nan
        return covariance

    def rows(self, u: FloatArray, state: FloatArray) -> ArrayPair:
        """Return residuals (m, s + 4) of standard deviation one, and derivatives of what they miss.

        The last four are those of the priors: places near the box of the sensors, small shears.
        """
        seeking = self.seeking
        value, slopes = seeking.fields.forward(*_parts(state))
        away = np.column_stack([seeking.beyond(state[:, :2]), state[:, 3:]])
        weight = np.full(away.shape, 1 / max(seeking.shear, _FIXED))
        weight[:, :2] = np.where(away[:, :2], 1 / seeking.near, 0.0)
        weight[:, [i for i in (0, 1) if i not in seeking.axes]] = 1 / _FIXED
        read = u - value[:, self.kept] @ self.whitener.T
        prior = weight[..., None] * np.eye(5)[[0, 1, 3, 4]]
        slopes = np.concatenate([self.whitener @ slopes[:, self.kept], prior], axis=1)
        return np.concatenate([read, -weight * away], axis=1), slopes


def steps(residual: FloatArray, slopes: FloatArray, damping: FloatArray) -> ArrayPair:
    """Return damped Gauss-Newton steps (m, f) of rows, and inverses of the normal equations."""
    size = np.linalg.norm(slopes, axis=1)
    scaled = slopes / size[:, None]
    normal = scaled.swapaxes(1, 2) @ scaled + damping[:, None, None] * np.eye(size.shape[1])
    inverse = np.linalg.inv(normal) / (size[:, :, None] * size[:, None])
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
    zero, scatter = _zero(array, rest)
    saturated = at_an_end(array, readings, tared=rest is None)
    values = np.where(saturated, np.nan, readings - zero)[:, fields.sensors]
    state = np.full((len(values), 5), np.nan)
    covariance = np.full((len(values), 3, 3), np.nan)
    p_value = np.full(len(values), np.nan)
    sought = np.zeros(len(values), bool)
    grid = seeking.grid()
    on_grid = fields.normal(grid)[0]
    for kept, frames in patterns(np.isfinite(values)):
        if kept.sum() <= len(seeking.axes):
            continue
        sought[frames] = True
        sight = Sight.of(seeking, array.noise + scatter, kept)
        for part in slices(frames.size, _BATCH):
            some = frames[part]
            whitened = values[np.ix_(some, kept)] @ sight.whitener.T
            starts = sight.starts(whitened, grid, on_grid)
            seen = np.isfinite(starts[:, 0, 0])
            if seen.any():
                best = sight.fitted(whitened[seen], starts[seen])
                of = some[seen]
                state[of], covariance[of], p_value[of] = sight.judged(whitened[seen], best)
    places, force, ratios = _parts(state)
    blank = ~np.isfinite(readings).any(axis=1)
    said = {
        "no reading": blank,
        "too few readings": ~sought & ~blank,
        "no contact": sought & np.isnan(force),
        "saturated": saturated.any(axis=1),
        "edge": seeking.outside(places) > seeking.thickness,
        "weak": np.sqrt(covariance[:, 2, 2]) > _WEAK * force,
        "misfit": p_value < FALSE_ALARM,
    }
    flags = [""] * len(values)
    for name, frames in said.items():
        for i in np.flatnonzero(frames):
            flags[i] = f"{flags[i]}; {name}".removeprefix("; ")
    return Contacts(
        x=places[:, 0],
        y=places[:, 1],
        force=force,
        radius=fields.radius(force),
        shear=force[:, None] * ratios,
        covariance=covariance,
        p_value=p_value,
        flags=tuple(flags),
        assumed_shear=float(seeking.shear),
        indenter=None if isinstance(indenter, str) else indenter,
        frame=np.arange(len(values)),
        centres=fields.centres,
        unit=fields.unit,
    )


def _parts(state: FloatArray) -> ArrayTriple:
    """Return places, forces and shears over forces of states (m, 5)."""
    return state[:, :2], state[:, 2], state[:, 3:]


def columns_of(array: ArrayData, readings: ArrayLike, name: str) -> FloatArray:
    """Return readings as frames; refuse another number of columns than that of the sensors."""
    frames = np.atleast_2d(floats(unmasked(readings)))
    count = len(array.sensors)
    if frames.ndim != 2 or frames.shape[1] != count:
        raise InputError(
            f"{name} has {frames.shape[-1]} columns, but the array has {count} sensors.",
            why="Each frame is one reading of every sensor, also of those that are not used.",
            cure="Give the columns in the order of array.sensors, NaN where a reading is missing.",
        )
    return frames


def _zero(array: ArrayData, rest: ArrayLike | None) -> ArrayPair:
    """Return the readings without contact (n,), and the covariance of their error (n, n)."""
    if rest is None:
        return np.zeros(len(array.noise)), np.zeros_like(array.noise)
    frames = np.ma.masked_invalid(columns_of(array, rest, "rest"))
    zero = frames.mean(axis=0).filled(np.nan)
    if len(frames) == 1:
        return zero, array.noise
    scatter: Any = np.ma.cov(frames, rowvar=False)  # type: ignore[no-untyped-call]
    return zero, scatter.filled(0.0) / len(frames)


def at_an_end(array: ArrayData, readings: FloatArray, *, tared: bool) -> BoolArray:
    """Return which readings are at an end of a sensor's range, and none."""
    # Where readings are tared their baselines may have been those of the scan, or none.
    baseline = np.nan_to_num(array.baselines) * tared
    low = -np.inf if array.reading_low is None else array.reading_low - np.minimum(baseline, 0.0)
    high = np.inf if array.reading_high is None else array.reading_high - np.maximum(baseline, 0.0)
    return (readings <= low) | (readings >= high)


def patterns(seen: BoolArray) -> Iterator[tuple[BoolArray, IndexArray]]:
    """Yield which sensors read, and the frames of which that is so."""
    # Bytes are sorted twenty times faster than the bits that they hold.
    packed = np.packbits(seen, axis=1)
    _, first, of = np.unique(packed, axis=0, return_index=True, return_inverse=True)
    for i, frame in enumerate(first):
        yield seen[frame], np.flatnonzero(of.ravel() == i)
