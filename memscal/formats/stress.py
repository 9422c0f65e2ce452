"""memscal-stress: the stress that a calibrated sensor measured, load by load, as HDF5."""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence

import numpy as np

from memscal.errors import FormatError
from memscal.formats.groups import (
    budget_group,
    indenter_group,
    instrument_group,
    process_group,
    quality_group,
    read_budget,
    read_film,
    read_process,
    read_quality,
    read_round_indenter,
    read_sensor,
    sample_group,
)
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.formats.hdf5.writer import Group, Node, count, file_tree, index_axis, si, write_tree
from memscal.formats.json_text import to_json
from memscal.formats.schema import STRESS_SCHEMA
from memscal.formats.values import (
    altered,
    json_value,
    optional_array,
    optional_scalar,
    optional_text,
    require_array,
    require_scalar,
    require_schema,
    require_text,
)
from memscal.model.arrays import FloatArray
from memscal.model.measured_stress import (
    MeasuredPoints,
    MeasuredProfile,
    MeasuredScan,
    MeasuredStress,
)
from memscal.model.provenance import SourceFile

__all__ = [
    "points_groups",
    "profile_paths",
    "read_points",
    "read_scans",
    "read_stress",
    "scans_group",
    "stress_from",
    "write_stress",
]

_CHANNELS = ("zz", "xz", "yz")
_POINT = ("point",)
_PAIRS = ("point", "point_prime")


def points_groups(points: Mapping[str, MeasuredPoints]) -> dict[str, Node]:
    """Return the points of each channel as an NXdata of its own: ``points_zz`` and so on."""
    return {f"points_{channel}": _points_group(channel, p) for channel, p in points.items()}


def read_points(file: SafeFile, path: str) -> dict[str, MeasuredPoints]:
    """Read the points of each channel of a profile; none of a file of version 1.0."""
    return {
        channel: _read_channel(file, f"{path}/points_{channel}", f"u_{channel}")
        for channel in _CHANNELS
        if file.has(f"{path}/points_{channel}")
    }


def _points_group(channel: str, points: MeasuredPoints) -> Group:
    u = f"u_{channel}"
    children: dict[str, Node] = {
        "point": index_axis("point", points.u.size),
        "x": si(points.x, "length", _POINT),
        "y": si(points.y, "length", _POINT),
        "position_errors": si(points.x_errors, "length", _POINT),
        u: si(points.u, "voltage", _POINT),
        "outlier_weight": si(points.weight, "dimensionless", _POINT),
        "normal_load": si(points.load, "force", _POINT),
        "normal_load_errors": si(points.load_errors, "force", _POINT),
    }
    if points.noise is not None:
        children[f"{u}_errors"] = si(points.noise, "voltage", _POINT)
    if points.correlation is not None:
        children["point_prime"] = index_axis("point_prime", points.u.size)
        children[f"{u}_correlation"] = si(points.correlation, "dimensionless", _PAIRS)
    return Group("NXdata", children, {"signal": u, "axes": _POINT})


def _read_channel(file: SafeFile, path: str, u: str) -> MeasuredPoints:
    voltage = require_array(file, f"{path}/{u}", "voltage", ndim=1)
    n = voltage.size

    def shaped(name: str, values: FloatArray | None, shape: tuple[int, ...]) -> FloatArray | None:
        if values is not None and values.shape != shape:
            raise FormatError(
                f"{file.where(path)}/{name} has shape {values.shape}, but {u} gives {shape}."
            )
        return values

    def array(name: str, dimension: str) -> FloatArray:
        values = require_array(file, f"{path}/{name}", dimension)
        shaped(name, values, (n,))
        return values

    noise, correlation = f"{u}_errors", f"{u}_correlation"
    return MeasuredPoints(
        x=array("x", "length"),
        y=array("y", "length"),
        x_errors=array("position_errors", "length"),
        u=voltage,
        noise=shaped(noise, optional_array(file, f"{path}/{noise}", "voltage"), (n,)),
        weight=array("outlier_weight", "dimensionless"),
        load=array("normal_load", "force"),
        load_errors=array("normal_load_errors", "force"),
        correlation=shaped(
            correlation, optional_array(file, f"{path}/{correlation}", "dimensionless"), (n, n)
        ),
    )


def scans_group(scans: Sequence[MeasuredScan]) -> Group:
    """Return what was scanned as an NXcollection, one group for each scan."""
    groups: dict[str, Node] = {f"scan_{i + 1}": _scan_group(scan) for i, scan in enumerate(scans)}
    return Group("NXcollection", {"names": to_json("scans", list(groups)), **groups})


