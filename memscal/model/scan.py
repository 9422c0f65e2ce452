"""A scan: the sensor's voltage for many positions of the indenter."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field, replace
from functools import partial
from types import MappingProxyType
from typing import Any, Literal, NamedTuple, TypedDict, Unpack

import numpy as np
from numpy.typing import ArrayLike, NDArray

from memscal.errors import InputError, require_names
from memscal.extensions import hook
from memscal.model.arrays import (
    BoolArray,
    FloatArray,
    IndexArray,
    Values,
    finite_vector,
    frozen_array,
    keyword_array_record,
    require_non_negative,
    require_size,
    unmasked,
    warn_of_units,
)
from memscal.model.correlation import checked_correlation, of_points
from memscal.model.film import ElasticFilm
from memscal.model.indenter import RoundIndenter
from memscal.model.instrument import Equipment, LoadCell, StressSensor, User
from memscal.model.notation import Reading
from memscal.model.provenance import SourceFile
from memscal.model.stress import StressProfile

LIKE_SIGNAL = (
    "u_zz_errors",
    "normal_load",
    "normal_load_errors",
    "tangential_load",
    "time",
    "sliding_direction",
)
"""Arrays of a scan that have the shape of its readings, where they are stated."""

OF_SENSORS = ("layout", "layout_uncertainty", "used", "reading_low", "reading_high", "board")
"""What the scan of an array may state of its sensors; one value is that of each of them."""

LUBRICATIONS = ("", "dry", "lubricated")
"""States of lubrication; empty where a scan states none."""

MOTIONS = ("", "pressed", "sliding", "rest")
"""How an indenter moved; one that states nothing was pressed.  A noise record has none: rest."""

DIRECTIONS = {"forth": 1.0, "back": -1.0}
"""Signs of the directions of a sliding indenter: along the positions, and against them."""

STATED_ERRORS = (
    "position_scale",
    "gain",
    "gain_curvature",
    "roundness",
    "line_offset",
    "base_slip",
    "baseline_curvature",
    "shear_sensitivity",
)
"""What a scan takes for granted unless it states a standard uncertainty, by its budget's names."""

BRANCHES = {"approach": 1, "retreat": 2}
"""Numbers of the indenter's branches; 0 where none is stated."""

#: One value of these is that of a whole row, or of all.
_BY_ROW = ("branch", "sliding_direction")
#: Points that spread by less of their length across it are a line.
LINE = 0.01


#: What is possible of what an array states, if not any finite number; what is that of the scan of
#: each sensor is proved with it.
_POSSIBLE: dict[str, Callable[[FloatArray], BoolArray]] = {
    "u_zz_errors": np.isreal,
    "used": lambda values: np.isin(values, (0, 1)),
    "layout_uncertainty": lambda values: (values >= 0) & np.isfinite(values),
    "reading_low": lambda values: ~np.isnan(values),
    "reading_high": lambda values: ~np.isnan(values),
}


def _of_sensors(name: str, stated: ArrayLike, shape: tuple[int, ...]) -> NDArray[Any]:
    """Prove what an array states of its sensors, each or all of them, and return it in full."""
    values = frozen_array(stated, name=f"{name} of the scan")
    possible = _POSSIBLE.get(name, np.isfinite)(values)
    fewest = len(shape) if name == "layout" else 0
    fits = values.ndim >= fewest and values.shape == shape[: values.ndim]
    if not fits or not possible.all():
        raise InputError(
            f"{name} of the scan has shape {values.shape} and {possible.sum()} possible values, "
            f"but it should be {shape}.",
            why=f"There are {shape[0]} sensors. used is 0 or 1, an uncertainty finite and not "
            "negative; an end of a range may be infinite, all else is finite.",
            cure="Give such values of that shape, or leave it out.",
        )
    require_size(f"{name} of the scan", values[np.isfinite(values)], smallest=0.0)
    # By its first axes, not by its last ones: one value for each sensor, or for all.
    whole = np.broadcast_to(values.T, shape[::-1]).T
    return whole > 0 if name == "used" else whole


def require_rod_friction(friction: float | None) -> None:
    """Refuse a friction of the rod that no film of rubber is solved with."""
    if friction not in (None, 0.0, math.inf):
        raise InputError(
            f"The rod's friction is {friction!r}.",
            why="Only a rod that slides freely or sticks is solved at finite strain.",
            cure="Give 0 or inf, or leave it out: the difference is then counted.",
        )


