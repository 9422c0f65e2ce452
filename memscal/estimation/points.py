r"""Points of one scan or several, flattened, with refusals of unusable ones.

A tangential channel measures :math:`U_{xz} = A_{xz}\,(G_{xz} \otimes \tau)(R)\cos\theta`, with
:math:`R, \theta` from the sensor to the indenter and :math:`\tau` the radial traction of the base
on the film, positive outward.  Where the film is squeezed outward :math:`\tau` is negative, and
the voltage falls where the indenter stands at larger x than the sensor.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import field, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from memscal.errors import FitError, InputError
from memscal.estimation.decorrelation import Decorrelation
from memscal.extensions import hook
from memscal.model.arrays import BoolArray, FloatArray, IndexArray, Values, array_record
from memscal.model.correlation import is_banded, of_points, root_of
from memscal.model.instrument import Dynamics
from memscal.model.notation import VOLTS, Reading
from memscal.model.places import Places
from memscal.model.scan import Scan
from memscal.model.sizes import MOST_OF_LINES, MOST_OF_RASTER, too_large
from memscal.readings.find_places import places_of
from memscal.readings.mistaken_unit import rise_of

#: Channels that measure the shear along x and along y.
TANGENTIAL = ("xz", "yz")
#: All, the normal one first.
CHANNELS = ("zz", *TANGENTIAL)


def channel_order(channel: str) -> int:
    """Order of a channel's Hankel transforms: zero of a scalar, one of a vector's component."""
    if channel not in CHANNELS:
        raise InputError(
            f"There is no channel {channel!r}.", cure=f"The channels are {', '.join(CHANNELS)}."
        )
    return int(channel in TANGENTIAL)


def channel_signal(scan: Scan, channel: str) -> tuple[FloatArray, FloatArray | None]:
    """Return a channel's voltages and their stated standard uncertainty, in V."""
    if channel_order(channel) == 0:
        if scan.sensor.channel in TANGENTIAL:
            raise InputError(
                f"The scan was recorded by channel {scan.sensor.channel}, but channel zz is to be "
                "calibrated.",
                why="A shear is not fitted by a normal stress.",
                cure=f"Store the voltage as u_{scan.sensor.channel} beside u_zz, and calibrate "
                f"channel {scan.sensor.channel}; or correct /entry/instrument/stress_sensor.",
            )
        return scan.u_zz, scan.u_zz_errors
    name = f"u_{channel}"
    along = channel[0]
    if name not in scan.channels:
        held = ", ".join(["u_zz", *scan.channels])
        raise InputError(
            f"The scan holds no {name}, only {held}.",
            why=f"Channel {channel} is calibrated with its own voltage.",
            cure=f"Import it (memscal import --{name.replace('_', '-')} COLUMN), or calibrate "
            "channel zz.",
        )
    if scan.planar:
        raise InputError(
            f"Channel {channel} cannot be calibrated with a raster.",
            why="A raster is used as a field, and the shear's has a line of zeros through it.",
            cure=f"Calibrate with lines along {along} through the sensor; cut one from the raster.",
        )
    if scan.direction != along:
        raise InputError(
            f"The scan runs along {scan.direction}, and channel {channel} measures the shear "
            f"along {along}.",
            why="On a line through the sensor the shear across the line is zero.",
            cure=f"Calibrate with a scan along {along}, or channel {scan.direction}z.",
        )
    u = scan.channels[name]
    if np.isinf(u).any():
        raise InputError(f"{name} holds an infinite voltage.", cure="Mark missing points with NaN.")
    return u, scan.channels.get(f"{name}_errors")


#: Conversion constant, width, centre, baseline, slope; one more to estimate the noise.
MINIMUM_POSITIONS = 6
#: Readings this many times farther from the median than all others are wild, if they are so few: a
#: share of a line's, or of a raster's, whose beam may be small.
_WILD = 5.0
_FEW_OF_LINE = 0.1
_FEW_OF_RASTER = 0.003
#: So many readings at the top, which agree within this share of the steps to the next ones, half as
#: many, may be at a ceiling; and more that agree so many times less closely, or to so many digits.
#: Within the larger share they look so where a calibration is refused.
FEWEST_AT_CEILING = 3
_AGREEING = 0.05
_LOOKING_SO = 0.07
_AS_ALIKE = 5.0
#: The least step of readings is of so few of their last digit, of which all are multiples, to this
#: share of it.
_MOST_DIGITS = 10
_WHOLE = 0.01


