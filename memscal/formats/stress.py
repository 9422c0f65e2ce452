"""memscal-stress: the stress that a calibrated sensor measured, load by load, as HDF5."""

from collections import defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from memscal.errors import FormatError
from memscal.formats import groups
from memscal.formats.digest import require_schema, require_unaltered
from memscal.formats.files import FilePath
from memscal.formats.groups import read_record, read_source, write_record, write_source
from memscal.formats.hdf5 import writer
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.formats.hdf5.writer import Group, Nodes, si, to_json
from memscal.model import records
from memscal.model.arrays import Arrays, FloatArray
from memscal.model.checks import override_messages
from memscal.model.instrument import Equipment
from memscal.model.measured_stress import (
    MeasuredPoints,
    MeasuredProfile,
    MeasuredScan,
    MeasuredStress,
)
from memscal.model.notation import Reading
from memscal.model.provenance import SourceFile, accepted_alterations
from memscal.model.records import points_record

_CHANNELS = ("zz", "xz", "yz")
_NOT_ALWAYS = ("centre_y", "centre_y_errors", "load_errors", "lubrication")


def _read_points(file: SafeFile, name: str, of: Reading) -> dict[str, MeasuredPoints]:
    """Read the points of each channel of a profile; none of a file of version 1.0."""
    points = {}
    for channel in _CHANNELS:
        group = f"/entry/points_{channel}/{name}"
        if file.has(group):
            stored = read_record(points_record(channel).read_in(of), file, group)
            points[channel] = MeasuredPoints(**{"noise": None} | stored)
    return points


def _read_scans(
    file: SafeFile, paths: Sequence[str], of: Sequence[float], sources: Mapping[str, SourceFile]
) -> tuple[MeasuredScan, ...]:
    """Read the scans; ``of`` says which, from 1, the profile at each of the paths is of."""
    stored = file.json_value("/entry/scans/names", list, None)
    size = _MOST_SCANS if stored is None else len(stored)
    for path, number in zip(paths, of, strict=True):
        if not 1 <= number <= size:
            raise FormatError(
                f"{file.where(path)}: the profile comes from scan {number:g} of {size}.",
                why="Scans are counted from 1.",
                cure="Run memscal apply again.",
            )
    scans = []
    named = stored or [f"scan_{i + 1}" for i in range(int(max(of)))]
    for i, name in enumerate(named, start=1):
        path = f"/entry/scans/{name}"
        source = sources.get(str(name))
        if stored is not None:
            lubrication = file.optional_text(f"{path}/sample/lubrication")
            numbers = read_record(records.MEASURED_SCAN, file, path)
        else:
            # A file of version 1.0 states film, indenter and sensor once, for all scans.
            path = "/entry"
            profile = paths[of.index(i) if i in of else 0]
            lubrication = file.optional_text(f"{profile}/lubrication")
            x, y = (file.require_array(f"{profile}/{axis}", "length") for axis in "xy")
            numbers = {"width": float(np.hypot(np.ptp(x), np.ptp(y)))}
        scans.append(
            MeasuredScan(
                film=groups.read_film(file, f"{path}/sample/film"),
                indenter=groups.read_round_indenter(file, f"{path}/indenter"),
                **groups.read_instrument(file, path),
                lubrication=lubrication,
                **read_record(records.SLIDING, file, f"{path}/indenter"),
                source=source,
                **numbers,
            )
        )
    return tuple(scans)


#: Correlations below this are rounding.
_ROUNDING = 1e-9
_BUDGET = {"force": "force", "maximum": "stress"}
_MOST_SCANS = 10_000


def read_stress(path: FilePath, *, accept_altered: bool = False) -> MeasuredStress:
    """Read measured stress from a memscal-stress file.

    Parameters
    ----------
    path : path
        The file; units in it are converted to SI.
    accept_altered : bool
        Accept a file whose content does not fit its digest: ``overridden`` records it.

    Returns
    -------
    MeasuredStress
        Equal to what was saved.  A file of version 1.0 holds no measured points.

    Raises
    ------
    FormatError, UnitError, UnsafeFileError, SchemaVersionError
        If the file does not hold measured stress that this version can read, or was changed
        since it was written (its content digest no longer fits).

    Examples
    --------
    >>> import memscal, tempfile
    >>> apparatus = memscal.calibrate(memscal.simulate(seed=1), method="bayesian").apparatus
    >>> measured = memscal.measure_stress(memscal.simulate(seed=2), apparatus)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     measured.save(f"{folder}/rod.stress.h5")
    ...     read_stress(f"{folder}/rod.stress.h5") == measured
    True
    """
    with open_hdf5(path, accept_altered=accept_altered) as file:
        return stress_from(file)


