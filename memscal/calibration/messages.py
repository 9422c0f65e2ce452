"""Messages of a calibration."""

from __future__ import annotations

from memscal.calibration.solution import Solution
from memscal.estimation.profile_estimate import ProfileEstimate
from memscal.mechanics.contact import Contact
from memscal.model.checks import (
    NOISE_UNSTATED,
    OUTLIER_WEIGHT,
    Message,
    QualityCheck,
    failed_check_messages,
)
from memscal.model.indenter import RoundIndenter
from memscal.model.scan import Scan
from memscal.model.stress import StressProfile

__all__ = ["calibration_messages"]

#: Methods that are a fixed window or none: their uncertainties are complete to first order.
_WINDOWS = ("white-noise", "tikhonov", "evidence")
#: Relative difference below which two lengths or ratios are the same.
_SAME = 1e-6


def calibration_messages(
    solution: Solution, checks: tuple[QualityCheck, ...]
) -> tuple[Message, ...]:
    """Return the messages that accompany a result, the gravest first."""
    estimate, scan = solution.estimate, solution.scan
    messages = failed_check_messages(checks)
    messages += _channel(estimate)
    messages += _points(estimate)
    messages += _method(solution)
    messages += _reference(solution)
    messages += _unstated(scan)
    if scan.synthetic is not None:
        messages.append(Message("synthetic", "The scan is synthetic: its truth is stored in it."))
    return tuple(messages)


def _channel(estimate: ProfileEstimate) -> list[Message]:
    channel = estimate.points.channel
    if estimate.model.order == 0:
        return []
    text = (
        f"Channel {channel} is experimental: it was tested on synthetic data only. A and G are "
        "those of the shear at the base; the voltage is positive where the film pulls the sensor "
        f"towards larger {channel[0]}."
    )
    return [Message("experimental", text)]


def _points(estimate: ProfileEstimate) -> list[Message]:
    points = estimate.points
    messages: list[Message] = []
    if points.missing:
        text = f"{points.missing} points of the scan are missing and were left out."
        messages.append(Message("missing_points", text))
    for i in (estimate.outlier_weight < OUTLIER_WEIGHT).nonzero()[0]:
        place = f"x = {points.x[i] * 1e3:.4g} mm"
        if points.planar:
            place += f", y = {points.y[i] * 1e3:.4g} mm"
        if points.repeat.any():
            place += f" of repeat {points.repeat[i]}"
        text = (
            f"Outlier at {place}: {points.u[i] * 1e3:.4g} mV instead of "
            f"{estimate.predicted[i] * 1e3:.4g} mV; its weight is "
            f"{estimate.outlier_weight[i]:.2g}."
        )
        messages.append(Message("outlier", text))
    if points.u_errors is None:
        text = (
            f"u_{points.channel}_errors is absent: a noise of {estimate.noise_scale * 1e3:.3g} mV "
            "was estimated from the scan's scatter, so that chi-square cannot tell noise from "
            "misfit of the same size, and has no p-value."
        )
        messages.append(Message(NOISE_UNSTATED, text))
    return messages


def _method(solution: Solution) -> list[Message]:
    """Say of a method that is no fixed window on the spectrum what its uncertainty leaves out."""
    regulariser = solution.regulariser
    if regulariser.name in _WINDOWS:
        return []
    text = (
        f"Method {regulariser.name}: uncertainties are first-order through its effective window, "
        f"without its own scatter. {regulariser.fails}"
    )
    return [Message("method", text)]


def _reference(solution: Solution) -> list[Message]:
    stress, scan = solution.stress, solution.scan
    if isinstance(stress, Contact):
        return [Message("model_form", _model_form(stress))]
    messages = _other_set_up(scan, stress)
    if stress.convergence is None:
        text = "The reference states no convergence: its own error is not counted."
        messages.append(Message("convergence_unstated", text))
    return messages


def _model_form(contact: Contact) -> str:
    """Say what the reference takes for granted."""
    way = "frictionless" if contact.friction == 0 else "sticking"
    depth = f"{contact.depth / contact.film.thickness:.0%} of its thickness at {contact.load:.3g} N"
    if contact.strain == "finite":
        return (
            f"The reference is the {way} rod on a neo-Hookean film at finite strain, indented by "
            f"{depth}; it is used in proportion to the load, and how far the film's own law "
            "departs from it is not part of the uncertainties."
        )
    return (
        f"The reference is the {way} rod on the linear elastic film, indented by {depth}; the "
        "error of linear elasticity there is not part of the uncertainties. A reference at finite "
        "strain (memscal reference rod --strain finite --friction inf) shows what it changes."
    )


def _other_set_up(scan: Scan, stress: StressProfile) -> list[Message]:
    """Say where a reference was made for another film or indenter than the scan's."""
    pairs = []
    if stress.film is not None:
        for name, unit in (("thickness", 1e3), ("poisson_ratio", 1.0)):
            ours, theirs = getattr(scan.film, name), getattr(stress.film, name)
            pairs.append((f"film {name.replace('_', ' ')}", ours * unit, theirs * unit))
    if isinstance(stress.indenter, RoundIndenter):
        pairs.append(("rod radius", scan.indenter.radius * 1e3, stress.indenter.radius * 1e3))
    return [
        Message(
            "other_set_up",
            f"The reference was made for another {name} than the scan's: {theirs:.4g} instead of "
            f"{ours:.4g}{'' if 'ratio' in name else ' mm'}.",
        )
        for name, ours, theirs in pairs
        if abs(theirs - ours) > _SAME * abs(ours)
    ]


def _unstated(scan: Scan) -> list[Message]:
    film = scan.film
    missing = {
        "film thickness": film.thickness_uncertainty,
        "Poisson's ratio": film.poisson_ratio_uncertainty,
        "rod radius": scan.indenter.radius_uncertainty,
        "load": scan.load_uncertainty,
    }
    names = [name for name, value in missing.items() if value is None]
    if not names:
        return []
    pronoun = "them" if len(names) > 1 else "it"
    listed = ", ".join(names)
    text = f"No uncertainty is stated for {listed}: nothing is counted for {pronoun}."
    return [Message("uncertainty_unstated", text)]
