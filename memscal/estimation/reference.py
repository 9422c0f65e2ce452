"""Reference stress of a calibration: its source, its transform, and its sensitivities."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from types import SimpleNamespace

import numpy as np

from memscal.axisymmetry.hankel import ACROSS, RadialSpectrum, Wavenumbers, hankel_transform
from memscal.errors import ConvergenceError, DomainError, InputError
from memscal.estimation import points
from memscal.estimation.points import ScanPoints
from memscal.mechanics.contact import BaseStress, Contact
from memscal.mechanics.press_rod import is_tabulated, press_rod
from memscal.mechanics.tabulated_rod import largest_tabulated_load
from memscal.model.arrays import FloatArray
from memscal.model.film import LINEAR, NEO_HOOKEAN, ElasticFilm, more_and_less
from memscal.model.indenter import Rod
from memscal.model.records import FILM, INDENTER, LOAD
from memscal.model.scan import Scan, SetUp
from memscal.model.stress import StressProfile
from memscal.progress import counted
from memscal.readings.mistaken_unit import require_plausible

#: The film passes nothing of exp(-kh) beyond this: 2e-9 of the load.
_LARGEST_KH = 20.0
#: A Gaussian G of half the scan's step passes 3e-9 at this wavenumber times the step. A table's
#: transform is looked at so many wavenumbers, and ends at this share of its largest.
_PASSED = 4 * math.pi
_WAVENUMBERS = 400
_NOTHING = 1e-6
#: Two models differ by a bound, anywhere within which the truth may lie: a rectangle.
RECTANGLE = 1 / math.sqrt(3)
#: Rods of somewhat larger load are in the table, too, where it serves for varied inputs.
_MARGIN = 1.1
#: A table that ends inside the scan must have decayed to this share of its maximum.
_DECAYED = 1e-3
#: A field is taken as round where less than this share of it is not, at so many wavenumbers.
_ROUND = 0.005
_SEEN = 17


def is_source(stress: BaseStress | None) -> bool:
    """Whether a reference is a source that needs no film, rod and load."""
    return stress is not None and stress.form is not None


def require_one_kind(
    references: Sequence[BaseStress | None], alternatives: Sequence[BaseStress | None]
) -> None:
    """Refuse references that no one conversion constant belongs to."""
    forms = [reference and reference.form for reference in references]
    kinds = {form and (form.unit, getattr(form, "shape", "") == "slit") for form in forms}
    if len(kinds) > 1 or any(map(is_source, alternatives)) or (kinds != {None} and alternatives):
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
        why = "Scans that are fitted together share one apparatus function."
        cure = "Calibrate each sensor by itself; check /entry/instrument/stress_sensor."
        raise InputError(f"The scans are of {len(sensors)} sensors: {named}.", why=why, cure=cure)
    films: dict[str, ElasticFilm] = {}
    for film in (scan.film for scan in scans if scan.film is not None):
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
    if scan.indenter is not None and not isinstance(scan.indenter, Rod):
        raise InputError(
            f"The scan was made with a {scan.indenter.shape}, but a calibration needs a rod.",
            why="Only a contact smaller than the film's thickness is independent of friction and "
            "linear in load.",
            cure="Calibrate with a rod scan, then apply the apparatus function to this scan.",
        )
    if with_film_of(reference, scan).film is not None:
        require_plausible(scan)


def film_of(stress: BaseStress) -> ElasticFilm | None:
    """Return the film that a stress is stated to be below."""
    return stress.film_of_law if isinstance(stress, Contact) else stress.film


def with_film_of(reference: BaseStress | None, scan: Scan) -> Scan:
    """Return a scan with film and rod if the reference depends on them, else without."""
    stress = scan.reference if reference is None else reference
    if stress is None:
        return scan
    film = film_of(stress)
    rod = scan.indenter or stress.indenter
    if film is None or not isinstance(rod, Rod):
        return replace(scan, film=None, indenter=None, rod_friction=None)
    return replace(scan, film=scan.film or film, indenter=rod)


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
    given = [scan.reference if r is None else r for scan, r in zip(scans, references, strict=True)]
    differences: list[str] = []
    for kind, stresses in (("reference", given), ("alternative", alternatives)):
        for scan, stress in zip(scans, stresses, strict=False):
            if stress is not None and not (kind == "reference" and is_source(stress)):
                differences += _other_set_up(scan, stress, kind)
    cure = "Give a stress that was calculated for the scan (memscal reference), or correct the "
    cure += "value that is wrong."
    if any(text.startswith("load") for text in differences):
        cure += " If the film of the reference is linear, state it (memscal import --film-law "
        cure += "linear; ElasticFilm(law='linear') in Python)."
    return points.accepted_differences(
        differences,
        override=override,
        problem="Scan and calculated stress are not of one set-up",
        why="A calibration divides by the stress that this rod makes below this film, in "
        "proportion to the load where the film's law is linear.",
        cure=cure,
    )


def _other_set_up(scan: Scan, stress: BaseStress, kind: str) -> list[str]:
    """Return in words what of film, rod and load a stress was not calculated for."""
    source = None if isinstance(stress, Contact) else stress.source
    places = points.file_in_words(scan.source, "scan"), points.file_in_words(source, kind)
    film = film_of(stress)
    law = "" if film is None else film.law
    names = ["thickness", "poisson_ratio"]
    finite = {law, scan.film.law if scan.film and film else ""} - {"", LINEAR}
    if finite:
        # Equilibrium of a linear film holds its modulus as a factor on both sides: at a given load
        # the modulus changes depths, and no stress.
        names.append("young_modulus")
    if kind == "reference":
        names += ["law", "mooney_rivlin_ratio"]
    # What one side does not state does not differ.
    differences = points.stated_differences(FILM, names, (scan.film, film), places, "film")
    pair = scan.indenter, stress.indenter
    differences += points.stated_differences(INDENTER, ("shape", "radius"), pair, places, "rod")
    if kind == "reference" and finite:
        friction = stress.friction if isinstance(stress, Contact) else stress.friction_coefficient
        rods = scan, SimpleNamespace(rod_friction=friction)
        differences += points.stated_differences(LOAD, ("rod_friction",), rods, places)
    if law == LINEAR or (scan.load is None and scan.normal_load is None):
        return differences
    loads = (_farthest(scan, stress), stress)
    stated = f"law is {law or 'not stated'}"
    return differences + [
        f"{text}, whose {stated}: the stress is proportional to the load under a linear law only"
        for text in points.stated_differences(LOAD, ("load",), loads, places)
    ]


def _farthest(scan: Scan, stress: BaseStress) -> SimpleNamespace:
    """Return the load of the scan that agrees least with a stress's, and its uncertainty, in N."""
    loads = np.atleast_1d(scan.stated_load if scan.normal_load is None else scan.normal_load)
    stated = [u for u in (scan.load_uncertainty, scan.normal_load_errors) if u is not None]
    spread = np.sqrt(sum((np.square(u) for u in stated), start=np.zeros(loads.shape)))
    i = np.nanargmax(np.abs(loads - stress.load) - points.COVERAGE * spread)
    uncertainty = float(spread.flat[i]) if stated else None
    return SimpleNamespace(load=float(loads.flat[i]), load_uncertainty=uncertainty)


