"""The paper's steps on arrays, against closed forms of Gaussians."""

import numpy as np
import pytest

import memscal
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.deconvolution.division import Tikhonov
from memscal.errors import FitError, InputError

R = np.linspace(0.0, 7e-3, 281)
SPACING = 0.1e-3
EXTENT = 8e-3
STRESS_WIDTH = 0.5e-3
WIDTH = 0.561e-3
CONVERSION = 1e-7


def gaussian(width):
    """A Gaussian of unit integral, lifted."""
    return memscal.lift(R, unit_gaussian(R, width), SPACING, EXTENT)


def voltage_and_stress():
    """Fields of a sensor with a Gaussian G: the widths add up in squares."""
    blurred = gaussian(np.hypot(STRESS_WIDTH, WIDTH))
    return memscal.Field(blurred.grid, CONVERSION * blurred.values), gaussian(STRESS_WIDTH)


def test_lifting_keeps_the_integral_and_the_profile():
    field = gaussian(WIDTH)
    # The spline through the profile errs by (25 um / 561 um)^4 = 4e-6 at the most.
    assert field.integral == pytest.approx(1.0, abs=4e-6)
    assert field.image.shape == (field.y.size, field.x.size)
    exact = unit_gaussian(field.r, WIDTH)
    np.testing.assert_allclose(field.radial, exact, atol=1e-5 * exact[0])


def test_the_transform_of_a_lifted_gaussian_is_a_gaussian():
    k, modulus = gaussian(WIDTH).spectrum()
    np.testing.assert_allclose(modulus, np.exp(-((k * WIDTH) ** 2) / 2), atol=1e-6)


def test_the_steps_find_conversion_constant_and_width():
    voltage, stress = voltage_and_stress()
    quotient = memscal.divide(voltage, stress, weakest=1e-5)
    a, g = memscal.normalise(quotient)
    # The window leaves ripples of the size of the weakest component, 1e-5.
    assert a == pytest.approx(CONVERSION, rel=3e-5)
    assert g.integral == pytest.approx(1.0, abs=1e-12)
    assert memscal.fit_gaussian(g) == pytest.approx(WIDTH, rel=1e-3)
    assert quotient.window[0, 0] == pytest.approx(1.0)


@pytest.mark.parametrize("method", ["white-noise", "tikhonov"])
def test_what_was_divided_convolves_back_to_the_voltage(method):
    voltage, stress = voltage_and_stress()
    a, g = memscal.normalise(memscal.divide(voltage, stress, weakest=1e-5, method=method))
    back = memscal.reconvolve(a, g, stress)
    np.testing.assert_allclose(back.values, voltage.values, atol=2e-4 * voltage.values.max())


def test_the_weakest_component_of_the_voltage_is_read_where_that_of_the_stress_is():
    voltage, stress = voltage_and_stress()
    pair = (1e-2, float(voltage.spectrum()[1][int(np.argmax(stress.spectrum()[1] <= 1e-2))]))
    drawn = [
        memscal.divide(
            voltage, stress, weakest=weakest, method="white-noise-draw", options={"seed": 3}
        )
        for weakest in (1e-2, pair)
    ]
    np.testing.assert_allclose(drawn[0].values, drawn[1].values)


def test_a_profile_that_is_none_is_refused():
    with pytest.raises(InputError, match="must increase"):
        memscal.lift(R[::-1], R, SPACING, EXTENT)
    with pytest.raises(InputError, match="differ in length"):
        memscal.lift(R, R[1:], SPACING, EXTENT)
    for extent in (SPACING / 2, 1e6 * SPACING):
        with pytest.raises(InputError, match="half side"):
            memscal.lift(R, R, SPACING, extent)


def test_fields_on_different_grids_are_not_divided():
    stress = memscal.lift(R, np.exp(-R / 1e-3), SPACING, 2 * EXTENT)
    with pytest.raises(InputError, match="one spacing and one extent"):
        memscal.divide(gaussian(WIDTH), stress, weakest=1e-3)
    with pytest.raises(InputError, match="one spacing and one extent"):
        memscal.reconvolve(1.0, gaussian(WIDTH), stress)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"weakest": 0.0}, "weakest relevant component"),
        ({"weakest": float("nan")}, "weakest relevant component"),
        ({"weakest": 1e-3, "method": Tikhonov(), "options": {"amplitude": 2.0}}, "set up already"),
    ],
)
def test_a_division_without_a_noise_or_with_idle_options_is_refused(options, message):
    with pytest.raises(InputError, match=message):
        memscal.divide(*voltage_and_stress(), **options)


def test_a_quotient_without_a_positive_integral_has_no_conversion_constant():
    field = gaussian(WIDTH)
    with pytest.raises(FitError, match="conversion constant is positive"):
        memscal.normalise(memscal.Field(field.grid, -field.values))
