"""What a planned scan is, and what no scan can be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import memscal
from memscal.errors import FitError, InputError
from memscal.planning.plan import Plan


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"step": -0.1e-3}, "step"),
        ({"step": 0.0}, "step"),
        ({"step": float("nan")}, "step"),
        ({"half_range": -1e-3}, "half range"),
        ({"load": 0.0}, "load"),
        ({"conversion_constant": -1e-7}, "conversion constant"),
        ({"load_uncertainty": -0.01}, "load"),
        ({"repeats": 0}, "repeated 0 times"),
        ({"repeats": 1.5}, "repeated 1.5 times"),
        ({"noise": 0.0}, "noise"),
        ({"noise": -0.01}, "noise"),
        ({"noise_voltage": 0.0}, "noise"),
        ({"half_range": 2e-3, "centre": 3e-3}, "2 mm to either side"),
        ({"step": 1e-6}, "positions"),
        ({"half_range": 8.0}, "positions"),
    ],
)
def test_a_plan_that_makes_no_scan_is_refused(given: dict[str, Any], told: str) -> None:
    with pytest.raises(InputError, match=told):
        Plan(**given)


def test_fewer_positions_than_parameters_determine_nothing() -> None:
    with pytest.raises(FitError, match="5 measured positions; at least 6"):
        memscal.design(step=2e-3, half_range=4e-3)


def test_a_range_that_ends_within_the_profile_tells_no_baseline() -> None:
    with pytest.raises(FitError, match="not told apart from zero"):
        memscal.design(half_range=0.8e-3, step=0.1e-3, noise=0.01)


def test_a_kernel_without_unit_integral_is_refused() -> None:
    class Half:
        def transform(self, k: np.ndarray) -> np.ndarray:
            return 0.5 * np.exp(-0.5 * (5e-4 * k) ** 2)

        def radial(self, r: np.ndarray) -> np.ndarray:
            return np.exp(-0.5 * (r / 5e-4) ** 2) / (4 * np.pi * 5e-4**2)

        def describe(self) -> dict[str, float | str]:
            return {"kernel": "half a Gaussian"}

    with pytest.raises(InputError, match="unit integral"):
        memscal.design(kernel=Half())


@pytest.mark.parametrize(
    ("step", "half_range", "count"), [(0.25e-3, 8e-3, 65), (0.1e-3, 0.7e-3, 15), (0.3e-3, 8e-3, 54)]
)
def test_positions_are_whole_steps_within_the_range(
    step: float, half_range: float, count: int
) -> None:
    scan = Plan(step=step, half_range=half_range).scan()
    assert scan.x.size == count
    np.testing.assert_allclose(np.diff(scan.x), step)
    assert scan.x[-1] <= half_range * (1 + 1e-6)


def test_noise_is_a_share_of_the_signal_above_the_sensor() -> None:
    plan = Plan(noise=0.02)
    largest = float(plan.scan().u_zz.max())
    assert plan.point_noise == pytest.approx(0.02 * largest, rel=1e-6)
    assert Plan(noise_voltage=3e-5).point_noise == 3e-5


def test_repeats_are_averaged() -> None:
    once, often = Plan().scan(), Plan(repeats=16).scan()
    assert once.u_zz_errors is not None
    assert often.u_zz_errors is not None
    np.testing.assert_allclose(often.u_zz_errors, once.u_zz_errors / 4)
