from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.scans import EXACT_FILM, EXACT_ROD, LINEAR_FILM, TAILS, shear_scan, simulated
from scipy.linalg import toeplitz

import memscal
from memscal.calibration.uncertainty import BUDGETED
from memscal.deconvolution.division import create_regulariser
from memscal.errors import FitError
from memscal.extensions.monte_carlo.monte_carlo import DrawnScans, shortest_interval
from memscal.extensions.simulation.rod_scan import PAPER_FILM, PAPER_ROD

DRAWS = 100 if FULL else 40


def uncertain(**options):
    """The paper's film and rod, with their uncertainties."""
    stated = {"film": PAPER_FILM, "rod": PAPER_ROD, "load_uncertainty": 0.01, "noise": 0.004}
    return memscal.calibrate(simulated(**(stated | options), seed=3), method="evidence")


def drawn_scans(calibration, seed=0):
    return DrawnScans(calibration.solution, calibration.effects, calibration.correlations, seed)


def spread_limit(draws):
    """Relative error of a standard deviation of normal draws, exceeded once in 16,000."""
    return 4.0 / np.sqrt(2 * draws)


@pytest.fixture(scope="module")
def paper():
    return uncertain()


@pytest.fixture(scope="module")
def forty(paper):
    return memscal.monte_carlo(paper, draws=40, seed=8)


def correlated(scan):
    near = toeplitz(0.4 ** np.arange(scan.x.size))
    return replace(scan, u_zz_correlation=near, x_errors=np.full(scan.x.size, 2e-5))


def incomplete(scan):
    u = scan.u_zz.copy()
    u[30] += 0.3 * np.nanmax(u)
    u[10] = np.nan
    return replace(scan, u_zz=u, position_scale_uncertainty=0.002)


LINE = {"film": PAPER_FILM, "rod": PAPER_ROD, "noise": 0.004}
THICKER = replace(PAPER_FILM, thickness=2.2e-3)
CASES = {
    "evidence": ([simulated(**LINE)], {"method": "evidence"}),
    "white-noise": ([simulated(**LINE)], {"method": "white-noise"}),
    "white-noise-draw": ([simulated(**LINE, points=33)], {"method": "white-noise-draw", "seed": 3}),
    "tikhonov": ([simulated(**LINE)], {"method": "tikhonov"}),
    "wiener": ([simulated(**LINE, kernel=TAILS)], {"method": "wiener"}),
    "raster": ([simulated(**LINE, raster=True, points=11)], {}),
    "loads": ([simulated(**LINE, load=[0.5, 1.0], repeats=2)], {"method": "evidence"}),
    "films": ([simulated(**LINE), simulated(**(LINE | {"film": THICKER}), seed=1)], {}),
    "correlated noise": ([correlated(simulated(**LINE))], {"method": "evidence"}),
    "outlier and gap": ([incomplete(simulated(**LINE, state_noise=False))], {}),
    "tangential": ([shear_scan(seed=11)], {"method": "evidence", "channel": "xz"}),
    "reference": (
        [simulated(**(LINE | {"film": LINEAR_FILM}))],
        {"reference": memscal.indent(EXACT_FILM, EXACT_ROD, load=1.0).profile()},
    ),
}


BY_NIGHT = {"white-noise-draw": pytest.mark.full_study}


@pytest.mark.parametrize("case", [pytest.param(c, marks=BY_NIGHT.get(c, ())) for c in CASES])
def test_a_draw_is_what_calibrate_says_of_the_drawn_scan(case):
    scans, options = CASES[case]
    calibration = memscal.calibrate(list(scans), **options)
    found = memscal.monte_carlo(calibration, draws=2, seed=5)
    redrawn = drawn_scans(calibration, seed=5).draw(1)
    # A scan at several loads is drawn as one scan for each load.
    assert list(dict.fromkeys(s.film for s in redrawn)) == [scan.film for scan in scans]
    again = memscal.calibrate(redrawn, **options).apparatus
    values = [again.parameters[name] for name in BUDGETED]
    np.testing.assert_allclose(found.samples[1], values, rtol=1e-9)
    assert np.abs(found.samples[1] / found.samples[0] - 1).max() > 1e-4


