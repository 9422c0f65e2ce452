"""memscal-artifact: the apparatus function with all that it rests on, as HDF5."""

from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from memscal.errors import FormatError
from memscal.formats import groups
from memscal.formats.digest import require_schema, require_unaltered
from memscal.formats.files import FilePath
from memscal.formats.groups import read_record, write_record
from memscal.formats.hdf5.reader import SafeFile
from memscal.formats.hdf5.writer import ARTIFACT_SCHEMA, Group, file_tree, si, to_json, write_tree
from memscal.formats.units import reading_of
from memscal.model import records
from memscal.model.apparatus import (
    ApparatusData,
    ApparatusField,
    ApparatusRadial,
    OtherEstimate,
    Reconvolution,
    TransferFunction,
    round_wavenumbers,
)
from memscal.model.arrays import Arrays
from memscal.model.notation import Reading

#: A compact artifact has none.
_PLANE = "/entry/apparatus_function"
_CHANGES = "/entry/kernel_changes"
_EFFECTS = "/entry/shared_effects"


def artifact_from(file: SafeFile) -> ApparatusData:
    """Read the apparatus function of an open memscal-artifact file; refuse one that was changed."""
    require_schema(file, ARTIFACT_SCHEMA)
    require_unaltered(file)
    load = read_record(records.LOAD, file, "/entry/indenter", defaults={"load": None})["load"]
    process = groups.read_process(file)
    u_zz = "/entry/reconvolution/u_zz"
    reading = reading_of(file.units_of(u_zz) or "V", file.where(u_zz))
    reading = replace(reading, per=str(process.configuration.get("reference_unit", "Pa")))
    plane = None
    if file.has(_PLANE):
        plane = ApparatusField(**read_record(records.FIELD, file, _PLANE))
    transfer = read_record(records.TRANSFER, file, "/entry/transfer_function")
    reconvolution = records.RECONVOLUTION.read_in(reading)
    return ApparatusData(
        plane=plane,
        radial_profile=_read_radial(file, "/entry/radial_profile", "/entry/radial_covariance"),
        transfer=TransferFunction(**transfer),
        reconvolution=Reconvolution(**read_record(reconvolution, file, "/entry/reconvolution")),
        parameters=groups.read_parameters(file, "/entry/parameters", reading),
        budget=groups.read_budget(file, "/entry/parameters/budget"),
        checks=groups.read_quality(file),
        **groups.read_circumstances(file),
        load=load,
        reference=groups.read_profile(file, load=load),
        process=process,
        kernel_changes=_read_changes(file),
        shared_effects=_read_effects(file),
        assumptions=groups.read_assumptions(file),
        other=_read_other(file, reading),
    )


def write_artifact(data: ApparatusData, path: FilePath, *, overwrite: bool = False) -> None:
    """Write an apparatus function as a memscal-artifact file; the same data, the same bytes."""
    write_tree(artifact_tree(data), path, overwrite=overwrite)


