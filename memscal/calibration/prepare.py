"""What a calibration is asked for, and what it starts from: scans, film, loads and references."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import chain
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy as np

from memscal.calibration.stages import COMMON, PER_REPEAT
from memscal.deconvolution.division import Method
from memscal.errors import InputError
from memscal.estimation.points import require_size, scans_by_load
from memscal.estimation.set_up import (
    at_load_of,
    film_of,
    reference_profile,
    require_calibration_rod,
    require_one_kind,
    require_one_sensor,
    require_same_set_up,
    with_film_of,
)
from memscal.extensions import hook
from memscal.mechanics.contact import BaseStress, Contact, stress_table
from memscal.mechanics.press_rod import press_rod
from memscal.model.arrays import array_record, keyword_array_record
from memscal.model.film import LINEAR
from memscal.model.notation import RELATIVE, Reading
from memscal.model.provenance import accepted_alterations
from memscal.model.scan import Scan
from memscal.model.stress import IdealReference, StressField, StressProfile
from memscal.readings.crossed_lines import crossed_lines

if TYPE_CHECKING:
    from memscal.calibration.film_inference import FreeThickness

Reference = StressProfile | StressField | IdealReference | Contact | str | PathLike[str] | None
"""A base stress, an ideal reference, the path or name of one, or nothing: the rod is solved."""

References = Reference | Sequence[Reference]
"""One of all scans, or one of each."""


#: A load in N under which a rod hardly sinks.
_LIGHT = 1e-6


@keyword_array_record
class Request:
    """What a calibration is asked for; :func:`memscal.calibrate` describes each."""

    method: Method
    reference: References
    alternative: References
    film_law: str | None
    mooney_rivlin_ratio: float | None
    rod_friction: float | None
    channel: str
    centre: str | None
    correlations: Mapping[tuple[str, str], float]
    pixel_size: float | None = None
    free: str | Sequence[str]
    seed: int
    override: bool
    accept_altered: bool
    relative: bool
    creep: Any = None  # of the sensor, or its file; as it is taken, what tells that file


@array_record
class Prepared:
    """What a calibration starts from: scans with the film and loads that count, and references."""

    request: Request
    as_stated: Sequence[Scan]
    scans: Sequence[Scan]
    references: Sequence[BaseStress | None]  # as given
    stresses: Sequence[BaseStress]  # as taken, one of each scan
    alternatives: Sequence[BaseStress | None]  # none or, as the references, one of each scan
    owners: Sequence[int]  # of scans that were split by their loads; else none
    reading: Reading
    overridden: list[str]
    thickness: "FreeThickness | None" = None  # of the films, where the scans determine it


def prepare(as_stated: Sequence[Scan], request: Request) -> Prepared:
    """Read and solve the references, and hold them against the scans."""
    if request.centre not in (None, COMMON, PER_REPEAT):
        raise InputError(
            f"There is no choice of centre {request.centre!r}.",
            cure=f"Give {COMMON!r} or {PER_REPEAT!r}, or leave it out.",
        )
    if request.creep is not None:
        as_stated, request = hook("with_creep")(as_stated, request)
    require_size(as_stated)
    if request.reference is None:
        as_stated = tuple(chain(*map(crossed_lines, as_stated)))
    as_stated = require_one_sensor(as_stated)
    loaded = as_stated
    if request.relative and request.reference is None:
        loaded = tuple(map(_with_some_load, as_stated))
    references = _references(request.reference, as_stated, request)
    scans = []
    stated = []
    for scan, given in zip(loaded, references, strict=True):
        require_calibration_rod(scan, given)
        scan = _with_law(scan, given, request)
        stated.append(given or scan.reference)
        if request.relative:
            load = None if stated[-1] else scan.load  # a rod that has to be solved keeps it
            scan = replace(
                scan, load=load, load_uncertainty=None, normal_load=None, normal_load_errors=None
            )
        scans.append(scan)
    alternatives: list[BaseStress | None] = []
    if request.alternative is not None:
        alternatives = _references(request.alternative, scans, replace(request, pixel_size=None))
    overridden = require_same_set_up(scans, references, alternatives, override=request.override)
    files = (*as_stated, *references, *alternatives)
    overridden[:0] = accepted_alterations(*(getattr(file, "source", None) for file in files))
    scans = list(map(with_film_of, references, scans))
    require_one_kind(stated, alternatives)
    owners: Sequence[int] = ()
    if not any(stated) and any(s.set_up.film.law != LINEAR for s in scans):
        scans, owners = scans_by_load(scans)  # whose stresses have shapes of their own
        references = [None] * len(scans)
    stresses = list(map(reference_profile, scans, references))
    peak = None
    per = stresses[0].unit
    if request.relative:  # a point has no largest value, but a unit integral
        peak = float(abs(stress_table(stresses[0]).sigma_zz).max())
        per = RELATIVE if peak else f"{RELATIVE} {per}"
        peak = peak or 1.0
    scans = [at_load_of(stress, s, peak) for s, stress in zip(scans, stresses, strict=True)]
    return Prepared(
        request=request,
        as_stated=as_stated,
        scans=scans,
        references=references,
        stresses=stresses,
        alternatives=alternatives,
        owners=owners,
        reading=replace(scans[0].reading, per=per),
        overridden=overridden,
    )


def _with_law(scan: Scan, reference: BaseStress | None, request: Request) -> Scan:
    """Return the scan with the law and the rod's friction that are known: asked for, or stated."""
    law = request.film_law
    if law is not None:
        if reference:
            raise InputError(
                f"A film law ({law}) and a reference are given.",
                why="A reference has been calculated by a law already.",
                cure="Give one of them (film_law, --film-law; reference, --reference).",
            )
        ratio = request.mooney_rivlin_ratio
        film = replace(scan.set_up.film, law=law, mooney_rivlin_ratio=ratio)
        scan = replace(scan, film=film, reference=None)
    stress = reference or scan.reference
    made_on = film_of(stress) if stress else None
    if stress and made_on and made_on.law and scan.film:
        if not scan.film.law:
            ratio = made_on.mooney_rivlin_ratio
            film = replace(scan.film, law=made_on.law, mooney_rivlin_ratio=ratio)
            scan = replace(scan, film=film)
        friction = stress.friction if isinstance(stress, Contact) else stress.friction_coefficient
        if made_on.law != LINEAR and scan.rod_friction is None and friction in (0.0, np.inf):
            scan = replace(scan, rod_friction=friction)
    if request.rod_friction is not None:
        scan = replace(scan, rod_friction=request.rod_friction)
    return scan