TRUTHS = {
    "thickness": {"film": replace(EXACT_FILM, poisson_ratio=0.45, thickness=2.03e-3)},
    "poisson_ratio": {"film": replace(EXACT_FILM, poisson_ratio=0.465)},
    "rod_radius": {"rod": replace(EXACT_ROD, radius=0.265e-3)},
    "load": {"load": 1.03},
    "position_scale": {"half_range": 8e-3 * 1.003, "centre": (0.14e-3 * 1.003, 0.0)},
}


@pytest.mark.parametrize("source", TRUTHS)
def test_voltages_of_a_draw_are_those_of_the_true_inputs(source):
    uncertainties = {"thickness_uncertainty": 1e-5, "poisson_ratio_uncertainty": 0.005}
    film = replace(EXACT_FILM, poisson_ratio=0.45, **uncertainties)
    quiet = {"noise": 1e-6, "baseline": 0.0, "drift": 0.0}
    stated = {"film": film, "rod": replace(EXACT_ROD, radius_uncertainty=5e-6)} | quiet
    scan = replace(simulated(**stated, load_uncertainty=0.01), position_scale_uncertainty=1e-3)
    model = drawn_scans(memscal.calibrate(scan, method="evidence"))
    standard = dict.fromkeys(model.effects, np.asarray(0.0))
    change = model.voltages(standard | {source: np.asarray(3.0)}) - model.voltages(standard)
    truth = simulated(**(stated | TRUTHS[source])).u_zz - scan.u_zz
    assert np.abs(change - truth).max() < 0.02 * np.abs(truth).max()


# The noise-equivalent area squares the noise of G, of which a division has more.
@pytest.mark.parametrize(
    ("method", "number"),
    [
        ("evidence", "noise_equivalent_area"),
        pytest.param("white-noise", "gaussian_sigma_deconvolved", marks=pytest.mark.full_study),
    ],
)
def test_a_budget_of_noise_is_that_of_draws_where_the_estimate_is_linear(method, number):
    # A curved baseline lets some draws be read as tails of G, by a jump.
    scan = replace(simulated(noise=0.001, seed=3), baseline_curvature_uncertainty=0.0)
    calibration = memscal.calibrate(scan, method=method)
    found = memscal.monte_carlo(calibration, draws=DRAWS)
    for name in ("conversion_constant", "gaussian_sigma", number):
        assert found[name].agrees, found[name].reason
        assert found[name].ratio == pytest.approx(1.0, abs=spread_limit(DRAWS))
    core = found.r < 1e-3
    ratio = found.g_uncertainty[core] / found.g_first_order[core]
    assert np.median(ratio) == pytest.approx(1.0, abs=spread_limit(DRAWS))


def test_a_budget_counts_that_poissons_ratio_never_exceeds_one_half():
    film = replace(EXACT_FILM, poisson_ratio_uncertainty=0.02)
    calibration = uncertain(film=film, rod=EXACT_ROD, load_uncertainty=None, noise=1e-4)
    found = memscal.monte_carlo(calibration, draws=40)
    width = found["gaussian_sigma"]
    # By the mean and the standard deviation of half a normal distribution.
    assert width.ratio == pytest.approx(1.0, rel=spread_limit(40))
    assert abs(width.mean - width.value) < 4 * width.first_order / np.sqrt(40)
    assert width.agrees


def test_draws_do_not_depend_on_the_number_of_processes(paper, forty):
    told = []
    options = {"seed": 8, "workers": 2, "progress": told.append}
    two = memscal.monte_carlo(paper, draws=18, **options)
    np.testing.assert_allclose(two.samples, forty.samples[:18], rtol=1e-9)
    other = memscal.monte_carlo(paper, draws=2, seed=9).samples
    assert not np.any(other == forty.samples[:2])
    done = [progress.done for progress in told]
    assert done == sorted(done)
    assert len(done) > 2
    assert (told[-1].task, told[-1].done, told[-1].total) == ("draws", 18, 18)


