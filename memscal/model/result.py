"""Base of all results: each shows itself as text, mapping, arrays, figure and notebook cell.

The modules that write and draw a result import it: the table of :mod:`memscal.extensions` names
them, and they are imported when a method is called.
"""

from __future__ import annotations

from html import escape
from typing import TYPE_CHECKING, Any

from memscal import extensions
from memscal.errors import InputError

if TYPE_CHECKING:
    import pandas as pd
    import xarray
    from matplotlib.figure import Figure

_FORMS = {"dataset": "arrays", "frame": "data frame", "correlated": "covariance of parameters"}


class Result:
    """A result that prints, tabulates and draws itself.

    The module of its summary has the functions ``tables(result)``, ``mapping(result)`` and, where
    there is one, ``answer(result)``, ``dataset(result)``, ``frame(result)`` and
    ``correlated(result)``.
    """

    def tables(self) -> list[Any]:
        """Return the tables of the result, those without rows left out."""
        return [table for table in self._shown_as("tables") if table.rows]

    def answer(self) -> str:
        """Return what the result says, in about two lines; empty where only its tables do."""
        answer = getattr(self._summary_module(), "answer", None)
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
        return "\n".join([*blocks, *(table.html() for table in self.tables())])

    def to_dict(self) -> dict[str, Any]:
        """Return values with standard uncertainties and units, as JSON holds them."""
        return dict(self._shown_as("mapping"))

    def to_xarray(self) -> xarray.Dataset:
        """Return the arrays on their axes, each with its unit, in SI units (needs xarray)."""
        dataset: xarray.Dataset = self._shown_as("dataset")
        return dataset

    def to_dataframe(self) -> pd.DataFrame:
        """Return the result as a table of numbers, units in the names of columns (needs pandas)."""
        return self._shown_as("frame")

    def ufloats(self) -> dict[str, Any]:
        """Return the parameters as correlated numbers of the package uncertainties, in SI units."""
        return dict(self._shown_as("correlated"))

    def plot(self, **options: Any) -> Figure:
        """Draw the result; the figure is returned, and nothing is shown or written."""
        name = extensions.VIEWS[type(self).__name__][1]
        if not name:
            raise InputError(f"There is no figure of a {type(self).__name__}.")
        module, _, function = name.rpartition(".")
        figure: Figure = getattr(extensions.module(module), function)(self, **options)
        return figure

    def report(self) -> str:
        """Return the result as an HTML page without other files, network or scripts."""
        return str(extensions.hook("html_report")(self))

    def _summary_module(self) -> Any:
        return extensions.module(extensions.VIEWS[type(self).__name__][0])

    def _shown_as(self, form: str) -> Any:
        function = getattr(self._summary_module(), form, None)
        if function is None:
            raise InputError(
                f"A {type(self).__name__} has no {_FORMS[form]}.",
                cure="Use summary() or to_dict().",
            )
        try:
            return function(self)
        except ModuleNotFoundError as error:
            raise InputError(
                f"{error.name} is not installed.",
                cure='Install it with the extra "interop": pip install "memscal[interop]".',
            ) from error
