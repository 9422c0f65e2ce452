"""Points with their uncertainties, in the marker of their lubrication."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes

from memscal.figures.friction_scale import LUBRICATIONS
from memscal.friction.results import LoadComparison
from memscal.model.quantities import KPA, MM
from memscal.model.validation import FloatArray

__all__ = ["EXPANDED", "draw_errorbar", "draw_points", "share_limits"]

#: Coverage factor of the grey band, and of what stands clear of zero.
EXPANDED = 2.0
#: How strongly points are drawn that do not stand clear of zero.
_PALE = 0.25
_LEAST_LIMIT = 3.5


def draw_points(
    axes: Axes, one: LoadComparison, colour: str, label: str, logarithmic: bool
) -> None:
    """Draw the measured points.

    On a logarithmic scale those that are not above 0 are left out, and those that are less than
    twice their uncertainty are pale: they say no more than that the stress has decayed.
    """
    r, s, u = (np.asarray(v) for v in (one.profile.r, one.profile.s_zz, one.profile.s_zz_errors))
    clear = s > EXPANDED * u if logarithmic else np.ones(s.size, dtype=bool)
    for shown, strength in ((clear, 1.0), (~clear & (s > 0), _PALE)):
        if shown.any():
            draw_errorbar(
                axes, r[shown] / MM, s[shown] / KPA, u[shown] / KPA, one,
                colour=colour, label=label, strength=strength,
            )  # fmt: skip


def draw_errorbar(
    axes: Axes,
    x: FloatArray,
    y: FloatArray,
    u: FloatArray,
    one: LoadComparison,
    *,
    colour: str,
    label: str = "",
    strength: float = 1.0,
) -> None:
    """Draw points with their standard uncertainties, in the marker of their lubrication."""
    marker, filled = LUBRICATIONS.get(one.lubrication, LUBRICATIONS[""])
    style: dict[str, Any] = {"ls": "none", "ms": 3.0, "mew": 0.6, "elinewidth": 0.7}
    face = colour if filled else "white"
    style |= {"label": label or "_points", "alpha": None if strength == 1.0 else strength}
    axes.errorbar(x, y, u, fmt=marker, color=colour, mfc=face, **style)


def share_limits(panels: Sequence[Axes]) -> None:
    """Give residual panels one scale that shows every point, and at least the band."""
    sizes = [
        np.abs(np.asarray(line.get_ydata()))
        for axes in panels
        for line in axes.lines
        if line.get_marker() not in ("None", "", None)
    ]
    limit = max(_LEAST_LIMIT, 1.1 * float(np.max(np.concatenate(sizes))))
    for axes in panels:
        axes.set_ylim(-limit, limit)