def reference_profile(scan: Scan, reference: BaseStress | None) -> BaseStress:
    """Choose the reference: the argument, the scan's own, or the rod on the expected film."""
    known = reference or scan.reference
    return known or press_rod(*scan.set_up.expected)


def expected_spectra(
    scans: Sequence[Scan], stresses: Sequence[BaseStress], references: Sequence[RadialSpectrum]
) -> tuple[RadialSpectrum, ...]:
    """Move transforms of stresses that are of a film as stated to those of the expected film."""
    moved = []
    for scan, stress, reference in zip(scans, stresses, references, strict=True):
        film = scan.film
        made_on = film_of(stress)
        stated = film is not None and made_on is not None and film.expected != film
        if stated and film and made_on and film.poisson_ratio == made_on.poisson_ratio:
            change = _difference(scan.set_up, reference, (scan.set_up.expected, scan.set_up))
            reference = replace(reference, values=reference.values + change)
        moved.append(reference)
    return tuple(moved)


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


def reference_spectra(
    references: Sequence[BaseStress],
    data: Sequence[ScanPoints],
    wavenumbers: Wavenumbers | None = None,
) -> tuple[RadialSpectrum, ...]:
    """Transforms of the references per newton, on common nodes that serve every distance."""
    pairs = list(zip(references, data, strict=True))
    if wavenumbers is None:
        last = max(_last_wavenumber(*pair) for pair in pairs)
        # Fields are lifted to squares that reach one span from the centre, to their corners.
        wavenumbers = Wavenumbers.covering(last, 1.5 * max(map(_span, data)))
    return tuple(_spectrum(stress, wavenumbers, points) for stress, points in pairs)


