"""Groups that several files share, and the codec that writes, reads and lists declared records."""

import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import asdict, replace
from types import MappingProxyType
from typing import Any

import numpy as np

from memscal.errors import FormatError, InputError, UnitError, placed
from memscal.formats.hdf5 import writer
from memscal.formats.hdf5.reader import SafeFile
from memscal.formats.hdf5.writer import Attributes, Group, Node, Nodes, Number, si, to_json
from memscal.formats.units import dimension_of, from_si, to_si
from memscal.model import records
from memscal.model.apparatus import ApparatusData, ParameterSet
from memscal.model.arrays import Values, value_record
from memscal.model.assumptions import Assumption
from memscal.model.checks import QualityCheck, QualityChecks, messages_from_json
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Cone, Indenter, Profile, Rod, RoundIndenter, Sphere
from memscal.model.instrument import Dynamics, Equipment, LoadCell, StressSensor, User
from memscal.model.measured_stress import MeasuredScan
from memscal.model.notation import VOLTS, Reading
from memscal.model.provenance import Process, SourceFile
from memscal.model.quantities import (
    DIMENSIONS,
    TRUTH,
    Quantity,
    Record,
    dimension_with,
    estimated_quantity,
)
from memscal.model.scan import Scan
from memscal.model.stress import IdealReference, StressField, StressProfile

_NOTHING: Mapping[str, Any] = MappingProxyType({})
_MeasuredOn = Scan | ApparatusData | MeasuredScan

Budget = Mapping[str, Mapping[str, float]]
"""Standard uncertainties by source, of each quantity."""


@value_record
class Kind:
    """How a quantity that is no number is written (no empty text) and read."""

    write: Callable[[Quantity, Any], Node]
    read: Callable[[SafeFile, str], Any]
    inside: str = ""


def _write_json_note(quantity: Quantity, value: Any) -> Group:
    text = to_json(value, quantity.name)
    return writer.note(text, media_type="application/json", description=quantity.words)


def write_source(source: SourceFile) -> Group:
    """Return the name and the checksum of a file that was read as an NXnote."""
    named = {"file_name": source.file_name, "checksum": source.sha256, "algorithm": "sha256"}
    return Group("NXnote", named)


def read_source(file: SafeFile, path: str) -> SourceFile:
    """Read the name and the checksum of a file that was read."""
    return SourceFile(file.text(f"{path}/file_name"), file.text(f"{path}/checksum"))


KINDS = {
    "text": Kind(lambda _, text: str(text), SafeFile.text),
    "names": Kind(lambda _, names: to_json(names), SafeFile.text_list),
    "note": Kind(lambda _, text: writer.note(text), SafeFile.text, inside="/data"),
    "truth": Kind(
        lambda _, truth: writer.count(truth),
        lambda file, path: bool(file.require_scalar(path, "dimensionless")),
    ),
    "mapping": Kind(_write_json_note, lambda file, path: file.json_value(path, dict, {}), "/data"),
    "messages": Kind(
        lambda quantity, messages: _write_json_note(quantity, [*map(asdict, messages)]),
        lambda file, path: messages_from_json(file.json_value(path, list, [])),
        "/data",
    ),
    "file": Kind(lambda _, source: write_source(source), read_source),
}
"""Kinds of quantity beside the numbers, by :attr:`Quantity.dimension`."""


def write_record(record: Record, stated: object, **others: Node) -> Group:
    """Return the group of what an object or a mapping states; other axes count from 0."""
    children: Nodes = {}
    keys = {quantity.key for quantity in record.quantities}
    for quantity in record.quantities:
        name = quantity.name
        value = stated.get(name) if isinstance(stated, Mapping) else getattr(stated, name, None)
        kind = KINDS.get(quantity.dimension)
        if value is None:
            continue
        if kind is None:
            for axis, size in zip(quantity.axes, np.shape(value), strict=True):
                if axis not in keys:
                    children.setdefault(axis, writer.index_axis(axis, size))
            children[quantity.key] = si(value, quantity.dimension, quantity.axes)
            if quantity.of is not None:
                value_of = quantity.key.removesuffix("_errors")
                children.setdefault(value_of, si(quantity.of, quantity.dimension))
        elif value != "":
            children[quantity.key] = kind.write(quantity, value)
    plot: Attributes = {"signal": record.signal, "axes": record.axes}
    return Group(record.nx_class, children | others, plot if record.signal else {})


