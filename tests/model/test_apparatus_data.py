"""Parameters, checks and the short cuts to them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from memscal.errors import InputError
from memscal.model.apparatus import ParameterSet


@given(st.lists(st.floats(1e-12, 1e12), min_size=1, max_size=6))
def test_an_uncertainty_is_the_root_of_its_variance(deviations: list[float]) -> None:
    names = tuple(f"p{i}" for i in range(len(deviations)))
    values = np.arange(len(deviations), dtype=float)
    parameters = ParameterSet(names, values, np.diag(np.square(deviations)))
    for name, value, deviation in zip(names, values, deviations, strict=True):
        assert parameters[name] == value
        assert parameters.uncertainty(name) == pytest.approx(deviation)
        assert name in parameters
    assert "another" not in parameters


@pytest.mark.parametrize(("values", "covariance", "units"), [
    (np.zeros(3), np.zeros((2, 2)), ()),
    (np.zeros(2), np.zeros((3, 3)), ()),
    (np.zeros(2), np.zeros(2), ()),
    (np.zeros(2), np.zeros((2, 2)), ("m",)),
])  # fmt: skip
def test_parameters_that_do_not_fit_together_are_refused(values, covariance, units) -> None:
    with pytest.raises(InputError, match="2 parameter names"):
        ParameterSet(("a", "b"), values, covariance, units)
