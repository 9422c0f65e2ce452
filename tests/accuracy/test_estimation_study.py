"""The estimator over many kernels, scans and noise draws: errors of G and A, truth of its bands.

Set MEMSCAL_FULL_STUDY for all cases of docs/estimation.md and 200 seeds in place of 12.  Its table
says which limits a case does not keep; no other may be exceeded, and no other kind may be listed.
"""

import runpy
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest
from helpers.bounds import FULL, root_mean_square_limit
from helpers.estimation_study import (
    BANDS,
    CASES,
    EFFICIENCY,
    MEAN_COVERAGE,
    REDUCED,
    SEEDS,
    chance,
    half_width,
    mean_coverage,
    mean_efficiency,
    study,
)
from scipy.stats import norm

import memscal

pytestmark = pytest.mark.accuracy

DOCS = Path(__file__).parent.parent.parent / "docs"
NAMES = list(CASES) if FULL else REDUCED

ADMITTED = {
    "Gaussian": {"worst"}, "disc": {"error of G", "worst"},
    "mixture": {"worst", "bias of A", "band of A"}, "ring": set(),
}  # fmt: skip
"""What the table may say that a kind of kernel does not keep."""


@lru_cache
def stated() -> list[list[str]]:
    """Cells of the rows of the cases that stand in docs/estimation.md."""
    text = (DOCS / "estimation.md").read_text(encoding="utf-8")
    rows = [line for line in text.splitlines() if line.startswith("|")]
    (first,) = (i for i, line in enumerate(rows) if line == script()["HEAD"][0])
    assert rows[first + 1] == script()["HEAD"][1]
    return [
        [cell.strip() for cell in line.split("|")[1:-1]]
        for line in rows[first + 2 : first + 2 + len(CASES)]
    ]


@lru_cache
def script() -> dict[str, object]:
    return runpy.run_path(str(DOCS / "estimation_table.py"))


def not_kept(name: str) -> set[str]:
    """Limits that the table says the case does not keep."""
    return set(filter(None, stated()[list(CASES).index(name)][-1].split(", ")))


def test_the_table_has_the_cases_of_the_study() -> None:
    setting = script()["setting"]
    assert [row[:5] for row in stated()] == [setting(case) for case in CASES.values()]
    for name, case in CASES.items():
        assert not_kept(name) <= ADMITTED[case.label.split()[0]]


@pytest.mark.full_study
@pytest.mark.parametrize("name", REDUCED)
def test_the_table_is_what_its_script_prints(name: str) -> None:
    printed = [cell.strip() for cell in script()["row"](study(name)).split("|")[1:-1]]
    for ours, theirs in zip(printed[5:-1], stated()[list(CASES).index(name)][5:-1], strict=True):
        # Another processor may round differently, and a seed cross a limit by it.
        numbers = [[float(x) for x in cell.split("(")[0].split()] for cell in (ours, theirs)]
        assert numbers[0] == pytest.approx(numbers[1], rel=0.01, abs=0.0101)


@pytest.mark.parametrize("name", NAMES)
def test_a_case_keeps_the_limits_that_it_is_said_to_keep(name: str) -> None:
    assert study(name).exceeded() <= not_kept(name)


@pytest.mark.parametrize("band", BANDS)
def test_bands_of_95_percent_hold_the_truth_often_enough(band: str) -> None:
    # Those of G, A and FWHM hold it more often than the limit says: docs/estimation.md.
    share, error = mean_coverage([study(name) for name in NAMES], band)
    assert share + norm.isf(chance(SEEDS)) * error > MEAN_COVERAGE[0]


def test_the_band_of_a_gaussian_width_is_not_too_wide() -> None:
    share, error = mean_coverage([study(name) for name in NAMES], "σ")
    assert share - norm.isf(chance(SEEDS)) * error < MEAN_COVERAGE[1]


def test_departures_that_are_allowed_for_cost_a_gaussian_little_of_a() -> None:
    ratio, count = mean_efficiency([study(name) for name in NAMES])
    assert ratio < root_mean_square_limit(EFFICIENCY, count, chance(SEEDS))


def test_the_seeds_of_two_cases_have_no_noise_in_common() -> None:
    first, second = list(CASES.values())[:2]
    drawn = {case.scan(seed).synthetic["seed"] for case in (first, second) for seed in range(3)}
    assert len(drawn) == 6


@pytest.mark.parametrize("sigma", [0.45e-3, 0.75e-3])
def test_the_true_width_at_half_maximum_is_that_of_a_gaussian(sigma: float) -> None:
    width = half_width(memscal.GaussianMixture((1.0,), (sigma,)))
    assert width == pytest.approx(2 * np.sqrt(2 * np.log(2)) * sigma, rel=1e-9)
