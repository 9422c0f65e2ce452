"""Files of a fleet: the manifest of its scans, and the Parquet tables of its results."""

import csv
import hashlib
import json
import os
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from glob import glob
from pathlib import Path
from typing import Any

import numpy as np

from memscal.errors import FormatError, InputError, MemscalError, OutputError
from memscal.extensions.fleet.results import Failure, FleetResults
from memscal.formats.files import HDF5_SUFFIXES, atomic_write_bytes, read_bytes
from memscal.formats.tables.sheets import installed
from memscal.model.apparatus import ApparatusData
from memscal.model.arrays import FloatArray, Values, value_record
from memscal.model.checks import OVERRIDE, Message
from memscal.model.notation import VOLTS, Reading
from memscal.model.quantities import ESTIMATED, MM, PER_MM, PER_MM2, parameter_quantity
from memscal.version import __version__

FLEET_SCHEMA = "memscal-fleet"
FLEET_SCHEMA_VERSION = "1.3.0"
DIGEST = "memscal_shard_sha256"
BATCH = "batch.json"
"""File that states a batch."""
#: Bytes that it may have; scans that a message names.
_MOST_STATED = 100_000
_NAMED = 5
TABLE_SUFFIXES = (".csv", ".tsv", ".txt", ".dat", ".xlsx", ".parquet", ".tdms")
"""Endings of tables of readings."""
#: What memscal writes beside scans.
_RESULTS = (".apparatus", ".stress")


@value_record
class FleetScan:
    """A scan of a manifest: its path as listed, the sensor's place on its wafer (mm), its name."""

    path: str
    wafer_x: float | None = None
    wafer_y: float | None = None
    sensor: str = ""
    place_unit: str = "mm"  # or "die", where columns and rows are counted


def expanded(sources: Iterable[Path]) -> list[Path]:
    """Return paths with those that patterns such as ``*.csv`` stand for."""
    paths: list[str | Path] = []
    for source in sources:
        paths += sorted(glob(str(source), recursive=True)) or [source]
    return [Path(path) for path in paths]


def relative(path: Path, folder: Path) -> str:
    """Return a path as seen from a folder; on another disk as it is."""
    with suppress(ValueError):
        return Path(os.path.relpath(path, folder)).as_posix()
    return str(path)


def manifest_scans(
    sources: Sequence[Path], suffixes: tuple[str, ...] = HDF5_SUFFIXES
) -> Iterator[FleetScan]:
    """Yield several scans, those of a folder, by their names, or of a manifest, in its order."""
    source = sources[0]
    if len(sources) > 1:
        yield from (FleetScan(relative(path, source.parent)) for path in sources)
        return
    if source.is_dir():
        for place, folders, files in os.walk(source):
            folders.sort()
            for path in (Path(place, name) for name in sorted(files)):
                if path.suffix.lower() in suffixes and not path.stem.endswith(_RESULTS):
                    yield FleetScan(path.relative_to(source).as_posix())
        return
    try:
        lines = read_bytes(source).decode("utf-8-sig").splitlines()
        yield from _listed_scans(source.name, lines)
    except (UnicodeDecodeError, csv.Error) as error:
        raise FormatError(f"{source} is not a table of text: {error}.") from error


def _listed_scans(name: str, lines: Iterable[str]) -> Iterator[FleetScan]:
    """Read a table with a column ``path``, or without a head a path a line, commas included."""
    head: list[str] = []
    for number, line in enumerate(lines, start=1):
        text = line.strip()
        if not text or text.startswith("#"):
            continue
        cells = [cell.strip() for cell in next(csv.reader([text]))]
        if not head:
            head = [cell.lower().removesuffix("(mm)").rstrip() for cell in cells]
            if "path" in head:
                _require_places(name, head)
                continue
            head = ["path"]
        row = dict(zip(head, cells if len(head) > 1 else [text], strict=False))
        try:
            place = [float(row[key]) if row.get(key) else None for key in ("wafer_x", "wafer_y")]
        except ValueError as error:
            raise FormatError(
                f"{name}, line {number}: {error}.",
                cure="Give the place on the wafer in mm, or leave it empty.",
            ) from error
        if not row.get("path"):
            raise FormatError(f"{name}, line {number} has no path.")
        sensor = row.get("sensor") or ""
        yield FleetScan(row["path"], place[0], place[1], sensor, row.get("place_unit") or "mm")


def _require_places(name: str, head: Sequence[str]) -> None:
    for cell in head:
        if cell.startswith(("wafer_x", "wafer_y")) and cell[7:]:
            raise FormatError(
                f"{name} has a column {cell!r}, which is not read.",
                cure=f"Give places on the wafer in mm, in a column {cell[:7]}.",
            )


#: Those that a calibration may estimate, with columns of their own.
_PARAMETERS = tuple(n for n in ESTIMATED if n not in ("baseline_slope", "force", "maximum"))
#: Types of the other columns, and units of those that have one.
_COLUMNS = Path(__file__).with_name("columns.json")
_CHECK = ("value", "limit", "p_value")


