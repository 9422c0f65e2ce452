"""Lengths of a rod scan held against each other before anything is computed.

Positions, voltage, rod and film of one scan have to be of one scale: the stress at the base of a
film spreads over about the film's thickness, whatever the film is made of.  A unit that was
mistaken (mm stated as m, inches as mm) makes them differ by a factor that no set-up has.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from memscal.errors import InputError
from memscal.model.arrays import FloatArray
from memscal.model.indenter import Rod
from memscal.model.scan import Scan, places_of

#: Limits in units of the film's thickness h.  Only what no set-up can have lies beyond them.
#: Span: at h/4 from the axis a point load's base stress has fallen by a tenth; a scan that spans
#: less than h/2 has neither flank nor baseline.
_SHORTEST_SPAN = 0.5
#: Step: a base stress is 1.3 h wide at half its height, and G of a usable sensor (the check
#: width_over_thickness) at most 7 h: beyond 4 h at most two points rise.
_LONGEST_STEP = 4.0
#: Span: signals of such sensors end at 20 h; a rod scan spans 8 h.
_LONGEST_SPAN = 1000.0
#: Full width of the voltage at half its height: three times that of the widest usable sensor.
_WIDEST_VOLTAGE = 20.0

#: Factor that a stated value needs, and the mistake that this means.
_MISTAKES = {
    1e3: "m stated as mm, or mm as um",
    25.4: "inches stated as mm",
    10.0: "cm stated as mm",
    0.1: "mm stated as cm",
    1 / 25.4: "mm stated as inches",
    1e-3: "mm stated as m, or um as mm",
}
#: A factor is near one of these within this share.
_NEAR = 0.15
_FEWEST = 6


def mistaken_unit(factor: float) -> str:
    """Name the mistake of a unit that a stated value needs this factor for; or nothing."""
    near = [words for mistake, words in _MISTAKES.items() if abs(factor / mistake - 1) < _NEAR]
    return near[0] if near else ""


def require_plausible(scan: Scan, channel: str = "zz") -> None:
    """Refuse a rod scan whose lengths no film, rod and sensor can have, and name the unit."""
    if not isinstance(scan.indenter, Rod):
        return
    lengths = _lengths(scan, channel)
    problem = _problem(lengths)
    if problem is None:
        return
    file_name = f"{scan.source.file_name}: " if scan.source else ""
    causes = [cause for name, path, keys in _INPUTS if (cause := _cause(lengths, name, path, keys))]
    cure = (
        f"Check the units. The scan would be a usual one with {'; or with '.join(causes)}."
        if causes
        else "Check the units of the positions (/entry/data/x), the film's thickness "
        "(/entry/sample/film/thickness) and the rod's radius (/entry/indenter/radius)."
    )
    raise InputError(f"{file_name}{problem[0]}", why=problem[1], cure=cure)


_INPUTS = (
    ("positions", "data/x", ("span", "step", "width")),
    ("a film thickness", "sample/film/thickness", ("thickness",)),
    ("a rod radius", "indenter/radius", ("radius",)),
)
#: Usual lengths in thicknesses: a scan of a 2 mm film spans 16 mm, 0.25 mm apart, by a rod of
#: 0.25 mm, and its voltage is 2.8 mm wide.
_USUAL = {"radius": (0.02, 0.5), "span": (2.0, 40.0), "step": (0.0, 0.7), "width": (0.7, 4.0)}


def _cause(lengths: Mapping[str, float], name: str, path: str, keys: Sequence[str]) -> str:
    """Name the values of one input that make all lengths usual ones; empty if none does."""
    low, high = 0.0, np.inf
    for key, (lower, upper) in _USUAL.items():
        if key not in lengths:
            continue
        ratio = lengths[key] / lengths["thickness"]
        if key in keys:
            low, high = max(low, lower / ratio), min(high, upper / ratio)
        elif "thickness" in keys:
            low, high = max(low, ratio / upper), min(high, ratio / lower if lower else np.inf)
        elif not lower <= ratio <= upper:
            return ""
    if not low < high:
        return ""
    middle = np.sqrt(low * high)
    inside = [factor for factor in _MISTAKES if low <= factor <= high]
    unit = min(inside, key=lambda factor: abs(np.log(factor / middle)), default=None)
    hint = "" if unit is None else f" ({_MISTAKES[unit]}: {unit:.4g} times?)"
    positions = name == "positions"
    value = 1.0 if positions else lengths[keys[0]] * 1e3
    # Two digits, without a power of ten where a plain number is as short.
    least, most = (f"{float(f'{factor * value:.2g}'):g}" for factor in (low, high))
    if positions:
        return f"{name} (/entry/{path}) {least} to {most} times as large{hint}"
    return f"{name} (/entry/{path}) of {least} to {most} mm{hint}"


def _lengths(scan: Scan, channel: str) -> dict[str, float]:
    """Span, step, thickness and radius, and where it can be told the voltage's width, in m."""
    x, y = (positions.ravel() for positions in scan.positions)
    steps = [step for step in places_of(x, y, scan.passes.ravel()).steps if step > 0]
    lengths = {
        "span": float(max(np.ptp(x), np.ptp(y))),
        "step": min(steps, default=0.0),
        "thickness": scan.film.thickness,
        "radius": scan.indenter.radius,
    }
    if channel == "zz" and (width := _voltage_width(x, y, scan.u_zz.ravel())):
        lengths["width"] = width
    return lengths


