"""memscal-scan: the sensor's voltage against the indenter's position, as HDF5."""

from __future__ import annotations

import contextlib
import os
import shutil
import tempfile
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

from memscal.errors import FormatError, OutputError
from memscal.formats.files import ensure_writable
from memscal.formats.groups import (
    indenter_group,
    instrument_group,
    parameter_dimension,
    profile_groups,
    read_film,
    read_profile,
    read_round_indenter,
    read_sensor,
    sample_group,
)
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.formats.hdf5.writer import (
    Group,
    Node,
    Number,
    file_tree,
    index_axis,
    note,
    si,
    write_tree,
)
from memscal.formats.json_text import to_json
from memscal.formats.schema import SCAN_SCHEMA
from memscal.formats.values import (
    any_scalar,
    json_value,
    optional_array,
    optional_scalar,
    optional_text,
    require_array,
    require_scalar,
    require_schema,
)
from memscal.model.scan import Scan

__all__ = ["ensure_folder_writable", "read_scan", "write_scan", "write_scans"]

_CHANNELS = ("u_xz", "u_xz_errors", "u_yz", "u_yz_errors")
_DATA = "/entry/data"
_SAMPLE = "/entry/sample"
_AXES = {"line": ("x",), "repeats": ("repeat", "x"), "raster": ("y", "x")}
_ALONG_Y = {"line": ("y",), "repeats": ("repeat", "y")}
_POINTS = ("point",)
# One name for each axis of the correlation: netCDF tools want each dimension once.
_PAIRS = ("point", "point_prime")
_SYNTHETIC = (
    "The data of this file are synthetic: calculated from the known truth below, not measured."
)


def read_scan(path: str | os.PathLike[str]) -> Scan:
    """Read a scan from a memscal-scan file.

    Parameters
    ----------
    path : path
        The file; units in it are converted to SI.

    Returns
    -------
    Scan
        With ``source`` naming the file and its SHA-256.

    Raises
    ------
    FormatError, UnitError, UnsafeFileError, SchemaVersionError
        If the file does not hold a scan that this version can read; the message names the
        file and the HDF5 path.

    Examples
    --------
    >>> import tempfile
    >>> from memscal.model.film import ElasticFilm
    >>> from memscal.model.indenter import Rod
    >>> film = ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> scan = Scan(x=[-1e-3, 0, 1e-3], u_zz=[1e-3, 3e-3, 1e-3], load=1.0,
    ...             indenter=Rod(radius=0.25e-3), film=film)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_scan(scan, f"{folder}/scan.h5")
    ...     read_scan(f"{folder}/scan.h5").u_zz
    array([0.001, 0.003, 0.001])
    """
    with open_hdf5(path) as file:
        return scan_from(file)


def scan_from(file: SafeFile) -> Scan:
    """Read the scan of an open memscal-scan file."""
    require_schema(file, SCAN_SCHEMA)
    load = require_scalar(file, "/entry/indenter/load", "force")
    film = read_film(file, f"{_SAMPLE}/film")
    indenter = read_round_indenter(file, "/entry/indenter")
    axes = _check_axes(file)
    only_y = axes == _POINTS and not file.has(f"{_DATA}/x")
    along_y = only_y or axes in _ALONG_Y.values()
    along = "y" if along_y else "x"
    channels = {
        name: require_array(file, f"{_DATA}/{name}", "voltage")
        for name in _CHANNELS
        if file.has(f"{_DATA}/{name}")
    }
    reference = None
    if file.has("/entry/reference"):
        parts = ("/entry/reference", "/entry/reference_parameters", "/entry/reference_process")
        reference = read_profile(file, *parts, load=load, film=film, indenter=indenter)
    return Scan(
        x=require_array(file, f"{_DATA}/{along}", "length", ndim=1),
        y=None if along_y else optional_array(file, f"{_DATA}/y", "length", ndim=1),
        repeat=file.array(f"{_DATA}/repeat") if _numbered(file, axes) else None,
        x_errors=optional_array(file, f"{_DATA}/{along}_errors", "length", ndim=1),
        direction=along,
        position_scale_uncertainty=optional_scalar(
            file, f"{_DATA}/position_scale_errors", "dimensionless"
        ),
        u_zz=require_array(file, f"{_DATA}/u_zz", "voltage"),
        u_zz_errors=optional_array(file, f"{_DATA}/u_zz_errors", "voltage"),
        u_zz_correlation=optional_array(file, f"{_DATA}/u_zz_correlation", "dimensionless", ndim=2),
        normal_load=optional_array(file, f"{_DATA}/normal_load", "force"),
        normal_load_errors=optional_array(file, f"{_DATA}/normal_load_errors", "force"),
        channels=channels,
        load=load,
        load_uncertainty=optional_scalar(file, "/entry/indenter/load_errors", "force"),
        indenter=indenter,
        film=film,
        lubrication=optional_text(file, f"{_SAMPLE}/lubrication").strip().lower(),
        lubricant=optional_text(file, f"{_SAMPLE}/lubricant"),
        sensor=read_sensor(file, "/entry/instrument/stress_sensor"),
        title=optional_text(file, "/entry/title"),
        start_time=optional_text(file, "/entry/start_time"),
        end_time=optional_text(file, "/entry/end_time"),
        notes=optional_text(file, "/entry/notes/data"),
        reference=reference,
        synthetic=_read_synthetic(file),
        source=file.source,
    )


