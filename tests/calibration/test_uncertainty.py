"""Uncertainties against brute force, the budget's own sums, and the functionals of G(r)."""

import re
from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from helpers.bounds import FULL, deviates
from helpers.scans import LINEAR_FILM, RING, SIGMA, TAILS, simulate, simulated
from scipy.stats import binom

import memscal
from memscal.axisymmetry.hankel import hankel_transform
from memscal.axisymmetry.kernels import unit_gaussian
from memscal.deconvolution.division import WhiteNoise
from memscal.deconvolution.widths import kernel_functionals
from memscal.extensions.simulation.rod_scan import PAPER_ROD
from memscal.model.apparatus import round_wavenumbers

PARAMETERS = ("conversion_constant", "gaussian_sigma", "gaussian_sigma_deconvolved")


def calibrated(scan, film=LINEAR_FILM, rod=PAPER_ROD):
    return memscal.calibrate(scan, reference=memscal.indent(film, rod, load=1.0)).apparatus


@pytest.mark.parametrize(
    ("source", "change"),
    [
        ("thickness", lambda: {"film": replace(LINEAR_FILM, thickness=2.02e-3)}),
        # Of 0.5 ± 0.005 half a normal distribution is left: of mean 0.5 - 0.00399, and 0.00301.
        ("poisson_ratio", lambda: {"film": replace(LINEAR_FILM, poisson_ratio=0.5 - 0.0070)}),
        ("rod_radius", lambda: {"rod": replace(PAPER_ROD, radius=0.2525e-3)}),
    ],
)
def test_each_input_of_the_reference_counts_what_moving_it_changes(source, change):
    # A curved baseline would take a part of what a film changes in the tail.
    scan = simulated(film=LINEAR_FILM, rod=PAPER_ROD, noise=0.002)
    scan = replace(scan, baseline_curvature_uncertainty=0.0)
    usual = calibrated(scan)
    moved = calibrated(scan, **change())
    # The window of the deconvolved G follows the reference too, which first order leaves out.
    for name, tolerance in (("gaussian_sigma", 0.05), ("gaussian_sigma_deconvolved", 0.25)):
        difference = abs(moved.parameters[name] - usual.parameters[name])
        assert usual.budget[name][source] == pytest.approx(difference, rel=tolerance, abs=2e-8)
    # A follows from the total force, which no film changes, up to the tail that the film shapes.
    difference = abs(moved.conversion_constant - usual.conversion_constant)
    counted = usual.budget["conversion_constant"][source]
    assert counted == pytest.approx(difference, rel=0.5, abs=5e-4 * usual.conversion_constant)


def test_at_finite_strain_the_load_counts_in_the_widths_what_moving_it_changes():
    scan = replace(simulate(noise=0.002, seed=2), load_uncertainty=0.02)
    usual, moved = (
        memscal.calibrate(each, method="bayesian").apparatus
        for each in (scan, replace(scan, load=1.02))
    )
    for name, value in (("gaussian_sigma", 0.00178e-3), ("conversion_constant", None)):
        difference = abs(moved.parameters[name] - usual.parameters[name])
        assert usual.budget[name]["load"] == pytest.approx(difference, rel=0.05)
        assert value is None or difference == pytest.approx(value, rel=0.1)
    linear = simulated(film=LINEAR_FILM, rod=PAPER_ROD, load_uncertainty=0.02)
    assert memscal.calibrate(linear).apparatus.budget["gaussian_sigma"]["load"] == 0


@pytest.mark.parametrize(
    ("film", "kernel", "settings"),
    [
        ({"thickness": 5e-3}, memscal.GaussianMixture(), {"noise": 0.003, "half_range": 20e-3}),
        ({"thickness": 2e-3}, memscal.SmoothedDisc(0.6e-3, 0.05e-3), {"noise": 0.005}),
    ],
)
def test_the_area_of_a_division_counts_what_its_window_hides(film, kernel, settings):
    k = np.linspace(0.0, 60e3, 100_001)
    true = 2 * np.pi / np.trapezoid(kernel.transform(k) ** 2 * k, k)
    film = memscal.ElasticFilm(young_modulus=1e6, poisson_ratio=0.49, law="linear", **film)
    pulls = []
    for seed in range(12 if FULL else 5):
        scan = simulate(film=film, kernel=kernel, load=0.1, seed=seed, **settings)
        found = memscal.calibrate(scan).apparatus.parameters
        pulls += deviates(found, {"noise_equivalent_area": true})
    # A bias of known size is its standard uncertainty; before that was 2.5 to 3.2.
    assert 0.5 < np.mean(pulls) < 1.2
    assert np.sum(np.abs(pulls) < 2) >= binom.ppf(1e-3, len(pulls), 0.95)


def test_a_scan_that_is_given_twice_is_refused():
    scan, other = (memscal.simulate(seed=seed, points=33) for seed in (1, 2))
    for scans in ([scan, scan], [scan, other, replace(scan, title="a copy")]):
        with pytest.raises(memscal.MemscalError, match="is given twice"):
            memscal.calibrate(scans)


def test_a_gain_that_varies_between_repeats_counts_by_its_standard_deviation():
    scan = memscal.simulate(seed=1)
    rng = np.random.default_rng(1)
    repeats = scan.u_zz + rng.normal(0.0, 0.002 * np.ptp(scan.u_zz), (4, scan.u_zz.size))
    gain = 1 + 0.01 * np.array([1, -1, 1, -1])
    shares = []
    for u in (repeats, gain[:, None] * repeats):
        found = memscal.calibrate(replace(scan, u_zz=u, u_zz_errors=None), other=False).apparatus
        line = found.budget["conversion_constant"].get("between_repeats", 0.0)
        shares.append(line / found.conversion_constant)
    assert shares[0] < 1e-3
    assert shares[1] == pytest.approx(gain.std(ddof=1) / 2, rel=0.2)


