import numpy as np
import pytest
from scipy.optimize import least_squares

from memscal.estimation.gaussian import gauss_newton
from memscal.model.arrays import FloatArray

X = np.linspace(0.0, 4.0, 60)
TRUTH = np.array([1.3, 0.7, 0.1])


def curve(p: FloatArray) -> FloatArray:
    return p[0] * np.exp(-p[1] * X) + p[2]


def slope(p: FloatArray) -> FloatArray:
    fall = np.exp(-p[1] * X)
    return np.stack([fall, -p[0] * X * fall, np.ones_like(X)], axis=1)


def found_and_searched(
    data: FloatArray, start: FloatArray, knee: float
) -> tuple[FloatArray, FloatArray]:
    def linearise(p: FloatArray) -> tuple[FloatArray, FloatArray]:
        return curve(p) - data, slope(p)

    found = gauss_newton(linearise, start, tolerance=1e-10, knee=knee)
    assert found is not None
    robust = np.isfinite(knee)
    searched = least_squares(
        lambda p: curve(p) - data, start, jac=slope, loss="soft_l1" if robust else "linear",
        f_scale=knee if robust else 1.0, xtol=1e-14, ftol=1e-14, gtol=1e-14,
    )  # fmt: skip
    return found, searched.x


@pytest.mark.parametrize("knee", [np.inf, 0.06])
@pytest.mark.parametrize("seed", range(4))
def test_it_ends_where_a_trust_region_ends(knee: float, seed: int) -> None:
    data = curve(TRUTH) + np.random.default_rng(seed).normal(0.0, 0.02, X.size)
    data[[10, 40]] += 0.8 if np.isfinite(knee) else 0.0
    found, searched = found_and_searched(data, np.array([1.0, 1.0, 0.0]), knee)
    np.testing.assert_allclose(found, searched, rtol=1e-6, atol=1e-7)


def test_a_step_that_goes_too_far_is_halved() -> None:
    # From here the plain steps of least squares overshoot: arctan flattens.
    def linearise(p: FloatArray) -> tuple[FloatArray, FloatArray]:
        return np.arctan(p), np.diag(1 / (1 + p**2))

    found = gauss_newton(linearise, np.array([1.6]), tolerance=1e-9)
    assert found[0] == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("residual", [0.5, np.nan], ids=["uphill", "not a number"])
def test_it_gives_up_where_no_step_leads_downhill(residual: float) -> None:
    def linearise(p: FloatArray) -> tuple[FloatArray, FloatArray]:
        return p * residual, -np.eye(1)

    assert gauss_newton(linearise, np.array([0.5]), tolerance=1e-9) is None
