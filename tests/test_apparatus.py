"""The apparatus function in use, against closed forms and direct quadrature."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square, root_mean_square_range
from helpers.builders import CONVERSION, SIGMA, make_artifact
from helpers.machine import assert_same_to_rounding
from helpers.scans import EXACT_FILM, EXACT_ROD, TAILS, as_function, known_apparatus, simulate
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import dblquad
from scipy.stats import ncx2, norm

import memscal
from memscal import ApparatusField, ApparatusRadial, ParameterSet, TransferFunction
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.errors import InputError

SUPPORT = 6e-3
DRAWS = 40 if FULL else 12
RADII = np.linspace(0.0, 12e-3, 601)
STRESS = unit_gaussian(RADII, 1e-3)
AXIS = np.linspace(-8e-3, 8e-3, 81)
X = np.linspace(-8e-3, 8e-3, 101)
Y = np.linspace(-9e-3, 9e-3, 91)


def with_kernel(kernel):
    """An apparatus function of this radial profile, tabulated out to 6 mm."""
    r = np.linspace(0.0, SUPPORT, 401)
    g = kernel(r)
    errors = 0.02 * g
    radial = ApparatusRadial(r, g, errors, g, np.diag(errors**2))
    k = np.linspace(0.0, 2.5e4, 101)
    transfer = TransferFunction(k, np.exp(-((k * SIGMA) ** 2) / 2), 0 * k, 0 * k + 1, 3.7e3)
    return as_function(make_artifact(radial_profile=radial, transfer=transfer))


@pytest.fixture(scope="module")
def apparatus():
    """A Gaussian apparatus function of 561 um."""
    return with_kernel(lambda r: unit_gaussian(r, SIGMA))


@settings(max_examples=25)
@given(width=st.floats(0.2e-3, 1.5e-3), load=st.floats(0.01, 100.0))
def test_a_gaussian_convolved_with_a_gaussian_is_a_wider_gaussian(apparatus, width, load):
    blurred = apparatus.convolve(RADII, load * unit_gaussian(RADII, width))
    exact = load * unit_gaussian(RADII, float(np.hypot(width, SIGMA)))
    np.testing.assert_allclose(blurred, exact, atol=1e-6 * exact[0])


#: What a Gaussian sensor reads at a distance r from the middle of each, as a share of A.
IDEAL = {
    "disc": (1e-3, lambda r: ncx2.cdf((1e-3 / SIGMA) ** 2, 2, (r / SIGMA) ** 2)),
    "gaussian": (1e-3, lambda r: 2e-6 * np.pi * unit_gaussian(r, float(np.hypot(1e-3, SIGMA)))),
    "point": (0.0, lambda r: unit_gaussian(r, SIGMA)),
    "slit": (1e-3, lambda r: norm.cdf(0.5e-3 - r, 0, SIGMA) - norm.cdf(-0.5e-3 - r, 0, SIGMA)),
}


@pytest.fixture(scope="module")
def alike(apparatus):
    """The same, with errors of G that all radii share."""
    radial = apparatus.radial_profile
    radial = replace(radial, g_covariance=np.outer(radial.g_errors, radial.g_errors))
    return replace(apparatus, plane=None, radial_profile=radial)


@pytest.mark.parametrize("shape", IDEAL)
def test_an_ideal_reference_is_predicted_by_its_closed_form(shape, alike):
    size, share = IDEAL[shape]
    source = memscal.IdealReference(shape, size)
    x = np.linspace(-3e-3, 2e-3, 41)
    expected = alike.conversion_constant * share(np.abs(x))
    volts = alike.predict(x, source)
    np.testing.assert_allclose(volts, expected, atol=1e-4 * expected.max())
    errors = alike.predict_uncertainty(x, source)
    u_a = alike.parameters.uncertainty("conversion_constant") / alike.conversion_constant
    np.testing.assert_allclose(errors, volts * np.hypot(0.02, u_a), atol=1e-5 * volts.max())
    if shape == "slit":
        with pytest.raises(InputError, match="same along itself"):
            alike.predict(x, source, y=x)
        return
    plane = alike.predict(x, source, y=[0.0, 1e-3])
    np.testing.assert_allclose(plane[0], expected, atol=2e-3 * expected.max())
    over_plane = alike.predict_uncertainty(x, source, y=[0.0])[0]
    np.testing.assert_allclose(over_plane, errors, atol=0.01 * errors.max())


def test_over_the_plane_what_is_uncertain_beside_the_profile_adds_to_a_prediction(alike):
    sensor = replace(alike, plane=ApparatusField.of_profile(alike.radial_profile))
    x = np.linspace(-6e-3, 6e-3, 61)
    stress = 1e3 * np.exp(-((np.hypot.outer(x, x) / 1e-3) ** 2))
    r = x[30:]
    along = sensor.predict_uncertainty(r, stress[30, 30:])
    plane = sensor.predict_uncertainty(x, stress, y=x)
    np.testing.assert_allclose(plane[30, 30:], along, atol=0.02 * along.max())
    # Errors of independent patches, each of the largest G's tenth.
    field = sensor.field
    errors = np.full_like(field.g, 0.1 * field.g.max())
    unsure = replace(sensor, plane=replace(field, g_errors=errors))
    more = unsure.predict_uncertainty(x, stress, y=x)[30, 30]
    patch = 4 * np.pi / 3.7e3**2
    area = 2e-6 * np.pi
    force = 1e3 * np.pi * 1e-6
    extra = CONVERSION * errors[0, 0] * force * np.sqrt(patch / (patch + area))
    assert more == pytest.approx(np.hypot(along[0], extra), rel=0.05)


def test_the_line_spread_of_a_gaussian_is_a_normal_density_as_unsure_as_its_width():
    value, uncertainty = known_apparatus(width_uncertainty=0.01).line_spread(X)
    density = norm.pdf(X, 0, SIGMA)
    change = 0.01 * abs((X / SIGMA) ** 2 - 1) * density
    np.testing.assert_allclose(value, density, atol=1e-6 * density.max())
    np.testing.assert_allclose(uncertainty, change, atol=1e-3 * change.max())


@pytest.mark.parametrize("place", [0.0, 0.7e-3, 2.3e-3])
def test_the_convolution_is_the_double_integral_at_a_point(place):
    def kernel(r):
        return 1.5 * unit_gaussian(r, 0.6e-3) - 0.5 * unit_gaussian(r, 0.4e-3)

    # A stress with a flank, 1/(1 + (r/w)^4), which is no sum of Gaussians.
    def stress(r):
        return 1e5 / (1 + (r / 1e-3) ** 4)

    def integrand(angle, s):
        distance = np.sqrt(place**2 + s**2 - 2 * place * s * np.cos(angle))
        return float(2 * s * kernel(s) * stress(distance))

    direct, _ = dblquad(integrand, 0, 8 * SIGMA, 0, np.pi, epsabs=1e-3, epsrel=1e-8)
    found = with_kernel(kernel).convolve(RADII, stress(RADII))
    at = int(np.argmin(np.abs(RADII - place)))
    # What the table leaves out beyond 12 mm is 1e5/12^4 Pa.
    assert found[at] == pytest.approx(direct, abs=1e5 / 12**4)
    assert found[at] == pytest.approx(direct, rel=1e-5)


def elliptic(x, y, covariance):
    """Gaussian of unit integral at positions (y, x)."""
    places = np.stack(np.meshgrid(x, y), axis=-1)
    form = np.einsum("...i,ij,...j", places, np.linalg.inv(covariance), places)
    return np.exp(-form / 2) / (2 * np.pi * np.sqrt(np.linalg.det(covariance)))


def test_a_field_is_convolved_with_g_over_the_plane():
    sensor = np.array([[0.5, 0.2], [0.2, 0.3]]) * 1e-6
    force = np.array([[1.0, -0.6], [-0.6, 2.0]])
    axis = np.linspace(-4e-3, 4e-3, 161)
    field = ApparatusField(axis, axis, elliptic(axis, axis, sensor), np.zeros((161, 161)))
    apparatus = as_function(make_artifact(plane=field))
    stress = 3.0 * elliptic(X, Y, force * 1e-6)
    exact = 3.0 * elliptic(X, Y, sensor + force * 1e-6)
    blurred = apparatus.convolve(X, stress, y=Y)
    np.testing.assert_allclose(blurred, exact, atol=1e-5 * exact.max())
    volts = apparatus.predict(X, stress, y=Y)
    np.testing.assert_allclose(volts, apparatus.conversion_constant * blurred)


@pytest.mark.parametrize(
    ("x", "y", "shape", "problem"),
    [
        (AXIS, AXIS[1:], (81, 81), "80 positions"),
        (1e3 * AXIS, AXIS, (81, 81), "200 mm"),
        (np.geomspace(1e-3, 8e-3, 81), AXIS, (81, 81), "not even"),
        (AXIS, AXIS, (81, 81), "the edge"),
        (AXIS, AXIS, (81,), "no field"),
    ],
)
def test_a_field_that_cannot_be_convolved_is_refused(apparatus, x, y, shape, problem):
    with pytest.raises(InputError, match=problem):
        apparatus.predict(x, np.ones(shape), y=y)


@settings(max_examples=8)
@given(a=st.floats(-1e3, 1e3, width=16), b=st.floats(-1e3, 1e3, width=16))
def test_the_convolution_is_linear(apparatus, a, b):
    two = unit_gaussian(RADII, 0.6e-3) * (RADII / 1e-3) ** 2
    together = apparatus.convolve(RADII, a * STRESS + b * two)
    apart = a * apparatus.convolve(RADII, STRESS) + b * apparatus.convolve(RADII, two)
    np.testing.assert_allclose(together, apart, atol=1e-9 * (abs(a) + abs(b)) * STRESS[0])


@pytest.mark.parametrize(
    "uneven",
    [
        np.append(np.linspace(0.0, 4e-3, 300), np.geomspace(4e-3, 12e-3, 60)[1:]),
        np.append(RADII[:301], [8e-3, 10e-3, 12e-3]),  # where there is no stress
    ],
)
def test_uneven_radii_give_the_same_as_even_ones(apparatus, uneven):
    found = apparatus.convolve(uneven, unit_gaussian(uneven, 0.9e-3))
    exact = unit_gaussian(uneven, float(np.hypot(0.9e-3, SIGMA)))
    np.testing.assert_allclose(found, exact, atol=1e-6 * exact[0])


def test_a_voltage_is_the_blurred_stress_times_the_constant(apparatus):
    stress = 2e5 * np.exp(-((RADII / 1e-3) ** 2))
    volts = apparatus.predict(RADII, stress)
    assert_same_to_rounding(volts, CONVERSION * apparatus.convolve(RADII, stress))
    np.testing.assert_allclose(apparatus.stress(volts), apparatus.convolve(RADII, stress))


def test_the_radial_profile_is_that_of_the_table_between_its_radii(apparatus):
    r = np.linspace(-SUPPORT, SUPPORT, 997).reshape(-1, 1)
    g = unit_gaussian(r, SIGMA)
    np.testing.assert_allclose(apparatus.radial(r), g, atol=1e-2)
    np.testing.assert_allclose(apparatus.radial_uncertainty(r), 0.02 * g, atol=1)
    assert apparatus.radial(r).shape == r.shape


@pytest.mark.parametrize(
    ("r", "sigma", "problem"),
    [
        (RADII * 1e3, STRESS, "r reaches 12 m"),
        (RADII[::40], STRESS[::40], "every 0.8 mm, coarser"),
        (RADII[:101], STRESS[:101], "13.5% of the largest stress is left"),
        (RADII[:-1], STRESS, "differ in length: 600 and 601"),
        (RADII[::-1], STRESS, "r must increase"),
        (RADII - 1e-4, STRESS, "r begins at -0.0001 m"),
        (RADII[100:], STRESS[100:], "r begins at 0.002 m"),
        (np.outer([1, 1], RADII), np.outer([1, 1], RADII), "r has shape"),
        ([], [], "r has shape"),
        (RADII, np.full(601, np.nan), "sigma_zz holds a value that is not finite"),
        (RADII[:3], [1.0, 0.5, 0.0], "3 radii cannot be interpolated"),
        ([0.0], [1.0], "cannot be interpolated"),
    ],
)
def test_a_table_that_cannot_be_convolved_is_refused(apparatus, r, sigma, problem):
    for method in (apparatus.convolve, apparatus.predict):
        with pytest.raises(InputError, match=problem) as caught:
            method(r, sigma)
        if "12 m" in problem:
            assert "metres, not millimetres" in caught.value.cure


def test_a_compact_artifact_is_half_as_large_and_convolves_the_same(tmp_path):
    whole = memscal.calibrate(simulate(noise=0.005, seed=2)).apparatus
    compact = whole.compact()
    sizes = []
    for name, apparatus in (("whole.h5", whole), ("compact.h5", compact)):
        apparatus.save(tmp_path / name)
        sizes.append((tmp_path / name).stat().st_size)
    assert sizes[1] < 0.55 * sizes[0]
    read = memscal.load_apparatus(tmp_path / "compact.h5")
    assert (read.plane, read.content_digest) == (None, compact.content_digest)
    assert read.content_digest != whole.content_digest
    np.testing.assert_allclose(read.field.g, whole.field.g, atol=1e-5 * whole.field.g.max())
    np.testing.assert_allclose(read.field.g_errors, whole.field.g_errors, rtol=1e-6)
    stress = elliptic(X, Y, np.array([[1.0, -0.6], [-0.6, 2.0]]) * 1e-6)
    expected = whole.convolve(X, stress, y=Y)
    np.testing.assert_allclose(read.convolve(X, stress, y=Y), expected, atol=1e-5 * expected.max())


def test_g_that_is_not_round_stays_in_a_compact_artifact(apparatus):
    axis = np.linspace(-SUPPORT, SUPPORT, 801)
    oval = elliptic(axis, axis, np.diag([1.01, 1 / 1.01]) * SIGMA**2)
    field = ApparatusField(axis, axis, oval, np.zeros_like(oval))
    kept = replace(apparatus, plane=field).compact()
    assert kept.plane is field
    of_profile = ApparatusField.of_profile(apparatus.radial_profile)
    assert replace(apparatus, plane=of_profile).compact().plane is None


def test_the_uncertainty_of_a_prediction_is_that_of_many_calibrations():
    """Predicted voltages of a sphere's stress scatter as the artifact's covariances say."""
    film = EXACT_FILM
    rod = EXACT_ROD
    sphere = memscal.indent(film, memscal.Sphere(radius=20e-3), load=1.0)
    r = np.linspace(0.0, 12e-3, 241)
    stress = sphere.base_stress(r)
    predicted = []
    stated = []
    blurred = []
    for seed in range(DRAWS):
        scan = simulate(
            film=film, rod=rod, noise=0.005, seed=seed, load_uncertainty=None, kernel=TAILS
        )
        apparatus = memscal.calibrate(scan, method="evidence").apparatus
        predicted.append(apparatus.predict(r, stress)[:60:6])
        stated.append(apparatus.predict_uncertainty(r, stress)[:60:6])
        blurred.append(apparatus.convolve_uncertainty(r, stress)[:60:6])
    scatter = np.std(predicted, axis=0, ddof=1)
    said = root_mean_square(stated)
    # What is stated also counts what does not scatter; a standard deviation is known to so much.
    chance = root_mean_square_range(DRAWS - 1, 1e-5)
    assert np.all(scatter < 1.1 * chance[1] * said)
    assert np.all(said < 1.8 / chance[0] * scatter)
    # A alone, as if it were independent of G, would say more than is true on the axis.
    u_a = apparatus.parameters.uncertainty("conversion_constant") / apparatus.conversion_constant
    assert apparatus.stress_uncertainty(predicted[-1]) == pytest.approx(
        u_a * np.abs(apparatus.stress(predicted[-1]))
    )
    assert np.all(np.array(blurred) > 0)


@pytest.mark.parametrize(
    ("values", "covariance", "units"),
    [
        (np.zeros(3), np.zeros((2, 2)), ()),
        (np.zeros(2), np.zeros((3, 3)), ()),
        (np.zeros(2), np.zeros(2), ()),
        (np.zeros(2), np.zeros((2, 2)), ("m",)),
    ],
)
def test_parameters_that_do_not_fit_together_are_refused(values, covariance, units):
    with pytest.raises(InputError, match="2 parameter names"):
        ParameterSet(("a", "b"), values, covariance, units)
