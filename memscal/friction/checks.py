"""Quality checks of a comparison: whether any calculated contact explains what was measured."""

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence

import numpy as np
from scipy.special import chdtrc

from memscal.friction.effective import HALF_NORMAL_MEAN
from memscal.friction.family import ProfileFamily
from memscal.friction.likelihood import LUBRICATED_FRICTION
from memscal.friction.results import BoundedEstimate, ByLoading, Joint, LoadComparison
from memscal.model import checks as quality
from memscal.model.checks import Message, QualityCheck, check, chi_square_limit
from memscal.model.measured_stress import MeasuredStress

#: Share of points that may lie outside of what friction can explain, beyond those of chance.
_OUTSIDE = 0.15


def comparison_checks(
    loads: Mapping[str, Sequence[LoadComparison]],
    joint: Joint,
    *,
    noise_stated: bool = True,
) -> quality.QualityChecks:
    """Return the checks of every load (one loading has to explain it), and those of all loads."""
    # A noise that was estimated from the scatter about a contact is as large as the misfit.
    checks = []
    for i, by_loading in enumerate(zip(*loads.values(), strict=True), start=1):
        profile = by_loading[0].profile
        outside = 1 - max(load.bracketed for load in by_loading)
        size = np.format_float_positional(profile.load, precision=3, trim="-")
        kind = f"{profile.lubrication} load".strip()
        place = f"the {kind} of {size} N"
        explained = (
            f"Reduced chi-square of {place} against the friction coefficient that explains it "
            "best. A failure means that no calculated contact does: noise or scatter larger than "
            "stated, another shape of contact, or a film, gain or load that is not as stated."
        )
        bracketed = (
            f"Share of the points of {place} that lie outside of what no friction and full stick "
            "give, by more than 1.96 standard uncertainties. A failure means that friction alone "
            "does not explain the stress."
        )
        readings = (load.by_profile for load in by_loading)
        if noise_stated:
            checks.append(reduced_check(f"profile_chi_square_{i}", readings, explained))
        checks.append(check(f"bracketing_{i}", outside, _OUTSIDE, bracketed))
    if noise_stated:
        for lubrication, estimates in joint.items():
            name = f"joint_chi_square_{lubrication}".removesuffix("_")
            kind = f"{lubrication} loads".strip()
            together = (
                f"Reduced chi-square of all {kind} against one friction coefficient. A failure "
                "while the single loads pass means that friction changes with the load: look at "
                "the coefficient of each load, or at laws of the interface."
            )
            checks.append(reduced_check(name, estimates.values(), together))
    if "lubricated" in joint:
        dry = [each for state, each in joint.items() if state != "lubricated"]
        checks.append(frictionless_check(joint["lubricated"], dry))
    return tuple(checks)


def reduced_check(name: str, estimates: Iterable[BoundedEstimate], meaning: str) -> QualityCheck:
    """Return the check of the reduced chi-square of the best of some estimates."""
    best = min(estimates, key=lambda estimate: estimate.least)
    limit = chi_square_limit(best.degrees) / best.degrees
    return check(name, best.least / best.degrees, limit, meaning, best.p_value)


def frictionless_check(by_loading: ByLoading, beside: Sequence[ByLoading]) -> QualityCheck:
    """Return the check that the lubricated loads have no friction that moves others ``beside``."""
    # The first of the values is no friction.
    rises = (float(joint.deviance[0]) - joint.least for joint in by_loading.values())
    least = max(min(rises), 0.0)
    limits = [chi_square_limit(1)]
    for others in beside:
        for loading, dry in others.items():
            known = math.hypot(*by_loading[loading].budget.values())
            if dry.standard_uncertainty and dry.by_lubricated and known > 0:
                # One standard uncertainty beyond the mean that was counted.
                mean = HALF_NORMAL_MEAN * dry.budget.get(LUBRICATED_FRICTION, 0.0)
                allowed = (dry.standard_uncertainty + mean) / dry.by_lubricated
                limits.append((allowed / known) ** 2)
    return check(
        "lubricated_frictionless",
        least,
        min(limits),
        "Twice the loss of log likelihood of the lubricated loads from their best friction "
        "coefficient to none. "
        "A failure means that the lubricated contacts have more friction than was counted, by what "
        "moves the dry coefficients by one standard uncertainty, or that something that scales the "
        "stress (A, load, film thickness) is not as stated. One of ten fails by chance.",
        float(chdtrc(1, least)),
    )


#: Calculated contacts that are less certain than this share of their stress are named.
_COARSE = 2e-3
#: Of the uncertainty that a rectangle adds where it is as wide as the rest is large.
_LARGE_SHARE = 1 / math.sqrt(13)


def comparison_messages(
    measured: MeasuredStress,
    families: Mapping[str, ProfileFamily],
    joint: Joint,
    checks: quality.QualityChecks,
) -> quality.Messages:
    """Return the messages of a comparison and of its measured stress, failed checks first."""
    messages = [*quality.failed_check_messages(checks), *synthetic_messages(measured)]
    # Where the definitions of the loading disagree.
    for lubrication, by_loading in joint.items():
        first, *_ = by_loading.values()
        apart = first.budget.get("loading", 0.0)
        if apart > _LARGE_SHARE * (first.standard_uncertainty or math.inf):
            message = Message(
                "loading",
                f"The definitions of the loading disagree ({lubrication or 'all'} loads) by "
                f"{math.sqrt(12) * apart:.2g}, more than one standard uncertainty: its middle is "
                "given.",
            )
            messages.append(message)
    for family in families.values():
        worst = np.nanmax(family.convergence, initial=0.0)
        if worst > _COARSE:
            text = f"The calculated contacts have converged to {worst:.1%} of their stress only."
            messages.append(Message("convergence", text))
        messages += [Message("calculated", text) for text in family.notes]
    # All scans are of one film and one sphere.
    film = measured.scans[0].film
    indenter = measured.scans[0].indenter
    loads = [profile.load_uncertainty for profile in measured.profiles]
    stated = {
        "Young's modulus": film.young_modulus_uncertainty,
        "Poisson's ratio": film.poisson_ratio_uncertainty,
        "film thickness": film.thickness_uncertainty,
        f"{indenter.shape} radius": indenter.radius_uncertainty,
        "load": None if None in loads else loads[0],
    }
    messages += quality.uncertainty_unstated_messages(stated)
    return tuple(dict.fromkeys([*messages, *measured.messages]))


def synthetic_messages(measured: MeasuredStress) -> Iterator[Message]:
    """Say where the scans are synthetic."""
    if any(scan.synthetic for scan in measured.scans):
        yield Message("synthetic", "The scans are synthetic: nothing here was measured.")
