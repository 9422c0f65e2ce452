"""Spectra of reference stresses, and their change with the film's thickness and other inputs."""

import math
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from functools import lru_cache
from itertools import product

import numpy as np

from memscal.axisymmetry.hankel import (
    ACROSS,
    RadialSpectrum,
    Wavenumbers,
    hankel_transform,
    quotient,
)
from memscal.errors import FitError, InputError
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import MOST_AT_START, fit_gaussian_to_points, some_points
from memscal.estimation.points import ScanPoints
from memscal.estimation.set_up import film_of
from memscal.mechanics.contact import BaseStress, Contact
from memscal.mechanics.press_rod import UNSOLVED, is_tabulated, press_rod, stick_and_slide
from memscal.model.arrays import Arrays, FloatArray
from memscal.model.film import LINEAR, NEO_HOOKEAN, more_and_less
from memscal.model.indenter import Rod
from memscal.model.scan import Scan, SetUp
from memscal.model.stress import StressProfile
from memscal.progress import Task

#: The film passes nothing of exp(-kh) beyond this: 2e-9 of the load.
_LARGEST_KH = 20.0
#: A Gaussian G passes 3e-9 at this wavenumber times its width, and 1e-5 at the second, where a
#: source without an end is cut off. A table's transform is looked at so many wavenumbers, and ends
#: at this share of its largest.
_PASSED = 2 * math.pi
_PASSED_OF_SOURCE = 1.5 * math.pi
#: The narrowest G is half a step wide; of many points the narrowest kernel by this share of G's.
_NARROWEST = 0.15
_WAVENUMBERS = 400
_NOTHING = 1e-6
#: A bound, anywhere within which the truth may lie, over its half width: a rectangle.
RECTANGLE = 1 / math.sqrt(3)
#: Rods of somewhat larger load are in the table, too, where it serves for varied inputs.
_MARGIN = 1.1
#: A table that ends inside the scan must have decayed to this share of its maximum.
_DECAYED = 1e-3
#: A field is taken as round where less than this share of it is not, at so many wavenumbers.
_ROUND = 0.005
_SEEN = 17


def expected_spectra(
    scans: Sequence[Scan], stresses: Sequence[BaseStress], references: Sequence[RadialSpectrum]
) -> tuple[RadialSpectrum, ...]:
    """Move transforms of stresses that are of a film as stated to those of the expected film."""
    moved = []
    for scan, stress, reference in zip(scans, stresses, references, strict=True):
        film = scan.film
        made_on = film_of(stress)
        same_ratio = film and made_on and film.poisson_ratio == made_on.poisson_ratio
        if film and same_ratio and film.expected != film:
            set_up = scan.set_up
            change = difference(set_up, reference, set_up.expected, set_up)
            reference = replace(reference, values=reference.values + change)
        moved.append(reference)
    return tuple(moved)


def reference_spectra(
    references: Sequence[BaseStress],
    data: Sequence[ScanPoints],
    wavenumbers: Wavenumbers | None = None,
) -> tuple[RadialSpectrum, ...]:
    """Transforms of the references per newton, on common nodes that serve every distance."""
    pairs = list(zip(references, data, strict=True))
    if wavenumbers is None:
        last = max(_last_wavenumber(stress, points) for stress, points in pairs)
        # Fields are lifted to squares that reach one span from the centre, to their corners.
        wavenumbers = Wavenumbers.covering(last, 1.5 * max(points.span for points in data))
    return tuple(_spectrum(stress, wavenumbers, points) for stress, points in pairs)


def _spectrum(stress: BaseStress, wavenumbers: Wavenumbers, points: ScanPoints) -> RadialSpectrum:
    order = points.order
    if isinstance(stress, Contact):
        values = _base_spectrum(stress, wavenumbers.k.tobytes(), order) / stress.load
        return RadialSpectrum(wavenumbers, values, order)
    if not stress.form or order:
        values = _table_spectrum(stress, wavenumbers.k, points.span, order)
        return RadialSpectrum(wavenumbers, values, order)
    values = stress.form.transform(wavenumbers.k) / stress.load
    if stress.ideal and stress.ideal.shape == "slit":
        if points.planar:
            raise InputError(
                "A slit is the reference of a raster.",
                why="It is scanned across, along a line, and shows nothing of any other direction.",
                cure="Give a line scan.",
            )
        return RadialSpectrum(wavenumbers, values, ACROSS, source=True)
    # What a scan samples of a field is looked at.
    seen = np.linspace(0.0, min(np.pi / points.step, wavenumbers.k[-1]), _SEEN)[1:]
    if not stress.field or stress.field.unevenness(seen) < _ROUND:
        return RadialSpectrum(wavenumbers, values, source=True)
    from memscal.estimation.field_model import FieldSpectrum

    return FieldSpectrum(wavenumbers, values, source=True, field=stress.field, load=stress.load)


