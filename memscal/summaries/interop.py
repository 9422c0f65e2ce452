"""Datasets, tables and correlated numbers of other libraries, from declared quantities."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from memscal.model.arrays import FloatArray
from memscal.model.quantities import DIMENSIONS, Quantity
from memscal.summaries.table import finite

if TYPE_CHECKING:
    import pandas as pd
    import xarray


def labelled_dataset(
    quantities: Iterable[Quantity],
    values: Mapping[str, ArrayLike],
    axes: Mapping[str, tuple[str, ...]] | None = None,
) -> xarray.Dataset:
    """Return values in SI units by the names of their quantities, which give axes and words.

    ``axes``: those of quantities that here run along others than declared.
    """
    import xarray

    variables = {}
    for quantity in quantities:
        if quantity.name in values:
            attributes = {"long_name": quantity.words}
            if quantity.dimension in DIMENSIONS:
                attributes["units"] = DIMENSIONS[quantity.dimension].si
            names = (axes or {}).get(quantity.name, quantity.axes)
            variables[quantity.name] = (names, np.asarray(values[quantity.name]), attributes)
    return xarray.Dataset(variables)


def data_frame(quantities: Iterable[Quantity], values: Mapping[str, ArrayLike]) -> pd.DataFrame:
    """Return columns of the values (SI) in the units in which they are shown."""
    import pandas as pd

    return pd.DataFrame(
        {
            column(quantity): np.asarray(values[quantity.name]) / quantity.scale
            if quantity.dimension in DIMENSIONS
            else values[quantity.name]
            for quantity in quantities
            if quantity.name in values
        }
    )


def column(quantity: Quantity) -> str:
    """Return the name of a column: ``"r (mm)"``."""
    shown = quantity.unit if quantity.dimension in DIMENSIONS else ""
    return f"{quantity.name} ({shown})" if shown else quantity.name


def correlated_numbers(
    names: Sequence[str], values: Sequence[float] | FloatArray, covariance: FloatArray
) -> dict[str, Any]:
    """Return numbers of the package uncertainties by name."""
    from uncertainties import correlated_values

    return dict(zip(names, correlated_values(list(values), covariance), strict=True))


def quantity_json(
    value: float | None, unit: str, uncertainty: float | None = None
) -> dict[str, Any]:
    """Return a value with unit, and its standard uncertainty where there is one, for JSON."""
    spread = {} if uncertainty is None else {"standard_uncertainty": finite(uncertainty)}
    return {"value": finite(value), **spread, "unit": unit}