def test_intervals_hold_their_share_of_the_draws(forty):
    for i, comparison in enumerate(forty.comparisons):
        for low, high in (comparison.symmetric, comparison.shortest):
            held = np.mean((forty.samples[:, i] >= low) & (forty.samples[:, i] <= high))
            assert held == pytest.approx(0.95, abs=1.1 / 40)
    # Of normal draws 1 / sqrt(2 M), known itself to 19 %.
    errors = [c.sampling_error / c.uncertainty for c in forty.comparisons]
    assert np.median(errors) == pytest.approx(1 / np.sqrt(80), rel=0.57)
    low, high = forty.g_symmetric
    assert ((forty.g_mean >= low) & (forty.g_mean <= high))[forty.r < 3e-3].all()


def test_the_shortest_interval_of_a_skewed_distribution_is_to_one_side():
    draws = -np.log(1 - (np.arange(10_000) + 0.5) / 10_000)
    np.testing.assert_allclose(shortest_interval(draws), [0.0, -np.log(0.05)], atol=0.01)


def test_correlated_inputs_are_drawn_together_and_a_models_form_is_a_rectangle():
    scan = simulated(film=LINEAR_FILM, rod=PAPER_ROD, load_uncertainty=0.01, noise=0.003)
    film = replace(LINEAR_FILM, poisson_ratio=0.45)
    other = replace(memscal.indent(film, PAPER_ROD, load=1.0).profile(), film=None)
    options = {"alternative": other, "correlations": {("thickness", "load"): 0.9}}
    together = memscal.calibrate(scan, method="evidence", **options)
    normal = np.random.default_rng(0).standard_normal((len(together.effects), 4000))
    drawn = drawn_scans(together).standardised(normal)
    # Of 4000 draws a correlation of 0.9 is known to 0.003.
    assert np.corrcoef(drawn["thickness"], drawn["load"])[0, 1] == pytest.approx(0.9, abs=0.012)
    assert abs(np.corrcoef(drawn["thickness"], drawn["rod_radius"])[0, 1]) < 0.07
    assert np.abs(drawn["model_form"]).max() <= np.sqrt(3)
    assert drawn["model_form"].std() == pytest.approx(1.0, abs=0.04)


def test_outliers_are_drawn_again_and_noise_alone_is_said_to_be():
    found = memscal.monte_carlo(replace(uncertain(noise=0.004), effects={}), draws=3)
    assert found.sources == ("noise", "baseline_curvature")
    assert [m.kind for m in found.messages][:1] == ["uncertainty_unstated"]
    assert "3 draws of noise, baseline_curvature" in repr(found)
    messy = memscal.calibrate(incomplete(simulated(noise=0.004)), method="evidence")
    found = memscal.monte_carlo(messy, draws=25)
    assert found["gaussian_sigma"].ratio == pytest.approx(1.0, abs=spread_limit(25))
    assert "outlier" in [m.kind for m in found.messages]


class Failing:
    """White noise that refuses the divisions with these numbers."""

    name = "failing"
    fails = "It fails."

    def __init__(self):
        self.method = create_regulariser("white-noise")
        self.refused = range(0)
        self.divisions = 0

    def divide(self, problem):
        self.divisions += 1
        if self.divisions in self.refused:
            raise FitError("This one is refused.")
        return self.method.divide(problem)


def test_draws_that_fail_are_left_out_and_told():
    method = Failing()
    calibration = memscal.calibrate(simulated(), method=method)
    method.refused = range(method.divisions + 4, method.divisions + 6)
    found = memscal.monte_carlo(calibration, draws=5)
    assert len(found.samples) == 3
    assert "2 of 5 draws could not be calibrated" in found.messages[-1].text
    assert "This one is refused" in found.messages[-1].text
    method.refused = range(10**6)
    with pytest.raises(FitError, match="4 of 4 draws"):
        memscal.monte_carlo(calibration, draws=4)


@pytest.mark.parametrize(
    ("options", "named"),
    [
        ({"draws": 1}, "draws .* is 1"),
        ({"draws": 2.5}, "draws .* is 2.5"),
        ({"seed": -1}, "seed .* is -1"),
        ({"workers": 0}, "workers is 0"),
    ],
)
def test_numbers_that_make_no_sense_are_refused(paper, options, named):
    with pytest.raises(memscal.MemscalError, match=named):
        memscal.monte_carlo(paper, **options)


def test_a_parameter_that_is_not_drawn_is_named(forty):
    with pytest.raises(memscal.MemscalError, match="centre is not drawn"):
        forty["centre"]
