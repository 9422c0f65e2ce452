r"""Place and force of a contact on an array, frame by frame.

The readings are :math:`u = P\,[H(r) + q_x S_x(r) + q_y S_y(r)] + n` with the receptive fields
:mod:`~memscal.extensions.arrays.receptive_fields`, the ratios q of shear to normal force, and noise
of the array's covariance.  The largest :math:`z = h^T u / |h|` of whitened fields on a grid of
places tells whether there is a contact; damped Gauss-Newton steps from the three best places that
are a thickness apart minimise

.. math::

    |u - P\,(H + q \cdot S)|^2 + |q|^2/s^2

with the prior standard deviation s of the ratios, for shear moves the readings as another place
does.  The array's own errors are added to the covariance to first order.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike
from scipy.special import chdtrc

from memscal.errors import InputError
from memscal.extensions.arrays import contacts as flag
from memscal.extensions.arrays.array_data import ArrayData
from memscal.extensions.arrays.contacts import Contacts
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
#: A force is at least this share of that at the best start.
_LEAST = 1e-3
#: Prior standard deviation of a contact's distance from the sensors' box, in thicknesses: by little
#: noise a large force far outside is as likely as the contact at the edge.
_OUTSIDE = 0.5
#: Standard deviation of ln force about that of the scan, by which starts are compared.
_FORCES = 1.5
#: A force of a larger relative uncertainty is weak.
_WEAK = 0.2


class Fields(Protocol):
    """What a sensor reads of a contact, by its place."""

    @property
    def sensors(self) -> IndexArray:
        """Which sensors are used, (n,)."""

    @property
    def centres(self) -> FloatArray:
        """Their places, (n, 2), in m."""

    @property
    def unit(self) -> str:
        """Unit of the forces."""

    def radius(self, force: FloatArray) -> FloatArray:
        """Contact radii (m) under forces."""

    def normal(self, places: FloatArray, force: FloatArray | None = None) -> ArrayTriple:
        """Readings per newton, and their derivatives by x and y, (m, n) each."""

    def forward(self, places: FloatArray, force: FloatArray, shear: FloatArray) -> ArrayPair:
        """Readings (m, n), and their derivatives by x, y, force and two shears, (m, n, 5)."""

    def errors(self, places: FloatArray, force: FloatArray, shear: FloatArray) -> FloatArray:
        """Changes of the readings by one u of each error of the array, (m, n, c)."""


Touch = str | RoundIndenter
"""What presses: ``"point"``, a rod, or a sphere."""


def fields_under(array: ArrayData, indenter: Touch) -> Fields:
    """Return the receptive fields under an indenter; refuse another one than a rod or a sphere."""
    if not (indenter == "point" or isinstance(indenter, Rod | Sphere)):
        raise InputError(
            f"The indenter is {indenter!r}.",
            why="Receptive fields are calculated under a point, a rod, or a sphere.",
            cure='Give "point", memscal.Rod(radius=...) or memscal.Sphere(radius=...).',
        )
    return receptive_fields(array, None if isinstance(indenter, str) else indenter)


@array_record
class Seeking:
    """How contacts are sought: fields, the parameters that are free, and the region in m."""

    fields: Fields
    free: tuple[int, ...]  # of x, y, force and the two shears
    shear: float
    low: FloatArray  # (2,)
    high: FloatArray
    thickness: float
    load: float  # usual, in the unit of the forces
    near: float  # prior standard deviation of the distance from the sensors' box, in m

    @classmethod
    def on(cls, array: ArrayData, indenter: Touch, shear: float) -> Seeking:
        """Return how contacts are sought on an array."""
        require_non_negative("shear", shear)
        fields = fields_under(array, indenter)
        thickness = array.film.thickness
        told = np.ptp(fields.centres, axis=0) > _ON_A_LINE * thickness
        axes = np.flatnonzero(told) if told.any() else np.arange(1)
        shears = axes + 3 if shear > 0 else axes[:0]
        margin = np.where(np.isin([0, 1], axes), MARGIN * thickness, 0.0)
        middle = fields.centres.mean(axis=0)
        low, high = fields.centres.min(axis=0), fields.centres.max(axis=0)
        return cls(
            fields=fields,
            free=(*axes.tolist(), 2, *shears.tolist()),
            shear=shear,
            low=np.where(margin > 0, low - margin, middle),
            high=np.where(margin > 0, high + margin, middle),
            thickness=thickness,
            load=array.load,
            near=_OUTSIDE * thickness,
        )

    @property
    def axes(self) -> list[int]:
        """Which of x and y the sensors tell."""
        return [i for i in self.free if i < 2]

    def grid(self) -> FloatArray:
        """Places on which contacts are sought first, (g, 2), in m."""
        counts = 1 + np.ceil((self.high - self.low) / (_STEP * self.thickness)).astype(int)
        x, y = (np.linspace(*ends) for ends in zip(self.low, self.high, counts, strict=True))
        return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)

    def outside(self, places: FloatArray) -> FloatArray:
        """Distances (m) of places from the hull of the sensors; negative within."""
        centres = self.fields.centres
        if len(self.axes) < 2:
            middle = (centres.min(axis=0) + centres.max(axis=0)) / 2
            apart = np.abs(places - middle) - np.ptp(centres, axis=0) / 2
            return floats(apart[:, self.axes[0]])
        from scipy.spatial import ConvexHull

        facets = ConvexHull(centres).equations
        return floats(np.max(places @ facets[:, :2].T + facets[:, 2], axis=1))


def locate(
    array: ArrayData,
    u: ArrayLike,
    indenter: Touch = "point",
    shear: float = 0.3,
    rest: ArrayLike | None = None,
) -> Contacts:
    """Find place and force of a contact in each frame: :meth:`SensorArray.locate`."""
    seeking = Seeking.on(array, indenter, shear)
    sensors = seeking.fields.sensors
    readings = _columns(array, u, "u")
    zero, scatter = _zero(array, rest)
    saturated = _at_an_end(array, readings, tared=rest is None)
    values = np.where(saturated, np.nan, readings - zero)[:, sensors]
    count = len(values)
    state = np.full((count, 5), np.nan)
    covariance = np.full((count, 3, 3), np.nan)
    p_value = np.full(count, np.nan)
    seen = np.isfinite(values)
    flags = np.where(np.isfinite(readings).any(axis=1), flag.TOO_FEW, flag.NO_READING)
    flags = flags.astype(object)
    grid = seeking.grid()
    fields, *_ = seeking.fields.normal(grid)
    for kept, frames in _patterns(seen):
        if kept.sum() <= len(seeking.axes):
            continue
        sight = Sight.of(seeking, array.noise + scatter, kept)
        for part in slices(frames.size, _BATCH):
            some = frames[part]
            whitened = values[np.ix_(some, kept)] @ sight.whitener.T
            starts, detected = sight.starts(whitened, grid, fields)
            flags[some] = np.where(detected, "", flag.NO_CONTACT)
            if detected.any():
                found = some[detected]
                best = sight.fitted(whitened[detected], starts[detected])
                state[found] = best
                covariance[found], p_value[found] = sight.judged(whitened[detected], best)
    places, force, ratios = state[:, :2], state[:, 2], state[:, 3:]
    uncertain = np.sqrt(covariance[:, 2, 2]) > _WEAK * force
    said = {
        flag.SATURATED: saturated.any(axis=1),
        flag.EDGE: seeking.outside(places) > array.film.thickness,
        flag.WEAK: uncertain,
        flag.MISFIT: p_value < FALSE_ALARM,
    }
    words = [[text] if text else [] for text in flags]
    for name, frames_of in said.items():
        for i in np.flatnonzero(frames_of):
            words[i].append(name)
    return Contacts(
        x=places[:, 0],
        y=places[:, 1],
        force=force,
        radius=np.where(np.isnan(force), np.nan, seeking.fields.radius(force)),
        shear=force[:, None] * ratios,
        covariance=covariance,
        p_value=p_value,
        flags=tuple("; ".join(texts) for texts in words),
        assumed_shear=float(shear),
        indenter=None if isinstance(indenter, str) else indenter,
        frame=np.arange(count),
        centres=seeking.fields.centres,
        unit=seeking.fields.unit,
    )


Starts = tuple[FloatArray, BoolArray]


@array_record
class Sight:
    """Frames in which the same s sensors read: their noise made white."""

    seeking: Seeking
    kept: BoolArray  # (n,)
    whitener: FloatArray  # (s, s)

    @classmethod
    def of(cls, seeking: Seeking, noise: FloatArray, kept: BoolArray | None = None) -> Sight:
        """Return the sight of sensors (n,), by default all that are used, in noise of all."""
        sensors = seeking.fields.sensors
        kept = np.ones(sensors.size, bool) if kept is None else kept
        some = sensors[kept]
        root = np.linalg.cholesky(noise[np.ix_(some, some)])
        return cls(seeking, kept, floats(np.linalg.inv(root)))

    def covariance(self, state: FloatArray, errors: FloatArray | None = None) -> FloatArray:
        """Return covariances of x, y and force by noise, priors, and errors, (m, 3, 3)."""
        _, slopes = self._whitened(state)
        curved, size = self._scaled(slopes, state)
        whole = np.linalg.inv(curved) / (size[:, :, None] * size[:, None])
        if errors is not None:
            moved = whole @ slopes.swapaxes(1, 2) @ errors
            whole = whole + moved @ moved.swapaxes(1, 2)
        covariance = np.full((len(state), 3, 3), np.nan)
        told = [i for i in self.seeking.free if i < 3]
        covariance[np.ix_(range(len(state)), told, told)] = whole[:, : len(told), : len(told)]
        return covariance

    def starts(self, u: FloatArray, grid: FloatArray, fields: FloatArray) -> Starts:
        """Return the best places of frames (m, s), (m, 3, 2), and whether a contact is seen.

        Places of the grid are (g, 2), and their fields (g, n) per newton.
        """
        tuned = fields[:, self.kept] @ self.whitener.T
        size = np.linalg.norm(tuned, axis=1)
        seen = size > _SEEN * size.max()
        places = grid[seen]
        score = u @ (tuned[seen] / size[seen, None]).T
        detected = score.max(axis=1) > DETECTED
        starts = np.zeros((len(u), _STARTS, 2))
        for i in range(_STARTS):
            starts[:, i] = places[score.argmax(axis=1)]
            apart = np.linalg.norm(places - starts[:, i, None], axis=-1)
            score[apart < self.seeking.thickness] = -np.inf
        return starts, detected

    def fitted(self, u: FloatArray, starts: FloatArray) -> FloatArray:
        """Return the state of least chi-square of whitened frames (m, s), (m, 5)."""
        count, several, _ = starts.shape
        readings = np.repeat(u, several, axis=0)
        state = np.zeros((len(readings), 5))
        state[:, :2] = starts.reshape(-1, 2)
        state[:, 2] = 1.0
        fields, _ = self._whitened(state)
        force = np.sum(fields * readings, axis=1) / np.sum(fields**2, axis=1)
        largest = force.reshape(count, several).max(axis=1)
        least = _LEAST * np.repeat(largest, several)
        state[:, 2] = np.maximum(force, least)
        cost = self._settle(readings, state, least)
        # Of contacts that are as likely the one of a more usual force is taken.
        cost += (np.log(state[:, 2] / self.seeking.load) / _FORCES) ** 2
        best = cost.reshape(count, several).argmin(axis=1)
        return floats(state.reshape(count, several, 5)[np.arange(count), best])

    def judged(self, u: FloatArray, state: FloatArray) -> ArrayPair:
        """Return covariances (m, 3, 3) of x, y and force, and p-values of the residuals."""
        seeking = self.seeking
        value, slopes = self._whitened(state)
        errors = self.whitener @ seeking.fields.errors(*_parts(state))[:, self.kept]
        # Without the shear that was found, which is noise with the prior's deviation.
        told = len(seeking.axes) + 1
        sheared = slopes[..., told:]
        ratios = state[:, [i for i in seeking.free if i >= 3]]
        residual = u - value + np.einsum("msq,mq->ms", sheared, ratios)
        spread = np.concatenate([errors, seeking.shear * sheared], axis=-1)
        spread = np.eye(self.kept.sum()) + spread @ spread.swapaxes(1, 2)
        columns = np.concatenate([residual[..., None], slopes[..., :told]], axis=-1)
        products = columns.swapaxes(1, 2) @ np.linalg.solve(spread, columns)
        fitted = np.linalg.solve(products[:, 1:, 1:], products[:, 1:, :1])
        square = products[:, 0, 0] - (products[:, :1, 1:] @ fitted)[:, 0, 0]
        freedom = residual.shape[1] - told
        p_value = chdtrc(freedom, square) if freedom else np.full(len(u), np.nan)
        return self.covariance(state, errors), p_value

    def _settle(self, u: FloatArray, state: FloatArray, least: FloatArray) -> FloatArray:
        """Move states (m, 5) to their least chi-square by damped Gauss-Newton steps; return it."""
        seeking = self.seeking
        free = list(seeking.free)
        low = np.array([*seeking.low, 0.0, -np.inf, -np.inf])
        high = np.array([*seeking.high, np.inf, np.inf, np.inf])
        damping = np.full(len(state), _DAMPING)
        value, slopes = self._whitened(state)
        cost = self._cost(u - value, state)
        active = np.arange(len(state))
        for _ in range(_STEPS):
            here = state[active]
            curved, size = self._scaled(slopes[active], here)
            pull = np.einsum("msf,ms->mf", slopes[active], (u - value)[active])
            pull -= np.prod(self._prior(here), axis=0)
            curved = curved + damping[active, None, None] * np.eye(len(free))
            step = np.linalg.solve(curved, (pull / size)[..., None])[..., 0] / size
            trial = here.copy()
            trial[:, free] += step
            trial = np.clip(trial, low, high)
            trial[:, 2] = np.maximum(trial[:, 2], least[active])
            there, bent = self._whitened(trial)
            risen = self._cost(u[active] - there, trial)
            fall = cost[active] - risen
            better = fall >= 0
            damping[active] *= np.where(better, _LESS, _MORE)
            good = active[better]
            state[good], value[good] = trial[better], there[better]
            slopes[good], cost[good] = bent[better], risen[better]
            settled = better & (fall < _SETTLED) & (damping[active] < 1)
            active = active[~settled & (damping[active] < _STUCK)]
            if not active.size:
                break
        return cost

    def _prior(self, state: FloatArray) -> FloatArray:
        """Return what the prior expects otherwise of states, and its inverse variances, (2, m, f).

        Its places lie in the box of the sensors, or near it; its shears are small.
        """
        seeking = self.seeking
        centres = seeking.fields.centres
        away = state.copy()
        away[:, :2] -= np.clip(away[:, :2], centres.min(axis=0), centres.max(axis=0))
        away[:, 2] = 0.0
        weight = np.zeros_like(away)
        weight[:, :2] = np.where(away[:, :2], seeking.near**-2, 0.0)
        weight[:, 3:] = (seeking.shear or np.inf) ** -2
        return np.stack([away, weight])[..., list(seeking.free)]

    def _scaled(self, slopes: FloatArray, state: FloatArray) -> ArrayPair:
        """Return the normal equations with a diagonal of ones, and the roots of their diagonal."""
        _, weight = self._prior(state)
        normal = slopes.swapaxes(1, 2) @ slopes + weight[:, None] * np.eye(weight.shape[1])
        size = np.sqrt(np.diagonal(normal, axis1=1, axis2=2))
        return normal / (size[:, :, None] * size[:, None]), size

    def _cost(self, residual: FloatArray, state: FloatArray) -> FloatArray:
        away, weight = self._prior(state)
        return floats(np.sum(residual**2, axis=1) + np.sum(weight * away**2, axis=1))

    def _whitened(self, state: FloatArray) -> ArrayPair:
        """Return whitened readings (m, s), and their derivatives by the free parameters."""
        value, slopes = self.seeking.fields.forward(*_parts(state))
        slopes = slopes[:, self.kept][..., list(self.seeking.free)]
        return value[:, self.kept] @ self.whitener.T, self.whitener @ slopes


def _parts(state: FloatArray) -> ArrayTriple:
    """Return places, forces and shears over forces of states (m, 5)."""
    return state[:, :2], state[:, 2], state[:, 3:]


def _columns(array: ArrayData, readings: ArrayLike, name: str) -> FloatArray:
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
    count = len(array.sensors)
    if rest is None:
        return np.zeros(count), np.zeros((count, count))
    frames = _columns(array, rest, "rest")
    known = np.isfinite(frames)
    many = known.sum(axis=0)
    zero = np.where(known, frames, 0.0).sum(axis=0) / np.where(many > 0, many, np.nan)
    if len(frames) == 1:
        return zero, array.noise
    away = np.where(known, frames - zero, 0.0)
    pairs = floats(known).T @ floats(known)
    return zero, away.T @ away / np.maximum(pairs - 1, 1) / np.maximum(pairs, 1)


def _at_an_end(array: ArrayData, readings: FloatArray, *, tared: bool) -> BoolArray:
    """Return which readings are at an end of a sensor's range, and none."""
    # Where readings are tared their baselines may have been those of the scan, or none.
    baseline = np.nan_to_num(array.baselines) if tared else np.zeros(len(array.sensors))
    ended = np.zeros(readings.shape, bool)
    if array.reading_high is not None:
        ended |= readings >= array.reading_high - np.maximum(baseline, 0.0)
    if array.reading_low is not None:
        ended |= readings <= array.reading_low - np.minimum(baseline, 0.0)
    return ended


def _patterns(seen: BoolArray) -> Iterator[tuple[BoolArray, IndexArray]]:
    """Yield which sensors read, and the frames of which that is so."""
    kinds, of = np.unique(seen, axis=0, return_inverse=True)
    for i, kept in enumerate(kinds):
        yield kept, np.flatnonzero(of.ravel() == i)
