"""Maps of a calibration over the plane: voltage, residual and G; and its points, load by load."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any, TypeAlias

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colorbar import Colorbar
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec

from memscal.estimation.points import loads_differ
from memscal.figures.style import COLOURS, channel_indices, legend_above
from memscal.model.apparatus import ApparatusData, Reconvolution
from memscal.model.arrays import FloatArray
from memscal.model.quantities import MM, MV, PER_MM2
from memscal.model.scan import even_lattice

Loads: TypeAlias = Sequence[tuple[str, ApparatusData]]
"""Each load's text, and the calibration with its points only."""

_RESIDUALS = (-3.5, 3.5)
_MISSING = "0.75"  # grey of a node without a reading
_DOTS = 5e3  # area of all points that lie on no lattice, in square points: half of a map's
_KERNEL_WIDTHS = 5.0  # to which G is drawn


def by_load(data: ApparatusData) -> Loads:
    """Return the points of each load apart, from the smallest up; of a single one without text."""
    scan, parts = data.reconvolution, []
    if scan.load is None:
        return [("", data)]
    loads, inverse = np.unique(scan.load, return_inverse=True)
    # A load that is measured with noise at each point is one load: there is no gap in it.
    group = np.cumsum([0, *map(loads_differ, pairwise(loads))])[inverse]
    for inside in group == np.unique(group)[:, None]:
        columns = {name: v[inside] for name, v in vars(scan).items() if v is not None}
        load = float(scan.load[inside].mean())
        part = replace(data, load=load, reconvolution=Reconvolution(**columns))
        parts.append((f"{load:.3g} N", part))
    return parts if len(parts) > 1 else [("", data)]


def few_loads(loads: Loads, most: int) -> Loads:
    """Return the first of the loads; the text of the last says how many more there are."""
    if len(loads) <= most:
        return loads
    load, part = loads[most - 1]
    return [*loads[: most - 1], (f"{load}\nand {len(loads) - most} more loads", part)]


def standardised(scan: Reconvolution) -> tuple[FloatArray, FloatArray, str]:
    """Residuals with G and with the Gaussian over their standard uncertainty, and its symbol."""
    errors, scale = scan.u_zz_errors, "$u$"
    if not np.all(np.isfinite(errors) & (errors > 0)):
        # Without a stated uncertainty residuals are shown over their own rms.
        rms = rms_of(scan.residual)
        errors, scale = np.full(errors.shape, rms if rms > 0 else 1.0), "own rms"
    return scan.residual / errors, (scan.u_zz - scan.u_zz_gaussian) / errors, scale


def rms_of(values: FloatArray) -> float:
    """Return the root mean square."""
    return float(np.sqrt(np.mean(values**2)))


def residual_limit(*residuals: FloatArray) -> float:
    """Return an axis limit that one outlier cannot stretch."""
    sizes = np.abs(np.concatenate(residuals))
    return float(max(3.5, min(1.1 * np.max(sizes), 2.0 * np.quantile(sizes, 0.9))))


def draw_maps(figure: Figure, place: SubplotSpec, data: ApparatusData, loads: Loads) -> list[Axes]:
    """Draw voltage and residual of each load in a row, and G beside the first."""
    grid, indices = place.subgridspec(len(loads), 3), channel_indices(data)
    panels: list[Axes] = []
    for row, (load, part) in enumerate(loads):
        scan, background = part.reconvolution, np.asarray(part.reconvolution.background)
        # An outlier does not stretch the colours of the other voltages.
        measured, predicted = ((u - background) / MV for u in (scan.u_zz, scan.u_zz_predicted))
        z, _, scale = standardised(scan)
        for i, (values, span, colours, label) in enumerate((
            (measured, predicted, "viridis", f"$U_{{{indices}}}$ less baseline (mV)"),
            (z, _RESIDUALS, "RdBu_r", f"residual / {scale}"),
        )):  # fmt: skip
            axes = figure.add_subplot(grid[row, i], label=f"{('voltage', 'residual')[i]} map")
            limits = {"vmin": np.min(span), "vmax": np.max(span)}
            _finish(axes, _draw_points(axes, scan, values, cmap=colours, **limits), label)
            axes.set_title(load, loc="left", fontsize=8.0, pad=4)
            panels.append(axes)
        panels[-2].set_ylabel("$y$ from the centre (mm)", labelpad=14)
    kernel = figure.add_subplot(grid[0, 2], label="G map")
    x, y = (np.abs(a) <= _KERNEL_WIDTHS * data.gaussian_sigma for a in (data.field.x, data.field.y))
    plane = data.field.x[x] / MM, data.field.y[y] / MM, data.field.g[np.ix_(y, x)] / PER_MM2
    drawn = kernel.pcolormesh(*plane, cmap="viridis", rasterized=True)
    kernel.contour(*plane, [plane[2].max() / 2], colors=COLOURS["measured"], linewidths=1.0)
    kernel.plot([], [], color=COLOURS["measured"], lw=1.0, label="half of the largest G")
    legend_above(kernel)
    _finish(kernel, drawn, f"$G_{{{indices}}}$ (1/mm$^2$)")
    return [*panels[:2], kernel, *panels[2:]]


def _draw_points(
    axes: Axes, scan: Reconvolution, values: FloatArray, **colours: Any
) -> ScalarMappable:
    """Draw values at the points of a raster; on a lattice nodes that are missing are grey."""
    x, y = np.asarray(scan.offset_x), np.asarray(scan.offset_y)
    lattice = even_lattice(x, y, x.size)
    if lattice is None:
        return axes.scatter(
            x / MM, y / MM, _DOTS / x.size, values, rasterized=True, lw=0, **colours
        )
    nodes = [(a.start + a.step * np.arange(a.index.max() + 1)) / MM for a in lattice]
    cells = np.full((nodes[1].size, nodes[0].size), np.nan)
    cells[lattice[1].index, lattice[0].index] = values
    axes.set_facecolor(_MISSING)
    return axes.pcolormesh(*nodes, cells, rasterized=True, **colours)


def _finish(axes: Axes, drawn: ScalarMappable, label: str) -> None:
    """Give a map its aspect, axes, and a colour bar that is as high as it is."""
    axes.set(aspect="equal", xlabel="$x$ from the centre (mm)")
    axes.locator_params(nbins=4)
    Colorbar(axes.inset_axes((1.04, 0.0, 0.06, 1.0)), drawn, label=label)
