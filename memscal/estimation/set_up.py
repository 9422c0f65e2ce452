"""Set-up of a calibration: the reference of each scan, and whether both are of one film and rod."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np

from memscal.errors import InputError
from memscal.extensions import hook
from memscal.mechanics.contact import BaseStress, Contact
from memscal.mechanics.press_rod import press_rod
from memscal.model.film import LINEAR, ElasticFilm
from memscal.model.indenter import Rod
from memscal.model.provenance import SourceFile
from memscal.model.quantities import Record
from memscal.model.records import FILM, INDENTER, LOAD
from memscal.model.scan import Scan, require_pressed
from memscal.readings.mistaken_unit import require_plausible

#: Stated values agree within this many standard uncertainties of their difference ...
COVERAGE = 2.0
#: ... and within this share of them where none is stated.
_SAME = 1e-6


def film_of(stress: BaseStress) -> ElasticFilm | None:
    """Return the film that a stress is stated to be below."""
    return stress.film_of_law if isinstance(stress, Contact) else stress.film


def reference_profile(scan: Scan, reference: BaseStress | None) -> BaseStress:
    """Choose the reference: the argument, the scan's own, or the rod on the expected film."""
    return reference or scan.reference or press_rod(*scan.set_up.expected)


def with_film_of(reference: BaseStress | None, scan: Scan) -> Scan:
    """Return a scan with film and rod if the reference depends on them, else without."""
    stress = reference or scan.reference
    if not stress:
        return scan
    film = film_of(stress)
    rod = scan.indenter or stress.indenter
    if not film or not isinstance(rod, Rod):
        return replace(scan, film=None, indenter=None, rod_friction=None)
    return replace(scan, film=scan.film or film, indenter=rod)


def at_load_of(stress: BaseStress, scan: Scan, peak: float | None) -> Scan:
    """Return a scan with a load: its own or the reference's; with a ``peak`` (Pa) one for all."""
    if peak:
        # A refers to the reference over its peak.
        factor = np.full(scan.u_zz.shape, stress.load / peak)
        return replace(scan, load=stress.load, normal_load=factor, normal_load_errors=None)
    if stress.unit != "Pa":
        # Loads are strengths, over that of the reference, and no newtons.
        scan = replace(scan, load_uncertainty=None)
    if scan.load is None and scan.normal_load is not None:
        return replace(scan, load=float(np.nanmedian(scan.normal_load)))
    return scan if scan.load else replace(scan, load=stress.load)


Difference = tuple[str, ...]
"""Two places, a quantity, and what each of them states of it."""


def require_one_kind(
    references: Sequence[BaseStress | None], alternatives: Sequence[BaseStress | None]
) -> None:
    """Refuse references that no one conversion constant belongs to."""
    forms = [reference and reference.form for reference in references]
    kinds = {form and (form.unit, getattr(form, "shape", "") == "slit") for form in forms}
    sources = kinds != {None}
    mixed = any(stress and stress.form for stress in alternatives)
    if mixed or len(kinds) > 1 or (sources and alternatives):
        raise InputError(
            "Sources and stresses, slits and other sources, or sources of several units are mixed.",
            why="One conversion constant has one unit; an alternative is of a film's stress.",
            cure="Calibrate each by itself.",
        )


def require_one_sensor(scans: Sequence[Scan]) -> tuple[Scan, ...]:
    """Refuse scans that cannot be fitted together."""
    sensors = {(s.sensor.name or "unnamed", s.sensor.channel, s.unit): None for s in scans}
    if len(sensors) > 1:
        named = ", ".join(f"{name} ({channel}, in {unit})" for name, channel, unit in sensors)
        raise InputError(
            f"The scans are of {len(sensors)} sensors: {named}.",
            why="Scans that are fitted together share one apparatus function.",
            cure="Calibrate each sensor by itself; check /entry/instrument/stress_sensor.",
        )
    films: dict[str, ElasticFilm] = {}
    for film in (scan.film for scan in scans if scan.film):
        first = films.setdefault(film.name, film)
        if film.name and first != film:
            raise InputError(
                f"Two of the scans name their film {film.name!r}, but give it a thickness of "
                f"{first.thickness * 1e3:.4g} and {film.thickness * 1e3:.4g} mm, a Poisson's ratio "
                f"of {first.poisson_ratio:.4g} and {film.poisson_ratio:.4g}, and a modulus of "
                f"{first.young_modulus * 1e-6:.4g} and {film.young_modulus * 1e-6:.4g} MPa, or "
                "other uncertainties.",
                why="One film has one set of properties.",
                cure="Correct /entry/sample/film in one of the files, or its name.",
            )
    return tuple(scans)


def require_calibration_rod(scan: Scan, reference: BaseStress | None) -> None:
    """Refuse an indenter that cannot calibrate, and lengths that no set-up has."""
    if scan.indenter and not isinstance(scan.indenter, Rod):
        raise InputError(
            f"The scan was made with a {scan.indenter.shape}, but a calibration needs a rod.",
            why="Only a contact smaller than the film's thickness is independent of friction and "
            "linear in load.",
            cure="Calibrate with a rod scan, then apply the apparatus function to this scan.",
        )
    require_pressed(scan.motion, scan.source)
    if with_film_of(reference, scan).film:
        require_plausible(scan)


