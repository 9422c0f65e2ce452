"""Messages of a calibration: what a user has to know of its result beside the checks."""

from collections.abc import Container, Iterator, Sequence

import numpy as np

from memscal.calibration.drawn_scatter import LINEAR_METHODS, draw_count
from memscal.calibration.film_inference import FilmLawComparison
from memscal.calibration.prepare import Prepared
from memscal.calibration.stages import Solution
from memscal.calibration.uncertainty import Results, slow_noise_text
from memscal.estimation.points import loads_differ
from memscal.estimation.profile import ProfileEstimate, point_messages
from memscal.estimation.reference_spectra import RECTANGLE
from memscal.mechanics.contact import Contact
from memscal.model import checks as quality
from memscal.model.assumptions import ASSUMED, MOVED, Assumption
from memscal.model.checks import Message, QualityChecks
from memscal.model.film import LINEAR, NEO_HOOKEAN, law_in_words
from memscal.readings.noise_record import record_messages

#: Methods whose window is that of the stress's transform: nothing is left to say of them.
_WINDOWS = ("white-noise", "tikhonov", "bayesian")
#: An uncertainty is mostly of the form of G where that exceeds what is by chance so many times.
_MOSTLY = 2.0
#: Lines of the budget that count what is not stated.
_LINES = {
    "baseline_curvature": "baseline_curvature",
    "film_law": "model_form",
    "rod_friction": "rod_friction",
}


def calibration_messages(
    prepared: Prepared,
    solution: Solution,
    results: Results,
    checks: QualityChecks,
    laws: FilmLawComparison | None,
    assumptions: tuple[Assumption, ...],
) -> Iterator[Message]:
    """Yield the messages that accompany a result: what was decided, then warnings first."""
    estimate = solution.estimate
    channel = estimate.points.channel
    stress = solution.stress
    yield from quality.override_messages(prepared.overridden)
    if laws:
        yield laws.message
    if prepared.thickness:
        yield from prepared.thickness.messages
    yield from _unstated_load(prepared, solution)
    yield from quality.failed_check_messages(checks)
    if estimate.points.order:
        yield Message(
            "experimental",
            f"Channel {channel} is experimental: it was tested on synthetic data only. A and G are "
            "those of the shear at the base; the voltage is positive where the film pulls the "
            f"sensor towards larger {channel[0]}.",
        )
    if solution.per_repeat:
        yield _centres(solution)
    offsets = [abs(scan.line_offset) for scan in solution.scans]
    if max(offsets) > 0:
        distances = " and ".join(f"{offset * 1e3:.3f} mm" for offset in offsets)
        yield Message(
            "line_offset",
            f"The lines pass the sensor's centre at {distances}, each by the centre of the line "
            "across it: their positions are taken as those of one stage.",
        )
    clipped = round(sum(scan.at_ceiling for scan in prepared.as_stated))
    if clipped:
        yield Message("at_ceiling", quality.at_ceiling_text(clipped))
    if prepared.request.creep:
        yield Message("creep", f"Creep is corrected for by {prepared.request.creep}.")
    yield from point_messages(estimate)
    for scan in prepared.as_stated:
        yield from record_messages(scan)
    if not estimate.points.noise_stated:
        yield _noise(estimate, results)
    yield from _method(solution)
    yield from _form_of_g(results)
    form = stress.form
    if form:
        text = (
            f"The reference is a {form}, taken as exact: A is the reading over its unit, "
            f"{form.unit}. Film and rod do not enter: what they blur is in G."
        )
        yield Message("reference", f"{text} {form.notes}".strip())
    elif not isinstance(stress, Contact) and stress.convergence is None:
        yield Message(
            "convergence_unstated",
            "The reference states no convergence: its own error is not counted.",
        )
    counted = results.budget["conversion_constant"]
    if not form:
        yield from _law(solution, results)
        yield from _unstated(solution, counted)
    yield from _assumed(assumptions, counted)
    if solution.scan.synthetic is not None:
        yield Message("synthetic", "The scan is synthetic: its truth is stored in it.")


def _unstated_load(prepared: Prepared, solution: Solution) -> Iterator[Message]:
    """Say what load is taken where a scan states none."""
    if all(s.load is not None or s.normal_load is not None for s in prepared.as_stated):
        return
    solved = prepared.request.reference is None and prepared.as_stated[0].reference is None
    if prepared.reading.per == "Pa":
        yield Message(
            "load_of_reference",
            "No load is stated: it is taken to be that of the reference, "
            f"{solution.scan.stated_load:.4g} N (--relative takes none).",
        )
    elif prepared.reading.relative and solved:
        yield Message(
            "load_of_reference",
            f"No load is stated: {solution.stress.load:.3g} N is taken, under which the shape of "
            "the stress is calculated; of a linear film it is that of any load (--film-law "
            "linear).",
        )


def _centres(solution: Solution) -> Message:
    owners = np.array(solution.owners)
    centres = solution.estimate.centres
    apart = max(np.ptp(centres[owners == i], axis=0).max() for i in set(solution.owners))
    test = solution.apart
    reason = "as asked for (--centre per-repeat)"
    if loads_differ([scan.stated_load for scan in solution.scans]):
        reason = "as their loads differ, and with them the shape of the stress"
    elif test:
        reason = f"as one centre has a p-value of {test.p_value:.1g} (--centre common takes one)"
    return Message(
        quality.REPEAT_CENTRES,
        f"Each of the {owners.size} repeats has its own centre, baseline and drift, {reason}. The "
        f"centres are up to {apart * 1e6:.3g} um apart.",
    )


