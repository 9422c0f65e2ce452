"""What a calibration takes for granted: listed with sizes, counted where it is stated."""

import json
from dataclasses import replace

import numpy as np
import pytest
from helpers.outside import ROUND, A, World, elliptic
from helpers.outside import scan as outside_scan

import memscal
from memscal.errors import InputError
from memscal.model.scan import STATED_ERRORS

SIZES = {
    "position_scale": 0.005,
    "gain": 0.01,
    "gain_curvature": 0.02,
    "roundness": 0.03,
    "line_offset": 0.1e-3,
    "base_slip": 0.05,
    "baseline_curvature": 0.002,
    "shear_sensitivity": 0.03e-3,
}


def stated(**sizes):
    uncertainties = {f"{name}_uncertainty": size for name, size in sizes.items()}
    return replace(outside_scan(ROUND, 1), **uncertainties)


def by_name(apparatus):
    return {assumption.name: assumption for assumption in apparatus.assumptions}


def states_of(apparatus):
    return {name: assumption.state for name, assumption in by_name(apparatus).items()}


def text_of(apparatus):
    return " ".join(message.text for message in apparatus.process.messages)


def test_every_statement_has_a_size_here():
    assert set(SIZES) == set(STATED_ERRORS)


@pytest.mark.parametrize("name", [name for name in SIZES if name != "baseline_curvature"])
def test_what_is_stated_is_in_the_budget_by_its_size_for_one_uncertainty(name):
    free = memscal.calibrate(stated()).apparatus
    counted = memscal.calibrate(stated(**{name: SIZES[name]})).apparatus
    line = counted.budget["conversion_constant"][name]
    listed = by_name(free)
    u = free.parameters.uncertainty("conversion_constant")
    if name == "gain":
        assert line == pytest.approx(SIZES[name] * counted.conversion_constant, rel=1e-6)
        return
    assumption = listed["stage_scale" if name == "position_scale" else name]
    assert assumption.state == "assumed"
    share = SIZES[name] / assumption.sizes["conversion_constant"]
    expected = 2**0.5 * share**2 if name == "line_offset" else share
    assert line == pytest.approx(expected * u, rel=0.05)
    states = states_of(counted)
    assert states[assumption.name] == "stated"


def test_a_curved_baseline_is_fitted_with_a_prior_and_counts():
    name = "baseline_curvature"
    lines = []
    uncertainties = []
    for size in (None, 0.002, 0.0):
        found = memscal.calibrate(stated(baseline_curvature=size)).apparatus
        states = states_of(found)
        assert states[name] == ("assumed" if size is None else "stated")
        # Held straight, there is nothing to fit.
        assert (name in found.parameters.names) == (size != 0)
        lines.append(found.budget["conversion_constant"][name])
        uncertainties.append(found.parameters.uncertainty("conversion_constant"))
    assert min(lines[:2]) > lines[2] == 0
    assert uncertainties[0] > uncertainties[1] > uncertainties[2]


def test_a_true_curvature_of_one_deviation_moves_a_result_by_its_line():
    """By scans without noise that states half a percent, of another forward calculation."""
    found = []
    for parabola in (0.0, 0.005):
        world = replace(ROUND, parabola=parabola)
        scan = replace(outside_scan(world, 1), u_zz=world.voltages(stated().x))
        found.append(memscal.calibrate(scan, method="bayesian").apparatus)
    straight, curved = found
    for name in ("conversion_constant", "gaussian_sigma"):
        moved = abs(curved.parameters[name] - straight.parameters[name])
        assert straight.budget[name]["baseline_curvature"] == pytest.approx(moved, rel=0.1)
    top = ROUND.voltages(stated().x).max()
    u = straight.parameters.uncertainty("baseline_curvature")
    assert u < 0.005 * top
    assert abs(curved.parameters["baseline_curvature"] - 0.005 * top) < u