def read_record(
    record: Record,
    file: SafeFile,
    path: str,
    *,
    defaults: Mapping[str, Any] = _NOTHING,
    sizes: Mapping[str, int] = _NOTHING,
) -> dict[str, Any]:
    """Return the values at a path, in SI units, by name; ``sizes`` are of axes known before."""
    values = dict(defaults)
    lengths = dict(sizes)
    for at, quantity in _paths(record, path):
        if file.has(at) or (quantity.required and quantity.name not in defaults):
            values[quantity.name] = _read(file, at, quantity, lengths)
    return values


def listed(record: Record, file: SafeFile, path: str) -> Iterator[tuple[str, Quantity]]:
    """Yield the path of each quantity that a file holds, with its declaration."""
    return ((at, quantity) for at, quantity in _paths(record, path) if file.has(at))


def _paths(record: Record, path: str) -> Iterator[tuple[str, Quantity]]:
    """Yield where each quantity stands; an attribute that is stored twice is read once."""
    names = set()
    for quantity in record.quantities:
        if quantity.name not in names:
            names.add(quantity.name)
            kind = KINDS.get(quantity.dimension)
            yield f"{path}/{quantity.key}{kind.inside if kind else ''}", quantity


def _read(file: SafeFile, at: str, quantity: Quantity, lengths: dict[str, int]) -> Any:
    kind = KINDS.get(quantity.dimension)
    if kind is not None:
        return kind.read(file, at)
    if not quantity.axes:
        return file.require_scalar(at, quantity.dimension)
    values = file.require_array(at, quantity.dimension, ndim=len(quantity.axes))
    axes = [axis.removesuffix("_prime") for axis in quantity.axes]
    shape = tuple(map(lengths.setdefault, axes, values.shape))
    if values.shape != shape:
        raise FormatError(
            f"{file.where(at)} has shape {values.shape}, but its axes give {shape}.",
            cure="Write the file again.",
        )
    return values


def origins(file: SafeFile, paths: Iterable[tuple[str, Quantity]]) -> Values:
    """Return the origin of a file as its quantities state it, by their names; JSON notes last."""
    texts: Values = {}
    notes = {}
    for at, quantity in paths:
        value = KINDS[quantity.dimension].read(file, at)
        name = quantity.origin
        if isinstance(value, SourceFile):
            texts |= {name: value.file_name, f"{name}_sha256": value.sha256}
        elif isinstance(value, str):
            texts[name] = value
        else:
            messages = quantity.dimension == "messages"
            notes[name] = [item.text for item in value] if messages else value
    return texts | notes


# One name for each axis of the covariance: netCDF tools need each dimension once.
_AXES = ("parameter", "parameter_prime")
_COVARIANCE = (
    "Covariance of the numbers, in the order of names: each parameter in the unit of its dataset."
)


def parameter_dimension(name: str, unit: str = "", reading: Reading = VOLTS) -> str:
    """Return the dimension of a parameter: by its SI unit where that is given, else by its name."""
    known = [declared for declared in TRUTH if name == declared or name.startswith(f"{declared}_")]
    if known and (not unit or reading != VOLTS):
        # The longest name that the parameter's begins with.
        return TRUTH[max(known, key=len)].read_in(reading).dimension
    if unit:
        dimension = dimension_with(unit, reading)
        return dimension if dimension in DIMENSIONS else dimension_of(unit, f"parameter {name}")
    raise InputError(
        f"The unit of {name} is not known.",
        why="Every number in a file carries its unit.",
        cure=f"Begin its name with one of {', '.join(TRUTH)}, or give the SI unit of a parameter "
        "in ParameterSet(units=...).",
    )


def parameter_group(parameters: ParameterSet, budget: Budget) -> Group:
    """Return the parameters as an NXcollection."""
    stated = parameters.units or ("",) * len(parameters.names)
    dimensions = {
        name: parameter_dimension(name, unit, parameters.reading)
        for name, unit in zip(parameters.names, stated, strict=True)
    }
    reserved = {"names", "covariance", "budget", *_AXES}.intersection(parameters.names)
    if reserved:
        raise InputError(
            f"A parameter cannot be called {min(reserved)}.",
            why="The group of the parameters holds something else of that name.",
            cure="Give it another name.",
        )
    children: Nodes = {"names": to_json(parameters.names)}
    for name, dimension in dimensions.items():
        children[name] = si(parameters[name], dimension)
        children[f"{name}_errors"] = si(parameters.uncertainty(name), dimension)
    children |= {axis: writer.index_axis(axis, len(parameters.names)) for axis in _AXES}
    scale = np.array([from_si(1.0, dimension)[0] for dimension in dimensions.values()])
    numbers = parameters.covariance * scale[:, None] * scale
    children["covariance"] = Number(numbers, "1", _AXES, {"description": _COVARIANCE})
    if budget:
        children["budget"] = budget_group(budget, dimensions)
    return Group("NXcollection", children)


