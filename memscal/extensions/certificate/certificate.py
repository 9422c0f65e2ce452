"""Contents of a certificate of calibration, once for all its forms."""

import math
import re
import tomllib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from datetime import date
from typing import Any, NamedTuple

import numpy as np
from scipy.special import stdtr

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import radial_spline
from memscal.errors import InputError
from memscal.extensions.certificate.laboratory import (
    KINDS,
    RULES,
    SECTIONS,
    TEXTS,
    LaboratoryFile,
    Measured,
    Section,
    missing_keys,
)
from memscal.formats.artifact import artifact_tree
from memscal.formats.hdf5.writer import tree_to_bytes
from memscal.formats.units import to_si
from memscal.model.arrays import FloatArray, Values, keyword_value_record, value_record
from memscal.model.assumptions import ASSUMED
from memscal.model.provenance import timestamp
from memscal.model.quantities import MM, Quantity, parameter_quantity

COVERAGE_FACTOR = 2.0
COVERAGE_PROBABILITY = 0.95
"""k of U = k u of many degrees of freedom, and about what a normal distribution has within."""

#: Parameters of the sensor; the others are those of one scan.
_SENSOR_PARAMETERS = (
    "conversion_constant",
    "gaussian_sigma",
    "gaussian_sigma_deconvolved",
    "ellipticity",
    "ellipticity_diagonal",
    "fwhm",
    "noise_equivalent_area",
)
_OF_GAUSSIAN = _SENSOR_PARAMETERS[1:5]
#: Bounds of the budget, anywhere within which the truth may lie: rectangles.
_BOUNDS = ("model_form", "rod_friction")
#: Places spread evenly over a rectangle of half a width of one.
_WITHIN = (np.arange(1000) + 0.5) / 500 - 1
#: A length or an area whose expanded uncertainty is a larger share of it is not determined.
_DETERMINED = 0.5
_OTHER = "conversion_constant_gaussian"
_SHOWN_SHARE = 0.01
_MOST_RADII = 12
#: A value that conforms with less probability rather does not.
_EVEN = 0.5
_NUMBER_DIGITS = 10
_MOST_EMBEDDED = 4_000_000


@value_record
class CertifiedValue:
    """A parameter with its standard uncertainty, in SI units, and how its errors are spread."""

    quantity: Quantity
    value: float
    uncertainty: float
    factor: float = COVERAGE_FACTOR  # k: larger where an estimated noise has few degrees of freedom
    degrees: float = math.inf  # effective ones of the uncertainty
    bounds: tuple[float, ...] = ()  # standard uncertainties of the rectangles in it
    rejected: bool = False  # it is of a Gaussian, from which the scan shows a departure

    @property
    def expanded(self) -> float:
        """The expanded uncertainty U = k u."""
        return self.factor * self.uncertainty

    @property
    def determined(self) -> bool:
        """Whether the scan tells the value: of a number without a unit zero is a value, too."""
        largest = _DETERMINED * abs(self.value) if self.quantity.unit else math.inf
        return not self.rejected and self.expanded <= largest

    def probability(self, lower: float, upper: float) -> float:
        r"""Probability that the true value lies between limits, in SI units.

        By the budget: errors :math:`\sqrt{u^2 - \sum u_i^2}\,t_\nu` of Student's distribution,
        beside those of each rectangle, of half a width of :math:`\sqrt{3} u_i`.
        """
        errors = np.zeros(1)
        bounded = 0.0
        for u in self.bounds:
            errors = np.add.outer(errors, 3**0.5 * u * _WITHIN).ravel()
            bounded += u**2
        rest = max(self.uncertainty**2 - bounded, 1e-12 * bounded, np.finfo(float).tiny)
        # By Welch and Satterthwaite degrees grow with the fourth power of what else there is.
        degrees = max(self.degrees * (rest / (rest + bounded)) ** 2, 1.0)
        ends = [(end - self.value - errors) / rest**0.5 for end in (lower, upper)]
        low, high = stdtr(degrees, ends)
        return float(np.mean(high - low))


@value_record
class Conformity:
    """Whether a value conforms with its tolerance, by a decision rule; -inf or inf: no limit."""

    certified: CertifiedValue
    lower: float
    upper: float
    guard_band: float

    @property
    def acceptance(self) -> tuple[float, float]:
        """The acceptance interval (JCGM 106:2012, 8.3.2)."""
        return self.lower + self.guard_band, self.upper - self.guard_band

    @property
    def accepted(self) -> bool:
        """Whether the value lies within the acceptance interval."""
        lowest, highest = self.acceptance
        return lowest <= self.certified.value <= highest

    @property
    def statement(self) -> str:
        """Name of the statement of conformity among the texts."""
        if not self.accepted:
            return "not_stated"
        return "conforms" if self.probability >= _EVEN else "conforms_rather_not"

    @property
    def probability(self) -> float:
        """Conformance probability (JCGM 106:2012, 7.3)."""
        return self.certified.probability(self.lower, self.upper)


