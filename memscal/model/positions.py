"""Positions of a scan: which readings share a place, and lengths held against film and rod."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.scan import Scan

IntArray = NDArray[np.intp]

#: Readings share a place where they are closer than this share of the distance that nine tenths
#: of the readings of a pass keep from each other; a few may be read twice in one.
_CLOSE = 0.1
_TWICE = 0.1
#: Of many passes over a plane there are too many pairs of readings: positions are rounded to this
#: share of what is close where there may be more pairs.
_GRAIN = 0.1
_MOST_PAIRS = 20_000_000
#: Distances below a nanometre are rounding.
_ROUNDING = 1e-9
#: Rows and columns make a raster if they cross at no more than this many nodes for each place.
_MOST_NODES = 4
#: Largest distance of a reading from its node of an even lattice, over the lattice's step.
_OFF_LATTICE = 0.1
_CANDIDATES = 200


@dataclass(frozen=True, eq=False)
class Places:
    """Places of the points of one scan."""

    index: IntArray  # (n,): the place of each point
    row: IntArray  # (n,): its row along y, 0 on a line
    # Typical distance of neighbours along x and y, in m, 0 along an axis without spread.
    steps: tuple[float, float]

    @property
    def count(self) -> int:
        """How many places there are."""
        return int(self.index.max()) + 1

    @property
    def readings(self) -> IntArray:
        """Number of readings at the place of each point, shape (n,)."""
        return np.bincount(self.index)[self.index]


@dataclass(frozen=True, eq=False)
class EvenAxis:
    """An even lattice along one axis: ``start`` and ``step`` in m, ``index`` (n,) of each point."""

    start: float
    step: float
    index: IntArray


def places_of(x: FloatArray, y: FloatArray, repeat: IntArray) -> Places:
    """Group points by place: equal positions, and of several passes those close to each other."""
    # Close is a tenth of the usual distance within a pass. On a plane the readings at one node of
    # an even lattice share a place too.
    close = _close(x, y, repeat)
    columns, rows = (_clusters(values, close) for values in (x, y))
    # Along a line the neighbours of a place are those in order.
    index = rows if np.ptp(y) else columns
    if np.ptp(x) and np.ptp(y):
        index = _linked(x, y, close, int(np.ptp(repeat)) + 1)
    steps = _typical_step(x, columns), _typical_step(y, rows)
    count = int(index.max()) + 1
    if 0.0 in steps or _nodes(columns, rows) <= _MOST_NODES * count:
        return Places(index, rows, steps)
    lattice = even_lattice(x, y, count)
    if lattice is not None:
        along_x, along_y = lattice
        nodes = along_x.index * (int(along_y.index.max()) + 1) + along_y.index
        index = np.unique(nodes, return_inverse=True)[1]
        return Places(index, along_y.index, (along_x.step, along_y.step))
    # No rows and columns: every place stands for an equal share of the plane.
    step = float(np.sqrt(np.ptp(x) * np.ptp(y) / count))
    return Places(index, np.floor((y - y.min()) / step).astype(np.intp), (step, step))


def even_lattice(x: FloatArray, y: FloatArray, count: int) -> tuple[EvenAxis, EvenAxis] | None:
    """Fit an even lattice to the positions of ``count`` places in a plane, or return ``None``."""
    # Rows may be missing, but not most nodes: all positions lie on a lattice that is fine enough.
    along_x = _even_axis(x)
    along_y = _even_axis(y)
    if along_x is None or along_y is None:
        return None
    few = _nodes(along_x.index, along_y.index) <= _MOST_NODES * count
    return (along_x, along_y) if few else None


def _even_axis(positions: FloatArray) -> EvenAxis | None:
    """Fit the coarsest even lattice through all positions; steps are counted between them."""
    order = np.argsort(positions, kind="stable")
    ordered = positions[order]
    gaps = np.diff(ordered)
    # One of the gaps is about the step; the others are noise and missing rows.
    candidates = np.unique(gaps[gaps > max(_ROUNDING, 1e-9 * np.ptp(positions))])[::-1]
    if candidates.size > _CANDIDATES:
        candidates = candidates[np.geomspace(1, candidates.size, _CANDIDATES).astype(int) - 1]
    for candidate in candidates:
        number = np.concatenate([[0], np.cumsum(np.rint(gaps / candidate))])
        centred = number - number.mean()
        step = float(centred @ (ordered - ordered.mean()) / max(centred @ centred, 1.0))
        start = float(ordered.mean() - step * number.mean())
        if step > 0 and np.abs(ordered - start - step * number).max() <= _OFF_LATTICE * step:
            index = np.empty(positions.size, dtype=np.intp)
            index[order] = number
            return EvenAxis(start, step, index)
    return None


def _close(x: FloatArray, y: FloatArray, repeat: IntArray) -> float:
    """Return the distance within which readings of several passes share a place; 0 of one pass."""
    order = np.argsort(repeat, kind="stable")
    starts = np.flatnonzero(np.diff(repeat[order])) + 1
    if not starts.size:
        return 0.0
    usual = []
    for chosen in np.split(order, starts):
        # Without an index unique() hashes, which is slower.
        places = np.unique(x[chosen] + 1j * y[chosen], return_index=True)[0]
        if places.size > 1:
            usual.append(float(np.quantile(_nearest(places), _TWICE, method="lower")))
    return max(_CLOSE * min(usual, default=0.0), _ROUNDING)


def _nearest(places: NDArray[np.complex128]) -> FloatArray:
    """Return the distance of each of several distinct positions x + iy to its nearest one."""
    if not np.ptp(places.imag) or not np.ptp(places.real):
        gaps = np.concatenate([[np.inf], np.abs(np.diff(places)), [np.inf]])
        return np.asarray(np.minimum(gaps[:-1], gaps[1:]))
    from scipy.spatial import KDTree

    plane = places.view(np.float64).reshape(-1, 2)
    return np.asarray(KDTree(plane).query(plane, k=[2])[0])[:, 0]


def _linked(x: FloatArray, y: FloatArray, close: float, passes: int) -> IntArray:
    """Number the groups of positions in a plane that are equal or, through others, close."""
    places, index = np.unique(x + 1j * y, return_inverse=True)
    if not close:
        return index
    if places.size * passes > _MOST_PAIRS:
        rounded = np.rint(places / (close * _GRAIN)) * (close * _GRAIN)
        places, coarse = np.unique(rounded, return_inverse=True)
        index = coarse[index]
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    pairs = KDTree(places.view(np.float64).reshape(-1, 2)).query_pairs(close, output_type="ndarray")
    links = coo_array((np.ones(len(pairs), bool), pairs.T), shape=(places.size, places.size))
    return np.asarray(connected_components(links, directed=False)[1][index], dtype=np.intp)


def _clusters(values: FloatArray, gap: float) -> IntArray:
    """Number groups of values, in order, that no gap wider than ``gap`` parts."""
    order = np.argsort(values, kind="stable")
    index = np.empty(values.size, dtype=np.intp)
    index[order] = np.concatenate([[0], np.cumsum(np.diff(values[order]) > gap)])
    return index


def _nodes(columns: IntArray, rows: IntArray) -> int:
    return (int(columns.max()) + 1) * (int(rows.max()) + 1)


def _typical_step(values: FloatArray, cluster: IntArray) -> float:
    means = np.bincount(cluster, values) / np.bincount(cluster)
    return float(np.median(np.diff(means))) if means.size > 1 else 0.0


# The stress at the base spreads over about the film's thickness, whatever the film is made of.
#: Limits in units of the film's thickness h, beyond what any set-up has.  At h/4 from the axis a
#: point load's base stress has fallen by a tenth: a span of h/2 has neither flank nor baseline.
_SHORTEST_SPAN = 0.5
#: A base stress is 1.3 h wide at half its height, and G of a usable sensor (the check
#: width_over_thickness) at most 7 h: of steps beyond 4 h at most two points rise, ...
_LONGEST_STEP = 4.0
#: ... and three times that width is no sensor's.
_WIDEST_VOLTAGE = 20.0
#: Signals of such sensors end at 20 h. Memory, a gigabyte here, grows with the square of the span.
_LONGEST_SPAN = 60.0
#: Usual lengths in thicknesses: a scan of a 2 mm film spans 16 mm, 0.25 mm apart, by a rod of
#: 0.25 mm, and its voltage is 2.8 mm wide.
_USUAL = {"radius": (0.02, 0.5), "span": (2.0, 40.0), "step": (1e-3, 0.7), "width": (0.7, 4.0)}
#: Factor that a stated value needs, and the mistake that this means; near it within a share.
_MISTAKES = {
    1e3: "m stated as mm, or mm as um",
    25.4: "inches stated as mm",
    10.0: "cm stated as mm",
    0.1: "mm stated as cm",
    1 / 25.4: "mm stated as inches",
    1e-3: "mm stated as m, or um as mm",
}
_NEAR = 0.15
_FEWEST = 6
#: A nominal load may lie beyond those recorded by this share.
_BEYOND = 0.3
#: Of more points than these some tell the width of a peak.
_MOST_POINTS = 1_000_000
#: Share of points within a peak's width that lie above its half.
_CROWDED = 0.7


def mistaken_unit(factor: float) -> str:
    """Name the mistake of a unit that a stated value needs this factor for; or nothing."""
    return next((words for m, words in _MISTAKES.items() if abs(factor / m - 1) < _NEAR), "")


_SHORT = "So short a scan shows neither the flanks of the stress nor the baseline."
_WIDE = "The stress at the base of a film is little wider than the film is thick: "
_LONG = f"{_WIDE}no scan of it is longer than {_LONGEST_SPAN:g} thicknesses."


def require_span(scan: Scan) -> None:
    """Refuse positions over which no film is scanned, before anything is built on them."""
    h = _film(scan).thickness
    lengths = _lengths(scan)
    row = "The positions span", (span := lengths["span"])
    short = span < _SHORTEST_SPAN * h
    long = span > _LONGEST_SPAN * h
    _refuse(scan, lengths, (short, *row, _SHORT), (long, *row, _LONG))


def require_recorded(load: float, recorded: FloatArray) -> None:
    """Refuse a nominal load in N that lies beyond those that were recorded."""
    if np.isnan(recorded).all():
        return
    low = float(np.nanmin(recorded))
    high = float(np.nanmax(recorded))
    if not (1 - _BEYOND) * low <= load <= (1 + _BEYOND) * high:
        raise InputError(
            f"The load is stated as {load:.4g} N, but those recorded go from {low:.4g} to "
            f"{high:.4g} N.",
            why="One of them is wrong, and the stress at the base follows from it.",
            cure="Leave the load out to take the median of those recorded, or correct them or "
            "their unit (normal_load; --load-column, --load-unit).",
        )


def require_plausible(scan: Scan) -> None:
    """Refuse a rod scan whose lengths no film, rod and sensor can have, and name the unit."""
    if scan.load is not None and scan.normal_load is not None:
        require_recorded(scan.load, scan.normal_load)
    h = _film(scan).thickness
    lengths = _lengths(scan)
    span = lengths["span"]
    rod = 2 * lengths.get("radius", 0.0)
    of_rod = f"The positions span {span * 1e3:.4g} mm; the rod's width is"
    short = (span < _SHORTEST_SPAN * h, "The positions span", span, _SHORT)
    _refuse(scan, lengths, short, (rod > span, of_rod, rod, _SHORT))
    x, y = (positions.ravel() for positions in scan.positions)
    steps = places_of(x, y, scan.passes.ravel()).steps
    lengths["step"] = step = min((s for s in steps if s > 0), default=0.0)
    lengths["width"] = width = _voltage_width(x, y, scan.u_zz.ravel())
    no_sensor = f"{_WIDE}no sensor is so much wider."
    of_width = "The voltage's width at half height is"
    _refuse(
        scan,
        lengths,
        (step > _LONGEST_STEP * h, "The positions' step is", step, f"{_WIDE}the scan misses it."),
        (span > _LONGEST_SPAN * h, "The positions span", span, _LONG),
        (rod > h, "The rod's width is", rod, "Under such a rod the stress depends on friction."),
        (width > _WIDEST_VOLTAGE * h, of_width, width, no_sensor),
    )


def _film(scan: Scan) -> ElasticFilm:
    """Return the film; a scan that states none is refused."""
    return scan.film or scan.set_up.film


def _lengths(scan: Scan) -> dict[str, float]:
    """Return the span of a scan and the radius of a rod, in m."""
    span = max(float(np.ptp(along)) for along in (scan.x, scan.y) if along is not None)
    return {"span": span} | (
        {"radius": scan.indenter.radius} if isinstance(scan.indenter, Rod) else {}
    )


def _refuse(scan: Scan, lengths: dict[str, float], *rows: tuple[bool, str, float, str]) -> None:
    h = _film(scan).thickness
    place = f"{scan.source.file_name}: " if scan.source else ""
    for wrong, name, value, why in rows:
        if wrong:
            times = f"{value / h:.3g} times the film's thickness of {h * 1e3:.4g} mm"
            problem = f"{place}{name} {value * 1e3:.4g} mm, {times}."
            raise InputError(problem, why=why, cure=_cure(lengths, h))


def rise_of(x: FloatArray, y: FloatArray, u: FloatArray) -> FloatArray:
    """Rise of a voltage above its median over the outer quarter of the positions, shape (n,)."""
    distance = np.hypot(x - np.median(x), y - np.median(y))
    return np.asarray(u - np.median(u[distance >= np.quantile(distance, 0.75)]))


def _voltage_width(x: FloatArray, y: FloatArray, u: FloatArray) -> float:
    """Full width of the voltage at half its rise above the outer quarter, in m; 0 if unknown."""
    measured = np.flatnonzero(np.isfinite(u))[:: -(-u.size // _MOST_POINTS)]
    x = x[measured]
    y = y[measured]
    u = u[measured]
    if u.size < _FEWEST:
        return 0.0
    rise = rise_of(x, y, u)
    # The median of three points does not follow a single outlier.
    above = rise > 0.5 * np.median(np.sort(rise)[-3:])
    if not above.any():
        return 0.0
    distance = np.hypot(x - np.median(x[above]), y - np.median(y[above]))
    # Of points spread evenly over +-w half lie within w/2; over a disc of radius w, within 0.71 w.
    half = float(np.median(distance[above])) * (np.sqrt(2) if np.ptp(x) and np.ptp(y) else 2.0)
    # In noise the points above are scattered among others.
    return 2 * half if above[distance <= half].mean() > _CROWDED else 0.0


def _cure(lengths: dict[str, float], thickness: float) -> str:
    """Name the units to check, and the values of each input that make all lengths usual ones."""
    causes = []
    for name, path, scaled, stated in (
        ("positions", "data/x", ("span", "step", "width"), 1.0),
        ("a film thickness", "sample/film/thickness", tuple(_USUAL), thickness * 1e3),
        ("a rod radius", "indenter/radius", ("radius",), lengths.get("radius", 0.0) * 1e3),
    ):
        if not stated:
            continue
        low = 0.0
        high = np.inf
        for key in (key for key, length in lengths.items() if length > 0):
            least, most = (limit * thickness / lengths[key] for limit in _USUAL[key])
            if path == "sample/film/thickness":
                least, most = 1 / most, 1 / least
            elif key not in scaled:
                # Not changed by this input: any factor will do, or none.
                least, most = (0.0, np.inf) if least <= 1 <= most else (np.inf, 0.0)
            low = max(low, least)
            high = min(high, most)
        if not 0 < low < high < np.inf:
            continue
        inside = [factor for factor in _MISTAKES if low <= factor <= high]
        middle = np.log(low * high) / 2
        unit = min(inside, key=lambda factor: abs(np.log(factor) - middle), default=None)
        # Two digits, without a power of ten.
        first, last = (f"{float(f'{factor * stated:.2g}'):g}" for factor in (low, high))
        value = f"{first} to {last} times as large" if stated == 1.0 else f"of {first} to {last} mm"
        hint = f" ({_MISTAKES[unit]}?)" if unit else ""
        causes.append(f"{name} (/entry/{path}) {value}{hint}")
    if not causes:
        return "Check the units of /entry/data/x, /entry/sample/film/thickness and /entry/indenter."
    return f"Check the units. The scan would be a usual one with {'; or with '.join(causes)}."
