"""memscal-array: an array of sensors with all that it rests on, as HDF5.

The records of its groups stand in ``files.toml``.
"""

import tomllib
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from memscal.errors import FormatError
from memscal.extensions.arrays.array_data import RADII, ArrayData, ArrayReadings, KernelModes
from memscal.formats import groups
from memscal.formats.digest import require_schema, require_unaltered
from memscal.formats.files import FilePath
from memscal.formats.groups import read_record, write_record
from memscal.formats.hdf5.reader import SafeFile
from memscal.formats.hdf5.writer import ARRAY_SCHEMA, Group, Nodes, file_tree, write_tree
from memscal.formats.units import reading_of
from memscal.model import records
from memscal.model.arrays import TINY, Values
from memscal.model.instrument import StressSensor
from memscal.model.quantities import Quantity, Record, record

_U_ZZ = "/entry/reconvolution/u_zz"


def _declared(nx_class: str, signal: str, quantities: list[Values]) -> Record:
    rows = [Quantity(**{**row, "axes": tuple(row.get("axes", ()))}) for row in quantities]
    return record(nx_class, *rows, signal=signal)


_TABLES = tomllib.loads(Path(__file__).with_name("files.toml").read_text(encoding="utf-8"))
RECORDS = {name: _declared(**table) for name, table in _TABLES.items()}
"""Records of the groups of the file, by their names."""
LAYOUT = {f"/entry/{name}": of for name, of in RECORDS.items()}
"""The same by their paths, for ``memscal check`` and ``memscal inspect``."""

#: The transform of G is 1 at zero within this, at the smallest wavenumber.
_UNIT = 0.1

_PARTS = ("of_ln_a", "of_x", "of_y", "of_c", "of_mode")


def write_array(data: ArrayData, path: FilePath, *, overwrite: bool = False) -> None:
    """Write an array as a memscal-array file; the same data, the same bytes."""
    stated = stated_in_file(data)
    of: Any = SimpleNamespace(**data.stated(), sensor=StressSensor())
    children: Nodes = {
        "title": f"Array of {len(data.sensors)} sensors",
        **{name: write_record(r.read_in(data.reading), stated) for name, r in RECORDS.items()},
        "quality": groups.quality_group(data.checks),
        "sample": groups.sample_group(of),
        "instrument": groups.instrument_group(of),
        **groups.circumstances(of),
        "indenter": groups.indenter_group(data.indenter, data),
        "process": write_record(records.PROCESS, data.process),
    }
    entry = Group("NXentry", children, {"default": "sensors"})
    write_tree(file_tree(ARRAY_SCHEMA, entry), path, overwrite=overwrite)


def stated_in_file(data: ArrayData) -> Values:
    """Return what the groups hold, by the names of their records."""
    deviation = np.sqrt(np.diag(data.noise))
    radii = RADII * np.fmax.reduce(data.gaussian_sigmas, initial=0.0)
    stated = {
        **data.stated(),
        **vars(data.modes),
        **vars(data.readings),
        **dict(zip(_PARTS, data.split(data.columns), strict=True)),
        "inputs": list(data.effects),
        "reference_unit": data.reading.per,
        "conversion_constants_errors": np.sqrt(np.diag(data.covariance)),
        "gaussian_sigmas_errors": np.linalg.norm(data.sigma_columns, axis=1),
        "crosstalk_errors": data.crosstalk_uncertainties,
        "deviation": deviation,
        "correlation": data.noise / np.maximum(np.outer(deviation, deviation), TINY),
        "r": radii,
        "g": data.radial(np.nan_to_num(data.kernels).T, radii).T,
    }
    stated["centre_x"], stated["centre_y"] = data.centres.T
    stated["centre_x_errors"], stated["centre_y_errors"] = data.centre_uncertainties.T
    if data.layout is not None:
        stated["layout_x"], stated["layout_y"] = data.layout.T
    return stated


