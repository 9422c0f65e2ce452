"""Numbers read off G(r), in closed form for a Gaussian, and their derivatives."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import RING, SIGMA

from memscal import fit_gaussian, lift
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.calibration.uncertainty import kernel_functionals
from memscal.model.arrays import FloatArray

R = np.linspace(0.0, 8e-3, 97)


def functionals(g: FloatArray):
    field = lift(R, g, R[1], R[-1])
    return {f.name: f for f in kernel_functionals(field, fit_gaussian(field, SIGMA))}


def test_a_gaussian_has_the_width_and_area_of_its_closed_form() -> None:
    found = functionals(unit_gaussian(R, SIGMA))
    assert found["gaussian_sigma_deconvolved"].value == pytest.approx(SIGMA, rel=1e-6)
    assert found["fwhm"].value == pytest.approx(2 * np.sqrt(2 * np.log(2)) * SIGMA, rel=1e-4)
    assert found["noise_equivalent_area"].value == pytest.approx(4 * np.pi * SIGMA**2, rel=1e-4)


def test_the_width_of_a_ring_is_that_of_its_outer_edge() -> None:
    fine = np.linspace(0.0, 4e-3, 400001)
    values = RING.radial(fine)
    outer = fine[np.flatnonzero(values >= values.max() / 2)[-1]]
    assert functionals(RING.radial(R))["fwhm"].value == pytest.approx(2 * outer, rel=1e-3)


@pytest.mark.parametrize("name", ["gaussian_sigma_deconvolved", "fwhm", "noise_equivalent_area"])
@pytest.mark.parametrize("kernel", [unit_gaussian(R, SIGMA), RING.radial(R)], ids=["round", "ring"])
def test_the_rows_are_derivatives(name: str, kernel: FloatArray) -> None:
    change = 1e-4 * kernel.max() * np.exp(-(((R - 0.5e-3) / 0.4e-3) ** 2))
    above, below = functionals(kernel + change)[name], functionals(kernel - change)[name]
    expected = (above.value - below.value) / 2
    assert functionals(kernel)[name].row @ change == pytest.approx(expected, rel=0.05)


def test_the_rows_are_frozen_with_their_functional() -> None:
    found = functionals(unit_gaussian(R, SIGMA))["fwhm"]
    with pytest.raises(AttributeError):
        found.value = 1.0
    assert replace(found, name="other").value == found.value
