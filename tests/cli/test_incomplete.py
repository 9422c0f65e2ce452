"""Scans that lack one quantity, or two: what is missing, and what can be had all the same."""

from itertools import combinations

import numpy as np
import pytest

FILM = "--young-modulus=2.2 --poisson-ratio=0.5 --thickness=2"
STATED = f"--load=1 --radius=0.25 {FILM} --x-unit=mm --u-unit=mV".split()
WORDS = {"--load=1": "no load", "--radius=0.25": "no indenter", "--thickness=2": "no film"}
LACKING = [*combinations(STATED, 1), *combinations(STATED, 2), (*FILM.split(), "--load=1")]


@pytest.mark.parametrize("lacking", LACKING, ids="".join)
def test_a_message_names_what_is_missing_and_what_does_without_it(lacking, folder, run):
    x = np.linspace(-6, 6, 49)
    table = np.transpose([x, 2 * np.exp(-(x**2) / 2)])
    np.savetxt("rod.csv", table, delimiter=",", header="x,U", comments="")
    stated = [option for option in STATED if option not in lacking]
    failed = run("import", "rod.csv", "-o", "rod.h5", "--x=x", "--u=U", *stated)
    words = []
    if failed.code:
        assert any(option.partition("=")[0] in failed.err for option in lacking)
    else:
        failed = run("calibrate", "rod.h5").exits(3)
        words = [WORDS[option] for option in lacking if option in WORDS]
        asked = ("--reference=point", "--relative", "--figure=a.svg", "--json")
        found = run("calibrate", "rod.h5", *asked).json
        assert found["conversion_constant"]["unit"] == "mV*m^2 (relative)"
        # The integral over the plane of the Gaussian of 1 mm.
        assert found["conversion_constant"]["value"] == pytest.approx(4e-6 * np.pi, 0.05)
    way = "--relative" if lacking == ("--load=1",) else "--reference point"
    assert all(word in failed.err for word in (*words, way))
