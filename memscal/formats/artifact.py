"""memscal-artifact: the apparatus function with all that it rests on, as HDF5."""

from __future__ import annotations

import os

from memscal.errors import FormatError
from memscal.formats.fields import (
    require_array,
    require_scalar,
    require_schema,
)
from memscal.formats.hdf5_reader import SafeFile, open_hdf5
from memscal.formats.hdf5_writer import file_tree, write_tree
from memscal.formats.parameters import parameter_group, read_budget, read_parameters
from memscal.formats.parts import (
    indenter_group,
    instrument_group,
    profile_groups,
    read_film,
    read_profile,
    read_round_indenter,
    read_sensor,
    sample_group,
)
from memscal.formats.process import process_group, quality_group, read_process, read_quality
from memscal.formats.schema import ARTIFACT_SCHEMA
from memscal.formats.tree import Group, Node, si
from memscal.formats.verify import altered
from memscal.model.apparatus import (
    ApparatusData,
    ApparatusField,
    ApparatusRadial,
    Reconvolution,
    TransferFunction,
)
from memscal.model.validation import FloatArray

__all__ = ["artifact_tree", "read_artifact", "write_artifact"]

_RECONVOLUTION = ("u_zz", "u_zz_errors", "u_zz_predicted", "u_zz_gaussian", "residual")


def read_artifact(path: str | os.PathLike[str]) -> ApparatusData:
    """Read an apparatus function from a memscal-artifact file.

    Parameters
    ----------
    path : path
        The file; units in it are converted to SI.

    Returns
    -------
    ApparatusData

    Raises
    ------
    FormatError, UnitError, UnsafeFileError, SchemaVersionError
        If the file does not hold an apparatus function that this version can read, or was
        changed since it was written (its content digest no longer fits).
    """
    with open_hdf5(path) as file:
        return artifact_from(file)


def artifact_from(file: SafeFile) -> ApparatusData:
    """Read the apparatus function of an open memscal-artifact file."""
    require_schema(file, ARTIFACT_SCHEMA)
    problem = altered(file)
    if problem:
        raise FormatError(
            f"{file.name} was changed after it was written: {problem}",
            why="An apparatus function is used only as its calibration left it.",
            cure="Get the original file, or run the calibration again.",
        )
    load = require_scalar(file, "/entry/indenter/load", "force")
    film = read_film(file, "/entry/sample/film")
    indenter = read_round_indenter(file, "/entry/indenter")
    parts = ("/entry/reference", "/entry/reference_parameters", "/entry/reference_process")
    return ApparatusData(
        field=_read_field(file, "/entry/apparatus_function"),
        radial_profile=_read_radial(file, "/entry/radial_profile"),
        transfer=_read_transfer(file, "/entry/transfer_function"),
        reconvolution=_read_reconvolution(file, "/entry/reconvolution"),
        parameters=read_parameters(file, "/entry/parameters"),
        budget=read_budget(file, "/entry/parameters/budget"),
        checks=read_quality(file, "/entry/quality"),
        film=film,
        indenter=indenter,
        sensor=read_sensor(file, "/entry/instrument/stress_sensor"),
        load=load,
        reference=read_profile(file, *parts, load=load, film=film, indenter=indenter),
        process=read_process(file, "/entry/process"),
    )


