"""Functions of the package that each main job runs, counted in a process that ran none before."""

import importlib
import json
import os
import pkgutil
import sys
from collections.abc import Callable
from inspect import CO_OPTIMIZED
from pathlib import Path

import memscal

PACKAGE = memscal.__path__[0] + os.sep
DATA = Path(__file__).parents[2] / "calibration_data"


def functions_run(job: Callable[[], object]) -> int:
    """Count the functions of the package that a job runs, comprehensions aside."""
    found = set()

    def note(frame, event, _):
        code = frame.f_code
        inside = event == "call" and code.co_filename.startswith(PACKAGE)
        if inside and code.co_flags & CO_OPTIMIZED and not code.co_name.startswith("<"):
            found.add((code.co_filename, code.co_firstlineno))

    sys.setprofile(note)
    try:
        job()
    finally:
        sys.setprofile(None)
    return len(found)


def main():
    """Print how many functions each job runs."""
    for module in pkgutil.walk_packages(memscal.__path__, "memscal."):
        if module.name != "memscal.__main__":
            importlib.import_module(module.name)
    experiment = DATA / "sphere_experiment"
    scan = memscal.read_scan(DATA / "rod_scan_65.h5")
    contacts = (experiment / "sphere_dry.h5", experiment / "sphere_lubricated.h5")
    scans = [memscal.read_scan(path) for path in contacts]
    counts = {"calibrate": functions_run(lambda: memscal.calibrate(scan))}
    sensor = memscal.calibrate(experiment / "rod_scan.h5", method="bayesian").apparatus
    job = functions_run(lambda: memscal.compare(scans, sensor, loading="incremental"))
    sys.stdout.write(json.dumps({**counts, "compare": job}))


if __name__ == "__main__":
    main()
