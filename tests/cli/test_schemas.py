"""Every command that prints JSON ships the schema of what it prints."""

import copy

import pytest
from golden.make import load
from helpers.friction_results import comparison
from helpers.scans import known_apparatus, measured, pressed, sphere_scan
from helpers.schemas import SCHEMAS, faults
from jsonschema import Draft202012Validator

import memscal
from memscal.extensions import COMMANDS, module

SHARED = "common"


def test_each_command_with_json_has_a_schema_and_each_schema_a_command():
    commands = {name: module(place).command for name, (place, _) in COMMANDS.items()}
    printing = {
        name
        for name, command in commands.items()
        if any("--json" in parameter.opts for parameter in command.params)
    }
    assert set(SCHEMAS) == {*printing, SHARED}


@pytest.mark.parametrize("name", SCHEMAS)
def test_a_schema_is_one_and_names_what_it_describes(name):
    Draft202012Validator.check_schema(SCHEMAS[name])
    assert SCHEMAS[name]["$schema"] == "https://json-schema.org/draft/2020-12/schema"
    assert name == SHARED or f"memscal {name} --json" in SCHEMAS[name]["title"]


def objects(value):
    """Yield every object within a value."""
    for item in value.values() if isinstance(value, dict) else value:
        if isinstance(item, dict | list):
            yield from objects(item)
    if isinstance(value, dict):
        yield value


@pytest.mark.parametrize(
    "golden", ["check-artifact", "import-line", "reference-rod", "restore-sphere", "design"]
)
def test_a_misspelt_key_follows_no_schema(golden):
    printed = load(golden)["output"]
    for one in objects(printed):
        before = copy.copy(one)
        if one.keys() <= {"length", "missing", "some", "mean", "root_mean_square"}:
            continue  # a long list, made short
        if "noise" in one and "unit" not in one and "step" not in one:
            continue  # a budget, whose keys are free
        one["vaule"] = "1"
        assert faults(golden.partition("-")[0], printed)
        one.clear()
        one.update(before)


@pytest.mark.parametrize(
    "line",
    [
        "explain",
        "explain symmetry",
        "batch . -o results --workers 1",
        "batch . -o results --dry-run",
        "calibrate scan.h5 --dry-run",
        "check sensor.apparatus.h5",
        "check table.csv",
    ],
)
def test_what_is_printed_follows_its_schema(run, scan, artifact, line):
    scan.with_name("table.csv").write_text("x,u\n0,1\n", encoding="utf-8")
    done = run(*line.split(), "--json")
    assert faults(line.split()[0], done.json) == []
    if line.startswith("batch") and "--dry-run" not in line:
        assert faults("summary", run("summary", "results", "--json").json) == []


@pytest.mark.parametrize(
    ("command", "result"),
    [
        ("calibrate", lambda: memscal.calibrate(memscal.simulate(seed=1, points=33))),
        ("calibrate", lambda: memscal.calibrate(memscal.simulate(seed=1, points=33)).apparatus),
        ("apply", measured),
        ("restore", lambda: memscal.restore(sphere_scan(pressed(), seed=1), known_apparatus())),
        ("compare", comparison),
        ("design", lambda: memscal.design(step=0.5e-3, repeats=2)),
    ],
)
def test_a_dictionary_follows_the_schema_of_its_command(command, result):
    assert faults(command, result().to_dict()) == []