class CertifiedProfile(NamedTuple):
    """G (n,) at radii ``r`` (n,), with its covariance (n, n), in SI units."""

    r: FloatArray
    g: FloatArray
    covariance: FloatArray


class Missing(NamedTuple):
    """What a certificate lacks, in its own words, and where a user states or reads of it."""

    words: str
    cure: str


@keyword_value_record
class Certificate:
    """What a certificate states: on its pages, and in XML."""

    number: str
    issued: str
    sections: Mapping[str, Section]  # of the laboratory's file, with the artifact's
    equipment: tuple[Section, ...]
    apparatus: ApparatusFunction
    texts: Mapping[str, Any]  # of its language
    values: tuple[CertifiedValue, ...]
    others: tuple[CertifiedValue, ...]  # another estimate, which the annex states
    undetermined: tuple[CertifiedValue, ...]
    profile: CertifiedProfile
    conformity: tuple[Conformity, ...]
    missing: tuple[Missing, ...]
    artifact: bytes  # the artifact in its compact form; empty if that is too large

    def covariance_of(self, values: Iterable[CertifiedValue]) -> FloatArray:
        """Joint covariance of some values, in SI units."""
        names = [value.quantity.name for value in values]
        return self.apparatus.parameters.only(names).covariance

    @property
    def correlation(self) -> FloatArray:
        """Correlation coefficients of the values."""
        covariance = self.covariance_of(self.values)
        u = np.sqrt(np.diag(covariance))
        scale = np.multiply.outer(u, u)
        return np.divide(covariance, scale, out=np.eye(u.size), where=scale > 0)

    @property
    def synthetic(self) -> bool:
        """Whether the scan was simulated."""
        return any(message.kind == "synthetic" for message in self.apparatus.process.messages)

    def words(self, group: str, name: str) -> str:
        """What the texts call something of a group."""
        return str(self.texts[group].get(name, name.replace("_", " ")))


def certify(
    apparatus: ApparatusFunction, laboratory: LaboratoryFile, *, incomplete: bool = False
) -> Certificate:
    """Return the contents of a certificate; all that it lacks is named, and refused or said."""
    apparatus.require_pascals()
    sections, equipment = _completed(apparatus, laboratory)
    language = sections["certificate"].get("language", "en")
    texts = tomllib.loads((TEXTS / f"{language}.toml").read_text("utf-8"))
    values = {}
    for name in (*_SENSOR_PARAMETERS, _OTHER):
        if name in apparatus.parameters:
            values[name] = _certified(apparatus, name)
    missing = []
    for key in missing_keys(sections, equipment):
        words = re.sub(r"[\W_]+", " ", key).strip()
        missing.append(Missing(words, f"{key} in {laboratory.name}"))
    missing += _unstated(apparatus, texts["missing"], values)
    if missing and not incomplete:
        listed = "; ".join(f"{item.words}: {item.cure}" for item in missing)
        raise InputError(
            f"The certificate lacks: {listed}.",
            why="A certificate states who calibrated what for whom, with what and when, and every "
            "uncertainty that counts (ISO/IEC 17025:2017, 7.8.2 and 7.8.4).",
            cure="State each as the list says, and calibrate again with a scan that states it. "
            "Find the cause of a failed check (memscal explain). Or write a certificate that says "
            "what it lacks (--incomplete).",
        )
    other = values.pop(_OTHER, None)
    certified = [value for value in values.values() if value.determined]
    artifact = tree_to_bytes(artifact_tree(apparatus.compact()))
    derived = apparatus.content_digest[:_NUMBER_DIGITS].upper()
    stated = sections["laboratory"]
    decision = {} if missing else sections["decision"]
    return Certificate(
        number=stated.get("number") or stated.get("prefix", "") + derived,
        issued=timestamp()[:10],
        sections=sections,
        equipment=equipment,
        apparatus=apparatus,
        texts=texts,
        values=tuple(certified),
        others=(other,) if other else (),
        undetermined=tuple(value for value in values.values() if not value.determined),
        profile=_profile(apparatus),
        conformity=tuple(_conformity(certified, decision, laboratory.name)),
        missing=tuple(missing),
        artifact=artifact if len(artifact) <= _MOST_EMBEDDED else b"",
    )


def _certified(apparatus: ApparatusFunction, name: str) -> CertifiedValue:
    parameters = apparatus.parameters
    budget = apparatus.budget.get(name, {})
    gaussian = all(check.passed for check in apparatus.checks if "gaussian" in check.name)
    return CertifiedValue(
        parameter_quantity(parameters, name),
        parameters[name],
        parameters.uncertainty(name),
        apparatus.coverage_factor(name),
        apparatus.effective_degrees.get(name, math.inf),
        tuple(budget[source] for source in _BOUNDS if budget.get(source)),
        rejected=name in _OF_GAUSSIAN and not gaussian,
    )


