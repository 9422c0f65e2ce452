"""Figure of laws of the interface: lengths, evidence, and what a slip length means."""

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from memscal.errors import InputError
from memscal.extensions.interface_laws.results import (
    ImpliedFriction,
    InterfaceComparison,
    LawComparison,
)
from memscal.figures.friction import INTERVAL_NOTE, RISE, deviance_rise, draw_levels, interval_ends
from memscal.figures.friction_profiles import friction_axis, friction_position, lubricated_words
from memscal.figures.style import (
    DECONVOLVED,
    GAUSSIAN,
    MEASURED,
    draw_band,
    legend_above,
    panels_of,
)
from memscal.friction.family import bounded
from memscal.friction.results import FrictionComparison, LoadComparison

_UM = 1e-6
#: The length in the middle of the axis from 0 to infinity, in m.
_MIDDLE = 3e-6
_TICKS = (0.0, 1.0, 2.0, 3.0, 5.0, 10.0, 30.0, np.inf)
_COLOURS = {"tangential": DECONVOLVED, "normal": GAUSSIAN}


def interface_figure(comparison: FrictionComparison | InterfaceComparison) -> Figure:
    """Draw laws of the interface, of a comparison with friction or of the laws alone."""
    if isinstance(comparison, FrictionComparison):
        laws = comparison.interface
        loads = comparison.loads[comparison.loadings[0]]
    else:
        laws = comparison
        loads = ()
    if laws is None:
        raise InputError(
            "There is no law of the interface to draw.",
            cure="Compare with interface=True and a macroscopic friction coefficient.",
        )
    slip = laws.tangential
    implied = None if slip is None else slip.implied
    columns = 2 if implied is None else 3
    with panels_of(3.0, 1, columns, note=INTERVAL_NOTE) as (figure, panels):
        _draw_lengths(panels[0], laws.by_direction)
        _draw_marginal_likelihoods(panels[1], laws.by_direction)
        if slip is not None and implied is not None:
            measured = [load for load in loads if load.lubrication == slip.lubrication]
            _draw_implied(panels[2], implied, measured)
    return figure


def _draw_lengths(axes: Axes, by_direction: dict[str, LawComparison]) -> None:
    for direction, compared in by_direction.items():
        place = bounded(compared.length.values, _MIDDLE)
        label = f"{direction}, {lubricated_words(compared.lubrication)}"
        axes.plot(place, deviance_rise(compared.length), color=_COLOURS[direction], label=label)
    draw_levels(axes)
    names = ["∞" if np.isinf(tick) else f"{tick:g}" for tick in _TICKS]
    axes.xaxis.set_ticks(bounded(np.array(_TICKS) * _UM, _MIDDLE), names)
    axes.set(xlim=(-0.02, 1.02), xlabel="length (µm)", ylabel=RISE)
    legend_above(axes, columns=1)


def _draw_marginal_likelihoods(axes: Axes, by_direction: dict[str, LawComparison]) -> None:
    """Draw the logarithm of each law's marginal likelihood over that of the best of its kind."""
    names = []
    height = 0
    for direction, compared in by_direction.items():
        best = max(law.log_evidence for law in compared.laws)
        for law in compared.laws:
            below = law.log_evidence - best
            axes.plot([below, 0.0], [height, height], color="0.8", lw=0.8, zorder=1)
            axes.plot(below, height, "o", color=_COLOURS[direction], ms=5)
            names.append(textwrap.fill(law.name, 22))
            height += 1
    axes.yaxis.set_ticks(range(height), names)
    axes.set_ylim(height - 0.5, -0.5)
    axes.axvline(0.0, color="0.6", lw=0.6)
    axes.set_xlabel("ln of marginal likelihood\nover the best")


def _draw_implied(axes: Axes, implied: ImpliedFriction, measured: Sequence[LoadComparison]) -> None:
    low, best, high = friction_position(np.sort(implied.friction, axis=1)).T
    draw_band(axes, implied.loads, low, high)
    axes.plot(implied.loads, best, color=DECONVOLVED, label="what the slip length means")
    for i, at_load in enumerate(measured):
        reading = at_load.by_profile
        label = "found at each load" if i == 0 else "_found"
        axes.plot([at_load.load] * 2, interval_ends(reading), color=MEASURED, lw=1.0, label=label)
        if reading.value is not None:
            axes.plot(at_load.load, friction_position(reading.value), "o", color=MEASURED, ms=4)
    friction_axis(axes, "y")
    axes.set_xlabel("load (N)")
    axes.set_xlim(left=0)
    legend_above(axes, columns=1)
