"""Several scans of one sensor, fitted together; correlated noise, positions, and inputs."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import (
    FULL,
    assert_as_stated,
    cramer_rao,
    root_mean_square,
    root_mean_square_range,
)
from helpers.scans import (
    CONVERSION,
    EXACT_FILM,
    EXACT_ROD,
    SIGMA,
    TAILS,
    as_points,
    simulate,
    simulated,
)

import memscal
from memscal import StressSensor
from memscal.errors import InputError

SEEDS = 60 if FULL else 12
LOW, HIGH = root_mean_square_range(SEEDS, 1e-5)


def joint(scans, method="bayesian", **options):
    return memscal.calibrate(scans, method=method, **options).apparatus


def several(noise, seed=0, **options):
    """Scans at other loads, with another rod, on another film."""
    thin = replace(EXACT_FILM, thickness=1.5e-3, name="thin")
    thick = replace(EXACT_FILM, name="thick")
    wide = replace(EXACT_ROD, radius=0.5e-3)
    common = {"noise": noise, "state_noise": noise > 0} | options
    return [
        simulated(film=thick, load=1.0, centre=(0.14e-3, 0.0), seed=seed, **common),
        simulated(film=thick, load=0.4, centre=(-0.3e-3, 0.0), seed=seed + 1000, **common),
        simulated(film=thin, rod=wide, load=0.7, points=45, seed=seed + 2000, **common),
    ]


def test_without_noise_scans_of_other_loads_rods_and_films_give_one_answer():
    apparatus = joint(several(0.0))
    assert apparatus.conversion_constant == pytest.approx(CONVERSION, rel=1e-5)
    assert apparatus.gaussian_sigma == pytest.approx(SIGMA, rel=1e-5)
    assert apparatus.parameters["centre_2"] == pytest.approx(-0.3e-3, abs=1e-8)


def test_a_joint_fit_is_surer_than_each_of_its_scans_and_between_them():
    scans = several(0.005)
    together = joint(scans)
    alone = [joint([scan]) for scan in scans]
    for name in ("conversion_constant_gaussian", "gaussian_sigma"):
        weights = np.array([a.parameters.uncertainty(name) for a in alone]) ** -2
        values = np.array([a.parameters[name] for a in alone])
        # With nuisances of its own in every scan, the fits combine as independent measurements.
        combined = weights.sum() ** -0.5
        assert together.parameters.uncertainty(name) < 1.1 * min(weights**-0.5)
        assert abs(together.parameters[name] - weights @ values / weights.sum()) < combined


def assert_a_is_as_stated(parameters, bounds):
    """Assert that A is right to what it states, which is at the bound of separate scans."""
    name = "conversion_constant"
    combined = sum(bound[name] ** -2 for bound in bounds) ** -0.5
    assert_as_stated(parameters, {name: CONVERSION}, {name: combined})


def test_the_division_joins_scans_of_other_loads_rods_and_films():
    name = "conversion_constant"
    rows = []
    # An uncertainty varies with the draw, by which shapes of G a scan leaves open.
    for seed in (0, 10, 20):
        scans = several(0.005, seed=seed)
        groups = [scans, *([scan] for scan in scans)]
        found = [joint(group, "white-noise").parameters for group in groups]
        bounds = []
        for scan in scans:
            size = {"film": scan.film, "rod": scan.indenter, "load": scan.load}
            bounds.append(cramer_rao(0.005, points=scan.x.size, **size))
        assert_a_is_as_stated(found[0], bounds)
        rows.append([parameters.uncertainty(name) for parameters in found])
    together, *alone = np.mean(rows, axis=0)
    assert together < min(alone)


def test_lines_and_a_raster_are_fitted_together():
    raster = simulated(raster=True, points=15, noise=0.003, centre=(0.2e-3, -0.1e-3), kernel=TAILS)
    apparatus = joint([simulated(noise=0.003, kernel=TAILS), raster])
    setting = {"raster": True, "points": 15, "centre": (0.2e-3, -0.1e-3)}
    bounds = [cramer_rao(0.003, kernel=TAILS, **scan) for scan in ({}, setting)]
    assert_a_is_as_stated(apparatus.parameters, bounds)
    assert apparatus.parameters["centre_y_2"] == pytest.approx(-0.1e-3, abs=0.02e-3)


def test_scans_of_other_sensors_or_of_films_that_contradict_are_refused():
    one, two, _ = several(0.003)
    with pytest.raises(InputError, match="2 sensors: a simulated sensor"):
        joint([one, replace(two, sensor=StressSensor(name="another"))])
    other = replace(two, film=replace(two.film, thickness=2.1e-3))
    with pytest.raises(InputError, match="name their film 'thick', but give it a thickness of 2"):
        joint([one, other])
    with pytest.raises(InputError, match="Some of the scans state their noise"):
        joint([one, replace(two, u_zz_errors=None)])
    with pytest.raises(InputError, match="no scan"):
        joint([])


SOURCES = ("noise", "regularisation", "window", "baseline_curvature", "misfit")


def moved_repeats():
    """Three passes over a sensor that moves between them."""
    points = as_points(simulate(repeats=3, points=33, noise=0.003, seed=4))
    return replace(points, x=points.x + 40e-6 * points.repeat)


def test_repeats_with_centres_of_their_own_stay_one_scan_in_budget_file_and_draws(tmp_path):
    path = tmp_path / "scan.h5"
    memscal.write_scan(moved_repeats(), path)
    own, common = (memscal.calibrate(path, centre=centre) for centre in (None, "common"))
    for apparatus in (own.apparatus, common.apparatus):
        budget = apparatus.budget["conversion_constant"]
        assert set(budget) == {*SOURCES, *common.effects}
        # At finite strain a share of the load is a little more of A, and a little of the width.
        assert 0.01 < budget["load"] / apparatus.conversion_constant < 0.011
        assert 0 < apparatus.budget["gaussian_sigma"]["load"] < 0.002 * apparatus.gaussian_sigma
    own.apparatus.save(tmp_path / "sensor.h5")
    saved = memscal.load_apparatus(tmp_path / "sensor.h5")
    parameters = saved.parameters
    process = saved.process
    assert parameters["centre_3"] - parameters["centre"] == pytest.approx(80e-6, abs=1e-5)
    assert process.input_scan.file_name == "scan.h5"
    assert process.configuration["centre"]["chosen_by"] == "test"
    assert "further_scans" not in process.configuration
    assert "up to 8" in next(m.text for m in process.messages if m.kind == "repeat_centres")
    assert saved.passed
    names = {check.name for check in saved.checks}
    assert "held_out_repeat" in names
    assert not {"held_out_scan", "repeat_centres"} & names
    # Drawn as one line about the first centre, by points that no line joins.
    assert saved.reconvolution.x.min() < -7.9e-3
    drawn = memscal.monte_carlo(own, draws=4)
    assert drawn.sources == ("noise", "baseline_curvature", *common.effects)


@pytest.mark.parametrize(
    ("bad", "words"),
    [
        ({"repeat": None}, "one repeat"),
        ({"u_zz_correlation": 0.7 * np.eye(99) + 0.3}, "one repeat with that of another"),
        ({"u_zz": np.where(np.arange(99) < 90, np.nan, 1e-3)}, "Repeat [123] has [1-5] measured"),
    ],
)
def test_a_centre_for_each_repeat_needs_repeats_that_stand_alone(bad, words):
    with pytest.raises(InputError, match=words):
        memscal.calibrate(replace(moved_repeats(), **bad), centre="per-repeat")


def test_films_of_other_names_count_for_themselves_and_a_shared_film_once():
    scans = several(0.003)
    uncertain = [replace(s, film=replace(s.film, thickness_uncertainty=2e-5)) for s in scans]
    budget = joint(uncertain).budget["gaussian_sigma"]
    assert {"thickness", "thickness_2"} <= set(budget)
    assert "thickness_3" not in budget


def correlated(scan, seed, reach=0.4e-3):
    """The scan with noise that forgets itself over a distance."""
    apart = np.abs(np.subtract.outer(scan.x, scan.x))
    correlation = 0.9 * np.exp(-apart / reach) + 0.1 * np.eye(scan.x.size)
    draw = np.linalg.cholesky(correlation) @ np.random.default_rng(seed).normal(size=scan.x.size)
    errors = np.full_like(scan.x, 0.005 * np.ptp(scan.u_zz))
    u = scan.u_zz + errors * draw
    return replace(scan, u_zz=u, u_zz_errors=errors, u_zz_correlation=correlation)


def test_noise_that_is_correlated_is_weighed_as_such():
    clean = simulated(noise=0.0)
    stated = []
    naive = []
    for seed in range(SEEDS):
        scan = correlated(clean, seed)
        for scans, found in ((scan, stated), (replace(scan, u_zz_correlation=None), naive)):
            p = joint([scans]).parameters
            name = "gaussian_sigma"
            found.append(((p[name] - SIGMA) / p.uncertainty(name), p[name] - SIGMA))
    stated = np.array(stated)
    naive = np.array(naive)
    assert LOW / 1.1 < root_mean_square(stated[:, 0]) < HIGH * 1.1
    assert np.std(stated[:, 1]) < np.std(naive[:, 1])


@pytest.mark.parametrize(
    ("correlation", "words"),
    [
        (np.ones((65, 65)), "not positive definite"),
        (np.eye(65) * 2, "not one on its diagonal"),
        (np.eye(60), r"should be \(65, 65\)"),
        (np.full((65, 65), np.nan), "finite"),
    ],
)
def test_a_correlation_that_no_noise_can_have_is_refused(correlation, words):
    with pytest.raises(InputError, match=words):
        replace(simulated(), u_zz_correlation=correlation)


def test_correlated_inputs_combine_as_their_correlation_says():
    film = replace(EXACT_FILM, thickness_uncertainty=2e-5, poisson_ratio_uncertainty=0.005)
    scan = simulated(film=film, noise=0.002)
    pair = ("thickness", "poisson_ratio")
    budgets = {r: joint([scan], correlations={pair: r}) for r in (-1.0, 0.0, 1.0)}
    u = {r: a.parameters.uncertainty("gaussian_sigma") for r, a in budgets.items()}
    parts = budgets[0.0].budget["gaussian_sigma"]
    assert u[1.0] ** 2 + u[-1.0] ** 2 == pytest.approx(2 * u[0.0] ** 2)
    assert abs(u[1.0] ** 2 - u[0.0] ** 2) == pytest.approx(2 * parts[pair[0]] * parts[pair[1]])
    for r, apparatus in budgets.items():
        squares = np.array(list(apparatus.budget["gaussian_sigma"].values()))
        assert np.sum(np.copysign(squares**2, squares)) == pytest.approx(u[r] ** 2)


@pytest.mark.parametrize(("correlations", "words"), [
    ({("thickness", "weather"): 0.5}, "'thickness' and 'weather'"),
    ({("thickness", "poisson_ratio"): 1.5}, "outside -1 to 1"),
    ({("thickness", "poisson_ratio"): 0.9, ("thickness", "load"): 0.9,
      ("poisson_ratio", "load"): -0.9}, "contradict each other"),
])  # fmt: skip
def test_correlations_that_cannot_be_are_refused(correlations, words):
    with pytest.raises(InputError, match=words):
        memscal.calibrate(memscal.simulate(), correlations=correlations)


def test_several_loads_weigh_the_laws_of_the_film_and_one_does_not():
    scans = [simulated(load=load, noise=0.005, seed=i) for i, load in enumerate((0.2, 0.6))]
    made = memscal.calibrate(scans, method="bayesian")
    best, other = made.to_dict()["film_laws"]
    assert (best["law"], best["is_reference"]) == ("linear", True)
    assert best["conversion_constant"]["value"] == pytest.approx(
        1e3 * made.apparatus.conversion_constant
    )
    assert (other["law"], other["best_against_it"]) == ("neo-hookean", "very strong")
    [message] = [m for m in made.apparatus.process.messages if m.kind == "film_laws"]
    assert message.severity == "note"
    assert "film_laws" not in memscal.calibrate(scans[:1]).to_dict()


UNSURE = replace(EXACT_FILM, thickness_uncertainty=0.1e-3)


@pytest.mark.parametrize(
    ("film", "loads", "radii", "words"),
    [
        (UNSURE, (1.0, 0.5), (0.25e-3, 0.25e-3), "proportion to the load"),
        (EXACT_FILM, (1.0, 1.0), (0.15e-3, 0.35e-3), "no uncertainty of its thickness"),
    ],
)
def test_a_thickness_that_the_scans_do_not_determine_is_not_freed(film, loads, radii, words):
    rods = (replace(EXACT_ROD, radius=radius) for radius in radii)
    scans = [simulated(film=film, rod=rod, load=p) for rod, p in zip(rods, loads, strict=True)]
    with pytest.raises(InputError, match=words):
        memscal.calibrate(scans, free="thickness")


def test_a_thickness_that_rods_determine_is_the_posterior_of_what_is_stated():
    film = replace(UNSURE, thickness=2.05e-3)
    rods = [replace(EXACT_ROD, radius=radius) for radius in (0.15e-3, 0.4e-3)]
    scans = [replace(simulated(rod=rod, noise=0.002, seed=3), film=film) for rod in rods]
    made = memscal.calibrate(scans, free="thickness", method="bayesian")
    [row] = made.to_dict()["free"]["thickness"]
    assert row["prior"] == {"value": pytest.approx(2.05), "standard_uncertainty": 0.1, "unit": "mm"}
    u = row["posterior"]["standard_uncertainty"]
    assert abs(row["posterior"]["value"] - 2.0) < 4 * u
    assert u < 0.1
    assert made.apparatus.film.thickness * 1e3 == pytest.approx(row["posterior"]["value"])
    assert made.apparatus.budget["gaussian_sigma"]["thickness"] > 0
