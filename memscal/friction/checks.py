"""Quality checks of a comparison: whether any calculated contact explains what was measured."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from scipy.special import chdtrc

from memscal.friction.results import EffectiveFriction, LoadComparison
from memscal.model.checks import QualityCheck, check, chi_square_limit

__all__ = ["comparison_checks"]

#: Share of points that may lie outside of what friction can explain, beyond those of chance.
_OUTSIDE = 0.15


def comparison_checks(
    loads: Mapping[str, Sequence[LoadComparison]],
    joint: Mapping[str, Mapping[str, EffectiveFriction]],
) -> tuple[QualityCheck, ...]:
    """Return the checks of every load, numbered from one, and those of all loads together.

    A load passes if one definition of the loading explains it.
    """
    checks: list[QualityCheck] = []
    for i, of_load in enumerate(zip(*loads.values(), strict=True), start=1):
        checks += [_profile(i, of_load), _bracketing(i, of_load)]
    for lubrication, by_loading in joint.items():
        checks.append(_together(lubrication, by_loading))
    if "lubricated" in joint:
        checks.append(_frictionless(joint["lubricated"]))
    return tuple(checks)


def _best(found: Sequence[EffectiveFriction]) -> EffectiveFriction:
    return min(found, key=lambda one: one.least)


def _profile(number: int, found: Sequence[LoadComparison]) -> QualityCheck:
    best = _best([one.by_profile for one in found])
    return check(
        f"profile_chi_square_{number}",
        best.least / best.degrees,
        chi_square_limit(best.degrees) / best.degrees,
        f"Reduced chi-square of {_place(found[0])} against the friction coefficient that explains "
        "it best. A failure means that no calculated contact does: noise or scatter larger than "
        "stated, another shape of contact, or a film, gain or load that is not as stated.",
        best.p_value,
    )


def _bracketing(number: int, found: Sequence[LoadComparison]) -> QualityCheck:
    return check(
        f"bracketing_{number}",
        1 - max(one.bracketed for one in found),
        _OUTSIDE,
        f"Share of the points of {_place(found[0])} that lie outside of what no friction and full "
        "stick give, by more than 1.96 standard uncertainties. A failure means that friction "
        "alone does not explain the stress.",
    )


def _together(lubrication: str, by_loading: Mapping[str, EffectiveFriction]) -> QualityCheck:
    best = _best(list(by_loading.values()))
    suffix = f"_{lubrication}" if lubrication else ""
    return check(
        f"joint_chi_square{suffix}",
        best.least / best.degrees,
        chi_square_limit(best.degrees) / best.degrees,
        f"Reduced chi-square of all {f'{lubrication} ' if lubrication else ''}loads against one "
        "friction coefficient. A failure while the single loads pass means that friction changes "
        "with the load: look at the coefficient of each load, or at laws of the interface.",
        best.p_value,
    )


def _frictionless(by_loading: Mapping[str, EffectiveFriction]) -> QualityCheck:
    # The first of the values is no friction.
    rises = [float(one.chi_square[0]) - one.least for one in by_loading.values()]
    least = max(min(rises), 0.0)
    return check(
        "lubricated_frictionless",
        least,
        chi_square_limit(1),
        "Rise of chi-square of the lubricated loads from their best friction coefficient to none. "
        "A failure means that the lubricated contacts are not frictionless, or that something "
        "that scales the stress (A, load, film thickness) is not as stated: then the dry "
        "coefficients are not to be trusted either.",
        float(chdtrc(1, least)),
    )


def _place(found: LoadComparison) -> str:
    words = f"the {found.lubrication} load" if found.lubrication else "the load"
    return f"{words} of {np.format_float_positional(found.load, precision=3, trim='-')} N"
