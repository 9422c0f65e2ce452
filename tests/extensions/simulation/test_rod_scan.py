"""Synthetic scans: conservation of force, and statistics; tests/accuracy convolves directly."""

import math
from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import RARE
from helpers.scans import LINEAR_FILM, STILL, simulate
from scipy.special import j1
from scipy.stats import chi2

from memscal import GaussianMixture, SmoothedDisc
from memscal.errors import InputError
from memscal.extensions.simulation.rod_scan import PAPER_FILM

RING = GaussianMixture((1.8, -0.8), (0.7e-3, 0.45e-3))
DISC = SmoothedDisc(radius=0.8e-3, sigma=0.3e-3)
KERNELS = {"gaussian": GaussianMixture(), "ring": RING, "disc": DISC}


@pytest.mark.parametrize("kernel", KERNELS.values(), ids=KERNELS)
def test_the_voltage_over_the_plane_is_the_constant_times_the_load(kernel):
    # The integral of a smooth field is the sum of a raster's pixels; this one, of an
    # incompressible film, is gone only at 20 thicknesses.
    options = {"points": 121, "half_range": 40e-3, "centre": (0.2e-3, -0.3e-3)}
    options |= {"film": LINEAR_FILM, "load": 2.0, "kernel": kernel}
    scan = simulate(raster=True, conversion_constant=3e-8, **options, **STILL)
    assert scan.u_zz.sum() * (scan.x[1] - scan.x[0]) ** 2 == pytest.approx(3e-8 * 2.0, rel=1e-6)


def test_a_line_is_the_middle_row_of_a_raster():
    options = {
        "points": 33,
        "centre": (0.3e-3, 0.2e-3),
        "film": LINEAR_FILM,
        **STILL,
    }
    raster = simulate(raster=True, **options)
    line = simulate(**options)
    assert (raster.kind, line.kind) == ("raster", "line")
    np.testing.assert_array_equal(raster.x, raster.y)
    np.testing.assert_allclose(raster.u_zz[16], line.u_zz, rtol=1e-9)


@pytest.mark.parametrize("noise", [0.001, 0.05])
def test_the_noise_has_the_standard_deviation_that_is_stated(noise, seed):
    options = {"points": 65, "repeats": 60, "load": [0.5, 1.5], "film": LINEAR_FILM}
    noisy, clean = (simulate(noise=s, seed=seed, **options) for s in (noise, 0.0))
    residual = noisy.u_zz - clean.u_zz
    stated = noisy.u_zz_errors
    assert np.ptp(stated) == 0
    assert noisy.synthetic["noise"] == stated.flat[0]
    largest = simulate(**{**options, **STILL}).u_zz[-1].max() / 1.5
    assert stated.flat[0] == pytest.approx(noise * largest, rel=1e-9)
    low, high = chi2.ppf([RARE, 1 - RARE], residual.size)
    assert low < np.sum((residual / stated) ** 2) < high
    # Neighbours, and repeats, are independent: their products have mean 0 and variance 1.
    scaled = residual / stated
    for products in (scaled[:, 1:] * scaled[:, :-1], scaled[1:] * scaled[:-1]):
        assert abs(products.mean()) < 7 / np.sqrt(products.size)


def test_a_seed_gives_the_same_scan_whatever_else_draws_numbers(seed):
    before = np.random.get_state()[1].copy()  # noqa: NPY002
    first = simulate(points=17, seed=seed).u_zz
    np.testing.assert_array_equal(before, np.random.get_state()[1])  # noqa: NPY002
    np.random.seed(seed % 1000)  # noqa: NPY002
    np.testing.assert_array_equal(first, simulate(points=17, seed=seed).u_zz)
    assert not np.array_equal(first, simulate(points=17, seed=seed + 1).u_zz)


def test_several_loads_give_repeats_of_a_rod_pressed_by_the_law_at_each():
    options = {"points": 17, "half_range": 4e-3, **STILL}
    loads = [0.1, 1.0]
    scan = simulate(load=loads, repeats=2, load_uncertainty=0.02, **options)
    assert (scan.kind, scan.load) == ("repeats", pytest.approx(0.55))
    assert scan.load_uncertainty == pytest.approx(0.011)
    np.testing.assert_array_equal(scan.normal_load[:, 5], np.repeat(loads, 2))
    for rows, load in zip((scan.u_zz[:2], scan.u_zz[2:]), loads, strict=True):
        np.testing.assert_allclose(rows, [simulate(load=load, **options).u_zz] * 2, rtol=1e-9)
    light = scan.u_zz[0].max() / loads[0]
    heavy = scan.u_zz[2].max() / loads[1]
    assert heavy / light > 1.1


