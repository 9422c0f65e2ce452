"""Outputs: where they go, and the proof that they can, before anything is computed."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import click

__all__ = ["FIGURE_SUFFIXES", "FigurePath", "beside", "prove_writable"]

FIGURE_SUFFIXES = (".png", ".svg", ".pdf")
"""Those of ``memscal.figures.render``, which would import matplotlib; a test compares them."""

_HDF5_SUFFIXES = (".h5", ".hdf5", ".hdf", ".nxs", ".nx5")


class FigurePath(click.Path):
    """The name of a figure's file, whose suffix chooses the format."""

    name = "figure"

    def __init__(self) -> None:
        super().__init__(path_type=Path)

    def convert(
        self, value: object, param: click.Parameter | None, ctx: click.Context | None
    ) -> Path:
        """Refuse a suffix in which no figure can be written."""
        path = Path(str(value))
        if path.suffix.lower() not in FIGURE_SUFFIXES:
            self.fail(
                f"{str(path)!r} does not end in {', '.join(FIGURE_SUFFIXES)}: the suffix chooses "
                "the format.",
                param,
                ctx,
            )
        return path


def beside(path: Path, suffix: str) -> Path:
    """Return the name of a result beside its input.

    Examples
    --------
    >>> beside(Path("data/scan.h5"), ".apparatus.h5").name
    'scan.apparatus.h5'
    >>> beside(Path("run_0.5mm"), ".apparatus.h5").name
    'run_0.5mm.apparatus.h5'
    """
    stem = path.stem if path.suffix.lower() in _HDF5_SUFFIXES else path.name
    return path.with_name(stem + suffix)


def prove_writable(outputs: Sequence[Path], *, force: bool, inputs: Sequence[Path] = ()) -> None:
    """Refuse outputs that share a name, and prove that each can be written.

    Raises
    ------
    click.UsageError
        If two outputs are the same file.
    OutputError
        If one cannot be written, exists (without ``force``), or is an input.
    """
    from memscal.formats.atomic import ensure_writable

    seen: dict[Path, Path] = {}
    for output in outputs:
        real = output.resolve()
        if real in seen:
            raise click.UsageError(
                f"Two outputs have the same name: {seen[real]} and {output}. Give each its own."
            )
        seen[real] = output
    for output in outputs:
        ensure_writable(output, overwrite=force, inputs=inputs)