def require_same_set_up(
    scans: Sequence[Scan],
    references: Sequence[BaseStress | None],
    alternatives: Sequence[BaseStress | None] = (),
    *,
    override: bool,
) -> list[str]:
    """Refuse a reference of another film, rod or load than its scan; or return the differences."""
    # :func:`stated_differences` has the rule; ``None`` stands for the reference in the scan, and an
    # alternative may have another law and friction, which it is given for.
    differences: list[Difference] = []
    for scan, reference in zip(scans, references, strict=True):
        stress = reference or scan.reference
        if stress and not stress.form:
            differences += _other_set_up(scan, stress, "reference")
    for scan, stress in zip(scans, alternatives, strict=False):
        if stress:
            differences += _other_set_up(scan, stress, "alternative")
    cure = "Give a stress that was calculated for the scan (memscal reference), or correct the "
    cure += "value that is wrong."
    if any(difference[2].startswith("load") for difference in differences):
        cure += " If the film of the reference is linear, state it (memscal import --film-law "
        cure += "linear; ElasticFilm(law='linear') in Python)."
    return accepted_differences(
        differences,
        override=override,
        problem="Scan and calculated stress are not of one set-up",
        why="A calibration divides by the stress that this rod makes below this film, in "
        "proportion to the load where the film's law is linear.",
        cure=cure,
    )


def _other_set_up(scan: Scan, stress: BaseStress, kind: str) -> Iterator[Difference]:
    """Yield what of film, rod and load a stress was not calculated for."""
    source = None if isinstance(stress, Contact) else stress.source
    places = (file_in_words(scan.source, "scan"), file_in_words(source, kind))
    film = film_of(stress)
    law = film.law if film else ""
    names = ["thickness", "poisson_ratio"]
    finite = {law, scan.film.law if scan.film and film else ""} - {"", LINEAR}
    if finite:
        # Equilibrium of a linear film holds its modulus as a factor on both sides: at a given load
        # the modulus changes depths, and no stress.
        names.append("young_modulus")
    if kind == "reference":
        names += ["law", "mooney_rivlin_ratio"]
    # What one side does not state does not differ.
    yield from stated_differences(FILM, names, (scan.film, film), places, "film")
    pair = scan.indenter, stress.indenter
    yield from stated_differences(INDENTER, ("shape", "radius"), pair, places, "rod")
    if kind == "reference" and finite:
        friction = stress.friction if isinstance(stress, Contact) else stress.friction_coefficient
        rods = scan, SimpleNamespace(rod_friction=friction)
        yield from stated_differences(LOAD, ("rod_friction",), rods, places)
    if law == LINEAR or (scan.load is None and scan.normal_load is None):
        return
    loads = (_farthest(scan, stress), stress)
    # Under another law the stress is not proportional to the load.
    there = f"{places[1]} (film: {law or 'law not stated'})"
    yield from stated_differences(LOAD, ("load",), loads, (places[0], there))


def _farthest(scan: Scan, stress: BaseStress) -> SimpleNamespace:
    """Return the load of the scan that agrees least with a stress's, and its uncertainty, in N."""
    loads = np.atleast_1d(scan.stated_load if scan.normal_load is None else scan.normal_load)
    stated = [u for u in (scan.load_uncertainty, scan.normal_load_errors) if u is not None]
    spread = np.sqrt(sum((np.square(u) for u in stated), start=np.zeros(loads.shape)))
    i = np.nanargmax(abs(loads - stress.load) - COVERAGE * spread)
    uncertainty = spread.flat[i] if stated else None
    return SimpleNamespace(load=loads.flat[i], load_uncertainty=uncertainty)


def file_in_words(source: SourceFile | None, kind: str) -> str:
    """Name what a file holds, for messages: "the scan rod.h5"."""
    return f"the {kind} {source.file_name}" if source else f"the {kind}"


def stated_differences(
    record: Record, names: Sequence[str], stated: Sequence[Any], places: Sequence[str], of: str = ""
) -> Iterator[Difference]:
    """Yield which quantities two sides both state, and with values that do not agree."""
    # Numbers agree within twice the standard uncertainty of their difference, or within 1e-6 of
    # them where no uncertainty is stated; texts if they are equal.
    for quantity in (q for q in record.quantities if q.name in names):
        values: list[Any] = [getattr(side, quantity.name, None) for side in stated]
        spreads = [getattr(side, f"{quantity.name}_uncertainty", None) for side in stated]
        if None in values or "" in values or values[0] == values[1]:
            continue
        allowed = COVERAGE * math.hypot(*(u or 0.0 for u in spreads))
        if not isinstance(values[0], str) and math.isclose(*values, rel_tol=_SAME, abs_tol=allowed):
            continue
        words = quantity.words if " of the " in quantity.words else f"{of} {quantity.words}"
        sides = []
        for value, spread in zip(values, spreads, strict=True):
            shown = f'"{value}"'
            if not isinstance(value, str):
                u = "not stated" if spread is None else f"{spread / quantity.scale:.2g}"
                unit = quantity.unit and f" {quantity.unit}"
                shown = f"{value / quantity.scale:.7g}{unit} (u {u})"
            sides.append(shown)
        yield (*places, words.strip(), *sides)


def accepted_differences(differences: Sequence[Difference], **words: Any) -> list[str]:
    """Refuse what does not agree; with ``override`` return it in words, each difference once."""
    accepted: list[str] = hook("accepted_differences")(differences, **words)
    return accepted
