"""Departures weighed by evidence, against the textbook formulas for linear Gaussian models."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.rounding import assert_same_to_rounding
from helpers.scans import CONVERSION, RING, SIGMA, TAILS, estimated, plane_error, simulated
from scipy.stats import multivariate_normal

import memscal
from memscal.errors import InputError
from memscal.estimation.bayesian import HYPOTHESES
from memscal.estimation.profile import constrained_profile

R = np.linspace(0.0, 3e-3, 121)
DISC = memscal.SmoothedDisc(0.8e-3, 0.3e-3)


def test_the_prior_weights_add_up_and_the_uncertainty_believes_in_no_gaussian() -> None:
    assert sum(h.estimate for h in HYPOTHESES) == pytest.approx(1.0)
    assert sum(h.uncertainty for h in HYPOTHESES) == pytest.approx(1.0)
    assert HYPOTHESES[0].shape is None
    assert HYPOTHESES[0].uncertainty == 0.0


def test_log_evidence_ratios_are_those_of_the_marginal_likelihood() -> None:
    """Densities of the data with the flat parameters projected out, covariance by covariance."""
    estimate = estimated(simulated(noise=0.003, kernel=TAILS, repeats=2))
    fit, basis, model = estimate.gaussian, estimate.basis, estimate.model
    root = np.sqrt(estimate.weights)
    q, _ = np.linalg.qr(fit.jacobian * root[:, None], mode="complete")
    null = q[:, basis.flat :]
    rest = null.T @ (root * (estimate.points.u - fit.predicted))
    voltages = model.signal(fit.geometry, basis.kernels(model.k)) * root[:, None]
    from memscal.estimation.bayesian import SHAPES

    for i in (1, 5, len(HYPOTHESES) - 1):
        hypothesis = HYPOTHESES[i]
        block = basis.blocks[SHAPES.index(hypothesis.shape)]
        design = null.T @ voltages[:, block]
        noise = estimate.weighed.noise**2
        # At the same noise for both: the estimate's own maximises each, which is its profile.
        signal = hypothesis.strength**2 * design @ design.T
        eye = noise * np.eye(rest.size)
        ratio = multivariate_normal.logpdf(rest, cov=eye + signal)
        ratio -= multivariate_normal.logpdf(rest, cov=eye)
        weight = hypothesis.estimate / HYPOTHESES[0].estimate
        found = estimate.weighed.probability
        if weight and found[0] > 0 and found[i] > 0:
            assert np.log(found[i] / found[0] / weight) == pytest.approx(ratio, abs=1.5)


@pytest.mark.parametrize(
    ("kernel", "kind"),
    [(DISC, ("edge",)), (RING, ("core", "edge")), (TAILS, ("tail",))],
    ids=["disc", "ring", "tail"],
)
def test_each_kind_of_departure_is_recognised(kernel, kind) -> None:
    families: dict[str, float] = {}
    for seed in range(10):
        estimate = estimated(simulated(noise=0.001, repeats=2, seed=seed, kernel=kernel))
        for hypothesis, p in zip(HYPOTHESES, estimate.weighed.probability, strict=True):
            name = "none" if hypothesis.shape is None else hypothesis.shape.name.split()[-1]
            families[name] = families.get(name, 0.0) + p
    assert families.get("none", 0.0) < 1.0
    # The hole of a ring may be a core of its own, or the edge of what surrounds it.
    assert max(families, key=families.__getitem__) in kind


def test_more_noise_means_less_departure_from_the_gaussian() -> None:
    probabilities = [
        np.median(
            [
                estimated(simulated(noise=noise, seed=s, kernel=TAILS)).weighed.gaussian_probability
                for s in range(8)
            ]
        )
        for noise in (0.002, 0.01, 0.05)
    ]
    assert probabilities == sorted(probabilities)


def test_the_width_reached_by_fewer_points_than_components_keeps_the_prior() -> None:
    """Few places cannot tell 79 coefficients; what they do not tell stays uncertain."""
    scan = simulated(points=15, half_range=5e-3, noise=0.003)
    found = estimated(scan)
    assert np.isfinite(found.covariance).all()
    few = memscal.calibrate(scan, method="evidence").apparatus
    many = memscal.calibrate(simulated(points=129, noise=0.003), method="evidence").apparatus
    assert few.radial_uncertainty(0.0) > many.radial_uncertainty(0.0)


@pytest.mark.parametrize("monotone", [False, True])
def test_a_constrained_profile_meets_its_constraint_and_moves_little(monotone) -> None:
    moved = []
    for seed in range(6):
        estimate = estimated(simulated(noise=0.003, repeats=2, seed=seed, kernel=TAILS))
        profile = constrained_profile(estimate, nonnegative=not monotone, monotone=monotone)
        found, free = profile.radial(R), estimate.radial(R)
        least = np.diff(found).max() if monotone else -found.min()
        assert least < 2e-3 * found[0]
        moved.append(plane_error(R, found, free))
    # The truth meets both constraints: most posteriors do, or nearly.
    assert np.median(moved) < 0.1


def test_a_ring_is_no_falling_profile_and_its_constrained_fit_misses_the_scan() -> None:
    scan = simulated(noise=5e-4, repeats=2, kernel=RING)
    free = memscal.calibrate(scan, method="evidence").apparatus
    falling = memscal.calibrate(scan, method="evidence", monotone=True).apparatus
    assert plane_error(R, falling.radial(R), RING.radial(R)) > 1.5 * plane_error(
        R, free.radial(R), RING.radial(R)
    )
    residual = {a: float(np.sum(a.reconvolution.residual**2)) for a in (free, falling)}
    assert residual[falling] > residual[free]


def test_without_constraints_the_profile_is_the_posterior_mean() -> None:
    estimate = estimated(simulated(noise=0.003))
    profile = constrained_profile(estimate, nonnegative=False, monotone=False)
    assert_same_to_rounding(profile.radial(R), estimate.radial(R))


def test_the_method_needs_a_scan_and_says_so() -> None:
    from memscal.axisymmetry.grids import EvenGrid
    from memscal.deconvolution.division import DivisionProblem, create_regulariser

    grid = EvenGrid(9, 1e-3)
    field = np.ones((9, 9))
    with pytest.raises(InputError, match="without the scan"):
        create_regulariser("evidence").divide(DivisionProblem(grid, field, field, 1.0, 1.0))


def test_evidence_leaves_nothing_to_a_window() -> None:
    apparatus = memscal.calibrate(replace(simulated(), notes=""), method="evidence").apparatus
    assert np.all(apparatus.transfer.window == 1.0)
    assert apparatus.budget["gaussian_sigma_deconvolved"]["window"] == 0.0
    assert apparatus.gaussian_sigma == pytest.approx(SIGMA, rel=0.1)
    assert apparatus.conversion_constant == pytest.approx(CONVERSION, rel=0.05)
