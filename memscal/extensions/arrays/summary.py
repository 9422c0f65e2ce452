"""A calibrated array as an answer, tables, a mapping and arrays."""

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import numpy as np

from memscal.extensions.arrays.files import RECORDS, stated_in_file
from memscal.extensions.arrays.sensor_array import SensorArray
from memscal.model.arrays import Values
from memscal.model.notation import format_measured
from memscal.summaries.declared import Dataset, members, record_arrays
from memscal.summaries.table import Table, checks_json, checks_table, percent, texts_of, verdict

#: Names of sensors that a sentence lists.
_NAMED = 3
_SHOWN = ("conversion", "centre", "gaussian", "crosstalk")


def array_of(result: Any) -> SensorArray:
    """Return the array of a calibration, or the one that it is already."""
    array: SensorArray = getattr(result, "array", result)
    return array


def identified(array: SensorArray) -> bool:
    """Whether the crosstalk is known well enough to be shown."""
    return all(check.passed for check in array.checks if check.name == "crosstalk_identified")


def _numbers(array: SensorArray) -> Values:
    """Return what is stated of the sensors and of their crosstalk, as JSON holds it."""
    quantities = [*RECORDS["sensors"].quantities, *RECORDS["crosstalk"].quantities]
    shown = [q.read_in(array.reading) for q in quantities if q.name.startswith(_SHOWN)]
    return members(shown, None, **stated_in_file(array))


def answer(result: Any) -> str:
    """Return how many sensors are used, how well A and crosstalk are known, and what failed."""
    array = array_of(result)
    used = array.used
    lost = np.array(array.sensors)[~used].tolist()
    left_out = f"; left out: {_listed(lost)}" if lost else ""
    if array.kernel == "measured":
        fields = f"Fields of {used.sum()} sensors as measured{left_out}: places, without pascals."
        return "\n".join([fields, *texts_of(array.messages)])
    a = _numbers(array)["conversion_constant"]
    values, errors = np.array([a["value"], a["standard_uncertainty"]], float)[:, used]
    middle = format_measured(np.median(values), np.median(errors), a["unit"])
    lines = [
        f"{used.sum()} of {used.size} sensors are used{left_out}.",
        f"A = {middle} at the median; it scatters by {percent(np.std(values) / np.mean(values))}.",
        _crosstalk_text(array),
        verdict(array.checks),
    ]
    for check in array.checks:
        if not check.passed and array.failing.get(check.name):
            words = check.name.replace("_", " ")
            lines.append(f"What fails {words}: {_listed(array.failing[check.name])}.")
    return "\n".join(filter(None, lines))


def _listed(names: Sequence[str]) -> str:
    more = f" and {len(names) - _NAMED} more" if len(names) > _NAMED else ""
    return ", ".join(names[:_NAMED]) + more


def _crosstalk_text(array: SensorArray) -> str:
    found = array.estimated
    if not found.any():
        return "No crosstalk was estimated."
    if identified(array):
        u = percent(np.median(array.crosstalk_uncertainties[found]))
        return (
            f"Crosstalk is {percent(array.crosstalk[found].mean())} on the mean, u of a pair {u}."
        )
    check, *_ = (check for check in array.checks if check.name == "crosstalk_identified")
    places = array.places
    apart = np.hypot(*(places[:, None] - places).T)
    pitch = apart[found].min() / array.film.thickness
    return (
        f"Crosstalk is not identified: its u by the readings alone is {percent(check.value)}, of "
        f"at most {percent(check.limit)}, with a pitch of {pitch:.2g} thicknesses of the film. "
        "Mend what else fails, scan a raster, or take a thinner film; A has the u that this costs."
    )


def tables(result: Any) -> list[Table]:
    """Return the sensors, their crosstalk if it is identified, and the checks."""
    array = array_of(result)
    if array.kernel == "measured":
        return [checks_table(array.checks)]
    numbers = _numbers(array)
    crosstalk = numbers.pop("crosstalk")
    heads = []
    columns = []
    for name, held in numbers.items():
        pairs = np.array([held["value"], held["standard_uncertainty"]], float).T
        if not np.isnan(pairs).all():
            heads.append(f"{name.replace('_', ' ')} ({held['unit']})")
            columns.append([format_measured(value, error) for value, error in pairs])
    return [
        Table(
            f"Array of {len(array.sensors)} sensors (± standard uncertainty, k = 1)",
            ("sensor", *heads),
            list(zip(array.sensors, *columns, strict=True)),
            frozenset(np.flatnonzero(~array.used).tolist()),
        ),
        _crosstalk_table(array, crosstalk),
        checks_table(array.checks),
    ]


def _crosstalk_table(array: SensorArray, crosstalk: Values) -> Table:
    """Return what each sensor reads of those whose share was estimated, if that is identified."""
    percents = 100 * np.array([crosstalk["value"], crosstalk["standard_uncertainty"]])
    shares: dict[str, list[str]] = {}
    for i, j in array.pairs if identified(array) else ():
        share = f"{array.sensors[j]}: {format_measured(*percents[:, i, j])}"
        shares.setdefault(array.sensors[i], []).append(share)
    rows = [(name, ", ".join(parts)) for name, parts in shares.items()]
    return Table("Crosstalk", ("sensor", "reads of (%)"), rows)


def mapping(result: Any) -> Values:
    """Return the object of ``calibrate --json`` of an array; its form is part of the contract."""
    array = array_of(result)
    checks = checks_json(array.checks)
    for check in checks:
        check["sensors"] = list(array.failing.get(check["name"], ()))
    return {
        "schema_version": "1",
        "sensors": list(array.sensors),
        "used": array.used.tolist(),
        "kernel": array.kernel,
        **_numbers(array),
        "estimated": array.estimated.tolist(),
        "checks": checks,
        "warnings": texts_of(array.messages),
    }


def dataset(result: Any) -> Dataset:
    """Return all arrays on their axes, in SI units."""
    import xarray

    array = array_of(result)
    stated = SimpleNamespace(**stated_in_file(array))
    variables: Values = {}
    for of in RECORDS.values():
        held = record_arrays(of.read_in(array.reading), stated)
        variables |= {name: variable for name, variable in held.items() if variable[0]}
    return xarray.Dataset(variables, {"sensor": list(array.sensors)})
