"""A sweep over the noise amplitude as a table, a mapping and arrays."""

import numpy as np

from memscal.extensions.monte_carlo.sweep import Sweep
from memscal.model.arrays import FloatArray, Values
from memscal.model.quantities import ESTIMATED, MM, Quantity
from memscal.summaries.declared import Dataset, plain, power_of_ten
from memscal.summaries.table import Table

#: Results of a sweep, with the attribute of their draws.
_RESULTS = (
    (ESTIMATED["conversion_constant"], "seed_conversion_constant"),
    (ESTIMATED["gaussian_sigma_deconvolved"], "seed_gaussian_sigma"),
    (Quantity("relative_rms", "dimensionless", "rms over the largest signal"), "seed_relative_rms"),
)


def tables(result: Sweep) -> list[Table]:
    """Return every second amplitude: the exact expectation, and the median of the draws."""
    constant = _RESULTS[0][0].read_in(result.reading)
    power = power_of_ten(result.conversion_constant / constant.scale)
    scales = (constant.scale * 10.0**power, MM, 0.01)
    forms = (".4f", ".4f", ".3g")
    columns = [[f"{amplitude:.3g}" for amplitude in result.amplitude]]
    medians = []
    for (quantity, draws_name), scale, form in zip(_RESULTS, scales, forms, strict=True):
        exact = getattr(result, quantity.name) / scale
        columns.append([_number(value, form) for value in exact])
        drawn = [_median(draws) / scale for draws in getattr(result, draws_name)]
        medians.append([_number(median, form) for median in drawn])
    columns += medians
    title = (
        "Dependence on the noise amplitude (1 is the rule's choice): the expectation, and the "
        f"median of {result.seed_relative_rms.shape[1]} draws"
    )
    head = ("amplitude", f"A (1e{power} {constant.unit})", "σ(G) (mm)", "rms (%)")
    rows = list(zip(*columns, strict=True))[::2]
    return [Table(title, (*head, "A, draws", "σ(G), draws", "rms, draws"), rows)]


def mapping(result: Sweep) -> Values:
    """Return the whole sweep: lists over amplitudes, and lists of draws within them."""
    values = {"amplitude": {"value": plain(result.amplitude), "unit": "1"}}
    for declared, draws in _RESULTS:
        quantity = declared.read_in(result.reading)
        values[quantity.name] = {
            "value": plain(getattr(result, quantity.name), quantity.scale),
            "draws": plain(getattr(result, draws), quantity.scale),
            "unit": quantity.unit_text,
        }
    return values


def dataset(result: Sweep) -> Dataset:
    """Return the results over amplitude, and those of the draws over amplitude and draw."""
    import xarray

    axes = ("amplitude", "draw")
    variables: Values = {"amplitude": (axes[:1], result.amplitude, {"units": "1"})}
    for quantity, draws in _RESULTS:
        attributes = {"units": quantity.read_in(result.reading).si_unit}
        variables[quantity.name] = (axes[:1], getattr(result, quantity.name), attributes)
        variables[draws] = (axes, getattr(result, draws), attributes)
    return xarray.Dataset(variables)


def _number(value: float, form: str) -> str:
    return f"{value:{form}}" if np.isfinite(value) else "-"


def _median(draws: FloatArray) -> float:
    known = draws[np.isfinite(draws)]
    return np.median(known) if known.size else np.nan
