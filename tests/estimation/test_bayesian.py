"""Bayesian model averaging against the formulas of linear Gaussian models; shapes of departure."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import CONVERSION, SIGMA, TAILS, estimated, plane_error, simulated
from scipy.stats import multivariate_normal

import memscal
from memscal.axisymmetry.hankel import Wavenumbers
from memscal.estimation.bayesian import HYPOTHESES, weigh_departures
from memscal.estimation.departures import SHAPES, ReducedScan, departure_basis
from memscal.estimation.profile import constrained_profile

R = np.linspace(0.0, 3e-3, 121)
NODES = Wavenumbers.covering(60e3, 12e-3)


def test_the_prior_weights_add_up_and_the_uncertainty_allows_no_gaussian():
    assert sum(h.estimate for h in HYPOTHESES) == pytest.approx(1.0)
    assert sum(h.uncertainty for h in HYPOTHESES) == pytest.approx(1.0)
    assert HYPOTHESES[0].shape is None
    assert HYPOTHESES[0].uncertainty == 0.0


def test_posterior_odds_are_prior_odds_times_the_ratio_of_marginal_likelihoods():
    """Densities of the data, flat priors in ln A, ln(width) and the nuisance parameters."""
    scan = simulated(noise=0.01, kernel=TAILS, repeats=2)
    # Stated larger than it is, so that it is the noise of every hypothesis.
    estimate = estimated(replace(scan, u_zz_errors=1.5 * scan.u_zz_errors))
    fit = estimate.gaussian
    basis = estimate.departures
    model = estimate.model
    root = np.sqrt(estimate.weights)[:, None]
    kernels = basis.kernels(model.k)
    voltages = root * model.signal(fit.geometry, kernels)
    voltages[:, 2 : basis.flat] = root * fit.jacobian[:, 2:]
    blocks = dict(zip([*SHAPES, *(f.family for f in basis.families)], basis.blocks, strict=True))
    curvature = estimate.points.curvatures
    curved = voltages[:, curvature]
    straight = np.delete(voltages[:, 2 : basis.flat], np.arange(basis.flat - 2)[-1], axis=1)
    deviation = estimate.points.curvature
    likely = np.flatnonzero(estimate.weighed.probability > 1e-3)
    assert len({HYPOTHESES[i].kind for i in likely}) > 2
    logs = []
    for h in (HYPOTHESES[i] for i in likely):
        # The curvature of the baseline has a prior about zero, not about the fit.
        data = root[:, 0] * (estimate.points.u - fit.predicted) + curved @ fit.drift[-1:]
        of_a = voltages[:, 0] * basis.conversion_constant
        of_width = voltages[:, 1] * basis.sigma
        spread = np.zeros((data.size, 0))
        if h.family is not None:
            off, of_width, last = voltages[:, blocks[h.family]].T
            data = data - off
            of_a = of_a + off
            spread = last[:, None]
        flat = np.column_stack([of_a, of_width, straight])
        covariance = np.eye(data.size) + spread @ spread.T + deviation**2 * (curved @ curved.T)
        if h.shape is not None:
            columns = h.strength * voltages[:, blocks[h.shape]]
            covariance += columns @ columns.T
        # A flat prior integrates the parameters out of the density of the data.
        q, r = np.linalg.qr(flat, mode="complete")
        null = q[:, basis.flat - 1 :]
        density = multivariate_normal.logpdf(null.T @ data, cov=null.T @ covariance @ null)
        size = np.abs(np.diag(r[: basis.flat - 1])).prod()
        logs.append(density - np.log(size) + np.log(h.estimate))
    found = np.log(estimate.weighed.probability[likely])
    np.testing.assert_allclose(found - found.max(), logs - np.max(logs), atol=1e-6)


def test_a_hypothesis_without_prior_is_left_out_however_well_it_fits():
    estimate = estimated(simulated())
    reduced = ReducedScan.of(estimate.model, estimate.gaussian, estimate.weights, None)
    weighing = weigh_departures(reduced, departure_basis(estimate.gaussian, reduced), 65.0)
    better = weighing.log_marginals + 1e4 * np.array([h.estimate == 0.0 for h in HYPOTHESES])
    found = replace(weighing, log_marginals=better).average()
    assert np.isfinite(found.residual).all()
    np.testing.assert_allclose(found.probability, weighing.average().probability)


def test_the_width_reached_by_fewer_points_than_components_keeps_the_prior():
    """Few places cannot tell 79 coefficients; what they do not tell stays uncertain."""
    scan = simulated(points=15, half_range=5e-3, noise=0.003)
    assert np.isfinite(estimated(scan).weighed.covariance).all()
    few = memscal.calibrate(scan, method="bayesian").apparatus
    many = memscal.calibrate(simulated(points=129, noise=0.003), method="bayesian").apparatus
    assert few.radial_uncertainty(0.0) > many.radial_uncertainty(0.0)


@pytest.mark.parametrize("monotone", [False, True])
def test_a_constrained_profile_meets_its_constraint_and_moves_little(monotone):
    moved = []
    for seed in range(6):
        estimate = estimated(simulated(noise=0.003, repeats=2, seed=seed, kernel=TAILS))
        profile = constrained_profile(estimate, nonnegative=not monotone, monotone=monotone)
        found = profile.radial(R)
        free = estimate.radial(R)
        least = np.diff(found).max() if monotone else -found.min()
        assert least < 2e-3 * found[0]
        moved.append(plane_error(R, found, free))
    # The truth meets both constraints: most posteriors do, or nearly.
    assert np.median(moved) < 0.1


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: f"{s.name} {s.blur} {s.extent}")
def test_a_shape_is_its_transform_and_a_strength_of_one_as_large_as_the_gaussian(shape):
    rings = shape.rings(SIGMA, CONVERSION)
    r = np.linspace(0.0, 4e-3, 41)
    transform = rings.transform(NODES.k)
    by_quadrature = np.stack([NODES.synthesise(column, r) for column in transform.T], axis=1)
    np.testing.assert_allclose(rings.radial(r), by_quadrature, atol=1e-9 * by_quadrature.max())
    expected = np.sqrt(np.sum(NODES.weights @ transform**2))
    gaussian = CONVERSION * np.exp(-0.5 * (SIGMA * NODES.k) ** 2)
    assert expected == pytest.approx(np.sqrt(NODES.weights @ gaussian**2), rel=1e-6)