def arrow() -> Any:
    """Return the module pyarrow, or say how to get it."""
    installed("pyarrow", "A table of results", "fleet")
    import pyarrow.csv
    import pyarrow.parquet

    return pyarrow


def _schema(readings: Iterable[Reading]) -> Any:
    """Return names, types and units of the columns, for sensors with readings in some units."""
    stated = json.loads(_COLUMNS.read_text("utf-8"))
    for parameter in _PARAMETERS:
        units = {ESTIMATED[parameter].read_in(reading).unit_text for reading in readings}
        for name in (parameter, f"{parameter}_errors"):
            stated["types"][name] = "double"
            stated["units"][name] = " or ".join(sorted(units))
    pa = arrow()
    fields = []
    for name, kind in stated["types"].items():
        about = {"units": stated["units"][name]} if name in stated["units"] else None
        fields.append(pa.field(name, _type(kind), metadata=about))
    return pa.schema(fields)


def _type(kind: Any) -> Any:
    """Return a type by its name; a list has that of its items, a mapping those of its entries."""
    pa = arrow()
    if isinstance(kind, list):
        return pa.list_(_type(kind[0]))
    if isinstance(kind, dict):
        return pa.struct({name: _type(item) for name, item in kind.items()})
    return pa.type_for_alias(kind)


def fleet_row(data: ApparatusData) -> Values:
    """Return an apparatus function as a row, in the units of files."""
    parameters = data.parameters
    radial = data.radial_profile
    quantities = {name: parameter_quantity(parameters, name) for name in parameters.names}
    names = [name for name in _PARAMETERS if name in quantities]
    row = {
        "passed": data.passed,
        "calibrated_at": data.process.date,
        "method": data.process.configuration["method"],
        "reading": data.reading,
        "unit": quantities["conversion_constant"].unit_text,
        "messages": [{"kind": m.kind, "text": m.text} for m in data.process.messages],
        "checks": [
            {key: getattr(check, key) for key in ("name", "passed", *_CHECK)}
            for check in data.checks
        ],
        "correlated": names,
        "correlation": _correlation(parameters.only(names).covariance),
        "resolved_wavenumber": data.resolved_wavenumber / PER_MM,
        "r": radial.r / MM,
        "g": radial.g / PER_MM2,
        "g_errors": radial.g_errors / PER_MM2,
    }
    for name in names:
        scale = quantities[name].scale
        row[name] = parameters[name] / scale
        row[f"{name}_errors"] = parameters.uncertainty(name) / scale
    row["budget"] = []
    for name, sources in data.budget.items():
        for source, u in sources.items():
            if u > 0:
                errors = u / quantities[name].scale
                row["budget"].append({"quantity": name, "source": source, "errors": errors})
    return row


def _correlation(covariance: FloatArray) -> FloatArray:
    """Coefficients of correlation above the diagonal, row by row."""
    u = np.sqrt(np.diag(covariance))
    with np.errstate(divide="ignore", invalid="ignore"):
        correlation = covariance / np.outer(u, u)
    return np.asarray(correlation[np.triu_indices(u.size, 1)])


def write_shard(path: Path, rows: list[Values], digest: str) -> None:
    """Write a table whole or not at all; its metadata state the digest of what it is made from."""
    pa = arrow()
    about = {
        "memscal_schema": FLEET_SCHEMA,
        "memscal_schema_version": FLEET_SCHEMA_VERSION,
        "memscal_version": __version__,
        DIGEST: digest,
    }
    readings = {row["reading"] for row in rows if "reading" in row} or {VOLTS}
    table = pa.Table.from_pylist(rows, _schema(readings).with_metadata(about))
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
        missing = set(columns or ()) - set(file.schema_arrow.names)
        if missing:
            raise FormatError(
                f"{path} was written by an earlier memscal.",
                why=f"It lacks {', '.join(sorted(missing))}.",
                cure="Run memscal batch --resume with this one.",
            )
        return file.read(columns)
    except (pa.ArrowException, OSError) as error:
        reason = " ".join(str(error).split())[:200]
        raise FormatError(
            f"{path} is damaged: {reason}", cure="Remove it, and run memscal batch --resume."
        ) from error


