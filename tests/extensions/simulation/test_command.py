"""``memscal simulate``."""

import numpy as np
from helpers.console import names
from helpers.records import assert_same

import memscal


def test_the_defaults_are_those_of_the_library(run, folder):
    run("simulate").exits(0)
    assert names(folder) == ["synthetic_scan.h5"]
    found = memscal.read_scan("synthetic_scan.h5")
    own = memscal.simulate()
    # The options of a film have no roughness.
    but = ("source", "roughness_rms", "roughness_rms_uncertainty")
    assert_same(found, own, but=but, rtol=1e-12)
    assert found.rod_friction == np.inf
