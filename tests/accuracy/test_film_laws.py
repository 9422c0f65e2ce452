"""Film's law by scans at several loads, and its thickness: how often, and how surely, it is right.

They run with MEMSCAL_FULL_STUDY; tests/calibration/test_joint.py weighs laws and finds a thickness
in scans without noise each day.
"""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import root_mean_square, root_mean_square_range
from helpers.direct import LOADS, RATIO, direct_scan
from helpers.scans import GAUSSIAN, TAILS
from scipy.stats import binom, norm

import memscal
from memscal.extensions.simulation.rod_scan import PAPER_FILM
from memscal.model.film import LAWS

pytestmark = pytest.mark.full_study

SEEDS = 200
CHANCE = 1e-5
LINEAR, RUBBER, MOONEY = LAWS
DISC = memscal.SmoothedDisc(radius=0.9e-3, sigma=0.25e-3)
SENSORS = {"Gaussian": GAUSSIAN, "disc": DISC, "tails": TAILS}
BALANCE = 0.01
"""Relative standard uncertainty of each load: scans are off by such an error each."""


def scans_of(
    law,
    sensor,
    seed,
    *,
    noise=0.005,
    loads=LOADS,
    radii=(0.25e-3,),
    film=PAPER_FILM,
):
    scans = []
    for i, (load, radius) in enumerate((load, radius) for load in loads for radius in radii):
        rng = np.random.default_rng([seed, i])
        kernel = SENSORS[sensor]
        rod = {"load": load, "radius": radius, "law": law}
        scan = direct_scan(kernel, noise=noise, seed=1000 * seed + i, **rod)
        off = {"u_zz": scan.u_zz * (1 + BALANCE * rng.normal()), "load_uncertainty": BALANCE * load}
        scans.append(replace(scan, **off, film=film, rod_friction=np.inf))
    return scans


@pytest.mark.parametrize("truth", [LINEAR, RUBBER, MOONEY])
@pytest.mark.parametrize("sensor", [*SENSORS])
def test_loads_prefer_the_law_of_the_film(sensor, truth):
    # Mooney-Rivlin is weighed where it is stated, and hardly told from neo-Hookean.
    stated = {"law": truth, "mooney_rivlin_ratio": RATIO} if truth == MOONEY else {}
    other = RUBBER if truth == LINEAR else LINEAR
    factors = []
    for seed in range(SEEDS):
        scans = scans_of(truth, sensor, seed, film=replace(PAPER_FILM, **stated))
        made = memscal.calibrate(scans, method="bayesian").to_dict()["film_laws"]
        below = {law["law"]: law["log_evidence_below_best"] for law in made}
        factors.append([below[law] - below[truth] for law in (other, *below) if law != truth])
    wrong = np.sum(np.array(factors)[:, 0] < 0)
    strongly = np.sum(np.min(factors, axis=1) < -3)
    assert wrong <= binom.isf(CHANCE, SEEDS, 0.05)
    assert strongly <= binom.isf(CHANCE, SEEDS, 0.01)


@pytest.mark.parametrize("sensor", [*SENSORS])
@pytest.mark.parametrize(
    ("law", "setting"),
    [
        (RUBBER, {}),
        (LINEAR, {"loads": (1.0,), "radii": (0.15e-3, 0.35e-3)}),
    ],
)
def test_an_estimated_thickness_is_off_by_what_it_states(law, setting, sensor):
    # What is stated is drawn about the truth: of both, the difference is all that counts.
    u = 0.1e-3
    truth = PAPER_FILM.thickness
    rows = []
    for seed in range(SEEDS):
        film = replace(PAPER_FILM, law=law, thickness_uncertainty=u)
        uncertainties = u, film.young_modulus_uncertainty
        h, e = np.random.default_rng(seed).normal([truth, film.young_modulus], uncertainties)
        stated = replace(film, thickness=h, young_modulus=e)
        scans = scans_of(law, sensor, seed, film=stated, **setting)
        estimated = memscal.calibrate(scans, method="bayesian", free="thickness").apparatus.film
        rows.append([estimated.thickness - truth, estimated.thickness_uncertainty])
    error, left = np.transpose(rows)
    assert np.median(left) < u
    # Of one sensor the mean is off by its shape, of all sensors of the prior it is not.
    bias = {"Gaussian": 0.2, "disc": 0.7, "tails": 0.7}[sensor]
    assert abs(np.mean(error / left)) < bias + norm.isf(CHANCE) / np.sqrt(SEEDS)
    low, high = (0.6, 1.3) * root_mean_square_range(SEEDS, CHANCE)
    assert low < root_mean_square(error / left) < high