def _unstated(
    apparatus: ApparatusFunction, words: Mapping[str, str], values: Mapping[str, CertifiedValue]
) -> Iterator[Missing]:
    """Yield what the calibration lacks: uncertainties of what enters, and checks that passed."""
    states = {each.name: each.state for each in apparatus.assumptions}
    film = apparatus.film
    rod = apparatus.indenter
    unstated = {
        "gain": "gain" not in apparatus.budget.get("conversion_constant", {}),
        # Of an artifact without assumptions nothing is known to be stated.
        "position_scale": states.get("stage_scale", ASSUMED) == ASSUMED,
        "load": states.get("load_scale") == ASSUMED,
        "thickness": film is not None and film.thickness_uncertainty is None,
        "radius": rod is not None and rod.radius_uncertainty is None,
    }
    for name, lacking in unstated.items():
        if lacking:
            yield Missing(words[name], f"memscal import --{name.replace('_', '-')}-uncertainty")
    failed = ", ".join(check.name for check in apparatus.checks if not check.passed)
    if failed:
        yield Missing(f"{words['checks']} ({failed.replace('_', ' ')})", "memscal explain CHECK")
    if not values["conversion_constant"].determined:
        yield Missing(words["conversion_constant"], "measure with less noise")


def _completed(
    apparatus: ApparatusFunction, laboratory: LaboratoryFile
) -> tuple[dict[str, Values], tuple[Values, ...]]:
    """Return sections and equipment of the laboratory's file, with what the artifact states."""
    held = laboratory.additions(apparatus)
    sections = {name: dict(laboratory.sections.get(name, {})) for name in SECTIONS}
    sensor = held["sensor"]
    conditions = sections["conditions"]
    names = ("name", "model", "manufacturer", "channel")
    sections["sensor"] = {name: getattr(sensor, name) for name in names}
    sections["sensor"]["serial"] = sensor.serial_number
    for key in ("start_time", "end_time"):
        conditions[key] = ""
        with suppress(ValueError):  # a scan may state it in any words
            text = held.get(key) or getattr(apparatus, key)
            date.fromisoformat(text[:10])
            conditions[key] = text
    if sensor.temperature is not None:
        conditions["temperature"] = Measured(sensor.temperature, sensor.temperature_uncertainty)
    if held["user"].name:
        sections["person"]["operator"] = held["user"].name
    listed = []
    for kind, attribute in KINDS.items():
        part = held[attribute]
        item = {"name": part.name, "serial": part.serial_number, "certificate": part.certificate}
        if any(item.values()):
            listed.append({**item, "date": part.certificate_date, "kind": kind})
    listed += [dict(item) for item in laboratory.equipment if item.get("kind") not in KINDS]
    return sections, tuple(listed)


def _conformity(values: Iterable[CertifiedValue], decision: Section, name: str) -> list[Conformity]:
    factor = decision.get("guard_band", 1.0)
    rule = decision.get("rule")
    if decision and (rule is None or factor < 0):
        raise InputError(
            f"{name}: [decision] gives no decision rule.",
            cure=f'Write rule = "{RULES[0]}" or "{RULES[1]}", and a guard_band that is not '
            "negative.",
        )
    known = {value.quantity.name: value for value in values}
    statements = []
    for key, limits in decision.items():
        if isinstance(limits, Mapping):
            where = f"{name}: [decision] {key}"
            if key not in known:
                raise InputError(
                    f"{where} is not certified for this sensor.",
                    cure=f"There are {', '.join(known)}.",
                )
            certified = known[key]
            ends = (limits.get("lower", -np.inf), limits.get("upper", np.inf))
            dimension = certified.quantity.dimension
            lower, upper = map(float, to_si(ends, limits.get("unit"), dimension, where))
            guard_band = factor * certified.expanded if rule == RULES[1] else 0.0
            if not lower + guard_band < upper - guard_band:
                raise InputError(
                    f"{where}: no value could be accepted between its limits.",
                    why="The tolerance is not wider than its two guard bands.",
                    cure="Agree on a wider tolerance or a smaller guard_band, or measure better.",
                )
            statements.append(Conformity(certified, lower, upper, guard_band))
    return statements


def _profile(apparatus: ApparatusFunction) -> CertifiedProfile:
    """Return G at even radii up to where its Gaussian has fallen to a hundredth."""
    profile = apparatus.radial_profile
    shown = profile.g_gaussian > _SHOWN_SHARE * profile.g_gaussian[0]
    reach = profile.r[shown][-1]
    sizes = (MM * np.outer(10.0 ** np.arange(-4, 3), [1, 2, 5])).ravel()
    step = sizes[np.searchsorted(sizes, reach / _MOST_RADII)]
    r = step * np.arange(int(reach / step) + 1)
    # A spline is linear in the values that it goes through.
    weights = radial_spline(profile.r, np.eye(profile.r.size))(r)
    return CertifiedProfile(r, weights @ profile.g, weights @ profile.g_covariance @ weights.T)