def read_parameters(file: SafeFile, path: str, reading: Reading) -> ParameterSet:
    """Read the parameters, in SI units."""
    names = tuple(file.text_list(f"{path}/names"))
    if not names or len(set(names)) != len(names):
        raise FormatError(
            f"{file.where(path)}/names is missing or names a parameter twice.",
            why="It lists the parameters, in the order of their covariance.",
        )
    values = []
    units = []
    scales = []
    for name in names:
        estimated_quantity(name).read_in(reading)  # enters its unit
        at = f"{path}/{name}"
        value, si_unit = file.any_scalar(at)
        values.append(value)
        units.append(si_unit)
        stored = file.units_of(at) or "1"
        where = file.where(at)
        scales.append(to_si(1.0, stored, dimension_of(stored, where), where))
    covariance = file.require_array(f"{path}/covariance", "dimensionless", ndim=2)
    if covariance.shape != (len(names), len(names)):
        raise FormatError(
            f"{file.where(path)}/covariance has shape {covariance.shape} with names: {len(names)}."
        )
    scale = np.array(scales)
    return ParameterSet(
        names=names,
        values=np.array(values),
        covariance=covariance * scale[:, None] * scale,
        units=tuple(units),
        reading=reading,
    )


def named_collection(children: Mapping[str, Node]) -> Group:
    """Return nodes as an NXcollection; ``names`` keeps their order."""
    return Group("NXcollection", {"names": to_json(list(children)), **children})


def budget_group(budget: Budget, dimensions: Mapping[str, str]) -> Group:
    """Return the uncertainty budget: one group per quantity, one number per source."""
    children = {}
    for quantity, sources in budget.items():
        dimension = dimensions.get(quantity) or parameter_dimension(quantity)
        numbers = {source: si(value, dimension) for source, value in sources.items()}
        children[quantity] = named_collection(numbers)
    return named_collection(children)


def read_budget(file: SafeFile, path: str) -> Budget:
    """Read the uncertainty budget, in SI units; empty where there is none."""
    budget = {}
    for quantity in file.text_list(f"{path}/names"):
        group = f"{path}/{quantity}"
        sources = file.text_list(f"{group}/names")
        budget[quantity] = {name: file.any_scalar(f"{group}/{name}")[0] for name in sources}
    return budget


_ROUND: dict[str, type[RoundIndenter]] = {shape.shape: shape for shape in (Rod, Sphere)}


def read_film(file: SafeFile, path: str) -> ElasticFilm:
    """Read a film."""
    with placed(file.where(path)):
        return ElasticFilm(**read_record(records.FILM, file, path))


#: NeXus has samples and sensors say what moves them: nothing here, the indenter moves.
_NOWHERE = {"depends_on": "."}


def sample_group(of: _MeasuredOn) -> Group:
    """Return the NXsample that holds the film, and how it was lubricated."""
    children: Nodes = {}
    if of.film is not None:
        children["film"] = write_record(records.FILM, of.film)
    children |= write_record(records.SAMPLE, of).children
    return Group("NXsample", children | _NOWHERE)


def indenter_group(indenter: Indenter | None, of: object = _NOTHING) -> Group:
    """Return an indenter as an NXcollection, with the load and friction that ``of`` states."""
    children: Nodes = {} if indenter is None else {"shape": indenter.shape}
    if isinstance(indenter, Profile):
        children["face"] = write_record(records.INDENTER_FACE, indenter)
    elif indenter is not None:
        round_or_cone = records.CONE if isinstance(indenter, Cone) else records.ROUND_INDENTER
        children |= write_record(round_or_cone, indenter).children
    children |= write_record(records.LOAD, of).children
    return Group("NXcollection", children)


def read_indenter(file: SafeFile, path: str) -> Indenter:
    """Read an indenter."""
    shape = _shape(file, path)
    if shape == Cone.shape:
        return Cone(**read_record(records.CONE, file, path))
    if shape == Profile.shape:
        return Profile(**read_record(records.INDENTER_FACE, file, f"{path}/face"))
    return read_round_indenter(file, path)


