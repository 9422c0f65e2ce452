"""The smoothed profile of the voltages, and its division: linear in what was measured."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import RING, TAILS, added_ring, estimated, simulated

import memscal
from memscal import divide
from memscal.calibration.fields import LineFields, choose_grid
from memscal.deconvolution.division import WhiteNoise
from memscal.estimation.band import find_band
from memscal.estimation.smoothing import smooth_profile

DISC = memscal.SmoothedDisc(radius=0.8e-3, sigma=0.3e-3)


def test_the_division_is_linear_in_the_voltages():
    smoothed = smooth_profile(estimated(simulated(noise=0.005)))
    estimate = smoothed.estimate
    signal = smoothed.signal
    band = find_band(estimate, smoothed)
    choice = choose_grid(estimate, band)
    weakest = (band.weakest_reference, band.weakest_voltage)

    def divided(voltage):
        spectrum = replace(estimate.model.reference, values=smoothed.gain @ voltage)
        fields = LineFields.lift(estimate, spectrum, choice)
        quotient = divide(fields.voltage, fields.stress, weakest=weakest, method=WhiteNoise())
        return np.asarray(fields.on_support(quotient.values * fields.confinement, None).values)

    other = np.random.default_rng(0).normal(0.0, signal.max(), signal.size)
    separately = 0.7 * divided(signal) - 1.3 * divided(other)
    together = divided(0.7 * signal - 1.3 * other)
    np.testing.assert_allclose(together, separately, atol=1e-9 * np.abs(separately).max())


@pytest.mark.parametrize("width", [0.5e-3, 0.7e-3])
def test_a_ring_in_the_voltages_is_followed_by_the_division(width):
    scan = simulated(noise=0.001)
    followed = {}
    for method in ("white-noise", "bayesian"):
        usual = memscal.calibrate(scan, method=method).apparatus.reconvolution.u_zz_predicted
        for q in (3e-3, 4e-3, 5e-3):
            changed = added_ring(scan, 0.004, q, width)
            ring = changed.u_zz - scan.u_zz
            again = memscal.calibrate(changed, method=method).apparatus.reconvolution
            followed[method, q] = float((again.u_zz_predicted - usual) @ ring / (ring @ ring))
    assert min(followed["white-noise", q] for q in (3e-3, 4e-3, 5e-3)) > 0.8
    # The Bayesian estimate takes what is far from the middle for noise, and follows it less.
    for q in (4e-3, 5e-3):
        assert followed["bayesian", q] < 0.8 < followed["white-noise", q] < 1.2


@pytest.mark.parametrize("kernel", [memscal.GaussianMixture(), DISC, RING, TAILS])
def test_a_scan_without_noise_is_its_own_profile(kernel):
    smoothed = smooth_profile(estimated(simulated(noise=0.0, kernel=kernel)))
    np.testing.assert_allclose(
        smoothed.predicted, smoothed.signal, atol=1e-5 * smoothed.signal.max()
    )
    # Beyond the scan the profile decays as the reference does, from 8 to 13 mm to a fraction.
    r = np.linspace(smoothed.estimate.distance.max(), 13e-3, 20)
    profile = smoothed.spectrum.at(r)
    reference = smoothed.estimate.model.reference.at(r)
    assert abs(reference[-1]) < 0.5 * abs(reference[0])
    np.testing.assert_allclose(profile * reference[0] / profile[0], reference, rtol=0.05)


def test_repeats_and_both_sides_count_by_their_weights():
    scan = simulated(noise=0.005, centre=(0.0, 0.0))
    mirrored = np.stack([scan.u_zz, scan.u_zz[::-1]])
    errors = np.stack([scan.u_zz_errors] * 2)
    gain = smooth_profile(estimated(replace(scan, u_zz=mirrored, u_zz_errors=errors))).gain.dense()
    # At one distance, with one noise, every reading counts alike: repeats as well as sides.
    left_and_right = gain[:, :65]
    readings = gain[:, 65:]
    atol = 1e-6 * np.abs(gain).max()
    np.testing.assert_allclose(left_and_right[:, ::-1], left_and_right, atol=atol)
    np.testing.assert_allclose(readings, left_and_right, atol=atol)
    # A repeat of twice the noise has a quarter of the weight.
    repeats = simulated(noise=0.005, repeats=2)
    unequal = replace(repeats, u_zz_errors=repeats.u_zz_errors * np.array([[1.0], [2.0]]))
    gain = smooth_profile(estimated(unequal)).gain.dense()
    np.testing.assert_allclose(gain[:, 65:], gain[:, :65] / 4, atol=1e-6 * np.abs(gain).max())
