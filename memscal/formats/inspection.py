"""Contents of a file, and its checks step by step: for ``memscal inspect`` and ``check``."""

from collections.abc import Callable, Iterator
from typing import Any

import numpy as np

from memscal.errors import FormatError, MemscalError
from memscal.extensions import FILES, module
from memscal.formats.artifact import artifact_from
from memscal.formats.digest import altered, has_no_digest, require_schema
from memscal.formats.files import FilePath
from memscal.formats.groups import listed, origins, read_quality
from memscal.formats.hdf5 import writer
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.formats.reference import profile_from
from memscal.formats.scan import scan_from
from memscal.formats.stress import profile_paths, stress_from
from memscal.formats.units import dimension_of, to_si
from memscal.model import records
from memscal.model.arrays import Values, value_record
from memscal.model.quantities import Record, estimated_quantity, record

_READERS: dict[str, Callable[[SafeFile], Any]] = {
    writer.SCAN_SCHEMA: scan_from,
    writer.REFERENCE_SCHEMA: profile_from,
    writer.ARTIFACT_SCHEMA: artifact_from,
    writer.STRESS_SCHEMA: stress_from,
}
# What files may hold, by its path, in the order of the listing; no file holds all of it.
_LAYOUT = {
    "/entry": records.EXPERIMENT,
    "/entry/data": record(
        "NXdata", *records.SCAN_DATA.quantities, *records.TAKEN_FOR_GRANTED.quantities
    ),
    "/entry/noise_record": records.SCAN_DATA,
    "/entry/apparatus_function": records.FIELD,
    "/entry/radial_profile": records.RADIAL_VERSION_1_0,
    "/entry/radial_covariance": records.RADIAL_COVARIANCE,
    "/entry/kernel_changes": records.KERNEL_CHANGES,
    "/entry/shared_effects": records.SHARED_EFFECTS,
    "/entry/radial_profile_bayesian": records.RADIAL,
    "/entry/radial_profile_division": records.RADIAL,
    "/entry/transfer_function": records.TRANSFER,
    "/entry/reconvolution": records.RECONVOLUTION,
    "/entry/reference": records.REFERENCE_DATA,
    "/entry/parameters": records.CONTACT,
    "/entry/parameters/indenter": records.INDENTER,
    "/entry/parameters/film": records.FILM,
    "/entry/indenter": records.INDENTER,
    "/entry/sample/film": records.FILM,
    "/entry/sample": records.SAMPLE,
    "/entry/instrument/stress_sensor": records.SENSOR,
    "/entry/instrument/stress_sensor/dynamics": records.DYNAMICS,
    "/entry/instrument/load_cell": records.LOAD_CELL,
    "/entry/instrument/stage": records.STAGE,
    "/entry/user": records.USER,
    "/entry/synthetic": records.SYNTHETIC,
    "/entry/sensor": records.CONVERSION,
    "/entry/process/numerics": records.NUMERICS,
    "/entry/process": record(
        "NXprocess", *records.PROFILE_NOTES.quantities, *records.PROCESS.quantities
    ),
}


@value_record
class Finding:
    """One finding about a file: what was looked at, whether it is in order, and what it means."""

    name: str
    passed: bool
    meaning: str


def describe(path: FilePath, *, accept_altered: bool = False) -> Values:
    """Return what a file of memscal holds, in its units and in plain values for JSON."""
    with open_hdf5(path, accept_altered=accept_altered) as file:
        schema = _schema(file)
        version = require_schema(file, schema)
        held = _reader(schema)(file)
        quantities = []
        arrays = []
        provenance = []
        for at, layout in _layout(file, schema):
            for place, quantity in listed(layout, file, at):
                value = place.removesuffix("_errors")
                if quantity.origin:
                    provenance.append((place, quantity))
                elif quantity.axes and file.array(place).ndim:
                    arrays.append(_array_row(file, place))
                elif value == place:
                    quantities.append(_quantity_row(file, place))
                elif quantity.of is not None and value not in [q["path"] for q in quantities]:
                    quantities.append(_quantity_row(file, value if file.has(value) else place))
        checks = [
            {
                "name": check.name,
                "value": _plain(check.value),
                "limit": _plain(check.limit),
                "passed": check.passed,
                "meaning": check.meaning,
            }
            for check in read_quality(file)
        ]
        stated: Values = {}
        if file.source.altered:
            stated["altered"] = file.source.altered
        # Places of the sensors of an array by design, in mm.
        if getattr(held, "layout", None) is not None:
            stated["layout"] = dict(zip(held.sensors, (1e3 * held.layout).tolist(), strict=True))
        return {
            "file": file.name,
            "sha256": file.source.sha256,
            **stated,
            "schema": schema,
            "schema_version": version,
            "title": file.optional_text("/entry/title"),
            "quantities": quantities,
            "arrays": arrays,
            "checks": checks,
            "provenance": origins(file, provenance),
        }