def read_scans(
    file: SafeFile, paths: Sequence[str], numbers: Sequence[int], sources: Mapping[str, SourceFile]
) -> tuple[MeasuredScan, ...]:
    """Read what was scanned."""
    stored = json_value(file, "/entry/scans/names", list, None)
    known = max(numbers) if stored is None else len(stored)
    if max(numbers) > known:
        raise FormatError(
            f"{file.where('/entry')}: a profile comes from scan {max(numbers)} of {known}.",
            cure="Run memscal apply again.",
        )
    if stored is None:
        # A file of version 1.0 states film, indenter and sensor once, for all scans.
        path_of = dict(zip(reversed(numbers), reversed(paths), strict=True))
        return tuple(
            _old_scan(file, path_of.get(i, paths[0]), sources.get(f"scan_{i}"))
            for i in range(1, known + 1)
        )
    return tuple(
        _read_scan(file, f"/entry/scans/{name}", sources.get(str(name))) for name in stored
    )


def _scan_group(scan: MeasuredScan) -> Group:
    children: dict[str, Node] = {
        "sample": sample_group(scan.film, {"lubrication": scan.lubrication}),
        "indenter": indenter_group(scan.indenter),
        "instrument": instrument_group(scan.sensor),
        "width": si(scan.width, "length"),
        "synthetic": count(int(scan.synthetic)),
    }
    if scan.position_scale_uncertainty is not None:
        children["position_scale_errors"] = si(scan.position_scale_uncertainty, "dimensionless")
    return Group("NXcollection", children)


def _read_scan(file: SafeFile, path: str, source: SourceFile | None) -> MeasuredScan:
    return MeasuredScan(
        film=read_film(file, f"{path}/sample/film"),
        indenter=read_round_indenter(file, f"{path}/indenter"),
        sensor=read_sensor(file, f"{path}/instrument/stress_sensor"),
        width=require_scalar(file, f"{path}/width", "length"),
        lubrication=optional_text(file, f"{path}/sample/lubrication"),
        position_scale_uncertainty=optional_scalar(
            file, f"{path}/position_scale_errors", "dimensionless"
        ),
        synthetic=bool(require_scalar(file, f"{path}/synthetic", "dimensionless")),
        source=source,
    )


def _old_scan(file: SafeFile, profile: str, source: SourceFile | None) -> MeasuredScan:
    x, y = (require_array(file, f"{profile}/{name}", "length") for name in ("x", "y"))
    return MeasuredScan(
        film=read_film(file, "/entry/sample/film"),
        indenter=read_round_indenter(file, "/entry/indenter"),
        sensor=read_sensor(file, "/entry/instrument/stress_sensor"),
        width=float(np.hypot(np.ptp(x), np.ptp(y))),
        lubrication=optional_text(file, f"{profile}/lubrication"),
        source=source,
    )


_BUDGET = {"force": "force", "maximum": "stress"}
_PREFIX = "covariance_"
_MOST_SCANS = 10_000
# The covariance's second axis has its own name: netCDF tools want each dimension once.
_AXES = ("r", "r_prime")


def read_stress(path: str | os.PathLike[str]) -> MeasuredStress:
    """Read measured stress from a memscal-stress file.

    Parameters
    ----------
    path : path
        The file; units in it are converted to SI.

    Returns
    -------
    MeasuredStress
        Equal to what was saved.  A file of version 1.0 holds no measured points.

    Raises
    ------
    FormatError, UnitError, UnsafeFileError, SchemaVersionError
        If the file does not hold measured stress that this version can read, or was changed
        since it was written (its content digest no longer fits).
    """
    with open_hdf5(path) as file:
        return stress_from(file)


