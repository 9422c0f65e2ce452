"""A field in the base of a film in 3-D, averaged over circles about the indenter's axis."""

from __future__ import annotations

import numpy as np

from memscal.errors import InputError
from memscal.model.validation import FloatArray

__all__ = ["average_over_circles"]

_CIRCLES = 501
_DIRECTIONS = 72


def average_over_circles(
    places: FloatArray, columns: dict[str, FloatArray]
) -> tuple[dict[str, FloatArray], str]:
    """Interpolate linearly between scattered places and average over circles about the origin.

    A half or a quarter of a film will do: where nothing is known, nothing is averaged.  Circles
    of which less than half as much is inside as of others are left out: they are at the corners.

    Parameters
    ----------
    places : ndarray, shape (n, 2)
        Places in the base, in m, from the axis.
    columns : dict of str to ndarray, shape (n,)
        Values there; the first is the normal stress.

    Returns
    -------
    tuple
        The columns with ``r`` in m, and a note of what was done.

    Raises
    ------
    InputError
        If the places lie on a line, or not about the axis.
    """
    from scipy.interpolate import LinearNDInterpolator
    from scipy.spatial import QhullError

    reach = float(np.hypot(*places.T).max()) or 1.0
    r = np.linspace(0.0, reach, _CIRCLES)
    # On the axis and along an edge of the mesh, rounding decides what is inside.
    directions = 2 * np.pi * (np.arange(_DIRECTIONS) + 0.5) / _DIRECTIONS
    circles = np.maximum(r, 1e-6 * reach)[:, None]
    points = np.stack([circles * np.cos(directions), circles * np.sin(directions)], axis=-1)
    distinct, index = np.unique(np.round(places / reach, 7), axis=0, return_inverse=True)
    number = np.bincount(index.ravel())
    try:
        fields = {
            name: LinearNDInterpolator(
                distinct * reach, np.bincount(index.ravel(), values) / number
            )(points)
            for name, values in columns.items()
        }
    except QhullError as error:
        raise InputError(
            "The nodes on the base of the film lie on one line.",
            cure="Name the axis across the film (vertical; --vertical).",
        ) from error
    inside = np.isfinite(next(iter(fields.values())))
    share = inside.sum(axis=1)
    kept = share >= max(1, share.max() / 2)
    means = {name: np.nansum(values[kept], axis=1) / share[kept] for name, values in fields.items()}
    first = next(iter(columns))
    spread = np.nanmax(np.abs(fields[first][kept] - means[first][:, None]))
    peak = float(np.abs(means[first]).max())
    note = (
        f"Means over {kept.sum()} circles about the axis, interpolated linearly between "
        f"{distinct.shape[0]} places in the base; on a circle the normal stress differs from its "
        f"mean by up to {spread / peak if peak else 0:.2g} of the maximum."
    )
    return {"r": r[kept], **means}, note
