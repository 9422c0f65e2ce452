"""Groups that scan, reference and artifact share: film, indenter, sensor, stress profile."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from memscal.errors import FormatError
from memscal.formats.codec import read_record, write_record
from memscal.formats.fields import require_text
from memscal.formats.hdf5_reader import SafeFile
from memscal.formats.tree import Group, Node
from memscal.model import records
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
    return ElasticFilm(**read_record(records.FILM, file, path))


def sample_group(film: ElasticFilm, texts: Mapping[str, str] = _NO_TEXTS) -> Group:
    """Return the NXsample that holds the film, and the texts beside it that are not empty."""
    stated = {name: text for name, text in texts.items() if text}
    return Group("NXsample", {"film": write_record(records.FILM, film), **stated})


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
        **read_record(records.PROFILE, file, data),
        **read_record(
            records.CONTACT, file, parameters, defaults={} if load is None else {"load": load}
        ),
        **read_record(records.SOLVER, file, process),
        **read_record(records.NUMERICS, file, f"{process}/numerics"),
        **read_record(records.PROFILE_NOTES, file, process),
    )
