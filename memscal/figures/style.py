"""Style of all figures: type, colours, layout, and the bytes of a figure's file."""

import io
import textwrap
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from string import ascii_lowercase
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib import style as styles
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.font_manager import findfont, get_font
from matplotlib.layout_engine import ConstrainedLayoutEngine
from numpy.typing import NDArray

from memscal.axisymmetry.hankel import radial_spline
from memscal.errors import InputError, require_names
from memscal.estimation.points import TANGENTIAL
from memscal.figures import FIGURE_SUFFIXES
from memscal.model.apparatus import ApparatusData
from memscal.model.arrays import FloatArray, Values
from memscal.model.quantities import MM


def channel_indices(data: ApparatusData) -> str:
    """Return the indices of the stress that a sensor's channel measures: zz, xz or yz."""
    return data.sensor.channel if data.sensor.channel in TANGENTIAL else "zz"


COVERAGE_NOTE = "Error bars and bands: expanded uncertainty U = {0:g}u (k = {0:g})."
"""What a figure with uncertainties states below its panels, of its coverage factor."""

ALONG_RADIUS = "distance from the axis $r$ (mm)"
"""Label of the axis along which profiles are drawn."""

FIGURE_WIDTH = 7.2
"""Width in inches of a figure across two columns of a journal."""

MEASURED = "#000000"
DECONVOLVED = "#0072B2"
GAUSSIAN = "#D55E00"
REFERENCE = "#009E73"
WINDOW = "#7B3F8C"
MUTED = "#6B6B6B"
FAILED = "#A11D00"
"""Okabe and Ito's colours, for colour-blind readers; line styles differ, too, for grey print."""

Looks = dict[float, tuple[str, str]]
"""Colour and name of each load."""

SCATTER_THRESHOLD = 400
"""Above this many points dots are drawn in place of error bars."""

#: Room in inches for the line below the panels.
_NOTE_HEIGHT = 0.2
#: Loads up to this multiple of another one look alike.
_ALIKE = 1.05
#: Radii closer than this, in m, count as one.
_CLOSE = 1e-6
#: Marker and filling of a lubrication.
_LUBRICATIONS = {"dry": ("o", True), "lubricated": ("s", False), "": ("D", True)}

_STYLE = Path(__file__).with_name("house.mplstyle")


#: Coverage factor, the user's style on top of ours, and whether all panels are drawn, with letters.
_LOOK = ContextVar[tuple[float, Any, bool]]("look", default=(2.0, (), True))


class HouseFigure(Figure):
    """A figure that a notebook shows at the end of a cell."""

    def _repr_png_(self) -> bytes:
        return render_figure(self, "png", dpi=100.0)


def coverage() -> float:
    """Return the coverage factor of every error bar, band and limit in a figure."""
    return _LOOK.get()[0]


def drawn_as(
    draw: Callable[[], Figure],
    figsize: tuple[float, float] | None,
    k: float,
    panels: Sequence[str],
    style: Any,
) -> Figure:
    """Draw a figure with a coverage factor and a style, of a size in inches, or some panels."""
    try:
        Figure(figsize)
        with mpl.rc_context():
            styles.use(style)
        if not k > 0:
            raise ValueError("no band is drawn with it")
    except (KeyError, OSError, TypeError, ValueError) as error:
        raise InputError(
            f"No figure has figsize={figsize!r}, k={k!r} and style={style!r}: {error}.",
            cure="Give width and height in inches, and styles of matplotlib or its settings.",
        ) from error
    token = _LOOK.set((k, style, not panels))
    try:
        figure = draw()
        if figsize:
            figure.set_size_inches(figsize)
        if panels:
            _keep_panels(figure, panels)
        return figure
    finally:
        _LOOK.reset(token)


