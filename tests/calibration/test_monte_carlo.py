from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scans import RING, TAILS, simulated
from scipy.special import ndtr

import memscal
from memscal.calibration.draw_blocks import DrawModel, drawn_results
from memscal.calibration.input_draws import InputDraws, ReferenceTable
from memscal.calibration.procedure import Calibration
from memscal.calibration.replicate_results import REPLICATED
from memscal.laboratory.rod_scan import PAPER_FILM, PAPER_ROD
from memscal.mechanics.indent import indent

KERNELS = {"gaussian": None, "tails": TAILS, "ring": RING}


def calibrated(method: str = "evidence", seed: int = 3, **options: object) -> Calibration:
    return memscal.calibrate(simulated(**({"noise": 0.004} | options), seed=seed), method=method)


def uncertain(**options: object) -> Calibration:
    """The paper's film and rod, with their uncertainties."""
    given = {"film": PAPER_FILM, "rod": PAPER_ROD, "load_uncertainty": 0.01} | options
    return calibrated(**given)


@pytest.fixture(scope="module")
def paper() -> Calibration:
    return uncertain()


@pytest.mark.parametrize("method", ["evidence", "white-noise"])
@pytest.mark.parametrize("kernel", KERNELS)
def test_the_measured_voltages_give_the_calibration(kernel: str, method: str) -> None:
    calibration = calibrated(method, kernel=KERNELS[kernel])
    model = DrawModel.of(calibration)
    scalars, g = model.results.read(model.estimator.fit(model.measured[None]))
    parameters = calibration.apparatus.parameters
    wanted = [parameters[name] for name in REPLICATED]
    np.testing.assert_allclose(scalars[0], wanted, rtol=2e-3)
    profile = calibration.apparatus.radial_profile
    np.testing.assert_allclose(g[0], profile.g, atol=2e-3 * profile.g.max())


@pytest.mark.parametrize("kernel", KERNELS)
def test_draws_of_noise_scatter_as_calibrations_of_scans_do(kernel: str) -> None:
    calibration = calibrated(kernel=KERNELS[kernel], repeats=2)
    found = memscal.monte_carlo(calibration, draws=600)
    model = DrawModel.of(calibration)
    scan, scans = calibration.solution.scan, 40
    values = []
    for draw in np.random.default_rng(1).standard_normal((scans, model.voltages.size)):
        u = (model.voltages + model.noise_root @ draw).reshape(scan.u_zz.shape)
        apparatus = memscal.calibrate(replace(scan, u_zz=u), method="evidence").apparatus
        values.append([apparatus.parameters[name] for name in REPLICATED])
    # Of 40 scans, a standard deviation is known to 11 %: three times that, and the draws' own.
    spread = np.std(values, axis=0, ddof=1) / found.samples.std(axis=0, ddof=1)
    assert np.all(np.abs(np.log(spread)) < 0.4)
    error = found.samples.std(axis=0) * np.sqrt(1 / scans + 1 / 600)
    assert np.all(np.abs(np.mean(values, axis=0) - found.samples.mean(axis=0)) < 4 * error)


def test_a_budget_of_noise_is_that_of_draws_where_the_estimate_is_linear() -> None:
    found = memscal.monte_carlo(calibrated(noise=0.001), draws=1000)
    for name in ("conversion_constant", "gaussian_sigma", "noise_equivalent_area"):
        assert found[name].agrees, found[name].reason
        assert found[name].ratio == pytest.approx(1.0, abs=0.12)
    assert found.sources == ("noise", "reference_force", "reference_convergence")


def test_small_inputs_are_propagated_as_the_budget_has_them() -> None:
    # Small enough to be linear: half a percent of the thickness, well away from nu = 1/2.
    film = replace(
        PAPER_FILM, poisson_ratio=0.45, thickness_uncertainty=3e-5, poisson_ratio_uncertainty=4e-3
    )
    rod = replace(PAPER_ROD, radius_uncertainty=2e-5)
    calibration = uncertain(film=film, rod=rod, noise=0.0005)
    found = memscal.monte_carlo(calibration, draws=1500)
    model = DrawModel.of(calibration)
    alone = drawn_results(model, 1500, 0, only="noise")[0]
    for source in ("thickness", "poisson_ratio", "rod_radius", "load"):
        both = drawn_results(model, 1500, 0, only=source)[0]
        for i, name in enumerate(REPLICATED[:2]):
            first_order = calibration.apparatus.budget[name][source]
            spread = float(np.std(both[:, i] - alone[:, i]))
            # Below a tenth of the whole, an input changes it by half a percent at the most.
            allowed = 0.1 * found[name].first_order
            assert spread == pytest.approx(first_order, rel=0.1, abs=allowed), (source, name)


