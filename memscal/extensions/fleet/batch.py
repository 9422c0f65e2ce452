"""Batch of calibrations: shards of scans, each a task and a Parquet file that proves its work."""

import hashlib
import shutil
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import islice
from pathlib import Path

from memscal.apparatus import ApparatusFunction
from memscal.calibration.calibrate import calibrate
from memscal.cli.import_ import read_table
from memscal.cli.options import Options
from memscal.errors import InputError, MemscalError, OutputError
from memscal.extensions.fleet.many import attempted
from memscal.extensions.fleet.recipe import place_in_name
from memscal.extensions.fleet.shards import (
    BATCH,
    DIGEST,
    FLEET_SCHEMA_VERSION,
    TABLE_SUFFIXES,
    FleetScan,
    arrow,
    fleet_row,
    manifest_scans,
    read_batch,
    read_shard,
    relative,
    require_same,
    shard_paths,
    write_batch,
    write_shard,
)
from memscal.formats.files import HDF5_SUFFIXES, read_bytes
from memscal.formats.scan import read_scan
from memscal.model.arrays import Values
from memscal.model.provenance import timestamp
from memscal.model.scan import Scan
from memscal.version import __version__

Counts = Counter[str]
"""Numbers of scans, of errors, of failed checks, and of shards that were kept."""

_LONGEST_STEM = 80
#: Shards, as many as balance the workers, and the scans of one.
_SHARDS = 64
_SMALLEST = 4
_LARGEST = 256
#: Scans that a message names.
_NAMED = 3


@dataclass(frozen=True)
class Shard:
    """Scans that are calibrated as one task; ``first`` is the place of the first of them."""

    number: int
    first: int
    scans: tuple[FleetScan, ...]

    @property
    def name(self) -> str:
        """Name of its table, and of its folder of artifacts."""
        return f"shard-{self.number:06d}"


