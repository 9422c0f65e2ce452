"""Contents of a certificate of calibration, once for all its forms."""

from collections.abc import Iterable, Mapping
from contextlib import suppress
from datetime import date
from typing import NamedTuple

import numpy as np
from scipy.special import ndtr

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import radial_spline
from memscal.errors import InputError
from memscal.extensions.certificate.laboratory import (
    KINDS,
    RULES,
    LaboratoryFile,
    Measured,
    Section,
    missing_keys,
)
from memscal.formats.artifact import artifact_tree
from memscal.formats.hdf5.writer import tree_to_bytes
from memscal.formats.units import to_si
from memscal.model.arrays import FloatArray, Values, keyword_value_record, value_record
from memscal.model.checks import OVERRIDE
from memscal.model.provenance import timestamp
from memscal.model.quantities import MM, Quantity, parameter_quantity

COVERAGE_FACTOR = 2.0
COVERAGE_PROBABILITY = 0.95
"""k of U = k u of many degrees of freedom, and about what a normal distribution has within."""

#: Parameters of the sensor; the others are those of one scan.
_SENSOR_PARAMETERS = (
    "conversion_constant",
    "conversion_constant_gaussian",
    "gaussian_sigma",
    "gaussian_sigma_deconvolved",
    "fwhm",
    "noise_equivalent_area",
    "ellipticity",
    "ellipticity_diagonal",
)
SYNTHETIC = "SYNTHETIC DATA: NOTHING WAS MEASURED"
_SHOWN_SHARE = 0.01
_MOST_RADII = 12
#: A value that conforms with less probability rather does not.
_EVEN = 0.5
_NUMBER_DIGITS = 10
_MOST_EMBEDDED = 4_000_000


@value_record
class CertifiedValue:
    """A parameter with its standard uncertainty, in SI units, and how it is shown."""

    quantity: Quantity
    value: float
    uncertainty: float
    factor: float = COVERAGE_FACTOR  # k: larger where an estimated noise has few degrees of freedom

    @property
    def expanded(self) -> float:
        """The expanded uncertainty U = k u."""
        return self.factor * self.uncertainty


@value_record
class Conformity:
    """Whether a value conforms with its tolerance, by a decision rule; -inf or inf: no limit."""

    certified: CertifiedValue
    lower: float
    upper: float
    guard_band: float

    @property
    def accepted(self) -> bool:
        """Whether the value lies within the acceptance interval (JCGM 106:2012, 8.3.2)."""
        lowest = self.lower + self.guard_band
        highest = self.upper - self.guard_band
        return lowest <= self.certified.value <= highest

    @property
    def statement(self) -> str:
        """The statement of conformity in words."""
        if not self.accepted:
            return "not stated to conform"
        rather_not = ", though more probably it does not: the tolerance is too narrow to tell"
        return f"conforms{rather_not if self.probability < _EVEN else ''}"

    @property
    def probability(self) -> float:
        r"""Conformance probability of a normal distribution (JCGM 106:2012, 7.3).

        :math:`p_c = \Phi((T_U - y)/u) - \Phi((T_L - y)/u)`.
        """
        low = self.lower - self.certified.value
        high = self.upper - self.certified.value
        u = self.certified.uncertainty
        return ndtr(high / u) - ndtr(low / u) if u > 0 else float(low <= 0 <= high)


class CertifiedProfile(NamedTuple):
    """G (n,) at radii ``r`` (n,), with its covariance (n, n), in SI units."""

    r: FloatArray
    g: FloatArray
    covariance: FloatArray