def require_single(scan: Scan) -> None:
    """Refuse the scan of an array where that of one sensor is meant."""
    if scan.sensors:
        raise InputError(
            f"{scan.source.file_name if scan.source else 'The scan'} is that of an array of "
            f"{len(scan.sensors)} sensors.",
            why="What a sensor reads of its neighbours changes its A: it is no single sensor.",
            cure="Calibrate the array (memscal calibrate, memscal.calibrate_array), and locate "
            "contacts (memscal locate). The scan of one sensor by itself is scan.of_sensor(name).",
        )


def require_pressed(motion: str, source: SourceFile | None) -> None:
    """Refuse the scan of an indenter that slid, and one of none, at rest."""
    if motion == "rest":
        raise InputError(
            f"{source.file_name if source else 'The scan'} is a noise record or a dwell record.",
            why="It has readings in time at one place, and no positions.",
            cure="Give a noise record beside a scan (noise_record, --noise-record), and a dwell "
            "record, which states its indenter, to memscal creep.",
        )
    if motion == "sliding":
        raise InputError(
            f"{source.file_name if source else 'The scan'} was made with a sliding indenter "
            "(/entry/indenter/motion).",
            why="The calculated contacts are those of an indenter that is pressed straight down; "
            "sliding friction shifts and skews the stress at the base of the film.",
            cure="Give a scan whose indenter was pressed at each place. What stress a sliding one "
            "made, memscal restore finds, and the friction of a sphere memscal compare --sliding.",
        )


def require_sliding(motion: str, source: SourceFile | None) -> None:
    """Refuse the scan of an indenter that did not slide."""
    if motion != "sliding":
        raise InputError(
            f"{source.file_name if source else 'The scan'} does not state that its indenter slid "
            "(/entry/indenter/motion).",
            why="Sliding contacts (sliding, --sliding) are not those of an indenter that is "
            "pressed.",
            cure="Leave out --sliding (sliding=True), or state the motion: memscal import "
            "--sliding.",
        )


def branch_numbers(name: str, stated: ArrayLike) -> NDArray[np.int64]:
    """Return branches, given by number or by word, as an array of numbers."""
    values = np.asarray(unmasked(stated))
    numbers = values
    named = {"": 0, **BRANCHES}
    if values.dtype.kind not in "biuf":
        words = [named.get(v.strip().lower(), -1) if isinstance(v, str) else v for v in values.flat]
        numbers = np.array(words).reshape(values.shape)
    known = np.isin(numbers, list(named.values()))
    if not known.all():
        raise InputError(
            f"{name} holds {values[~known][0]}, which names no branch.",
            why="It says whether the indenter approached (was loaded) or retreated (was unloaded).",
            cure="Give 1 or 'approach', 2 or 'retreat', and 0 where it is not known.",
        )
    return numbers.astype(np.int64)


class SetUp(NamedTuple):
    """What a scan was made with; the load in N."""

    film: ElasticFilm
    indenter: RoundIndenter
    load: float
    rod_friction: float | None

    @property
    def expected(self) -> SetUp:
        """The same with the film that is expected, of a Poisson's ratio of at most 1/2."""
        return self._replace(film=self.film.expected)

    def under(self, law: str) -> SetUp:
        """Return the same with a film of a law without further parameters."""
        return self._replace(film=replace(self.film, law=law, mooney_rivlin_ratio=None))


class ArrayOptions(TypedDict, total=False):
    """What :meth:`Scan.from_arrays` takes: arrays like ``u``, and fields of the records."""

    y: ArrayLike
    repeat: ArrayLike
    branch: ArrayLike
    u_errors: ArrayLike
    load_column: ArrayLike
    depth: ArrayLike
    u_xz: ArrayLike
    u_yz: ArrayLike
    time: ArrayLike
    sliding: ArrayLike
    tangential_load: ArrayLike
    x_unit: str
    u_unit: str
    load_unit: str
    time_unit: str
    speed: float
    step: float
    u_sign: int
    holds: bool
    depth_unit: str
    baseline: Literal["before-each"]
    ceiling: float
    film: ElasticFilm
    indenter: RoundIndenter
    load: float
    rod_friction: float
    lubrication: str
    lubricant: str
    sensor: StressSensor
    load_cell: LoadCell
    stage: Equipment
    user: User
    direction: str
    title: str
    start_time: str
    end_time: str
    reference: StressProfile
    synthetic: Mapping[str, float | str]
    noise: float
    load_uncertainty: float
    load_scatter: float
    x_error: float
    position_errors_by_repeat: bool
    position_scale_uncertainty: float
    gain_uncertainty: float
    gain_curvature_uncertainty: float
    roundness_uncertainty: float
    line_offset_uncertainty: float
    base_slip_uncertainty: float
    baseline_curvature_uncertainty: float
    shear_sensitivity_uncertainty: float
    u_zz_correlation: FloatArray
    motion: str
    sliding_friction: float
    sliding_friction_uncertainty: float
    averaging_length: float
    dwell_time: float


