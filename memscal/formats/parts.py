"""Groups that scan, reference and artifact share: film, indenter, sensor, stress profile."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from memscal.errors import FormatError
from memscal.formats.fields import require_text
from memscal.formats.hdf5_reader import SafeFile
from memscal.formats.records import (
    CONE,
    CONTACT,
    FILM,
    INDENTER_FACE,
    LOAD,
    NUMERICS,
    PROFILE,
    PROFILE_NOTES,
    ROUND_INDENTER,
    SENSOR,
    SOLVER,
)
from memscal.formats.tree import Group, Node
from memscal.model.film import ElasticFilm
from memscal.model.indenter import Cone, Indenter, Profile, Rod, RoundIndenter, Sphere
from memscal.model.scan import StressSensor
from memscal.model.stress import StressProfile

__all__ = [
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

_ROUND: dict[str, type[RoundIndenter]] = {shape.shape: shape for shape in (Rod, Sphere)}
_NO_TEXTS: Mapping[str, str] = MappingProxyType({})


def read_film(file: SafeFile, path: str) -> ElasticFilm:
    """Read a film."""
    return ElasticFilm(**FILM.read(file, path))


def sample_group(film: ElasticFilm, texts: Mapping[str, str] = _NO_TEXTS) -> Group:
    """Return the NXsample that holds the film, and the texts beside it that are not empty."""
    stated = {name: text for name, text in texts.items() if text}
    return Group("NXsample", {"film": FILM.write(film), **stated})


def indenter_group(
    indenter: Indenter, load: float | None = None, load_uncertainty: float | None = None
) -> Group:
    """Return an indenter as an NXcollection, with its nominal load."""
    children: dict[str, Node] = {"shape": indenter.shape}
    if isinstance(indenter, Profile):
        children["face"] = INDENTER_FACE.write(indenter)
    else:
        round_or_cone = CONE if isinstance(indenter, Cone) else ROUND_INDENTER
        children |= round_or_cone.write(indenter).children
    if load is not None:
        stated = {"load": load, "load_uncertainty": load_uncertainty}
        children |= LOAD.write(stated).children
    return Group("NXcollection", children)


def read_indenter(file: SafeFile, path: str) -> Indenter:
    """Read an indenter."""
    shape = _shape(file, path)
    if shape == Cone.shape:
        return Cone(**CONE.read(file, path))
    if shape == Profile.shape:
        return Profile(**INDENTER_FACE.read(file, f"{path}/face"))
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
    return _ROUND[shape](**ROUND_INDENTER.read(file, path))


def _shape(file: SafeFile, path: str) -> str:
    return require_text(file, f"{path}/shape").strip().lower()


def instrument_group(sensor: StressSensor) -> Group:
    """Return the NXinstrument that holds the sensor."""
    return Group("NXinstrument", {"stress_sensor": SENSOR.write(sensor)})


def read_sensor(file: SafeFile, path: str) -> StressSensor:
    """Read the sensor; what is not stated stays empty."""
    return StressSensor(**SENSOR.read(file, path))


def profile_groups(profile: StressProfile) -> tuple[Group, Group, Group]:
    """Return a stress profile as NXdata, its parameters, and how it was calculated."""
    of: dict[str, Node] = {}
    if profile.film is not None:
        of["film"] = FILM.write(profile.film)
    if profile.indenter is not None:
        of["indenter"] = indenter_group(profile.indenter)
    numerics = NUMERICS.write(profile)
    made: dict[str, Node] = {"numerics": numerics} if numerics.children else {}
    made |= PROFILE_NOTES.write(profile).children
    return PROFILE.write(profile), CONTACT.write(profile, **of), SOLVER.write(profile, **made)


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
    if file.has(f"{parameters}/film"):
        film = read_film(file, f"{parameters}/film")
    if file.has(f"{parameters}/indenter"):
        indenter = read_indenter(file, f"{parameters}/indenter")
    return StressProfile(
        film=film,
        indenter=indenter,
        source=file.source,
        **PROFILE.read(file, data),
        **CONTACT.read(file, parameters, defaults={} if load is None else {"load": load}),
        **SOLVER.read(file, process),
        **NUMERICS.read(file, f"{process}/numerics"),
        **PROFILE_NOTES.read(file, process),
    )