def stress_from(file: SafeFile) -> MeasuredStress:
    """Read the measured stress of an open memscal-stress file."""
    require_schema(file, STRESS_SCHEMA)
    problem = altered(file)
    if problem:
        raise FormatError(
            f"{file.name} was changed after it was written: {problem}",
            why="Measured stress is used only as it was measured.",
            cure="Get the original file, or run memscal apply again.",
        )
    paths = profile_paths(file)
    if not paths:
        raise FormatError(
            f"{file.where('/entry/profiles')} names no profile.",
            why="It lists the groups that hold one.",
        )
    sources = _read_sources(file)
    numbers = [_scan_number(file, path) for path in paths]
    scans = read_scans(file, paths, numbers, sources)
    return MeasuredStress(
        profiles=tuple(
            _read_profile(file, path, scans[number - 1])
            for path, number in zip(paths, numbers, strict=True)
        ),
        scans=scans,
        conversion_constant=require_scalar(
            file, "/entry/sensor/conversion_constant", "voltage per stress"
        ),
        conversion_constant_uncertainty=require_scalar(
            file, "/entry/sensor/conversion_constant_errors", "voltage per stress"
        ),
        checks=read_quality(file, "/entry/quality"),
        overridden=tuple(str(text) for text in json_value(file, "/entry/overridden", list, [])),
        process=read_process(file, "/entry/process"),
        artifact=sources.get("artifact"),
        artifact_digest=optional_text(file, "/entry/sensor/content_sha256"),
    )