def write_scan(scan: Scan, path: str | os.PathLike[str], *, overwrite: bool = False) -> None:
    """Write a scan as a memscal-scan file, whole or not at all.

    Parameters
    ----------
    scan : Scan
        The scan; its ``source`` is not written.
    path : path
        The file.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    OutputError
        If the file exists or cannot be written.
    """
    write_tree(file_tree(SCAN_SCHEMA, _entry(scan)), path, overwrite=overwrite)


def _entry(scan: Scan) -> Group:
    texts = {"title": scan.title, "start_time": scan.start_time, "end_time": scan.end_time}
    children: dict[str, Node] = {name: text for name, text in texts.items() if text}
    children["data"] = _data_group(scan)
    children["indenter"] = indenter_group(scan.indenter, scan.load, scan.load_uncertainty)
    contact = {"lubrication": scan.lubrication, "lubricant": scan.lubricant}
    children["sample"] = sample_group(scan.film, contact)
    children["instrument"] = instrument_group(scan.sensor)
    if scan.notes:
        children["notes"] = note(scan.notes)
    if scan.reference is not None:
        data, parameters, process = profile_groups(scan.reference)
        children["reference"] = data
        children["reference_parameters"] = parameters
        children["reference_process"] = process
    if scan.synthetic is not None:
        children["synthetic"] = _synthetic_group(scan.synthetic)
    return Group("NXentry", children, {"default": "data"})


def _data_group(scan: Scan) -> Group:
    along, points = scan.direction, scan.kind == "points"
    axes = _POINTS if points else (_ALONG_Y if along == "y" else _AXES)[scan.kind]
    data: dict[str, Node] = {}
    if points:
        data["point"] = index_axis("point", scan.x.size)
    if scan.y is not None:
        data["y"] = si(scan.y, "length", axes if points else ("y",))
    if scan.repeat is not None:
        data["repeat"] = Number(scan.repeat, "1", axes)
    elif scan.kind == "repeats":
        data["repeat"] = index_axis("repeat", scan.u_zz.shape[0])
    data[along] = si(scan.x, "length", axes if points else (along,))
    if scan.x_errors is not None:
        data[f"{along}_errors"] = si(scan.x_errors, "length", axes if points else (along,))
    if scan.position_scale_uncertainty is not None:
        data["position_scale_errors"] = si(scan.position_scale_uncertainty, "dimensionless")
    data["u_zz"] = si(scan.u_zz, "voltage", axes)
    if scan.u_zz_correlation is not None:
        for axis in _PAIRS:
            data[axis] = index_axis(axis, scan.u_zz_correlation.shape[0])
        data["u_zz_correlation"] = si(scan.u_zz_correlation, "dimensionless", _PAIRS)
    if scan.u_zz_errors is not None:
        data["u_zz_errors"] = si(scan.u_zz_errors, "voltage", axes)
    if scan.normal_load is not None:
        data["normal_load"] = si(scan.normal_load, "force", axes)
    if scan.normal_load_errors is not None:
        data["normal_load_errors"] = si(scan.normal_load_errors, "force", axes)
    for name, values in scan.channels.items():
        data[name] = si(values, "voltage", axes)
    return Group("NXdata", data, {"signal": "u_zz", "axes": axes})