def make_folder(folder: Path) -> None:
    """Make a folder, if it is not there."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            f"The folder {folder} cannot be made: {error.strerror}.",
            cure="Give a folder in which you may write.",
        ) from error


def shard_paths(results: Path) -> list[Path]:
    """Return the tables in a folder of results, in their order."""
    return sorted((results / "shards").glob("shard-*.parquet"))


def write_batch(path: Path, stated: Values) -> None:
    """State what a batch or an import is, for those that continue or summarise it."""
    text = json.dumps({"schema": FLEET_SCHEMA, "version": FLEET_SCHEMA_VERSION, **stated}, indent=2)
    atomic_write_bytes(path, f"{text}\n".encode(), overwrite=True)


def read_batch(path: Path) -> Values:
    """Return what a batch or an import states of itself; nothing where that is not known."""
    with suppress(MemscalError, ValueError, RecursionError):
        stated = json.loads(read_bytes(path, limit=_MOST_STATED))
        if isinstance(stated, dict) and all(
            stated.get(key, 1) in range(1, 2**31) for key in ("scans", "shard_size")
        ):
            return stated
    return {}


def require_same(path: Path, stated: Mapping[str, str]) -> None:
    """Refuse to go on with other options than a file states of what was begun, and name each."""
    before = read_batch(path).get("options", {})
    absent = "not stated"
    changed = [
        f"{name}: {before.get(name, absent)}, now {stated.get(name, absent)}"
        for name in {**before, **stated}
        if before.get(name) != stated.get(name)
    ]
    if changed:
        raise InputError(
            f"{path.parent} was begun with other options: {'; '.join(changed)}.",
            why="Nothing was touched.",
            cure="Give the options as they were, or another folder; --force does all anew.",
        )


_NUMBERS = (
    "conversion_constant",
    "conversion_constant_errors",
    "gaussian_sigma",
    "gaussian_sigma_errors",
    "wafer_x",
    "wafer_y",
)
_WORDS = (
    "path",
    "sensor",
    "method",
    "calibrated_at",
    "options_sha256",
    "version",
    "unit",
    "place_unit",
    "input_sha256",
)
_SUMMARISED = (*_NUMBERS, *_WORDS, "passed", "error_class", "problem", "cure", "checks", "messages")


def _messages(table: Any, words: Mapping[str, Any], scans: int) -> Iterator[Message]:
    """Yield what is missing of so many scans, mixed, repeated or overridden."""
    paths = words["path"]
    if len(paths) < scans:
        text = f"The batch is not finished: {len(paths)} of {scans} scans are done."
        yield Message("unfinished", f"{text} memscal batch --resume does the rest.", "warning")
    settings = list(zip(words["options_sha256"], words["version"], strict=True))
    firsts = sorted(map(settings.index, set(settings)))
    if len(firsts) > 1:
        first = ", ".join(paths[i] for i in firsts)
        text = f"The scans were calibrated with {len(firsts)} different options or versions"
        yield Message("mixed", f"{text}; the first of each: {first}.", "warning")
    contents = set()
    repeated = []
    for path, digest in zip(paths, words["input_sha256"], strict=True):
        if digest and digest in contents:
            repeated.append(path)
        contents.add(digest)
    if repeated:
        text = f"{len(repeated)} of the scans repeat the content of another one and count again"
        yield Message("repeated", f"{text}, as {', '.join(repeated[:_NAMED])}.", "warning")
    overridden: dict[str, str] = {}
    for path, messages in zip(paths, table["messages"], strict=True):
        for message in messages.as_py() or ():
            if message["kind"] == OVERRIDE:
                overridden.setdefault(path, message["text"])
    for path, text in [*overridden.items()][:1]:
        text = f"{len(overridden)} scans, the first {path}: {text}"
        yield Message(OVERRIDE, text, "warning")


def read_fleet(results: Path) -> FleetResults:
    """Read what a summary needs of the tables of a batch."""
    shards = shard_paths(results)
    if not shards:
        raise InputError(
            f"{results} holds no results of a batch.",
            cure="Give the folder that memscal batch -o wrote.",
        )
    table = arrow().concat_tables([read_shard(shard, _SUMMARISED) for shard in shards])
    words = {name: table[name].to_pylist() for name in _WORDS}
    paths = words["path"]
    units = sorted(set(words["unit"]) - {None})
    if len(units) > 1:
        raise FormatError(
            f"{results} holds sensors of several kinds.",
            why=f"The conversion constants are in {' and '.join(units)}.",
            cure="Run a batch for each unit of readings.",
        )
    failing = np.flatnonzero(~table["passed"].to_numpy().astype(bool))
    failed = {}
    errors = {}
    for number, row in zip(failing.tolist(), table.take(failing).to_pylist(), strict=True):
        failed[number] = tuple(c["name"] for c in row["checks"] or () if not c["passed"])
        if row["error_class"]:
            errors[number] = Failure(row["error_class"], row["problem"], row["cure"])
    batch = read_batch(results / BATCH)
    return FleetResults(
        paths=paths,
        sensors=[
            sensor or Path(path).stem for sensor, path in zip(words["sensor"], paths, strict=True)
        ],
        failed=failed,
        errors=errors,
        unit="".join(units),
        place_unit=words["place_unit"][0],
        name=results.resolve().name,
        messages=tuple(_messages(table, words, batch.get("scans", 0))),
        provenance={
            "method": sorted(set(filter(None, words["method"]))),
            "options": batch.get("options"),
            "version": sorted(set(words["version"])),
            "calibrated": [min(words["calibrated_at"]), max(words["calibrated_at"])],
            "inputs_sha256": hashlib.sha256(repr(words["input_sha256"]).encode()).hexdigest(),
        },
        **{name: table[name].to_numpy().astype(np.float64) for name in _NUMBERS},
    )
