from pathlib import Path

import pytest
from helpers.console import Run

import memscal


def test_draws_are_given_as_json_in_the_units_of_the_rest(run: Run, scan: Path):
    arguments = ("calibrate", scan, "--method", "evidence", "--monte-carlo", 80, "--seed", 4)
    found = run(*arguments, "--json").json["monte_carlo"]
    assert (found["draws"], found["seed"]) == (80, 4)
    assert found["sources"][0] == "noise"
    assert {"thickness", "poisson_ratio", "rod_radius", "load"} < set(found["sources"])
    width = found["parameters"]["gaussian_sigma"]
    calibration = memscal.calibrate(memscal.read_scan(scan), method="evidence")
    drawn = memscal.monte_carlo(calibration, draws=80, seed=4)["gaussian_sigma"]
    assert width["unit"] == "mm"
    assert width["standard_uncertainty"] == pytest.approx(drawn.uncertainty * 1e3, rel=1e-6)
    assert width["first_order"] == pytest.approx(drawn.first_order * 1e3, rel=1e-6)
    low, high = width["interval_95"]
    assert low < width["value"] < high
    assert width["agrees"] is (width["reason"] == "")
    assert found["parameters"]["noise_equivalent_area"]["unit"] == "mm^2"


@pytest.mark.parametrize("draws", ["1", "0", "many", "-5"])
def test_a_number_of_draws_that_makes_no_sense_is_refused(run: Run, scan: Path, draws):
    run("calibrate", scan, f"--monte-carlo={draws}").exits(2, "--monte-carlo")
    assert not scan.with_suffix(".apparatus.h5").exists()
