"""Results by their declared quantities: JSON, cells of tables, datasets, and data frames."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike

from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import Arrays, FloatArray, Values
from memscal.model.notation import format_measured
from memscal.model.quantities import DIMENSIONS, Quantity, Record, by_name, parameter_quantity
from memscal.summaries.table import finite

if TYPE_CHECKING:
    from pandas import DataFrame as DataFrame
    from xarray import Dataset as Dataset
else:  # their libraries are imported when they are needed
    DataFrame = Dataset = Any


def total_of(budget: Mapping[str, float]) -> float:
    """Return the standard uncertainty of a budget; what correlations take away has a minus sign."""
    return math.sqrt(max(sum(u * abs(u) for u in budget.values()), 0.0))


_UNCERTAINTY = "_uncertainty"
#: Endings of names of what stands beside a quantity in JSON, in its unit, and as what.
_COMPANIONS = {
    _UNCERTAINTY: "standard_uncertainty",
    "_errors": "standard_uncertainty",
    "_budget": "budget",
}


def members(quantities: Iterable[Quantity], holder: object, /, **values: Any) -> Values:
    """Return an object's quantities as JSON holds them; ``values`` stand in for attributes."""
    # In the units in which they are shown: a number or an array stands with its unit and, where
    # they are declared, its standard uncertainty and the budget of it; counts, statistics and
    # text stand alone.
    declared = by_name(quantities)
    held = {}
    for name, quantity in declared.items():
        key = quantity.label or name
        if quantity.dimension not in DIMENSIONS:
            held[key] = plain(_value(name, holder, values))
        elif not name.endswith(tuple(_COMPANIONS)):
            held[key] = {"value": plain(_value(name, holder, values), quantity.scale)}
            for ending, companion in _COMPANIONS.items():
                if name + ending in declared:
                    number = _value(name + ending, holder, values)
                    held[key][companion] = plain(number, quantity.scale)
            held[key]["unit"] = quantity.unit_text
    return held


def _value(name: str, holder: object, values: Values) -> Any:
    return values[name] if name in values else getattr(holder, name)


def plain(value: Any, scale: float = 1.0) -> Any:
    """Return text, truth, a count, or numbers over ``scale`` as JSON can hold them."""
    if isinstance(value, Mapping):
        return {key: plain(number, scale) for key, number in value.items()}
    if isinstance(value, np.ndarray | list | tuple):
        return [plain(number, scale) for number in value]
    if value is None or isinstance(value, str | bool):
        return value
    return value if isinstance(value, int) and scale == 1 else finite(float(value) / scale)


def power_of_ten(values: FloatArray) -> int:
    """Return the power of ten to name in a head or label in place of a row of zeros."""
    sizes = np.abs(values[np.isfinite(values) & (values != 0)])
    return int(np.floor(np.log10(np.median(sizes)))) if sizes.size else 0


def parameter_json(parameters: ParameterSet, name: str) -> Values:
    """Return a parameter's value and standard uncertainty in the unit in which it is shown."""
    quantity = parameter_quantity(parameters, name)
    return {
        "value": plain(parameters[name], quantity.scale),
        "standard_uncertainty": plain(parameters.uncertainty(name), quantity.scale),
        "unit": quantity.unit_text,
    }


def parameters_json(
    parameters: ParameterSet, names: Iterable[str] | None = None
) -> dict[str, Values]:
    """Return parameters as JSON by their names, by default all."""
    chosen = parameters.names if names is None else names
    return {name: parameter_json(parameters, name) for name in chosen}


def cell(quantity: Quantity, holder: object, /, *, unit: str | None = None, **values: Any) -> str:
    """Return a number with its standard uncertainty as a cell of a table, in its unit or none."""
    value = _value(quantity.name, holder, values) / quantity.scale
    u = _value(quantity.name + _UNCERTAINTY, holder, values)
    spread = None if u is None else u / quantity.scale
    return format_measured(value, spread, quantity.unit if unit is None else unit)


def columns(quantities: Iterable[Quantity], holder: object, /, **values: Any) -> Values:
    """Return the quantities of an object by the names of their columns in a data frame."""
    held = {}
    for quantity in quantities:
        value = _value(quantity.name, holder, values)
        measured = quantity.dimension in DIMENSIONS
        held[quantity.column] = value / quantity.scale if measured else value
    return held


def data_frame(quantities: Iterable[Quantity], values: Arrays) -> DataFrame:
    """Return columns of the values (SI) in the units in which they are shown."""
    import pandas as pd

    stated = [quantity for quantity in quantities if quantity.name in values]
    return pd.DataFrame(columns(stated, None, **values))


def labelled_dataset(
    quantities: Iterable[Quantity],
    values: Mapping[str, ArrayLike],
    axes: Mapping[str, tuple[str, ...]] | None = None,
) -> Dataset:
    """Return values in SI units by their quantities; ``axes``: where they differ from those."""
    import xarray

    variables = {}
    for quantity in quantities:
        if quantity.name in values:
            attributes = {"long_name": quantity.words}
            if quantity.dimension in DIMENSIONS:
                attributes["units"] = quantity.si_unit
            names = (axes or {}).get(quantity.name, quantity.axes)
            variables[quantity.name] = (names, np.asarray(values[quantity.name]), attributes)
    return xarray.Dataset(variables)


def record_arrays(
    record: Record, holder: object, names: Mapping[str, str] | None = None
) -> dict[str, tuple[tuple[str, ...], Any, dict[str, str]]]:
    """Return what an object holds of a record as variables of an xarray Dataset, in SI units."""
    # ``names`` replaces names of quantities and axes that another record of the Dataset has, too.
    names = names or {}
    variables = {}
    for quantity in record.quantities:
        value = getattr(holder, quantity.name, None)
        if value is not None:
            axes = tuple(names.get(axis, axis) for axis in quantity.axes)
            attributes = {"units": quantity.si_unit, "long_name": quantity.words}
            variables[names.get(quantity.key, quantity.key)] = (axes, value, attributes)
    return variables


def correlated_numbers(
    names: Sequence[str], values: Sequence[float] | FloatArray, covariance: FloatArray
) -> Values:
    """Return numbers of the package uncertainties by name."""
    from uncertainties import correlated_values

    return dict(zip(names, correlated_values(list(values), covariance), strict=True))


def correlated_parameters(parameters: ParameterSet) -> Values:
    """Return parameters as numbers of the package uncertainties, with their covariance."""
    return correlated_numbers(parameters.names, parameters.values, parameters.covariance)
