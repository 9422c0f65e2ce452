"""Batch of calibrations: shards of scans, each a task and a Parquet file that proves its work."""

import hashlib
import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, Future, wait
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import cached_property
from itertools import islice
from pathlib import Path

from memscal.calibration.calibrate import calibrate
from memscal.errors import InputError, MemscalError, OutputError
from memscal.extensions.fleet.many import attempted
from memscal.extensions.fleet.shards import (
    DIGEST,
    FLEET_SCHEMA_VERSION,
    FleetScan,
    arrow,
    fleet_row,
    manifest_scans,
    read_batch,
    read_shard,
    shard_paths,
    write_batch,
    write_shard,
)
from memscal.formats.files import ensure_writable, read_bytes
from memscal.formats.scan import read_scan
from memscal.model.arrays import Values
from memscal.model.provenance import timestamp
from memscal.model.stress import StressProfile
from memscal.version import __version__

_LONGEST_STEM = 80
#: Shards, as many as balance the workers, and the scans of one.
_SHARDS = 64
_SMALLEST = 4
_LARGEST = 256


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
class ShardOutcome:
    """How many scans a shard has, how many of them have an error, and how many a failed check."""

    scans: int
    errors: int
    failed: int
    kept: bool  # its file was there already


@dataclass(frozen=True)
class Batch:
    """What is calibrated how: ``options`` are those of :func:`memscal.calibrate`.

    ``source`` is a folder of scans, or a manifest; ``results`` the folder of the results.
    ``artifacts`` are written of calibrations with a failed check (``failed``), of ``all``, or of
    ``none``.
    """

    source: Path
    results: Path
    options: Values
    artifacts: str
    shard_size: int | None = None  # by default from the number of scans
    count: int = 0  # of scans
    version: str = __version__

    @cached_property
    def options_sha256(self) -> str:
        """Digest of the options; a reference counts by the digest of its file."""
        stated = {
            name: value.source or value.form if isinstance(value, StressProfile) else value
            for name, value in self.options.items()
        }
        return _sha256_of((stated, self.artifacts))

    @property
    def folder(self) -> Path:
        """What the paths of the scans are relative to."""
        return self.source if self.source.is_dir() else self.source.parent

    def shards(self) -> Iterator[Shard]:
        """Yield the shards in their order, listing the scans as they are needed."""
        assert self.shard_size is not None
        scans = manifest_scans(self.source)
        size = self.shard_size
        shards = iter(lambda: tuple(islice(scans, size)), ())
        yield from (Shard(i, i * size, some) for i, some in enumerate(shards))

    def table(self, shard: Shard) -> Path:
        """Return the path of a shard's table."""
        return self.results / "shards" / f"{shard.name}.parquet"

    def prepare(self, *, resume: bool) -> "Batch":
        """Make the folder of results, if it may be used; count the scans."""
        arrow()
        results = self.results
        count = self._counted()
        stays = "It may hold results, which are not replaced."
        with suppress(FileNotFoundError, NotADirectoryError):
            if not resume and any(path.is_file() for path in results.rglob("*")):
                raise OutputError(
                    f"The folder {results} exists.",
                    why=stays,
                    cure="Continue them with --resume, or give another folder.",
                )
        begun_with = read_batch(results).get("shard_size")
        balanced = min(max(_SMALLEST, -(-count // _SHARDS)), _LARGEST)
        size = self.shard_size or begun_with or balanced
        shards = -(-count // size)
        numbers = [int(path.stem.rpartition("-")[2]) for path in shard_paths(results)]
        if max(numbers, default=0) >= shards:
            raise OutputError(
                f"{results} has shard {max(numbers)}; this batch ends at {shards - 1}.",
                why=stays,
                cure="Resume with the manifest and the --shard-size that it was begun with.",
            )
        try:
            (results / "shards").mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError(
                f"The folder {results} cannot be made: {error.strerror}.",
                cure="Give a folder in which you may write.",
            ) from error
        ensure_writable(results / "shards" / "proof")
        return replace(self, shard_size=size, count=count)

    def _counted(self) -> int:
        """Return how many scans there are; refuse a list of which none is there."""
        count = 0
        there = False
        first = ""
        for scan in manifest_scans(self.source):
            count += 1
            first = first or scan.path
            there = there or (self.folder / scan.path).exists()
        if not count:
            raise MemscalError(
                f"{self.source} holds no scans.",
                cure="Give a folder with scans (HDF5), or a manifest with a scan a line.",
            )
        if not there:
            raise InputError(
                f"None of the {count} scans that {self.source.name} lists is there; the first is "
                f"{first[:200]!r}.",
                why=f"Paths are relative to {self.folder}.",
                cure="List a path a line, or give a table with a column path, separated by commas.",
            )
        return count

    def run(self, executor: Executor, most: Callable[[], int]) -> Iterator[ShardOutcome]:
        """Yield the outcomes of the shards as they are done, of which ``most()`` are in flight."""
        write_batch(self.results, {"scans": self.count, "shard_size": self.shard_size})
        shards = self.shards()
        tasks = set[Future[ShardOutcome]]()
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


def _sha256_of(value: object) -> str:
    return hashlib.sha256(repr(value).encode()).hexdigest()


def run_shard(batch: Batch, shard: Shard) -> ShardOutcome:
    """Calibrate the scans of a shard, unless its file is there and is of the same work."""
    if batch.version != __version__:
        raise MemscalError(
            f"A worker has memscal {__version__}, the batch {batch.version}.",
            cure="Install the same version everywhere.",
        )
    rows = _kept_rows(batch, shard)
    kept = bool(rows)
    if not kept:
        # Artifacts of what was there before are of other scans or options.
        shutil.rmtree(batch.results / "artifacts" / shard.name, ignore_errors=True)
        rows = [_row(batch, shard, i) for i in range(len(shard.scans))]
        digest = _digest(batch, shard, [row["input_sha256"] for row in rows])
        write_shard(batch.table(shard), rows, digest)
    errors = sum(row["error"] is not None for row in rows)
    failed = sum(not row["passed"] for row in rows) - errors
    return ShardOutcome(len(rows), errors, failed, kept)


def _kept_rows(batch: Batch, shard: Shard) -> list[Values]:
    """Return what a shard's file says, if it opens whole and its digest is that of this work."""
    if batch.table(shard).exists():
        with suppress(MemscalError):
            table = read_shard(batch.table(shard))
            inputs = [_sha256_of_file(batch.folder / scan.path) for scan in shard.scans]
            if table.schema.metadata.get(DIGEST.encode()) == _digest(batch, shard, inputs).encode():
                names = ["passed", "error", "artifact"]
                rows: list[Values] = table.select(names).to_pylist()
                written = (batch.results / row["artifact"] for row in rows if row["artifact"])
                if all(path.exists() for path in written):
                    return rows
    return []


def _digest(batch: Batch, shard: Shard, inputs: list[str | None]) -> str:
    """Return the digest of version, options, and of the contents and places of the scans."""
    made = batch.version, FLEET_SCHEMA_VERSION, batch.options_sha256
    return _sha256_of((*made, shard, inputs))


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
        "passed": False,
        "calibrated_at": timestamp(),
        "options_sha256": batch.options_sha256,
        "version": batch.version,
        "error": None,
    }
    accepted = batch.options.get("accept_altered", False)
    scan = attempted(item.path, lambda: read_scan(path, accept_altered=accepted))
    if isinstance(scan, MemscalError):
        return row | _error_columns(scan) | {"input_sha256": _sha256_of_file(path)}
    row |= asdict(scan.sensor) | {"sensor": scan.sensor.name, "start_time": scan.start_time}
    row["input_sha256"] = scan.source and scan.source.sha256
    apparatus = attempted(
        item.path, lambda: calibrate(scan, other=False, **batch.options).apparatus
    )
    if isinstance(apparatus, MemscalError):
        return row | _error_columns(apparatus)
    if batch.artifacts == "all" or (batch.artifacts == "failed" and not apparatus.passed):
        name = f"{shard.first + i:07d}-{path.stem[:_LONGEST_STEM]}.apparatus.h5"
        artifact = Path("artifacts", shard.name, name)
        row["artifact"] = artifact.as_posix()
        (batch.results / artifact).parent.mkdir(parents=True, exist_ok=True)
        apparatus.compact().save(batch.results / artifact, overwrite=True)
    return row | fleet_row(apparatus)


def _error_columns(error: MemscalError) -> dict[str, str]:
    return {"error_class": type(error).__name__, "error": str(error)}
