"""What a file of measured stress holds of the scans: their points, and what was scanned."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from memscal.errors import FormatError
from memscal.formats.fields import (
    json_value,
    optional_array,
    optional_scalar,
    optional_text,
    require_array,
    require_scalar,
)
from memscal.formats.hdf5_reader import SafeFile
from memscal.formats.json_text import to_json
from memscal.formats.parts import (
    indenter_group,
    instrument_group,
    read_film,
    read_round_indenter,
    read_sensor,
    sample_group,
)
from memscal.formats.tree import Group, Node, count, index_axis, si
from memscal.model.measured_stress import MeasuredPoints, MeasuredScan
from memscal.model.provenance import SourceFile
from memscal.model.validation import FloatArray

__all__ = ["points_groups", "read_points", "read_scans", "scans_group"]

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
    """Read what was scanned.

    Parameters
    ----------
    file : SafeFile
        A file of measured stress.
    paths, numbers : sequence
        The groups of the profiles, and which scan each comes from, counted from one.
    sources : mapping of str to SourceFile
        The scans' files by name (``scan_1``), where they are stated.
    """
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
