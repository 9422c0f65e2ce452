"""Composite Gauss-Legendre rules against the integrals they are for."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from memscal.axisymmetry.hankel import gauss_panels


@given(degree=st.integers(0, 31), upper=st.floats(1e-6, 1e6), panels=st.integers(1, 7))
def test_a_rule_of_sixteen_nodes_is_exact_to_degree_thirty_one(degree, upper, panels) -> None:
    nodes, weights = gauss_panels(upper, upper / panels * 1.0001, order=16)
    assert weights @ (nodes / upper) ** degree == pytest.approx(upper / (degree + 1), rel=1e-12)


@pytest.mark.parametrize(("order", "phase"), [(16, 16.0), (64, 100.0)])
def test_a_panel_integrates_the_phase_that_its_nodes_resolve(order: int, phase: float) -> None:
    nodes, weights = gauss_panels(1.0, 1.0, order)
    for start in np.linspace(0.0, 2 * np.pi, 13):
        exact = (np.sin(phase + start) - np.sin(start)) / phase
        assert weights @ np.cos(phase * nodes + start) == pytest.approx(exact, abs=5e-14)


@given(upper=st.floats(1e-3, 1e3), longest=st.floats(1e-1, 1e4), order=st.integers(1, 20))
def test_no_panel_is_longer_than_allowed_and_none_is_spent_needlessly(upper, longest, order):
    nodes, weights = gauss_panels(upper, longest, order)
    panels = nodes.size // order
    assert upper / panels <= longest * (1 + 1e-12)
    assert panels == 1 or upper / (panels - 1) >= longest * (1 - 1e-12)
    assert np.all(np.diff(nodes, prepend=0.0, append=upper) > 0)
    assert weights.sum() == pytest.approx(upper, rel=1e-12)