@array_record
class ScanPoints:
    """Every measured point of a scan, missing ones left out."""

    x: FloatArray  # (n,): position of the indenter, in m; zero across a line scan
    y: FloatArray
    u: FloatArray  # (n,): voltage of the channel, in V
    load: FloatArray  # (n,): load, in N
    u_errors: FloatArray | None  # (n,): stated standard uncertainty of each voltage, in V
    x_errors: FloatArray  # (n,): standard uncertainty of each position along the scan, in m
    repeat: IndexArray  # (n,): number of each point's repeat, counted through all scans
    branch: NDArray[np.int64]  # (n,): 1 where the indenter approached, 2 where it retreated, or 0
    scan: IndexArray  # (n,): number of each point's scan
    owner: IndexArray  # (n,): number of the measurement that its scan is a part of
    anew: BoolArray  # (n,): whether each repeat has an error of its position of its own
    free: BoolArray  # (scans, 2): along x and y, whether the centre is a free parameter
    averaging: FloatArray  # (scans, 2): way along x and y over which each reading is the mean, in m
    velocity: FloatArray  # (n,): of the indenter along its line, in m/s; zero where it stood
    missing: int  # how many points were missing
    decorrelation: Decorrelation | None = None  # makes noise of the stated correlation white
    channel: str = "zz"
    reading: Reading = VOLTS  # the unit in which voltages are shown
    # (scans,): standard deviation of each baseline's curvature, edge to centre, in V; 0: straight
    curvature: FloatArray = field(default_factory=lambda: np.zeros(0))
    unit: float = 1.0  # noise of a point of weight one, by which that prior is weighed
    dynamics: Dynamics | None = None  # how the sensor follows readings that change

    @property
    def order(self) -> int:
        """Order of the channel's transforms: one where it measures a vector's component."""
        return channel_order(self.channel)

    @property
    def noise_stated(self) -> bool:
        """Whether the voltages state their noise."""
        return self.u_errors is not None

    @property
    def positions(self) -> FloatArray:
        """Positions of the indenter along x and y, shape (2, n), in m."""
        return np.stack([self.x, self.y])

    @property
    def in_motion(self) -> bool:
        """Whether readings are not those of a still sensor: means, or of one that lags."""
        return bool(self.averaging.any() or (self.dynamics and self.velocity.any()))

    @property
    def scans(self) -> int:
        """How many scans there are."""
        return len(self.free)

    @property
    def planar(self) -> bool:
        """Whether a scan spreads over two dimensions (a raster)."""
        return bool(self.free.all(axis=1).any())

    @property
    def as_raster(self) -> bool:
        """Whether they are one raster, which is used as it is; several scans share a profile."""
        return self.planar and self.scans == 1

    @property
    def ellipse(self) -> int:
        """How many parameters of an ellipse are fitted: of crossed lines, not the diagonal one."""
        if self.order:
            return 0
        return 2 if self.planar else int(self.free.any(axis=0).all())

    @property
    def curved(self) -> IndexArray:
        """Numbers of the scans whose baselines may be curved."""
        return np.flatnonzero(self.curvature)

    @property
    def centres(self) -> slice:
        """Places of the free centres among the parameters of a Gaussian fit."""
        return slice(2, 2 + self.free.sum())

    @property
    def curvatures(self) -> slice:
        """Places of the curvatures among the parameters of a Gaussian fit."""
        # After A, the width, centres and drifts, and baselines; before an ellipse.
        last = 2 * self.centres.stop - 2 + self.scans + self.curved.size
        return slice(last - self.curved.size, last)

    @property
    def prior_rows(self) -> FloatArray:
        """Further rows (c, p): readings of the curvatures, zero, with noise as that of a point."""
        rows = np.zeros((self.curved.size, self.curvatures.stop + self.ellipse))
        rows[:, self.curvatures] = np.diag(self.unit / self.curvature[self.curved])
        return rows

    @cached_property
    def inside(self) -> list[BoolArray]:
        """Which points are each scan's, (n,) each."""
        return [self.scan == scan for scan in range(self.scans)]

    @cached_property
    def places(self) -> tuple[Places, ...]:
        """The places of each scan's points."""
        return tuple(places_of(self.x[i], self.y[i], self.repeat[i]) for i in self.inside)

    def place_numbers(self, name: str) -> IndexArray:
        """Return ``index``, ``row`` or ``readings`` of the places for all points, shape (n,)."""
        values = np.empty(self.u.size, np.intp)
        for scan, places in enumerate(self.places):
            values[self.scan == scan] = getattr(places, name)
        return values

    @property
    def span(self) -> float:
        """Diagonal of the rectangle that holds all points, in m."""
        return float(np.hypot(np.ptp(self.x), np.ptp(self.y)))

    @cached_property
    def step(self) -> float:
        """Typical distance of neighbouring positions, in m; of several scans the smallest."""
        # Along x, but for a line along y.
        return min(places.steps[0] or places.steps[1] for places in self.places)

    @property
    def cell(self) -> float:
        """Area of the plane for each place of a raster, in m^2."""
        # A line has no step across it.
        return self.step * min(places.steps[1] for places in self.places if all(places.steps))

    def along(self, components: FloatArray) -> FloatArray:
        """Return of components (2, n) along x and y each point's along its line; a raster's: x."""
        return components[np.argmax(self.free[self.scan], axis=1), range(self.u.size)]

    def only(self, scan: int) -> ScanPoints:
        """Return one of the scans."""
        if self.scans == 1:
            return self
        single = self.selected(np.flatnonzero(self.scan == scan))
        own = slice(scan, scan + 1)
        return replace(
            single,
            scan=np.zeros_like(single.scan),
            free=self.free[own],
            averaging=self.averaging[own],
            curvature=self.curvature[own],
        )

    def selected(self, chosen: IndexArray) -> ScanPoints:
        """Return some of the points, without their correlations."""
        columns: Values = {
            name: value[chosen]
            for name, value in vars(self).items()
            if isinstance(value, np.ndarray) and name not in ("free", "averaging", "curvature")
        }
        return replace(self, **columns, decorrelation=None)

    def standardised(
        self, values: FloatArray, weights: FloatArray, out: FloatArray | None = None
    ) -> FloatArray:
        """Scale rows, (n,) or (n, m), by the root of their weights, and decorrelate them."""
        place = None if out is None else out.T
        scaled = np.multiply(values.T, np.sqrt(weights), out=place).T
        return self.decorrelation.apply(scaled) if self.decorrelation else scaled

    def sharing(self, changes: FloatArray) -> tuple[ScanPoints, float]:
        """Return the points with further errors in common, and what these add to ln det.

        ``changes`` S (n, q), standardised, are what one deviation of each does: values are then
        standardised by the root of :math:`1 + S S^T`, too.
        """
        left, singular, _ = np.linalg.svd(changes, full_matrices=False)
        factor = self.decorrelation or Decorrelation(())
        factor = replace(factor, common=(*factor.common, (left, np.hypot(1, singular))))
        return replace(self, decorrelation=factor), np.log1p(singular**2).sum()

    def sharing_positions(self, moved: FloatArray, stated: FloatArray) -> ScanPoints:
        """Return the points with the errors of their positions in common to repeats.

        ``moved`` (n,), in V, is what one deviation of each does, ``stated`` the inverse variance.
        """
        from scipy.sparse import csr_array

        place = grouped(self.owner, self.anew * self.repeat, self.y, self.x)
        share = moved * np.sqrt(stated)
        share[np.bincount(place)[place] == 1] = 0.0
        if not (self.noise_stated and share.any()):
            return self
        # The variance counts all errors: what is a reading's own is left of it.
        own = np.sqrt(1 - share**2)
        every = np.arange(place.size)
        known = self.decorrelation
        root = own[:, None] * known.correlate(np.eye(every.size)) if known else own[None]
        factor = Decorrelation(((every, root),))
        if known:
            columns = factor.apply(csr_array((share, (every, place))).toarray())
            return replace(self, decorrelation=factor).sharing(columns)[0]
        # No reading has two positions: the columns are orthogonal.
        square = np.bincount(place, (share / own) ** 2)
        size = np.sqrt(np.where(square > 0, square, 1.0))
        common = csr_array((share / own / size[place], (every, place)))
        factor = replace(factor, common=((common, np.sqrt(1 + square)),))
        return replace(self, decorrelation=factor)

    def unstandardise(self, columns: FloatArray, weights: FloatArray) -> FloatArray:
        """Apply the transposed standardisation to columns (n, m), which are overwritten."""
        if self.decorrelation:
            columns = self.decorrelation.adjoint(columns)
        columns *= np.sqrt(weights)[:, None]
        return columns


