"""Readings in motion against a filter in time: exact recursions and an integrator of the package's
peer library, on a dense path, not by transforms."""

from dataclasses import replace
from functools import lru_cache

import numpy as np
import pytest
from helpers.filters import in_time
from scipy.integrate import quad
from scipy.interpolate import CubicSpline
from scipy.special import j0

import memscal
from memscal.errors import InputError
from memscal.estimation.forward import forward_model
from memscal.estimation.points import measured_points
from memscal.estimation.reference_spectra import reference_spectra
from memscal.extensions.motion.moving_model import changes_by_dynamics
from memscal.extensions.motion.transfer import transfer
from memscal.extensions.motion.velocities import velocities
from memscal.measurement.measured_profile import measured_scan

FILM = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
ROD = memscal.Rod(radius=0.25e-3)
CONTACT = memscal.indent(FILM, ROD, load=1.0, strain="linear")
WIDTH = 0.561e-3
CENTRE = 0.14e-3
SPEED = 1e-3
X = np.linspace(-12e-3, 12e-3, 241)

DYNAMICS = {
    "low_pass": memscal.Dynamics(low_pass=0.3),
    "resonance": memscal.Dynamics(resonance=0.8, quality=2.0),
    "overdamped": memscal.Dynamics(resonance=0.8, quality=0.4),
    "creep": memscal.Dynamics(creep_share=0.05, creep_time=1.0),
    "creep of a record": memscal.Dynamics(creep_share=0.2, creep_time=3.0, creep_record=4.0),
    "all": memscal.Dynamics(
        low_pass=0.5, resonance=2.0, quality=3.0, creep_share=0.1, creep_time=2.0
    ),
}


def scan_of(dynamics, u=None, x=X, **stated):
    return memscal.Scan(
        x=x,
        u_zz=np.exp(-((x / 1e-3) ** 2)) if u is None else u,
        load=1.0,
        indenter=ROD,
        film=FILM,
        sensor=memscal.StressSensor(dynamics=dynamics),
        **stated,
    )


@lru_cache
def blurred_stress():
    """Base stress blurred by a Gaussian, by the distance, by an integral of its own."""
    k = np.linspace(0, 12e3, 6001)
    values = CONTACT.base_spectrum(k) * np.exp(-((WIDTH * k) ** 2) / 2) * k / (2 * np.pi)
    r = np.linspace(0.0, 42e-3, 801)
    return CubicSpline(r, [np.trapezoid(values * j0(k * one), k) for one in r])


def still_signal(x):
    return blurred_stress()(np.abs(x - CENTRE))


def model_signal(scan):
    points = measured_points(scan)
    model = forward_model(points, reference_spectra([CONTACT], [points]))
    kernel = np.exp(-((WIDTH * model.k) ** 2) / 2)
    geometry = model.geometry(np.array([[CENTRE, 0.0]]))
    return model, geometry, kernel, model.signal(geometry, kernel)


@pytest.mark.parametrize("way", [1, -1])
@pytest.mark.parametrize("name", DYNAMICS)
def test_a_reading_is_that_of_a_filter_in_time(name, way):
    dynamics = DYNAMICS[name]
    scan = scan_of(dynamics, speed=SPEED, sliding_direction=way, motion="sliding")
    signal = model_signal(scan)[3]
    path = way * np.arange(-40e-3, 16e-3, 0.01e-3)
    read = in_time(dynamics, still_signal(path), 0.01)
    order = np.argsort(path)
    expected = np.interp(scan.x, path[order], read[order])
    assert signal == pytest.approx(expected, abs=3e-4 * expected.max())


def test_a_mean_along_the_scan_is_the_mean_of_the_still_signal():
    scan = scan_of(None, averaging_length=0.8e-3)
    signal = model_signal(scan)[3]
    ends = still_signal(np.linspace(-13e-3, 13e-3, 2601))
    fine = np.linspace(-13e-3, 13e-3, 2601)
    integral = np.concatenate([[0.0], np.cumsum((ends[1:] + ends[:-1]) / 2 * np.diff(fine))])
    upper = np.interp(scan.x + 0.4e-3, fine, integral)
    lower = np.interp(scan.x - 0.4e-3, fine, integral)
    assert signal == pytest.approx((upper - lower) / 0.8e-3, abs=1e-4 * ends.max())


