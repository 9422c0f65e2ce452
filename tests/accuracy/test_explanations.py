"""What explains a failed check of the Gaussian: the true cause is named, and G where it is that.

Set MEMSCAL_FULL_STUDY for 20 seeds at 0.1 and 0.5 % of noise in place of one at 0.1 %.
"""

from dataclasses import replace

import pytest
from helpers.bounds import FULL, RARE
from helpers.direct import direct_scan
from helpers.outside import FILM, ROUND, Part
from helpers.outside import scan as perturbed_scan
from helpers.scans import GAUSSIAN
from scipy.stats import binom

import memscal
from memscal.calibration.explanations import MISFITS

SEEDS = 20 if FULL else 1
NOISES = (0.001, 0.005) if FULL else (0.001,)
NAMED = 0.9
"""Share of the scans that fail whose cause is named."""


def of(**other):
    """Scans of a world that is perturbed in one way."""
    world = replace(ROUND, **other)
    return lambda seed, **noise: perturbed_scan(world, seed, **noise)


def of_film(law, stated):
    """Scans at 1 N of a film of one law that states another, or none."""

    def scan(seed, *, noise, noise_stated):
        made = direct_scan(GAUSSIAN, law=law, noise=noise, seed=seed)
        errors = made.u_zz_errors if noise_stated else None
        return replace(made, film=replace(FILM, law=stated), u_zz_errors=errors)

    return scan


CAUSES = {
    "poisson_ratio": (of(poisson_ratio=0.45), of(poisson_ratio=0.40)),
    "thickness": (of(thickness=1.9e-3), of(thickness=2.2e-3)),
    "stage_scale": (of(stage_scale=1.05), of(stage_scale=0.95)),
    "film_law": (of_film("neo-hookean", "linear"), of_film("linear", "")),
    "baseline_curvature": (of(parabola=0.01), of(parabola=0.02)),
    "gain_curvature": (of(gain_curvature=0.05), of(gain_curvature=0.10)),
    "lag": (of(lag=0.2e-3), of(lag=0.4e-3)),
}
#: Scans of a curved baseline whose curvature is fitted need not fail.
PASSING = ("baseline_curvature",)


def parts(weight, core, wide):
    """Scans by a G of a core and tails, of widths in m."""
    return of(parts=(Part(weight, (core, core)), Part(1 - weight, (wide, wide))))


SENSORS = {
    "disc": of(parts=(Part(width=(0.25e-3, 0.25e-3), disc=0.9e-3),)),
    "tails": parts(0.8, 0.45e-3, 1.1e-3),
    "few tails": parts(0.9, 0.5e-3, 1.5e-3),
}
UNLISTED = {
    "base_slip": of(base_slip=0.5),
    "cosine": of(cosine=0.01),
    "step": of(step=0.02),
    "shear_sensitivity": of(shear_sensitivity=0.3e-3),
}


def failing(scans):
    """Calibrations in which a check fails, of noise that is stated and that is not."""
    found = []
    for made in scans:
        for noise in NOISES:
            for i in range(2 * SEEDS):
                scan = made(i // 2, noise=noise, noise_stated=bool(i % 2))
                result = memscal.calibrate(scan, other=False)
                failed = {check.name for check in result.apparatus.checks if not check.passed}
                if failed & {*MISFITS}:
                    found.append(result)
    return found


def named(result):
    """Names of what explains a scan, the best first."""
    return [row["name"] for row in result.to_dict()["explanations"] if row["named"]]


@pytest.mark.parametrize("cause", CAUSES)
def test_the_true_cause_is_among_those_named(cause):
    found = failing(CAUSES[cause])
    hits = [cause in named(result) for result in found]
    assert hits or cause in PASSING
    # Fewer only by chance, if nine of ten are named.
    assert binom.cdf(sum(hits), len(hits), NAMED) > RARE**0.5
    if FULL:
        assert sum(hits) >= NAMED * len(hits)
    for result in found:
        first, second = result.answer().splitlines()[:2]  # the film's law may follow
        assert not first.startswith("Use")
        assert "not settled" in first or not named(result)
        assert second.endswith("or by a cause that is not listed.")


@pytest.mark.parametrize("sensor", SENSORS)
def test_a_g_that_is_not_gaussian_is_named_first(sensor):
    found = failing([SENSORS[sensor]])
    hits = ["The scan is explained by a G that is not" in result.answer() for result in found]
    assert found
    assert binom.cdf(sum(hits), len(hits), NAMED) > RARE**0.5


@pytest.mark.parametrize("cause", UNLISTED)
def test_a_cause_that_is_not_listed_is_left_open(cause):
    for result in failing([UNLISTED[cause]]):
        text = result.answer()
        assert "or by a cause that is not listed" in text
        assert not text.startswith("Use")
