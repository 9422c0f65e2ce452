"""What only shipped data shows: a load of several, and the names of checks."""

import shutil

from helpers.folders import SHIPPED

SPHERE = SHIPPED / "sphere_experiment"


def test_a_load_of_several_is_restored_by_its_number(run, folder):
    shutil.copy(SPHERE / "sphere_dry.h5", "dry.h5")
    run("calibrate", SPHERE / "rod_scan.h5", "-o", "sensor.h5")
    restore = ("restore", "sensor.h5", "dry.h5")
    single = run(*restore, "--load", 1.4, "--json").json
    assert single["load"]["value"] == 1.37
    assert abs(single["force"]["value"] - 1.37) < 3 * single["force"]["standard_uncertainty"]
    run(*restore).exits(3, "go from 0.34 to 2.75 N", "--load")
    run(*restore, "--load", 2).exits(3, "0.34, 0.69, 1.37, 2.75 N", "none of 2 N")


def test_explain_knows_each_check_by_the_names_of_tables_and_files(run):
    assert run("explain", "joint_chi_square_dry").out.startswith("joint chi square\n")
    assert run("explain", "applied-force").out == run("explain", "applied_force_12").out