def test_means_at_single_places_of_a_plane_are_those_of_the_still_signal():
    x, y = np.random.default_rng(3).uniform(-4e-3, 4e-3, (2, 30))
    means = scan_of(None, u=np.exp(-np.hypot(x, y) / 1e-3), x=x, y=y, averaging_length=0.8e-3)
    signal = model_signal(means)[3]
    ways = np.linspace(-0.4e-3, 0.4e-3, 81)
    still = blurred_stress()(np.hypot(np.add.outer(x - CENTRE, ways), y[:, None]))
    expected = np.trapezoid(still, ways, axis=1) / 0.8e-3
    assert signal == pytest.approx(expected, abs=1e-4 * still.max())


def test_the_slopes_are_those_of_moved_centres():
    scan = scan_of(DYNAMICS["low_pass"], speed=SPEED)
    model, geometry, kernel, _ = model_signal(scan)
    slopes = model.shift_derivative(geometry, kernel)[0]
    step = 1e-6
    ends = [
        model.signal(model.geometry(np.array([[CENTRE + side * step, 0.0]])), kernel)
        for side in (1, -1)
    ]
    assert slopes == pytest.approx((ends[0] - ends[1]) / (2 * step), abs=1e-4 * slopes.max())


def test_every_row_of_a_raster_is_read_as_a_line():
    y = np.array([-1e-3, 0.0, 1e-3, 2e-3])
    u = np.exp(-((X / 1e-3 - y[:, None] / 1e-3) ** 2))
    signal = model_signal(scan_of(DYNAMICS["low_pass"], u=u, y=y, speed=SPEED))[3]
    line = model_signal(scan_of(DYNAMICS["low_pass"], speed=SPEED))[3]
    assert signal.reshape(4, -1)[1] == pytest.approx(line, abs=1e-6 * line.max())
    assert signal.reshape(4, -1)[0] == pytest.approx(signal.reshape(4, -1)[2])


def test_a_sensor_at_rest_or_at_low_speed_reads_the_still_signal():
    plain = model_signal(scan_of(None))[3]
    slow = scan_of(DYNAMICS["low_pass"], speed=1e-8)
    held = scan_of(DYNAMICS["low_pass"], speed=SPEED, dwell_time=1.0)
    for scan in (slow, held):
        assert model_signal(scan)[3] == pytest.approx(plain, abs=1e-5 * plain.max())


@pytest.mark.parametrize("name", DYNAMICS)
def test_a_step_is_read_in_full_at_the_end_of_the_record(name):
    """The step response by the inverse transform of H, and by the systems in time."""
    dynamics = DYNAMICS[name]
    time = dynamics.creep_record or 60.0
    end = in_time(dynamics, np.ones(200_001), time / 200_000)[-1]
    assert end == pytest.approx(1.0, abs=2e-4)

    def density(f):
        return 2 * transfer(dynamics, np.array(f)).real * np.sin(2 * np.pi * f * 0.7) / (np.pi * f)

    # s(t) = 2/pi int Re H(f) sin(2 pi f t)/f df of a causal system.
    step, _ = quad(density, 0.0, 400.0, limit=4000)
    read = in_time(dynamics, np.ones(70_001), 1e-5)[-1]
    assert step == pytest.approx(read, abs=3e-3)


def test_velocities_follow_the_times_the_speed_and_the_direction():
    x = np.linspace(0, 10e-3, 101)
    time = np.concatenate([x / 2e-3, 6 + (10e-3 - x) / 5e-3])
    both = scan_of(
        None, u=np.arange(202.0), x=np.tile(x, 2), repeat=np.repeat([0, 1], 101), time=time
    )
    assert velocities(both)[:101] == pytest.approx(2e-3)
    assert velocities(both)[101:] == pytest.approx(-5e-3)
    assert velocities(scan_of(None, x=x[::-1], speed=1e-3)) == pytest.approx(-1e-3)
    sliding = scan_of(None, x=x, speed=1e-3, motion="sliding", sliding_direction=-1)
    assert velocities(sliding) == pytest.approx(-1e-3)
    gap = replace(both, time=np.where(np.arange(202) == 50, np.nan, time))
    assert velocities(gap) == pytest.approx(velocities(both))
    coarse = replace(both, time=np.floor(10 * time + 1e-9) / 10)
    assert velocities(coarse) == pytest.approx(velocities(both), rel=0.1)