@pytest.mark.parametrize(
    ("film", "law", "friction"),
    [
        (PAPER_FILM, "neo-hookean", math.inf),
        (LINEAR_FILM, "linear", None),
        (replace(PAPER_FILM, law=""), "linear", None),
    ],
)
def test_the_scan_states_its_law_if_it_has_one_and_it_is_wanted(film, law, friction):
    scan = simulate(film=film, points=9)
    silent = simulate(film=film, points=9, state_law=False)
    assert (scan.film, scan.rod_friction) == (replace(film, law=law), friction)
    assert (silent.film, silent.rod_friction) == (replace(film, law=""), None)
    assert scan.synthetic == silent.synthetic
    assert (scan.synthetic["film_law"], scan.synthetic.get("rod_friction")) == (law, friction)


@pytest.mark.parametrize(("options", "problem"), [
    ({"points": 1}, "two positions"), ({"repeats": 0}, "one repeat"),
    ({"raster": True, "repeats": 2}, "A raster has one repeat at one load"),
    ({"raster": True, "load": [1.0, 2.0]}, "A raster has one repeat at one load"),
    ({"load": 0.0}, "load"), ({"load": float("nan")}, "load"),
    ({"load_uncertainty": -0.1}, "uncertainty of the load"),
    ({"conversion_constant": -1e-7}, "conversion_constant"), ({"noise": float("nan")}, "noise"),
    ({"half_range": 8.0}, "8"), ({"load": []}, "load"), ({"load": [-1.0, 3.0]}, "load"),
    ({"seed": -1}, "seed"), ({"centre": (float("nan"), 0.0)}, "centre"),
])  # fmt: skip
def test_what_cannot_be_simulated_is_refused(options, problem):
    with pytest.raises(InputError, match=problem):
        simulate(**options)


def test_the_stored_truth_rebuilds_the_kernel():
    kernel = GaussianMixture((1 / 3, 2 / 3), (0.5e-3, 1e-3))
    truth = simulate(kernel=kernel, points=9).synthetic
    assert tuple(float(w) for w in str(truth["kernel_weights"]).split(",")) == kernel.weights
    assert "gaussian_sigma" not in truth
    truth = simulate(kernel=DISC, points=9).synthetic
    assert "disc" in str(truth["kernel"])
    assert "gaussian_sigma" not in truth
    assert float(truth["kernel_radius_um"]) * 1e-6 == pytest.approx(DISC.radius)
    assert float(truth["kernel_sigmas_um"]) * 1e-6 == pytest.approx(DISC.sigma)


class Own:
    """A disc by somebody else, of any size, whose transform is no number at k = 0."""

    def __init__(self, size=1.0):
        self.size = size

    def transform(self, k):
        phase = k * DISC.radius
        return self.size * 2 * j1(phase) / phase * np.exp(-0.5 * (DISC.sigma * k) ** 2)

    def radial(self, r):
        return self.size * DISC.radial(r)

    def describe(self):
        return {"kernel": "my own", "centre_of_mass": 0.0}


def test_any_object_with_the_three_methods_is_a_kernel():
    own = simulate(kernel=Own(), seed=3)
    disc = simulate(kernel=DISC, seed=3)
    np.testing.assert_allclose(own.u_zz, disc.u_zz, rtol=1e-12)
    assert own.synthetic.items() >= {"kernel": "my own", "centre_of_mass": 0.0}.items()


@pytest.mark.parametrize(
    ("kernel", "problem"),
    [
        (Own(size=2.0), "transform is 2 at k = 0, not 1"),
        (Own(size=float("nan")), "transform is nan at k = 0"),
        (561e-6, r"of type float, without transform\(\)"),
    ],
)
def test_what_is_no_apparatus_function_is_refused(kernel, problem):
    with pytest.raises(InputError, match=problem):
        simulate(kernel=kernel, points=9)