def _keep_panels(figure: Figure, names: Sequence[str]) -> None:
    """Keep panels alone, below each other, each with labels of its own."""
    panels = figure.axes
    require_names("The figure has no panel", names, [str(axes.get_label()) for axes in panels])
    kept = [axes for axes in panels if axes.get_label() in names]
    grid = figure.add_gridspec(len(kept))
    for i, axes in enumerate(kept):
        siblings = axes.get_shared_x_axes().get_siblings(axes)
        label = max((other.get_xlabel() for other in siblings), key=len)
        axes.set(xlabel=label, ylabel=textwrap.fill(axes.get_ylabel(), 34))
        axes.tick_params(labelbottom=True, labelleft=True)
        axes.set_subplotspec(grid[i])
    for artist in {*panels, *figure.texts} - {*kept}:
        artist.remove()
    figure.set_layout_engine("constrained")


@contextmanager
def house_style() -> Iterator[None]:
    """Set matplotlib's settings to the house's, not the user's, and restore them after."""
    # They are read both when a figure is built and when it is rendered: both need this.
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(mpl.rc_params_from_file(_STYLE, use_default_template=False))
        styles.use(_LOOK.get()[1])
        yield


def drawable(text: str) -> str:
    """Return the text in the font's characters, a mark for each other one."""
    font = get_font(findfont("DejaVu Sans"))
    return "".join(c if font.get_char_index(ord(c)) else "\ufffd" for c in text)


def new_figure(height: float, note: str = "") -> Figure:
    """Return an empty figure of the usual width and a height in inches, a note at its bottom."""
    room = _NOTE_HEIGHT if note else 0.0
    share = room / (height + room)
    layout = ConstrainedLayoutEngine(
        w_pad=0.05, h_pad=0.04, wspace=0.04, hspace=0.02, rect=(0.0, share, 1.0, 1.0 - share)
    )
    figure = HouseFigure(figsize=(FIGURE_WIDTH, height + room), layout=layout)
    FigureCanvasAgg(figure)
    if note:
        figure.text(0.01, 0.3 * share, note.format(coverage()), color=MUTED, fontsize=7)
    return figure


@contextmanager
def panels_of(
    height: float, rows: int = 1, columns: int = 1, note: str = COVERAGE_NOTE, **layout: Any
) -> Iterator[tuple[Figure, NDArray[Any]]]:
    """Yield a figure of a height in inches and its panels, in the house's style, with letters.

    The note stands below the panels.
    """
    with house_style():
        figure = new_figure(height, note)
        panels = np.asarray(figure.subplots(rows, columns, **layout))
        panel_letters(panels.flat)
        yield figure, panels


def panel_letters(panels: Iterable[Axes]) -> None:
    """Put each panel's letter at the upper left, outside the frame and clear of all data."""
    for axes, letter in zip(panels, ascii_lowercase, strict=False):
        axes.set_label(axes.get_label() or letter)
        axes.annotate(
            letter if _LOOK.get()[2] else "",
            (0.0, 1.0),
            (-5, 6),
            xycoords="axes fraction",
            textcoords="offset points",
            fontweight="bold",
            fontsize=10,
            horizontalalignment="right",
        )


def legend_above(
    axes: Axes, *, columns: int = 2, points: int = 0, first: Artist | None = None
) -> None:
    """Put the legend above the frame, where it cannot lie over data, in order after ``first``."""
    handles, _ = axes.get_legend_handles_labels()
    axes.legend(
        handles=sorted(handles, key=lambda handle: handle is not first),
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns if _LOOK.get()[2] else 1,
        borderpad=0.2,
        markerscale=3.0 if points > SCATTER_THRESHOLD else 1.0,
    )


def entry_columns(entries: int) -> int:
    """Return how many columns the entries of a figure's legend take, or of a panel's."""
    return min(entries, 7 if _LOOK.get()[2] else 2)


def shades(count: int, first: float) -> list[str]:
    """Return colours that get darker along a path, also in grey; the first from 0 to 1."""
    if count == 1:
        return [DECONVOLVED]
    colours = mpl.colormaps["viridis_r"](np.linspace(first, 1.0, count))
    return [mpl.colors.to_hex(colour) for colour in colours]


