"""Files of a fleet: the manifest of its scans, and the Parquet tables of its results."""

from __future__ import annotations

import csv
import hashlib
import json
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from memscal.errors import FormatError, InputError, MemscalError
from memscal.formats.files import atomic_write_bytes, read_bytes
from memscal.model.apparatus import ApparatusData, ParameterSet
from memscal.model.fleet import FleetResults
from memscal.model.quantities import ESTIMATED, parameter_quantity
from memscal.version import __version__

FLEET_SCHEMA, FLEET_SCHEMA_VERSION = "memscal-fleet", "1.0.0"
_SUFFIXES = (".h5", ".hdf5", ".hdf", ".nxs", ".nx5")
#: What memscal writes beside scans.
_RESULTS = (".apparatus", ".stress")


@dataclass(frozen=True)
class FleetScan:
    """A scan of a manifest: its path as listed, and the sensor's place on its wafer, in mm."""

    path: str
    wafer_x: float | None = None
    wafer_y: float | None = None


def manifest_scans(source: Path) -> Iterator[FleetScan]:
    """Yield the scans of a folder, by their names, or those that a manifest lists, in its order."""
    if source.is_dir():
        yield from _folder_scans(source)
        return
    if not source.is_file():
        cure = "Give a folder of scans, or a text file that lists one scan a line."
        raise InputError(f"{source} is neither a folder nor a regular file.", cure=cure)
    with source.open(encoding="utf-8-sig", newline="") as lines:
        try:
            yield from _listed_scans(source.name, lines)
        except (UnicodeDecodeError, csv.Error) as error:
            raise FormatError(f"{source} is not a table of text: {error}.") from error


def _folder_scans(folder: Path) -> Iterator[FleetScan]:
    for place, folders, files in os.walk(folder):
        folders.sort()
        for path in (Path(place, name) for name in sorted(files)):
            if path.suffix.lower() in _SUFFIXES and not path.stem.endswith(_RESULTS):
                yield FleetScan(path.relative_to(folder).as_posix())


def _listed_scans(name: str, lines: Iterator[str]) -> Iterator[FleetScan]:
    """Read a table with a column ``path``, or without a head a path a line, commas included."""
    head: list[str] | None = None
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        cells = [cell.strip() for cell in next(csv.reader([text]))]
        if head is None:
            head = [cell.lower().removesuffix("(mm)").rstrip() for cell in cells]
            if "path" in head:
                continue
            head = ["path"]
        if head == ["path"]:
            yield FleetScan(text if len(cells) > 1 else cells[0])
            continue
        row = dict(zip(head, cells, strict=False))
        if not row.get("path"):
            raise FormatError(f"{name}, line {number} has no path.", cure="Add it, or the line.")
        yield FleetScan(row["path"], *(_place(row, axis, name, number) for axis in "xy"))


def _place(row: Mapping[str, str], axis: str, name: str, number: int) -> float | None:
    cell = row.get(f"wafer_{axis}", "")
    try:
        return float(cell) if cell else None
    except ValueError as error:
        problem = f"{name}, line {number}: wafer_{axis} is {cell!r}, which is no number."
        raise FormatError(
            problem, cure="Give the place on the wafer in mm, or no place."
        ) from error


PARAMETERS = tuple(
    name for name in ESTIMATED if name not in ("baseline_slope", "force", "maximum")
)  # fmt: skip
"""Parameters with columns of their own, where a calibration estimates them."""

_TEXTS = {
    "path": "scan, as the manifest or folder lists it",
    "sensor": "name of the sensor",
    "model": "model of the sensor",
    "serial_number": "serial number of the sensor",
    "channel": "channel of the sensor",
    "start_time": "begin of the scan",
    "calibrated_at": "time of the calibration",
    "method": "method of A and G",
    "reading_unit": "unit of the readings, of which A and baseline are",
    "artifact": "artifact, in the folder of the results",
    "error_class": "class of the error of a scan that was not calibrated",
    "error": "its words",
    "input_sha256": "SHA-256 of the scan's file",
    "options_sha256": "SHA-256 of the options",
    "version": "version of memscal",
}

#: Columns of names within others.
_NAMES = (
    "checks.list.element.name", "budget.list.element.quantity", "budget.list.element.source",
    "correlated.list.element",
)  # fmt: skip


