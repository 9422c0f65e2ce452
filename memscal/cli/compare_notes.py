"""What a comparison of measured with calculated stress has to say beside its tables."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise

from memscal.cli.friction_text import friction_name
from memscal.friction.family import FRICTION_SCALE, bounded
from memscal.friction.results import FrictionComparison
from memscal.model.apparatus import QualityCheck

__all__ = ["comparison_notes", "failures", "kind", "which"]

#: Coefficients farther apart than this, in the bounded coordinate, leave much to interpolation.
_FAR = 0.26


def comparison_notes(found: FrictionComparison) -> Iterator[str]:
    """Return what a user should know, each thing once; what failed of several profiles, once."""
    said = dict.fromkeys([*_once_a_kind(found), *_reasons(found), *_about_profiles(found)])
    if found.interface is not None:
        said |= dict.fromkeys(found.interface.messages)
    yield from said


def _about_profiles(found: FrictionComparison) -> Iterator[str]:
    """Say what the calculated profiles do not cover."""
    friction = found.friction
    if friction[0] > 0:
        yield (
            f"No frictionless profile was calculated: p0_max is that of friction {friction[0]:.3g}."
        )
    for low, high in pairwise(float(mu) for mu in friction):
        apart = bounded(high, FRICTION_SCALE) - bounded(low, FRICTION_SCALE)
        if low < FRICTION_SCALE and apart > _FAR:
            yield (
                f"Profiles between the friction coefficients {friction_name(low)} and "
                f"{friction_name(high)} are interpolated over a wide gap: values and intervals "
                "there are rough. More coefficients make them better."
            )


def failures(checks: Sequence[QualityCheck]) -> dict[str, list[str]]:
    """Return the numbers of the profiles that failed, by kind of check; none of a single one."""
    failed: dict[str, list[str]] = {}
    for check in checks:
        if not check.passed:
            number = check.name.removeprefix(kind(check)).lstrip("_")
            failed.setdefault(kind(check), []).extend([number] if number else [])
    return failed


def _once_a_kind(found: FrictionComparison) -> Iterator[str]:
    """Return the messages; of a check that failed for several profiles, the first one."""
    failed = failures(found.checks)
    repeated = {
        f"Quality check {name}_{number} failed": numbers
        for name, numbers in failed.items()
        for number in numbers
    }
    told: set[tuple[str, ...]] = set()
    for text in found.messages:
        numbers = repeated.get(text.partition(":")[0], [])
        key = (text.partition(":")[0].rpartition("_")[0], *numbers)
        if len(numbers) < 2:
            yield text
        elif key not in told:
            told.add(key)
            yield f"{text} The same of profiles {', '.join(numbers[1:])}."


def _reasons(found: FrictionComparison) -> Iterator[str]:
    """Return why the coefficient of all loads together has no value, where it has none."""
    for lubrication, by_loading in found.joint.items():
        for loading, joint in by_loading.items():
            if joint.reason:
                yield f"{_capital(which(lubrication, loading))}, all loads: {joint.reason}"


def which(lubrication: str, loading: str) -> str:
    """Return lubrication and definition of the loading in words."""
    words = [lubrication or "lubrication not stated", f"{loading} loading" if loading else ""]
    return ", ".join(word for word in words if word)


def _capital(text: str) -> str:
    return text[:1].upper() + text[1:]


def kind(check: QualityCheck) -> str:
    """Return a check's name without the number of its profile."""
    return check.name.rstrip("0123456789").rstrip("_")
