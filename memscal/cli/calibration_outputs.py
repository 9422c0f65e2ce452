"""The files that ``memscal calibrate`` writes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from memscal.calibration.procedure import Calibration
    from memscal.calibration.sweep import Sweep

__all__ = ["Outputs"]


@dataclass(frozen=True)
class Outputs:
    """Where the results go."""

    artifact: Path
    report: Path | None
    figures: tuple[Path, ...]
    sweep_figure: Path | None

    @property
    def paths(self) -> tuple[Path, ...]:
        """All of them, the artifact first."""
        others = (self.report, *self.figures, self.sweep_figure)
        return (self.artifact, *(path for path in others if path is not None))

    def rendered(self, found: Calibration, swept: Sweep | None) -> dict[Path, bytes]:
        """Return the figures and the report as the bytes of their files."""
        ready: dict[Path, bytes] = {}
        if self.figures:
            from memscal.figures.calibration import calibration_figure
            from memscal.figures.render import figure_format, render_figure

            figure = calibration_figure(found.apparatus)
            for path in self.figures:
                ready[path] = render_figure(figure, figure_format(path.suffix))
        if self.report is not None:
            from memscal.figures.report import html_report

            ready[self.report] = html_report(found.apparatus).encode("utf-8")
        if self.sweep_figure is not None and swept is not None:
            from memscal.figures.render import figure_format, render_figure
            from memscal.figures.sweep import sweep_figure

            kind = figure_format(self.sweep_figure.suffix)
            ready[self.sweep_figure] = render_figure(sweep_figure(swept), kind)
        return ready

    def write(self, found: Calibration, ready: Mapping[Path, bytes], *, force: bool) -> None:
        """Write the artifact, then what was rendered: nothing is computed any more."""
        from memscal.formats.atomic import atomic_write_bytes

        found.apparatus.save(self.artifact, overwrite=force)
        for path, data in ready.items():
            atomic_write_bytes(path, data, overwrite=force)
