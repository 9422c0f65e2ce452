"""The recurrence against scipy's function, order by order."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.special import spherical_jn

from memscal.mechanics.rod import spherical_bessel


@pytest.mark.parametrize("count", [1, 2, 33, 257])
@pytest.mark.parametrize("largest", [1e-9, 0.1, 5.0, 80.0, 900.0])
def test_every_order_agrees_with_scipy(count: int, largest: float) -> None:
    x = np.concatenate([[0.0, np.pi * (largest > 4)], np.linspace(0.0, largest, 41)])
    expected = spherical_jn(np.arange(count)[:, None], x)
    np.testing.assert_allclose(spherical_bessel(count, x), expected, atol=3e-15)
