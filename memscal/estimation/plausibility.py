"""Lengths of a rod scan held against each other before anything is computed.

The stress at the base of a film spreads over about the film's thickness, whatever the film is made
of: positions, voltage, rod and film are of one scale, unless a unit was mistaken.
"""

from __future__ import annotations

import numpy as np

from memscal.errors import InputError
from memscal.model.arrays import FloatArray
from memscal.model.scan import Scan, places_of

#: Limits in units of the film's thickness h, beyond what any set-up has.  At h/4 from the axis a
#: point load's base stress has fallen by a tenth: a span of h/2 has neither flank nor baseline.
_SHORTEST_SPAN = 0.5
#: A base stress is 1.3 h wide at half its height, and G of a usable sensor (the check
#: width_over_thickness) at most 7 h: of steps beyond 4 h at most two points rise, ...
_LONGEST_STEP = 4.0
#: ... and three times that width is no sensor's.
_WIDEST_VOLTAGE = 20.0
#: Signals of such sensors end at 20 h; a rod scan spans 8 h.
_LONGEST_SPAN = 1000.0
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
_NEAR, _FEWEST = 0.15, 6
#: Share of points within a peak's width that lie above its half.
_CROWDED = 0.7


def mistaken_unit(factor: float) -> str:
    """Name the mistake of a unit that a stated value needs this factor for; or nothing."""
    return next((words for m, words in _MISTAKES.items() if abs(factor / m - 1) < _NEAR), "")


def require_plausible(scan: Scan) -> None:
    """Refuse a rod scan whose lengths no film, rod and sensor can have, and name the unit."""
    h, a = scan.film.thickness, scan.indenter.radius
    x, y = (positions.ravel() for positions in scan.positions)
    span = float(max(np.ptp(x), np.ptp(y)))
    step = min((s for s in places_of(x, y, scan.passes.ravel()).steps if s > 0), default=0.0)
    width = _voltage_width(x, y, scan.u_zz.ravel())
    short = "So short a scan shows neither the flanks of the stress nor the baseline."
    wide = "The stress at the base of a film is little wider than the film is thick: "
    friction = "Under a rod wider than the film is thick, the stress depends on friction."
    for wrong, name, value, why in (
        (span < _SHORTEST_SPAN * h, "The positions span", span, short),
        (2 * a > span, f"The positions span {span * 1e3:.4g} mm; the rod's width is", 2 * a, short),
        (step > _LONGEST_STEP * h, "The positions' step is", step, f"{wide}the scan misses it."),
        (span > _LONGEST_SPAN * h, "The positions span", span, f"{wide}no scan is so long."),
        (2 * a > h, "The rod's width is", 2 * a, friction),
        (width > _WIDEST_VOLTAGE * h, "The voltage's full width at half its height is", width,
         f"{wide}no sensor that it serves is so much wider."),
    ):  # fmt: skip
        if wrong:
            file_name = f"{scan.source.file_name}: " if scan.source else ""
            raise InputError(
                f"{file_name}{name} {value * 1e3:.4g} mm, {value / h:.3g} times the film's "
                f"thickness of {h * 1e3:.4g} mm.",
                why=why,
                cure=_cure({"radius": a, "span": span, "step": step, "width": width}, h),
            )


def rise_of(x: FloatArray, y: FloatArray, u: FloatArray) -> FloatArray:
    """Rise of a voltage above its median over the outer quarter of the positions, shape (n,)."""
    distance = np.hypot(x - np.median(x), y - np.median(y))
    return np.asarray(u - np.median(u[distance >= np.quantile(distance, 0.75)]))


def _voltage_width(x: FloatArray, y: FloatArray, u: FloatArray) -> float:
    """Full width of the voltage at half its rise above the outer quarter, in m; 0 if unknown."""
    measured = np.isfinite(u)
    x, y, u = x[measured], y[measured], u[measured]
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
        ("a rod radius", "indenter/radius", ("radius",), lengths["radius"] * 1e3),
    ):
        low, high = 0.0, np.inf
        for key in (key for key, length in lengths.items() if length > 0):
            least, most = (limit * thickness / lengths[key] for limit in _USUAL[key])
            if path == "sample/film/thickness":
                least, most = 1 / most, 1 / least
            elif key not in scaled:
                # Not changed by this input: any factor will do, or none.
                least, most = (0.0, np.inf) if least <= 1 <= most else (np.inf, 0.0)
            low, high = max(low, least), min(high, most)
        if not low < high:
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