def stress_from(file: SafeFile) -> MeasuredStress:
    """Read the measured stress of an open memscal-stress file."""
    require_schema(file, writer.STRESS_SCHEMA)
    require_unaltered(file)
    paths = profile_paths(file)
    if not paths:
        raise FormatError(
            f"{file.where('/entry/profiles')} names no profile.",
            why="It lists the groups that hold one.",
        )
    inputs = file.text_list("/entry/inputs/names")
    sources = {name: read_source(file, f"/entry/inputs/{name}") for name in inputs}
    numbers = [file.require_scalar(f"{path}/scan", "dimensionless") for path in paths]
    scans = _read_scans(file, paths, numbers, sources)
    profiles = tuple(
        _read_profile(file, path, scans[int(number) - 1])
        for path, number in zip(paths, numbers, strict=True)
    )
    accepted = accepted_alterations(file.source)
    process = groups.read_process(file)
    return MeasuredStress(
        profiles=profiles,
        scans=scans,
        **read_record(records.CONVERSION.read_in(scans[0].reading), file, "/entry/sensor"),
        checks=groups.read_quality(file),
        overridden=(*file.text_list("/entry/overridden"), *accepted),
        process=replace(process, messages=(*override_messages(accepted), *process.messages)),
        artifact=sources.get("artifact"),
        artifact_digest=file.optional_text("/entry/sensor/content_sha256"),
    )


def write_stress(measured: MeasuredStress, path: FilePath, *, overwrite: bool = False) -> None:
    """Write measured stress as a memscal-stress file, whole or not at all."""
    root = writer.file_tree(writer.STRESS_SCHEMA, _entry(measured))
    writer.write_tree(root, path, overwrite=overwrite)


def profile_paths(file: SafeFile) -> list[str]:
    """Return the paths of the groups that hold a profile each; none in another schema's file."""
    return [f"/entry/{name}" for name in file.text_list("/entry/profiles")]


def _entry(measured: MeasuredStress) -> Group:
    profiles = {}
    for i, profile in enumerate(measured.profiles, 1):
        profiles[f"profile_{i}"] = _profile_group(profile, measured.scans)
    scans = {}
    sources = {"artifact": measured.artifact}
    for i, scan in enumerate(measured.scans, 1):
        parts = {
            "sample": groups.sample_group(scan),
            "indenter": groups.indenter_group(scan.indenter, scan),
            "instrument": groups.instrument_group(scan),
            **write_record(records.MEASURED_SCAN, scan).children,
        }
        scans[f"scan_{i}"] = Group("NXcollection", parts)
        sources[f"scan_{i}"] = scan.source
    inputs = {name: write_source(s) for name, s in sources.items() if s}
    # Of the first scan; each states its own beside it, with its lubrication and stage.
    first = replace(measured.scans[0], lubrication="", stage=Equipment())
    sensor = first.sensor.name
    digest = measured.artifact_digest
    digests = {"content_sha256": digest} if digest else {}
    children: Nodes = {
        "title": f"Stress measured by {sensor}" if sensor else "Measured stress",
        "profiles": to_json(list(profiles)),
        **profiles,
        **_parts_of_profiles(measured.profiles),
        "sensor": write_record(records.CONVERSION.read_in(first.reading), measured, **digests),
        "quality": groups.quality_group(measured.checks),
        "overridden": to_json(measured.overridden),
        "sample": groups.sample_group(first),
        "instrument": groups.instrument_group(first),
        "indenter": groups.indenter_group(first.indenter),
        "scans": groups.named_collection(scans),
        "inputs": groups.named_collection(inputs),
        "process": write_record(records.PROCESS, measured.process),
    }
    return Group("NXentry", children, {"default": [*profiles][-1]})


def _profile_group(profile: MeasuredProfile, scans: tuple[MeasuredScan, ...]) -> Group:
    record = records.STRESS_NUMBERS.read_in(profile.scan.reading)
    stated = {q.name: getattr(profile, q.name, None) for q in record.quantities}
    # A line does not determine its centre across it.
    for i, name in enumerate(("centre", "centre_y")):
        if i == 0 or profile.centre_uncertainty[i] > 0:
            stated[name] = profile.centre[i]
            stated[f"{name}_uncertainty"] = profile.centre_uncertainty[i]
    numbers = dict(write_record(record, stated).children)
    # What not every profile has comes last.
    optional = {name: numbers.pop(name) for name in _NOT_ALWAYS if name in numbers}
    number = writer.count(scans.index(profile.scan) + 1)
    if profile.direction:
        optional |= write_record(records.SLID, profile).children
    return write_record(records.STRESS_PROFILE, profile, scan=number, **numbers, **optional)


