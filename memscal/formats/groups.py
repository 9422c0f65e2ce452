"""Groups that several files share: film, indenter, sensor, profile, parameters, process, checks."""

from __future__ import annotations

import re
from collections.abc import Mapping

import numpy as np

from memscal.errors import FormatError, InputError
from memscal.formats.codec import read_record, write_record
from memscal.formats.hdf5.reader import SafeFile
from memscal.formats.hdf5.writer import Group, Node, Number, index_axis, si, to_json
from memscal.formats.units import dimension_of, from_si, to_si
from memscal.formats.values import any_scalar, require_array, require_text, text_list, units_of
from memscal.model import records
from memscal.model.apparatus import ParameterSet
from memscal.model.checks import QualityCheck
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Cone, Indenter, Profile, Rod, RoundIndenter, Sphere
from memscal.model.provenance import Process
from memscal.model.quantities import TRUTH, Record, declared_quantity, estimated_quantity, record
from memscal.model.scan import StressSensor
from memscal.model.stress import StressProfile

# One name for each axis of the covariance: netCDF tools need each dimension once.
_AXES = ("parameter", "parameter_prime")
_COVARIANCE = (
    "Covariance of the numbers, in the order of names: each parameter in the unit of its dataset."
)


def parameter_dimension(name: str, unit: str = "") -> str:
    """Return the dimension of a parameter: by its SI unit where that is given, else by its name."""
    if unit:
        return dimension_of(unit, f"parameter {name}")
    if (declared := declared_quantity(name)) is not None:
        return declared.dimension
    raise InputError(
        f"The unit of {name} is not known.",
        why="Every number in a file carries its unit.",
        cure="Begin its name with one of "
        + ", ".join(TRUTH)
        + ", or give the SI unit of a parameter in ParameterSet(units=...).",
    )


def parameter_group(parameters: ParameterSet, budget: Mapping[str, Mapping[str, float]]) -> Group:
    """Return the parameters as an NXcollection."""
    stated = parameters.units or ("",) * len(parameters.names)
    dimensions = [parameter_dimension(n, u) for n, u in zip(parameters.names, stated, strict=True)]
    reserved = {"names", "covariance", "budget", *_AXES}.intersection(parameters.names)
    if reserved:
        raise InputError(
            f"A parameter cannot be called {min(reserved)}.",
            why="The group of the parameters holds something else of that name.",
            cure="Give it another name.",
        )
    children: dict[str, Node] = {"names": to_json("parameter names", list(parameters.names))}
    for name, value, dimension in zip(parameters.names, parameters.values, dimensions, strict=True):
        children[name] = si(float(value), dimension)
        children[f"{name}_errors"] = si(parameters.uncertainty(name), dimension)
    for axis in _AXES:
        children[axis] = index_axis(axis, len(parameters.names))
    scale = np.array([float(from_si(1.0, dimension)[0]) for dimension in dimensions])
    numbers = parameters.covariance * scale[:, None] * scale[None, :]
    children["covariance"] = Number(numbers, "1", _AXES, {"description": _COVARIANCE})
    if budget:
        of_names = dict(zip(parameters.names, dimensions, strict=True))
        children["budget"] = budget_group(budget, of_names)
    return Group("NXcollection", children)


def read_parameters(file: SafeFile, path: str) -> ParameterSet:
    """Read the parameters, in SI units."""
    names = tuple(text_list(file, f"{path}/names"))
    if not names or len(set(names)) != len(names):
        raise FormatError(
            f"{file.where(path)}/names is missing or names a parameter twice.",
            why="It lists the parameters, in the order of their covariance.",
        )
    pairs = [any_scalar(file, f"{path}/{name}") for name in names]
    scale = np.array([_unit_scale(file, f"{path}/{name}") for name in names])
    covariance = require_array(file, f"{path}/covariance", "dimensionless", ndim=2)
    if covariance.shape != (len(names), len(names)):
        raise FormatError(
            f"{file.where(path)}/covariance has shape {covariance.shape} for {len(names)} names."
        )
    return ParameterSet(
        names=names,
        values=np.array([value for value, _ in pairs]),
        covariance=covariance * scale[:, None] * scale[None, :],
        units=tuple(unit for _, unit in pairs),
    )


def estimated_record(file: SafeFile, path: str) -> Record:
    """Return what the group of the parameters holds, by the names that the file gives them."""
    names = text_list(file, f"{path}/names")
    return record("NXcollection", *map(estimated_quantity, names))


def budget_group(budget: Mapping[str, Mapping[str, float]], dimensions: Mapping[str, str]) -> Group:
    """Return the uncertainty budget: one group per quantity, one number per source."""
    children: dict[str, Node] = {"names": to_json("budget", list(budget))}
    for quantity, sources in budget.items():
        dimension = dimensions.get(quantity) or parameter_dimension(quantity)
        group: dict[str, Node] = {"names": to_json(f"budget of {quantity}", list(sources))}
        for source, value in sources.items():
            group[source] = si(float(value), dimension)
        children[quantity] = Group("NXcollection", group)
    return Group("NXcollection", children)


def read_budget(file: SafeFile, path: str) -> dict[str, dict[str, float]]:
    """Read the uncertainty budget, in SI units; empty where there is none."""
    groups = {name: f"{path}/{name}" for name in text_list(file, f"{path}/names")}
    return {
        name: {s: any_scalar(file, f"{group}/{s}")[0] for s in text_list(file, f"{group}/names")}
        for name, group in groups.items()
    }