def test_the_reference_in_between_is_that_of_its_own_film_and_rod() -> None:
    film = replace(PAPER_FILM, thickness_uncertainty=1e-4, poisson_ratio_uncertainty=0.02)
    rod = replace(PAPER_ROD, radius_uncertainty=2e-5)
    solution = uncertain(film=film, rod=rod).solution
    reference = solution.estimate.model.reference
    table = ReferenceTable.of(solution.scan, reference)
    rng = np.random.default_rng(0)
    standard = {name: rng.standard_normal(20) for name in table.sources}
    found = table.drawn(standard, 20)
    values = {name: table.quantiles(name, ndtr(draws)) for name, draws in standard.items()}
    for i, change in enumerate(found):
        place = {name: float(drawn[i]) for name, drawn in values.items()}
        changed = replace(film, thickness=place["thickness"], poisson_ratio=place["poisson_ratio"])
        contact = indent(changed, replace(rod, radius=place["rod_radius"]), load=1.0)
        exact = contact.base_spectrum(reference.wavenumbers.k) - reference.values
        # It is one at k = 0; five percent of thickness change it by 0.05.
        assert np.abs(change - exact).max() < 5e-5
        assert changed.poisson_ratio <= 0.5


def test_poissons_ratio_never_exceeds_one_half_and_the_reason_says_so() -> None:
    film = replace(
        PAPER_FILM,
        poisson_ratio_uncertainty=0.02,
        thickness_uncertainty=None,
        young_modulus_uncertainty=None,
    )
    calibration = uncertain(film=film, load_uncertainty=None, noise=0.001)
    found = memscal.monte_carlo(calibration, draws=800)
    width = found["gaussian_sigma"]
    # Half of a normal distribution has 0.603 of its standard deviation.
    assert width.ratio == pytest.approx(0.603, abs=0.1)
    assert not width.agrees
    assert "cut off at 0.5" in width.reason
    assert not found.agrees


@pytest.mark.parametrize("block", [1, 7, 1000])
def test_draws_do_not_depend_on_their_blocks(paper: Calibration, block: int) -> None:
    model = DrawModel.of(paper)
    whole = drawn_results(model, 20, seed=4)
    parts = drawn_results(model, 20, seed=4, block=block)
    for one, other in zip(whole, parts, strict=True):
        np.testing.assert_allclose(other, one, rtol=1e-9, atol=1e-9 * np.abs(one).max())


def test_draws_do_not_depend_on_the_number_of_processes(paper: Calibration) -> None:
    one = memscal.monte_carlo(paper, draws=1001, seed=8)
    two = memscal.monte_carlo(paper, draws=1001, seed=8, workers=2)
    np.testing.assert_allclose(two.samples, one.samples, rtol=1e-9)
    np.testing.assert_allclose(two.g_mean, one.g_mean, rtol=1e-9)


def test_another_seed_gives_other_draws_of_the_same_spread(paper: Calibration) -> None:
    one, two = (memscal.monte_carlo(paper, draws=500, seed=seed) for seed in (1, 2))
    assert not np.any(one.samples == two.samples)
    for a, b in zip(one.comparisons, two.comparisons, strict=True):
        error = np.hypot(a.sampling_error / a.uncertainty, b.sampling_error / b.uncertainty)
        assert abs(np.log(a.uncertainty / b.uncertainty)) < 4 * error


def test_more_draws_begin_with_the_same(paper: Calibration) -> None:
    few, many = (memscal.monte_carlo(paper, draws=draws) for draws in (5, 60))
    np.testing.assert_allclose(many.samples[:5], few.samples, rtol=1e-9)


def test_intervals_hold_their_share_of_the_draws(paper: Calibration) -> None:
    found = memscal.monte_carlo(paper, draws=1000)
    for i, each in enumerate(found.comparisons):
        for low, high in (each.symmetric, each.shortest):
            held = np.mean((found.samples[:, i] >= low) & (found.samples[:, i] <= high))
            assert held == pytest.approx(0.95, abs=0.002)
        # Quantiles fall between draws, the shortest interval ends at two of them.
        assert np.ptp(each.shortest) <= 1.02 * np.ptp(each.symmetric)
    low, high = found.g_symmetric
    inside = (found.g_mean >= low) & (found.g_mean <= high)
    assert inside.all()


