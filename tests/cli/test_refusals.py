"""Command lines that are refused: by exit code, with words that lead on, and nothing written."""

import shlex
from collections.abc import Callable
from pathlib import Path

import pytest
from helpers.console import Run, names

TWICE = "Two outputs"
WANT = "--want and --vary go together"

#: Of a folder with a scan and an artifact: commands, each with what its refusal says.
WRONG_USAGE = {
    "--verbose": "--version",
    "apply sensor.apparatus.h5": "",
    "calibrat scan.h5": "Did you mean calibrate?",
    "calibrate": "SCAN",
    "calibrate ''": "The name of the file is empty",
    "calibrate scan.h5 --brief --json": "Give --brief or --json, not both.",
    "calibrate scan.h5 --colour": "--colour",
    "calibrate scan.h5 --figure a.jpg": ".png",
    "calibrate scan.h5 --figure a.png --sweep-figure ./a.png": TWICE,
    "calibrate scan.h5 --method magic": "white-noise",
    "calibrate scan.h5 --method richardson-lucy": "docs/own_method.md",
    "calibrate scan.h5 --monte-carlo 1": "--monte-carlo",
    "calibrate scan.h5 --monte-carlo many": "--monte-carlo",
    "calibrate scan.h5 --option amplitude": "NAME=VALUE",
    "calibrate scan.h5 --option amplitude=NaN": "amplitude is a number",
    "calibrate scan.h5 --option amplitude=much": "amplitude is a number",
    "calibrate scan.h5 --option amplitudes=1": "amplitude",
    "calibrate scan.h5 --option seed=1": "--seed",
    "calibrate scan.h5 --report scan.apparatus.h5": TWICE,
    "calibrate scan.h5 --seed x": "--seed",
    "batch '' -o results": "The name of the file is empty",
    "compare sensor.apparatus.h5 scan.h5 --cache here --no-cache": "not both",
    "compare sensor.apparatus.h5 scan.h5 --figure table.txt": ".png",
    "compare sensor.apparatus.h5 scan.h5 --friction -0.1": "of at least 0",
    "compare sensor.apparatus.h5 scan.h5 --friction 0.1 --friction 0.1": "twice",
    "compare sensor.apparatus.h5 scan.h5 --interface": "--macroscopic",
    "compare sensor.apparatus.h5 scan.h5 --loading sideways": "incremental",
    "compare sensor.apparatus.h5 scan.h5 --macroscopic-uncertainty 0.1": "--macroscopic",
    "compare sensor.apparatus.h5 scan.h5 --reference a.h5 --friction 0 --friction inf": (
        "--reference"
    ),
    "completion tcsh": "fish",
    "design --figure design.gif": ".png",
    "design --noise 0": "--noise",
    "design --repeats 0": "--repeats",
    "design --step -1": "--step",
    "design --vary step": WANT,
    "design --want resolved=4% --vary step": "without %",
    "design --want sigma --vary step": "is no target",
    "design --want sigma=0.01 --vary step": "write the %",
    "design --want sigma=1%": WANT,
    "design --want sigma=much% --vary step": "is no target",
    "design --weight 0.5 --weight 0.5": "--weight",
    "explain gausian_misfit": "Did you mean gaussian_misfit?",
    "import t.csv -o a.h5 --x-units mm": "--x-unit",
    "reference cone -o out.h5": "needs --inclination",
    "reference cone --inclination 5 --radius 1 -o out.h5": "--radius does not describe a cone",
    "reference profile -o out.h5": "needs --profile-table",
    "reference pyramid": "rod",
    "reference rod --depth 2 --load 1": "not both",
    "reference rod --film-law mooney-rivlin -o out.h5": "--mooney-rivlin-ratio",
    "reference rod --inclination 5 -o out.h5": "--inclination does not describe a rod",
    "reference rod --load 0": "above 0",
    "reference rod --load 1 --load 2 -o rod.h5": "one load",
    "reference rod --load nan": "(in N)",
    "reference rod --poisson-ratio 0.7": "at most 0.5",
    "reference rod --radius 'a quarter'": "(in mm)",
    "reference rod --strain finite --film-law linear -o out.h5": "leave --strain out",
    "reference sphere --backend fem --mesh film.png -o out.h5": ".vtu",
    "reference sphere --exponential 1 1 --greenwood-tripp 1 1 1 -o out.h5": "normal law",
    "reference sphere --figure film.txt -o out.h5": ".png",
    "reference sphere --friction -0.1 -o out.h5": "-0.1",
    "reference sphere --mesh film.vtu -o out.h5": "--backend fem",
    "reference sphere --rings 4 -o out.h5": "4",
    "reference sphere --thickness -2 -o out.h5": "-2",
    "simulate --disc-radius 0": "--disc-radius",
    "simulate --disc-radius 800 --sigma 300 --sigma 200": "",
    "simulate --disc-radius 800 --sigma 300 --weight 1": "",
    "simulate --experiment rod --friction 0.2": "--friction belongs to --experiment sphere",
    "simulate --experiment rod --gain 1 --slip-length 2": "--slip-length, --gain belong",
    "simulate --experiment sphere --contacts 1": "2<=x<=4096",
    "simulate --experiment sphere --friction -1": "of at least 0",
    "simulate --experiment sphere --greenwood-tripp 1 1 1 --exponential 1 1": "one normal law",
    "simulate --experiment sphere --half-range 5 --raster": "--half-range, --raster belong",
    "simulate --experiment sphere --load 1 --load 1": "given twice",
    "simulate --experiment sphere --load-scatter 11": "(in percent)",
    "simulate --experiment sphere --lubricated-load 1 --lubricated-load 1": "given twice",
    "simulate --experiment sphere --raster": "--raster belongs to --experiment rod",
    "simulate --experiment sphere -o ''": "The name of the file is empty",
    "simulate --film-law mooney-rivlin": "",
    "simulate --mooney-rivlin-ratio 0.1": "",
    "simulate --noise -1": "--noise",
    "simulate --points 1": "--points",
    "simulate --raster --repeats 2": "",
    "simulate --rod-friction 0.3": "--rod-friction",
    "simulate --sigma 700 --sigma 400": "",
    "simulate -o ''": "The name of the file is empty",
}