def _span(points: ScanPoints) -> float:
    return float(np.hypot(np.ptp(points.x), np.ptp(points.y)))


def _spectrum(stress: BaseStress, wavenumbers: Wavenumbers, points: ScanPoints) -> RadialSpectrum:
    values = _per_newton(stress, wavenumbers.k, _span(points), points.order)
    if isinstance(stress, Contact) or stress.form is None:
        return RadialSpectrum(wavenumbers, values, points.order)
    if stress.ideal is not None and stress.ideal.shape == "slit":
        if points.planar:
            why = "It is scanned across, along a line, and shows nothing of any other direction."
            cure = "Give a line scan."
            raise InputError("A slit is the reference of a raster.", why=why, cure=cure)
        return RadialSpectrum(wavenumbers, values, ACROSS, source=True)
    # What a scan samples of a field is looked at.
    seen = np.linspace(0.0, min(np.pi / points.step, wavenumbers.k[-1]), _SEEN)[1:]
    if stress.field is None or stress.field.unevenness(seen) < _ROUND:
        return RadialSpectrum(wavenumbers, values, source=True)
    from memscal.estimation.field_model import FieldSpectrum

    return FieldSpectrum(wavenumbers, values, source=True, field=stress.field, load=stress.load)


def _last_wavenumber(reference: BaseStress, points: ScanPoints) -> float:
    """Return the wavenumber (rad/m) beyond which a reference has nothing, or none that is seen."""
    if isinstance(reference, Contact):
        return _LARGEST_KH / reference.film.thickness
    form = reference.form
    # Of a source without an end, a Gaussian of half the step passes 1e-5 at the last wavenumber.
    passed = _PASSED if form is None else 0.75 * _PASSED
    k = np.linspace(0.0, passed / points.step, _WAVENUMBERS)[1:]
    values = form.transform(k) if form else hankel_transform(reference.r, reference.sigma_zz, k)
    values = np.abs(values)
    return float(k[values > _NOTHING * values.max()][-1])


def _per_newton(reference: BaseStress, k: FloatArray, span: float, order: int) -> FloatArray:
    if isinstance(reference, Contact):
        return _base_spectrum(reference, k.tobytes(), order) / reference.load
    if reference.form is not None and not order:
        return reference.form.transform(k) / reference.load
    stress = reference.sigma_rz if order else reference.sigma_zz
    if stress is None or (order and not stress.any()):
        raise InputError(
            "The reference holds no shear (sigma_rz), only the normal stress.",
            why="A tangential channel is calibrated with the shear at the base of the film.",
            cure="Give a reference with sigma_rz (memscal import --format reference --shear "
            "COLUMN), or leave it out to have the rod solved.",
        )
    _require_coverage(reference, stress, span)
    values = hankel_transform(reference.r, stress, k, order=order) / reference.load
    # Most of a shear, whatever the film, holds the film back.
    if order and values[int(np.argmax(np.abs(values)))] > 0:
        raise InputError(
            "The shear of the reference pulls the film outward.",
            why="sigma_rz is the traction of the base on the film, positive outward: a film that "
            "is squeezed outward is held back, and it is negative.",
            cure="Change the sign of sigma_rz in the reference (memscal import --shear-sign -1).",
        )
    if not order and values[0] <= 0:
        problem = "The stress of the reference adds up to a pull, not a push."
        why = "Normal stress is positive in compression."
        raise InputError(problem, why=why, cure="Change the sign of sigma_zz in the reference.")
    return values