def artifact_tree(data: ApparatusData) -> Group:
    """Return what a memscal-artifact file holds; its root states the content digest."""
    sensor = f" of {data.sensor.name}" if data.sensor.name else ""
    a = ", with a relative A (no load was known)" if data.reading.relative else ""
    reconvolution = records.RECONVOLUTION.read_in(data.reading)
    children = {
        "title": f"Apparatus function{sensor}{a}",
        "radial_profile": write_record(records.RADIAL, data.radial_profile),
        "radial_covariance": write_record(records.RADIAL_COVARIANCE, data.radial_profile),
        "transfer_function": write_record(records.TRANSFER, data.transfer),
        "reconvolution": write_record(reconvolution, data.reconvolution),
        "parameters": groups.parameter_group(data.parameters, data.budget),
        "quality": groups.quality_group(data.checks),
        "sample": groups.sample_group(data),
        "instrument": groups.instrument_group(data),
        **groups.circumstances(data),
        "indenter": groups.indenter_group(data.indenter, data),
        **groups.profile_groups(data.reference),
        "process": write_record(records.PROCESS, data.process),
    }
    if data.assumptions:
        children["assumptions"] = groups.assumption_group(data.assumptions)
    if data.kernel_changes:
        stated = {"kernel_changes": np.stack(list(data.kernel_changes.values()))}
        radii = si(data.radial_profile.r, "length", ("r",))
        group = write_record(records.KERNEL_CHANGES, stated, r=radii)
        children["kernel_changes"] = _with_names(group, data.kernel_changes)
    if data.shared_effects:
        table = np.stack(list(data.shared_effects.values()))
        effects = {
            "k": round_wavenumbers(data.resolved_wavenumber),
            "of_a": table[:, 0],
            "of_sigma": table[:, 1],
            "of_transfer": table[:, 2:],
        }
        group = write_record(records.SHARED_EFFECTS, effects)
        children["shared_effects"] = _with_names(group, data.shared_effects)
    if data.other is not None:
        name = "bayesian" if data.other.method == "bayesian" else "division"
        radial = data.other.radial_profile
        children |= {
            f"radial_profile_{name}": write_record(records.RADIAL, radial),
            f"radial_covariance_{name}": write_record(records.RADIAL_COVARIANCE, radial),
            f"parameters_{name}": groups.parameter_group(data.other.parameters, {}),
        }
    default = "radial_profile"
    if data.plane is not None:
        default = "apparatus_function"
        children[default] = write_record(records.FIELD, data.plane)
    return file_tree(ARTIFACT_SCHEMA, Group("NXentry", children, {"default": default}))


def _with_names(group: Group, names: Iterable[str]) -> Group:
    return replace(group, children={"names": to_json(list(names)), **group.children})


def _read_effects(file: SafeFile) -> Arrays:
    """Read what calibrations share, which artifacts before version 1.2 do not state."""
    names = file.text_list(f"{_EFFECTS}/names")
    if not names:
        return {}
    read = read_record(records.SHARED_EFFECTS, file, _EFFECTS, sizes={"source": len(names)})
    table = np.column_stack([read["of_a"], read["of_sigma"], read["of_transfer"]])
    return dict(zip(names, table, strict=True))


def _read_changes(file: SafeFile) -> Arrays:
    names = file.text_list(f"{_CHANGES}/names")
    if not names:
        return {}
    sizes = {"input": len(names), "r": file.array("/entry/radial_profile/r").size}
    read = read_record(records.KERNEL_CHANGES, file, _CHANGES, sizes=sizes)["kernel_changes"]
    return dict(zip(names, read, strict=True))


def _read_other(file: SafeFile, reading: Reading) -> OtherEstimate | None:
    """Read the estimate by the route that was not chosen; a division is one by white noise."""
    for route, method in (("bayesian", "bayesian"), ("division", "white-noise")):
        places = [f"/entry/{name}_{route}" for name in ("radial_profile", "radial_covariance")]
        if file.has(places[0]):
            parameters = groups.read_parameters(file, f"/entry/parameters_{route}", reading)
            return OtherEstimate(method, parameters, _read_radial(file, *places))
    return None


def _read_radial(file: SafeFile, path: str, covariance_path: str) -> ApparatusRadial:
    """Read G(r) with its covariance, which a file of version 1.0 holds in the same group."""
    if not file.has(covariance_path):
        return ApparatusRadial(**read_record(records.RADIAL_VERSION_1_0, file, path))
    profile = read_record(records.RADIAL, file, path)
    sizes = {"r": profile["r"].size}
    covariance = read_record(records.RADIAL_COVARIANCE, file, covariance_path, sizes=sizes)
    if not np.allclose(covariance["r"], profile["r"], rtol=1e-9, atol=0):
        raise FormatError(
            f"{file.where(covariance_path)}/r differs from {path}/r.",
            why="The covariance is that of the profile, radius by radius.",
            cure="Write the file again.",
        )
    return ApparatusRadial(**profile, g_covariance=covariance["g_covariance"])