def test_the_mean_of_an_offset_is_corrected():
    u = 0.3e-3
    # By Gauss-Hermite quadrature over offsets, from whose sign nothing depends.
    nodes, weights = np.polynomial.hermite_e.hermegauss(7)
    errors = []
    for node in nodes[nodes >= 0]:
        made = outside_scan(replace(ROUND, line_offset=float(node) * u), 3, noise=0.001)
        offset = replace(made, line_offset_uncertainty=u)
        errors.append(memscal.calibrate(offset, other=False).apparatus.conversion_constant / A - 1)
    mirrored = np.concatenate([errors[:0:-1], errors])
    mean = float(weights @ mirrored / weights.sum())
    spread = float(np.sqrt(weights @ (mirrored - mean) ** 2 / weights.sum()))
    # Without the correction the mean error is -4 %.
    assert abs(mean) < 0.005
    centred = replace(outside_scan(ROUND, 3, noise=0.001), line_offset_uncertainty=u)
    counted = memscal.calibrate(centred, other=False).apparatus.budget["conversion_constant"]
    assert counted["line_offset"] / A == pytest.approx(spread, rel=0.3)


def test_a_raster_measures_what_a_line_assumes():
    line = memscal.calibrate(stated()).apparatus
    raster = memscal.calibrate(memscal.simulate(raster=True, points=17, seed=1)).apparatus
    assert {"roundness", "line_offset"} <= set(by_name(line))
    states = states_of(raster)
    assert states["roundness"] == states["line_offset"] == "measured"


def test_what_the_budget_counts_unasked_is_listed_with_its_size():
    made = memscal.simulate(seed=5, load=0.6)
    # Half is the largest Poisson's ratio in the table of rods.
    film = replace(made.film, law="", poisson_ratio_uncertainty=None)
    apparatus = memscal.calibrate(
        replace(made, film=film, rod_friction=None), other=False
    ).apparatus
    listed = by_name(apparatus)
    # Half the difference of the ends, and the whole one, as rectangles.
    for name, line, ends in (("film_law", "model_form", 3), ("rod_friction", "rod_friction", 12)):
        for parameter in ("conversion_constant", "gaussian_sigma"):
            moved = apparatus.parameters.uncertainty(parameter) / listed[name].sizes[parameter]
            counted = ends**0.5 * apparatus.budget[parameter][line]
            assert moved == pytest.approx(counted, rel=0.3)
        assert listed[name].words not in text_of(apparatus)
    assert listed["poisson_ratio"].words in text_of(apparatus)


def test_of_a_relative_constant_no_load_is_taken_for_granted():
    scan = replace(stated(), load_uncertainty=None)
    for relative in (False, True):
        found = memscal.calibrate(scan, relative=relative)
        assert ("load_scale" in by_name(found)) is not relative


def test_an_offset_as_in_another_unit_is_refused():
    with pytest.raises(InputError, match="line offset uncertainty of the scan is 100 mm"):
        memscal.calibrate(stated(line_offset=0.1))


def test_assumptions_are_in_file_json_and_text(tmp_path):
    calibration = memscal.calibrate(stated())
    path = tmp_path / "a.apparatus.h5"
    calibration.apparatus.save(path)
    assert memscal.load_apparatus(path).assumptions == calibration.apparatus.assumptions
    listed = json.loads(json.dumps(calibration.to_dict()))["assumptions"]
    assert [entry["name"] for entry in listed] == [a.name for a in calibration.assumptions]
    roundness = listed[0]
    assert roundness["size_for_one_u"]["unit"] == "1"
    offset = listed[1]["size_for_one_u"]
    assert offset["unit"] == "mm"
    assert 0.1 < offset["value"] < 0.3
    text = text_of(calibration.apparatus)
    assert "the sensor is round" in text
    assert f"{roundness['size_for_one_u']['value']:.2g}" in text