INVALID = {
    "apply scan.h5 scan.h5": "memscal-artifact",
    "apply sensor.apparatus.h5 absent.h5": "absent.h5",
    "apply sensor.apparatus.h5 sensor.apparatus.h5": "memscal-scan",
    "compare scan.h5 scan.h5": "memscal-artifact",
    "design --method magic": "magic",
    "design --radius 1.5": "rod's width is 3 mm",
    "design --want sigma=1% --vary repeats": "the best is",
    "reference profile --profile-table absent.csv -o out.h5": "absent.csv",
    "reference rod --depth 3000 -o out.h5": "would sink 3000 um",
    "reference sphere --backend fem --film-radius 1 -o out.h5": "the film's edge at 1 mm",
    "reference sphere --strain finite --friction 0.3 -o out.h5": "slides freely (friction 0) or",
    "restore scan.h5 scan.h5": "memscal-artifact",
    "simulate --experiment sphere --load 1e6": "film",
    "simulate --sigma 700 --weight 0.5": "",
}

NOT_WRITTEN = {
    "simulate --experiment sphere -o no/such/folder": "Create the folder first",
    "simulate --experiment sphere -o scan.h5": "not a folder",
}


@pytest.fixture
def refused(run: Run, scan: Path, artifact: Path, folder: Path) -> Callable[..., None]:
    """Run a command that is refused, in a folder that stays as it was."""

    def refused_(code: int, line: str, *words: str) -> None:
        before = names(folder)
        assert run(*shlex.split(line)).exits(code, *words).out == ""
        assert names(folder) == before

    return refused_


@pytest.mark.parametrize("line", WRONG_USAGE)
def test_wrong_usage_is_exit_code_2_with_a_hint(refused, line: str) -> None:
    refused(2, line, WRONG_USAGE[line], "--help")


@pytest.mark.parametrize("line", INVALID)
def test_an_input_that_cannot_be_used_is_exit_code_3(refused, line: str) -> None:
    refused(3, line, INVALID[line])


@pytest.mark.parametrize("line", NOT_WRITTEN)
def test_an_output_that_cannot_be_written_is_exit_code_4(refused, line: str) -> None:
    refused(4, line, NOT_WRITTEN[line])
