"""Scans, and the stress measured of them, given as objects or as the paths of their files."""

from collections.abc import Hashable, Iterable, Sequence
from dataclasses import replace
from os import PathLike
from typing import Any, TypeAlias

from memscal.errors import InputError, counted
from memscal.extensions import hook
from memscal.formats.files import FilePath
from memscal.formats.hdf5.reader import open_hdf5
from memscal.formats.hdf5.writer import STRESS_SCHEMA
from memscal.formats.scan import scan_from
from memscal.formats.stress import stress_from
from memscal.model.measured_stress import MeasuredStress
from memscal.model.scan import Scan, require_single
from memscal.readings.noise_record import with_recorded_noise

Scans: TypeAlias = Scan | FilePath | Sequence[Scan | FilePath]
"""One scan or several, each itself or as the path of its file."""

Contacts: TypeAlias = Scan | MeasuredStress | FilePath | Sequence[Scan | MeasuredStress | FilePath]
"""Scans, or the stress that was measured of them; each itself or as the path of its file."""


def opened_scan(
    scan: Any, most: int | None = None, *, accept_altered: bool = False, noise_record: Any = None
) -> Scan:
    """Return a single sensor's scan, given itself or as a path, with ``most`` points in a file.

    Its noise is that of a noise record, given in one of these ways, or else its own.
    """
    if isinstance(scan, str | PathLike):
        with open_hdf5(scan, accept_altered=accept_altered) as file:
            scan = scan_from(file, most)
    if not isinstance(scan, Scan):
        raise InputError(
            f"{type(scan).__name__} is given where a Scan is needed.",
            cure="Give a scan, or the path of its file.",
        )
    require_single(scan)
    if noise_record is not None:
        record = opened_scan(noise_record, accept_altered=accept_altered)
        scan = replace(scan, noise_record=record)
    return with_recorded_noise(scan)


def opened_scans(
    scans: Scans,
    most: int | None = None,
    *,
    accept_altered: bool = False,
    noise_record: Any = None,
) -> tuple[Scan, ...]:
    """Return scans that are given themselves or as paths, at least one; of ``most`` points each."""
    opened = [
        opened_scan(scan, most, accept_altered=accept_altered, noise_record=noise_record)
        for scan in listed_items(scans)
    ]
    require_different(map(contents_of, opened))
    return tuple(opened)


def opened_contacts(
    contacts: Contacts, *, accept_altered: bool = False, noise_record: Any = None
) -> tuple[Scan | MeasuredStress, ...]:
    """Return scans and measured stresses that are given themselves or as paths, at least one."""
    opened: list[Scan | MeasuredStress] = []
    for item in listed_items(contacts):
        if isinstance(item, str | PathLike):
            with open_hdf5(item, accept_altered=accept_altered) as file:
                is_stress = file.schema == STRESS_SCHEMA
                item = stress_from(file) if is_stress else scan_from(file)
        if not isinstance(item, MeasuredStress):
            item = opened_scan(item, noise_record=noise_record)
        opened.append(item)
    if noise_record is not None and not all(isinstance(item, Scan) for item in opened):
        raise InputError(
            "A noise record and measured stress are given.",
            why="Measured stress has the noise with which it was measured.",
            cure="Give the scans, or measure the stress with the record (memscal apply).",
        )
    require_different(contents_of(item) for item in opened if isinstance(item, Scan))
    return tuple(opened)


def contents_of(scan: Scan) -> tuple[str, Hashable]:
    """Return a scan's name, and what tells it from another."""
    arrays = scan.x, scan.y, scan.u_zz, scan.normal_load, *scan.channels.values()
    stated = scan.direction, scan.load, scan.unit, scan.lubrication
    named = (
        scan.source.file_name if scan.source else f"A scan of {counted(scan.u_zz.size, 'points')}"
    )
    return named, (*stated, *(a if a is None else a.tobytes() for a in arrays))


def require_different(named: Iterable[tuple[str, Hashable]]) -> None:
    """Refuse contents, with their names, that are given twice: they would count as independent."""
    seen = set()
    for name, content in named:
        if content in seen:
            raise InputError(
                f"{name} is given twice.",
                why="The same readings would count as independent ones, and every uncertainty "
                "would come out too small.",
                cure="Give each of them once.",
            )
        seen.add(content)


def listed_items(items: Any) -> list[Any]:
    """Return the items of a list, or the one that is given by itself."""
    single = isinstance(items, str | PathLike) or not isinstance(items, Iterable)
    listed = [items] if single else list(items)
    if not listed:
        raise InputError("There is no scan.", cure="Give a scan, or several.")
    return listed


def accepted_differences(
    differences: Iterable[Sequence[str]], *, override: bool, problem: str, why: str, cure: str
) -> list[str]:
    """Refuse what two places state differently; with ``override`` return it in words, each once."""
    # Two places, a quantity, and what each of them states of it.
    unlike = list(dict.fromkeys(differences))
    if unlike and not override:
        raise InputError(
            f"{problem}:{hook('table_of')(unlike)}",
            why=why,
            cure=f"{cure} To go on all the same, override it (override=True; --override on the "
            "command line): that is recorded.",
        )
    return ["{2} {3} in {0}, {4} in {1}".format(*difference) for difference in unlike]