def write_artifact(
    data: ApparatusData, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write an apparatus function as a memscal-artifact file, whole or not at all.

    The same data give the same bytes; the only time in the file is ``data.process.date``.

    Parameters
    ----------
    data : ApparatusData
        What the calibration found.
    path : path
        The file.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    OutputError
        If the file exists or cannot be written.
    InputError
        If the data hold a name that is no name, or a value without a known unit.
    """
    write_tree(artifact_tree(data), path, overwrite=overwrite)


def artifact_tree(data: ApparatusData) -> Group:
    """Return what a memscal-artifact file holds; its root states the content digest."""
    return file_tree(ARTIFACT_SCHEMA, _entry(data))


def _entry(data: ApparatusData) -> Group:
    reference, parameters, process = profile_groups(data.reference)
    sensor = data.sensor.name
    children: dict[str, Node] = {
        "title": f"Apparatus function of {sensor}" if sensor else "Apparatus function",
        "apparatus_function": _field_group(data.field),
        "radial_profile": _radial_group(data.radial_profile),
        "transfer_function": _transfer_group(data.transfer),
        "reconvolution": _reconvolution_group(data.reconvolution),
        "parameters": parameter_group(data.parameters, data.budget),
        "quality": quality_group(data.checks),
        "sample": sample_group(data.film),
        "instrument": instrument_group(data.sensor),
        "indenter": indenter_group(data.indenter, data.load),
        "reference": reference,
        "reference_parameters": parameters,
        "reference_process": process,
        "process": process_group(data.process),
    }
    return Group("NXentry", children, {"default": "apparatus_function"})


def _field_group(field: ApparatusField) -> Group:
    axes = ("y", "x")
    children: dict[str, Node] = {
        "y": si(field.y, "length", ("y",)),
        "x": si(field.x, "length", ("x",)),
        "g": si(field.g, "per area", axes),
        "g_errors": si(field.g_errors, "per area", axes),
    }
    return Group("NXdata", children, {"signal": "g", "axes": axes})


def _read_field(file: SafeFile, path: str) -> ApparatusField:
    x = require_array(file, f"{path}/x", "length", ndim=1)
    y = require_array(file, f"{path}/y", "length", ndim=1)
    shape = (y.size, x.size)
    return ApparatusField(
        x=x,
        y=y,
        g=_shaped(file, f"{path}/g", "per area", shape),
        g_errors=_shaped(file, f"{path}/g_errors", "per area", shape),
    )


def _radial_group(radial: ApparatusRadial) -> Group:
    # The covariance's second axis has its own name: netCDF tools want each dimension once.
    children: dict[str, Node] = {
        "r": si(radial.r, "length", ("r",)),
        "r_prime": si(radial.r, "length", ("r_prime",)),
        "g": si(radial.g, "per area", ("r",)),
        "g_errors": si(radial.g_errors, "per area", ("r",)),
        "g_gaussian": si(radial.g_gaussian, "per area", ("r",)),
        "g_covariance": si(radial.g_covariance, "per area squared", ("r", "r_prime")),
    }
    if radial.conversion_correlation is not None:
        correlation = si(radial.conversion_correlation, "dimensionless", ("r",))
        children["conversion_correlation"] = correlation
    return Group("NXdata", children, {"signal": "g", "axes": ("r",)})


def _read_radial(file: SafeFile, path: str) -> ApparatusRadial:
    r = require_array(file, f"{path}/r", "length", ndim=1)
    return ApparatusRadial(
        r=r,
        g=_shaped(file, f"{path}/g", "per area", r.shape),
        g_errors=_shaped(file, f"{path}/g_errors", "per area", r.shape),
        g_gaussian=_shaped(file, f"{path}/g_gaussian", "per area", r.shape),
        g_covariance=_shaped(file, f"{path}/g_covariance", "per area squared", (r.size, r.size)),
        conversion_correlation=_correlation(file, f"{path}/conversion_correlation", r.size),
    )


def _correlation(file: SafeFile, path: str, size: int) -> FloatArray | None:
    return _shaped(file, path, "dimensionless", (size,)) if file.has(path) else None


def _transfer_group(transfer: TransferFunction) -> Group:
    axes = ("k",)
    children: dict[str, Node] = {
        "k": si(transfer.k, "wavenumber", axes),
        "modulus": si(transfer.modulus, "dimensionless", axes),
        "modulus_errors": si(transfer.modulus_errors, "dimensionless", axes),
        "window": si(transfer.window, "dimensionless", axes),
        "resolved_wavenumber": si(transfer.resolved_wavenumber, "wavenumber"),
    }
    return Group("NXdata", children, {"signal": "modulus", "axes": axes})


def _read_transfer(file: SafeFile, path: str) -> TransferFunction:
    k = require_array(file, f"{path}/k", "wavenumber", ndim=1)
    return TransferFunction(
        k=k,
        modulus=_shaped(file, f"{path}/modulus", "dimensionless", k.shape),
        modulus_errors=_shaped(file, f"{path}/modulus_errors", "dimensionless", k.shape),
        window=_shaped(file, f"{path}/window", "dimensionless", k.shape),
        resolved_wavenumber=require_scalar(file, f"{path}/resolved_wavenumber", "wavenumber"),
    )


def _reconvolution_group(reconvolution: Reconvolution) -> Group:
    children: dict[str, Node] = {"x": si(reconvolution.x, "length", ("x",))}
    for name in _RECONVOLUTION:
        children[name] = si(getattr(reconvolution, name), "voltage", ("x",))
    return Group("NXdata", children, {"signal": "u_zz", "axes": ("x",)})


def _read_reconvolution(file: SafeFile, path: str) -> Reconvolution:
    x = require_array(file, f"{path}/x", "length", ndim=1)
    fields = {n: _shaped(file, f"{path}/{n}", "voltage", x.shape) for n in _RECONVOLUTION}
    return Reconvolution(x=x, **fields)


def _shaped(file: SafeFile, path: str, dimension: str, shape: tuple[int, ...]) -> FloatArray:
    values = require_array(file, path, dimension)
    if values.shape != shape:
        raise FormatError(
            f"{file.where(path)} has shape {values.shape}, but its axes give {shape}.",
            cure="Write the file again.",
        )
    return values
