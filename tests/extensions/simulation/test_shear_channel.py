"""The simulated tangential channel: its parity, its size, and nothing moved in the other."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.machine import assert_same_to_rounding

import memscal
from memscal import GaussianMixture, simulate_experiment
from memscal.errors import InputError
from memscal.extensions.simulation.experiment import simulate_contacts
from memscal.extensions.simulation.rod_scan import PAPER_FILM

KERNEL = GaussianMixture(sigmas=(400e-6,))
QUIET = {"noise": 0.0, "baseline": 0.0, "drift": 0.0}
LINEAR = replace(PAPER_FILM, law="linear", poisson_ratio_uncertainty=None)
BOTH = {"channels": ("zz", "xz"), "shear_kernel": KERNEL, "shear_conversion_constant": 4e-8}


def test_the_normal_channel_is_the_same_with_and_without_the_other() -> None:
    for make in (memscal.simulate, simulate_contacts):
        one = make(seed=3)
        other = make(seed=3, **BOTH)
        assert_same_to_rounding(one.u_zz, other.u_zz)
        assert not one.channels
        assert set(other.channels) == {"u_xz", "u_xz_errors"}


def test_a_rod_s_shear_is_odd_about_the_sensor_and_falls_where_the_rod_is_beyond_it() -> None:
    scan = memscal.simulate(film=LINEAR, centre=(0.0, 0.0), **QUIET, **BOTH)
    u = scan.channels["u_xz"]
    np.testing.assert_allclose(u, -u[::-1], atol=1e-12 * np.abs(u).max())
    assert u[scan.x > 0].max() < 0 < u[scan.x < 0].min()


def test_a_raster_s_shear_is_one_component_of_a_vector_field() -> None:
    scan = memscal.simulate(raster=True, points=21, centre=(0.0, 0.0), **QUIET, **BOTH)
    u = scan.channels["u_xz"]
    np.testing.assert_allclose(u, -u[:, ::-1], atol=1e-12 * np.abs(u).max())
    np.testing.assert_allclose(u, u[::-1], atol=1e-12 * np.abs(u).max())
    # On the diagonal both components are the same: the field is radial.
    np.testing.assert_allclose(np.hypot(u, u.T), np.hypot(u, u.T)[:, ::-1], rtol=1e-6)


def test_a_narrow_g_shows_the_shear_of_rod_and_sphere_at_its_friction() -> None:
    options = {**QUIET, **BOTH, "centre": (0.0, 0.0), "film": LINEAR}
    options["shear_kernel"] = GaussianMixture(sigmas=(5e-6,))
    exact = {"load_scatter": 0.0, "position_error": 0.0, "load": 1.37, **options}
    scans = [(memscal.simulate(**options), 1.0, 0.0, 1e-3)]
    scans += [(simulate_contacts(friction=mu, **exact), 1.37, mu, 2e-3) for mu in (0.0, 0.3)]
    for scan, load, friction, close in scans:
        contact = memscal.indent(scan.film, scan.indenter, load=load, friction=friction)
        expected = 4e-8 * contact.base_shear(np.abs(scan.x)) * np.sign(scan.x)
        found = scan.channels["u_xz"]
        np.testing.assert_allclose(found, expected, atol=close * np.abs(expected).max())


def test_the_truth_of_the_channel_is_stored() -> None:
    scan = memscal.simulate(seed=5, **BOTH)
    assert scan.synthetic["conversion_constant_xz"] == 4e-8
    assert scan.synthetic["gaussian_sigma_xz"] == 400e-6


def test_a_whole_experiment_has_the_channel_in_all_of_its_scans() -> None:
    for scan in simulate_experiment(loads=[0.69], lubricated_loads=[0.69], **BOTH).scans.values():
        assert "u_xz" in scan.channels
        assert scan.synthetic["conversion_constant_xz"] == 4e-8


@pytest.mark.parametrize("channels", [(), ("xz",), ("zz", "yz"), ("zz", "xz", "xz")])
def test_channels_that_a_line_along_x_has_not_are_refused(channels: tuple[str, ...]) -> None:
    with pytest.raises(InputError, match="channels"):
        memscal.simulate(channels=channels)
