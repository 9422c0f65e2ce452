"""Positions of a planned scan in an order that can be stopped early."""

from numbers import Integral
from typing import Any

import numpy as np

from memscal.errors import InputError, require_names
from memscal.extensions.planning.design import Design
from memscal.model.arrays import FloatArray

#: Places of each block of an order, counted along the line.
_BLOCKS = {
    "interleaved": (slice(0, None, 4), slice(2, None, 4), slice(1, None, 2)),
    "along": (slice(None),),
}


def require_whole(name: str, value: Any) -> None:
    """Refuse what is no whole number of at least zero."""
    if not isinstance(value, Integral) or int(value) < 0:
        raise InputError(f"{name} is {value!r}.", cure="Give a whole number, 0 or more.")


def positions(design: Design, order: str = "interleaved", blanks: int = 5) -> FloatArray:
    """Return the positions of a planned scan in the order in which they are best recorded.

    A scan from left to right tells nothing before it has passed the sensor.  In the order
    ``"interleaved"`` come every fourth place, those between, the rest, and the repeats in the same
    way: after each block the whole field is known, more finely than before, and a run may stop
    where it knows enough.  There are no more positions than these: they are the most that a run
    records.

    Parameters
    ----------
    design : Design
        The planned scan, of :func:`memscal.design`.
    order : str
        ``"interleaved"``, or ``"along"``: from one end to the other.
    blanks : int
        How many places beyond the field are read between two blocks, one step apart: nothing is
        seen there, and a drift of the baseline shows.

    Returns
    -------
    ndarray, shape (n,)
        Positions in m.

    Raises
    ------
    InputError
        If there is no such order, or ``blanks`` is no whole number of at least zero.

    Examples
    --------
    >>> import memscal
    >>> from memscal.acquire import positions
    >>> planned = memscal.design(step=1e-3, half_range=4e-3)
    >>> (1e3 * positions(planned, blanks=1)).round(6).tolist()
    [-4.0, 0.0, 4.0, 5.0, -2.0, 2.0, 5.0, -3.0, -1.0, 1.0, 3.0]
    """
    require_names("There is no order", [order], _BLOCKS)
    require_whole("The number of blanks", blanks)
    plan = design.plan
    line = plan.scan().x
    beyond = line[-1] + plan.step * np.arange(1, blanks + 1)
    parts = []
    for places in _BLOCKS[order] * plan.repeats:
        parts += [line[places], beyond]
    return np.concatenate(parts[:-1])
