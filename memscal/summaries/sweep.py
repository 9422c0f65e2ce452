"""A sweep over the noise amplitude as a table, a mapping and arrays."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from memscal.calibration.sweep import Sweep
from memscal.model.arrays import FloatArray
from memscal.model.quantities import MM, MV
from memscal.summaries.table import Table, finite

if TYPE_CHECKING:
    import xarray

# Results of a sweep, the attribute of their draws, and the units of Python and of JSON.
_RESULTS = (
    ("conversion_constant", "seed_conversion_constant", "V/Pa", "mV/Pa", MV),
    ("gaussian_sigma_deconvolved", "seed_gaussian_sigma", "m", "mm", MM),
    ("relative_rms", "seed_relative_rms", "1", "1", 1.0),
)


def tables(result: Sweep) -> list[Table]:
    """Return every second amplitude: the exact expectation, and the median of the draws."""
    # The power of ten stands in the head in place of a row of zeros.
    values = result.conversion_constant / MV
    sizes = np.abs(values[np.isfinite(values) & (values != 0)])
    power = int(np.floor(np.log10(np.median(sizes)))) if sizes.size else 0
    scales, forms = (MV * 10.0**power, MM, 0.01), (".4f", ".4f", ".3g")
    columns = [[f"{amplitude:.3g}" for amplitude in result.amplitude]]
    for (name, *_), scale, form in zip(_RESULTS, scales, forms, strict=True):
        columns.append([_number(value / scale, form) for value in getattr(result, name)])
    for (_, name, *_), scale, form in zip(_RESULTS, scales, forms, strict=True):
        columns.append([_median(draws / scale, form) for draws in getattr(result, name)])
    title = (
        "Dependence on the noise amplitude (1 is the rule's choice): the expectation, and the "
        f"median of {result.seed_relative_rms.shape[1]} draws"
    )
    head = ("amplitude", f"A (1e{power} mV/Pa)", "σ(G) (mm)", "rms (%)")
    rows = list(zip(*columns, strict=True))[::2]
    return [Table(title, (*head, "A, draws", "σ(G), draws", "rms, draws"), rows)]


def mapping(result: Sweep) -> dict[str, Any]:
    """Return the whole sweep: lists over amplitudes, and lists of draws within them."""
    return {"amplitude": _scaled(result.amplitude, 1.0)} | {
        name: {
            "values": _scaled(getattr(result, name), scale),
            "draws": [_scaled(row, scale) for row in getattr(result, draws)],
            "unit": unit,
        }
        for name, draws, _, unit, scale in _RESULTS
    }


def dataset(result: Sweep) -> xarray.Dataset:
    """Return the results over amplitude, and those of the draws over amplitude and draw."""
    import xarray

    axes = ("amplitude", "draw")
    variables: dict[str, Any] = {"amplitude": (axes[:1], result.amplitude, {"units": "1"})}
    for name, draws, unit, *_ in _RESULTS:
        variables[name] = (axes[:1], getattr(result, name), {"units": unit})
        variables[draws] = (axes, getattr(result, draws), {"units": unit})
    return xarray.Dataset(variables)


def _scaled(values: FloatArray, scale: float) -> list[float | None]:
    return [finite(float(value) / scale) for value in values]


def _median(values: FloatArray, form: str) -> str:
    numbers = values[np.isfinite(values)]
    return _number(float(np.median(numbers)), form) if numbers.size else "-"


def _number(value: float, form: str) -> str:
    return f"{value:{form}}" if np.isfinite(value) else "-"
