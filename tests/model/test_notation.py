"""Measured values in words: rounding, exponents, and what is said when nothing is known."""

import re

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from memscal.errors import InputError
from memscal.model.notation import format_measured


@pytest.mark.parametrize(("value", "uncertainty", "unit", "plain"), [
    # JCGM 100:2008, 7.2.2: the gauge block of its example, 100.021 47(35) g.
    (100.02147, 0.00035, "g", "(100.02147 ± 0.00035) g"),
    (0.56123, 0.00342, "mm", "(0.5612 ± 0.0034) mm"),
    (1.0, 0.0996, "mm", "(1.00 ± 0.10) mm"),
    (3.0123e-5, 1.2e-7, "mV/Pa", "(3.012 ± 0.012)×10⁻⁵ mV/Pa"),
    (1.5, 25.0, "mm", "(2 ± 25) mm"),
    (12345.0, 1234.0, "Pa", "(12300 ± 1200) Pa"),
    (999999.0, 51.0, "", "(9.99999 ± 0.00051)×10⁵"),
    (0.5, 0.01, "1", "0.500 ± 0.010"), (-0.0001, 0.02, "mV", "(0.000 ± 0.020) mV"),
])  # fmt: skip
def test_a_value_is_rounded_to_two_digits_of_its_uncertainty(value, uncertainty, unit, plain):
    assert format_measured(value, uncertainty, unit) == plain


@pytest.mark.parametrize("uncertainty", [None, 0.0, float("nan"), float("inf")])
def test_a_missing_uncertainty_is_said_in_words(uncertainty):
    assert format_measured(2.0, uncertainty, "mm") == "2 mm (no uncertainty stated)"


@pytest.mark.parametrize("value", [float("nan"), float("inf")])
def test_a_value_that_is_not_finite_was_not_determined(value):
    assert format_measured(value, 1.0, "mm") == "not determined"


def test_a_negative_uncertainty_is_refused():
    with pytest.raises(InputError, match="negative"):
        format_measured(1.0, -0.1, "mm")


@given(value=st.floats(-1e30, 1e30), uncertainty=st.floats(1e-30, 1e30))
def test_what_is_read_back_differs_by_no_more_than_the_rounding(value, uncertainty):
    assume(uncertainty > 1e-11 * abs(value))
    text = format_measured(value, uncertainty, "m")
    match = re.fullmatch(r"\((-?[\d.]+) ± ([\d.]+)\)(?:×10([⁻⁰¹²³⁴⁵⁶⁷⁸⁹]+))? m", text)
    assert match is not None, text
    factor = 10.0 ** int((match[3] or "0").translate(str.maketrans("⁻⁰¹²³⁴⁵⁶⁷⁸⁹", "-0123456789")))
    assert float(match[2]) * factor == pytest.approx(uncertainty, rel=0.0501)
    assert abs(float(match[1]) * factor - value) <= 0.0501 * uncertainty + 1e-14 * abs(value)
