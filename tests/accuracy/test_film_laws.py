"""Film's law by scans at several loads, and its thickness: how often, and how surely, it is right.

Set MEMSCAL_FULL_STUDY for 200 seeds in place of 2.
"""

from dataclasses import replace

import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.direct import LOADS, Kernel, direct_scan
from helpers.scans import GAUSSIAN, TAILS
from scipy.stats import binom, chi2

import memscal
from memscal.model.film import LAWS
from memscal.simulation.rod_scan import PAPER_FILM

pytestmark = pytest.mark.accuracy

SEEDS, CHANCE = (200, 1e-5) if FULL else (2, 1e-3)
LINEAR, RUBBER = LAWS[:2]
DISC = memscal.SmoothedDisc(radius=0.9e-3, sigma=0.25e-3)
SENSORS: dict[str, Kernel] = {"Gaussian": GAUSSIAN, "disc": DISC, "tails": TAILS}
BALANCE = 0.01
"""Relative standard uncertainty of each load: scans are off by such an error each."""


def scans_of(
    law: str, sensor: str, seed: int, *, noise: float = 0.005,
    loads=LOADS, radii=(0.25e-3,), film: memscal.ElasticFilm = PAPER_FILM,
) -> list[memscal.Scan]:  # fmt: skip
    scans = []
    for i, (load, radius) in enumerate((load, radius) for load in loads for radius in radii):
        rng, kernel = np.random.default_rng([seed, i]), SENSORS[sensor]
        scan = direct_scan(
            kernel, noise=noise, seed=1000 * seed + i, load=load, radius=radius, law=law
        )
        off = {"u_zz": scan.u_zz * (1 + BALANCE * rng.normal()), "load_uncertainty": BALANCE * load}
        scans.append(replace(scan, **off, film=film, rod_friction=np.inf))
    return scans


@pytest.mark.parametrize("truth", [LINEAR, RUBBER])
@pytest.mark.parametrize("sensor", [*SENSORS][: None if FULL else 1])
def test_loads_prefer_the_law_of_the_film(sensor: str, truth: str) -> None:
    factors = []
    for seed in range(SEEDS):
        made = memscal.calibrate(scans_of(truth, sensor, seed), method="bayesian").to_dict()
        below = {law["law"]: law["log_evidence_below_best"] for law in made["film_laws"]}
        factors.append(
            below[LINEAR] - below[RUBBER] if truth == RUBBER else below[RUBBER] - below[LINEAR]
        )
    wrong, strongly = (int(np.sum(np.array(factors) < limit)) for limit in (0.0, -3.0))
    assert wrong <= binom.isf(CHANCE, SEEDS, 0.05)
    assert strongly <= binom.isf(CHANCE, SEEDS, 0.01)


@pytest.mark.parametrize("sensor", [*SENSORS][: None if FULL else 1])
@pytest.mark.parametrize(("law", "setting"), [
    (RUBBER, {}), (LINEAR, {"loads": (1.0,), "radii": (0.15e-3, 0.35e-3)}),
][: None if FULL else 1])  # fmt: skip
def test_an_estimated_thickness_is_off_by_what_it_states(law: str, setting, sensor: str) -> None:
    # What is stated is drawn about the truth: of both, the difference is all that counts.
    u, truth, deviates, left = 0.1e-3, PAPER_FILM.thickness, [], []
    for seed in range(SEEDS):
        stated = truth + u * np.random.default_rng(seed).normal()
        film = replace(PAPER_FILM, law=law, thickness=stated, thickness_uncertainty=u)
        scans = scans_of(law, sensor, seed, film=film, **setting)
        estimated = memscal.calibrate(scans, method="bayesian", free="thickness").apparatus.film
        deviates.append((estimated.thickness - truth) / estimated.thickness_uncertainty)
        left.append(estimated.thickness_uncertainty / u)
    assert np.median(left) < 1.0
    ratio = np.sqrt(np.mean(np.square(deviates)))
    assert ratio < 1.2 * np.sqrt(chi2.isf(CHANCE, SEEDS) / SEEDS)
