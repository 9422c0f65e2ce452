"""Shapes of departure from a Gaussian: closed forms against quadrature."""

from __future__ import annotations

import numpy as np
import pytest
from helpers.scans import CONVERSION, SIGMA, estimated, simulated

from memscal.axisymmetry.hankel import Wavenumbers
from memscal.estimation.bayesian import SHAPES, Rings

NODES = Wavenumbers.covering(60e3, 12e-3)


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: f"{s.name} {s.blur} {s.extent}")
def test_a_shape_is_the_same_on_both_sides_of_the_transform(shape) -> None:
    rings = shape.rings(SIGMA, CONVERSION)
    r = np.linspace(0.0, 4e-3, 41)
    transform = rings.transform(NODES.k)
    by_quadrature = np.stack([NODES.synthesise(column, r) for column in transform.T], axis=1)
    np.testing.assert_allclose(rings.radial(r), by_quadrature, atol=1e-9 * by_quadrature.max())


@pytest.mark.parametrize("shape", SHAPES, ids=lambda s: f"{s.name} {s.blur} {s.extent}")
def test_a_strength_of_one_is_as_large_as_the_gaussian(shape) -> None:
    transform = shape.rings(SIGMA, CONVERSION).transform(NODES.k)
    expected = np.sqrt(np.sum(NODES.weights @ transform**2))
    gaussian = CONVERSION * np.exp(-0.5 * (SIGMA * NODES.k) ** 2)
    assert expected == pytest.approx(np.sqrt(NODES.weights @ gaussian**2), rel=1e-6)


def test_a_ring_carries_its_amplitude_whatever_its_radius_and_blur() -> None:
    rings = Rings(np.array([0.0, 1e-3, 3e-3]), np.array([0.2e-3, 0.3e-3, 1e-3]), np.ones(3))
    r = np.linspace(0.0, 10e-3, 20001)
    integrals = 2 * np.pi * np.trapezoid(rings.radial(r) * r[:, None], r, axis=0)
    np.testing.assert_allclose(integrals, 1.0, rtol=1e-6)
    np.testing.assert_allclose(rings.transform(np.zeros(1))[0], 1.0)


def test_the_basis_moves_the_estimate_as_its_columns_say() -> None:
    estimate = estimated(simulated(noise=0.002))
    basis, r = estimate.basis, np.linspace(0.0, 3e-3, 31)
    columns = basis.kernels(NODES.k)
    np.testing.assert_allclose(
        np.stack([NODES.synthesise(c, r) for c in columns.T], axis=1),
        basis.radial(r),
        atol=1e-8 * np.abs(basis.radial(r)).max(),
    )
    assert basis.blocks[-1].stop == basis.integrals.size == columns.shape[1]