def test_what_regularisation_hides_is_said_not_to_scatter() -> None:
    found = memscal.monte_carlo(calibrated(noise=0.01), draws=200)
    width = found["fwhm"]
    assert width.first_order < width.stated
    (hidden,) = [m for m in found.messages if m.kind == "regularisation"]
    assert "fwhm" in hidden.text


def test_correlated_inputs_are_drawn_together() -> None:
    scan = simulated(film=PAPER_FILM, rod=PAPER_ROD, load_uncertainty=0.01, noise=0.003)
    together = memscal.calibrate(scan, method="evidence", correlations={("thickness", "load"): 0.9})
    model = DrawModel.of(together)
    normal = np.random.default_rng(0).standard_normal((4000, len(model.inputs.sources)))
    drawn = model.inputs.standardised(normal)
    # Of 4000 draws a correlation of 0.9 is known to 0.003.
    assert np.corrcoef(drawn["thickness"], drawn["load"])[0, 1] == pytest.approx(0.9, abs=0.012)
    assert abs(np.corrcoef(drawn["thickness"], drawn["rod_radius"])[0, 1]) < 0.07


def test_a_models_form_is_a_rectangle() -> None:
    drawn = InputDraws.of(["model_form"], {}).standardised(
        np.random.default_rng(0).standard_normal((5000, 1))
    )["model_form"]
    assert np.abs(drawn).max() <= np.sqrt(3)
    assert drawn.std() == pytest.approx(1.0, abs=0.03)


def test_several_scans_are_drawn_together() -> None:
    scans = [
        simulated(film=PAPER_FILM, rod=PAPER_ROD, load_uncertainty=0.01, noise=0.004, seed=s)
        for s in (1, 2)
    ]
    found = memscal.monte_carlo(memscal.calibrate(scans, method="evidence"), draws=400)
    assert found["conversion_constant"].ratio == pytest.approx(1.0, abs=0.2)
    assert any(message.kind == "first_order" for message in found.messages)


def test_inputs_without_uncertainty_leave_noise_alone() -> None:
    calibration = replace(calibrated(), effects={})
    found = memscal.monte_carlo(calibration, draws=50)
    assert found.sources == ("noise",)
    assert any(message.kind == "uncertainty_unstated" for message in found.messages)
    assert "50 draws of noise" in repr(found)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"draws": 1}, "draws is 1"),
        ({"draws": 2.5}, "draws is 2.5"),
        ({"seed": -1}, "seed is -1"),
        ({"workers": 0}, "workers is 0"),
        ({"workers": 1.5}, "workers is 1.5"),
    ],
)
def test_numbers_that_make_no_sense_are_refused(
    paper: Calibration, options: dict[str, object], named: str
) -> None:
    with pytest.raises(memscal.MemscalError, match=named):
        memscal.monte_carlo(paper, **options)


def test_a_method_that_is_not_linear_is_refused() -> None:
    with pytest.raises(memscal.MemscalError, match="richardson-lucy"):
        memscal.monte_carlo(calibrated("richardson-lucy"))


def test_a_raster_is_refused() -> None:
    with pytest.raises(memscal.MemscalError, match="lattice"):
        memscal.monte_carlo(calibrated(raster=True, points=17))


def test_unstated_noise_outliers_and_missing_points_are_drawn_as_they_were_weighed() -> None:
    scan = simulated(noise=0.004, state_noise=False, seed=6)
    u = scan.u_zz.copy()
    u[10], u[30] = np.nan, u[30] + 0.3 * np.nanmax(u)
    found = memscal.monte_carlo(
        memscal.calibrate(replace(scan, u_zz=u), method="evidence"), draws=500
    )
    assert found["gaussian_sigma"].ratio == pytest.approx(1.0, abs=0.15)
    assert any(message.kind == "outlier" for message in found.messages)


def test_a_parameter_that_is_not_drawn_is_named(paper: Calibration) -> None:
    with pytest.raises(memscal.MemscalError, match="centre is not drawn"):
        memscal.monte_carlo(paper, draws=5)["centre"]
