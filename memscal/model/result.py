"""Base of all results: each shows itself as text, mapping, arrays, figure and notebook cell.

The modules that write and draw a result import it: the table of :mod:`memscal.extensions` names
them, and they are imported when a method is called.
"""

from __future__ import annotations

from functools import partial
from html import escape
from inspect import signature
from typing import TYPE_CHECKING, Any, TypedDict, Unpack

from memscal import extensions
from memscal.errors import InputError, require_names

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from os import PathLike

    import pandas as pd
    import xarray
    from matplotlib.figure import Figure

#: Dots of a figure in a notebook, per inch.
_IN_A_NOTEBOOK = 100.0


class PlotOptions(TypedDict, total=False):
    """What some figures take: contacts beside it, its name, what is drawn, or varied."""

    beside: Sequence[Any]
    name: str
    lubrication: str
    loading: str
    vary: str


class Drawn:
    """A result that draws itself, by the function that stands beside its class."""

    def plot(
        self,
        *,
        figsize: tuple[float, float] | None = None,
        k: float = 2.0,
        panels: str | Sequence[str] = (),
        style: str | Mapping[str, Any] | Sequence[str | Mapping[str, Any]] = (),
        **options: Unpack[PlotOptions],
    ) -> Figure:
        """Draw the result; the figure is returned, and nothing is shown or written.

        Parameters
        ----------
        figsize : (float, float), optional
            Width and height in inches; ``(3.15, 2.4)`` suits a panel in a column of 8 cm.
        k : float
            Coverage factor of bands and error bars.
        panels : str or sequence of str
            Panels that are drawn, alone: their letters in the whole figure or, of a calibration,
            ``scan``, ``residuals``, ``scan_log``, ``radial``, ``radial_log``, ``transfer``.
        style : str, mapping, or several
            Styles of matplotlib, or its settings, on top of ours.
        **options
            What else the figure of this result takes: of a comparison ``name``, ``lubrication``
            and ``loading``, of a contact others ``beside`` it, of a design what to ``vary``.

        Raises
        ------
        InputError
            If the figure has no such option or panel, or cannot have such a size or style.
        """
        module, _, function = extensions.VIEWS[type(self).__name__][1].rpartition(".")
        figure_of = getattr(extensions.module(module), function)
        require_names("The figure has no option", options, [*signature(figure_of).parameters][1:])
        draw = partial(figure_of, self, **options)
        chosen = [panels] if isinstance(panels, str) else panels
        figure: Figure = extensions.hook("drawn_as")(draw, figsize, k, chosen, style)
        return figure


class Told:
    """A result that prints itself.

    The module of its summary has the functions ``tables(result)``, ``mapping(result)`` and, where
    there is one, ``answer(result)``.
    """

    def tables(self) -> list[Any]:
        """Return the tables of the result, those without rows left out."""
        return [table for table in _shown_as("tables", self) if table.rows]

    def answer(self) -> str:
        """Return what the result says, in about two lines; empty where only its tables do."""
        answer = getattr(_summary_module(self), "answer", None)
        return str(answer(self)) if answer else ""

    def summary(self) -> str:
        """Return answer and tables of the result as text, as the command line prints them."""
        return str(extensions.hook("text_of")(self.answer(), self.tables()))

    def __str__(self) -> str:
        """Return the summary."""
        return self.summary()

    def _repr_html_(self) -> str:
        lines = "<br>\n".join(map(escape, self.answer().splitlines()))
        blocks = [f"<p>{lines}</p>"] if lines else []
        blocks += [table.html() for table in self.tables()]
        if isinstance(self, Drawn):
            image = extensions.hook("html_image")(self.plot(), "png", _IN_A_NOTEBOOK)
            blocks.append(f'<img alt="Figure of a {type(self).__name__}" src="{image}">')
        return "\n".join(blocks)

    def to_dict(self) -> dict[str, Any]:
        """Return values with standard uncertainties and units, as JSON holds them.

        The keys are those that the command which makes such a result prints with ``--json``; its
        JSON Schema, in ``memscal/cli/schemas``, describes each.  A contact is one of the
        ``solutions`` of ``memscal reference``.
        """
        return dict(_shown_as("mapping", self))

    def report(self, path: str | PathLike[str] | None = None) -> str:
        """Return the result as an HTML page without other files, network or scripts.

        Parameters
        ----------
        path : path, optional
            Where the page is written, too; a file there is replaced.
        """
        page = str(extensions.hook("html_report")(self))
        if path is not None:
            extensions.hook("atomic_write_bytes")(path, page.encode("utf-8"), overwrite=True)
        return page


class Shown(Drawn, Told):
    """A result that prints and draws itself."""


class Tabulated(Told):
    """A result whose module has ``frame(result)``."""

    def to_dataframe(self) -> pd.DataFrame:
        """Return the result as a table of numbers, with their units (needs pandas)."""
        return _shown_as("frame", self)


class Correlated(Told):
    """A result whose module has ``correlated(result)``."""

    def ufloats(self) -> dict[str, Any]:
        """Return the parameters as correlated numbers of the package uncertainties, in SI units."""
        return dict(_shown_as("correlated", self))


class Gridded(Told):
    """A result whose module has ``dataset(result)``."""

    def to_xarray(self) -> xarray.Dataset:
        """Return the arrays on their axes, each with its unit, in SI units (needs xarray)."""
        dataset: xarray.Dataset = _shown_as("dataset", self)
        return dataset


class Result(Shown, Tabulated, Correlated, Gridded):
    """A result that shows itself in every way."""


def _summary_module(result: Told) -> Any:
    return extensions.module(extensions.VIEWS[type(result).__name__][0])


def _shown_as(form: str, result: Told) -> Any:
    try:
        return getattr(_summary_module(result), form)(result)
    except ModuleNotFoundError as error:
        raise InputError(
            f"{error.name} is not installed.",
            cure='Install it with the extra "interop": pip install ".[interop]" in memscal\'s '
            "folder.",
        ) from error