def measured_points(scan: Scan, channel: str = "zz") -> ScanPoints:
    """Flatten a scan to the measured points of one channel."""
    u, errors = channel_signal(scan, channel)
    keep = measured_mask(scan, channel)
    if not keep.any():
        raise InputError(
            f"Every point of u_{channel} is missing (NaN).",
            why="There is nothing to calibrate with.",
            cure="Check the voltage column and its import.",
        )
    if errors is not None and np.any(errors[keep] <= 0):
        raise InputError(
            f"u_{channel}_errors holds a standard uncertainty of zero.",
            why="A point without noise would outweigh every other point.",
            cure="Give the electronic noise, or leave it out to have it estimated.",
        )
    x, y = scan.positions
    load = scan.stated_load if scan.normal_load is None else scan.normal_load
    x_errors = 0.0 if scan.x_errors is None else scan.x_errors
    branch = np.zeros(u.shape, np.int64) if scan.branch is None else scan.branch
    correlation = None if channel_order(channel) else scan.u_zz_correlation
    count = keep.sum()
    along = [scan.direction == "x", scan.direction == "y"]
    first = np.zeros(count, np.intp)
    velocity = hook("velocities")(scan) if scan.sensor.dynamics else np.zeros(u.shape)
    points = ScanPoints(
        x=x[keep],
        y=y[keep],
        u=u[keep],
        load=np.broadcast_to(load, u.shape)[keep],
        u_errors=None if errors is None else errors[keep],
        x_errors=np.broadcast_to(x_errors, u.shape)[keep],
        repeat=scan.passes[keep],
        owner=first,
        anew=np.full(count, scan.position_errors_by_repeat),
        branch=branch[keep],
        scan=first,
        free=np.array([[along[0], along[1] or scan.planar]]),
        averaging=np.array([along]) * (scan.averaging_length or 0.0),
        velocity=velocity[keep],
        missing=u.size - count,
        decorrelation=None if correlation is None else _decorrelation(correlation, keep),
        channel=channel,
        reading=scan.reading,
        dynamics=scan.sensor.dynamics,
    )
    _require_usable(points)
    return points