def _last_wavenumber(reference: BaseStress, points: ScanPoints) -> float:
    """Return the wavenumber (rad/m) beyond which a reference has nothing, or none that is seen."""
    if isinstance(reference, Contact):
        return _LARGEST_KH / reference.film.thickness
    form = reference.form
    width = 0.5 * points.step
    last = _PASSED / width
    if form:
        last = _PASSED_OF_SOURCE / max(width, _narrowest_kernel(reference, points))
    k = np.linspace(0.0, last, _WAVENUMBERS)[1:]
    values = form.transform(k) if form else hankel_transform(reference.r, reference.sigma_zz, k)
    size = abs(values)
    return float(k[size > _NOTHING * size.max()][-1])


def _narrowest_kernel(reference: StressProfile, points: ScanPoints) -> float:
    """Width (m) of the narrowest kernel by a fit to some of many points; zero of few."""
    count = points.u.size
    if count <= MOST_AT_START:
        return 0.0
    some = points.selected(some_points(points))
    last = _PASSED_OF_SOURCE / (0.5 * points.step * math.sqrt(count / some.u.size))
    spectra = reference_spectra([reference], [some], Wavenumbers.covering(last, 1.5 * some.span))
    try:
        fit = fit_gaussian_to_points(ForwardModel(some, spectra), np.ones_like(some.u))
    except FitError:
        return 0.0
    return _NARROWEST * fit.sigma


def _table_spectrum(reference: StressProfile, k: FloatArray, span: float, order: int) -> FloatArray:
    stress = reference.sigma_rz if order else reference.sigma_zz
    if stress is None or (order and not stress.any()):
        raise InputError(
            "The reference holds no shear (sigma_rz), only the normal stress.",
            why="A tangential channel is calibrated with the shear at the base of the film.",
            cure="Give a reference with sigma_rz (memscal import --format reference --shear "
            "COLUMN), or leave it out to have the rod solved.",
        )
    needed = span / 2
    tail = abs(stress[-1]) / abs(stress).max()
    if reference.r[-1] < needed and tail > _DECAYED:
        raise InputError(
            f"The reference ends at r = {reference.r[-1] * 1e3:.4g} mm with {tail:.1%} of its "
            f"maximum left, but the scan reaches {needed * 1e3:.4g} mm from its middle.",
            why="The stress beyond the table would be missing from every distant point.",
            cure="Extend the reference to where it has decayed, or leave it out to compute it.",
        )
    if reference.r[0] > 0.1 * needed:
        raise InputError(
            f"The reference begins at r = {reference.r[0] * 1e3:.4g} mm.",
            why="The stress on the axis, its largest, is missing.",
            cure="Give the reference from r = 0 outward.",
        )
    values = hankel_transform(reference.r, stress, k, order=order) / reference.load
    # Most of a shear, whatever the film, holds the film back.
    if order and values[np.argmax(abs(values))] > 0:
        raise InputError(
            "The shear of the reference pulls the film outward.",
            why="sigma_rz is the traction of the base on the film, positive outward: a film that "
            "is squeezed outward is held back, and it is negative.",
            cure="Change the sign of sigma_rz in the reference (memscal import --shear-sign -1).",
        )
    if not order and values[0] <= 0:
        raise InputError(
            "The stress of the reference adds up to a pull, not a push.",
            why="Normal stress is positive in compression.",
            cure="Change the sign of sigma_zz in the reference.",
        )
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
    if stress.form:
        return 1.0
    if reference.order == 0:
        return reference.integral
    return 1.0 if isinstance(stress, Contact) else stress.force / stress.load


def reference_sensitivities(
    scans: Sequence[Scan], references: Sequence[RadialSpectrum]
) -> dict[str, list[FloatArray]]:
    """Change of each scan's transform by one standard uncertainty of each input, by its name."""
    changes: dict[str, list[FloatArray]] = {}
    todo = list(product((*_STATED, "law"), range(len(scans))))
    for owner, i in Task("uncertain inputs", len(todo)).counted(todo):
        if not scans[i].film:
            continue
        # Scans share the error of a common film or rod, and that of the film's law.
        owners = [getattr(scan, owner, None) for scan in scans]
        number = list(dict.fromkeys(owners)).index(owners[i])
        suffix = f"_{number + 1}" if number else ""
        if owner == "law":
            found = law_sensitivities(scans[i].set_up, references[i])
        else:
            found = stated_sensitivities(scans[i].set_up, references[i], owner)
        for source, change in found.items():
            blank = [np.zeros_like(change) for _ in scans]
            changes.setdefault(source + suffix, blank)[i] = change
    return changes