def write_stress(
    measured: MeasuredStress, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write measured stress as a memscal-stress file, whole or not at all."""
    write_tree(file_tree(STRESS_SCHEMA, _entry(measured)), path, overwrite=overwrite)


def profile_paths(file: SafeFile) -> list[str]:
    """Return the paths of the groups that hold a profile each; none in another schema's file."""
    return [f"/entry/{name}" for name in json_value(file, "/entry/profiles", list, [])]


def _entry(measured: MeasuredStress) -> Group:
    names = [f"profile_{i + 1}" for i in range(len(measured.profiles))]
    first = measured.scans[0]
    sensor = first.sensor.name
    a, u_a = measured.conversion_constant, measured.conversion_constant_uncertainty
    used: dict[str, Node] = {
        "conversion_constant": si(a, "voltage per stress"),
        "conversion_constant_errors": si(u_a, "voltage per stress"),
    }
    if measured.artifact_digest:
        used["content_sha256"] = measured.artifact_digest
    children: dict[str, Node] = {
        "title": f"Stress measured by {sensor}" if sensor else "Measured stress",
        "profiles": to_json("profiles", names),
        **{
            name: _profile_group(profile, measured.scans)
            for name, profile in zip(names, measured.profiles, strict=True)
        },
        "sensor": Group("NXcollection", used),
        "quality": quality_group(measured.checks),
        "overridden": to_json("overridden", list(measured.overridden)),
        # Those of the first scan; each scan states its own beside them.
        "sample": sample_group(first.film),
        "instrument": instrument_group(first.sensor),
        "indenter": indenter_group(first.indenter),
        "scans": scans_group(measured.scans),
        "inputs": _inputs_group(measured),
        "process": process_group(measured.process),
    }
    return Group("NXentry", children, {"default": names[-1]})


def _inputs_group(measured: MeasuredStress) -> Group:
    sources = {"artifact": measured.artifact}
    sources |= {f"scan_{i + 1}": scan.source for i, scan in enumerate(measured.scans)}
    groups: dict[str, Node] = {
        name: Group(
            "NXnote",
            {"file_name": source.file_name, "checksum": source.sha256, "algorithm": "sha256"},
        )
        for name, source in sources.items()
        if source is not None
    }
    return Group("NXcollection", {"names": to_json("inputs", list(groups)), **groups})


def _read_sources(file: SafeFile) -> dict[str, SourceFile]:
    return {
        str(name): SourceFile(
            require_text(file, f"/entry/inputs/{name}/file_name"),
            require_text(file, f"/entry/inputs/{name}/checksum"),
        )
        for name in json_value(file, "/entry/inputs/names", list, [])
    }


def _scan_number(file: SafeFile, path: str) -> int:
    """Which scan a profile comes from, counted from one."""
    number = require_scalar(file, f"{path}/scan", "dimensionless")
    if not 1 <= number <= _MOST_SCANS:
        raise FormatError(
            f"{file.where(path)}/scan is {number:g}.",
            why=f"Scans are counted from 1 to {_MOST_SCANS} at most.",
            cure="Run memscal apply again.",
        )
    return int(number)


def _profile_group(profile: MeasuredProfile, scans: tuple[MeasuredScan, ...]) -> Group:
    centre, spread = profile.centre, profile.centre_uncertainty
    children: dict[str, Node] = {
        "r": si(profile.r, "length", ("r",)),
        "r_prime": si(profile.r, "length", ("r_prime",)),
        "x": si(profile.x, "length", ("r",)),
        "y": si(profile.y, "length", ("r",)),
        "s_zz": si(profile.s_zz, "stress", ("r",)),
        "s_zz_errors": si(profile.s_zz_errors, "stress", ("r",)),
        "covariance": si(profile.covariance, "stress squared", _AXES),
        "sources": to_json("sources", list(profile.covariances)),
        **{
            _PREFIX + source: si(values, "stress squared", _AXES)
            for source, values in profile.covariances.items()
        },
        "scan": count(scans.index(profile.scan) + 1),
        "load": si(profile.load, "force"),
        "force": si(profile.force, "force"),
        "force_errors": si(profile.force_uncertainty, "force"),
        "maximum": si(profile.maximum, "stress"),
        "maximum_errors": si(profile.maximum_uncertainty, "stress"),
        "centre": si(centre[0], "length"),
        "centre_errors": si(spread[0], "length"),
        "baseline": si(profile.baseline, "voltage"),
        "baseline_errors": si(profile.baseline_uncertainty, "voltage"),
        "contact_radius": si(profile.contact_radius, "length"),
        "budget": budget_group(
            {"force": profile.force_budget, "maximum": profile.maximum_budget}, _BUDGET
        ),
        **points_groups(profile.points),
    }
    if spread[1] > 0:
        children["centre_y"] = si(centre[1], "length")
        children["centre_y_errors"] = si(spread[1], "length")
    if profile.load_uncertainty is not None:
        children["load_errors"] = si(profile.load_uncertainty, "force")
    if profile.lubrication:
        children["lubrication"] = profile.lubrication
    if profile.curve_r.size:
        curve: dict[str, Node] = {
            "r": si(profile.curve_r, "length", ("r",)),
            "s_zz": si(profile.curve_s_zz, "stress", ("r",)),
        }
        children["curve"] = Group("NXdata", curve, {"signal": "s_zz", "axes": ("r",)})
    return Group("NXdata", children, {"signal": "s_zz", "axes": ("r",)})


def _read_profile(file: SafeFile, path: str, scan: MeasuredScan) -> MeasuredProfile:
    def number(name: str, dimension: str) -> float:
        return require_scalar(file, f"{path}/{name}", dimension)

    def array(name: str, dimension: str, shape: tuple[int, ...]) -> FloatArray:
        values = require_array(file, f"{path}/{name}", dimension)
        if values.shape != shape:
            raise FormatError(
                f"{file.where(path)}/{name} has shape {values.shape}, but r gives {shape}."
            )
        return values

    def along(first: str, second: str) -> FloatArray:
        # A line does not tell where its centre lies across it.
        across = optional_scalar(file, f"{path}/{second}", "length")
        return np.array([number(first, "length"), across or 0.0])

    r = require_array(file, f"{path}/r", "length", ndim=1)
    n = r.size
    stored = json_value(file, f"{path}/sources", list, [])
    covariances: Mapping[str, FloatArray] = {
        str(source): array(f"{_PREFIX}{source}", "stress squared", (n, n)) for source in stored
    }
    budget = read_budget(file, f"{path}/budget")
    if not covariances or not budget.keys() >= _BUDGET.keys():
        raise FormatError(
            f"{file.where(path)} states no covariance of its stress, or no budget.",
            why="Measured stress without uncertainty means little.",
        )
    y = optional_array(file, f"{path}/y", "length", ndim=1)
    curve_r = optional_array(file, f"{path}/curve/r", "length", ndim=1)
    m = 0 if curve_r is None else curve_r.size
    return MeasuredProfile(
        scan=scan,
        load=number("load", "force"),
        load_uncertainty=optional_scalar(file, f"{path}/load_errors", "force"),
        r=r,
        x=array("x", "length", (n,)),
        y=np.zeros(n) if y is None else y,
        s_zz=array("s_zz", "stress", (n,)),
        covariances=covariances,
        force=number("force", "force"),
        force_budget=budget["force"],
        maximum=number("maximum", "stress"),
        maximum_budget=budget["maximum"],
        centre=along("centre", "centre_y"),
        centre_uncertainty=along("centre_errors", "centre_y_errors"),
        baseline=number("baseline", "voltage"),
        baseline_uncertainty=number("baseline_errors", "voltage"),
        contact_radius=number("contact_radius", "length"),
        curve_r=np.zeros(0) if curve_r is None else curve_r,
        curve_s_zz=array("curve/s_zz", "stress", (m,)) if m else np.zeros(0),
        points=read_points(file, path),
    )