def read_open(file: SafeFile) -> ArrayData:
    """Read the array of an open memscal-array file; refuse one that was changed."""
    require_schema(file, ARRAY_SCHEMA)
    require_unaltered(file)
    reading = reading_of(file.units_of(_U_ZZ) or "V", file.where(_U_ZZ))
    names = tuple(file.text_list("/entry/sensors/names"))
    sizes = {"sensor": len(names)}
    read: Values = {}
    for path, of in LAYOUT.items():
        read |= read_record(of.read_in(reading), file, path, sizes=sizes)
    columns = np.vstack([read[part] for part in _PARTS])
    opened = columns.shape[1] - len(read["inputs"])
    if {"layout_x", "layout_y"} <= read.keys():
        read["layout"] = np.column_stack([read["layout_x"], read["layout_y"]])
    read |= {
        **groups.read_circumstances(file),
        "sensors": names,
        "used": read["used"] > 0,
        "centres": np.column_stack([read["centre_x"], read["centre_y"]]),
        "estimated": read["estimated"] > 0,
        "noise": read["correlation"] * np.outer(read["deviation"], read["deviation"]),
        "modes": KernelModes(read["changes"], read["owner"]),
        "root": columns[:, :opened],
        "effects": dict(zip(read["inputs"], columns.T[opened:], strict=True)),
        "readings": ArrayReadings(**{n: read[n] for n in ArrayReadings.__dataclass_fields__}),
        "load": file.require_scalar("/entry/indenter/load", "force"),
        "reading": replace(reading, per=read["reference_unit"]),
        "checks": groups.read_quality(file),
        "process": groups.read_process(file),
    }
    data = ArrayData(**{n: read[n] for n in read.keys() & ArrayData.__dataclass_fields__.keys()})
    faults = list(_faults(data))
    if [*map(len, data.split(data.columns)[3:])] != [len(read["of_c"]), len(read["changes"])]:
        faults.append("roots are of other pairs or modes than there are")
    if faults:
        raise FormatError(
            f"{file.name} is of no calibration: {', '.join(faults)}.",
            cure="Calibrate the array again.",
        )
    return data


def _faults(data: ArrayData) -> Iterator[str]:
    """Yield what of an array no calibration has found."""
    used = data.used
    if not used.any():
        yield "no sensor is used"
        return
    if len({*data.sensors, ""}) <= used.size:
        yield "sensors have the same name, or none"
    # A line tells one of x and y of each sensor, and of none the other one.
    told = np.isfinite(data.centres[used])
    if len(np.unique(told, axis=0)) > 1 or not np.isfinite(data.line_y):
        yield "some centres are not known"
    if len(np.unique(data.places[used], axis=0)) < used.sum():
        yield "sensors are at one place"
    kernel = np.fmax.reduce(data.kernels)
    reference = 0.0 * kernel if data.reference is None else data.reference
    numbers = np.vstack([data.k, kernel, data.modes.changes, reference])
    if not np.isfinite(numbers).all() or not np.isfinite(data.columns).all():
        yield "kernels or roots are not finite"
    if np.any(np.diff(data.k) <= 0) or not np.all(abs(data.modes.owner + 0.5) < used.size):
        yield "wavenumbers do not increase, or a mode has no sensor"
    a = data.conversion_constants[used]
    if data.kernel != "measured" and not np.all((a > 0) & np.isfinite(a)):
        yield "conversion constants are not finite and above zero"
    if data.kernel != "measured" and abs(kernel[0] - 1) > _UNIT:
        yield "G does not integrate to 1"
    crosstalk = data.crosstalk[np.ix_(used, used)]
    if not np.isfinite(crosstalk).all() or np.any(np.diag(crosstalk) != 1):
        yield "crosstalk is not finite, or not 1 of a sensor with itself"
    noise = np.nan_to_num(data.noise[np.ix_(used, used)], posinf=0.0)
    if np.linalg.eigvalsh(noise).min() <= 0:
        yield "noise is no covariance"