def test_uncertain_dynamics_count_by_their_derivative():
    scan = scan_of(replace(DYNAMICS["low_pass"], low_pass_uncertainty=0.02), speed=SPEED)
    changes = changes_by_dynamics(*model_signal(scan)[:3])
    faster, slower = (
        model_signal(scan_of(memscal.Dynamics(low_pass=fc), speed=SPEED))[3] for fc in (0.31, 0.29)
    )
    assert [*changes] == ["low_pass"]
    assert changes["low_pass"] == pytest.approx(
        faster - slower, abs=1e-3 * abs(faster - slower).max()
    )


def test_forth_and_back_in_one_pass_turns_the_velocity():
    x = np.linspace(0, 10e-3, 101)
    one_pass = {"u": np.arange(202.0), "x": np.append(x, x[::-1]), "repeat": np.zeros(202, int)}
    for stated in ({"speed": 1e-3}, {"time": 0.1 * np.arange(202.0)}):
        velocity = velocities(scan_of(None, **one_pass, **stated))
        assert velocity[:95] == pytest.approx(1e-3)
        assert velocity[107:] == pytest.approx(-1e-3)


@pytest.mark.parametrize("stated", [{"speed": 1e-3}, {"time": np.arange(101.0)}, {"time": 0 * X}])
def test_positions_that_do_not_follow_each_other_are_refused(stated):
    x = X[: len(stated.get("time", X[:101]))]
    order = np.random.default_rng(0).permutation(x.size)
    scan = scan_of(DYNAMICS["low_pass"], x=x[order], **stated)
    with pytest.raises(InputError, match="do not follow each other in time"):
        measured_points(scan)


def test_a_creep_that_is_slow_takes_no_more_room_than_a_scan():
    """At 1 m/s only what does not creep is left."""
    creep = memscal.Dynamics(creep_share=0.05, creep_time=30.0)
    fast = model_signal(scan_of(creep, speed=1.0))[3]
    still = model_signal(scan_of(None))[3]
    left = fast - 0.95 * still
    drift = np.polyval(np.polyfit(X, left, 1), X)
    assert left == pytest.approx(drift, abs=2e-5 * still.max())


def rod_scan(noise=0.001, **stated):
    """A scan with the rod by a sensor with a low-pass of 0.3 Hz, at 1 mm/s, as it is read."""
    path = np.arange(-40e-3, 12e-3, 0.01e-3)
    u = np.interp(X, path, in_time(DYNAMICS["low_pass"], still_signal(path), 0.01))
    scatter = noise * u.max() * np.random.default_rng(5).standard_normal(X.size)
    errors = np.full(X.size, noise * u.max())
    scan = scan_of(DYNAMICS["low_pass"], u=u + scatter, u_zz_errors=errors, **stated)
    return replace(scan, film=replace(FILM, law="linear"))


def test_a_division_finds_the_still_sensor():
    found = memscal.calibrate(rod_scan(speed=SPEED), method="white-noise", other=False)
    parameters = found.apparatus.parameters
    assert parameters["conversion_constant"] == pytest.approx(1.0, rel=0.01)
    assert parameters.uncertainty("conversion_constant") < 0.013
    assert parameters["gaussian_sigma"] == pytest.approx(WIDTH, rel=0.015)
    assert parameters["centre"] == pytest.approx(CENTRE, abs=2e-6)
    # A load of 1 N is too deep for the rod.
    assert [check.name for check in found.apparatus.checks if not check.passed] == ["indentation"]


def test_dynamics_without_a_velocity_are_told_not_to_count():
    def kinds(scan):
        apparatus = memscal.calibrate(scan, other=False).apparatus
        return [message.kind for message in apparatus.process.messages]

    assert "dynamics_unused" in kinds(rod_scan())
    assert "dynamics_unused" not in kinds(rod_scan(speed=SPEED))


def test_the_speed_of_an_indenter_that_slid_is_that_of_its_times():
    time = np.stack([X, X[::-1]]) / 2.004e-3
    u = np.tile(np.exp(-((X / 1e-3) ** 2)), (2, 1))
    slid = scan_of(None, u=u, time=time, motion="sliding", sliding_direction=np.array([1, -1]))
    assert measured_scan(slid).speed == pytest.approx(2e-3, rel=1e-9)
    assert measured_scan(scan_of(None, time=X / 2e-3)).speed is None
