"""The simulated tangential channel: its parity, its size, and nothing moved in the other."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.machine import assert_same_to_rounding
from helpers.scans import STILL, simulate, simulate_contacts, simulate_experiment

import memscal
from memscal import GaussianMixture
from memscal.errors import InputError
from memscal.extensions.simulation.rod_scan import PAPER_FILM

KERNEL = GaussianMixture(sigmas=(400e-6,))
LINEAR = replace(PAPER_FILM, law="linear", poisson_ratio_uncertainty=None)
BOTH = {"shear": (KERNEL, 4e-8)}


def test_the_normal_channel_is_the_same_with_and_without_the_other():
    for make in (memscal.simulate, simulate_contacts):
        one = make(seed=3)
        other = make(seed=3, **BOTH)
        assert_same_to_rounding(one.u_zz, other.u_zz)
        assert not one.channels
        assert set(other.channels) == {"u_xz", "u_xz_errors"}


def test_a_raster_s_shear_is_one_component_of_a_vector_field():
    scan = simulate(raster=True, points=21, centre=(0.0, 0.0), **STILL, **BOTH)
    u = scan.channels["u_xz"]
    np.testing.assert_allclose(u, -u[:, ::-1], atol=1e-12 * np.abs(u).max())
    np.testing.assert_allclose(u, u[::-1], atol=1e-12 * np.abs(u).max())
    # On the diagonal both components are the same: the field is radial.
    np.testing.assert_allclose(np.hypot(u, u.T), np.hypot(u, u.T)[:, ::-1], rtol=1e-6)


def test_a_narrow_g_shows_the_shear_of_rod_and_sphere_at_its_friction():
    options = {**STILL, **BOTH, "centre": (0.0, 0.0), "film": LINEAR}
    options["shear"] = (GaussianMixture(sigmas=(5e-6,)), 4e-8)
    exact = {"load_scatter": 0.0, "position_error": 0.0, "load": 1.37, **options}
    scans = [(simulate(**options), 1.0, 0.0, 1e-3)]
    scans += [(simulate_contacts(friction=mu, **exact), 1.37, mu, 2e-3) for mu in (0.0, 0.3)]
    for scan, load, friction, close in scans:
        contact = memscal.indent(scan.film, scan.indenter, load=load, friction=friction)
        expected = 4e-8 * contact.base_shear(np.abs(scan.x)) * np.sign(scan.x)
        found = scan.channels["u_xz"]
        np.testing.assert_allclose(found, expected, atol=close * np.abs(expected).max())


def test_a_whole_experiment_has_the_channel_in_all_of_its_scans():
    for scan in simulate_experiment(loads=[0.69], lubricated_loads=[0.69], **BOTH).scans.values():
        assert "u_xz" in scan.channels
        assert scan.synthetic["conversion_constant_xz"] == 4e-8
        assert scan.synthetic["gaussian_sigma_xz"] == 400e-6


@pytest.mark.parametrize(
    ("shear", "problem"), [((KERNEL, 0.0), "channel xz is 0"), ((4e-4, 5e-8), "transform")]
)
def test_a_channel_without_an_apparatus_function_or_a_constant_is_refused(shear, problem):
    with pytest.raises(InputError, match=problem):
        memscal.simulate(shear=shear)
