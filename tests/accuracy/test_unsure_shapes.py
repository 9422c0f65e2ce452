"""Scans of clear signals whose shape is unsure: few places, and a wide flat top with tails.

Halves of a scan share film, load and the prior of G's form: they differ by noise and baseline.
Set MEMSCAL_FULL_STUDY for 60 scans of each kind in place of 3.
"""

import re
from dataclasses import replace

import numpy as np
import pytest
from helpers import outside
from helpers.bounds import FULL, root_mean_square, root_mean_square_range
from helpers.outside import Part, World

import memscal
from memscal import ElasticFilm, Rod, Scan

SEEDS = 60 if FULL else 3
CHANCE = 1e-5 if FULL else 1e-3
NUMBERS = ("conversion_constant", "gaussian_sigma", "fwhm")
WIDTH = 1.3e-3
SENSORS = {
    "Gaussian": (Part(width=(WIDTH, WIDTH)),),
    "disc": (Part(disc=2.2e-3),),
    "tails": (Part(0.85, width=(WIDTH, WIDTH)), Part(0.15, width=(2.5 * WIDTH, 2.5 * WIDTH))),
}
FILM = ElasticFilm(young_modulus=0.5e6, poisson_ratio=0.5, thickness=2.5e-3, law="linear")
PLACES = (np.arange(20) - 9.37) * 1e-3


def calibrated(scan, **given):
    return memscal.calibrate(scan, method="bayesian", other=False, **given).apparatus


def halves(scan):
    """Return every other place of a scan, and the others."""
    names = ("x", "u_zz", "u_zz_errors")
    return [replace(scan, **{n: getattr(scan, n)[i::2] for n in names}) for i in (0, 1)]


def few_places(kind, seed):
    world = World(load=1.0, radius=0.5e-3, thickness=2.5e-3, parts=SENSORS[kind])
    made = outside.scan(world, seed, noise=0.002, x=PLACES)
    return replace(made, load_uncertainty=None, indenter=Rod(radius=0.5e-3), film=FILM)


def flat_top(seed, decay):
    """Return a box of 24 mm whose tails decay over so many mm, and its integral over the slit."""
    x = np.arange(71) - 34.8
    fine = np.arange(-400, 400, 0.05)
    beyond = np.maximum(np.abs(fine) - 12, 0)
    u = np.interp(x, fine, np.convolve(np.exp(-beyond / decay), np.ones(50) / 50, "same"))
    noise = np.full(x.size, u.max() / 35)
    u = u + noise * np.random.default_rng(seed).standard_normal(x.size)
    scan = Scan(x=x * 1e-3, u_zz=u * 1e-3, u_zz_errors=noise * 1e-3, load=1.0)
    return scan, (24 + 2 * decay) / 2.5e3


def parts(found, *sources):
    return np.array([np.hypot(*(found.budget[name][s] for s in sources)) for name in NUMBERS])


@pytest.mark.parametrize("kind", SENSORS)
def test_halves_of_few_places_differ_by_noise_and_baseline_and_share_the_rest(kind):
    z = []
    errors = []
    shares = []
    for seed in range(SEEDS):
        found = [calibrated(half) for half in halves(few_places(kind, seed))]
        values = np.array([[each.parameters[name] for name in NUMBERS] for each in found])
        chance = [parts(each, "noise", "baseline_curvature") for each in found]
        z.append((values[0] - values[1]) / np.hypot(*chance))
        u = found[0].parameters.uncertainty("conversion_constant")
        errors.append((values[0, 0] - 1e-7) / u)
        shares.append(parts(found[0], "regularisation", "window") / chance[0])
        told = [m.text for m in found[0].process.messages if m.kind == "form_of_g"]
        mostly = (shares[-1] > 2)[[0, 2]]
        assert [f"% of {w} (" in "".join(told) for w in ("A", "the full width")] == [*mostly]
    least, most = root_mean_square_range(SEEDS, CHANCE)
    ratio = root_mean_square(z)
    # The width of a disc's Gaussian depends on the places: its line is misfit.
    compared = np.array([True, kind != "disc", True])
    assert (ratio > 0.45 * least)[compared].all()
    assert (ratio < 1.2 * most)[compared].all()
    assert np.mean(np.abs(errors) < 1.96) >= 0.95 - 0.25 * (not FULL)
    # What halves share is most of the uncertainty, above all of the full width.
    assert np.median(shares, axis=0)[2] > 2.5


@pytest.mark.parametrize("decay", [7.0, 8.0])
def test_a_clear_flat_top_is_given_with_its_uncertainty_or_refused_with_numbers(decay):
    given = []
    refusals = []
    for seed in range(SEEDS):
        scan, truth = flat_top(seed, decay)
        try:
            found = calibrated(scan, reference="slit:2.5mm")
        except memscal.MemscalError as refusal:
            refusals.append(str(refusal))
            continue
        a = found.parameters["conversion_constant"]
        u = found.parameters.uncertainty("conversion_constant")
        assert a > 3 * u
        given.append((a - truth) / u)
    for refusal in refusals:
        # What falls short is one of the numbers that stand before their limits.
        numbers = re.findall(r"([\d.]+) (?:standard uncertainties|of all)", refusal)
        limits = re.findall(r"at least ([\d.]+)", refusal)
        pairs = zip(numbers, limits, strict=True)
        assert min(float(number) / float(limit) for number, limit in pairs) <= 1.0
    assert len(given) >= 0.5 * SEEDS
    assert root_mean_square(given) < 2.0
