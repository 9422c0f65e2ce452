"""The estimated parameters of an artifact: values, covariance, and the uncertainty budget."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from memscal.errors import FormatError, InputError
from memscal.formats.fields import any_scalar, json_value, require_array, units_of
from memscal.formats.hdf5_reader import SafeFile
from memscal.formats.json_text import to_json
from memscal.formats.tree import Group, Node, Number, index_axis, si
from memscal.formats.units import dimension_of, from_si, to_si
from memscal.model.apparatus import ParameterSet
from memscal.model.quantities import TRUTH, Record, declared_quantity, estimated_quantity, record

__all__ = [
    "budget_group",
    "estimated_record",
    "parameter_dimension",
    "parameter_group",
    "read_budget",
    "read_parameters",
]

# One name for each axis of the covariance: netCDF tools want each dimension once.
_AXES = ("parameter", "parameter_prime")
_COVARIANCE = (
    "Covariance of the numbers, in the order of names: each parameter in the unit of its dataset."
)


def parameter_dimension(name: str, unit: str = "") -> str:
    """Return the dimension of a parameter: by its SI unit where that is given, else by its name.

    Examples
    --------
    >>> parameter_dimension("gaussian_sigma_deconvolved")
    'length'
    """
    if unit:
        return dimension_of(unit, f"parameter {name}")
    declared = declared_quantity(name)
    if declared is not None:
        return declared.dimension
    raise InputError(
        f"The unit of {name} is not known.",
        why="Every number in a file carries its unit.",
        cure="Begin its name with one of "
        + ", ".join(TRUTH)
        + ", or give the SI unit of a parameter in ParameterSet(units=...).",
    )


def parameter_group(parameters: ParameterSet, budget: Mapping[str, Mapping[str, float]]) -> Group:
    """Return the parameters as an NXcollection."""
    dimensions = _dimensions(parameters)
    reserved = {"names", "covariance", "budget", *_AXES}.intersection(parameters.names)
    if reserved:
        raise InputError(
            f"A parameter cannot be called {min(reserved)}.",
            why="The group of the parameters holds something else of that name.",
            cure="Give it another name.",
        )
    children: dict[str, Node] = {"names": to_json("parameter names", list(parameters.names))}
    for name, value, dimension in zip(parameters.names, parameters.values, dimensions, strict=True):
        children[name] = si(float(value), dimension)
        children[f"{name}_errors"] = si(parameters.uncertainty(name), dimension)
    for axis in _AXES:
        children[axis] = index_axis(axis, len(parameters.names))
    scale = np.array([float(from_si(1.0, dimension)[0]) for dimension in dimensions])
    numbers = parameters.covariance * scale[:, None] * scale[None, :]
    children["covariance"] = Number(numbers, "1", _AXES, {"description": _COVARIANCE})
    if budget:
        children["budget"] = budget_group(
            budget, dict(zip(parameters.names, dimensions, strict=True))
        )
    return Group("NXcollection", children)


def read_parameters(file: SafeFile, path: str) -> ParameterSet:
    """Read the parameters, in SI units."""
    names = tuple(str(name) for name in json_value(file, f"{path}/names", list, []))
    if not names or len(set(names)) != len(names):
        raise FormatError(
            f"{file.where(path)}/names is missing or names a parameter twice.",
            why="It says which parameters there are, and the order of their covariance.",
        )
    pairs = [any_scalar(file, f"{path}/{name}") for name in names]
    scale = np.array([_unit_scale(file, f"{path}/{name}") for name in names])
    covariance = require_array(file, f"{path}/covariance", "dimensionless", ndim=2)
    if covariance.shape != (len(names), len(names)):
        raise FormatError(
            f"{file.where(path)}/covariance has shape {covariance.shape} for {len(names)} names."
        )
    return ParameterSet(
        names=names,
        values=np.array([value for value, _ in pairs]),
        covariance=covariance * scale[:, None] * scale[None, :],
        units=tuple(unit for _, unit in pairs),
    )


def estimated_record(file: SafeFile, path: str) -> Record:
    """Return what the group of the parameters holds, by the names that the file gives them."""
    names = json_value(file, f"{path}/names", list, [])
    return record("NXcollection", *(estimated_quantity(str(name)) for name in names))


def budget_group(budget: Mapping[str, Mapping[str, float]], dimensions: Mapping[str, str]) -> Group:
    """Return the uncertainty budget: one group per quantity, one number per source."""
    children: dict[str, Node] = {"names": to_json("budget", list(budget))}
    for quantity, sources in budget.items():
        dimension = dimensions.get(quantity) or parameter_dimension(quantity)
        group: dict[str, Node] = {"names": to_json(f"budget of {quantity}", list(sources))}
        for source, value in sources.items():
            group[source] = si(float(value), dimension)
        children[quantity] = Group("NXcollection", group)
    return Group("NXcollection", children)


def read_budget(file: SafeFile, path: str) -> dict[str, dict[str, float]]:
    """Read the uncertainty budget, in SI units; empty where there is none."""
    if not file.has(path):
        return {}
    return {
        str(quantity): {
            str(source): any_scalar(file, f"{path}/{quantity}/{source}")[0]
            for source in json_value(file, f"{path}/{quantity}/names", list, [])
        }
        for quantity in json_value(file, f"{path}/names", list, [])
    }


def _dimensions(parameters: ParameterSet) -> list[str]:
    units = parameters.units or ("",) * len(parameters.names)
    return [parameter_dimension(n, u) for n, u in zip(parameters.names, units, strict=True)]


def _unit_scale(file: SafeFile, path: str) -> float:
    """How many SI units the unit at a path is."""
    unit = units_of(file, path) or "1"
    return float(to_si(1.0, unit, dimension_of(unit, file.where(path)), file.where(path)))