def _unit_scale(file: SafeFile, path: str) -> float:
    """How many SI units the unit at a path is."""
    unit = units_of(file, path) or "1"
    return float(to_si(1.0, unit, dimension_of(unit, file.where(path)), file.where(path)))


_ROUND: dict[str, type[RoundIndenter]] = {shape.shape: shape for shape in (Rod, Sphere)}


def read_film(file: SafeFile, path: str) -> ElasticFilm:
    """Read a film."""
    return ElasticFilm(**read_record(records.FILM, file, path))


def sample_group(film: ElasticFilm, lubrication: str = "", lubricant: str = "") -> Group:
    """Return the NXsample that holds the film, and how it was lubricated."""
    stated = {"lubrication": lubrication, "lubricant": lubricant}
    contact = write_record(records.SAMPLE, stated).children
    return Group("NXsample", {"film": write_record(records.FILM, film), **contact})


def indenter_group(
    indenter: Indenter, load: float | None = None, load_uncertainty: float | None = None
) -> Group:
    """Return an indenter as an NXcollection, with its nominal load."""
    children: dict[str, Node] = {"shape": indenter.shape}
    if isinstance(indenter, Profile):
        children["face"] = write_record(records.INDENTER_FACE, indenter)
    else:
        round_or_cone = records.CONE if isinstance(indenter, Cone) else records.ROUND_INDENTER
        children |= write_record(round_or_cone, indenter).children
    if load is not None:
        stated = {"load": load, "load_uncertainty": load_uncertainty}
        children |= write_record(records.LOAD, stated).children
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
    return require_text(file, f"{path}/shape").strip().lower()


def instrument_group(sensor: StressSensor) -> Group:
    """Return the NXinstrument that holds the sensor."""
    return Group("NXinstrument", {"stress_sensor": write_record(records.SENSOR, sensor)})


def read_sensor(file: SafeFile, path: str) -> StressSensor:
    """Read the sensor; what is not stated stays empty."""
    return StressSensor(**read_record(records.SENSOR, file, path))


def profile_groups(profile: StressProfile) -> tuple[Group, Group, Group]:
    """Return a stress profile as NXdata, its parameters, and how it was calculated."""
    of: dict[str, Node] = {}
    if profile.film is not None:
        of["film"] = write_record(records.FILM, profile.film)
    if profile.indenter is not None:
        of["indenter"] = indenter_group(profile.indenter)
    numerics = write_record(records.NUMERICS, profile)
    made: dict[str, Node] = {"numerics": numerics} if numerics.children else {}
    made |= write_record(records.PROFILE_NOTES, profile).children
    return (
        write_record(records.PROFILE, profile),
        write_record(records.CONTACT, profile, **of),
        write_record(records.SOLVER, profile, **made),
    )


def reference_groups(profile: StressProfile) -> dict[str, Node]:
    """Return the groups of a stress profile within the entry of a scan or an artifact."""
    names = ("reference", "reference_parameters", "reference_process")
    return dict(zip(names, profile_groups(profile), strict=True))


def read_profile(
    file: SafeFile,
    data: str = "/entry/reference",
    parameters: str = "/entry/reference_parameters",
    process: str = "/entry/reference_process",
    *,
    load: float | None = None,
    film: ElasticFilm | None = None,
    indenter: Indenter | None = None,
) -> StressProfile:
    """Read a stress profile; load, film and indenter are those given where it names none."""
    if file.has(f"{parameters}/film"):
        film = read_film(file, f"{parameters}/film")
    if file.has(f"{parameters}/indenter"):
        indenter = read_indenter(file, f"{parameters}/indenter")
    defaults = {} if load is None else {"load": load}
    return StressProfile(
        film=film,
        indenter=indenter,
        source=file.source,
        **read_record(records.PROFILE, file, data),
        **read_record(records.CONTACT, file, parameters, defaults=defaults),
        **read_record(records.SOLVER, file, process),
        **read_record(records.NUMERICS, file, f"{process}/numerics"),
        **read_record(records.PROFILE_NOTES, file, process),
    )


def read_process(file: SafeFile, path: str) -> Process:
    """Read what was done."""
    defaults = {"program": "", "version": "", "date": ""}
    return Process(**read_record(records.PROCESS, file, path, defaults=defaults))


def quality_group(checks: tuple[QualityCheck, ...]) -> Group:
    """Return the quality checks, one NXcollection each; ``names`` keeps their order."""
    children: dict[str, Node] = {}
    for check in checks:
        name = re.sub(r"[^a-z0-9_]+", "_", check.name.lower()).strip("_")
        if not name or name in children:
            raise InputError(f'Two quality checks would be stored as "{name}".')
        children[name] = write_record(records.CHECK, check)
    return Group("NXcollection", {"names": to_json("quality checks", list(children)), **children})


def read_quality(file: SafeFile, path: str) -> tuple[QualityCheck, ...]:
    """Read the quality checks, in their order."""

    def check(name: str) -> QualityCheck:
        defaults = {"name": name, "meaning": ""}
        return QualityCheck(**read_record(records.CHECK, file, f"{path}/{name}", defaults=defaults))

    return tuple(map(check, text_list(file, f"{path}/names")))