def _with_some_load(scan: Scan) -> Scan:
    """Return the scan with a load where none is stated, for a relative A knows no other."""
    if scan.load is not None or scan.reference:
        return scan
    # 1 N, or less where the rod would sink deeper than finite elements can follow.
    light = replace(scan, load=_LIGHT).set_up.under(LINEAR)
    per_newton = press_rod(*light).depth / _LIGHT
    deepest = min(0.4 * light.film.thickness, 3 * light.indenter.radius)
    return replace(scan, load=min(1.0, deepest / per_newton))


def _references(
    reference: References, scans: Sequence[Scan], request: Request
) -> list[BaseStress | None]:
    """Read a reference for each scan; a single one is that of all scans."""
    loads = scans[0].normal_load
    strength = scans[0].load or (1.0 if loads is None else float(np.nanmedian(loads)))
    if isinstance(reference, Sequence) and not isinstance(reference, str):
        if len(reference) != len(scans):
            raise InputError(
                f"References and scans differ in number: {len(reference)} and {len(scans)}.",
                cure="Give one for each scan, in their order, or one for all.",
            )
        return [_read(item, strength, request) for item in reference]
    return [_read(reference, strength, request)] * len(scans)


def _read(reference: Reference, load: float, request: Request) -> BaseStress | None:
    """Read a reference; a source has its own strength at the nominal load of the first scan."""
    if isinstance(reference, str | PathLike):
        from memscal.formats.reference import read_reference

        reference = read_reference(
            reference, pixel_size=request.pixel_size, accept_altered=request.accept_altered
        )
    elif isinstance(reference, IdealReference | StressField):
        reference = reference.profile()
    if isinstance(reference, StressProfile) and reference.form:
        stated = reference.form.load if isinstance(reference.form, StressField) else None
        return replace(reference, load=stated or load)
    if reference is None or isinstance(reference, BaseStress):
        return reference
    raise InputError(
        f"The reference is of type {type(reference).__name__}.",
        cure="Give a contact from memscal.indent(), a StressProfile, a StressField, an ideal one "
        "such as disc:0.5mm, or the path of a file.",
    )