#: Standard deviation of a baseline's curvature, edge to centre, over the largest signal, where none
#: is stated.
CURVATURE = 0.005


def calibration_points(scan: Scan, channel: str = "zz") -> ScanPoints:
    """Flatten a scan whose baseline may be curved: as it states, or a little."""
    points = measured_points(scan, channel)
    relative = scan.baseline_curvature_uncertainty
    # The median of three points does not follow a single outlier.
    rise = np.sort(abs(rise_of(points.x, points.y, points.u)))
    deviation = np.median(rise[-3:]) * (CURVATURE if relative is None else relative)
    return replace(points, curvature=np.array([deviation]))


def measured_mask(scan: Scan, channel: str = "zz") -> BoolArray:
    """Say which voltages of a channel were measured: they, their loads and errors are numbers."""
    u, errors = channel_signal(scan, channel)
    stated = [values for values in (u, errors, scan.normal_load) if values is not None]
    return np.asarray(np.all([np.isfinite(values) for values in stated], axis=0))


def scans_of_repeats(scans: Sequence[Scan], channel: str) -> tuple[list[Scan], tuple[int, ...]]:
    """Return each repeat as a scan of its own, and the number of the scan that it belongs to."""
    separate = []
    owners = []
    for i, scan in enumerate(scans):
        passes = scan.passes
        measured, readings = np.unique(passes[measured_mask(scan, channel)], return_counts=True)
        if measured.size and readings.min() < MINIMUM_POSITIONS:
            raise InputError(
                f"Repeat {measured[readings.argmin()] + 1} has {readings.min()} measured readings; "
                f"for a centre of its own it needs {MINIMUM_POSITIONS}.",
                cure='Take one centre for all (centre="common", --centre common).',
            )
        between = scan.u_zz_correlation if scan.kind == "points" else None
        if between is not None and across(between, passes):
            raise InputError(
                "u_zz_correlation correlates the noise of one repeat with that of another.",
                why="Repeats with centres of their own are fitted as separate measurements.",
                cure='Take one centre for all (centre="common", --centre common).',
            )
        separate += [scan.only_passes(number) for number in measured]
        owners += [i] * measured.size
    if len(separate) <= len(scans):
        raise InputError(
            "The scan has one repeat, to which a centre per repeat changes nothing.",
            cure="Leave it out (centre, --centre); or give the number of each reading's repeat "
            "(memscal import --repeat COLUMN).",
        )
    return separate, tuple(owners)


#: Loads that differ by more than this share are several.
_SAME_LOAD = 0.02


