"""Mistaken units: lengths and loads of a scan that no film, rod and sensor can have."""

import warnings

import numpy as np

from memscal.errors import InputError, UnitWarning
from memscal.model.arrays import FloatArray
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Rod, RoundIndenter
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
#: Units of loads that are given without one, in N.
_LOAD_UNITS = {"mN": 1e-3, "gf": 9.80665e-3, "uN": 1e-6}
#: Depths in a linear film over its thickness beyond which rubber, which stiffens, does not give way
#: by all of it; under a sphere its contact stiffens too. A usual load sinks by more than the last.
_DEEPEST = {"rod": 2.0, "sphere": 0.5}
_SHALLOWEST = 1e-3
#: Stiffness of an incompressible film under a rod over a half-space's, as a polynomial of the
#: rod's radius over the thickness (at most 1 % too large up to 1/2).
_STIFFER = (0.4, 1.4, 1.1, 1.0)
#: A nominal load may lie beyond those recorded by this share.
_BEYOND = 0.3
#: Of more points than these some tell the width of a peak.
_MOST_POINTS = 1_000_000
#: Share of points within a peak's width that lie above its half.
_CROWDED = 0.7


#: What no set-up has: volts, amperes or tesla of a reading, volts of noise, metres of a scan.
_LARGEST = {"readings": 20.0, "noise": 1.0, "positions": 10.0}


def warn_of_readings(scan: Scan) -> None:
    """Warn of readings, a noise and positions that no scan has, and ask for the unit meant."""
    noise = np.zeros(1) if scan.u_zz_errors is None else scan.u_zz_errors
    sizes = {"positions": np.abs(scan.x).max()}
    if scan.unit in ("V", "A", "T"):
        sizes |= {"readings": np.nanmax(np.abs(scan.u_zz)), "noise": np.nanmax(noise)}
    for name, size in sizes.items():
        if size > _LARGEST[name]:
            unit = "m" if name == "positions" else scan.unit
            text = f"The {name}: up to {size:.4g} {unit}. Was m{unit} meant, or u{unit}? M is mega."
            warnings.warn(text, UnitWarning, stacklevel=2)


def mistaken_unit(factor: float) -> str:
    """Name the mistake of a unit that a stated value needs this factor for; or nothing."""
    near = (words for mistake, words in _MISTAKES.items() if abs(factor / mistake - 1) < _NEAR)
    return next(near, "")


Lengths = dict[str, float]
"""Lengths of a scan, in m, by their names."""

_SHORT = "So short a scan shows neither the flanks of the stress nor the baseline."
_WIDE = "The stress at the base of a film is little wider than the film is thick: "
_LONG = f"{_WIDE}no scan of it is longer than {_LONGEST_SPAN:g} thicknesses."
_WIDER = f"{_WIDE}no sensor is so much wider."


def require_span(scan: Scan) -> None:
    """Refuse positions over which no film is scanned, before anything is built on them."""
    lengths = _lengths(scan)
    if lengths["span"] > _LONGEST_SPAN * lengths["thickness"]:
        raise _implausible(scan, lengths, "The positions span", lengths["span"], _LONG)


def require_depth(scan: Scan) -> None:
    """Refuse a load that presses an indenter deeper than the film is thick."""
    film = scan.film
    indenter = scan.indenter
    load = scan.load
    if film is None or indenter is None or load is None:
        return
    h = film.thickness
    depth = _depth(film, indenter, load)
    if depth <= _DEEPEST[indenter.shape] * h:
        return
    fitting = [
        f"{load:.4g} {unit} ({scale * load:.4g} N)"
        for unit, scale in _LOAD_UNITS.items()
        if _SHALLOWEST * h < _depth(film, indenter, scale * load) < h
    ]
    raise InputError(
        f"Under {load:.4g} N the {indenter.shape} would sink by {depth * 1e3:.3g} mm into a film "
        f"that is {h * 1e3:.4g} mm thick.",
        why=f"A load of {' or of '.join(fitting)} would not." if fitting else "",
        cure="Check the load and its unit (--load in N; --load-unit of a column), and those of the "
        "film's modulus and thickness and of the indenter's radius.",
    )


def _depth(film: ElasticFilm, indenter: RoundIndenter, load: float) -> float:
    """Return about how deep an indenter sinks into a linear, incompressible film, in m."""
    # Any other film gives way more easily.
    ratio = indenter.radius / film.thickness
    if isinstance(indenter, Rod):
        stiffer = np.polyval(_STIFFER, ratio)  # than a half-space
        return float(load / (2 * indenter.radius * film.contact_modulus * stiffer))
    # Hertz's contact on a half-space; Chadwick's on a film much thinner than the contact is wide
    # (SIAM J. Appl. Math. 62, 1520, 2002). Their compliances in between: 6 % too deep at most.
    scaled = load / (film.young_modulus * indenter.radius**2)
    wide = film.thickness * (3 * scaled / (2 * np.pi)) ** (1 / 3)
    narrow = indenter.radius * (9 * scaled**2 / 16) ** (1 / 3)
    return float(1 / (1 / wide + 1 / narrow))