@lru_cache(maxsize=256)
def _base_spectrum(contact: Contact, nodes: bytes, order: int) -> FloatArray:
    """Transform of a contact's stress at wavenumbers, kept for scans over the same positions."""
    k = np.frombuffer(nodes)
    values = contact.base_shear_spectrum(k) if order else contact.base_spectrum(k)
    values.flags.writeable = False
    return values


def carried_force(stress: BaseStress, reference: RadialSpectrum) -> float:
    """Force that a reference (a shear: its normal stress) carries, over its load; 1 of a source."""
    if is_source(stress):
        return 1.0
    if reference.order == 0:
        return reference.integral
    return 1.0 if isinstance(stress, Contact) else stress.force / stress.load


def _require_coverage(profile: StressProfile, stress: FloatArray, span: float) -> None:
    needed = span / 2
    tail = abs(float(stress[-1])) / float(np.abs(stress).max())
    if profile.r[-1] < needed and tail > _DECAYED:
        raise InputError(
            f"The reference ends at r = {profile.r[-1] * 1e3:.4g} mm with {tail:.1%} of its "
            f"maximum left, but the scan reaches {needed * 1e3:.4g} mm from its middle.",
            why="The stress beyond the table would be missing from every distant point.",
            cure="Extend the reference to where it has decayed, or leave it out to compute it.",
        )
    first = float(profile.r[0])
    if first > 0.1 * needed:
        why = "The stress on the axis, its largest, is missing."
        cure = "Give the reference from r = 0 outward."
        raise InputError(f"The reference begins at r = {first * 1e3:.4g} mm.", why=why, cure=cure)


def reference_sensitivities(
    scans: Sequence[Scan], references: Sequence[RadialSpectrum]
) -> dict[str, list[FloatArray]]:
    """Change of each scan's transform by one standard uncertainty of each input, by its name."""
    # Scans share the error of a common film or rod, and that of the film's law.
    changes: dict[str, list[FloatArray]] = {}
    of_inputs = film_sensitivities, rod_sensitivities, law_sensitivities
    inputs = zip(of_inputs, ("film", "indenter", "law"), strict=True)
    todo = [(function, of, i) for function, of in inputs for i in range(len(scans))]
    found = (f(scans[i].set_up, references[i]) if scans[i].film else {} for f, _, i in todo)
    done = counted(found, "uncertain inputs", len(todo))
    for (_, of, i), by_source in zip(todo, done, strict=True):
        owners = [getattr(scan, of, None) for scan in scans]
        number = list(dict.fromkeys(owners)).index(owners[i])
        suffix = f"_{number + 1}" if number else ""
        for source, change in by_source.items():
            blank = [np.zeros_like(change) for _ in scans]
            changes.setdefault(source + suffix, blank)[i] = change
    return changes


def film_sensitivities(set_up: SetUp, reference: RadialSpectrum) -> Mapping[str, FloatArray]:
    """Change of the reference's transform by one standard uncertainty of each film property."""
    # Centred differences of the rod's solution, or its relative change for a reference from
    # elsewhere.
    set_up = set_up.expected
    film = set_up.film
    changes: dict[str, FloatArray] = {}
    if film.young_modulus_uncertainty is not None:
        changes["young_modulus"] = np.zeros_like(reference.values)
    # At a given load the modulus does not change the stress in a linear film.
    names = ["thickness", "poisson_ratio"]
    for name in names if film.law in ("", LINEAR) else ["young_modulus", *names]:
        if ends := more_and_less(film, name):
            *films, share = ends
            varied = [set_up._replace(film=film) for film in films]
            changes[name] = share * _difference(set_up, reference, varied)
    return changes


def rod_sensitivities(set_up: SetUp, reference: RadialSpectrum) -> Mapping[str, FloatArray]:
    """Change of the reference's transform by one standard uncertainty of the rod's radius."""
    rod = set_up.indenter
    if not (u := rod.radius_uncertainty):
        return {}
    radii = (rod.radius + u, max(rod.radius - u, rod.radius / 2))
    varied = [set_up._replace(indenter=replace(rod, radius=radius)) for radius in radii]
    return {"rod_radius": _difference(set_up, reference, varied) / 2}