def load_looks(loads: Iterable[float]) -> Looks:
    """Return colour and name of each load: darker as it grows; within 5 % loads look alike."""
    groups: list[list[float]] = []
    for load in sorted(set(loads)):
        if groups and load <= _ALIKE * groups[-1][0]:
            groups[-1].append(load)
        else:
            groups.append([load])
    looks: Looks = {}
    for group, colour in zip(groups, shades(len(groups), 0.2), strict=True):
        name = f"{np.mean(group):.3g} N"
        looks |= dict.fromkeys(group, (colour, name))
    return looks


def mark(lubrication: str, colour: str) -> Values:
    """Return marker and colours of points by their lubrication, distinct in grey print."""
    marker, filled = _LUBRICATIONS.get(lubrication, _LUBRICATIONS[""])
    return {"marker": marker, "color": colour, "mfc": colour if filled else "white"}


def draw_measured(
    axes: Axes, x: FloatArray, y: FloatArray, bars: FloatArray | None, *, many: bool, **look: Any
) -> Any:
    """Draw measured points, with bars if there are any; of many, dots alone; return them."""
    if bars is not None and not many:
        return axes.errorbar(x, y, bars, **look)
    for name in ("elinewidth", "capsize"):
        look.pop(name, None)
    if many:
        look = {"zorder": 1} | look | {"marker": ".", "mfc": look["color"], "ms": 1.5, "mew": 0}
    return axes.plot(x, y, rasterized=many, **look)[0]


def draw_band(
    axes: Axes, x: FloatArray, low: FloatArray, high: FloatArray, label: str | None = None
) -> None:
    """Draw the band of a curve's expanded uncertainty."""
    axes.fill_between(x, low, high, color=DECONVOLVED, alpha=0.25, lw=0, label=label)


def draw_residual_band(axes: Axes) -> None:
    """Draw where residuals over their standard uncertainty are expected."""
    axes.axhspan(-coverage(), coverage(), color="0.92", lw=0)
    axes.axhline(0.0, color="0.4", lw=0.6)


def draw_zero(axes: Axes) -> None:
    """Draw the line of no stress, behind all data."""
    axes.axhline(0.0, color="0.8", lw=0.5, zorder=0)


def along_radius(axes: Axes, r: FloatArray, ylabel: str) -> None:
    """Label axes on which curves are drawn up to the last of some radii, in m."""
    draw_zero(axes)
    axes.set(xlim=(0, r[-1] / MM), xlabel=ALONG_RADIUS, ylabel=ylabel)


def on_axis(r: FloatArray, values: FloatArray, fine: FloatArray) -> FloatArray:
    """Return smooth even profiles (m, k) at fine radii, through (m, n) at increasing ones."""
    kept = []
    last = -np.inf
    for i, radius in enumerate(r):
        if radius - last > _CLOSE:
            kept.append(i)
            last = radius
    return radial_spline(r[kept], values[:, kept].T)(fine).T


def marker_size(points: int) -> float:
    """Return a marker size in points that keeps 33 points visible and 400 apart."""
    return float(np.clip(4.0 * (40.0 / max(points, 1)) ** 0.5, 1.5, 4.0))


# matplotlib writes the time and its own version unless the metadata leave them out.
_METADATA: Mapping[str, dict[str, str | None]] = {
    "png": {"Software": None},
    "svg": {"Date": None, "Creator": None},
    "pdf": {"CreationDate": None, "Creator": None, "Producer": None},
}


def figure_format(suffix: str) -> str:
    """Return matplotlib's name of the format that a file name's suffix asks for."""
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
    """Return the figure as the bytes of a PNG, SVG or PDF file, without dates."""
    metadata = _METADATA[figure_format("." + file_format)]
    buffer = io.BytesIO()
    with house_style():
        figure.savefig(buffer, format=file_format, dpi=dpi, metadata=metadata)
    return buffer.getvalue()