def _parts_of_profiles(profiles: Sequence[MeasuredProfile]) -> dict[str, Group]:
    """Return roots of covariances, budgets, fitted curves and points of all profiles."""
    # Apart from the profiles: programs that read NeXus take a NXdata within another for its signal.
    parts: dict[str, Nodes] = defaultdict(dict)
    for i, profile in enumerate(profiles, 1):
        name = f"profile_{i}"
        budget = {"force": profile.force_budget, "maximum": profile.maximum_budget}
        parts["roots"][name] = _roots_group(profile)
        parts["budgets"][name] = groups.budget_group(budget, _BUDGET)
        if profile.curve_r.size:
            parts["curves"][name] = write_record(records.STRESS_CURVE, profile)
        for channel, points in profile.points.items():
            record = points_record(channel).read_in(profile.scan.reading)
            parts[f"points_{channel}"][name] = write_record(record, points)
    return {part: Group("NXcollection", by_profile) for part, by_profile in parts.items()}


def _roots_group(profile: MeasuredProfile) -> Group:
    children: Nodes = {
        "sources": to_json(list(profile.roots)),
        "r": si(profile.r, "length", ("r",)),
    }
    for source, root in profile.roots.items():
        axes = ("r", f"column_{source}")[: root.ndim]
        children[f"root_{source}"] = si(root, "stress", axes)
        if root.ndim > 1:
            children[axes[1]] = writer.index_axis(axes[1], root.shape[1])
    return Group("NXcollection", children)


def _part_of_profile(file: SafeFile, group: str, name: str, within: str) -> str:
    """Return where a part of a profile stands: version 1.0 held it within the profile."""
    path = f"/entry/{group}/{name}"
    return path if file.has(path) else within


def _root_of(covariance: FloatArray, where: str) -> FloatArray:
    """Return a square root of a covariance, of as many columns as its rank."""
    scale = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    unit = np.divide(1.0, scale, out=np.zeros_like(scale), where=scale > 0)
    with np.errstate(over="ignore", invalid="ignore"):
        correlation = covariance * unit * unit[:, None]
    if np.abs(correlation).max() <= 1 + _ROUNDING and not covariance[scale == 0].any():
        if not (correlation - np.diag(np.diag(correlation))).any():
            return scale
        values, vectors = np.linalg.eigh(correlation)
        if values[0] > -_ROUNDING * values[-1]:
            kept = values > _ROUNDING * values[-1]
            return np.asarray(scale[:, None] * vectors[:, kept] * np.sqrt(values[kept]))
    raise FormatError(f"{where} is no covariance: some combination has less than no variance.")


def _read_roots(file: SafeFile, name: str, path: str, n: int) -> Arrays:
    """Read the roots of a profile's covariance; of a file before them, those of its matrices."""
    where = f"/entry/roots/{name}"
    prefix = "root_"
    dimension = "stress"
    as_matrices = not file.has(where)
    if as_matrices:
        where = _part_of_profile(file, "covariances", name, path)
        prefix = "covariance_"
        dimension = "stress squared"
    roots = {}
    for source in file.text_list(f"{where}/sources"):
        place = f"{where}/{prefix}{source}"
        stored = file.require_array(place, dimension)
        shape = (n, n) if as_matrices else (n, *stored.shape[1:2])
        if stored.shape != shape or not stored.size or not np.isfinite(stored).all():
            raise FormatError(f"{file.where(place)} should hold finite numbers in {n} rows.")
        roots[source] = _root_of(stored, file.where(place)) if as_matrices else stored
    return roots


def _read_profile(file: SafeFile, path: str, scan: MeasuredScan) -> MeasuredProfile:
    arrays = read_record(records.STRESS_PROFILE, file, path)
    n = arrays["r"].size
    name = path.rpartition("/")[2]
    roots = _read_roots(file, name, path, n)
    budget = groups.read_budget(file, _part_of_profile(file, "budgets", name, f"{path}/budget"))
    if not roots or not budget.keys() >= _BUDGET.keys():
        raise FormatError(
            f"{file.where(path)} states no covariance of its stress, or no budget.",
            why="Measured stress without uncertainty means little.",
        )
    profile = {"y": np.zeros(n), "load_uncertainty": None} | arrays
    profile |= read_record(records.STRESS_NUMBERS.read_in(scan.reading), file, path)
    profile |= read_record(records.SLID, file, path)
    curve = _part_of_profile(file, "curves", name, f"{path}/curve")
    if file.has(curve):
        profile |= read_record(records.STRESS_CURVE, file, curve)
    for end in ("", "_uncertainty"):
        across = profile.get(f"centre_y{end}", 0.0)
        profile[f"centre{end}"] = np.array([profile[f"centre{end}"], across])
    # What follows from the others is stored for other programs.
    fields = MeasuredProfile.__dataclass_fields__
    return MeasuredProfile(
        scan=scan,
        **{name: value for name, value in profile.items() if name in fields},
        roots=roots,
        force_budget=budget["force"],
        maximum_budget=budget["maximum"],
        points=_read_points(file, name, scan.reading),
    )