@keyword_array_record
class Scan:
    r"""Sensor voltage against the position of the indenter, with what it was measured on.

    A scan has one of four forms, named by ``kind``:

    ========= ============= ======== =========== =================================
    kind      ``u_zz``      ``y``    ``repeat``  what it is
    ========= ============= ======== =========== =================================
    line      (n,)          none     none        one pass along a line
    repeats   (repeat, n)   none     none        passes over the same positions
    raster    (m, n)        (m,)     none        rows and columns
    points    (n,)          (n,)     optional    readings anywhere in the plane
    points    (n,)          none     (n,)        readings along a line, in passes
    ========= ============= ======== =========== =================================

    ``sensors`` make it the scan of an array under one film: the first axis of ``u_zz`` is then the
    sensor, before those of the table.  Positions, loads, branch and time have no such axis: one
    press is one press.

    Parameters
    ----------
    x : ndarray, shape (n,)
        Positions along the scan, in m; need not be sorted, centred or evenly spaced.
    u_zz : ndarray, shape (n,), (repeat, n) or (m, n)
        Normal channel's voltage, in V, or reading, in ``unit``; NaN marks a missing point.
    unit : str
        SI unit of the readings: ``"V"``, ``"A"``, ``"T"``, ``"Pa"`` ..., ``"1"`` of counts.
    load, load_uncertainty : float, optional
        Nominal load of the indenter and its standard uncertainty, common to all points, in N.
    indenter, film, sensor, load_cell, stage, user
        What was pressed, on what, measured by what, what gave load and position, and who measured.
        A calibration with a reference of its own needs no load, indenter or film; all else does.
    rod_friction : float, optional
        0 where a rod slides freely under the film, ``inf`` where it sticks.
    y : ndarray, shape (m,) of a raster, (n,) of points, optional
        Second axis of a raster, or second position of each point, in m.
    repeat : ndarray of int, shape (n,), optional
        Which pass each of the points belongs to: any whole numbers.
    branch : ndarray of int, shape of ``u_zz``, optional
        1 where the indenter approached (was loaded), 2 where it retreated (was unloaded), 0 where
        that is not known; the words ``"approach"`` and ``"retreat"``, and one value for each row
        of a ``u_zz`` of two axes, are accepted.
    u_zz_errors : ndarray, shape of ``u_zz``, optional
        Standard uncertainty of each voltage (electronic noise), in V; of an array also one value
        for each sensor.
    normal_load, normal_load_errors : ndarray, shape of ``u_zz``, optional
        Load at each point where it was recorded, and its standard uncertainty, independent from
        point to point, in N.
    tangential_load : ndarray, shape of ``u_zz``, optional
        Load along the positions at each point where it was recorded, in N.
    time : ndarray, shape of ``u_zz``, optional
        Time of each reading from the first one, in s; NaN where it is not known.
    averaging_length : float, optional
        Way along the scan, in m, over which each reading is the mean, centred on its position.
    dwell_time : float, optional
        How long the indenter was held at each place before its reading, in s.
    noise_record : Scan, optional
        Readings at rest, whose noise the readings have, in place of a stated one.
    x_errors : ndarray, shape of ``x``, optional
        Standard uncertainty of each position, independent from position to position, in m.
    position_errors_by_repeat : bool
        Whether these errors are new in each repeat; else all repeats at a position share its error.
    u_zz_correlation : ndarray, shape (n, n), or (m n, m n) of a raster, optional
        Correlation of the noise between the points of one repeat (of kind points: between all);
        none where absent.  With shape (n, w) that of each point with itself and the next w - 1.
    at_ceiling : int
        How many readings at a ceiling an import left out, which are missing.
    direction : str
        ``"x"`` or ``"y"``: which way a line scan ran across the sensor; its positions are in ``x``.
    position_scale_uncertainty : float, optional
        Relative standard uncertainty of the stage's scale, common to all positions.
    line_offset : float
        Distance at which a line passes the sensor's centre, in m.
    gain_uncertainty, gain_curvature_uncertainty : float, optional
        Relative standard uncertainty of the sensor's chain, common to all readings; and b of a
        reading :math:`U (1 - b\,U/U_{max})`.
    roundness_uncertainty, line_offset_uncertainty : float, optional
        Standard uncertainty of the sensor's axis ratio less one, and of the distance at which a
        line passes its centre, in m.
    base_slip_uncertainty, baseline_curvature_uncertainty : float, optional
        That of the share of the difference to a base on which the film slides freely; and of the
        baseline from the edge of the scan to its centre, over the largest signal.
    shear_sensitivity_uncertainty : float, optional
        That of the length, in m, by which the sensor responds to the divergence of the shear.
    channels : mapping of str to ndarray, shape of ``u_zz``
        Further channels (``u_xz``, ``u_yz``), in V, and where stated their noise
        (``u_xz_errors``, ``u_yz_errors``).
    motion : str
        ``"pressed"`` at each place, which an empty one stands for, or ``"sliding"``; ``"rest"``
        of a noise record, readings in time with nothing pressed, whose positions are zero, and of
        a dwell record, the same under an ``indenter``.
    sliding_direction : ndarray, shape of ``u_zz``, optional
        1 where a sliding indenter moved along the positions, -1 where against them; one value, and
        one for each row of a ``u_zz`` of two axes, are accepted.
    speed : float, optional
        Speed of the indenter, in m/s; used where no ``time`` tells it.
    sliding_friction, sliding_friction_uncertainty : float, optional
        Tangential over normal load of a sliding indenter, where it was measured.
    lubrication, lubricant : str
        ``"dry"`` or ``"lubricated"``, empty if not stated, and the name of the lubricant.
    title, start_time, end_time, notes : str
        Free text; times in ISO 8601.
    reference, source : StressProfile, SourceFile, optional
        A base stress that travels with the scan; the file the scan was read from.
    synthetic : mapping, optional
        The known truth of a simulated scan, SI units; present only in synthetic data.

    Raises
    ------
    InputError
        If shapes disagree, a position is not finite, or a load is not positive.

    Examples
    --------
    >>> from memscal.model.indenter import Rod
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> scan = Scan(x=[-1e-3, 0, 1e-3], u_zz=[1e-3, 3e-3, 1e-3], load=1.0,
    ...             indenter=Rod(radius=0.25e-3), film=film)
    >>> scan.kind
    'line'
    """

    x: FloatArray
    u_zz: FloatArray
    load: float | None = None
    indenter: RoundIndenter | None = None
    film: ElasticFilm | None = None
    unit: str = "V"
    sensors: tuple[str, ...] = ()
    layout: FloatArray | None = None
    layout_uncertainty: FloatArray | None = None
    used: BoolArray | None = None
    reading_low: FloatArray | None = None
    reading_high: FloatArray | None = None
    board: FloatArray | None = None
    sensor: StressSensor = field(default_factory=StressSensor)
    load_cell: LoadCell = field(default_factory=LoadCell)
    stage: Equipment = field(default_factory=Equipment)
    user: User = field(default_factory=User)
    y: FloatArray | None = None
    repeat: NDArray[np.int64] | None = None
    branch: NDArray[np.int64] | None = None
    u_zz_errors: FloatArray | None = None
    normal_load: FloatArray | None = None
    normal_load_errors: FloatArray | None = None
    tangential_load: FloatArray | None = None
    time: FloatArray | None = None
    averaging_length: float | None = None
    dwell_time: float | None = None
    noise_record: Scan | None = None
    x_errors: FloatArray | None = None
    position_errors_by_repeat: bool = False
    u_zz_correlation: FloatArray | None = None
    at_ceiling: int = 0
    direction: str = "x"
    position_scale_uncertainty: float | None = None
    line_offset: float = 0.0
    gain_uncertainty: float | None = None
    gain_curvature_uncertainty: float | None = None
    roundness_uncertainty: float | None = None
    line_offset_uncertainty: float | None = None
    base_slip_uncertainty: float | None = None
    baseline_curvature_uncertainty: float | None = None
    shear_sensitivity_uncertainty: float | None = None
    channels: Mapping[str, FloatArray] = field(default_factory=dict)
    load_uncertainty: float | None = None
    rod_friction: float | None = None
    motion: str = ""
    sliding_direction: FloatArray | None = None
    speed: float | None = None
    sliding_friction: float | None = None
    sliding_friction_uncertainty: float | None = None
    lubrication: str = ""
    lubricant: str = ""
    title: str = ""
    start_time: str = ""
    end_time: str = ""
    notes: str = ""
    reference: StressProfile | None = None
    synthetic: Mapping[str, float | str] | None = None
    source: SourceFile | None = None

    def __post_init__(self) -> None:
        if len(self.sensors) or self.layout is not None:
            self._freeze_array()
            return
        self._freeze_positions()
        u_zz = frozen_array(self.u_zz, name="u_zz of the scan")
        object.__setattr__(self, "u_zz", u_zz)
        self._check_signal_shape()
        self._freeze_readings()
        self._check_values()
        self._check_set_up()
        warn_of_units(self.film, self.indenter)
        if self.u_zz_correlation is not None:
            points = self.u_zz.size if self.planar else self.x.size
            correlation = checked_correlation(self.u_zz_correlation, points)
            object.__setattr__(self, "u_zz_correlation", correlation)

    @staticmethod
    def from_arrays(x: ArrayLike, u: ArrayLike, **options: Unpack[ArrayOptions]) -> Scan:
        """Return a scan of arrays in any units, checked as :func:`memscal.import_table` checks.

        Parameters
        ----------
        x, u : array_like
            Positions (n,) and readings, (n,) or (repeat, n).
        **options
            Of :func:`memscal.import_table`: ``x_unit`` (default: m), ``u_unit`` (V), ``film``,
            ``load`` ...; what names a column there (``y``, ``repeat``, ...) is an array like ``u``.

        Examples
        --------
        >>> Scan.from_arrays([-8, 0, 8], [[0.1, 2, 0.1], [0.2, 2, 0.1]], x_unit="mm", u_unit="mV")
        <ImportedScan: repeats, 2 x 3 points, x from -8 to 8 mm, no load stated>
        """
        scan: Scan = hook("scan_of_arrays")(x, u, **options)
        return scan

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the fields, and prove them again: a read-only mapping cannot be pickled."""
        values = {name: getattr(self, name) for name in Scan.__dataclass_fields__}
        return partial(Scan, **{**values, "channels": dict(self.channels)}), ()

    def __repr__(self) -> str:
        """Return what was scanned in place of thousands of array elements."""
        shape = " x ".join(map(str, self.u_zz.shape))
        form = shape if self.kind == "points" else f"{self.kind}, {shape}"
        reach = f"{self.x.min() * 1e3:.4g} to {self.x.max() * 1e3:.4g} mm"
        if self.motion == "rest":
            return f"<{type(self).__name__}: noise record, {shape} readings>"
        load = "no load stated" if self.load is None else f"load {self.load:.4g} N"
        return f"<{type(self).__name__}: {form} points, x from {reach}, {load}>"

    @property
    def set_up(self) -> SetUp:
        """Film, indenter and load; a scan that does not state all of them is refused."""
        film = self.film
        indenter = self.indenter
        load = self.load
        if film is not None and indenter is not None and load is not None:
            return SetUp(film, indenter, load, self.rod_friction)
        places = {
            "film (/entry/sample/film)": film,
            "indenter (/entry/indenter)": indenter,
            "load (/entry/indenter/load)": load,
        }
        missing = " and no ".join(place for place, stated in places.items() if stated is None)
        cure = "--relative (relative=True): centre, widths and G, with a relative A"
        if film is None or indenter is None:
            cure = (
                '--reference point (reference="point"), or another source in their place: centre '
                "and width of the image, and a G in which film and rod blur"
            )
        raise InputError(
            f"{self.source.file_name if self.source else 'The scan'} states no {missing}.",
            why="The stress that an indenter makes at the base of a film is calculated from them.",
            cure="State them (memscal import --thickness, --radius, --load). What a calibration "
            f"finds without them: {cure}.",
        )

    @property
    def stated_load(self) -> float:
        """The nominal load, in N; a scan that states none is refused."""
        return self.set_up.load if self.load is None else self.load

    @property
    def reading(self) -> Reading:
        """The unit in which the readings are shown."""
        return Reading.fitting(self.unit, np.nanmax(np.abs(self.u_zz), initial=0.0))

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of the readings of one sensor."""
        return self.u_zz.shape[bool(self.sensors) :]

    def of_sensor(self, sensor: str | int) -> Scan:
        """Return the scan of one sensor of an array by itself, by its name or number (from 0)."""
        i = sensor
        if isinstance(i, str):
            require_names("There is no sensor", [i], self.sensors)
            i = self.sensors.index(i)
        own: Values = dict.fromkeys(OF_SENSORS)
        if self.u_zz_errors is not None:
            own["u_zz_errors"] = self.u_zz_errors[i]
        described = replace(self.sensor, name=self.sensors[i])
        return replace(self, u_zz=self.u_zz[i], sensors=(), sensor=described, **own)

    @property
    def kind(self) -> str:
        """``"line"``, ``"repeats"``, ``"raster"`` or ``"points"``."""
        if len(self.shape) == 1:
            return "line" if self.y is None and self.repeat is None else "points"
        return "repeats" if self.y is None else "raster"

    @property
    def planar(self) -> bool:
        """Whether the positions spread over x and y."""
        return self.y is not None

    @property
    def positions(self) -> tuple[FloatArray, FloatArray]:
        """Position of every voltage along x and y, in m, each like ``u_zz`` of one sensor."""
        along = np.broadcast_to(self.x, self.shape)
        if self.y is not None:
            y = self.y.reshape(-1, *[1] * (len(self.shape) - 1))
            return along, np.broadcast_to(y, along.shape)
        across = np.full(self.shape, self.line_offset)
        return (across, along) if self.direction == "y" else (along, across)

    @property
    def passes(self) -> IndexArray:
        """Which pass each voltage belongs to, counted from zero, of the shape of ``u_zz``."""
        if self.repeat is not None:
            return np.unique(self.repeat, return_inverse=True)[1]
        rows = np.arange(self.shape[0]) if self.kind == "repeats" else np.zeros(1, np.intp)
        return np.broadcast_to(rows.reshape(-1, *[1] * (len(self.shape) - 1)), self.shape)

    def only_passes(self, numbers: ArrayLike) -> Scan:
        """Return the passes with these numbers (of ``passes``), as a scan of the same kind."""
        if self.kind in ("line", "raster"):
            return self  # one pass
        if self.kind == "repeats":
            return replace(self, **_rows(self, np.atleast_1d(numbers)))
        return only_points(self, np.flatnonzero(np.isin(self.passes, numbers)))

    @property
    def directions(self) -> tuple[str, ...]:
        """In which of ``"forth"`` and ``"back"`` a sliding indenter moved; none if not stated."""
        return tuple(
            word for word, sign in DIRECTIONS.items() if np.any(self.sliding_direction == sign)
        )

    def only_direction(self, direction: str | None) -> Scan:
        """Return the passes of a direction, which may be left out where the scan has not two."""
        held = self.directions
        if direction is None and len(held) < 2:
            return self
        if direction not in held:
            raise InputError(
                f"The indenter {'slid ' if held else 'has no direction of sliding'}"
                f"{' and '.join(held)}, and {direction or 'no direction'} is chosen.",
                why="Forth the stress under it is not that of the way back.",
                cure="Choose one of those of the scan: direction='forth' or 'back' (--direction).",
            )
        slid = self.passes[self.sliding_direction == DIRECTIONS[direction]]
        passes = self.only_passes(np.unique(slid))
        if passes.directions != (direction,):
            raise InputError(
                "A pass of the scan holds both directions of sliding.",
                cure="Number the passes (repeat, --repeat COLUMN), or give each direction as a "
                "scan of its own.",
            )
        return passes

    def _freeze_array(self) -> None:
        """Freeze what an array states of its sensors, and prove the scan of each by itself."""
        names = tuple(map(str, self.sensors))
        number = len(names)
        u_zz = frozen_array(self.u_zz, name="u_zz of the scan")
        distinct = all(name.isprintable() for name in names) and len({*names, ""}) > number
        faults = {
            "states layout, board or range, but names no sensors": not names,
            f"names its sensors {', '.join(map(repr, names))}": not distinct,
            f"names {number} sensors, and u_zz has shape {u_zz.shape}": u_zz.shape[:1] != (number,),
            f"has further channels, {', '.join(self.channels)}": bool(self.channels),
        }
        for problem, wrong in faults.items():
            if wrong:
                raise InputError(
                    f"The scan {problem}.",
                    why="Each sensor of an array has readings along the first axis of u_zz, and a "
                    "name in one line, unlike all others.",
                    cure="Name each sensor (sensors, --u of each), none twice, and further "
                    "channels as sensors of their own; of one sensor leave layout (--layout), "
                    "board and range out.",
                )
        if self.motion == "rest":
            raise InputError(
                f"The record at rest is of {number} sensors.",
                why="Noise of an array is found in its scan, and a dwell is that of one sensor.",
                cure="Give the readings of one sensor (--u COLUMN).",
            )
        own: Values = {"sensors": names, "sensor": self.sensor, "u_zz": u_zz}
        shapes = {"u_zz_errors": u_zz.shape, **dict.fromkeys(OF_SENSORS, (number,))}
        shapes |= {"layout": (number, 2), "layout_uncertainty": (number, 2)}
        for name, shape in shapes.items():
            stated = getattr(self, name)
            own[name] = None if stated is None else _of_sensors(name, stated, shape)
        low = own["reading_low"]
        high = own["reading_high"]
        if low is not None and high is not None and np.any(low >= high):
            raise InputError(
                "reading_low of the scan is not below reading_high.",
                why="Readings at or beyond them are left out.",
                cure="Give the lower end of the range of each sensor, and the upper one.",
            )
        vars(self).update(own)
        first, *_ = map(self.of_sensor, range(number))
        vars(self).update(vars(first) | own)

    def _freeze_positions(self) -> None:
        for name in ("x", "y"):
            stated = getattr(self, name)
            if stated is not None:
                values = finite_vector(f"{name} of the scan", stated)
                require_size(f"{name} of the scan (/entry/data/{name})", values, "m", smallest=0.0)
                object.__setattr__(self, name, values)
        if self.repeat is not None:
            repeat = frozen_array(self.repeat)
            whole = np.isfinite(repeat) & (repeat == np.rint(repeat))
            if repeat.ndim != 1 or not whole.all():
                raise InputError(
                    f"repeat of the scan has shape {repeat.shape}, or holds values that are no "
                    "whole numbers.",
                    cure="Give one whole number for each point.",
                )
            object.__setattr__(self, "repeat", frozen_array(repeat, dtype=np.int64))
        if self.x_errors is not None:
            errors = finite_vector("x_errors of the scan", self.x_errors)
            if errors.shape != self.x.shape or np.any(errors < 0):
                raise InputError(
                    f"x_errors has length {errors.size} for {self.x.size} positions, the "
                    f"smallest {errors.min(initial=0.0) * 1e3:.4g} mm.",
                    cure="Give one standard uncertainty for each position, in m, none negative.",
                )
            object.__setattr__(self, "x_errors", errors)

    def _check_signal_shape(self) -> None:
        n = self.x.size
        shape = self.u_zz.shape
        if self.y is None:
            good = len(shape) in (1, 2) and shape[-1:] == (n,) and self.u_zz.size > 0
            expected = f"({n},) or (repeat, {n})"
        else:
            good = shape == (self.y.size, n) or shape == (n,) == self.y.shape
            expected = f"({self.y.size}, {n}), from y and x"
            if self.y.size == n:
                expected += f", or ({n},), one voltage for each point"
        if not good:
            raise InputError(f"u_zz has shape {shape}, but it should be {expected}.")
        if self.repeat is not None and not self.repeat.shape == self.x.shape == shape:
            raise InputError(
                f"repeat has shape {self.repeat.shape}, but x has {self.x.shape} and u_zz {shape}.",
                why="It numbers the pass of each point; rows of a u_zz of two axes are passes.",
            )
        if self.kind == "points" and self.y is not None:
            spread = np.ptp(self.x), np.ptp(self.y)
            thin = np.argmin(spread)
            if spread[thin] <= LINE * spread[1 - thin]:
                raise InputError(
                    f"The points spread over {spread[0] * 1e3:.4g} mm along x and "
                    f"{spread[1] * 1e3:.4g} mm along y.",
                    why=f"With less than {LINE:.0%} of the one along the other they are a line: "
                    "the centre across it is not determined.",
                    cure="Leave y out."
                    if thin
                    else "Give the positions along y as x; direction='y'.",
                )

    def _freeze_readings(self) -> None:
        require_size("u_zz of the scan", self.u_zz)
        channels = {name: self._like_signal(name, u) for name, u in self.channels.items()}
        object.__setattr__(self, "channels", MappingProxyType(channels))
        for name in LIKE_SIGNAL:
            values = getattr(self, name)
            if values is not None:
                object.__setattr__(self, name, self._like_signal(name, values))
        if self.branch is not None:
            branch = branch_numbers("branch of the scan", self.branch)
            object.__setattr__(self, "branch", self._like_signal("branch", branch, np.int64))

    def _like_signal(self, name: str, values: ArrayLike, dtype: Any = np.float64) -> FloatArray:
        array = frozen_array(values, dtype=dtype)
        if name in _BY_ROW and array.shape in ((), self.u_zz.shape[:-1]):
            array = np.broadcast_to(array[..., None], self.u_zz.shape)
        if array.shape != self.u_zz.shape:
            raise InputError(f"{name} has shape {array.shape}, but u_zz has {self.u_zz.shape}.")
        require_size(f"{name} of the scan", array)
        return array

    def _check_values(self) -> None:
        for name in ("u_zz", "time", "tangential_load"):
            values = getattr(self, name)
            if values is not None and np.any(np.isinf(values)):
                raise InputError(
                    f"{name} holds an infinite value.", cure="Mark missing points with NaN."
                )
        signs = self.sliding_direction
        if signs is not None and (self.motion != "sliding" or np.any(np.abs(signs) != 1)):
            raise InputError(
                f"The scan has directions of sliding, {np.unique(signs)}, and its motion is "
                f"{self.motion or 'pressed'}.",
                why="An indenter that slides moves along the positions, 1, or against them, -1.",
                cure="Give the motion 'sliding' (/entry/indenter/motion) and directions of 1 and "
                "-1 (/entry/data/direction), or no directions.",
            )
        for name in ("u_zz_errors", "normal_load_errors"):
            errors = getattr(self, name)
            if errors is not None and np.any((errors < 0) | np.isinf(errors)):
                raise InputError(
                    f"{name} holds a standard uncertainty that is negative or infinite."
                )
        loads = self.normal_load
        if loads is None:
            return
        if np.any((loads <= 0) | np.isinf(loads)):
            raise InputError(
                "normal_load holds a load that is infinite or not above zero.",
                cure="Mark points without contact as missing (NaN).",
            )
        if np.isnan(loads).all():
            raise InputError(
                "normal_load is missing (NaN) at every point.",
                cure="Leave it out, and state the one load of all points.",
            )

    def _check_set_up(self) -> None:
        if self.direction not in ("x", "y") or (self.direction == "y" and self.y is not None):
            raise InputError(
                f"The direction of the scan is {self.direction!r}.",
                cure="A line scan runs along 'x' or 'y'; a raster has its own y.",
            )
        errors = [f"{name}_uncertainty" for name in ("load", "sliding_friction", *STATED_ERRORS)]
        for name in (*errors, "averaging_length", "dwell_time", "speed", "sliding_friction"):
            require_non_negative(f"{name.replace('_', ' ')} of the scan", getattr(self, name))
        record = self.noise_record
        if record is not None and getattr(record, "motion", "") != "rest":
            raise InputError(
                f"The noise record of the scan is {record!r}.",
                cure="Give readings at rest, as read_scan() returns them (motion='rest').",
            )
        require_rod_friction(self.rod_friction)
        if self.normal_load_errors is not None and self.normal_load is None:
            raise InputError(
                "normal_load_errors is given without normal_load.",
                why="It is the standard uncertainty of the load at each point.",
                cure="Give normal_load too, the load that was set at each point.",
            )
        if self.lubrication not in LUBRICATIONS:
            raise InputError(
                f"The lubrication of the scan is {self.lubrication!r}.",
                cure="Give 'dry' or 'lubricated', or leave it out.",
            )
        if self.motion not in MOTIONS:
            raise InputError(
                f"The motion of the indenter is {self.motion!r}.",
                cure="Give 'pressed' or 'sliding' (/entry/indenter/motion), or leave it out.",
            )
        if self.lubricant and self.lubrication != "lubricated":
            stated = self.lubrication or "not stated"
            raise InputError(
                f"The scan names a lubricant, {self.lubricant!r}, but its lubrication is {stated}.",
                cure="Give the lubrication 'lubricated', or leave the lubricant out.",
            )
        if self.load is None:
            return
        if not 0 < self.load < math.inf:
            raise InputError(
                f"The load of the scan is {self.load:g} N, but it must be above zero.",
                why="A calibration divides the voltage by the stress that this load produces.",
                cure="Give the indenter's load (/entry/indenter/load).",
            )
        if (self.load_uncertainty or 0.0) >= self.load:
            raise InputError(
                f"The standard uncertainty of the load is {self.load_uncertainty:g} N, but the "
                f"load is {self.load:g} N.",
                why="By a load that may be zero nothing is known of the stress.",
                cure=f"Give it in N: 1 % of the load are {0.01 * self.load:g} N.",
            )


