"""Quality checks and messages of a result: their records, the limits they share, their wording."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

if TYPE_CHECKING:
    from memscal.model.arrays import FloatArray

#: Chance that a check fails although its assumption holds.
FALSE_ALARM = 1e-3
#: Scatter over stated noise up to which a scan counts as being as noisy as stated.
NOISE_LIMIT = 1.5
#: Share of points that may be outliers.
_OUTLIER_LIMIT = 0.10
#: A point of less weight is an outlier.
OUTLIER_WEIGHT = 0.5

#: Kinds of messages that code selects by.
FAILED_CHECK = "failed_check"
FAILED_CALIBRATION = "failed_calibration"
NOISE_UNSTATED = "noise_unstated"
NOISE_ALONE = "noise_alone"
REPEAT_CENTRES = "repeat_centres"
OVERRIDE = "override"


_EXPLAINED = """\
reconvolution: scan against G convolved with the reference, or the restored stress blurred
    the result misses something: if chi_square passes, use bayesian
constraint: rise of chi-square by --option nonnegative=true or monotone=true
    the scan contradicts it: leave it out
gaussian_misfit: scan against the best Gaussian convolved with the reference
    G or a statement is wrong: the check says
method_agreement: division against Bayesian estimate, in A and G(r), over what noise explains
    compare both G(r) and the residuals
width_agreement: width of G against that of the Gaussian, in u without misfit
    one width does not describe G: use the profile
shape_width: full width of G at half maximum over a Gaussian's, or the inverse
    G is a spike or has lobes far out: use white-noise or bayesian
shape_negative: share of the integral of abs(G) where G is negative
    G consists of ripples: use white-noise or bayesian
shape_roughness: share of the power of G beyond 1.5 times the wavenumbers that the scan determines
    the detail of G is noise: use white-noise or bayesian
field_lobes: deepest lobe of G beyond 4 u (rasters)
    ripples: use bayesian
field_residuals: residuals by wavenumber against the noise (rasters)
    look at their map
width_over_thickness: width of G over the film's thickness
    check the units of positions and thickness
resolved_band: the Gaussian's transfer function at the end of the resolved band
    average repeats, or raise the load
tail_share: share of the voltage's integral beyond the scan
    scan farther
baseline_drift: change of the baseline across the scan over the largest signal
    let amplifier and film settle; scan faster
baseline_curvature: fitted curvature of the baseline over what its prior and noise make
    let amplifier and film settle, or state baseline_curvature_uncertainty
reference_force: total force of the reference against its load
    check the reference's load and the reach of its table
indentation: what a neo-Hookean film would change of A or of the width, over its uncertainty
    state --film-law neo-hookean, or no law, or lighten the load
outliers: share of points with less than half of their weight
    find what disturbs these points
saturation: number of points at a ceiling near the largest voltage (not of a shear)
    lower gain or load, or leave them out (--ceiling)
noise_as_stated: scatter over the stated noise
    look for noise of position and load, or take a noise record
chi_square: residuals that no radial G, or no radial stress, explains, against the noise
    check reference (rod, film), baseline, stated noise, roundness of a contact
residual_steps: largest step of the residuals, in standard deviations
    look for a step or bend of the baseline, a wrong reference, slow noise
residual_correlation: correlation of neighbouring residuals
    as residual_steps; or state u_zz_correlation
gaussian_evidence: logarithm of the Bayes factor for a departure of G from a Gaussian
    as gaussian_misfit
symmetry: difference of left and right (lines); even part of a shear
    look for a tilted rod, uneven film, drifting load, lag or sliding
axisymmetry: ellipticity of the sensor or of the contact (rasters)
    it is not round; of a calibration G(r) is a mean over directions
load_linearity: change of A with the load (several loads)
    calibrate at the load of use
hysteresis: approach against retreat in A, width and centre
    what grows with the speed is creep, what does not backlash
offset_agreement: baseline of a scan or repeat against all others'
    it names the run: let the sensor warm up
noise_agreement: scatter of a scan or repeat against all others'
    look at the run that it names; state its noise
repeat_centres: a centre for each repeat of a line against one for all (F ratio)
    stage or sensor moved: --centre per-repeat
held_out_repeat: each repeat against its prediction from the others; the worst
    look at the repeat that it names
held_out_load: each load against its prediction from the others; the worst
    calibrate at the load of use; check the load cell
held_out_scan: each scan against its prediction from the others; the worst
    calibrate each and compare
applied_force: total force of a profile against its load, in u; not A
    gain, load or a unit differ between calibration and scan
applied_force_all: mean total force over loads against one, in u; not A
    gain, loads or a unit differ between calibration and scans
restored_force: restored total force against the load, in u; not A
    gain, load or a unit differ from the calibration, or Poisson's ratio is wrong
expected_stress: scan against the expected stress blurred by A G, chi-square per degree
    the contact is another: friction, shape, film, or load
profile_chi_square: one load against the friction that explains it best, chi-square per degree
    no contact explains it: check noise, scatter of loads, shape, film, gain and load
bracketing: share of a load's points outside of what no friction and full stick give
    friction alone does not explain it: look at the figure
joint_chi_square: all loads of a kind against one friction coefficient, chi-square per degree
    friction changes with the load: see each coefficient, or --interface