def scans_by_load(scans: Sequence[Scan]) -> tuple[list[Scan], tuple[int, ...]]:
    """Split scans whose repeats have loads of their own; return each one's number, too."""
    split = []
    owners = []
    for i, scan in enumerate(scans):
        parts = []
        loads = scan.normal_load
        if loads is not None:
            stated = np.isfinite(loads)
            numbers = np.unique(scan.passes[stated])
            means = np.array([loads[stated & (scan.passes == n)].mean() for n in numbers])
            left = np.argsort(means, kind="stable")
            while left.size and loads_differ(means):
                group = left[means[left] <= (1 + _SAME_LOAD) * means[left[0]]]
                left = left[group.size :]
                load = float(means[group].mean())
                parts.append(passes_at_load(scan, numbers[group], load))
        parts = parts or [scan]
        split += parts
        owners += [i] * len(parts)
    return split, tuple(owners)


def passes_at_load(scan: Scan, numbers: IndexArray, load: float) -> Scan:
    """Return passes as a scan of one load (N), of the relative uncertainty of the whole scan's."""
    u = scan.load_uncertainty and scan.load_uncertainty * load / scan.stated_load
    return replace(scan.only_passes(np.sort(numbers)), load=load, load_uncertainty=u)


def loads_differ(loads: ArrayLike) -> bool:
    """Whether loads (N) differ by more than repeats of one load do."""
    return bool(np.max(loads) > (1 + _SAME_LOAD) * np.min(loads))


def grouped(*keys: NDArray[Any]) -> IndexArray:
    """Number of the group of each point, (n,), of equal keys (n,)."""
    order = np.lexsort(keys)
    new = np.any([np.diff(key[order], prepend=key[order[:1]]) != 0 for key in keys], axis=0)
    group = np.empty_like(order)
    group[order] = np.cumsum(new)
    return group


def joined_points(scans: Sequence[ScanPoints], owners: Sequence[int] | None = None) -> ScanPoints:
    """Join the points of several scans, of which all state their noise, or none.

    ``owners``: the number of the scan that each is a part of; parts share their positions.
    """
    if len(scans) == 1:
        return scans[0]
    stated = [points.u_errors for points in scans if points.u_errors is not None]
    if len(stated) not in (0, len(scans)):
        raise InputError(
            "Some of the scans state their noise (u_zz_errors) and others do not.",
            why="It determines their relative weights.",
            cure="State it in every scan, or leave it out of every one.",
        )
    number = np.repeat(np.arange(len(scans)), [points.u.size for points in scans])
    before = np.cumsum([0, *(points.repeat.max() + 1 for points in scans)])
    own = ("free", "averaging", "curvature")
    if any(points.dynamics != scans[0].dynamics for points in scans):
        raise InputError(
            "The scans state different dynamics of the sensor.",
            cure="Give scans of one sensor, or correct /entry/instrument/stress_sensor/dynamics.",
        )
    names = ("x", "y", "u", "load", "x_errors", "velocity", "branch", "anew", "repeat", *own)
    columns: Values = {
        name: np.concatenate([getattr(each, name) for each in scans]) for name in names
    }
    columns["repeat"] += before[number]
    blocks = []
    first = 0
    for points in scans:
        if points.decorrelation:
            blocks += [(rows + first, root) for rows, root in points.decorrelation.blocks]
        first += points.u.size
    return replace(
        scans[0],
        **columns,
        u_errors=np.concatenate(stated) if stated else None,
        owner=number if owners is None else np.array(owners)[number],
        scan=number,
        missing=sum(points.missing for points in scans),
        decorrelation=Decorrelation(tuple(blocks)) if blocks else None,
    )


def _decorrelation(correlation: FloatArray, keep: BoolArray) -> Decorrelation:
    """Cholesky factors of the correlation of all kept points, repeat by repeat."""
    blocks = []
    first = 0
    roots = {}
    for measured in keep.reshape(-1, len(correlation)):
        kept = np.flatnonzero(measured)
        if not kept.size:
            continue
        key = measured.tobytes()
        if key not in roots:
            roots[key] = root_of(of_points(correlation, kept))
        blocks.append((np.arange(first, first + kept.size), roots[key]))
        first += kept.size
    return Decorrelation(tuple(blocks))


