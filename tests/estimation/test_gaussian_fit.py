"""The Gaussian fit: exact without noise, right in its derivatives, and robust at its start."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.scans import CONVERSION, reference_spectrum, simulated, with_outlier
from hypothesis import given, settings
from hypothesis import strategies as st

import memscal
from memscal.axisymmetry.kernels import gaussian_transfer
from memscal.errors import FitError
from memscal.estimation.forward import ForwardModel
from memscal.estimation.gaussian import fit_gaussian_to_points
from memscal.estimation.points import measured_points


def forward(scan):
    points = measured_points(scan)
    contact = memscal.indent(scan.film, scan.indenter, load=1.0)
    return ForwardModel(points, (reference_spectrum(contact, points),))


def fit(scan):
    model = forward(scan)
    return fit_gaussian_to_points(model, np.ones_like(model.points.u))


@settings(max_examples=25)
@given(
    sigma=st.floats(0.15e-3, 1.2e-3),
    centre=st.floats(-2.5e-3, 2.5e-3),
    baseline=st.floats(-0.5, 0.5),
    drift=st.floats(-0.3, 0.3),
)
def test_without_noise_every_parameter_is_recovered(sigma, centre, baseline, drift):
    scan = simulated(
        kernel=memscal.GaussianMixture((1.0,), (sigma,)),
        centre=(centre, 0.0),
        baseline=baseline,
        drift=drift,
        noise=0.0,
    )
    found = fit(scan)
    # The film passes no more than exp(-kh): a width is known to what the fit converges to.
    assert found.sigma == pytest.approx(sigma, rel=1e-5)
    assert found.conversion_constant == pytest.approx(CONVERSION, rel=1e-6)
    assert found.centre[0, 0] == pytest.approx(centre, abs=1e-9)
    assert found.drift[0] == pytest.approx(scan.synthetic["baseline"], abs=1e-9)
    assert 2 * found.drift[1] == pytest.approx(scan.synthetic["drift"], abs=1e-9)


def test_uneven_and_unsorted_positions_change_nothing():
    even = simulated(noise=0.0, points=129)
    chosen = np.random.default_rng().permutation(129)[:60]
    uneven = replace(even, x=even.x[chosen], u_zz=even.u_zz[chosen])
    assert fit(uneven).sigma == pytest.approx(fit(even).sigma, rel=1e-5)


def test_the_jacobian_is_the_derivative_of_the_prediction():
    for raster in (False, True):
        model = forward(simulated(raster=raster, points=13, noise=0.0))
        found = fit_gaussian_to_points(model, np.ones_like(model.points.u))
        plane = 2 if raster else 1

        def predict(shift, found=found, model=model, plane=plane):
            a = found.conversion_constant + shift[0]
            s = found.sigma + shift[1]
            centre = found.centre.copy()
            centre[0, :plane] += shift[2 : 2 + plane]
            signal = model.signal(model.geometry(centre), a * gaussian_transfer(model.k, s))
            return signal + model.drift_columns @ (found.drift + shift[2 + plane :])

        # The ellipse of a raster, whose slopes follow, is tested where it is at home.
        count = found.jacobian.shape[1] - model.points.ellipse
        steps = [1e-5 * CONVERSION, 1e-8, *[1e-8] * plane, *[1e-6] * (count - 2 - plane)]
        for i, step in enumerate(steps):
            shift = np.zeros(count)
            shift[i] = step
            slope = (predict(shift) - predict(-shift)) / (2 * step)
            scale = np.abs(slope).max()
            np.testing.assert_allclose(found.jacobian[:, i] / scale, slope / scale, atol=1e-6)


@pytest.mark.parametrize("place", [0, 11, 31, 64])
def test_one_gross_outlier_does_not_lead_the_search_astray(place):
    scan = simulated(noise=0.002)
    assert fit(with_outlier(scan, place, 3.0)).centre[0, 0] == pytest.approx(0.14e-3, abs=0.05e-3)


def test_a_fit_that_leaves_all_numbers_is_refused():
    model = forward(simulated(noise=0.0))
    with pytest.raises(FitError, match="No Gaussian"):
        fit_gaussian_to_points(model, np.full_like(model.points.u, np.nan), fit(simulated()))


def test_a_voltage_that_never_falls_again_is_refused():
    scan = simulated()
    bowl = 1e-4 * (scan.x / 1e-3) ** 2
    with pytest.raises(FitError, match="apparatus function"):
        fit(replace(scan, u_zz=-bowl))
