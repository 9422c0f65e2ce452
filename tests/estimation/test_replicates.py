from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scans import RING, TAILS, estimated, simulated

import memscal
from memscal.axisymmetry.hankel import RadialSpectrum
from memscal.estimation.profile_estimate import ProfileEstimate, estimate_profile
from memscal.estimation.replicates import ReplicateEstimator, Replicates
from memscal.model.validation import FloatArray

RADII = np.linspace(0.0, 2e-3, 41)
KERNELS = {
    "gaussian": memscal.GaussianMixture((1.0,), (0.561e-3,)),
    "tails": TAILS,
    "ring": RING,
}


def ordinary(kernel: str, noise: float, repeats: int = 2, seed: int = 3) -> ProfileEstimate:
    """An estimate without outliers, whose weights the replicates share."""
    scan = simulated(kernel=KERNELS[kernel], noise=noise, repeats=repeats, seed=seed)
    found = estimated(scan)
    points = replace(found.points, u=found.predicted + found.noise * drawn(found, 1, seed)[0] * 0.9)
    again = estimate_profile(points, *found.model.references)
    return (
        again if (again.outlier_weight == 1).all() else ordinary(kernel, noise, repeats, seed + 1)
    )


def drawn(estimate: ProfileEstimate, count: int, seed: int) -> FloatArray:
    """Standard normal draws without those that would count as outliers."""
    draws = np.random.default_rng(seed).normal(size=(count, estimate.points.u.size))
    return np.clip(draws, -2.8, 2.8)


def one_by_one(estimate: ProfileEstimate, voltages: FloatArray) -> tuple[FloatArray, FloatArray]:
    """A, both widths' parameters and centre; and G, of each set of voltages by itself."""
    scalars, profiles = [], []
    for u in voltages:
        found = estimate_profile(replace(estimate.points, u=u), *estimate.model.references)
        a, fit = found.conversion_constant, found.gaussian
        scalars.append([a, fit.conversion_constant, fit.sigma, found.centre[0], found.drifts[0]])
        profiles.append(found.radial(RADII) / a)
    return np.array(scalars), np.array(profiles)


def shares(off: FloatArray, scatter: FloatArray) -> FloatArray:
    """Root mean square over the replicates, in units of the scatter."""
    return np.sqrt(np.mean(off**2, axis=0)) / scatter


def at_once(found: Replicates) -> tuple[FloatArray, FloatArray]:
    a, corrected = found.conversion_constant, found.corrected
    # A, sigma and centre come before the baseline; a raster's centre has two coordinates, and
    # its ellipse comes last.
    baseline = corrected[:, 4 if corrected.shape[1] > 5 else 3]
    scalars = [a, found.gaussian[:, 0], found.sigma, corrected[:, 2], baseline]
    return np.stack(scalars, axis=1), found.radial(RADII) / a[:, None]


@pytest.mark.parametrize("noise", [0.002, 0.01])
@pytest.mark.parametrize("kernel", KERNELS)
def test_replicates_are_those_of_the_estimator_to_a_small_share_of_their_scatter(
    kernel: str, noise: float
) -> None:
    estimate = ordinary(kernel, noise)
    voltages = estimate.predicted + drawn(estimate, 300, seed=5) * estimate.noise
    found = at_once(ReplicateEstimator(estimate).fit(voltages))
    wanted = one_by_one(estimate, voltages[:15])
    for ours, theirs in zip(found, wanted, strict=True):
        assert shares(ours[:15] - theirs, ours.std(axis=0)).max() < 0.1


def test_the_voltages_of_the_estimate_give_the_estimate() -> None:
    estimate = ordinary("ring", 0.005)
    found = ReplicateEstimator(estimate).fit(estimate.points.u[None])
    a = estimate.conversion_constant
    np.testing.assert_allclose(found.conversion_constant, a, rtol=1e-6)
    np.testing.assert_allclose(found.sigma, estimate.gaussian.sigma, rtol=1e-7)
    np.testing.assert_allclose(found.noise, estimate.weighed.noise, rtol=1e-5)
    np.testing.assert_allclose(found.probability[0], estimate.weighed.probability, atol=1e-5)
    k = estimate.model.k
    np.testing.assert_allclose(found.kernel(k)[0], estimate.kernel, atol=1e-6 * a)


@pytest.mark.parametrize("kernel", KERNELS)
def test_a_changed_reference_is_followed(kernel: str) -> None:
    estimate = ordinary(kernel, 0.003)
    reference = estimate.model.reference
    k = reference.wavenumbers.k
    # A film thicker by 3 % passes less of the fine detail.
    change = reference.values * (np.exp(-0.03 * (k * 2e-3) / 2) - 1)
    voltages = estimate.predicted + drawn(estimate, 200, seed=6) * estimate.noise
    found = ReplicateEstimator(estimate).fit(voltages, np.tile(change, (200, 1)))
    other = RadialSpectrum(reference.wavenumbers, reference.values + change)
    plain = at_once(ReplicateEstimator(estimate).fit(voltages))
    changed = replace(estimate, model=replace(estimate.model, references=(other,)))
    wanted = one_by_one(changed, voltages[:10])
    for ours, theirs, unchanged in zip(at_once(found), wanted, plain, strict=True):
        moved = np.abs((unchanged - ours).mean(axis=0))
        scatter = np.hypot(ours.std(axis=0), moved)
        assert shares(ours[:10] - theirs, scatter).max() < 0.1


def test_a_raster_is_replicated() -> None:
    scan = simulated(kernel=KERNELS["gaussian"], noise=0.01, raster=True, points=17, seed=2)
    estimate = estimated(scan)
    voltages = estimate.predicted + drawn(estimate, 100, seed=1) * estimate.noise
    scalars, g = at_once(ReplicateEstimator(estimate).fit(voltages))
    wanted, profiles = one_by_one(estimate, voltages[:6])
    assert shares(scalars[:6] - wanted, scalars.std(axis=0)).max() < 0.1
    off, scatter = np.mean((g[:6] - profiles) ** 2, axis=0), g.var(axis=0)
    assert np.sqrt(np.sum(RADII * off) / np.sum(RADII * scatter)) < 0.1