def _noise(estimate: ProfileEstimate, results: Results) -> Message:
    points = estimate.points
    slow = "Its correlation is not estimated."
    if estimate.slow:
        slow = slow_noise_text(estimate, estimate.slow, results)
    return Message(
        quality.NOISE_UNSTATED,
        f"u_{points.channel}_errors is absent: a noise of "
        f"{points.reading.text(estimate.noise_scale)} "
        "was estimated from the scan's scatter, so that chi-square cannot tell noise from "
        f"misfit of the same size, and has no p-value. {slow}",
    )


def _method(solution: Solution) -> Iterator[Message]:
    """Say where the uncertainty comes from if the method is no plain window."""
    method = solution.method
    if method.name in _WINDOWS:
        return
    how = "uncertainties are first-order through its effective window"
    if not isinstance(method, LINEAR_METHODS):
        how = "what noise adds to the uncertainties is the scatter of "
        how += f"{draw_count(solution)} draws of the voltages"
        how += " and of its own random numbers" if hasattr(method, "seed") else ""
    yield Message("method", f"Method {method.name}: {how}. {method.fails}")


def _form_of_g(results: Results) -> Iterator[Message]:
    """Say what of an uncertainty is by the prior of the form of G, which like scans share."""
    parts = []
    for name, words in (("conversion_constant", "A"), ("fwhm", "the full width")):
        budget = results.budget[name]
        form = np.hypot(budget["regularisation"], budget["window"])
        chance = np.hypot(budget["noise"], budget["baseline_curvature"])
        if form > _MOSTLY * chance:
            value = results.parameters[name]
            parts.append(f"{form / value:.1%} of {words} (by chance: {chance / value:.1%})")
    if parts:
        yield Message(
            "form_of_g",
            f"What form G may have, where noise or film hide it, makes {' and '.join(parts)}: "
            "lines regularisation and window of the budget. It is of a prior in which no sensor is "
            "exactly a Gaussian. Halves of a scan, and scans like it, share it: they agree better "
            "than that.",
        )


def _law(solution: Solution, results: Results) -> Iterator[Message]:
    """Say which law the reference has, and what is not known of it."""
    if not solution.on_films:
        return
    film = solution.scan.set_up.film
    law = film.law
    changes = results.changes
    parameters = results.parameters
    rows = [parameters.names.index(name) for name in MOVED[:2]]
    if law == LINEAR:
        yield Message(
            "film_law", "The film is taken as linear elastic, as stated; no other law is counted."
        )
        return

    def changed(by: str) -> str:
        if by not in changes:
            return "cannot be solved at this depth, and nothing is counted for it"
        a, sigma = changes[by][rows] / parameters.values[rows] / RECTANGLE
        return f"would change A by {a:+.1%} and sigma by {sigma:+.1%}"

    if not law:
        text = "The film's law is not stated (film/law, --film-law): "
        if isinstance(solution.stress, Contact):
            taken = law_in_words(solution.stress.film_of_law.law)
            text += f"it is taken as {taken}. "
        other = LINEAR if "model_form" in changes else law_in_words(NEO_HOOKEAN)
        text += f"A {other} film {changed('model_form')}."
        if "model_form" in changes:
            text += " Changes up to that, of either sign, count as equally likely (model_form)."
    else:
        text = (
            f"The film is taken as {film.law_text}, as stated; how far it departs "
            "from that, by viscosity, swelling or slip at the rod, is not in the uncertainties."
        )
        if isinstance(solution.stress, Contact):
            text += f" The rod is found by {solution.stress.discretisation}."
    if solution.scan.rod_friction is None:
        text += (
            " Whether it sticks under the rod is not stated (indenter/friction_coefficient, "
            "--rod-friction): "
        )
        if "rod_friction" in changes:
            text += f"the reference is midway. A film that sticks {changed('rod_friction')}, "
            text += "one that slides by the opposite: that is counted (rod_friction)."
        else:
            text += f"it is taken to stick, and sliding {changed('rod_friction')}."
    yield Message("film_law", text)


#: Sources of the budget that come from what is stated, or is not known of the film's law.
_INPUTS = (
    "young_modulus",
    "thickness",
    "poisson_ratio",
    "rod_radius",
    "load",
    "model_form",
    "gain",
)


def _unstated(solution: Solution, counted: Container[str]) -> list[Message]:
    """Return which inputs that no assumption is about state no uncertainty."""
    film = solution.scan.film
    if not film:
        return []
    if not any(source in counted for source in _INPUTS):
        text = "No uncertainty of film, rod and load is stated: ± counts noise alone."
        return [Message(quality.NOISE_ALONE, text)]
    uncertainties = {"rod radius": solution.scan.set_up.indenter.radius_uncertainty}
    # At a given load the stress in a linear film does not depend on its modulus.
    if film.law != LINEAR:
        uncertainties["Young's modulus"] = film.young_modulus_uncertainty
    return quality.uncertainty_unstated_messages(uncertainties)


def _assumed(assumptions: Sequence[Assumption], counted: Container[str]) -> Iterator[Message]:
    """Say what is taken for granted, and the size of each that moves A by one u."""
    listed = []
    for assumption in assumptions:
        if assumption.state == ASSUMED and _LINES.get(assumption.name) not in counted:
            reached = assumption.size_text("conversion_constant")
            listed.append(f"{assumption.words} ({assumption.measure}: {reached})")
    if listed:
        yield Message(
            "assumptions",
            "Taken for granted, and in no uncertainty; in brackets the size that moves A by one "
            f"standard uncertainty: {'; '.join(listed)}. State the uncertainty of one to have it "
            "counted.",
        )
