"""Contents of a certificate of calibration, once for all its forms."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from typing import Any

import numpy as np
from scipy.special import ndtr

from memscal.apparatus import ApparatusFunction
from memscal.axisymmetry.hankel import radial_spline
from memscal.errors import InputError
from memscal.formats.artifact import artifact_tree
from memscal.formats.hdf5.writer import tree_to_bytes
from memscal.formats.laboratory import (
    RULES,
    LaboratoryFile,
    Measured,
    missing_keys,
    missing_of_equipment,
)
from memscal.formats.units import to_si
from memscal.model.arrays import FloatArray
from memscal.model.provenance import timestamp
from memscal.model.quantities import MM, Quantity, parameter_quantity

COVERAGE_FACTOR = 2.0
"""k of every expanded uncertainty, U = k u."""
COVERAGE_PROBABILITY = 0.95
"""About that of a normal distribution within k = 2."""

#: Parameters of the sensor; the others are those of one scan.
_OF_SENSOR = (
    *("conversion_constant", "conversion_constant_gaussian", "gaussian_sigma"),
    *("gaussian_sigma_deconvolved", "fwhm", "noise_equivalent_area"),
    *("ellipticity", "ellipticity_diagonal"),
)
_LEAST_OF_G, _MOST_RADII = 0.01, 12
_DIGITS_OF_NUMBER = 10
_MOST_EMBEDDED = 4_000_000


@dataclass(frozen=True)
class CertifiedValue:
    """A parameter with its standard uncertainty, in SI units, and how it is shown."""

    quantity: Quantity
    value: float
    uncertainty: float

    @property
    def expanded(self) -> float:
        """The expanded uncertainty U = k u."""
        return COVERAGE_FACTOR * self.uncertainty


@dataclass(frozen=True)
class Conformity:
    """Whether a value conforms with its tolerance interval, by a decision rule; in SI units."""

    of: CertifiedValue
    lower: float  # -inf and inf where there is no such limit
    upper: float
    guard_band: float

    @property
    def accepted(self) -> bool:
        """Whether the value lies within the acceptance interval (JCGM 106:2012, 8.3.2)."""
        return self.lower + self.guard_band <= self.of.value <= self.upper - self.guard_band

    @property
    def statement(self) -> str:
        """The statement of conformity in words."""
        return "conforms" if self.accepted else "not stated to conform"

    @property
    def probability(self) -> float:
        r"""Conformance probability of a normal distribution (JCGM 106:2012, 7.2.2, 7.3).

        :math:`p_c = \Phi((T_U - y)/u) - \Phi((T_L - y)/u)`.
        """
        limits = np.array([self.lower, self.upper]) - self.of.value
        if not self.of.uncertainty > 0:
            return float(limits[0] <= 0 <= limits[1])
        low, high = ndtr(limits / self.of.uncertainty)
        return float(high - low)


@dataclass(frozen=True)
class CertifiedProfile:
    """G at some radii, in SI units: ``r``, ``g`` (n,), and the covariance (n, n)."""

    r: FloatArray
    g: FloatArray
    covariance: FloatArray

    @property
    def expanded(self) -> FloatArray:
        """The expanded uncertainties of G, (n,)."""
        return COVERAGE_FACTOR * np.sqrt(np.diag(self.covariance))


@dataclass(frozen=True, kw_only=True)
class Certificate:
    """What a certificate states: on its pages, and in XML."""

    number: str
    issued: str
    sections: Mapping[str, Mapping[str, Any]]  # of the laboratory's file, with the artifact's
    equipment: tuple[Mapping[str, Any], ...]
    apparatus: ApparatusFunction
    values: tuple[CertifiedValue, ...]
    covariance: FloatArray  # of the values, in SI units
    profile: CertifiedProfile
    conformity: tuple[Conformity, ...]
    artifact: bytes  # of the artifact in its compact form; empty if that is too large

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
    def decision(self) -> str:
        """The decision rule in words."""
        stated = self.sections.get("decision", {})
        if stated.get("rule") == RULES[0]:
            return "Simple acceptance (JCGM 106:2012, 8.2): the value lies within its tolerance."
        return (
            "Guarded acceptance (JCGM 106:2012, 8.3.2): the value lies within its tolerance, and "
            f"clear of its limits by the guard band w = {stated.get('guard_band', 1.0):g} U."
        )


def certify(apparatus: ApparatusFunction, laboratory: LaboratoryFile) -> Certificate:
    """Return the contents of a certificate; refuse one that lacks what is mandatory, by name.

    Raises
    ------
    InputError
        If mandatory fields are missing (all are named), artifact and laboratory's file contradict
        each other, or the conversion constant is not per pascal.
    """
    apparatus.require_pascals()
    sections, equipment = _completed(apparatus, laboratory)
    missing = [*missing_keys(sections)]
    for i, item in enumerate(equipment, 1):
        missing += missing_of_equipment(i, item)
    if not any(item.get("kind") == "load cell" for item in equipment):
        missing.append('[[equipment]] kind = "load cell" (what gave the load)')
    if missing:
        raise InputError(
            f"The certificate lacks {len(missing)} mandatory fields: {'; '.join(missing)}.",
            why="A certificate states who calibrated what for whom, with what and when (ISO/IEC "
            "17025:2017, 7.8.2 and 7.8.4).",
            cure=f"State them in {laboratory.name}, or in the scan (memscal import --lab).",
        )
    _require_dates(sections["conditions"], laboratory.name)
    names = [name for name in _OF_SENSOR if name in apparatus.parameters]
    parameters = apparatus.parameters.only(names)
    values = tuple(
        CertifiedValue(
            parameter_quantity(parameters, name), parameters[name], parameters.uncertainty(name)
        )
        for name in names
    )
    artifact = tree_to_bytes(artifact_tree(apparatus.compact()))
    derived = apparatus.content_digest[:_DIGITS_OF_NUMBER].upper()
    of_laboratory = sections["laboratory"]
    return Certificate(
        number=of_laboratory.get("number") or of_laboratory.get("prefix", "") + derived,
        issued=timestamp()[:10],
        sections=sections,
        equipment=equipment,
        apparatus=apparatus,
        values=values,
        covariance=parameters.covariance,
        profile=_profile(apparatus),
        conformity=tuple(_conformity(values, sections.get("decision", {}), laboratory.name)),
        artifact=artifact if len(artifact) <= _MOST_EMBEDDED else b"",
    )


def _completed(
    apparatus: ApparatusFunction, laboratory: LaboratoryFile
) -> tuple[dict[str, dict[str, Any]], tuple[dict[str, Any], ...]]:
    """Return sections and equipment of the laboratory's file, with what the artifact states."""
    held = laboratory.additions(apparatus)
    sections = {name: dict(section) for name, section in laboratory.sections.items()}
    sensor, times = held["sensor"], [held.get(k, getattr(apparatus, k)) for k in _TIMES]
    sections["sensor"] = {
        **{name: getattr(sensor, name) for name in ("name", "model", "manufacturer", "channel")},
        "serial": sensor.serial_number,
    }
    conditions = sections.setdefault("conditions", {})
    conditions |= dict(zip(_TIMES, times, strict=True))
    if sensor.temperature is not None:
        measured = Measured(sensor.temperature, sensor.temperature_uncertainty)
        conditions["temperature"] = measured
    if held["user"].name:
        sections.setdefault("person", {})["operator"] = held["user"].name
    listed = [item for item in laboratory.equipment if item.get("kind") not in _KINDS]
    for kind, attribute in _KINDS.items():
        part = held[attribute]
        if part != type(part)():
            item = {"name": part.name, "serial": part.serial_number, "kind": kind}
            listed.append(item | {"certificate": part.certificate, "date": part.certificate_date})
    listed.sort(key=lambda item: [*_KINDS, item.get("kind")].index(item.get("kind")))
    return sections, tuple(dict(item) for item in listed)