def parquet() -> Any:
    """Return the module pyarrow.parquet, or say how to get it."""
    try:
        import pyarrow.parquet
    except ModuleNotFoundError as error:
        raise MemscalError(
            "pyarrow is not installed.",
            why="Results of many sensors are written as Parquet.",
            cure='Install it with the extra "fleet": pip install "memscal[fleet]".',
        ) from error
    return pyarrow.parquet


def _schema(units: Mapping[str, str]) -> Any:
    """Return names, types and units of the columns; ``units`` are those of the parameters."""
    import pyarrow as pa

    single, check = pa.float32(), ("value", "limit", "p_value")
    numbers = [("name", pa.string()), ("passed", pa.bool_()), *((key, single) for key in check)]
    source = [("quantity", pa.string()), ("source", pa.string()), ("errors", single)]
    fields: list[tuple[str, Any, dict[str, str]]] = [
        ("place", pa.int64(), {"meaning": "place in the manifest, from 0"}),
        *((name, pa.string(), {"meaning": words}) for name, words in _TEXTS.items()),
        *((f"wafer_{axis}", pa.float64(), {"units": "mm"}) for axis in "xy"),
        ("passed", pa.bool_(), {"meaning": "calibrated, and every check passed"}),
        ("resolved_wavenumber", pa.float64(), {"units": "rad/mm"}),
        ("checks", pa.list_(pa.struct(numbers)), {"units": "1"}),
        ("budget", pa.list_(pa.struct(source)), {"units": "those of the quantity"}),
        ("correlated", pa.list_(pa.string()), {"meaning": "parameters that are correlated"}),
        ("correlation", pa.list_(single), {"units": "1", "meaning": "above the diagonal, by rows"}),
        ("r", pa.list_(single), {"units": "mm"}),
        *((name, pa.list_(single), {"units": "1/mm^2"}) for name in ("g", "g_errors")),
    ]
    named = [(name, column) for name in PARAMETERS for column in (name, f"{name}_errors")]
    fields += [(column, pa.float64(), {"units": units[name]}) for name, column in named]
    return pa.schema([pa.field(name, kind, metadata=about) for name, kind, about in fields])


def fleet_row(data: ApparatusData) -> dict[str, Any]:
    """Return an apparatus function as a row, in the units of files."""
    parameters, radial = data.parameters, data.radial_profile
    names = [name for name in PARAMETERS if name in parameters]
    row: dict[str, Any] = {"passed": data.passed, "calibrated_at": data.process.date}
    row |= {"method": data.process.configuration.get("method"), "reading_unit": data.reading.unit}
    scales = {name: parameter_quantity(parameters, name).scale for name in parameters.names}
    for name in names:
        row[name] = parameters[name] / scales[name]
        row[f"{name}_errors"] = parameters.uncertainty(name) / scales[name]
    row["correlated"], row["correlation"] = names, _correlation(parameters.only(names))
    row["budget"] = [
        {"quantity": name, "source": source, "errors": u / scales[name]}
        for name, sources in data.budget.items()
        for source, u in sources.items()
        if u
    ]
    checks = ("name", "value", "limit", "passed", "p_value")
    row["checks"] = [{key: getattr(check, key) for key in checks} for check in data.checks]
    row["resolved_wavenumber"] = data.resolved_wavenumber * 1e-3
    row |= {"r": radial.r * 1e3, "g": radial.g * 1e-6, "g_errors": radial.g_errors * 1e-6}
    return row | {"units": _units(parameters)}


def _units(parameters: ParameterSet) -> dict[str, str]:
    return {name: ESTIMATED[name].read_in(parameters.reading).unit_text for name in PARAMETERS}


def _correlation(parameters: ParameterSet) -> list[float]:
    errors = np.sqrt(np.diag(parameters.covariance))
    scale = np.outer(errors, errors)
    above = np.triu_indices(len(errors), 1)
    correlation = np.divide(parameters.covariance, scale, out=np.zeros_like(scale), where=scale > 0)
    return [float(value) for value in correlation[above]]


def sha256_of(value: Any) -> str:
    """Return a digest of what JSON can say."""
    return hashlib.sha256(json.dumps(value, sort_keys=True).encode()).hexdigest()