#: Uncertain quantities of film and indenter, and the names of what they change.
_STATED = {
    "film": {name: name for name in ("young_modulus", "thickness", "poisson_ratio")},
    "indenter": {"radius": "rod_radius"},
}


def stated_sensitivities(set_up: SetUp, reference: RadialSpectrum, owner: str) -> Arrays:
    """Change of the reference's transform by each uncertainty stated of a film or an indenter."""
    # Centred differences of the rod's solution, or its relative change for a reference from
    # elsewhere.  At a given load the modulus does not change the stress in a linear film.
    changes = {}
    if owner == "film":
        set_up = set_up.expected
    for name, source in _STATED[owner].items():
        ends = more_and_less(getattr(set_up, owner), name)
        if ends:
            more, less, share = ends
            varied = (set_up._replace(**{owner: more}), set_up._replace(**{owner: less}))
            changes[source] = share * difference(set_up, reference, *varied)
    return changes


def load_sensitivities(
    scans: Sequence[Scan], references: Sequence[RadialSpectrum]
) -> list[FloatArray]:
    """Change of each scan's transform, per newton, by one standard uncertainty of its load."""
    # None in a linear film; in others the stress spreads with the load over E h^2.
    changes = [np.zeros_like(reference.values) for reference in references]
    for i, (scan, reference) in enumerate(zip(scans, references, strict=True)):
        if scan.film and scan.film.law != LINEAR and scan.load_uncertainty:
            set_up = scan.set_up.expected
            more = set_up._replace(load=set_up.load + scan.load_uncertainty)
            less = set_up._replace(load=set_up.load - scan.load_uncertainty)
            changes[i] = difference(set_up, reference, more, less) / 2
    return changes


def law_sensitivities(set_up: SetUp, reference: RadialSpectrum) -> Arrays:
    """Change of the reference's transform by what is not known of the film's law."""
    # Rectangles: half as wide as the difference of a linear film is large where no law is stated
    # (``model_form``), and as half that of sticking and sliding where the friction of a rod on a
    # film at finite strain is not (``rod_friction``), for the reference is midway.
    film = set_up.film
    changes: Arrays = {}
    if film.law == LINEAR or not isinstance(set_up.indenter, Rod):
        return changes
    if not film.law:
        own = press_rod(*set_up)
        if own.strain == "linear":
            return changes
        linear = press_rod(*set_up.under(LINEAR))
        changes["model_form"] = RECTANGLE * spectrum_difference(reference, linear, own)
    if set_up.rod_friction is None:
        with suppress(*UNSOLVED):
            ends = stick_and_slide(film, set_up.indenter, set_up.load)
            # Per newton the difference of rods that are solved at less load grows with the load.
            half = RECTANGLE * set_up.load / ends[0].load / 2
            changes["rod_friction"] = half * spectrum_difference(reference, *ends)
    return changes


def spectrum_difference(reference: RadialSpectrum, first: Contact, second: Contact) -> FloatArray:
    """Difference of the base stress of two contacts, per newton, at the nodes of a reference."""
    k = reference.wavenumbers.k.tobytes()
    upper, lower = (_base_spectrum(c, k, reference.order) / c.load for c in (first, second))
    return upper - lower


def difference(set_up: SetUp, reference: RadialSpectrum, more: SetUp, less: SetUp) -> FloatArray:
    """Difference of two rods per newton, scaled from the scan's own rod to the reference."""
    law = law_at_once(set_up)
    rods = (more, less, set_up)
    upper, lower, own = (rod_spectrum(r, reference, law) / r.load for r in rods)
    # Zero where the scan's own ends.
    return reference.values * quotient(upper - lower, own)


def law_at_once(set_up: SetUp) -> str:
    """Law by which such rods are solved in milliseconds: the film's own, or the nearest one."""
    if set_up.film.law == LINEAR:
        return LINEAR
    larger = set_up.under(NEO_HOOKEAN)._replace(load=_MARGIN * set_up.load)
    return NEO_HOOKEAN if is_tabulated(*larger) else LINEAR


def rod_spectrum(set_up: SetUp, reference: RadialSpectrum, law: str) -> FloatArray:
    """Transform of the base stress of a rod, by a law, at the nodes of a reference (N)."""
    nodes = reference.wavenumbers.k.tobytes()
    return _base_spectrum(press_rod(*set_up.under(law)), nodes, reference.order)
