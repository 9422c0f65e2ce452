"""A figure as the bytes of a file: the same figure gives the same bytes, on every run."""

from __future__ import annotations

import io
from collections.abc import Mapping

from matplotlib.figure import Figure

from memscal.errors import InputError
from memscal.figures.style import house_style

__all__ = ["FIGURE_SUFFIXES", "figure_format", "render_figure"]

FIGURE_SUFFIXES = (".png", ".svg", ".pdf")
"""What a figure's file name may end in."""

# matplotlib writes the time and its own version unless it is told not to.
_METADATA: Mapping[str, dict[str, str | None]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


def figure_format(suffix: str) -> str:
    """Return matplotlib's name of the format that a file name's suffix asks for.

    Raises
    ------
    InputError
        If the suffix is none of ``.png``, ``.svg`` and ``.pdf``.

    Examples
    --------
    >>> figure_format(".PNG")
    'png'
    """
    if suffix.lower() not in FIGURE_SUFFIXES:
        raise InputError(
            f"A figure cannot be written as {suffix!r}."
            if suffix
            else "The figure's file name has no suffix.",
            why="The suffix of the file name chooses the format.",
            cure=f"Use one of {', '.join(FIGURE_SUFFIXES)}.",
        )
    return suffix.lower().removeprefix(".")


def render_figure(figure: Figure, file_format: str, *, dpi: float = 200.0) -> bytes:
    """Return the figure as the bytes of a PNG, SVG or PDF file, free of dates.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        What to render.
    file_format : str
        ``"png"``, ``"svg"`` or ``"pdf"``.
    dpi : float
        Dots per inch of a PNG, and of the point clouds inside the others.

    Returns
    -------
    bytes
    """
    metadata = _METADATA[figure_format("." + file_format)]
    buffer = io.BytesIO()
    with house_style():
        figure.savefig(buffer, format=file_format, dpi=dpi, metadata=metadata)
    return buffer.getvalue()
