"""Does a tangential channel's voltage look like a shear: odd about its centre, and of its sign."""

from __future__ import annotations

import numpy as np

from memscal.errors import InputError
from memscal.estimation.points import ScanPoints
from memscal.model.validation import FloatArray

__all__ = ["require_parity"]

#: A shape of the wrong parity or sign must leave less than this share of what the right one does.
_CLEARLY = 0.7


def require_parity(
    points: ScanPoints,
    odd: tuple[FloatArray, FloatArray],
    even: tuple[FloatArray, FloatArray],
) -> None:
    """Refuse a voltage that a shear of the other sign, or an even signal, meets far better.

    Parameters
    ----------
    points : ScanPoints
        The points of one scan, by a tangential channel.
    odd, even : tuple of two ndarray, shape (m,)
        Amplitudes of odd and of even signals of trial centres and widths, fitted to the voltages,
        and the sums of absolute residuals that each leaves.

    Raises
    ------
    InputError
        If the voltage has the wrong sign, or is even.
    """
    amplitudes, costs = odd
    right = float(np.min(costs, where=amplitudes > 0, initial=np.inf))
    turned = float(np.min(costs, where=amplitudes < 0, initial=np.inf))
    same = float(even[1].min())
    name, along = f"u_{points.channel}", points.channel[0]
    if same < _CLEARLY * min(right, turned):
        raise InputError(
            f"{name} is the same on both sides of the sensor.",
            why="A shear changes its sign where the indenter passes the sensor; a normal stress "
            "does not.",
            cure="Check the channels: this looks like u_zz.",
        )
    if turned < _CLEARLY * right:
        raise InputError(
            f"{name} has the wrong sign: it rises where the indenter stands at larger {along} "
            "than the sensor.",
            why="A squeezed film pulls the base away from the indenter: the traction on the "
            f"sensor along {along} is then negative.",
            cure=f"Change the sign of {name}, or of {along} if it is the sensor that was moved: "
            f"{along} is the indenter's position from the sensor.",
        )
