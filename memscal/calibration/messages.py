"""Messages of a calibration: what a user has to know of its result beside the checks."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from memscal.calibration.drawn_scatter import draw_count, is_linear
from memscal.calibration.film_inference import FilmLawComparison
from memscal.calibration.prepare import Prepared
from memscal.calibration.stages import Solution
from memscal.calibration.uncertainty import Results, changes_by, input_effects
from memscal.estimation.bayesian import HYPOTHESES
from memscal.estimation.points import loads_differ
from memscal.estimation.profile import ProfileEstimate, point_messages
from memscal.estimation.reference_spectra import RECTANGLE
from memscal.estimation.set_up import is_source
from memscal.mechanics.contact import Contact
from memscal.mechanics.press_rod import is_tabulated
from memscal.model import checks as quality
from memscal.model.apparatus import ParameterSet
from memscal.model.arrays import FloatArray
from memscal.model.checks import Message, QualityCheck
from memscal.model.film import LINEAR, NEO_HOOKEAN
from memscal.model.scan import Scan

#: Methods whose window is that of the stress's transform: nothing is left to say of them.
_WINDOWS = ("white-noise", "tikhonov", "bayesian")
#: Tails of less probability are not told.
_LEAST_TOLD = 0.001


def calibration_messages(
    prepared: Prepared,
    solution: Solution,
    results: Results,
    checks: tuple[QualityCheck, ...],
    laws: FilmLawComparison | None,
) -> tuple[Message, ...]:
    """Return the messages that accompany a result: what was decided, then warnings first."""
    scan = solution.scan
    channel = solution.estimate.points.channel
    messages = list(quality.override_messages(prepared.overridden))
    if laws is not None:
        messages.append(laws.message)
    if prepared.thickness is not None:
        messages += prepared.thickness.messages
    loads = [s.load if s.normal_load is None else s.normal_load for s in prepared.as_stated]
    if prepared.reading.per == "Pa" and any(load is None for load in loads):
        load = f"{scan.stated_load:.4g} N (--relative takes none)"
        text = f"No load is stated: it is taken to be that of the reference, {load}."
        messages.append(Message("load_of_reference", text))
    messages += quality.failed_check_messages(checks)
    if solution.estimate.model.order:
        text = (
            f"Channel {channel} is experimental: it was tested on synthetic data only. A and G are "
            "those of the shear at the base; the voltage is positive where the film pulls the "
            f"sensor towards larger {channel[0]}."
        )
        messages.append(Message("experimental", text))
    messages += _centres(solution) + _points(solution.estimate) + _tails(solution.estimate)
    messages += _directions(solution.estimate, checks) + _method(solution)
    stress = solution.stress
    if not isinstance(stress, Contact) and (form := stress.form) is not None:
        text = (
            f"The reference is a {form}, taken as exact: A is the reading over its unit, "
            f"{form.unit}. Film and rod that the scan states are not used."
        )
        messages.append(Message("reference", f"{text} {form.notes}".strip()))
    elif not isinstance(stress, Contact) and stress.convergence is None:
        text = "The reference states no convergence: its own error is not counted."
        messages.append(Message("convergence_unstated", text))
    if not is_source(stress):
        messages += _law(solution, results) + _unstated(solution, results)
    if scan.synthetic is not None:
        messages.append(Message("synthetic", "The scan is synthetic: its truth is stored in it."))
    return tuple(messages)


def _centres(solution: Solution) -> list[Message]:
    if not solution.per_repeat:
        return []
    owners = np.array(solution.owners)
    centres = solution.estimate.centres
    apart = max(float(np.ptp(centres[owners == i], axis=0).max()) for i in set(owners))
    test = solution.apart
    way = "as asked for (--centre per-repeat)"
    if loads_differ([scan.stated_load for scan in solution.scans]):
        way = "as their loads differ, and with them the shape of the stress"
    elif test is not None:
        way = f"as one centre has a p-value of {test.p_value:.1g} (--centre common takes one)"
    text = (
        f"Each of the {owners.size} repeats has its own centre, baseline and drift, {way}. The "
        f"centres are up to {apart * 1e6:.3g} um apart."
    )
    return [Message(quality.REPEAT_CENTRES, text)]


def _points(estimate: ProfileEstimate) -> list[Message]:
    points = estimate.points
    messages = point_messages(estimate)
    if points.u_errors is None:
        text = (
            f"u_{points.channel}_errors is absent: a noise of "
            f"{points.reading.text(estimate.noise_scale)} "
            "was estimated from the scan's scatter, so that chi-square cannot tell noise from "
            "misfit of the same size, and has no p-value."
        )
        messages.append(Message(quality.NOISE_UNSTATED, text))
    return messages


def _directions(estimate: ProfileEstimate, checks: tuple[QualityCheck, ...]) -> list[Message]:
    fall = next((c.value for c in checks if c.name == "axisymmetry"), 0.0)
    if fall <= quality.chi_square_limit(2):
        return []
    size = float(np.abs(estimate.oval).max()) / estimate.largest_signal
    text = (
        f"The sensor is not round: what differs between directions makes up {size:.1%} of the "
        "largest signal. The field has it; the radial profile is a mean over directions "
        "(predict(x, stress, y=y) takes the field)."
    )
    return [Message("not_round", text)]


def _tails(estimate: ProfileEstimate) -> list[Message]:
    """Return what a tail that the scan hardly tells from the baseline would change in A."""
    probability, change = estimate.weighed.of_kind("wide tail", estimate.departures.integrals)
    if probability < _LEAST_TOLD:
        return []
    prior = sum(h.estimate for h in HYPOTHESES if h.kind == "wide tail")
    a = estimate.conversion_constant
    text = (
        "Tails of G two to three times as wide as its core have a probability of "
        f"{probability:.2g} (prior {prior:.2g}). With them A by method bayesian is "
        f"{abs(change) / a:.2%} {'larger' if change > 0 else 'smaller'} than without; it is the "
        "mean of both."
    )
    return [Message("wide_tails", text)]


def _method(solution: Solution) -> list[Message]:
    """Return where the uncertainty comes from if the method is no plain window."""
    method = solution.method
    if method.name in _WINDOWS:
        return []
    way = "uncertainties are first-order through its effective window"
    if not is_linear(method):
        way = "what noise adds to the uncertainties is the scatter of "
        way += f"{draw_count(solution)} draws of the voltages"
        way += " and of its own random numbers" if hasattr(method, "seed") else ""
    return [Message("method", f"Method {method.name}: {way}. {method.fails}")]


def _law(solution: Solution, results: Results) -> list[Message]:
    """Return which law the reference has, and what is not known of it."""
    if any(scan.film is None for scan in solution.scans):
        return []
    film = solution.scan.set_up.film
    law = film.law
    changes = results.changes
    if law == LINEAR:
        rubbers = [scan.set_up.under(NEO_HOOKEAN) for scan in solution.scans]
        if not all(is_tabulated(*rubber) for rubber in rubbers):
            text = "The film is taken as linear elastic, as stated; no other law is counted."
            return [Message("film_law", text)]
        changes = _changes(
            solution,
            results,
            [replace(scan, film=replace(scan.set_up.film, law="")) for scan in solution.scans],
        )

    def changed(by: str, sign: int) -> str:
        if by not in changes:
            return "cannot be solved at this depth, and nothing is counted for it"
        change = sign * changes[by] / RECTANGLE
        rows = _a_and_sigma(results.parameters)
        words = [f"{symbol} by {change[i] / value:+.1%}" for symbol, i, value in rows]
        return f"would change {' and '.join(words)}"

    if law in ("", LINEAR):
        rubber = f"a neo-Hookean film under a rod that sticks {changed('model_form', 1)}"
    if law == LINEAR:
        text = f"The film is taken as linear elastic, as stated; {rubber}: it is not counted."
    elif not law:
        text = (
            "The film's law is not stated (film/law, --film-law), and the reference is that of a "
            f"linear film; {rubber}."
        )
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
                f"--rod-friction): it is taken to stick, and sliding {changed('rod_friction', -1)}."
            )
            text += " The difference is counted (rod_friction)." * ("rod_friction" in changes)
    return [Message("film_law", text)]


def _changes(
    solution: Solution, results: Results, scans: Sequence[Scan]
) -> Mapping[str, FloatArray]:
    """Changes of the parameters by one standard uncertainty of what these scans state."""
    effects = input_effects(scans, solution.stresses, solution.estimate)
    parameters = results.parameters
    changes = changes_by(effects, results.by_voltage, parameters.names, parameters.values)
    return dict(zip(effects, changes, strict=True))


#: Film properties by their names in messages, with their symbols; the share by which one that
#: states no uncertainty is varied.
_OF_FILM = {
    "film thickness": ("thickness", "h"),
    "Young's modulus": ("young_modulus", "E"),
    "Poisson's ratio": ("poisson_ratio", "nu"),
}
_VARIED = 0.01


def _unstated(solution: Solution, results: Results) -> list[Message]:
    """Return which inputs state no uncertainty, and how much hangs on those of the film."""
    film = solution.scan.film
    scan = solution.scan
    missing = {}
    if film is not None:
        # At a given load the stress in a linear film does not depend on its modulus.
        names = [n for n in _OF_FILM if n != "Young's modulus" or film.law not in ("", LINEAR)]
        missing = {name: getattr(film, f"{_OF_FILM[name][0]}_uncertainty") for name in names}
        missing["rod radius"] = scan.set_up.indenter.radius_uncertainty
    if results.parameters.reading.per == "Pa":
        missing["load"] = scan.load_uncertainty
    messages = quality.uncertainty_unstated_messages(missing)
    varied = {name: of for name, of in _OF_FILM.items() if missing.get(name, 0.0) is None}
    if varied:
        shares = {f"{a}_uncertainty": _VARIED * getattr(film, a) for a, _ in varied.values()}
        films = [replace(s.set_up.film, **shares) for s in solution.scans]
        pairs = zip(solution.scans, films, strict=True)
        changes = _changes(solution, results, [replace(s, film=film) for s, film in pairs])
        slopes = [
            f"d ln {symbol}/d ln {of} = {float(changes[a][row] / value / _VARIED):+.2f}"
            for a, of in varied.values()
            if a in changes  # a share of a value near zero changes nothing
            for symbol, row, value in _a_and_sigma(results.parameters)
        ]
        messages = [
            replace(m, text=f"{m.text} {', '.join(slopes)}.") if slopes else m for m in messages
        ]
    return messages


def _a_and_sigma(parameters: ParameterSet) -> list[tuple[str, int, float]]:
    """Return symbol, place and value of A and of the fitted width."""
    pairs = (("A", "conversion_constant"), ("sigma", "gaussian_sigma"))
    return [(symbol, parameters.names.index(name), parameters[name]) for symbol, name in pairs]
