"""Notes and warnings that the command line gives beside the tables of a comparison."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

from memscal.cli.friction_text import friction_name
from memscal.friction.family import FRICTION_SCALE, bounded
from memscal.friction.results import FrictionComparison
from memscal.model.checks import FAILED_CHECK, Message, QualityCheck, failed_check_messages

__all__ = ["comparison_notes", "failures", "which"]

#: Coefficients farther apart than this, in the bounded coordinate, leave much to interpolation.
_FAR = 0.26


def comparison_notes(found: FrictionComparison) -> Iterator[Message]:
    """Return what a user should know, each thing once; what failed of several profiles, once."""
    others = (message for message in found.messages if message.kind != FAILED_CHECK)
    of_laws = () if found.interface is None else found.interface.messages
    yield from dict.fromkeys(
        [*_failed(found), *others, *_reasons(found), *_about_profiles(found), *of_laws]
    )


def _about_profiles(found: FrictionComparison) -> Iterator[Message]:
    """Say what the calculated profiles do not cover."""
    friction = found.friction
    if friction[0] > 0:
        yield Message(
            "frictions",
            "No frictionless profile was calculated: p0_max is that of friction "
            f"{friction[0]:.3g}.",
        )
    for low, high in pairwise(float(mu) for mu in friction):
        apart = bounded(high, FRICTION_SCALE) - bounded(low, FRICTION_SCALE)
        if low < FRICTION_SCALE and apart > _FAR:
            yield Message(
                "frictions",
                f"Profiles between the friction coefficients {friction_name(low)} and "
                f"{friction_name(high)} are interpolated over a wide gap: values and intervals "
                "there are rough. More coefficients make them better.",
            )


def failures(checks: Sequence[QualityCheck]) -> dict[str, list[QualityCheck]]:
    """Return the checks that failed, by kind."""
    failed: dict[str, list[QualityCheck]] = {}
    for check in checks:
        if not check.passed:
            failed.setdefault(check.kind, []).append(check)
    return failed


def _failed(found: FrictionComparison) -> Iterator[Message]:
    """Return one warning for each kind of check that failed, about the first profile."""
    for first, *others in failures(found.checks).values():
        [message] = failed_check_messages([first])
        numbers = ", ".join(check.profile for check in others)
        text = f"{message.text} The same of profiles {numbers}." if others else message.text
        yield replace(message, text=text)


def _reasons(found: FrictionComparison) -> Iterator[Message]:
    """Return why the coefficient of all loads together has no value, where it has none."""
    for lubrication, by_loading in found.joint.items():
        for loading, joint in by_loading.items():
            if joint.reason:
                words = _capital(which(lubrication, loading))
                yield Message("no_value", f"{words}, all loads: {joint.reason}")


def which(lubrication: str, loading: str) -> str:
    """Return lubrication and definition of the loading in words."""
    words = [lubrication or "lubrication not stated", f"{loading} loading" if loading else ""]
    return ", ".join(word for word in words if word)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]
