"""The parts that scan, reference and artifact share: film, indenter, sensor, stress profile."""

from __future__ import annotations

from collections.abc import Mapping

from memscal.errors import FormatError
from memscal.formats.fields import (
    optional_array,
    optional_scalar,
    optional_text,
    require_array,
    require_scalar,
    require_text,
)
from memscal.formats.hdf5_reader import SafeFile
from memscal.formats.tree import Group, Node, note, si
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Cone, Indenter, Profile, Rod, RoundIndenter, Sphere
from memscal.model.scan import StressSensor
from memscal.model.stress import StressProfile

__all__ = [
    "film_group",
    "indenter_group",
    "instrument_group",
    "profile_groups",
    "read_film",
    "read_indenter",
    "read_profile",
    "read_round_indenter",
    "read_sensor",
    "sample_group",
]

_FILM = {
    "young_modulus": "stress",
    "poisson_ratio": "dimensionless",
    "thickness": "length",
    "roughness_rms": "length",
}
_PROFILE = {
    "depth": "length",
    "contact_radius": "length",
    "stick_radius": "length",
    "friction_coefficient": "dimensionless",
}
_ROUND: dict[str, type[RoundIndenter]] = {"rod": Rod, "sphere": Sphere}


def film_group(film: ElasticFilm) -> Group:
    """Return a film as an NXcollection; a standard uncertainty stands beside its quantity."""
    children: dict[str, Node] = {}
    for name, dimension in _FILM.items():
        for suffix, attribute in (("", ""), ("_errors", "_uncertainty")):
            value = getattr(film, name + attribute)
            if value is not None:
                children[name + suffix] = si(value, dimension)
    if film.name:
        children["name"] = film.name
    return Group("NXcollection", children)


def read_film(file: SafeFile, path: str) -> ElasticFilm:
    """Read a film."""
    return ElasticFilm(
        young_modulus=require_scalar(file, f"{path}/young_modulus", "stress"),
        poisson_ratio=require_scalar(file, f"{path}/poisson_ratio", "dimensionless"),
        thickness=require_scalar(file, f"{path}/thickness", "length"),
        roughness_rms=optional_scalar(file, f"{path}/roughness_rms", "length"),
        **{
            f"{name}_uncertainty": optional_scalar(file, f"{path}/{name}_errors", dimension)
            for name, dimension in _FILM.items()
        },
        name=optional_text(file, f"{path}/name"),
    )


def sample_group(film: ElasticFilm, texts: Mapping[str, str] | None = None) -> Group:
    """Return the NXsample that holds the film, and the texts beside it that are not empty."""
    stated = {name: text for name, text in (texts or {}).items() if text}
    return Group("NXsample", {"film": film_group(film), **stated})


def indenter_group(
    indenter: Indenter, load: float | None = None, load_uncertainty: float | None = None
) -> Group:
    """Return an indenter as an NXcollection, with its nominal load."""
    children: dict[str, Node] = {"shape": indenter.shape}
    if isinstance(indenter, RoundIndenter):
        children["radius"] = si(indenter.radius, "length")
        if indenter.radius_uncertainty is not None:
            children["radius_errors"] = si(indenter.radius_uncertainty, "length")
    if isinstance(indenter, Cone):
        children["inclination"] = si(indenter.inclination, "angle")
    if isinstance(indenter, Profile):
        face = {"r": si(indenter.r, "length", ("r",)), "z": si(indenter.z, "length", ("r",))}
        children["face"] = Group("NXdata", face, {"signal": "z", "axes": ("r",)})
    if load is not None:
        children["load"] = si(load, "force")
    if load_uncertainty is not None:
        children["load_errors"] = si(load_uncertainty, "force")
    return Group("NXcollection", children)


def read_indenter(file: SafeFile, path: str) -> Indenter:
    """Read an indenter."""
    shape = _shape(file, path)
    if shape == Cone.shape:
        return Cone(inclination=require_scalar(file, f"{path}/inclination", "angle"))
    if shape == Profile.shape:
        return Profile(
            r=require_array(file, f"{path}/face/r", "length", ndim=1),
            z=require_array(file, f"{path}/face/z", "length", ndim=1),
        )
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
    return _ROUND[shape](
        radius=require_scalar(file, f"{path}/radius", "length"),
        radius_uncertainty=optional_scalar(file, f"{path}/radius_errors", "length"),
    )