def check(path: FilePath) -> list[Finding]:
    """Check a file step by step (safety, schema, digest, content) up to the first that fails."""
    findings = []
    step = "safety"
    try:
        with open_hdf5(path) as file:
            schema = _schema(file)
            findings.append(Finding(step, True, "A regular file that opens as HDF5."))
            step = "schema"
            version = require_schema(file, schema)
            findings.append(Finding(step, True, f"{schema}, version {version}."))
            step = "digest"
            findings.append(_digest(file))
            if not findings[-1].passed:
                return findings
            step = "content"
            _reader(schema)(file)
            findings.append(Finding(step, True, "Complete, with units of the right dimension."))
    except MemscalError as error:
        findings.append(Finding(step, False, str(error)))
    return findings


def _digest(file: SafeFile) -> Finding:
    """Results must have a digest: scans and references may come from other programs."""
    if has_no_digest(file):
        return Finding("digest", True, "None, as other programs write them: no change would show.")
    problem = altered(file)
    if problem:
        return Finding("digest", False, f"The file was changed after it was written: {problem}.")
    return Finding("digest", True, "The content is what was written.")


def _schema(file: SafeFile) -> str:
    schema = file.schema
    known = [*_READERS, *FILES]
    if schema in known:
        return str(schema)
    raise FormatError(
        f"{file.name} is not a file of memscal.",
        why=f"Its root attribute {writer.SCHEMA_ATTRIBUTE} is {schema!r}, not one of "
        f"{', '.join(known)}.",
        cure="Convert a table with `memscal import`.",
    )


def _reader(schema: str) -> Callable[[SafeFile], Any]:
    return _READERS.get(schema) or module(FILES[schema]).read_open


def _layout(file: SafeFile, schema: str) -> Iterator[tuple[str, Record]]:
    names = file.text_list("/entry/parameters/names")
    yield "/entry/parameters", record("NXcollection", *map(estimated_quantity, names))
    own = module(FILES[schema]).LAYOUT if schema in FILES else {}
    yield from {**own, **_LAYOUT, **own}.items()
    for path in profile_paths(file):
        yield path, records.STRESS_NUMBERS
        yield path, records.SLID
        yield path, records.STRESS_PROFILE


def _quantity_row(file: SafeFile, path: str) -> Values:
    unit = None
    if file.is_text(path):
        value: Any = file.text(path)
    else:
        number = file.only_number(path, file.array(path))
        value = "inf" if number == np.inf else _plain(number)
        unit = file.units_of(path) or "1"
    return {
        "path": path,
        "name": path.rpartition("/")[2],
        "value": value,
        "standard_uncertainty": _uncertainty(file, path),
        "unit": unit,
    }


def _uncertainty(file: SafeFile, path: str) -> float | int | None:
    """Return the uncertainty of a quantity in the unit of the quantity, whatever its own is."""
    errors = f"{path}_errors"
    if not file.has(errors):
        return None
    spread = file.only_number(errors, file.array(errors))
    unit = file.units_of(path)
    spread_unit = file.units_of(errors)
    if spread_unit != unit:
        dimension = dimension_of(unit or "1", file.where(path))
        scale = to_si(1.0, unit, dimension, file.where(path))
        spread = float(to_si(spread, spread_unit, dimension, file.where(errors)) / scale)
    return _plain(spread)


def _array_row(file: SafeFile, path: str) -> Values:
    values = file.array(path)
    finite = values[np.isfinite(values)]
    return {
        "path": path,
        "shape": list(values.shape),
        "unit": file.units_of(path) or "1",
        "minimum": _plain(finite.min()) if finite.size else None,
        "maximum": _plain(finite.max()) if finite.size else None,
        "missing": int(np.isnan(values).sum()),
    }


def _plain(value: Any) -> float | int | None:
    number = np.asarray(value).item()
    return number if np.isfinite(number) else None