def load_sensitivities(
    scans: Sequence[Scan], references: Sequence[RadialSpectrum]
) -> list[FloatArray]:
    """Change of each scan's transform, per newton, by one standard uncertainty of its load."""
    # None in a linear film; in others the stress spreads with the load over E h^2.
    changes = [np.zeros_like(reference.values) for reference in references]
    for i, (scan, reference) in enumerate(zip(scans, references, strict=True)):
        if scan.film and scan.film.law not in ("", LINEAR) and scan.load_uncertainty:
            set_up = scan.set_up.expected
            u = scan.load_uncertainty
            varied = [set_up._replace(load=load) for load in (set_up.load + u, set_up.load - u)]
            changes[i] = _difference(set_up, reference, varied) / 2
    return changes


def press_neo_hookean(set_up: SetUp) -> Contact:
    """Press a rod on its film as if that were neo-Hookean, and stuck to it."""
    # One that slides differs less from a linear film, and is not solved to any depth.
    return press_rod(*set_up.expected.under(NEO_HOOKEAN)._replace(rod_friction=None))


def law_sensitivities(set_up: SetUp, reference: RadialSpectrum) -> Mapping[str, FloatArray]:
    """Change of the reference's transform by what is not known of the film's law."""
    # Rectangles, of which the standard uncertainty is the half width over the root of three: where
    # no law is stated (``model_form``) the difference of neo-Hookean and linear film, and of a film
    # at finite strain whose rod's friction is not stated (``rod_friction``) that of sticking and
    # sliding. Nothing where the rod goes deeper than is solved.
    film, rod, load, friction = set_up
    if film.law == LINEAR or (film.law and friction is not None):
        return {}
    k = reference.wavenumbers.k.tobytes()
    order = reference.order
    rubber = set_up.under(NEO_HOOKEAN).film
    end = load
    if film.law and isinstance(rod, Rod):
        # A film that slides is drawn out from under the rod, and is not solved to any depth.
        end = min(load, 0.999 * largest_tabulated_load(rubber, rod, sticking=False)) or load
    try:
        if not film.law:
            pair = press_neo_hookean(set_up), press_rod(film, rod, load)
        else:
            pair = press_rod(rubber, rod, end, math.inf), press_rod(rubber, rod, end, 0.0)
    except (ConvergenceError, DomainError):
        return {}
    change = np.subtract(*(_base_spectrum(c, k, order) / c.load for c in pair))
    source = "rod_friction" if film.law else "model_form"
    return {source: RECTANGLE * change * load / pair[0].load}


def _difference(set_up: SetUp, reference: RadialSpectrum, varied: Sequence[SetUp]) -> FloatArray:
    """Difference of two rods per newton, scaled from the scan's own rod to the reference."""
    k = reference.wavenumbers.k.tobytes()
    order = reference.order
    return reference.values * _relative_difference(set_up, *varied, k, order)


@lru_cache(maxsize=256)
def _relative_difference(
    set_up: SetUp, more: SetUp, less: SetUp, nodes: bytes, order: int
) -> FloatArray:
    """Difference of two rods per newton over the scan's own, kept for scans of other voltages."""
    law = law_at_once(set_up)
    upper, lower, own = (
        _rod_at(nodes, rod, law, order) / (rod.load / set_up.load) for rod in (more, less, set_up)
    )
    return relative(upper - lower, own)


def relative(values: FloatArray, own: FloatArray) -> FloatArray:
    """Ratio of two transforms, 0 where the second ends."""
    return np.divide(values, own, out=np.zeros_like(own), where=own != 0)


def law_at_once(set_up: SetUp) -> str:
    """Law by which such rods are solved in milliseconds: the film's own, or the nearest one."""
    if set_up.film.law in ("", LINEAR):
        return LINEAR
    larger = set_up.under(NEO_HOOKEAN)._replace(load=_MARGIN * set_up.load)
    return NEO_HOOKEAN if is_tabulated(*larger) else LINEAR


def rod_spectrum(set_up: SetUp, reference: RadialSpectrum, law: str) -> FloatArray:
    """Transform of the base stress of a rod, by a law, at the nodes of a reference (N)."""
    return _rod_at(reference.wavenumbers.k.tobytes(), set_up, law, reference.order)


def _rod_at(nodes: bytes, set_up: SetUp, law: str, order: int) -> FloatArray:
    return _base_spectrum(press_rod(*set_up.under(law)), nodes, order)