def only_points(scan: Scan, keep: IndexArray, **changes: Any) -> Scan:
    """Return some points of a scan of kind points, with changes of other fields."""
    chosen = _rows(scan, keep, "x", "y", "repeat", "x_errors")
    if scan.u_zz_correlation is not None:
        chosen["u_zz_correlation"] = of_points(scan.u_zz_correlation, keep)
    return replace(scan, **(chosen | changes))


def _rows(scan: Scan, keep: IndexArray, *names: str) -> Values:
    """Return some rows of the readings, of what is stated like them, and of further arrays."""
    stated = {name: getattr(scan, name) for name in (*names, "branch", "u_zz", *LIKE_SIGNAL)}
    rows = {n: values[keep] for n, values in stated.items() if values is not None}
    rows["channels"] = {name: values[keep] for name, values in scan.channels.items()}
    return rows


def common_circumstances(scans: Sequence[Scan]) -> Values:
    """Return what gave loads and positions, and who measured, if common to all scans, and when."""
    first = scans[0]
    same_cell = all(first.load_cell.same_as(scan.load_cell) for scan in scans)
    same_stage = all(first.stage == scan.stage for scan in scans)
    same_user = all(first.user == scan.user for scan in scans)
    return {
        "load_cell": first.load_cell if same_cell else LoadCell(),
        "stage": first.stage if same_stage else Equipment(),
        "user": first.user if same_user else User(),
        # Times in ISO 8601 and one time zone have the order of their texts.
        "start_time": min(scan.start_time for scan in scans),
        "end_time": max(scan.end_time for scan in scans) if all(s.end_time for s in scans) else "",
    }
