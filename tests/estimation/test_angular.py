"""What of a sensor is not round: its kernels, its size, and noise and outliers beside it."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.rasters import tailed_raster
from helpers.scans import estimated, simulated
from scipy.signal import fftconvolve

import memscal
from memscal.axisymmetry.kernels import Rings
from memscal.estimation.angular import ORDERS, AngularDepartures, AngularRings
from memscal.estimation.outliers import OUTLIER_THRESHOLD, point_weights, raster_noise
from memscal.estimation.plane import PlaneDepartures, Spots
from memscal.estimation.points import measured_points

RADII = np.array([0.3e-3, 0.8e-3])
ONES = np.ones(2)
ONE_EACH = np.eye(4 * len(ORDERS))


def test_kernels_are_blurred_rings_of_their_order():
    blur = 0.25e-3
    axis = np.arange(-30, 31) * 0.1e-3
    x, y = (a.ravel() for a in np.meshgrid(axis, axis))
    departures = AngularDepartures(AngularRings(RADII, blur * ONES, ONES), ONE_EACH)
    kernels = departures.at(axis, axis, np.eye(departures.count))
    angle = np.linspace(0, 2 * np.pi, 400, endpoint=False)
    # A ring is many Gaussians around it, their heights cos and sin of m times the angle.
    for column, (m, turn, q) in enumerate(
        (m, t, q) for m in ORDERS for t in (np.cos, np.sin) for q in RADII
    ):
        square = np.subtract.outer(x, q * np.cos(angle)) ** 2
        square += np.subtract.outer(y, q * np.sin(angle)) ** 2
        ring = np.exp(-0.5 * square / blur**2) @ turn(m * angle) / (2 * np.pi * blur**2) / 400
        np.testing.assert_allclose(kernels[:, column], ring, atol=2e-5 * np.abs(ring).max())


#: Spots on a lattice beside the centre, one of them left out.
SPOTS = Spots(np.arange(-1, 2) * 0.7e-3, ~np.eye(3, k=2, dtype=bool), 0.4e-3, np.eye(8))


@pytest.mark.parametrize(
    "departures",
    [
        AngularDepartures(AngularRings(RADII, 0.3e-3 * ONES, ONES), ONE_EACH),
        PlaneDepartures(SPOTS, np.eye(8)[:, 2:7]),
    ],
)
def test_signals_are_the_convolutions_of_the_kernels(departures):
    scan = simulated(raster=True, points=17, half_range=4e-3)
    model = estimated(scan).model
    step = 0.05e-3
    axis = step * np.arange(-160, 161)
    r = np.linspace(0.0, 17e-3, 2001)
    radial = memscal.indent(scan.film, scan.indenter, load=1.0).base_stress(r)
    stress = np.interp(np.hypot.outer(axis, axis), r, radial)
    unit = np.eye(departures.count)
    round_ = departures.mean(Rings.radial, np.hypot.outer(axis, axis).ravel())
    kernels = (departures.at(axis, axis, unit) + round_).T.reshape(-1, axis.size, axis.size)
    signals = departures.signal(model, np.array([[0.15e-3, -0.1e-3]]), unit)
    rows = np.rint((model.points.y + 0.1e-3) / step).astype(int) + 160
    columns = np.rint((model.points.x - 0.15e-3) / step).astype(int) + 160
    for kernel, signal in zip(kernels, signals.T, strict=True):
        field = fftconvolve(stress, kernel, mode="same") * step**2
        np.testing.assert_allclose(signal, field[rows, columns], atol=2e-4 * field.max())


@pytest.mark.parametrize("side", [33, pytest.param(49, marks=pytest.mark.full_study)])
def test_noise_of_a_raster_is_not_what_is_not_round(side):
    ratios = []
    seeds = 10 if FULL else 2
    for seed in range(seeds):
        scan = tailed_raster(seed=seed, side=side)
        points = measured_points(scan)
        # What is not round is left over: many times the noise.
        estimate = estimated(scan)
        residual = estimate.weighed.residual + estimate.oval
        noise = raster_noise(points, residual, np.ones_like(residual))
        assert noise is not None
        ratios.append(noise.deviation / scan.synthetic["noise"])
        if seed == 0:
            assert np.abs(estimate.oval).max() > 10 * scan.synthetic["noise"]
    assert np.mean(ratios) == pytest.approx(1.0, abs=0.03 * np.sqrt(10 / seeds))


def test_noise_by_repeats_is_that_within_each_place():
    scan = tailed_raster(seed=1, side=33)
    x, y = (np.tile(a.ravel(), 2) for a in scan.positions)
    again = tailed_raster(seed=2, side=33)
    both = replace(
        scan,
        x=x,
        y=y,
        u_zz=np.append(scan.u_zz, again.u_zz),
        repeat=np.repeat([0, 1], scan.u_zz.size),
    )
    # A gradient that third differences would not see either, and steps, which they would.
    points = measured_points(both)
    steps = np.where(points.x > 0, 1.0, 0.0) * points.u.max()
    noise = raster_noise(points, points.u - points.u.mean() + steps, np.ones_like(steps))
    assert noise is not None
    assert noise.degrees == scan.u_zz.size
    assert noise.deviation == pytest.approx(scan.synthetic["noise"], rel=0.1)


def test_a_spike_is_an_outlier_and_asymmetry_is_none():
    scan = tailed_raster(seed=3, side=33)
    u = scan.u_zz.copy()
    spikes = (16, 18), (5, 25), (20, 12)
    for place in spikes:
        u[place] += 12 * scan.synthetic["noise"]
    weight = estimated(replace(scan, u_zz=u), angular=True).outlier_weight.reshape(u.shape)
    assert {tuple(map(int, place)) for place in np.argwhere(weight < 0.5)} == set(spikes)


def test_readings_of_more_noise_than_others_are_no_outliers():
    # As by errors of the stage where the voltage is steep: 16 % without a look at the neighbours.
    points = measured_points(tailed_raster(seed=0, side=33))
    steep = np.abs(np.hypot(points.x, points.y) - 4.2e-3) < 1.3e-3
    spike = np.flatnonzero(steep)[50]
    shares = []
    for seed in range(4):
        residual = np.where(steep, 6e-3, 1e-3) * np.random.default_rng(seed).standard_normal(33**2)
        residual[spike] = 0.06
        size = np.ptp(points.u)
        weight = point_weights(points, size * residual, np.ones(33**2), OUTLIER_THRESHOLD)
        assert weight[spike] < 0.5
        shares.append(np.mean(weight[steep] < 0.5))
    assert np.mean(shares) < 0.08


def test_a_round_sensor_keeps_its_profile_and_its_centre():
    scan = simulated(raster=True, points=33, half_range=6e-3, noise=0.005, seed=4)
    round_ = estimated(scan)
    any_ = estimated(scan, angular=True)
    np.testing.assert_allclose(any_.centre, round_.centre, atol=2e-6)
    assert any_.conversion_constant == pytest.approx(round_.conversion_constant, rel=1e-3)
    assert np.abs(any_.oval).max() < 0.01 * any_.largest_signal
