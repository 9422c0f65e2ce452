"""Files of a fleet: the manifest of its scans, and the Parquet tables of its results."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from memscal.errors import FormatError, InputError, MemscalError
from memscal.formats.files import atomic_write_bytes, read_bytes
from memscal.model.apparatus import ApparatusData
from memscal.model.fleet import FleetResults
from memscal.model.notation import VOLTS, Reading
from memscal.model.quantities import ESTIMATED, parameter_quantity
from memscal.version import __version__

FLEET_SCHEMA, FLEET_SCHEMA_VERSION = "memscal-fleet", "1.0.0"
DIGEST = "memscal_shard_sha256"
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
    try:
        with source.open(encoding="utf-8-sig", newline="") as lines:
            yield from _listed_scans(source.name, lines)
    except (UnicodeDecodeError, csv.Error) as error:
        raise FormatError(f"{source} is not a table of text: {error}.") from error
    except OSError as error:
        cure = "Give a manifest that you may read."
        raise InputError(f"{source} cannot be read: {error.strerror}.", cure=cure) from error


def _folder_scans(folder: Path) -> Iterator[FleetScan]:
    for place, folders, files in os.walk(folder):
        folders.sort()
        for path in (Path(place, name) for name in sorted(files)):
            if path.suffix.lower() in _SUFFIXES and not path.stem.endswith(_RESULTS):
                yield FleetScan(path.relative_to(folder).as_posix())


def _listed_scans(name: str, lines: Iterator[str]) -> Iterator[FleetScan]:
    """Read a table with a column ``path``, or without a head a path a line, commas included."""
    head: list[str] = []
    for number, line in enumerate(lines, start=1):
        if not (text := line.strip()) or text.startswith("#"):
            continue
        cells = [cell.strip() for cell in next(csv.reader([text]))]
        if not head:
            head = [cell.lower().removesuffix("(mm)").rstrip() for cell in cells]
            if "path" in head:
                continue
            head = ["path"]
        row = dict(zip(head, cells if len(head) > 1 else [text], strict=False))
        try:
            place = [float(row[key]) if row.get(key) else None for key in ("wafer_x", "wafer_y")]
        except ValueError as error:
            cure = "Give the place on the wafer in mm, or leave it empty."
            raise FormatError(f"{name}, line {number}: {error}.", cure=cure) from error
        if not row.get("path"):
            raise FormatError(f"{name}, line {number} has no path.", cure="Add it.")
        yield FleetScan(row["path"], *place)


#: Those that a calibration may estimate, with columns of their own.
_PARAMETERS = tuple(n for n in ESTIMATED if n not in ("baseline_slope", "force", "maximum"))
_TEXTS = (
    "path", "sensor", "model", "serial_number", "channel", "start_time", "calibrated_at", "method",
    "artifact", "error_class", "error", "input_sha256", "options_sha256", "version",
)  # fmt: skip
_CHECK, _UNCERTAINTY = ("value", "limit", "p_value"), ("quantity", "source")


def arrow() -> Any:
    """Return the module pyarrow, or say how to get it."""
    try:
        import pyarrow.parquet
    except ModuleNotFoundError as error:
        cure = 'Install it with the extra "fleet": pip install "memscal[fleet]".'
        raise MemscalError("pyarrow, which writes Parquet, is not installed.", cure=cure) from error
    return pyarrow


def _schema(readings: Iterable[Reading]) -> Any:
    """Return names, types and units of the columns, for sensors with readings in some units."""
    pa = arrow()
    single, text, double = pa.float32(), pa.string(), pa.float64()
    check = {"name": text, "passed": pa.bool_(), **dict.fromkeys(_CHECK, single)}
    source = {**dict.fromkeys(_UNCERTAINTY, text), "errors": single}
    columns = {"place": pa.int64(), **dict.fromkeys(_TEXTS, text), "passed": pa.bool_()}
    columns |= dict.fromkeys(("wafer_x", "wafer_y", "resolved_wavenumber"), double)
    columns |= {name: pa.list_(single) for name in ("r", "g", "g_errors", "correlation")}
    columns |= {"correlated": pa.list_(text), "checks": pa.list_(pa.struct(check))}
    columns |= {"budget": pa.list_(pa.struct(source))}
    units = {"wafer_x": "mm", "wafer_y": "mm", "r": "mm", "resolved_wavenumber": "rad/mm"}
    units |= {"g": "1/mm^2", "g_errors": "1/mm^2", "correlation": "1"}
    for name in _PARAMETERS:
        stated = " or ".join(sorted({ESTIMATED[name].read_in(r).unit_text for r in readings}))
        columns |= {name: double, f"{name}_errors": double}
        units |= {name: stated, f"{name}_errors": stated}
    about = {name: {"units": unit} for name, unit in units.items()}
    return pa.schema([pa.field(n, kind, metadata=about.get(n)) for n, kind in columns.items()])


def fleet_row(data: ApparatusData) -> dict[str, Any]:
    """Return an apparatus function as a row, in the units of files."""
    parameters, radial = data.parameters, data.radial_profile
    scales = {name: parameter_quantity(parameters, name).scale for name in parameters.names}
    names = [name for name in _PARAMETERS if name in scales]
    row: dict[str, Any] = {"passed": data.passed, "calibrated_at": data.process.date}
    row |= {"method": data.process.configuration["method"], "reading": data.reading}
    row |= {name: parameters[name] / scales[name] for name in names}
    row |= {f"{name}_errors": parameters.uncertainty(name) / scales[name] for name in names}
    covariance, above = parameters.only(names).covariance, np.triu_indices(len(names), 1)
    u = np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", invalid="ignore"):
        row |= {"correlated": names, "correlation": (covariance / np.outer(u, u))[above]}
    row["budget"] = [
        {"quantity": name, "source": source, "errors": u / scales[name]}
        for name, sources in data.budget.items()
        for source, u in sources.items()
        if u > 0
    ]
    of_check = ("name", "passed", *_CHECK)
    row["checks"] = [{key: getattr(check, key) for key in of_check} for check in data.checks]
    row["resolved_wavenumber"] = data.resolved_wavenumber * 1e-3
    return row | {"r": radial.r * 1e3, "g": radial.g * 1e-6, "g_errors": radial.g_errors * 1e-6}


def write_shard(path: Path, rows: Sequence[Mapping[str, Any]], digest: str) -> None:
    """Write a table whole or not at all; its metadata state the digest of what it is made from."""
    pa = arrow()
    about = {"memscal_schema": FLEET_SCHEMA, "memscal_schema_version": FLEET_SCHEMA_VERSION}
    about |= {"memscal_version": __version__, DIGEST: digest}
    readings = {row["reading"] for row in rows if "reading" in row} or {VOLTS}
    table = pa.Table.from_pylist(list(rows), _schema(readings).with_metadata(about))
    packing = {"compression": "zstd", "use_dictionary": False, "write_page_checksum": True}
    sink = pa.BufferOutputStream()
    pa.parquet.write_table(table, sink, **packing)
    atomic_write_bytes(path, memoryview(sink.getvalue()), overwrite=True)


def read_shard(path: Path, columns: Sequence[str] | None = None) -> Any:
    """Read columns of a table, by default all; refuse a file that is damaged or another's."""
    pa = arrow()
    try:
        buffer = pa.BufferReader(read_bytes(path))
        file = pa.parquet.ParquetFile(buffer, page_checksum_verification=True)
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
        numbers.append([table[name].to_numpy().astype(np.float64) for name in _NUMBERS])
        if np.isfinite(numbers[-1][0]).any():
            about = table.schema.field("conversion_constant").metadata
            units |= set(about[b"units"].decode().split(" or "))
        for i in np.flatnonzero(~table["passed"].to_numpy().astype(bool)):
            row = table.slice(i, 1).to_pylist()[0]
            checks, number = row["checks"] or (), len(paths) + int(i)
            failed[number] = tuple(check["name"] for check in checks if not check["passed"])
            if row["error"]:
                errors[number] = row["error_class"], row["error"]
        paths += table["path"].to_pylist()
    if len(units) > 1:
        why = f"The conversion constants are in {', '.join(sorted(units))}."
        cure = "Run a batch for each unit of readings."
        raise FormatError(f"{results} holds sensors of several kinds.", why=why, cure=cure)
    columns = dict(zip(_NUMBERS, np.concatenate(numbers, axis=1), strict=True))
    name, unit = os.path.basename(os.path.realpath(results)), (*units, "")[0]
    return FleetResults(paths=paths, failed=failed, errors=errors, unit=unit, name=name, **columns)
