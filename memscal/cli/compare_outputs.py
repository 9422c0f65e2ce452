"""The figures that ``memscal compare`` writes: one by name, or all of them into a folder."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import click

from memscal.cli.targets import prove_writable

if TYPE_CHECKING:
    from memscal.friction.results import FrictionComparison

__all__ = ["FigureFiles", "figure_stems"]


def figure_stems(lubrications: Iterable[str], *, interface: bool = False) -> list[str]:
    """Return the stems of all figures' names: those of ``memscal.figures.friction``.

    They are needed before anything is computed, without matplotlib; a test compares both.

    Examples
    --------
    >>> figure_stems(["dry"])
    ['profiles-dry', 'friction-set-dry', 'maxima', 'effective-friction', 'likelihood']
    """
    tails = [f"-{name}" if name else "" for name in dict.fromkeys(lubrications)]
    of_each = [f"{stem}{tail}" for tail in tails for stem in ("profiles", "friction-set")]
    found = [*of_each, "maxima", "effective-friction", "likelihood"]
    return [*found, "interface"] if interface else found


@dataclass(frozen=True)
class FigureFiles:
    """Which figures are wanted, and where.

    Parameters
    ----------
    single : tuple of Path
        Files of the figure that shows all at a glance.
    folder : Path or None
        Folder of all others.
    suffix : str
        Their format: ``png``, ``svg`` or ``pdf``.
    lubrications : tuple of str
        Of the scans that are compared.
    interface : bool
        Whether laws of the interface are compared.
    """

    single: tuple[Path, ...]
    folder: Path | None
    suffix: str
    lubrications: tuple[str, ...]
    interface: bool = False

    @property
    def in_folder(self) -> dict[str, Path]:
        """Files in the folder by the stem of their names."""
        if self.folder is None:
            return {}
        stems = figure_stems(self.lubrications, interface=self.interface)
        return {stem: self.folder / f"{stem}.{self.suffix}" for stem in stems}

    @property
    def paths(self) -> list[Path]:
        """All files."""
        return [*self.single, *self.in_folder.values()]

    def prove(self, *, force: bool, inputs: Sequence[Path]) -> None:
        """Prove that all can be written; a folder that is not there yet is made at the end.

        Raises
        ------
        click.UsageError
            If two have one name, or the folder is a file.
        OutputError
            If one cannot be written.
        """
        if self.folder is not None and not self.folder.is_dir():
            if self.folder.exists():
                raise click.UsageError(f"--figures names a folder, but {self.folder} is a file.")
            prove_writable([*self.single, self.folder], force=force, inputs=inputs)
        else:
            prove_writable(self.paths, force=force, inputs=inputs)

    def rendered(self, found: FrictionComparison) -> dict[Path, bytes]:
        """Return the content of each file."""
        if not self.paths:
            return {}
        from memscal.figures.friction import comparison_figure, comparison_figures
        from memscal.figures.render import figure_format, render_figure

        ready: dict[Path, bytes] = {}
        if self.single:
            figure = comparison_figure(found)
            for path in self.single:
                ready[path] = render_figure(figure, figure_format(path.suffix))
        if self.folder is not None:
            named = self.in_folder
            for stem, draw in comparison_figures(found).items():
                ready[named[stem]] = render_figure(draw(), self.suffix)
        return ready

    def write(self, ready: dict[Path, bytes], *, force: bool) -> None:
        """Write what was rendered.

        Raises
        ------
        OutputError
            If a file cannot be written.
        """
        from memscal.formats.atomic import atomic_write_bytes

        if self.folder is not None:
            self.folder.mkdir(exist_ok=True)
        for path, content in ready.items():
            atomic_write_bytes(path, content, overwrite=force)