def _check_axes(file: SafeFile) -> tuple[str, ...] | None:
    """Return the axes: a square raster with them swapped would pass every other test."""
    axes = file.attribute(_DATA, "axes")
    if isinstance(axes, str):
        axes = tuple(axes.replace(":", " ").replace(",", " ").split())
    if axes is None:
        return None
    if axes not in (_POINTS, *_AXES.values(), *_ALONG_Y.values()):
        raise FormatError(
            f"{file.where(_DATA)}@axes is {axes}.",
            why="A scan is stored along [x], [repeat, x], [y], [repeat, y], [y, x] (a raster) or "
            "[point].",
            cure="Transpose the data, or correct the attribute.",
        )
    if axes != _POINTS and ("y" in axes) != file.has(f"{_DATA}/y"):
        stated = "names y, but there is no" if "y" in axes else "does not name y, but there is a"
        raise FormatError(
            f"{file.where(_DATA)}@axes {stated} {_DATA}/y.",
            why="Without it a raster and a repeated line scan look the same.",
            cure="Add the missing axis, or correct the attribute.",
        )
    return axes


def _numbered(file: SafeFile, axes: tuple[str, ...] | None) -> bool:
    """Whether each point has the number of its pass; else ``repeat`` only counts rows."""
    return axes == _POINTS and file.has(f"{_DATA}/repeat")


def _synthetic_group(truth: Mapping[str, float | str]) -> Group:
    children: dict[str, Node] = {"description": _SYNTHETIC}
    for name, value in truth.items():
        if isinstance(value, str):
            children[name] = value
        else:
            children[name] = si(value, parameter_dimension(name))
    children["names"] = to_json("names of the synthetic truth", list(truth))
    return Group("NXcollection", children)


def _read_synthetic(file: SafeFile) -> dict[str, Any] | None:
    path = "/entry/synthetic"
    if not file.is_group(path):
        return None
    truth: dict[str, Any] = {}
    for name in json_value(file, f"{path}/names", list, []):
        item = f"{path}/{name}"
        truth[str(name)] = file.text(item) if file.is_text(item) else any_scalar(file, item)[0]
    return truth


def ensure_folder_writable(
    folder: str | os.PathLike[str], names: Iterable[str], *, overwrite: bool
) -> None:
    """Prove that files of these names can be written in a folder, which need not exist yet."""
    target = Path(folder)
    if not target.exists() and not target.is_symlink():
        ensure_writable(target)
        return
    if not target.is_dir():
        raise OutputError(
            f"The output {target} is not a folder.",
            why="An experiment is several scans, each a file of its own.",
            cure="Give the name of a folder; a new one is made.",
        )
    for name in names:
        ensure_writable(target / name, overwrite=overwrite)


def write_scans(
    scans: Mapping[str, Scan], folder: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write scans as memscal-scan files of one folder, all of them or none.

    All are written whole under other names first, and only then take their own.
    """
    target = Path(folder)
    ensure_folder_writable(target, tuple(scans), overwrite=overwrite)
    made = not target.exists()
    staging: str | None = None
    try:
        target.mkdir(exist_ok=True)
        staging = tempfile.mkdtemp(prefix=".memscal-", dir=target)
        for name, scan in scans.items():
            write_scan(scan, Path(staging, name))
        for name in scans:
            os.replace(Path(staging, name), target / name)
    except OSError as error:
        raise OutputError(
            f"The output {target} cannot be written: {error.strerror}.",
            cure="Choose another folder.",
        ) from error
    finally:
        if staging is not None:
            shutil.rmtree(staging, ignore_errors=True)
        if made:
            # Of a folder that holds the scans this takes nothing away.
            with contextlib.suppress(OSError):
                target.rmdir()