def read_round_indenter(file: SafeFile, path: str) -> RoundIndenter:
    """Read a rod or a sphere, the indenters of a scan."""
    shape = _shape(file, path)
    if shape not in _ROUND:
        raise FormatError(
            f'{file.where(path)}/shape is "{shape}".',
            why="A scan is made with a flat rod or with a sphere.",
            cure='Write "rod" or "sphere".',
        )
    return _ROUND[shape](**read_record(records.ROUND_INDENTER, file, path))


def _shape(file: SafeFile, path: str) -> str:
    return file.text(f"{path}/shape").strip().lower()


def instrument_group(of: _MeasuredOn) -> Group:
    """Return the NXinstrument that holds the sensor, and load cell and stage if they are stated."""
    dynamics = {}
    if of.sensor.dynamics is not None:
        dynamics["dynamics"] = write_record(records.DYNAMICS, of.sensor.dynamics)
    parts = {"stress_sensor": write_record(records.SENSOR, of.sensor, **dynamics, **_NOWHERE)}
    if of.load_cell != LoadCell():
        parts["load_cell"] = write_record(records.LOAD_CELL, of.load_cell, **_NOWHERE)
    if of.stage != Equipment():
        parts["stage"] = write_record(records.STAGE, of.stage, **_NOWHERE)
    return Group("NXinstrument", parts)


def read_instrument(file: SafeFile, path: str = "/entry") -> Values:
    """Read sensor, load cell and stage, by these names; what is not stated stays empty."""
    sensor_path = f"{path}/instrument/stress_sensor"
    sensor = read_record(records.SENSOR, file, sensor_path)
    dynamics_path = f"{sensor_path}/dynamics"
    if file.has(dynamics_path):
        with placed(file.where(dynamics_path)):
            sensor["dynamics"] = Dynamics(**read_record(records.DYNAMICS, file, dynamics_path))
    return {
        "sensor": StressSensor(**sensor),
        "load_cell": LoadCell(
            **read_record(records.LOAD_CELL, file, f"{path}/instrument/load_cell")
        ),
        "stage": Equipment(**read_record(records.STAGE, file, f"{path}/instrument/stage")),
    }


def circumstances(of: Scan | ApparatusData) -> Nodes:
    """Return when and by whom a scan was made, for the entry of a scan or an artifact."""
    entry = dict(write_record(records.TIMES, of).children)
    if of.user != User():
        entry["user"] = write_record(records.USER, of.user)
    return entry


def read_circumstances(file: SafeFile) -> Values:
    """Read what was pressed on what, where it is stated, when, by whom, and with what."""
    film = "/entry/sample/film"
    indenter = "/entry/indenter"
    stated = any(file.has(f"{indenter}/{name}") for name in ("shape", "radius"))
    return {
        "film": read_film(file, film) if file.has(film) else None,
        "indenter": read_round_indenter(file, indenter) if stated else None,
        **read_instrument(file),
        "user": User(**read_record(records.USER, file, "/entry/user")),
        **read_record(records.TIMES, file, "/entry"),
    }


def profile_groups(profile: StressProfile, prefix: str = "reference_") -> Nodes:
    """Return a stress profile as NXdata, its parameters, and how it was calculated."""
    film = profile.film
    indenter = profile.indenter
    contact = {}
    if film:
        contact["film"] = write_record(records.FILM, film)
    if indenter:
        contact["indenter"] = indenter_group(indenter)
    numerics = write_record(records.NUMERICS, profile)
    solution: Nodes = {"numerics": numerics} if numerics.children else {}
    solution |= write_record(records.PROFILE_NOTES, profile).children
    data = write_record(records.PROFILE, profile) if profile.form is None else _form(profile.form)
    return {
        "reference": data,
        f"{prefix}parameters": write_record(records.CONTACT, profile, **contact),
        f"{prefix}process": write_record(records.SOLVER, profile, **solution),
    }


def _form(form: IdealReference | StressField) -> Group:
    """Return an ideal reference, or a field as NXdata in its own unit."""
    if isinstance(form, IdealReference):
        return write_record(records.IDEAL_REFERENCE, form)
    axes: Nodes = {name: si(getattr(form, name), "length", (name,)) for name in "xy"}
    axes["field"] = Number(form.values, form.unit, ("y", "x"))
    axes |= write_record(records.LOAD, form).children
    return Group("NXdata", axes, {"signal": "field", "axes": ("y", "x")})