@keyword_value_record
class Certificate:
    """What a certificate states: on its pages, and in XML."""

    number: str
    issued: str
    sections: Mapping[str, Section]  # of the laboratory's file, with the artifact's
    equipment: tuple[Section, ...]
    apparatus: ApparatusFunction
    values: tuple[CertifiedValue, ...]
    covariance: FloatArray  # of the values, in SI units
    profile: CertifiedProfile
    conformity: tuple[Conformity, ...]
    artifact: bytes  # the artifact in its compact form; empty if that is too large

    @property
    def correlation(self) -> FloatArray:
        """Correlation coefficients of the values."""
        u = np.sqrt(np.diag(self.covariance))
        scale = np.multiply.outer(u, u)
        return np.divide(self.covariance, scale, out=np.eye(u.size), where=scale > 0)

    @property
    def synthetic(self) -> bool:
        """Whether the scan was simulated."""
        return any(message.kind == "synthetic" for message in self.apparatus.process.messages)

    @property
    def warnings(self) -> list[str]:
        """What must be said first: synthetic data, checks that failed, what was overridden."""
        warnings = []
        if self.synthetic:
            form = "This shows the form of a certificate and certifies nothing."
            warnings.append(f"{SYNTHETIC}. {form}")
        failed = [c.name.replace("_", " ") for c in self.apparatus.checks if not c.passed]
        if failed:
            warnings.append(f"Quality checks of the calibration that failed: {', '.join(failed)}.")
        messages = self.apparatus.process.messages
        return warnings + [m.text for m in messages if m.kind == OVERRIDE]

    @property
    def accreditation(self) -> str:
        """What the laboratory states of its accreditation, in a sentence."""
        stated = self.sections["laboratory"].get("accreditation")
        none = "This is no accredited certificate: the laboratory states no accreditation for it."
        return f"Accreditation, as the laboratory states it: {stated}." if stated else none

    @property
    def decision(self) -> str:
        """The decision rule in words."""
        stated = self.sections.get("decision", {})
        if stated.get("rule") == RULES[0]:
            return "Simple acceptance (JCGM 106:2012, 8.2): the value lies within its tolerance."
        rule = "Guarded acceptance (JCGM 106:2012, 8.3.2): the value lies within its tolerance"
        band = f"the guard band w = {stated.get('guard_band', 1.0):g} U"
        return f"{rule}, and clear of its limits by {band}."


def certify(apparatus: ApparatusFunction, laboratory: LaboratoryFile) -> Certificate:
    """Return the contents of a certificate; what is mandatory and missing is all named."""
    apparatus.require_pascals()
    sections, equipment = _completed(apparatus, laboratory)
    missing = [*missing_keys(sections, equipment)]
    if missing:
        raise InputError(
            f"The certificate lacks {len(missing)} mandatory fields: {'; '.join(missing)}.",
            why="A certificate states who calibrated what for whom, with what and when (ISO/IEC "
            "17025:2017, 7.8.2 and 7.8.4).",
            cure=f"State them in {laboratory.name}, or in the scan (memscal import --lab).",
        )
    parameters = apparatus.parameters
    parameters = parameters.only([name for name in _SENSOR_PARAMETERS if name in parameters])
    values = []
    for name in parameters.names:
        quantity = parameter_quantity(parameters, name)
        u = parameters.uncertainty(name)
        values.append(
            CertifiedValue(quantity, parameters[name], u, apparatus.coverage_factor(name))
        )
    artifact = tree_to_bytes(artifact_tree(apparatus.compact()))
    derived = apparatus.content_digest[:_NUMBER_DIGITS].upper()
    stated = sections["laboratory"]
    return Certificate(
        number=stated.get("number") or stated.get("prefix", "") + derived,
        issued=timestamp()[:10],
        sections=sections,
        equipment=equipment,
        apparatus=apparatus,
        values=tuple(values),
        covariance=parameters.covariance,
        profile=_profile(apparatus),
        conformity=tuple(_conformity(values, sections.get("decision", {}), laboratory.name)),
        artifact=artifact if len(artifact) <= _MOST_EMBEDDED else b"",
    )


def _completed(
    apparatus: ApparatusFunction, laboratory: LaboratoryFile
) -> tuple[dict[str, Values], tuple[Values, ...]]:
    """Return sections and equipment of the laboratory's file, with what the artifact states."""
    held = laboratory.additions(apparatus)
    sections = {name: dict(section) for name, section in laboratory.sections.items()}
    sensor = held["sensor"]
    conditions = sections.setdefault("conditions", {})
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
        stated = Measured(sensor.temperature, sensor.temperature_uncertainty)
        conditions["temperature"] = stated
    if held["user"].name:
        sections.setdefault("person", {})["operator"] = held["user"].name
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