def ordinary_readings(points: ScanPoints) -> BoolArray:
    """Say which readings (n,) are not among a few that lie far beyond all others of their scan."""
    # A converter's sentinel would draw amplitude and baseline to itself, above all at an end.
    ordinary = np.ones(points.u.size, bool)
    share = _FEW_OF_RASTER if points.planar else _FEW_OF_LINE
    for inside in points.inside:
        rows = np.flatnonzero(inside)
        distance = abs(points.u[rows] - np.median(points.u[rows]))
        order = np.argsort(distance)
        few = max(int(share * rows.size), 1)
        farthest = distance[order[-few - 1 :]]
        beyond = farthest[1:] > _WILD * farthest[:-1]
        if beyond.any():
            ordinary[rows[order[np.argmax(beyond) - few :]]] = False
    return ordinary


def agreeing_tops(
    u: FloatArray, share: float = _AGREEING
) -> tuple[IndexArray, IndexArray, FloatArray]:
    """Order readings (n,) from the highest, and say how many of the first may be at a ceiling.

    With how far each is from the highest, at least a digit.
    """
    falling = np.argsort(-u, kind="stable")
    ordered = u[falling]
    apart = np.maximum(ordered[0] - ordered, _last_digit(u))
    count = np.arange(FEWEST_AT_CEILING, max(2 * (u.size - 1) // 3, FEWEST_AT_CEILING))
    steps = ordered[count - 1] - ordered[count + count // 2]
    count = count[ordered[0] - ordered[count - 1] <= share * steps]
    alike = apart[count - 1] <= _AS_ALIKE * apart[count[:1] - 1]
    return falling, count[alike], apart


def clipped_looks(u: FloatArray) -> FloatArray:
    """Return the highest readings that look as if held at a ceiling, none where none do."""
    if u.size < 2 * FEWEST_AT_CEILING or not np.ptp(u):
        return u[:0]
    falling, counts, _ = agreeing_tops(u, _LOOKING_SO)
    return u[falling[: counts.max(initial=0)]]


def _last_digit(u: FloatArray) -> float:
    """Step of readings (n,) of which all differ by multiples of one; zero of others."""
    steps = np.diff(np.unique(u))
    least = steps.min(initial=np.inf)
    for digits in range(1, _MOST_DIGITS + 1):
        number = digits * steps / least
        if abs(number - np.rint(number)).max(initial=0.0) < _WHOLE:
            return float(least) / digits
    return 0.0


def _require_usable(points: ScanPoints) -> None:
    positions = points.places[0].count
    needed = MINIMUM_POSITIONS + 2 * points.planar
    if positions < needed:
        raise FitError(
            f"The scan has {positions} measured positions; at least {needed} are needed.",
            why="Conversion constant, width, centre, baseline and noise are estimated from them.",
            cure="Scan more positions.",
        )
    if np.ptp(points.u) == 0:
        raise InputError(
            f"Every voltage of the scan is {points.u[0]:g} {points.reading.si}.",
            why="A calibration needs a voltage that follows the indenter.",
            cure="Check the channel.",
        )
    # The parity of a shear is tested later, by estimation.gaussian.
    if points.order:
        return
    # The median of three points does not follow a single outlier.
    kept = ordinary_readings(points)
    ordered = np.sort(rise_of(points.x, points.y, points.u / points.load)[kept])
    rise = np.median(ordered[-3:])
    fall = -np.median(ordered[:3])
    if fall > 1.5 * rise:
        raise InputError(
            f"The voltage falls by {points.reading.text(fall * points.load.mean(), '.4g')} where "
            "the indenter is above the sensor.",
            why="Normal stress is positive in compression, so the voltage must rise.",
            cure="Change the sign of u_zz (u_sign=-1; memscal import ... --u-sign -1), or swap the "
            "leads of the channel and measure again.",
        )


def require_size(scans: Sequence[Scan]) -> None:
    """Refuse more points than a calibration takes, before it does anything."""
    raster = any(scan.planar for scan in scans)
    size = sum(scan.u_zz.size for scan in scans)
    most = MOST_OF_RASTER if raster else MOST_OF_LINES
    if size > most:
        named = ", ".join(scan.source.file_name for scan in scans if scan.source) or "The scan"
        of = f"points {'in a plane' if raster else 'on lines'}"
        raise too_large(
            named,
            size,
            most,
            of,
            why="Time and memory grow with their number.",
            cure="Average neighbouring readings, thin the raster, or leave out repeats.",
        )


def across(correlation: FloatArray, group: IndexArray) -> bool:
    """Whether points of different groups (n,) are correlated."""
    if not is_banded(correlation):
        return bool(correlation[np.not_equal.outer(group, group)].any())
    columns = range(1, correlation.shape[1])
    return any(correlation[:-j, j][group[j:] != group[:-j]].any() for j in columns)