def _require_dates(conditions: Mapping[str, Any], name: str) -> None:
    """Refuse times of the measurement that are none, or that run backwards."""
    dates = []
    for key in _TIMES:
        if text := conditions.get(key):
            try:
                dates.append(date.fromisoformat(text[:10]))
            except ValueError as error:
                problem = f"The {key.replace('_', ' ')} of the measurement is {text!r}."
                why = "A certificate states the date of the measurement."
                cure = f"State it like 2026-11-20T09:30:00+01:00, in {name} or in the scan."
                raise InputError(problem, why=why, cure=cure) from error
    if dates != sorted(dates):
        raise InputError(f"The measurement begins on {dates[0]} and ends on {dates[1]}.")


_TIMES = ("start_time", "end_time")
_KINDS = {"load cell": "load_cell", "stage": "stage"}


def _conformity(
    values: tuple[CertifiedValue, ...], decision: Mapping[str, Any], name: str
) -> list[Conformity]:
    statements, known = [], {value.quantity.name: value for value in values}
    limits = {key: item for key, item in decision.items() if key not in ("rule", "guard_band")}
    if limits and "rule" not in decision:
        cure = f'Write rule = "{RULES[0]}" or "{RULES[1]}".'
        raise InputError(f"{name}: [decision] states limits, but no rule.", cure=cure)
    for key, tolerance in limits.items():
        if key not in known:
            problem = f"{name}: [decision] {key} is not certified for this sensor."
            raise InputError(problem, cure=f"There are {', '.join(known)}.")
        value, where = known[key], f"{name}: [decision] {key}"
        ends = (tolerance.get("lower", -np.inf), tolerance.get("upper", np.inf))
        dimension = value.quantity.dimension
        lower, upper = to_si(ends, tolerance.get("unit"), dimension, where)
        factor = decision.get("guard_band", 1.0) if decision["rule"] == RULES[1] else 0.0
        if factor < 0:
            raise InputError(f"{name}: [decision] guard_band is {factor:g}, below zero.")
        statements.append(Conformity(value, float(lower), float(upper), factor * value.expanded))
    return statements


def _profile(apparatus: ApparatusFunction) -> CertifiedProfile:
    """Return G at even radii up to where its Gaussian has fallen to a hundredth."""
    profile = apparatus.radial_profile
    reach = profile.r[np.flatnonzero(profile.g_gaussian > _LEAST_OF_G * profile.g_gaussian[0])[-1]]
    steps = [digit * 10.0**power * MM for power in range(-4, 3) for digit in (1, 2, 5)]
    step = next(step for step in steps if reach <= _MOST_RADII * step)
    r: FloatArray = step * np.arange(int(reach / step) + 1, dtype=np.float64)
    # A spline is linear in the values that it goes through.
    weights: FloatArray = radial_spline(profile.r, np.eye(profile.r.size))(r)
    return CertifiedProfile(r, weights @ profile.g, weights @ profile.g_covariance @ weights.T)
