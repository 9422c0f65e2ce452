"""Mistaken units: lengths and loads of a scan that no film, rod and sensor can have."""

import numpy as np

from memscal.errors import InputError
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.scan import Scan
from memscal.readings.find_places import places_of

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