lubricated_frictionless: lubricated loads against no friction: rise of -2 ln p
    more friction than counted, or a wrong A, load or thickness: doubt the dry ones
negative_friction: sliding friction below zero, in u
    check direction, sign of positions, backlash, low-pass
skew_and_shift: sliding friction by skew and shift against that by skew alone, in u
    state a larger backlash, or a low-pass
tangential_load: sliding friction against the tangential load over the load, in u
    check both load cells, direction, film and thickness
sliding_friction: sliding friction against the stated one, in u
    as tangential_load
dead_taxels: sensors without a signal
    left out: press on them, look at their wiring
ends_covered: what a scan lacks of two thicknesses beyond the last sensor
    scan farther
layout: centres against their layout, shifted, turned up to 30 degrees, scaled up to 50 %
    wrong place, name, unit or axis; sensors beside a single line
crosstalk_identified: median u of the crosstalk by the readings alone
    scan a raster, take a common shape, or a thinner film
crosstalk_model: A and crosstalk by a common G against own widths, or shapes of a raster, in u
    own shapes, of a raster
common_kernel: fall of chi-square by widths of the sensors' own
    own shapes, of a raster
array_chi_square: residuals of the worst sensor against the noise
    look at reference, farther pairs, drift, memory of the film
press_errors: what common errors of place and load explain, over chance
    state x_errors, normal_load_errors (--position-error, --load-scatter)
one_time: fall of chi-square by a second time of creep
    begin the record at the contact, or correct by none
common_mode: noise that two sensors share against that of their board
    state boards (in the layout table)
"""
_ENTRIES = re.findall(r"(\w+): (.*)\n +(.*)\n", _EXPLAINED)
EXPLANATIONS: dict[str, tuple[str, str]] = {name: (tests, cure) for name, tests, cure in _ENTRIES}
"""What each kind of check tests, and what to do if it fails; docs/quality.md has the same."""


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
        return self.name.rstrip("_0123456789")

    @property
    def profile(self) -> str:
        """The number of the profile that was checked, from one; empty where there is none."""
        return self.name.removeprefix(self.kind).lstrip("_")


QualityChecks = tuple[QualityCheck, ...]
Messages = tuple[Message, ...]


class Checked:
    """A result with quality checks."""

    checks: QualityChecks

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
    return check(
        "noise_as_stated",
        scatter,
        NOISE_LIMIT,
        f"Scatter about the fitted profile over the stated u_{channel}_errors; of means of many "
        "readings, where neighbours are alike. A failure means that something besides independent "
        "noise scatters the scan: of position or load, by which the uncertainties have been "
        "raised, or slow noise, which a noise record states (--noise-record).",
    )


def outlier_check(weights: "FloatArray", where: str) -> QualityCheck:
    """Return the check of the share of outliers by the weights of the points."""
    share = float((weights < OUTLIER_WEIGHT).mean())
    return check(
        "outliers",
        share,
        _OUTLIER_LIMIT,
        "Share of points whose weight was more than halved. A failure means that the noise is not "
        f"what the uncertainties take it for: look at {where}.",
    )


def added_check(name: str, fall: float, count: int, meaning: str) -> QualityCheck:
    """Return the check of a chi-square, or of its fall by columns that are added to a model."""
    from scipy.special import chdtrc

    return check(name, fall, chi_square_limit(count), meaning, float(chdtrc(count, fall)))


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
    return [
        Message(
            FAILED_CHECK,
            f"Quality check {check.name} failed: {check.value:.3g} exceeds {check.limit:.3g}. "
            f"{check.meaning}",
            "warning",
        )
        for check in checks
        if not check.passed
    ]


def uncertainty_unstated_messages(uncertainties: Mapping[str, float | None]) -> list[Message]:
    """Return one message that names the inputs without an uncertainty, if there are any."""
    names = [name for name, value in uncertainties.items() if value is None]
    text = f"No uncertainty is stated for {', '.join(names)}: none is counted."
    return [Message("uncertainty_unstated", text)] if names else []


def override_messages(differences: Iterable[str]) -> list[Message]:
    """Return a warning for each difference that was accepted."""
    return [Message(OVERRIDE, f"Overridden: {text}.", "warning") for text in differences]


def at_ceiling_text(number: int) -> str:
    """Say how many readings at a ceiling are left out."""
    reading = f"reading{'' if number == 1 else 's'}"
    return f"{number} {reading} at the ceiling {'is' if number == 1 else 'are'} left out."


def import_notes(texts: Iterable[str]) -> list[Message]:
    """Return what an import did, as notes."""
    return [Message("import", text) for text in texts]


def marked_texts(messages: Iterable[Message]) -> list[str]:
    """Return texts for a list without severities: a warning begins with "Warning: "."""
    return [("Warning: " if m.severity == "warning" else "") + m.text for m in messages]


def messages_from_json(stored: Sequence[Any]) -> Messages:
    """Return messages from a file; a plain text, as older files hold them, is a note."""
    messages = []
    for entry in (e if isinstance(e, Mapping) else {"text": e} for e in stored):
        kind = str(entry.get("kind", "note"))
        text = str(entry.get("text", ""))
        warns = entry.get("severity") == "warning"
        messages.append(Message(kind, text, "warning" if warns else "note"))
    return tuple(messages)
