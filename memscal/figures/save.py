"""Figures to files: rendered in memory first, then written whole or not at all."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from matplotlib.figure import Figure

from memscal.figures.render import figure_format, render_figure
from memscal.formats.atomic import atomic_write_bytes

__all__ = ["save_figure"]


def save_figure(figure: Figure, path: str | PathLike[str], *, overwrite: bool = False) -> None:
    """Write a figure as PNG (200 dots per inch), SVG or PDF, by the suffix of its name.

    Parameters
    ----------
    figure : matplotlib.figure.Figure
        What to write.
    path : path-like
        The file; its suffix, ``.png``, ``.svg`` or ``.pdf``, chooses the format.
    overwrite : bool
        Replace a file that exists.

    Raises
    ------
    InputError
        If the suffix is none of the three.
    OutputError
        If the file exists and ``overwrite`` is false, or cannot be written.  What was there
        before is untouched.

    Examples
    --------
    >>> import tempfile
    >>> from matplotlib.figure import Figure
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "empty.svg")
    ...     save_figure(Figure(), path)
    ...     path.read_text()[:5]
    '<?xml'
    """
    file_format = figure_format(Path(path).suffix)
    atomic_write_bytes(path, render_figure(figure, file_format), overwrite=overwrite)
