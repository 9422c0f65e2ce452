"""Scans that lack one quantity, or two: what is missing, and what can be had all the same."""

import itertools
from pathlib import Path

import numpy as np
import pytest
from helpers.console import Run

FILM = {"--young-modulus": "2.2", "--poisson-ratio": "0.5", "--thickness": "2"}
STATED = {"--load": "1", "--radius": "0.25", **FILM, "--x-unit": "mm", "--u-unit": "mV"}
ONE_OR_TWO = [*itertools.combinations(STATED, 1), *itertools.combinations(STATED, 2)]
NAMED = {"--load": "no load", "--radius": "no indenter", "--thickness": "no film"}


@pytest.mark.parametrize("lacking", [*ONE_OR_TWO, (*FILM,), (*FILM, "--load", "--radius")])
def test_a_message_names_what_is_missing_and_what_does_without_it(lacking, folder: Path, run: Run):
    x = np.linspace(-6, 6, 49)
    u = 2 * np.exp(-(x**2) / 2) + 0.005 * np.random.default_rng(1).normal(size=x.size)
    np.savetxt("rod.csv", np.column_stack([x, u]), delimiter=",", header="x,U", comments="")
    stated = [word for pair in STATED.items() if pair[0] not in lacking for word in pair]
    imported = run("import", "rod.csv", "-o", "rod.h5", "--x", "x", "--u", "U", *stated)
    if imported.code:
        assert any(option in imported.err for option in lacking)
        assert "--reference point" in imported.err
        return
    way = ["--relative"] if lacking == ("--load",) else ["--reference", "point"]
    words = [NAMED[option] for option in lacking if option in NAMED]
    run("calibrate", "rod.h5").exits(3, " ".join(way), *words)
    found = run("calibrate", "rod.h5", "--json", "--reference", "point", "--relative").json
    assert found["conversion_constant"]["unit"] == "mV*m^2 (relative)"
    # The integral over the plane of the Gaussian of 1 mm.
    assert found["conversion_constant"]["value"] == pytest.approx(4e-6 * np.pi, rel=0.05)
    run("inspect", "rod.apparatus.h5").exits(0)
    refused = run("apply", "rod.apparatus.h5", "rod.h5", "-o", "a.h5")
    refused.exits(3, "relative: it gives no stress in Pa", "widths and G hold")
