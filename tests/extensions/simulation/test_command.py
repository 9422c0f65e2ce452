"""``memscal simulate``."""

from pathlib import Path

import numpy as np
import pytest
from helpers.console import Run, names
from helpers.records import assert_same

import memscal


def test_the_defaults_are_those_of_the_library(run: Run, folder: Path):
    run("simulate").exits(0)
    assert names(folder) == ["synthetic_scan.h5"]
    found = memscal.read_scan("synthetic_scan.h5")
    own = memscal.simulate()
    # The options of a film have no roughness.
    but = ("source", "roughness_rms", "roughness_rms_uncertainty")
    assert_same(found, own, but=but, rtol=1e-12)
    assert found.rod_friction == np.inf


def test_options_mean_their_units(run: Run, folder: Path):
    options = [
        *("--sigma", 400, "--conversion-constant", 2e-4, "--load", 0.5, "--radius", 0.3),
        *("--thickness", 3, "--young-modulus", 1.1, "--poisson-ratio", 0.48),
        *("--half-range", 9, "--points", 41, "--noise", 0.2, "--centre", -0.3),
        *("--baseline", 2, "--drift", -1, "--load-uncertainty", 3, "--seed", 4),
    ]
    done = run("simulate", "-o", "scan.h5", *options, "--json")
    assert done.json["synthetic"] is True
    scan = memscal.read_scan("scan.h5")
    truth = scan.synthetic
    assert truth["gaussian_sigma"] == pytest.approx(400e-6)
    assert truth["conversion_constant"] == pytest.approx(2e-7)
    assert truth["centre"] == pytest.approx(-0.3e-3)
    assert (scan.load, scan.load_uncertainty) == pytest.approx((0.5, 0.015))
    assert scan.indenter.radius == 0.3e-3
    assert (scan.film.thickness, scan.film.young_modulus) == (3e-3, 1.1e6)
    assert (scan.x[0], scan.x[-1], scan.x.size) == (-9e-3, 9e-3, 41)
    largest = float(truth["noise"]) / 0.002
    assert truth["baseline"] == pytest.approx(0.02 * largest)
    assert truth["drift"] == pytest.approx(-0.01 * largest)
    assert done.json["truth"]["conversion_constant"]["value"] == pytest.approx(2e-4)
