"""The calibration over many scans: error of G and A by division, bands, both routes, the fit.

The scans come from another forward calculation than the analysis: the base stress by finite
elements, convolved with G on a raster of the plane.  Set MEMSCAL_FULL_STUDY for 200 seeds in
place of 6, of a Gaussian 24.  With --log-cli-level=INFO the study tells medians, mean errors,
coverage, and what scikit-image's Wiener filter, tuned on the truth, makes of the same scans.
"""

import logging
from dataclasses import replace
from functools import lru_cache
from zlib import crc32

import numpy as np
import pytest
from helpers.bounds import FULL, cramer_rao, root_mean_square_limit
from helpers.estimation_study import least_median
from helpers.peers import tuned_wiener
from helpers.scans import CENTRE, CONVERSION, EXACT_FILM, EXACT_ROD, RING, SIGMA, TAILS

from helpers.scans import added_ring, plane_error, simulated  # isort: skip
from scipy.interpolate import make_interp_spline
from scipy.signal import fftconvolve
from scipy.stats import binom, chi2, f

import memscal

pytestmark = pytest.mark.accuracy
LOG = logging.getLogger(__name__)

WIENER_SEEDS = 24 if FULL else 4
CHANCE = 1e-5 if FULL else 1e-3  # of fewer seeds, so that what is wrong by much is still found
R = np.linspace(0.0, 3e-3, 121)
NOISES = (0.001, 0.005, 0.02)
DISC = memscal.SmoothedDisc(radius=0.8e-3, sigma=0.3e-3)
WIDTHS = {0.001: 0.56e-3, 0.005: 0.56e-3, 0.02: 0.70e-3}

# Largest median of the relative error of G over the plane; rms of the error of A.
G_LIMITS = {
    "Gaussian": (0.06, 0.145, 0.15), "disc": (0.15, 0.15, 0.23), "tails": (0.15, 0.16, 0.26),
    "ring": (0.30, 0.30, 0.30),
}  # fmt: skip
A_LIMITS = (0.003, 0.015, 0.045)
KINDS = [(kind, noise) for kind in G_LIMITS for noise in NOISES]


def kernel_of(kind: str, noise: float) -> memscal.RadialKernel:
    others = {"disc": DISC, "tails": TAILS, "ring": RING}
    return others.get(kind) or memscal.GaussianMixture((1.0,), (WIDTHS[noise],))


def raster(step: float = 62.5e-6, pixels: int = 208) -> tuple[np.ndarray, np.ndarray]:
    """Axis of a raster of the plane and the distances of its points, in m."""
    axis = step * np.arange(-pixels, pixels + 1)
    return axis, np.hypot.outer(axis, axis)


@lru_cache
def stress_by_elements() -> np.ndarray:
    r = np.arange(0.0, 20e-3, 25e-6)
    stress = memscal.indent(EXACT_FILM, EXACT_ROD, load=1.0, backend="fem").base_stress(r)
    even = np.append(-r[:0:-1], r), np.append(stress[:0:-1], stress)
    return np.asarray(make_interp_spline(*even, k=5)(raster()[1]))


