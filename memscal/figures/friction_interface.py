"""Laws of the interface: the length over which it yields, its evidence, and what it means."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from memscal.errors import InputError
from memscal.figures.friction_readings import draw_levels
from memscal.figures.friction_scale import friction_axis, friction_position, lubricated_words
from memscal.figures.style import COLOURS, house_style, legend_above, new_figure, panel_letter
from memscal.friction.compliance_results import InterfaceComparison, LawComparison
from memscal.friction.family import FRICTION_SCALE
from memscal.friction.results import FrictionComparison
from memscal.model.validation import FloatArray

__all__ = ["interface_figure", "length_position"]

_UM = 1e-6
#: The length in the middle of the axis, in m.
_MIDDLE = 3e-6
_TICKS = (0.0, 1.0, 2.0, 3.0, 5.0, 10.0, 30.0, np.inf)
_COLOURS = {"tangential": "deconvolved", "normal": "gaussian"}


def interface_figure(found: FrictionComparison) -> Figure:
    """Draw what laws of the interface explain.

    Parameters
    ----------
    found : FrictionComparison
        What was compared, with an interface.

    Returns
    -------
    matplotlib.figure.Figure
        Panel a, profile likelihood of the length over which the interface yields; b, evidence of
        each law over that of the best; c, where dry scans were measured, the coefficient that the
        slip length means at each load, beside that which was found there.

    Raises
    ------
    InputError
        If no interface was compared.
    """
    if found.interface is None:
        raise InputError(
            "There is no law of the interface to draw.",
            cure="Compare with interface=True and a macroscopic friction coefficient.",
        )
    parts = _parts(found.interface)
    with house_style():
        figure = new_figure(3.0)
        implied = found.interface.tangential
        widths = (1.0, 1.0, 1.0) if implied is not None and implied.implied is not None else (1, 1)
        panels = figure.subplots(1, len(widths), width_ratios=widths)
        _draw_lengths(panels[0], parts)
        _draw_evidence(panels[1], parts)
        if implied is not None and len(widths) == 3:
            _draw_implied(panels[2], found, implied)
        for axes, letter in zip(panels, "abc", strict=False):
            panel_letter(axes, letter)
    return figure


def _parts(found: InterfaceComparison) -> dict[str, LawComparison]:
    both = {"tangential": found.tangential, "normal": found.normal}
    return {name: part for name, part in both.items() if part is not None}


def length_position(length: ArrayLike) -> FloatArray:
    r"""Return where a length (m) stands on an axis from 0 to infinity: 3 um in its middle.

    Examples
    --------
    >>> length_position([0.0, 3e-6, np.inf])
    array([0. , 0.5, 1. ])
    """
    return friction_position(FRICTION_SCALE * np.asarray(length, dtype=np.float64) / _MIDDLE)


def _draw_lengths(axes: Axes, parts: dict[str, LawComparison]) -> None:
    for direction, part in parts.items():
        rise = np.asarray(part.length.deviance) - float(np.min(part.length.deviance))
        label = f"{direction}, {lubricated_words(part.lubrication)}"
        colour = COLOURS[_COLOURS[direction]]
        axes.plot(length_position(part.length.values), rise, color=colour, label=label)
    draw_levels(axes)
    names = ["∞" if np.isinf(tick) else f"{tick:g}" for tick in _TICKS]
    axes.xaxis.set_ticks(list(length_position(np.array(_TICKS) * _UM)), names)
    axes.set_xlim(-0.02, 1.02)
    axes.set(xlabel="length (um)", ylabel=r"$\chi^2 - \chi^2_{min}$")
    legend_above(axes, columns=1)


def _draw_evidence(axes: Axes, parts: dict[str, LawComparison]) -> None:
    """Draw the logarithm of each law's evidence, below that of the best of its kind."""
    names, height = [], 0
    for direction, part in parts.items():
        best = max(law.log_evidence for law in part.laws)
        for law in part.laws:
            below = law.log_evidence - best
            axes.plot([below, 0.0], [height, height], color="0.8", lw=0.8, zorder=1)
            axes.plot([below], [height], "o", color=COLOURS[_COLOURS[direction]], ms=5)
            names.append(_folded(law.name))
            height += 1
    axes.yaxis.set_ticks(list(range(height)), names)
    axes.set_ylim(height - 0.5, -0.5)
    axes.axvline(0.0, color="0.6", lw=0.6)
    axes.set_xlabel("ln of evidence over the best")


def _folded(name: str, width: int = 22) -> str:
    import textwrap

    return "\n".join(textwrap.wrap(name, width))


def _draw_implied(axes: Axes, found: FrictionComparison, part: LawComparison) -> None:
    implied = part.implied
    if implied is None:
        return
    low, best, high = friction_position(np.sort(implied.friction, axis=1)).T
    blue = COLOURS["deconvolved"]
    axes.fill_between(implied.loads, low, high, color=blue, alpha=0.25, lw=0)
    axes.plot(implied.loads, best, color=blue, label="what the slip length means")
    loads = next(iter(found.loads.values()))
    of_it = [one for one in loads if one.lubrication == part.lubrication]
    for i, one in enumerate(of_it):
        reading = one.by_profile
        top = np.inf if reading.interval.high is None else reading.interval.high
        ends = friction_position([reading.interval.low, top])
        label = "found at each load" if i == 0 else "_found"
        axes.plot([one.load] * 2, ends, color=COLOURS["measured"], lw=1.0, label=label)
        if reading.value is not None:
            place = friction_position([reading.value])
            axes.plot([one.load], place, "o", color=COLOURS["measured"], ms=4)
    friction_axis(axes, "y", r"effective friction coefficient $\mu_e$")
    axes.set_xlabel("load (N)")
    axes.set_xlim(left=0)
    legend_above(axes, columns=1)
