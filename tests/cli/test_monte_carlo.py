"""``memscal calibrate --monte-carlo``."""

from pathlib import Path

import pytest
from helpers.console import Run
from helpers.records import assert_same

import memscal


def test_draws_are_given_as_json_in_the_units_of_the_rest(run: Run, scan: Path):
    arguments = ("calibrate", scan, "--method", "evidence", "--monte-carlo", 20, "--seed", 4)
    found = run(*arguments, "--json").json["monte_carlo"]
    assert (found["draws"], found["seed"]) == (20, 4)
    assert {"noise", "thickness", "poisson_ratio", "rod_radius", "load"} < set(found["sources"])
    drawn = memscal.monte_carlo(memscal.calibrate(scan, method="evidence"), draws=20, seed=4)
    assert_same(found, drawn.to_dict(), rtol=1e-6)
    width, shown = drawn["gaussian_sigma"], found["parameters"]["gaussian_sigma"]
    assert (shown["unit"], shown["agrees"]) == ("mm", shown["reason"] == "")
    assert shown["standard_uncertainty"] == pytest.approx(width.uncertainty * 1e3, rel=1e-6)
    assert shown["interval_95"][0] < shown["value"] < shown["interval_95"][1]
    assert found["parameters"]["noise_equivalent_area"]["unit"] == "mm^2"


@pytest.mark.parametrize("draws", ["1", "0", "many", "-5"])
def test_a_number_of_draws_that_makes_no_sense_is_refused(run: Run, scan: Path, draws):
    run("calibrate", scan, f"--monte-carlo={draws}").exits(2, "--monte-carlo")
    assert not scan.with_suffix(".apparatus.h5").exists()
