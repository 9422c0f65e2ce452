"""Command lines that are refused: by exit code, with words that lead on, and nothing written."""

import re
import shlex
import shutil
from pathlib import Path
from string import Template

import pytest
from helpers.folders import DATA
from helpers.schemas import SCHEMAS, faults

MESH = DATA / "vtk_film.vtu"
TABLES = {
    "left.csv": "path,wafer_x,wafer_y\na.h5,left,0\n",
    "no_path.csv": "sensor,path\n7,\n",
    "not_finite.csv": "r,z\n0,0\n1,nan\n2,4\n3,9\n",
    "semicolons.csv": "path;wafer_x\na.h5;0\n",
    "table.csv": "x,u\n0,1\n1,2\n2,1\n",
    "um.csv": "path,wafer_x (um)\na.h5,0\n",
}
#: What stands in many of the commands.
PARTS = {
    "columns": "import table.csv -o a.h5 --x x --x-unit mm --u u --u-unit mV",
    "film": "--load 1 --radius 0.25 --young-modulus 2.2 --poisson-ratio 0.5",
    "reference": "-o a.h5 --format reference --r-unit mm --sigma-unit MPa --load 1",
}

#: "1 points", "a int", "an number".
FAULTS_OF_GRAMMAR = re.compile(
    r"(?<![-.])\b1 (?!is\b)[a-z]+s\b|\ba [aeio][a-z]+|\ban [b-df-gj-np-tv-z][a-z]+"
)

TWICE = "Two outputs"
WANT = "--want and --vary go together"

#: Of a folder with a scan, an artifact and tables: commands, each with what its refusal says.
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
    "batch . -o new --workers 1 --scheduler tcp://a:1": "exclude each other",
    "summary . --tolerance A=2%,width=3%": "Known are A and sigma",
    "summary . --tolerance A=2%,A=3%": "each once",
    "summary . --tolerance A=2,5%": "with decimal points",
    "certificate sensor.apparatus.h5 --lab lab.toml": "--output",
    "certificate sensor.apparatus.h5 --lab lab.toml -o a.xml -o a.xml": "same name",
    "certificate sensor.apparatus.h5 --lab lab.toml -o c.txt": (
        "'c.txt' does not end in .html, .pdf, .xml"
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
    "import film.vtu -o a.h5": "film.vtu is a mesh, and no scan: add --format reference",
    "import film.vtu -o a.h5 --format reference": "--sigma, --r-unit, --sigma-unit",
    "import film.vtu $reference --sigma S --r x": "A mesh has no use for --r",
    "import t.csv -o a.h5 --x-units mm": "--x-unit",
    "import table.csv -o a.h5": "add --x, --u.",
    "import table.csv -o a.h5 --format reference": "add --sigma, --r.",
    "import table.csv $reference --r x --sigma u --base 0": "A table has no use for --base",
    "$columns --figure a.png": "--holds",
    "$columns --resume": "belongs to several tables",
    "import table.csv um.csv -o new --figure a.png": "--figure belongs to one table",
    "$columns --load 1 --indenter sphere": "--radius",
    "$columns --shear-sign -1": "--shear-sign",
    "$columns --sigma s": "--sigma belong to --format reference",
    "$columns --young-modulus 1,75": "Write a decimal point",
    "$columns --ceiling -1.2": "above 0",
    "$columns --load 1_0": "is not a number",
    "$columns --output b.h5": "given twice",
    "$columns --thickness 1": "add --young-modulus, --poisson-ratio",
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
    "batch left.csv -o new": "left.csv, line 2: could not convert string to float: 'left'",
    "batch no_path.csv -o new": "line 2 has no path",
    "batch none.csv -o new": "none.csv cannot be read",
    "batch semicolons.csv -o new": "None of the 2 scans",
    "batch um.csv -o new": "'wafer_x (um)'",
    "calibrate '\x1b[2Jscan.h5'": "[2Jscan.h5 cannot be read: No such file",
    "calibrate scan.h5 --channel xz --method wiener --dry-run": "bayesian",
    "calibrate scan.h5 --reference scan.h5": "memscal-reference",
    "calibrate scan.h5 --reference table.csv": "memscal import table.csv --format reference",
    "compare scan.h5 scan.h5": "memscal-artifact",
    "design --want sigma=1% --vary repeats": "the best is",
    "import film.vtu $reference --sigma Stress": "at the nodes: S (6); in the cells: S33 (1)",
    "$columns $film --thickness 0.02": "times the film's thickness of 0.02 mm",
    "$columns $film --thickness 1500": "Probably 1.5 mm was meant",
    "batch table.csv um.csv -o new": "--recipe recipe.toml",
    "inspect table.csv": "table.csv is not",
    "reference profile --profile-table absent.csv -o out.h5": "absent.csv",
    "reference profile --profile-table not_finite.csv -o out.h5": "not_finite.csv",
    "reference sphere --backend fem --film-radius 1 -o out.h5": "the film's edge at 1 mm",
    "restore scan.h5 scan.h5": "memscal-artifact",
    "simulate --experiment sphere --load 1e6": "film",
    "summary .": "holds no results of a batch",
}