def test_options_of_import_state_them(run, tmp_path):
    made = outside_scan(World(), 1)
    rows = "\n".join(f"{x * 1e3:.6g},{u * 1e3:.8g}" for x, u in zip(made.x, made.u_zz, strict=True))
    (tmp_path / "t.csv").write_text(f"x [mm],U [mV]\n{rows}\n", encoding="utf-8")
    given = ["--position-scale-uncertainty", "0.2", "--line-offset-uncertainty", "0.1"]
    given += ["--roundness-uncertainty", "0.05", "--gain-uncertainty", "0.5"]
    given += ["--base-slip-uncertainty", "0.1", "--baseline-curvature-uncertainty", "0"]
    given += ["--gain-curvature-uncertainty", "0.01", "--shear-sensitivity-uncertainty", "0.05"]
    columns = ["--x", "x", "--u", "U"]
    said = run("import", tmp_path / "t.csv", "-o", tmp_path / "s.h5", *columns, *given).out
    assert "position scale 0.002, gain 0.005" in said
    assert "line offset 0.1 mm" in said
    held = run("inspect", tmp_path / "s.h5", "--json").json["quantities"]
    sizes = {row["name"]: row["standard_uncertainty"] for row in held}
    assert (sizes["line_offset"], sizes["roundness"]) == (0.1, 0.05)
    read = memscal.read_scan(tmp_path / "s.h5")
    values = {name: getattr(read, f"{name}_uncertainty") for name in STATED_ERRORS}
    assert values == {
        "position_scale": 0.002,
        "gain": 0.005,
        "gain_curvature": 0.01,
        "roundness": 0.05,
        "line_offset": 1e-4,
        "base_slip": 0.1,
        "baseline_curvature": 0.0,
        "shear_sensitivity": 5e-5,
    }


def crossed(world, *, offset=0.0, seed=1):
    """Lines along x at y = 0 and along y at x = 0 of a sensor at (offset, offset)."""
    passing = replace(world, line_offset=-offset)
    lines = []
    for along in ("x", "y"):
        line = outside_scan(passing, seed, noise=0.001, along=along)
        lines.append(replace(line, x=line.x + offset))
        seed += 1
    return lines


@pytest.mark.parametrize("world", [ROUND, elliptic(1.4)], ids=["round", "elliptic"])
def test_crossed_lines_measure_axis_ratio_and_each_other_s_offset(world):
    calibration = memscal.calibrate(crossed(world, offset=0.3e-3))
    apparatus = calibration.apparatus
    # Without the offsets A is 4 % smaller.
    error = apparatus.conversion_constant / A - 1
    assert abs(error) < 1.5 * apparatus.parameters.uncertainty("conversion_constant") / A
    ratio = (1 + apparatus.parameters["ellipticity"]) / (1 - apparatus.parameters["ellipticity"])
    assert ratio**0.5 == pytest.approx(1.4 if world != ROUND else 1.0, abs=0.03)
    states = states_of(apparatus)
    assert states["roundness"] == states["line_offset"] == "measured"
    texts = [m.text for m in apparatus.process.messages if m.kind == "line_offset"]
    assert "at 0.30" in texts[0]


def test_lines_of_unlike_zeros_measure_no_offset():
    along, across = crossed(ROUND)
    apparatus = memscal.calibrate([along, replace(across, x=across.x + 5e-3)]).apparatus
    states = states_of(apparatus)
    assert (states["roundness"], states["line_offset"]) == ("measured", "assumed")


def test_points_on_two_lines_are_two_lines():
    lines = crossed(ROUND)
    x = np.concatenate([lines[0].x, np.zeros(lines[1].x.size)]) + 3e-3
    y = np.concatenate([np.zeros(lines[0].x.size), lines[1].x]) - 2e-3
    u = np.concatenate([line.u_zz for line in lines])
    errors = np.concatenate([line.u_zz_errors for line in lines])
    points = memscal.calibrate(replace(lines[0], x=x, y=y, u_zz=u, u_zz_errors=errors)).apparatus
    apart = memscal.calibrate(lines).apparatus
    # One reading where they cross is of the first line.
    assert points.conversion_constant == pytest.approx(apart.conversion_constant, rel=2e-3)


def test_what_is_solved_again_without_the_mean_offset_keeps_the_unit_of_its_reference():
    scan = replace(memscal.simulate(seed=1), line_offset_uncertainty=0.2e-3)
    disc = memscal.IdealReference("disc", 0.25e-3)
    calibration = memscal.calibrate(scan, reference=disc, other=False)
    assert calibration.solution.estimate.points.reading == calibration.apparatus.reading
