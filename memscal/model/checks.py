"""Quality checks and messages of a result: their records, the limits they share, their wording."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

#: Chance that a check fails although its assumption holds.
FALSE_ALARM = 1e-3
#: Scatter over stated noise up to which a scan counts as being as noisy as stated.
_NOISE_LIMIT = 1.5
#: Share of points that may be outliers.
OUTLIER_LIMIT = 0.10
#: A point of less weight is an outlier.
OUTLIER_WEIGHT = 0.5

#: Kinds of messages that code selects by.
FAILED_CHECK = "failed_check"
FAILED_CALIBRATION = "failed_calibration"
NOISE_UNSTATED = "noise_unstated"
REPEAT_CENTRES = "repeat_centres"
OVERRIDE = "override"


@dataclass(frozen=True)
class Message:
    """One message that accompanies a result.

    Parameters
    ----------
    kind : str
        What it is about, for code to select by: ``"failed_check"``, ``"outlier"``,
        ``"uncertainty_unstated"``, ...; ``"note"`` where a file does not state it.
    text, severity : str, {"note", "warning"}
        One or more sentences; a warning puts the result in doubt, a note helps to judge it.

    Examples
    --------
    >>> import memscal
    >>> message = memscal.Message("synthetic", "The scan is synthetic: its truth is stored in it.")
    >>> print(message)
    The scan is synthetic: its truth is stored in it.
    >>> message.severity
    'note'
    """

    kind: str
    text: str
    severity: Literal["note", "warning"] = "note"

    def __str__(self) -> str:
        """Return the text."""
        return self.text


@dataclass(frozen=True)
class QualityCheck:
    """One check of a result: its value, its limit, and what a failure means.

    A check passes while ``value`` is at most ``limit``.  ``p_value``: the chance of such a value,
    or a larger one, if nothing is wrong; ``None`` where it is not known.

    >>> check = QualityCheck("applied_force_2", 0.4, 3.0, True, "Force against load.", p_value=0.7)
    >>> check.kind, check.profile
    ('applied_force', '2')
    """

    name: str
    value: float
    limit: float
    passed: bool
    meaning: str
    p_value: float | None = None

    @property
    def kind(self) -> str:
        """The name without the number of a profile."""
        return self.name.rstrip("0123456789").rstrip("_")

    @property
    def profile(self) -> str:
        """The number of the profile that was checked, from one; empty where there is none."""
        return self.name.removeprefix(self.kind).lstrip("_")


class Checked:
    """A result with quality checks."""

    checks: tuple[QualityCheck, ...]

    @property
    def passed(self) -> bool:
        """Whether every quality check passed."""
        return all(check.passed for check in self.checks)


def check(
    name: str, value: float, limit: float, meaning: str, p_value: float | None = None
) -> QualityCheck:
    """Return a check, which passes while its value is at most the limit."""
    return QualityCheck(name, float(value), float(limit), bool(value <= limit), meaning, p_value)


def noise_check(scatter: float, channel: str = "zz") -> QualityCheck:
    """Return the check of the scatter over the stated noise."""
    meaning = (
        f"Scatter about the fitted profile over the stated u_{channel}_errors. A failure means "
        "that something besides electronic noise scatters the scan, such as position or load; the "
        "uncertainties have been raised accordingly."
    )
    return check("noise_as_stated", scatter, _NOISE_LIMIT, meaning)


def state_of_checks(checks: Iterable[QualityCheck]) -> str:
    """Return the names of the checks that failed, or that all passed."""
    failed = ", ".join(check.name for check in checks if not check.passed)
    return f"failed: {failed}" if failed else "all checks passed"


def chi_square_limit(degrees: float) -> float:
    """Value that chi-square exceeds by chance once in a thousand."""
    from scipy.special import chdtri

    return float(chdtri(degrees, FALSE_ALARM))


def failed_check_messages(checks: Iterable[QualityCheck]) -> list[Message]:
    """Return a warning for each check that failed, in their order."""
    failed = "Quality check {0.name} failed: {0.value:.3g} exceeds {0.limit:.3g}. {0.meaning}"
    return [
        Message(FAILED_CHECK, failed.format(check), "warning")
        for check in checks
        if not check.passed
    ]


def uncertainty_unstated_messages(uncertainties: Mapping[str, float | None]) -> list[Message]:
    """Return one message that names the inputs without an uncertainty, if there are any."""
    names = [name for name, value in uncertainties.items() if value is None]
    it = "it" if len(names) == 1 else "them"
    text = f"No uncertainty is stated for {', '.join(names)}: nothing is counted for {it}."
    return [Message("uncertainty_unstated", text)] if names else []


def override_messages(differences: Iterable[str]) -> list[Message]:
    """Return a warning for each difference that was accepted."""
    return [Message(OVERRIDE, f"Overridden: {text}.", "warning") for text in differences]


def import_notes(texts: Iterable[str]) -> list[Message]:
    """Return what an import did, as notes."""
    return [Message("import", text) for text in texts]


def marked_texts(messages: Iterable[Message]) -> list[str]:
    """Return texts for a list without severities: a warning begins with "Warning: "."""
    return [("Warning: " if m.severity == "warning" else "") + m.text for m in messages]


def messages_from_json(stored: Sequence[Any]) -> tuple[Message, ...]:
    """Return messages from a file; a plain text, as older files hold them, is a note."""
    messages = []
    for entry in (e if isinstance(e, Mapping) else {"text": e} for e in stored):
        kind, text = str(entry.get("kind", "note")), str(entry.get("text", ""))
        warns = entry.get("severity") == "warning"
        messages.append(Message(kind, text, "warning" if warns else "note"))
    return tuple(messages)