def _voltage_width(x: FloatArray, y: FloatArray, u: FloatArray) -> float:
    """Full width of the voltage at half its rise above the outer quarter, in m; 0 if unknown."""
    measured = np.isfinite(u)
    x, y, u = x[measured], y[measured], u[measured]
    if u.size < _FEWEST:
        return 0.0
    distance = np.hypot(x - np.median(x), y - np.median(y))
    rise = u - np.median(u[distance >= np.quantile(distance, 0.75)])
    # The median of three points does not follow a single outlier.
    above = rise > 0.5 * np.median(np.sort(rise)[-3:])
    if above.sum() < _FEWEST // 2:
        return 0.0
    x, y = x[above] - np.median(x[above]), y[above] - np.median(y[above])
    # Of points spread evenly over +-w half lie within w/2; over a disc of radius w, within 0.71 w.
    planar = bool(np.ptp(x) and np.ptp(y))
    return float(np.median(np.hypot(x, y)) * (2 * np.sqrt(2) if planar else 4.0))


def _problem(lengths: Mapping[str, float]) -> tuple[str, str] | None:
    """What no set-up can have, and why; ``None`` if the lengths are possible."""
    h, radius, span, step = (lengths[name] for name in ("thickness", "radius", "span", "step"))
    width = lengths.get("width", 0.0)

    def told(what: str, value: float) -> str:
        return (
            f"{what} {value * 1e3:.4g} mm, {value / h:.3g} times the film's thickness of "
            f"{h * 1e3:.4g} mm."
        )

    if span < _SHORTEST_SPAN * h:
        return told("The positions span", span), (
            "The stress at the base of a film falls off over about its thickness: so short a scan "
            "shows neither its flanks nor the baseline."
        )
    if 2 * radius > span:
        rod = f"The rod is {2e3 * radius:.4g} mm wide, but the positions span {span * 1e3:.4g} mm."
        return rod, "So short a scan shows neither the flanks of the stress nor the baseline."
    if step > _LONGEST_STEP * h:
        return told("Neighbouring positions are apart by", step), (
            "The stress at the base of a film is little wider than its thickness: so coarse a scan "
            "passes over it."
        )
    if span > _LONGEST_SPAN * h:
        return told("The positions span", span), (
            "The stress at the base of a film ends within a few thicknesses."
        )
    if width > _WIDEST_VOLTAGE * h:
        return told("The voltage's full width at half its height is", width), (
            "The stress at the base of a film is little wider than its thickness, and no sensor "
            "that a film of this thickness serves is so much wider."
        )
    return None