@dataclass(frozen=True)
class Batch:
    """What is calibrated how: ``options`` are those of :func:`memscal.calibrate`.

    ``sources`` are scans, or a folder of them, or a manifest; with a ``recipe``, options of
    ``memscal import``, they are tables.  ``results`` is the folder of the results, ``words`` are
    all options as they were given.  ``artifacts`` are written of calibrations with a failed check
    (``failed``), of ``all``, or of ``none``.
    """

    sources: Sequence[Path]
    results: Path
    options: Values
    artifacts: str
    words: Values
    recipe: Options | None = None
    anew: bool = False  # no shard stays
    shard_size: int | None = None  # by default from the number of scans
    count: int = 0  # of scans
    version: str = __version__

    @cached_property
    def stated(self) -> dict[str, str]:
        """Every option in words, by name; a reference counts by the digest of its file."""
        words = self.words | {"method": self.options["method"].name}
        for name in ("reference", "alternative"):
            profile = self.options[name]
            words[name] = profile and (profile.source or profile.form)
        return {name: str(value) for name, value in words.items() if value}

    @cached_property
    def options_sha256(self) -> str:
        """Digest of what is stated of the options."""
        return _sha256_of(sorted(self.stated.items()))

    @property
    def folder(self) -> Path:
        """What the paths of the scans are relative to."""
        source = self.sources[0]
        return source if source.is_dir() else source.parent

    def scans(self) -> Iterator[FleetScan]:
        """Yield what is calibrated: scans or, with a recipe, tables."""
        return manifest_scans(self.sources, TABLE_SUFFIXES if self.recipe else HDF5_SUFFIXES)

    def read(self, path: Path) -> Scan:
        """Read a scan, or a table by the recipe."""
        if self.recipe:
            return read_table(path, self.recipe)
        return read_scan(path, accept_altered=self.options["accept_altered"])

    def shards(self) -> Iterator[Shard]:
        """Yield the shards in their order, listing the scans as they are needed."""
        assert self.shard_size is not None
        scans = self.scans()
        size = self.shard_size
        shards = iter(lambda: tuple(islice(scans, size)), ())
        yield from (Shard(i, i * size, some) for i, some in enumerate(shards))

    def table(self, shard: Shard) -> Path:
        """Return the path of a shard's table."""
        return self.results / "shards" / f"{shard.name}.parquet"

    def prepare(self, *, resume: bool) -> "Batch":
        """Return the batch with its scans counted, if the folder of results may be used."""
        arrow()
        results = self.results
        count = self._counted()
        free = resume or self.anew
        if not free and any(path.is_file() for path in results.rglob("*")):
            raise OutputError(
                f"The folder {results} exists.",
                why="It may hold results, which are not replaced.",
                cure="Continue them with --resume, do them anew with --force, or give another "
                "folder.",
            )
        done = shard_paths(results)
        if done and not self.anew:
            require_same(results / BATCH, self.stated)
        size = self.shard_size or read_batch(results / BATCH).get("shard_size")
        size = size or min(max(_SMALLEST, -(-count // _SHARDS)), _LARGEST)
        sized = replace(self, shard_size=size, count=count)
        if not self.anew:
            sized._require_same_scans(done)
        # Workers see the same files from folders of their own.
        sources = [path.resolve() for path in self.sources]
        return replace(sized, sources=sources, results=results.resolve())

    def _require_same_scans(self, done: Iterable[Path]) -> None:
        """Refuse to go on with other scans than before; more of them may follow."""
        tables = {path: _paths_in(path) for path in done}
        for shard in self.shards():
            stored = tables.pop(self.table(shard), [])
            before = [(self.results / name).resolve() for name in stored]
            scans = shard.scans[: len(stored)]
            if before != [(self.folder / scan.path).resolve() for scan in scans]:
                tables = {self.table(shard): stored}
                break
        if tables:  # one that differs, or those beyond the last scan
            path, stored = next(iter(tables.items()))
            raise InputError(
                f"{self.results} holds results of other scans: {', '.join(stored[:_NAMED])}, in "
                f"{path.name}.",
                why="Nothing was touched.",
                cure="Give the scans, and --shard-size, as they were, with new ones at the end; or "
                "another folder. --force does all anew.",
            )

    def _counted(self) -> int:
        """Return how many scans there are; refuse a list of which none is there."""
        count = 0
        there = False
        first = ""
        for scan in self.scans():
            count += 1
            first = first or scan.path
            there = there or (self.folder / scan.path).exists()
        source = self.sources[0]
        if not first or (not self.recipe and first.lower().endswith(TABLE_SUFFIXES)):
            raise MemscalError(
                f"{source} holds no scans, which are HDF5.",
                why="Tables (CSV, ...) are read by a recipe, which states columns, film and load.",
                cure="Find the options for one table: memscal import TABLE ... --save-recipe "
                "recipe.toml. Then read them all: memscal batch ... --recipe recipe.toml.",
            )
        if not there:
            raise InputError(
                f"None of the {count} scans that {source.name} lists is there; the first is "
                f"{first[:200]!r}.",
                why="Paths are relative to the folder of the list.",
                cure="List a path a line, or give a table with a column path, separated by commas. "
                "If it is a table of readings, give a recipe (--recipe).",
            )
        return count

    def run(self, executor: Executor, most: Callable[[], int]) -> Iterator[Counts]:
        """Yield the counts of the shards as they are done, of which ``most()`` are in flight."""
        stated = {"scans": self.count, "shard_size": self.shard_size, "options": self.stated}
        write_batch(self.results / BATCH, stated)
        shards = self.shards()
        tasks = set[Future[Counts]]()
        lost = []
        try:
            while True:
                some = islice(shards, max(0, most() - len(tasks)))
                tasks |= {executor.submit(run_shard, self, shard) for shard in some}
                if not tasks:
                    break
                done, tasks = wait(tasks, return_when=FIRST_COMPLETED)
                for task in done:
                    try:
                        yield task.result()
                    except (MemscalError, BrokenExecutor):
                        raise
                    except Exception as failure:  # noqa: BLE001 - of a cluster: workers that died
                        lost.append(type(failure).__name__)
        finally:
            for task in tasks:
                task.cancel()
        if lost:
            raise MemscalError(
                f"The workers of {len(lost)} shards were lost ({', '.join(sorted(set(lost)))}).",
                why="They were killed or ran out of memory, with one shard several times.",
                cure="Give the workers more memory, and run the same command with --resume.",
            )


def _paths_in(table: Path) -> list[str]:
    """Return the scans of a shard's table; of a damaged one, which is made anew, none."""
    with suppress(MemscalError):
        paths: list[str] = read_shard(table)["path"].to_pylist()
        return paths
    return []


def _sha256_of(value: object) -> str:
    return hashlib.sha256(repr(value).encode()).hexdigest()


def run_shard(batch: Batch, shard: Shard) -> Counts:
    """Calibrate the scans of a shard, unless its file is there and is of the same work; count."""
    if batch.version != __version__:
        raise MemscalError(
            f"A worker has memscal {__version__}, the batch {batch.version}.",
            cure="Install the same version everywhere.",
        )
    rows = [] if batch.anew else _kept_rows(batch, shard)
    kept = bool(rows)
    if not kept:
        # Artifacts of what was there before are of other scans or options.
        shutil.rmtree(batch.results / "artifacts" / shard.name, ignore_errors=True)
        rows = [_row(batch, shard, i) for i in range(len(shard.scans))]
        digest = _digest(batch, shard, [row["input_sha256"] for row in rows])
        write_shard(batch.table(shard), rows, digest)
    errors = sum(row["error"] is not None for row in rows)
    failed = sum(not row["passed"] for row in rows) - errors
    return Counter(scans=len(rows), errors=errors, failed=failed, kept=kept)


def _kept_rows(batch: Batch, shard: Shard) -> list[Values]:
    """Return what a shard's file says, if it opens whole and its digest is that of this work."""
    if batch.table(shard).exists():
        with suppress(MemscalError):
            table = read_shard(batch.table(shard))
            inputs = [_sha256_of_file(batch.folder / scan.path) for scan in shard.scans]
            if table.schema.metadata.get(DIGEST.encode()) == _digest(batch, shard, inputs).encode():
                rows: list[Values] = table.select(["passed", "error", "artifact"]).to_pylist()
                names = [row["artifact"] for row in rows if row["artifact"]]
                if all((batch.results / name).exists() for name in names):
                    return rows
    return []


def _digest(batch: Batch, shard: Shard, inputs: list[str | None]) -> str:
    """Return the digest of version, options, and of the contents and places of the scans."""
    return _sha256_of((batch.version, FLEET_SCHEMA_VERSION, batch.options_sha256, shard, inputs))


def _sha256_of_file(path: Path) -> str | None:
    """Return the digest of a file, ``None`` of one that cannot be read."""
    with suppress(MemscalError):
        return hashlib.sha256(read_bytes(path)).hexdigest()
    return None


def _row(batch: Batch, shard: Shard, i: int) -> Values:
    """Calibrate a scan and return its row; an error is a row, too."""
    item = shard.scans[i]
    path = batch.folder / item.path
    row = {
        "place": shard.first + i,
        **asdict(item),
        "path": relative(path, batch.results),
        "passed": False,
        "calibrated_at": timestamp(),
        "input_sha256": _sha256_of_file(path),
        "options_sha256": batch.options_sha256,
        "version": batch.version,
        "error": None,
    }
    apparatus = attempted(item.path, lambda: _calibrated(batch, path, row))
    if isinstance(apparatus, MemscalError):
        row |= {"error_class": type(apparatus).__name__, "error": str(apparatus)}
        return row | vars(apparatus)  # problem and cure among them
    if batch.artifacts == "all" or (batch.artifacts == "failed" and not apparatus.passed):
        name = f"{shard.first + i:07d}-{path.stem[:_LONGEST_STEM]}.apparatus.h5"
        artifact = Path("artifacts", shard.name, name)
        row["artifact"] = artifact.as_posix()
        (batch.results / artifact).parent.mkdir(parents=True, exist_ok=True)
        apparatus.compact().save(batch.results / artifact, overwrite=True)
    return row | fleet_row(apparatus)


def _calibrated(batch: Batch, path: Path, row: Values) -> ApparatusFunction:
    """Calibrate with a scan; add what it states to its row."""
    if batch.recipe and batch.recipe["name_pattern"] and row["wafer_x"] is None:
        row |= place_in_name(path, batch.recipe)
    scan = batch.read(path)
    row |= asdict(scan.sensor) | {"start_time": scan.start_time}
    row["sensor"] = row["sensor"] or scan.sensor.name
    return calibrate(scan, other=False, **batch.options).apparatus
