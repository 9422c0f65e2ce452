"""A calibration in one figure: the paper's Fig. 2, with what it takes to trust it."""

from __future__ import annotations

import textwrap

from matplotlib.figure import Figure

from memscal.figures.apparatus_panels import draw_radial, draw_radial_log, draw_transfer
from memscal.figures.residual_panel import draw_residuals
from memscal.figures.scan_panels import draw_scan, draw_scan_log
from memscal.figures.style import COLOURS, drawable, house_style, new_figure, panel_letter
from memscal.model.apparatus import ApparatusData
from memscal.model.checks import QualityCheck
from memscal.model.quantities import KPA, MM, measured_text

__all__ = ["calibration_figure", "failed_checks_text", "values_text"]

_PANELS_HEIGHT = 8.2
_LINE_HEIGHT = 0.155
_LINE_WIDTH = 122
_MAX_FAILED_LINES = 12
_MARGIN = 0.012  # left and right of the lines of text, of the width


def calibration_figure(data: ApparatusData) -> Figure:
    r"""Draw an apparatus function and the scan that it came from.

    Left: the scan with its standard uncertainty, the reconvolutions
    :math:`A\,(G \otimes \sigma_{zz})` with the deconvolved G and with the Gaussian, the
    reference :math:`\sigma_{zz}` on the right-hand axis, and the rod's diameter (a, linear;
    c, logarithmic), and residuals in units of standard uncertainty (b).  Right: G(r) with
    its band (k = 2) and the Gaussian (d, linear; e, logarithmic), and the transfer function
    with the regularisation's window, hatched where the scan does not resolve it (f).

    Parameters
    ----------
    data : ApparatusData
        The result of a calibration, or what was read from an artifact.

    Returns
    -------
    matplotlib.figure.Figure
        7.2 inches wide, with an Agg canvas and outside of pyplot; save it with
        :func:`memscal.figures.save.save_figure`.

    Notes
    -----
    After Fig. 2 of Scheibert, Prevost, Frelat, Rey and Debrégeas: panel a is its a), panel d
    its b).  In c a point less than 2u above the baseline is drawn as an upper limit.
    """
    with house_style():
        lines = _text_lines(data)
        text_height = _LINE_HEIGHT * (len(lines) + 0.6)
        figure = new_figure(_PANELS_HEIGHT + text_height)
        outer = figure.add_gridspec(2, 2, height_ratios=[text_height, _PANELS_HEIGHT])
        _write_lines(figure, lines)
        figure.add_subplot(outer[0, :]).set_axis_off()
        left = outer[1, 0].subgridspec(3, 1, height_ratios=[3.0, 1.5, 3.0])
        right = outer[1, 1].subgridspec(3, 1)
        scan = figure.add_subplot(left[0], label="scan")
        residuals = figure.add_subplot(left[1], sharex=scan, label="residuals")
        scan_log = figure.add_subplot(left[2], sharex=scan, label="scan_log")
        radial = figure.add_subplot(right[0], label="radial")
        radial_log = figure.add_subplot(right[1], sharex=radial, label="radial_log")
        transfer = figure.add_subplot(right[2], label="transfer")
        draw_scan(scan, data)
        draw_residuals(residuals, data)
        draw_scan_log(scan_log, data)
        draw_radial(radial, data)
        draw_radial_log(radial_log, data)
        draw_transfer(transfer, data)
        for axes in (scan, residuals, radial):
            axes.tick_params(labelbottom=False)
        panels = (scan, residuals, scan_log, radial, radial_log, transfer)
        for letter, axes in zip("abcdef", panels, strict=True):
            panel_letter(axes, letter)
        # One pass of the layout, then none: rendering twice gives the same picture twice.
        figure.draw_without_rendering()
        figure.set_layout_engine("none")
    return figure


def values_text(data: ApparatusData) -> str:
    """Return the main values with their standard uncertainties, in one line."""
    parts = [f"A = {measured_text(data.parameters, 'conversion_constant')}"]
    parts.append(f"σ = {measured_text(data.parameters, 'gaussian_sigma')} (data space)")
    if "gaussian_sigma_deconvolved" in data.parameters:
        text = measured_text(data.parameters, "gaussian_sigma_deconvolved")
        parts.append(f"{text} (deconvolved G)")
    return ",  ".join(parts)


def failed_checks_text(checks: tuple[QualityCheck, ...]) -> list[str]:
    """Return one sentence for each failed check, in words."""
    return [
        f"Failed check, {check.name.replace('_', ' ')}: {check.value:.3g} "
        f"against a limit of {check.limit:.3g}. {check.meaning}"
        for check in checks
        if not check.passed
    ]


def _text_lines(data: ApparatusData) -> list[tuple[str, str, str]]:
    """Return the lines above the panels, each with colour and weight."""
    ink = COLOURS["measured"]
    sensor = (
        " ".join(part for part in (data.sensor.name, data.sensor.model) if part) or "the sensor"
    )
    sensor = textwrap.shorten(sensor, 60, placeholder=" …") + f", channel {data.sensor.channel}"
    title = textwrap.shorten(f"Apparatus function of {sensor}", 95, placeholder=" …")
    film = data.film
    setting = (
        f"{data.indenter.shape} of radius {data.indenter.radius / MM:.3g} mm, {data.load:.3g} N; "
        f"film {film.thickness / MM:.3g} mm, E = {film.young_modulus / KPA / 1e3:.3g} MPa, "
        f"ν = {film.poisson_ratio:.3g}; ± is the standard uncertainty (k = 1)"
    )
    rows = [(title, ink, "bold"), (setting, COLOURS["muted"], "normal")]
    rows.append((values_text(data), ink, "normal"))
    if data.checks and data.passed:
        rows.append((f"All {len(data.checks)} quality checks passed.", ink, "normal"))
    failed = [
        (line, COLOURS["failed"], "normal")
        for sentence in failed_checks_text(data.checks)
        for line in _wrapped(sentence)
    ]
    if len(failed) > _MAX_FAILED_LINES:
        rest = "… and more failed checks: see the report, or `memscal inspect`."
        failed = [*failed[: _MAX_FAILED_LINES - 1], (rest, COLOURS["failed"], "normal")]
    return [(line, ink, weight) for row, ink, weight in rows for line in _wrapped(row)] + failed


def _wrapped(text: str) -> list[str]:
    return textwrap.wrap(text, _LINE_WIDTH) or [""]


def _write_lines(figure: Figure, lines: list[tuple[str, str, str]]) -> None:
    height = figure.get_figheight()
    for i, (line, colour, weight) in enumerate(lines):
        y = 1.0 - (0.08 + _LINE_HEIGHT * i) / height
        # A sensor's name may hold a dollar sign: it is text, not mathematics.
        text = figure.text(
            _MARGIN, y, drawable(line), color=colour, weight=weight, va="top", parse_math=False
        )
        size = 9.0 if i == 0 else 7.5
        text.set_fontsize(size)
        text.set_in_layout(False)
        # Lines are broken by their number of characters; one of wide letters is set smaller.
        available = (1 - 3 * _MARGIN) * figure.bbox.width
        width = text.get_window_extent().width
        text.set_fontsize(size * min(1.0, available / max(width, 1.0)))