def write_shard(path: Path, rows: Sequence[Mapping[str, Any]], digest: str) -> None:
    """Write a table whole or not at all; its metadata state the digest of what it is made from."""
    import pyarrow as pa

    stated = [row["units"] for row in rows if "units" in row]
    units = dict(stated[0] if stated else _units(ParameterSet((), np.empty(0), np.empty((0, 0)))))
    for name in PARAMETERS:
        if any(other[name] != units[name] for other in stated):
            units[name] = "of reading_unit"
    about = {
        "memscal_schema": FLEET_SCHEMA,
        "memscal_schema_version": FLEET_SCHEMA_VERSION,
        "memscal_version": __version__,
        "memscal_shard_sha256": digest,
    }
    schema = _schema(units).with_metadata(about)
    table, sink = pa.Table.from_pylist(list(rows), schema=schema), pa.BufferOutputStream()
    # Bytes of equal significance stand together, which halves what numbers take.
    of_numbers = [f"{name}.list.element" for name in ("r", "g", "g_errors", "correlation")]
    of_numbers += [f"checks.list.element.{name}" for name in ("value", "limit", "p_value")]
    packing: dict[str, Any] = {"compression": "zstd", "compression_level": 9}
    packing |= {"use_byte_stream_split": [*of_numbers, "budget.list.element.errors"]}
    packing |= {"use_dictionary": [*_TEXTS, *_NAMES], "write_page_checksum": True}
    parquet().write_table(table, sink, **packing)
    atomic_write_bytes(path, memoryview(sink.getvalue()), overwrite=True)


def read_shard(path: Path, columns: Sequence[str] | None = None) -> Any:
    """Read columns of a table, by default all; refuse a file that is damaged or another's."""
    import pyarrow as pa

    try:
        buffer = pa.BufferReader(read_bytes(path))
        file = parquet().ParquetFile(buffer, page_checksum_verification=True)
        stated = file.schema_arrow.metadata or {}
        if stated.get(b"memscal_schema") != FLEET_SCHEMA.encode():
            raise FormatError(f"{path} is a Parquet file, but none of memscal batch.")
        return file.read(columns)
    except (pa.ArrowException, OSError) as error:
        reason = " ".join(str(error).split())[:200]
        cure = "Remove it, and run memscal batch --resume."
        raise FormatError(f"{path} is damaged: {reason}", cure=cure) from error


def shard_paths(results: Path) -> list[Path]:
    """Return the tables in a folder of results, in their order."""
    return sorted((results / "shards").glob("shard-*.parquet"))


_NUMBERS = (
    "conversion_constant", "conversion_constant_errors", "gaussian_sigma", "gaussian_sigma_errors",
    "wafer_x", "wafer_y",
)  # fmt: skip
_OF_SUMMARY = (*_NUMBERS, "path", "passed", "error_class", "error", "checks")


def read_fleet(results: Path) -> FleetResults:
    """Read what a summary needs of the tables of a batch, one after the other."""
    if not (shards := shard_paths(results)):
        cure = "Give the folder that memscal batch -o wrote."
        raise InputError(f"{results} holds no results of a batch.", cure=cure)
    paths: list[str] = []
    numbers: list[Any] = []
    failed: dict[int, tuple[str, ...]] = {}
    errors: dict[int, tuple[str, str]] = {}
    units: set[str] = set()
    for shard in shards:
        table = read_shard(shard, _OF_SUMMARY)
        values = [table[name].to_numpy().astype(np.float64) for name in _NUMBERS]
        if np.isfinite(values[0]).any():
            about = table.schema.field("conversion_constant").metadata
            units.add(about[b"units"].decode())
        for row, passed in enumerate(table["passed"].to_pylist(), start=len(paths)):
            if not passed:
                stated = {n: table[n][row - len(paths)].as_py() for n in _OF_SUMMARY[-3:]}
                checks = stated["checks"] or ()
                failed[row] = tuple(check["name"] for check in checks if not check["passed"])
                if stated["error"]:
                    errors[row] = stated["error_class"], stated["error"]
        paths += table["path"].to_pylist()
        numbers.append(values)
    if len(units) > 1:
        why = f"The conversion constants are in {', '.join(sorted(units))}."
        cure = "Run a batch for each unit of readings."
        raise FormatError(f"{results} holds sensors of several kinds.", why=why, cure=cure)
    columns = dict(zip(_NUMBERS, np.concatenate(numbers, axis=1), strict=True))
    return FleetResults(paths=paths, failed=failed, errors=errors, unit=(*units, "")[0], **columns)