def require_recorded(load: float, recorded: FloatArray) -> None:
    """Refuse a nominal load in N that lies beyond those that were recorded."""
    if np.isnan(recorded).all() or not load > 0:  # which a scan refuses
        return
    low = np.nanmin(recorded)
    high = np.nanmax(recorded)
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
    lengths = _lengths(scan)
    span = lengths["span"]
    rod_width = 2 * lengths.get("radius", 0.0)
    if rod_width > span:
        words = f"The positions span {span * 1e3:.4g} mm; the rod's width is"
        raise _implausible(scan, lengths, words, rod_width, _SHORT)

    x, y = (positions.ravel() for positions in scan.positions)
    steps = places_of(x, y, scan.passes.ravel()).steps
    lengths["step"] = min(filter(None, steps), default=0.0)
    lengths["width"] = _voltage_width(x, y, scan.u_zz.ravel())
    for length, most, words, why in (
        (lengths["step"], _LONGEST_STEP, "The positions' step is", f"{_WIDE}the scan misses it."),
        (span, _LONGEST_SPAN, "The positions span", _LONG),
        (rod_width, 1.0, "The rod's width is", "Under such a rod the stress depends on friction."),
        (lengths["width"], _WIDEST_VOLTAGE, "The voltage's width at half height is", _WIDER),
    ):
        if length > most * lengths["thickness"]:
            raise _implausible(scan, lengths, words, length, why)


def _lengths(scan: Scan) -> Lengths:
    """Return thickness, span and the radius of a rod, in m; too short a span is refused."""
    h = (scan.film or scan.set_up.film).thickness
    span = max(float(np.ptp(axis)) for axis in (scan.x, scan.y) if axis is not None)
    lengths = {"thickness": h, "span": span}
    if isinstance(scan.indenter, Rod):
        lengths["radius"] = scan.indenter.radius
    if span < _SHORTEST_SPAN * h:
        raise _implausible(scan, lengths, "The positions span", span, _SHORT)
    return lengths


def _implausible(scan: Scan, lengths: Lengths, words: str, length: float, why: str) -> InputError:
    """Return the error of a length in m that no set-up has, with the units to check."""
    place = f"{scan.source.file_name}: " if scan.source else ""
    h = lengths["thickness"]
    times = f"{length / h:.3g} times the film's thickness of {h * 1e3:.4g} mm"
    problem = f"{place}{words} {length * 1e3:.4g} mm, {times}."
    return InputError(problem, why=why, cure=_cure(lengths))


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
    half = np.median(distance[above]) * (np.sqrt(2) if np.ptp(x) and np.ptp(y) else 2.0)
    # In noise the points above are scattered among others.
    return 2 * half if above[distance <= half].mean() > _CROWDED else 0.0


def _cure(lengths: Lengths) -> str:
    """Name the units to check, and the values of each input that make all lengths usual ones."""
    inputs = {
        "positions (/entry/data/x) {:g} to {:g} times as large": ("span", "step", "width"),
        "a film thickness (/entry/sample/film/thickness) of {:g} to {:g} mm": ("thickness",),
        "a rod radius (/entry/indenter/radius) of {:g} to {:g} mm": ("radius",),
    }
    causes = []
    for words, scaled in inputs.items():
        low, high = _usual_factors(lengths, scaled)
        if not 0 < low < high < np.inf:  # so of a rod that is none
            continue
        millimetres = lengths[scaled[0]] * 1e3 if len(scaled) == 1 else 1.0
        # Two digits, without a power of ten.
        ends = (float(f"{factor * millimetres:.2g}") for factor in (low, high))
        causes.append(words.format(*ends) + _mistake_within(low, high))
    if not causes:
        return "Check the units of /entry/data/x, /entry/sample/film/thickness and /entry/indenter."
    return f"Check the units. The scan would be a usual one with {'; or with '.join(causes)}."


def _usual_factors(lengths: Lengths, scaled: tuple[str, ...]) -> tuple[float, float]:
    """Range of the factor on some of the lengths that makes all usual, over the thickness."""
    low = 0.0
    high = np.inf
    for name, limits in _USUAL.items():
        length = lengths.get(name, 0.0)
        if length <= 0:
            continue
        least, most = (limit * lengths["thickness"] / length for limit in limits)
        if "thickness" in scaled:
            least, most = 1 / most, 1 / least
        elif name not in scaled:
            if least <= 1 <= most:
                continue
            return np.inf, 0.0
        low = max(low, least)
        high = min(high, most)
    return low, high


def _mistake_within(low: float, high: float) -> str:
    """Name the mistake of a unit whose factor is nearest to the middle of a range, or nothing."""
    inside = [factor for factor in _MISTAKES if low <= factor <= high]
    if not inside:
        return ""
    middle = np.log(low * high) / 2
    nearest = min(inside, key=lambda factor: abs(np.log(factor) - middle))
    return f" ({_MISTAKES[nearest]}?)"