CREATE = "Create the folder first"
INPUT = "also an input"
NOT_WRITTEN = {
    "apply sensor.apparatus.h5 scan.h5 -o scan.h5 --force": INPUT,
    "batch . -o new --report no/page.html": CREATE,
    "batch . -o new --report scan.h5 --force": INPUT,
    "calibrate scan.h5 -o no/out.h5": CREATE,
    "calibrate scan.h5 --figure no/out.png": CREATE,
    "calibrate scan.h5 --report no/out.html": CREATE,
    "calibrate scan.h5 --sweep-figure no/out.png": CREATE,
    "certificate sensor.apparatus.h5 --lab lab.toml -o no/c.xml": CREATE,
    "compare sensor.apparatus.h5 scan.h5 --figures no/such/folder": CREATE,
    "import table.csv -o table.csv --x x --x-unit mm --u u --u-unit mV --force": INPUT,
    "simulate --experiment sphere -o no/such/folder": CREATE,
    "simulate --experiment sphere -o scan.h5": "not a folder",
}


@pytest.fixture
def refused(run, scan, artifact, folder):
    """Run a command that is refused, in a folder that stays as it was."""
    shutil.copy(MESH, "film.vtu")
    for name, text in TABLES.items():
        Path(name).write_text(text, encoding="utf-8")

    def refused_(code, line, *words):
        before = {path: path.read_bytes() for path in folder.iterdir()}
        arguments = shlex.split(Template(line).substitute(PARTS))
        done = run(*arguments, "--json").exits(code, *words)
        command = arguments[0] if arguments[0] in SCHEMAS else "explain"
        assert faults(command, done.json) == []
        error = done.json["error"]
        assert (error["exit_code"], error["class"].endswith("Error")) == (code, True)
        assert error["problem"].rpartition("\x1b")[2] in done.err
        assert "\x1b" not in done.err
        assert not FAULTS_OF_GRAMMAR.findall(done.err)
        assert {path: path.read_bytes() for path in folder.iterdir()} == before

    return refused_


@pytest.mark.parametrize("line", WRONG_USAGE)
def test_wrong_usage_is_exit_code_2_with_a_hint(refused, line):
    refused(2, line, WRONG_USAGE[line], "--help")


@pytest.mark.filterwarnings("default::memscal.errors.UnitWarning")
@pytest.mark.parametrize("line", INVALID)
def test_an_input_that_cannot_be_used_is_exit_code_3(refused, line):
    refused(3, line, INVALID[line])


@pytest.mark.parametrize("line", NOT_WRITTEN)
def test_an_output_that_cannot_be_written_is_exit_code_4(refused, line, monkeypatch):
    computing = "The calibration was reached."
    name = "memscal.calibration.calibrate.calibrate"
    monkeypatch.setattr(name, lambda *_, **__: pytest.fail(computing))
    refused(4, line, NOT_WRITTEN[line])
