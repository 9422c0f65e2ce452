"""What a certificate states, what it refuses, and its decision rules."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import memscal
from memscal.certificate.certificate import CertifiedValue, Conformity, certify
from memscal.errors import InputError
from memscal.formats.laboratory import NEEDED, LaboratoryFile
from memscal.model.quantities import ESTIMATED

LIMITS = "conversion_constant"


def without(laboratory: LaboratoryFile, section: str, key: str) -> LaboratoryFile:
    """The file without a key, of equipment without that of the first instrument."""
    if section == "equipment":
        first, *others = laboratory.equipment
        return replace(
            laboratory, equipment=({k: v for k, v in first.items() if k != key}, *others)
        )
    kept = {k: v for k, v in laboratory.sections[section].items() if k != key}
    return replace(laboratory, sections={**laboratory.sections, section: kept})


def stating(laboratory: LaboratoryFile, section: str, **values: object) -> LaboratoryFile:
    changed = {**laboratory.sections[section], **values}
    return replace(laboratory, sections={**laboratory.sections, section: changed})


def test_an_empty_file_is_refused_with_every_mandatory_field_by_name(apparatus):
    with pytest.raises(InputError) as refusal:
        certify(apparatus, LaboratoryFile("lab.toml", {}))
    sections = [section for section in NEEDED if section != "equipment"]
    needed = [f"[{section}] {key}" for section in sections for key in NEEDED[section]]
    assert [name for name in needed if name not in refusal.value.problem] == []
    assert f"lacks {len(needed) + 1} mandatory" in refusal.value.problem
    assert 'kind = "load cell"' in refusal.value.problem


@pytest.mark.parametrize(("section", "key"), [(s, key) for s in NEEDED for key in NEEDED[s]])
def test_one_mandatory_field_that_is_missing_is_named_alone(apparatus, laboratory, section, key):
    with pytest.raises(InputError) as refusal:
        certify(apparatus, without(laboratory, section, key))
    place = "[[equipment]] 1" if section == "equipment" else f"[{section}]"
    assert f"lacks 1 mandatory fields: {place} {key}." in refusal.value.problem


def test_what_the_artifact_states_need_not_be_in_the_file(apparatus, laboratory, certificate):
    stated = replace(apparatus, **laboratory.additions(apparatus))
    bare = LaboratoryFile("lab.toml", {
        **laboratory.sections, "sensor": {}, "conditions": {
            "humidity": laboratory.stated("conditions", "humidity"),
        },
    }, laboratory.equipment[2:])  # fmt: skip
    made = certify(stated, bare)
    assert made.sections == certificate.sections
    assert made.equipment == certificate.equipment


@pytest.mark.parametrize(("changes", "words"), [
    ({"sensor": memscal.StressSensor(serial_number="2")}, "'2' in the scan or artifact"),
    ({"start_time": "2001-01-01T00:00:00Z"}, "start time of the measurement"),
    ({"user": memscal.User(affiliation="another laboratory")}, "affiliation of the user"),
])  # fmt: skip
def test_an_artifact_that_says_otherwise_than_the_file_is_refused(
    apparatus, laboratory, changes, words
):
    with pytest.raises(InputError, match=words):
        certify(replace(apparatus, **changes), laboratory)


@pytest.mark.parametrize(("begin", "end"), [("on Monday", ""), ("2026-02-03", "2026-02-02")])
def test_times_that_are_none_or_run_backwards_are_refused(apparatus, laboratory, begin, end):
    with pytest.raises(InputError, match=f"from {begin}"):
        certify(apparatus, stating(laboratory, "conditions", start_time=begin, end_time=end))


def test_an_artifact_without_pascals_gets_no_certificate(laboratory):
    relative = memscal.calibrate(memscal.simulate(seed=1, points=33), relative=True).apparatus
    with pytest.raises(InputError, match="relative"):
        certify(relative, laboratory)


def test_the_number_is_that_of_the_artifact_unless_the_file_gives_one(
    apparatus, laboratory, certificate
):
    assert certificate.number == "EXAMPLE-" + apparatus.content_digest[:10].upper()
    other = certify(replace(apparatus, load=2.0), laboratory)
    assert other.number != certificate.number
    given_one = stating(laboratory, "laboratory", number="2026/17")
    assert certify(apparatus, given_one).number == "2026/17"


def test_values_and_profile_are_those_of_the_artifact(apparatus, certificate):
    parameters = apparatus.parameters
    for value in certificate.values:
        assert value.value == parameters[value.quantity.name]
        assert value.expanded == 2 * parameters.uncertainty(value.quantity.name)
    np.testing.assert_allclose(np.diag(certificate.correlation), 1.0)
    assert np.all(np.abs(certificate.correlation) <= 1 + 1e-12)
    profile = certificate.profile
    np.testing.assert_allclose(profile.g, apparatus.radial(profile.r), rtol=1e-9)
    # The band between radii is interpolated here by its covariance, there by itself.
    expected = 2 * apparatus.radial_uncertainty(profile.r)
    np.testing.assert_allclose(profile.expanded, expected, rtol=0.02)
    assert 5 <= profile.r.size <= 13
    assert apparatus.radial(profile.r[-1]) < 0.03 * apparatus.radial(0.0)


def conformity(y: float, u: float, lower: float, upper: float, guard: float = 0.0) -> Conformity:
    return Conformity(CertifiedValue(ESTIMATED[LIMITS], y, u), lower, upper, guard)


@pytest.mark.parametrize(("y", "lower", "upper", "expected"), [
    # Of a normal distribution: the limit itself, and 1, 2 standard uncertainties from limits.
    (1.0, -np.inf, 1.0, 0.5), (1.0, 0.0, 1.0, 0.5), (0.9, -np.inf, 1.0, 0.841344746),
    (0.8, -np.inf, 1.0, 0.977249868), (1.2, -np.inf, 1.0, 0.022750132),
    (0.5, 0.3, 0.7, 0.954499736),
])  # fmt: skip
def test_the_conformance_probability_is_that_of_a_normal_distribution(y, lower, upper, expected):
    assert conformity(y, 0.1, lower, upper).probability == pytest.approx(expected, abs=1e-8)


NUMBERS = st.floats(-10, 10)


@given(NUMBERS, st.floats(1e-3, 3), NUMBERS, st.floats(0, 10))
def test_what_is_accepted_with_a_guard_band_of_U_conforms_with_95_percent(y, u, lower, width):
    item = conformity(y, u, lower, lower + width, guard=2 * u)
    if item.accepted:
        assert item.probability >= 0.9544
    assert replace(item, guard_band=0.0).accepted == (lower <= y <= lower + width)


@pytest.mark.parametrize(("rule", "factor", "upper", "accepted"), [
    ("simple acceptance", 1.0, 1.018e-4, True), ("guarded acceptance", 1.0, 1.018e-4, False),
    ("guarded acceptance", 1.0, 1.10e-4, True), ("guarded acceptance", 0.0, 1.018e-4, True),
    ("guarded acceptance", 2.5, 1.10e-4, False), ("simple acceptance", 1.0, 1.016e-4, False),
])  # fmt: skip
def test_the_decision_is_that_of_its_rule(apparatus, laboratory, rule, factor, upper, accepted):
    limits = {LIMITS: {"upper": upper, "unit": "mV/Pa"}}
    decision = stating(laboratory, "decision", rule=rule, guard_band=factor, **limits)
    (item,) = certify(apparatus, decision).conformity
    assert item.accepted == accepted
    assert item.upper == pytest.approx(1e-3 * upper)


@pytest.mark.parametrize(("changes", "words"), [
    ({"rule": None}, "no decision rule"), ({"guard_band": -1.0}, "not negative"),
    ({"ellipticity": {"lower": 0.0, "unit": "1"}}, "is not certified"),
    ({LIMITS: {"lower": 1.0, "unit": "mm"}}, "must be a voltage per stress"),
    ({LIMITS: {"lower": 1.0}}, "has no unit"),
])  # fmt: skip
def test_limits_that_cannot_be_decided_on_are_refused(apparatus, laboratory, changes, words):
    changed = stating(laboratory, "decision", **changes)
    if changes.get("rule", "") is None:
        changed = without(laboratory, "decision", "rule")
    with pytest.raises(InputError, match=words):
        certify(apparatus, changed)