def test_covariances_are_covariances():
    apparatus = memscal.calibrate(memscal.simulate(kernel=TAILS)).apparatus
    for covariance in (apparatus.parameters.covariance, apparatus.radial_profile.g_covariance):
        scale = np.sqrt(np.diag(covariance))
        correlation = covariance / np.outer(scale, scale)
        np.testing.assert_allclose(correlation, correlation.T, atol=1e-12)
        assert np.linalg.eigvalsh(correlation).min() > -1e-9
    profile = apparatus.radial_profile
    np.testing.assert_allclose(profile.g_errors**2, np.diag(profile.g_covariance))


R = np.linspace(0.0, 8e-3, 97)


class PlugIn:
    """The division of method white-noise, as a plug-in of which nothing is known."""

    name = "plug-in"
    assumes = ""
    fails = ""

    def divide(self, problem):
        return WhiteNoise().divide(problem)


def test_draws_of_a_linear_division_scatter_by_its_first_order_uncertainty():
    scan = simulated(noise=0.01, kernel=memscal.GaussianMixture((1.0,), (0.9e-3,)))
    drawn, linear = (memscal.calibrate(scan, method=m).apparatus for m in (PlugIn(), "white-noise"))
    told = "\n".join(map(str, drawn.process.messages))
    draws = int(re.search(r"the scatter of (\d+) draws", told)[1])
    alike = partial(np.testing.assert_allclose, rtol=4 / np.sqrt(2 * draws))
    for name in (*PARAMETERS, "fwhm", "noise_equivalent_area"):
        alike(drawn.budget[name]["noise"], linear.budget[name]["noise"])
    alike(*(a.radial_uncertainty(R[R < 3e-3]) for a in (drawn, linear)))


def functionals(g):
    field = memscal.lift(R, g, R[1], R[-1])
    return {f.name: f for f in kernel_functionals(field, memscal.fit_gaussian(field, SIGMA))}


def test_a_gaussian_has_the_width_and_area_of_its_closed_form():
    found = functionals(unit_gaussian(R, SIGMA))
    assert found["gaussian_sigma_deconvolved"].value == pytest.approx(SIGMA, rel=1e-6)
    assert found["fwhm"].value == pytest.approx(2 * np.sqrt(2 * np.log(2)) * SIGMA, rel=1e-4)
    assert found["noise_equivalent_area"].value == pytest.approx(4 * np.pi * SIGMA**2, rel=1e-4)


def test_the_width_of_a_ring_is_that_of_its_outer_edge():
    fine = np.linspace(0.0, 4e-3, 400001)
    values = RING.radial(fine)
    outer = fine[np.flatnonzero(values >= values.max() / 2)[-1]]
    assert functionals(RING.radial(R))["fwhm"].value == pytest.approx(2 * outer, rel=1e-3)


@pytest.mark.parametrize("name", ["gaussian_sigma_deconvolved", "fwhm", "noise_equivalent_area"])
@pytest.mark.parametrize("kernel", [unit_gaussian(R, SIGMA), RING.radial(R)], ids=["round", "ring"])
def test_the_rows_are_derivatives(name, kernel):
    change = 1e-4 * kernel.max() * np.exp(-(((R - 0.5e-3) / 0.4e-3) ** 2))
    above = functionals(kernel + change)[name]
    below = functionals(kernel - change)[name]
    expected = (above.value - below.value) / 2
    assert functionals(kernel)[name].row @ change == pytest.approx(expected, rel=0.05)


def test_kernel_changes_are_those_of_calibrations_with_another_film():
    scan = simulate(noise=0.002, seed=4)
    found = memscal.calibrate(scan, method="evidence").apparatus
    film = scan.set_up.film
    u = film.thickness_uncertainty or 0.0
    kernels = []
    logarithms = []
    k = round_wavenumbers(found.resolved_wavenumber)
    for thickness in (film.thickness + u, film.thickness - u):
        other = replace(scan, film=replace(film, thickness=thickness))
        of_other = memscal.calibrate(other, method="evidence").apparatus
        g = np.interp(found.radial_profile.r, of_other.radial_profile.r, of_other.radial_profile.g)
        kernels.append(of_other.conversion_constant / found.conversion_constant * g)
        transfer = hankel_transform(of_other.radial_profile.r, of_other.radial_profile.g, k)
        numbers = [of_other.gaussian_sigma, *(of_other.conversion_constant * transfer)]
        logarithms.append(np.log(numbers))
    difference = (kernels[0] - kernels[1]) / 2
    apart = found.kernel_changes["thickness"] - difference
    assert np.linalg.norm(apart) < 0.05 * np.linalg.norm(difference)
    assert found.shared_effects["thickness"][1:] == pytest.approx(
        (logarithms[0] - logarithms[1]) / 2, rel=0.1
    )
    budget = found.budget["conversion_constant"]
    shares = {source: abs(found.shared_effects[source][0]) for source in budget}
    assert shares == pytest.approx({s: u / found.conversion_constant for s, u in budget.items()})
    between = {("thickness", "poisson_ratio"): 0.5}
    correlated = memscal.calibrate(scan, correlations=between).apparatus
    assert not correlated.kernel_changes
    assert not correlated.shared_effects
