"""The independent forward calculation is held against closed forms, and the package against it."""

import numpy as np
import pytest
from helpers.true_arrays import (
    KERNELS,
    ROD,
    SHEAR_MODULUS,
    TrueArray,
    layer,
    simulated_frames,
    true_array,
)

import memscal

R = np.linspace(0.0, 8e-3, 33)
LINE = np.stack([R, np.zeros_like(R)], axis=1)


def bare(**truth):
    """One sensor at the origin with A = 1 V/Pa that averages over nothing."""
    one = {"centres": np.zeros((1, 2)), "conversion_constants": np.ones(1), "crosstalk": np.eye(1)}
    return TrueArray(**one, kernel=np.ones_like, **truth)


@pytest.mark.parametrize("poisson_ratio", [0.3, 0.45, 0.5])
@pytest.mark.parametrize("indenter", [ROD, memscal.Sphere(radius=5e-3)])
def test_the_package_and_the_layer_agree(poisson_ratio, indenter):
    film = memscal.ElasticFilm(
        young_modulus=2 * (1 + poisson_ratio) * SHEAR_MODULUS,
        poisson_ratio=poisson_ratio,
        thickness=2e-3,
    )
    truth = bare(poisson_ratio=poisson_ratio)
    contact = memscal.indent(film, indenter, load=0.7)
    read = truth.readings(LINE, 0.7, indenter=indenter)[:, 0]
    np.testing.assert_allclose(read, contact.base_stress(R), atol=1e-3 * read.max())


@pytest.mark.parametrize("poisson_ratio", [0.3, 0.5])
def test_forces_and_moments_balance(poisson_ratio):
    np.testing.assert_allclose(layer(poisson_ratio)(0.0), [0.0, 1.0], atol=2e-4)
    x = np.linspace(-30e-3, 30e-3, 241)
    plane = np.stack(np.meshgrid(x, x, indexing="xy"), axis=-1).reshape(-1, 2)
    area = (x[1] - x[0]) ** 2
    truth = bare(poisson_ratio=poisson_ratio)
    # A place R from the contact is read by a contact -R from the sensor.
    stress = truth.readings(-plane, 2.0, shears=np.array([0.3, -0.1]))[:, 0]
    assert stress.sum() * area == pytest.approx(2.0, rel=1e-3)
    moments = stress @ plane * area
    np.testing.assert_allclose(moments, truth.thickness * np.array([0.3, -0.1]), atol=1e-6)


@pytest.mark.parametrize("kernel", KERNELS)
def test_each_g_has_unit_integral(kernel):
    k = np.array([1.0, 10.0])
    np.testing.assert_allclose(KERNELS[kernel](k), 1.0, atol=1e-4)


def test_a_uniform_pressure_reads_the_sum_of_what_a_row_takes_in():
    truth = true_array(3, 3, crosstalk=0.05)
    x = 0.5e-3 * np.arange(-50, 51)
    places = np.stack(np.meshgrid(x, x), axis=-1).reshape(-1, 2)
    # Presses of 0.25 uN everywhere are a pressure of 1 Pa.
    read = truth.readings(places, 0.25e-6).sum(axis=0)
    expected = truth.crosstalk @ truth.conversion_constants
    np.testing.assert_allclose(read, expected, rtol=2e-3)


def test_half_of_the_noise_is_common_and_frames_are_what_contacts_read():
    truth = true_array(4, 4)
    noisy, places, forces = simulated_frames(truth, 4000, noise=0.01)
    clean, *_ = simulated_frames(truth, 4000, noise=0.0)
    np.testing.assert_allclose(clean, truth.readings(places, forces))
    covariance = np.cov((noisy - clean).T) / truth.readings(truth.centres, 1.0).max() ** 2
    # Of 4,000 frames a covariance is known to 1/sqrt(2000), of which four are allowed.
    np.testing.assert_allclose(covariance, 0.5e-4 * (1 + np.eye(16)), atol=4 * 1e-4 / 2000**0.5)