@lru_cache
def departure(kernel: memscal.RadialKernel) -> np.ndarray:
    """Voltages by direct convolution less those of the simulation by transforms, in V."""
    axis, distance = raster()
    image = kernel.radial(distance.ravel()).reshape(distance.shape)
    middle = fftconvolve(stress_by_elements(), image, mode="same")[axis.size // 2]
    usual = simulated(kernel=kernel, noise=0.0, baseline=0.0, drift=0.0)
    voltage = CONVERSION * middle * (axis[1] - axis[0]) ** 2
    difference = make_interp_spline(axis, voltage, k=5)(usual.x - CENTRE) - usual.u_zz
    # Two calculations that share nothing but the film agree far below the least noise.
    assert np.abs(difference).max() < 1e-5 * usual.u_zz.max()
    return np.asarray(difference)


def scan_of(kind: str, noise: float, seed: int) -> memscal.Scan:
    kernel = kernel_of(kind, noise)
    # The noise of a Gaussian sensor's scans is not stated: it is found from their scatter.
    options = {"state_noise": kind != "Gaussian", "seed": crc32(f"{kind} {noise}".encode()) + seed}
    scan = simulated(kernel=kernel, noise=noise, **options)
    return replace(scan, u_zz=scan.u_zz + departure(kernel))


def seeds_of(kind: str) -> int:
    return 200 if FULL else 24 if kind == "Gaussian" else 5


def agreement(apparatus: memscal.ApparatusFunction) -> memscal.QualityCheck:
    return next(check for check in apparatus.checks if check.name == "method_agreement")


@lru_cache
def study(kind: str, noise: float) -> dict[str, np.ndarray]:
    """Errors and stated uncertainties of every seed's scan, by the default method."""
    truth, rows = kernel_of(kind, noise).radial(R), []
    for seed in range(seeds_of(kind)):
        scan = scan_of(kind, noise, seed)
        apparatus = memscal.calibrate(scan).apparatus
        p, error = apparatus.parameters, apparatus.radial(R) - truth
        truths = {"baseline": scan.synthetic["baseline"], "centre": CENTRE}
        rows.append({
            "error": error, "g": plane_error(R, apparatus.radial(R), truth),
            "a": p["conversion_constant"] / CONVERSION - 1,
            "u": p.uncertainty("conversion_constant") / CONVERSION,
            "fit": [p["conversion_constant_gaussian"] / CONVERSION, p["gaussian_sigma"]],
            "u_fit": [p.uncertainty("conversion_constant_gaussian") / CONVERSION,
                      p.uncertainty("gaussian_sigma")],
            "nuisances": [(p[n] - truth) / p.uncertainty(n) for n, truth in truths.items()],
            "covered": np.mean(np.abs(error) <= 1.96 * apparatus.radial_uncertainty(R)),
            "agreement": agreement(apparatus).value,
        })  # fmt: skip
    columns = {name: np.array([row[name] for row in rows]) for name in rows[0]}
    a, mean = columns["a"], columns["error"].mean(axis=0)
    told = (
        kind, noise, np.median(columns["g"]), plane_error(R, truth + mean, truth),
        columns["covered"].mean(), np.sqrt(np.mean(a**2)), a.mean(),
        np.sqrt(np.mean((a / columns["u"]) ** 2)), columns["agreement"].max(),
    )  # fmt: skip
    LOG.info(
        "%s, noise %.3f: G median %.3f, mean error %.3f, covered %.3f; A rms %.4f, mean %+.4f, "
        "error over uncertainty %.2f; largest difference of the routes %.2f", *told
    )  # fmt: skip
    return columns


@pytest.mark.parametrize(("kind", "noise"), KINDS)
def test_g_and_a_are_found_and_a_is_as_uncertain_as_stated(kind: str, noise: float) -> None:
    columns, place, seeds = study(kind, noise), NOISES.index(noise), seeds_of(kind)
    assert least_median(columns["g"]) <= G_LIMITS[kind][place]
    a, u = columns["a"], columns["u"]
    assert np.sqrt(np.mean(a**2)) < root_mean_square_limit(A_LIMITS[place], seeds, CHANCE)
    assert np.sqrt(np.mean((a / u) ** 2)) < root_mean_square_limit(1.15, seeds, CHANCE)
    # What is systematic: of A less than its stated uncertainty, of G what window and spline hide.
    assert abs(a.mean()) < (0.6 + 5 / np.sqrt(seeds)) * np.sqrt(np.mean(u**2))
    truth = kernel_of(kind, noise).radial(R)
    mean = plane_error(R, truth + columns["error"].mean(axis=0), truth)
    assert mean <= max(columns["g"])


@pytest.mark.parametrize("noise", NOISES)
def test_the_fit_reaches_its_bound_and_states_what_it_scatters_by(noise: float) -> None:
    columns, seeds = study("Gaussian", noise), seeds_of("Gaussian")
    truth = [1.0, WIDTHS[noise]]
    error, stated = columns["fit"] / truth - 1, columns["u_fit"] / truth
    bound = cramer_rao(noise, sigma=WIDTHS[noise])
    limit = root_mean_square_limit(1.1, seeds, CHANCE)
    assert (np.sqrt(np.mean(error**2, axis=0)) < limit * np.array(bound)).all()
    # The bound is what an efficient estimate truly scatters by, free of sampling error.
    assert np.sqrt(np.mean(stated**2, axis=0)) == pytest.approx(bound, rel=0.15)
    low, high = np.sqrt(chi2.isf([1 - CHANCE, CHANCE], seeds) / seeds)
    scatter = np.sqrt(np.mean((error / stated) ** 2, axis=0))
    assert (low / 1.15 < scatter).all()
    assert (scatter < high * 1.15).all()
    nuisances = np.sqrt(np.mean(columns["nuisances"] ** 2, axis=0))
    assert (nuisances < root_mean_square_limit(1.15, seeds, CHANCE)).all()


def test_the_bands_of_95_percent_hold_g_pooled_over_all_cases() -> None:
    covered = np.array([study(*case)["covered"].mean() for case in KINDS])
    scatter = [study(*case)["covered"].std(ddof=1) for case in KINDS]
    spread = [s / np.sqrt(seeds_of(case[0])) for s, case in zip(scatter, KINDS, strict=True)]
    chance = 4 * np.linalg.norm(spread) / len(KINDS)
    assert 0.90 - chance < covered.mean() < 0.99 + chance


def test_a_is_nearer_than_that_of_a_wiener_filter_tuned_on_the_truth() -> None:
    for noise in NOISES:
        kernel, rows = kernel_of("Gaussian", noise), []
        for seed in range(WIENER_SEEDS):
            g, a = tuned_wiener(scan_of("Gaussian", noise, seed), kernel)
            rows.append((plane_error(R, g, kernel.radial(R)), a / CONVERSION - 1))
        g, a = np.array(rows).T
        theirs, columns = np.sqrt(np.mean(a**2)), study("Gaussian", noise)
        LOG.info("Wiener, noise %.3f: G median %.3f, A rms %.4f", noise, np.median(g), theirs)
        luck = np.sqrt(f.isf(CHANCE, seeds_of("Gaussian"), WIENER_SEEDS))
        assert np.sqrt(np.mean(columns["a"] ** 2)) < theirs * (1.0 if FULL else luck)
        assert least_median(columns["g"]) < 1.4 * np.median(g)


def test_two_routes_to_one_scan_agree_but_for_one_good_scan_in_a_thousand() -> None:
    differences = np.concatenate([study(*case)["agreement"] for case in KINDS])
    limit = agreement(memscal.calibrate(simulated()).apparatus).limit
    failed = int(np.sum(differences > limit))
    LOG.info("%d of %d scans differ by more than %g", failed, differences.size, limit)
    assert binom.sf(failed - 1, differences.size, 1e-3) > 1e-3


def test_a_ring_that_only_the_division_follows_is_told() -> None:
    scans = [scan_of("Gaussian", 0.001, seed) for seed in range(6)]
    ringed = [added_ring(scan, 0.01, 4e-3, 0.7e-3) for scan in scans]
    values = [agreement(memscal.calibrate(scan).apparatus) for scan in ringed]
    assert np.median([check.value for check in values]) > values[0].limit


def test_a_raster_scatters_by_no_more_than_is_stated() -> None:
    deviates = []
    seeds = range(50 if FULL else 6)  # a raster costs as much as twenty lines
    for seed in seeds:
        scan = simulated(raster=True, points=25, seed=seed, centre=(0.3e-3, -0.2e-3))
        p = memscal.calibrate(scan).apparatus.parameters
        truths = {"conversion_constant": CONVERSION, "gaussian_sigma": SIGMA, "centre_y": -0.2e-3}
        deviates.append([(p[n] - truth) / p.uncertainty(n) for n, truth in truths.items()])
    scatter = np.sqrt(np.mean(np.square(deviates), axis=0))
    assert (scatter < root_mean_square_limit(1.15, len(seeds), CHANCE)).all()


PASSES = 200 if FULL else 10


def of_repeats(noise: float, seed: int, shift: float, **options) -> memscal.ApparatusFunction:
    """Calibrate with three passes over a Gaussian sensor, which moves from one to the next."""
    passes = [scan_of("Gaussian", noise, 3 * seed + i) for i in range(3)]
    moved = [scan.x + i * shift for scan, i in zip(passes, (-1, 0, 1), strict=True)]
    u, number = np.concatenate([scan.u_zz for scan in passes]), np.repeat([0, 1, 2], 65)
    scan = replace(passes[0], x=np.concatenate(moved), u_zz=u, repeat=number)
    return memscal.calibrate(scan, **options).apparatus


def test_repeats_that_share_their_centre_are_told_apart_as_rarely_as_is_said() -> None:
    found = [of_repeats(0.005, seed, 0.0).process.configuration["centre"] for seed in range(PASSES)]
    own = sum(choice["choice"] == "per-repeat" for choice in found)
    assert own <= binom.ppf(1 - CHANCE, PASSES, 1e-3)
    low, high = binom.ppf([CHANCE, 1 - CHANCE], PASSES, 0.4)
    assert low <= sum(choice["p_value"] < 0.4 for choice in found) <= high


def test_repeats_that_moved_have_centres_of_their_own_within_their_uncertainties() -> None:
    shift, names = 40e-6, ("conversion_constant_gaussian", "gaussian_sigma", "centre", "centre_3")
    truths = np.array([CONVERSION, WIDTHS[0.005], CENTRE - shift, CENTRE + shift])
    deviates = []
    for seed in range(PASSES):
        own, one = (of_repeats(0.005, seed, shift, centre=choice) for choice in (None, "common"))
        p = own.parameters
        assert own.process.configuration["centre"]["choice"] == "per-repeat"
        deviates.append([(p[n] - t) / p.uncertainty(n) for n, t in zip(names, truths, strict=True)])
        # With one centre the flanks of the others count as noise and outliers.
        assert p.uncertainty(names[0]) < 0.8 * one.parameters.uncertainty(names[0])
        assert "repeat_centres" in {check.name for check in one.checks if not check.passed}
    squares = np.sum(np.square(deviates), axis=0)
    low, high = chi2.isf([1 - CHANCE, CHANCE], PASSES)
    assert np.all((low < squares) & (squares < high))


def test_one_centre_for_repeats_that_moved_blurs_the_gaussian() -> None:
    shift, choices = 100e-6, ("common", "per-repeat")
    pairs = [[of_repeats(0.02, s, shift, centre=c) for c in choices] for s in range(PASSES)]
    widened = [one.gaussian_sigma - own.gaussian_sigma for one, own in pairs]
    blur = np.hypot(WIDTHS[0.02], shift * np.sqrt(2 / 3)) - WIDTHS[0.02]
    error = np.std(widened, ddof=1) / np.sqrt(PASSES)
    assert max(4 * error, blur - 4 * error) < np.mean(widened) < blur + 4 * error