def read_field(file: SafeFile, path: str) -> StressField:
    """Read a field from an NXdata group, or from one that holds x, y and sigma_zz or field."""
    axes = file.attribute(path, "axes") if path else None
    y, x = axes if isinstance(axes, tuple) and len(axes) == 2 else ("y", "x")
    signal = (file.attribute(path, "signal") if path else None) or "sigma_zz"
    at = f"{path}/{signal}"
    unit = file.units_of(at) or "1"
    if not file.has(at):
        raise FormatError(
            f"{file.where(at)} is missing.",
            why="The file is no memscal-reference, and should hold a field there.",
        )
    values = file.array(at)
    with suppress(UnitError):
        values = to_si(values, unit, "stress", file.where(at))
        unit = "Pa"
    load = file.require_scalar(f"{path}/load", "force") if file.has(f"{path}/load") else None
    along_x = file.require_array(f"{path}/{x}", "length", ndim=1)
    along_y = file.require_array(f"{path}/{y}", "length", ndim=1)
    with placed(file.where(path or "/")):
        return StressField(
            x=along_x, y=along_y, values=values, unit=unit, load=load, source=file.source
        )


def read_profile(
    file: SafeFile, prefix: str = "reference_", load: float | None = None
) -> StressProfile:
    """Read a stress profile; the load is the one given where it names none."""
    data = "/entry/reference"
    parameters = f"/entry/{prefix}parameters"
    process = f"/entry/{prefix}process"
    film = f"{parameters}/film"
    indenter = f"{parameters}/indenter"
    defaults = {} if load is None else {"load": load}
    contact = read_record(records.CONTACT, file, parameters, defaults=defaults)
    if file.has(f"{data}/shape"):
        ideal = IdealReference(**read_record(records.IDEAL_REFERENCE, file, data))
        return replace(ideal.profile(), **contact)
    if file.has(f"{data}/field"):
        return replace(read_field(file, data).profile(), **contact)
    return StressProfile(
        film=read_film(file, film) if file.has(film) else None,
        indenter=read_indenter(file, indenter) if file.has(indenter) else None,
        **read_record(records.PROFILE, file, data),
        **contact,
        **read_record(records.SOLVER, file, process),
        **read_record(records.NUMERICS, file, f"{process}/numerics"),
        **read_record(records.PROFILE_NOTES, file, process),
        source=file.source,  # states what was found to be altered on the way
    )


def read_process(file: SafeFile) -> Process:
    """Read what was done."""
    defaults = {"program": "", "version": "", "date": ""}
    return Process(**read_record(records.PROCESS, file, "/entry/process", defaults=defaults))


def assumption_group(assumptions: tuple[Assumption, ...]) -> Group:
    """Return what was taken for granted, one NXcollection each."""
    children = {}
    for assumption in assumptions:
        declared = records.assumption_record(assumption.name)
        stated = {"state": assumption.state, **assumption.sizes}
        children[assumption.name] = write_record(declared, stated)
    return named_collection(children)


def read_assumptions(file: SafeFile) -> tuple[Assumption, ...]:
    """Read what was taken for granted, where a file states it."""
    path = "/entry/assumptions"
    assumptions = []
    for name in file.text_list(f"{path}/names"):
        declared = records.assumption_record(name)
        sizes = read_record(declared, file, f"{path}/{name}")
        assumptions.append(Assumption(name, sizes.pop("state"), sizes))
    return tuple(assumptions)


def quality_group(checks: QualityChecks) -> Group:
    """Return the quality checks, one NXcollection each."""
    children = {}
    for check in checks:
        name = re.sub(r"[^a-z0-9_]+", "_", check.name.lower()).strip("_")
        if not name or name in children:
            raise InputError(f'Two quality checks would be stored as "{name}".')
        children[name] = write_record(records.CHECK, check)
    return named_collection(children)


def read_quality(file: SafeFile) -> QualityChecks:
    """Read the quality checks, in their order."""
    checks = []
    for name in file.text_list("/entry/quality/names"):
        defaults = {"name": name, "meaning": ""}
        stated = read_record(records.CHECK, file, f"/entry/quality/{name}", defaults=defaults)
        checks.append(QualityCheck(**stated))
    return tuple(checks)