def _shape(file: SafeFile, path: str) -> str:
    return require_text(file, f"{path}/shape").strip().lower()


def instrument_group(sensor: StressSensor) -> Group:
    """Return the NXinstrument that holds the sensor."""
    named = {"name": sensor.name, "model": sensor.model, "channel": sensor.channel}
    children: dict[str, Node] = {name: text for name, text in named.items() if text}
    return Group("NXinstrument", {"stress_sensor": Group("NXsensor", children)})


def read_sensor(file: SafeFile, path: str) -> StressSensor:
    """Read the sensor; what is not stated stays empty."""
    return StressSensor(
        name=optional_text(file, f"{path}/name"),
        model=optional_text(file, f"{path}/model"),
        channel=optional_text(file, f"{path}/channel", "zz"),
    )


def profile_groups(profile: StressProfile) -> tuple[Group, Group, Group]:
    """Return a stress profile as NXdata, its parameters, and how it was calculated."""
    axes = ("r",)
    data: dict[str, Node] = {
        "r": si(profile.r, "length", axes),
        "sigma_zz": si(profile.sigma_zz, "stress", axes),
    }
    if profile.sigma_rz is not None:
        data["sigma_rz"] = si(profile.sigma_rz, "stress", axes)
    if profile.sigma_zz_errors is not None:
        data["sigma_zz_errors"] = si(profile.sigma_zz_errors, "stress", axes)
    parameters: dict[str, Node] = {"load": si(profile.load, "force")}
    for name, dimension in _PROFILE.items():
        value = getattr(profile, name)
        if value is not None:
            parameters[name] = si(value, dimension)
    if profile.loading:
        parameters["loading"] = profile.loading
    if profile.film is not None:
        parameters["film"] = film_group(profile.film)
    if profile.indenter is not None:
        parameters["indenter"] = indenter_group(profile.indenter)
    process: dict[str, Node] = {}
    if profile.solver:
        process["program"] = profile.solver
    made: dict[str, Node] = {}
    if profile.discretisation:
        made["discretisation"] = profile.discretisation
    if profile.convergence is not None:
        made["convergence"] = si(profile.convergence, "dimensionless")
    if made:
        process["numerics"] = Group("NXparameters", made)
    if profile.notes:
        process["notes"] = note(profile.notes)
    return (
        Group("NXdata", data, {"signal": "sigma_zz", "axes": axes}),
        Group("NXcollection", parameters),
        Group("NXprocess", process),
    )


def read_profile(
    file: SafeFile,
    data: str,
    parameters: str,
    process: str,
    *,
    load: float | None = None,
    film: ElasticFilm | None = None,
    indenter: Indenter | None = None,
) -> StressProfile:
    """Read a stress profile; load, film and indenter are those given where it names none."""
    if load is None or file.has(f"{parameters}/load"):
        load = require_scalar(file, f"{parameters}/load", "force")
    if file.has(f"{parameters}/film"):
        film = read_film(file, f"{parameters}/film")
    if file.has(f"{parameters}/indenter"):
        indenter = read_indenter(file, f"{parameters}/indenter")
    return StressProfile(
        r=require_array(file, f"{data}/r", "length", ndim=1),
        sigma_zz=require_array(file, f"{data}/sigma_zz", "stress", ndim=1),
        sigma_rz=optional_array(file, f"{data}/sigma_rz", "stress", ndim=1),
        sigma_zz_errors=optional_array(file, f"{data}/sigma_zz_errors", "stress", ndim=1),
        load=load,
        film=film,
        indenter=indenter,
        loading=optional_text(file, f"{parameters}/loading"),
        solver=optional_text(file, f"{process}/program"),
        discretisation=optional_text(file, f"{process}/numerics/discretisation"),
        convergence=optional_scalar(file, f"{process}/numerics/convergence", "dimensionless"),
        notes=optional_text(file, f"{process}/notes/data"),
        source=file.source,
        **{
            name: optional_scalar(file, f"{parameters}/{name}", dimension)
            for name, dimension in _PROFILE.items()
        },
    )
