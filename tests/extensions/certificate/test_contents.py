"""What a certificate states, what it refuses, and its decision rules."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import memscal
from memscal.errors import InputError
from memscal.extensions.certificate.certificate import CertifiedValue, Conformity, certify
from memscal.extensions.certificate.dcc import certificate_xml
from memscal.extensions.certificate.laboratory import NEEDED, LaboratoryFile
from memscal.extensions.certificate.page import certificate_page, page_of
from memscal.model.quantities import ESTIMATED

LIMITS = "conversion_constant"


def stating(laboratory, section, **values):
    """The file with other values, or without those that are ``None``."""
    held = {**laboratory.sections[section], **values}
    changed = {key: value for key, value in held.items() if value is not None}
    return replace(laboratory, sections={**laboratory.sections, section: changed})


def test_a_file_without_equipment_is_refused_for_its_load_cell(apparatus, laboratory):
    with pytest.raises(InputError, match='kind = "load cell"'):
        certify(apparatus, replace(laboratory, equipment=()))


def test_all_that_is_not_stated_is_named_in_one_list_with_its_cure(apparatus, laboratory):
    scan = replace(
        memscal.simulate(seed=1, points=33),
        film=replace(apparatus.film, thickness_uncertainty=None),
        indenter=memscal.Rod(radius=apparatus.indenter.radius),
        load_uncertainty=None,
    )
    calibrated = memscal.calibrate(scan).apparatus
    failed = memscal.QualityCheck("symmetry", 2.0, 1.0, False, "Left and right differ.")
    lacking = replace(calibrated, sensor=memscal.StressSensor(), checks=(failed,))
    with pytest.raises(InputError) as refusal:
        certify(lacking, stating(laboratory, "person", role=None))
    names = ("gain", "position-scale", "load", "thickness", "radius")
    cures = [f": memscal import --{name}-uncertainty" for name in names]
    cures += ["checks (symmetry): memscal explain CHECK", ": [person] role in lab.toml"]
    assert [cure for cure in cures if cure not in refusal.value.problem] == []
    made = certify(lacking, laboratory, incomplete=True)
    assert (len(made.missing), made.conformity) == (6, ())


def test_a_gaussian_that_the_scan_rejects_is_not_certified_and_checks_are_listed_once(
    apparatus, laboratory, certificate
):
    page = certificate_page(page_of(certificate))
    assert "0.9500 – 1.1000" in page
    assert "<td>(1.000 ± 0.020) N</td>" in page
    assert "correlation of neighbouring readings: none is large enough" in page
    failed = [replace(check, passed="gaussian" not in check.name) for check in apparatus.checks]
    rejected = replace(apparatus, checks=tuple(failed))
    made = certify(rejected, laboratory, incomplete=True)
    names = [value.quantity.name for value in made.undetermined]
    assert names == ["gaussian_sigma", "gaussian_sigma_deconvolved"]
    page = certificate_page(page_of(made))
    assert "it lacks: passed quality checks (gaussian misfit, gaussian evidence).</p>" in page
    assert "σ (the scan shows a departure from a Gaussian)" in page


def test_an_incomplete_certificate_is_written_without_anything_of_the_file(apparatus, laboratory):
    empty = replace(laboratory, sections={}, equipment=())
    made = certify(apparatus, empty, incomplete=True)
    assert "equipment of kind load cell" in str(made.missing)
    assert "equipment of kind load cell" in certificate_page(page_of(made))
    assert certificate_xml(made)


@pytest.mark.parametrize(("section", "key"), [(s, key) for s in NEEDED for key in NEEDED[s]])
def test_one_mandatory_field_that_is_missing_is_named_alone(apparatus, laboratory, section, key):
    place = "[[equipment]] 1" if section == "equipment" else f"[{section}]"
    if section == "equipment":
        first, *others = laboratory.equipment
        changed = replace(laboratory, equipment=({**first, key: ""}, *others))
    else:
        changed = stating(laboratory, section, **{key: None})
    with pytest.raises(InputError) as refusal:
        certify(apparatus, changed)
    assert refusal.value.problem.startswith("The certificate lacks: ")
    assert refusal.value.problem.endswith(f": {place} {key} in lab.toml.")
    assert ";" not in refusal.value.problem


def test_what_the_artifact_states_need_not_be_in_the_file(apparatus, laboratory, certificate):
    stated = replace(apparatus, **laboratory.additions(apparatus))
    humidity = {"humidity": laboratory.stated("conditions", "humidity")}
    sections = {**laboratory.sections, "sensor": {}, "conditions": humidity}
    made = certify(stated, LaboratoryFile("lab.toml", sections, laboratory.equipment[2:]))
    assert made.sections == certificate.sections
    assert made.equipment == certificate.equipment


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sensor": memscal.StressSensor(serial_number="2_2")}, "'2_2' in the scan or artifact"),
        ({"start_time": "2001-01-01T00:00:00Z"}, "start time of the measurement"),
        ({"user": memscal.User(affiliation="another laboratory")}, "affiliation of the user"),
    ],
)
def test_contradictions_of_artifact_and_file_are_refused(apparatus, laboratory, changes, words):
    with pytest.raises(InputError, match=words):
        certify(replace(apparatus, **changes), laboratory)


def test_a_time_in_other_words_than_iso_8601_counts_as_missing(apparatus, laboratory):
    told = replace(apparatus, start_time="on Monday")
    with pytest.raises(InputError, match=r"\[conditions\] start_time"):
        certify(told, stating(laboratory, "conditions", start_time=None))


def test_an_artifact_without_pascals_gets_no_certificate(laboratory):
    relative = memscal.calibrate(memscal.simulate(seed=1, points=33), relative=True).apparatus
    with pytest.raises(InputError, match="relative"):
        certify(relative, laboratory)


def test_the_profile_is_that_of_the_artifact(apparatus, certificate):
    np.testing.assert_allclose(np.diag(certificate.correlation), 1.0)
    assert np.all(np.abs(certificate.correlation) <= 1 + 1e-12)
    r, g, covariance = certificate.profile
    np.testing.assert_allclose(g, apparatus.radial(r), rtol=1e-9)
    # The band between radii is interpolated here by its covariance, there by itself.
    errors = apparatus.radial_uncertainty(r)
    np.testing.assert_allclose(np.sqrt(np.diag(covariance)), errors, rtol=0.02)
    assert 5 <= r.size <= 13
    assert apparatus.radial(r[-1]) < 0.03 * apparatus.radial(0.0)


def conformity(y, u, lower, upper, guard=0.0):
    return Conformity(CertifiedValue(ESTIMATED[LIMITS], y, u), lower, upper, guard)


@pytest.mark.parametrize(
    ("y", "lower", "upper", "expected"),
    [
        # Of a normal distribution: the limit itself, and 1, 2 standard uncertainties from limits.
        (1.0, -np.inf, 1.0, 0.5),
        (1.0, 0.0, 1.0, 0.5),
        (0.9, -np.inf, 1.0, 0.841344746),
        (0.8, -np.inf, 1.0, 0.977249868),
        (1.2, -np.inf, 1.0, 0.022750132),
        (0.5, 0.3, 0.7, 0.954499736),
    ],
)
def test_the_conformance_probability_is_that_of_a_normal_distribution(y, lower, upper, expected):
    assert conformity(y, 0.1, lower, upper).probability == pytest.approx(expected, abs=1e-8)


@pytest.mark.parametrize("bounds", [(), (0.08,), (0.05, 0.07)])
@pytest.mark.parametrize("degrees", [4.0, 30.0, np.inf])
def test_the_conformance_probability_is_that_of_errors_that_are_drawn(bounds, degrees):
    # Noise of few degrees of freedom and another Gaussian make up what no rectangle does.
    rest = np.sqrt(0.1**2 - sum(u**2 for u in bounds))
    value = CertifiedValue(ESTIMATED[LIMITS], 1.0, 0.1, 2.0, degrees, bounds)
    rng = np.random.default_rng(1)
    count = 400_000
    # Welch and Satterthwaite: of the whole u, then of the part without the rectangles.
    own = max(degrees * (rest / 0.1) ** 4, 1.0)
    noise = rng.standard_normal(count)
    if np.isfinite(own):
        noise = noise / np.sqrt(rng.chisquare(own, count) / own)
    errors = rest * noise
    for u in bounds:
        errors += rng.uniform(-np.sqrt(3) * u, np.sqrt(3) * u, count)
    for lower, upper in ((0.9, 1.15), (-np.inf, 1.1), (0.75, np.inf)):
        drawn = np.mean((errors > lower - 1.0) & (errors < upper - 1.0))
        # Four standard deviations of such a share.
        assert value.probability(lower, upper) == pytest.approx(drawn, abs=2 / np.sqrt(count))


@given(st.floats(-10, 10), st.floats(1e-3, 3), st.floats(-10, 10), st.floats(0, 10))
def test_what_is_accepted_with_a_guard_band_of_U_conforms_with_95_percent(y, u, lower, width):
    item = conformity(y, u, lower, lower + width, guard=2 * u)
    assert not item.accepted or item.probability >= 0.9544
    assert replace(item, guard_band=0.0).accepted == (lower <= y <= lower + width)


@pytest.mark.parametrize(
    ("rule", "factor", "upper", "accepted"),
    [
        ("simple acceptance", 1.0, 1.018e-4, True),
        ("guarded acceptance", 1.0, 1.018e-4, False),
        ("guarded acceptance", 1.0, 1.10e-4, True),
        ("guarded acceptance", 0.0, 1.018e-4, True),
        ("guarded acceptance", 2.5, 1.10e-4, False),
        ("simple acceptance", 1.0, 1.006e-4, False),
    ],
)
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
    ({LIMITS: {"lower": 1e-4, "upper": 1.03e-4, "unit": "mV/Pa"}}, "no value could be accepted"),
])  # fmt: skip
def test_limits_that_cannot_be_decided_on_are_refused(apparatus, laboratory, changes, words):
    with pytest.raises(InputError, match=words):
        certify(apparatus, stating(laboratory, "decision", **changes))
