"""How many functions of the package a reader of each main job meets: those that it runs."""

import json
import subprocess
import sys
import tomllib
from pathlib import Path

TESTS = Path(__file__).parent


def test_the_main_jobs_run_few_functions():
    program = [sys.executable, TESTS / "helpers" / "trips.py"]
    run = subprocess.run(program, capture_output=True, text=True, check=True)
    budget = tomllib.loads((TESTS / "house_budget.toml").read_text(encoding="utf-8"))["functions"]
    counts = json.loads(run.stdout)
    assert {name: count for name, count in counts.items() if count > budget[name]} == {}
