"""The checks that the data classes share: what passes, what does not, and what is said."""

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from memscal.errors import InputError
from memscal.model import arrays

NUMBERS = st.floats(allow_nan=True, allow_infinity=True)


def refused(check, *arguments) -> bool:
    try:
        check(*arguments)
    except InputError:
        return True
    return False


@given(NUMBERS)
def test_positive_means_above_zero_and_not_negative_zero_too_and_both_finite(value: float) -> None:
    assert refused(arrays.require_positive, "thickness", value) == (not 0 < value < math.inf)
    assert refused(arrays.require_non_negative, "roughness", value) == (not 0 <= value < math.inf)


@given(NUMBERS, NUMBERS, NUMBERS)
def test_a_range_holds_both_of_its_ends_and_nothing_infinite(value, low, high) -> None:
    inside = low <= value <= high and math.isfinite(value)
    assert refused(arrays.require_range, "ratio", value, low, high) == (not inside)


def test_a_refusal_names_quantity_value_and_unit() -> None:
    with pytest.raises(InputError, match=r"film thickness is -0\.002 m, but .* above zero"):
        arrays.require_positive("film thickness", -2e-3, "m")
    with pytest.raises(InputError, match=r"ratio is 0\.7, but it must lie from 0 to 0\.5"):
        arrays.require_range("ratio", 0.7, 0.0, 0.5)


@pytest.mark.parametrize(("values", "problem"), [
    ([], r"shape \(0,\)"), (1.0, r"shape \(\)"), ([[1.0, 2.0]], r"shape \(1, 2\)"),
    ([0.0, math.nan], "not finite"), ([0.0, -math.inf], "not finite"),
])  # fmt: skip
def test_what_is_no_finite_vector_is_refused(values: object, problem: str) -> None:
    with pytest.raises(InputError, match=f"r of the profile .*{problem}"):
        arrays.finite_vector("r of the profile", values)


@given(st.lists(st.floats(-1e6, 1e6), min_size=1))
def test_increasing_means_each_above_the_last(values: list[float]) -> None:
    strictly = all(b > a for a, b in itertools.pairwise(values))
    assert refused(arrays.require_increasing, "r", np.array(values)) == (not strictly)
