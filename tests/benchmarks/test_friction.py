"""Speed of families of profiles and of their likelihood, as ratios on the same machine."""

import math
import sys
from dataclasses import replace
from statistics import median
from time import process_time

from helpers.folders import SHIPPED
from helpers.machine import once, show
from helpers.paper import FILM, SPHERE

import memscal
from memscal.friction.calculated import amontons_family
from memscal.mechanics.solver import refinement
from memscal.mechanics.solver.refinement import solve_on_rings

UNCERTAIN = replace(FILM, thickness_uncertainty=2e-5)


def family(cache):
    solve_on_rings.cache_clear()
    return amontons_family(
        UNCERTAIN, SPHERE, [0.34, 2.75], friction=[0.0, 0.3], reach=12e-3, cache=cache
    )


def test_a_kept_family_is_read_ten_times_faster_than_it_is_calculated(tmp_path):
    family(tmp_path)
    pairs = [(once(lambda: family(None)), once(lambda: family(tmp_path))) for _ in range(3)]
    ratio = median(kept / calculated for calculated, kept in pairs)
    show("kept family, over a calculated one", ratio, 1 / 10)


def test_measured_stress_and_comparison_cost_so_many_calibrations(tmp_path):
    # Processor time over that of one calibration of 65 points, all in one process; docs/speed.md.
    experiment = SHIPPED / "sphere_experiment"
    scan = memscal.read_scan(SHIPPED / "rod_scan_65.h5")
    contacts = [memscal.read_scan(experiment / f"sphere_{k}.h5") for k in ("dry", "lubricated")]
    apparatus = memscal.calibrate(experiment / "rod_scan.h5").apparatus
    friction = (0, 0.05, 0.1, 0.15, 0.2, 0.25, 0.3, 0.6, math.inf)

    def cost(work, rounds, *, forget):
        times = []
        for _ in range(rounds):
            if forget:
                solve_on_rings.cache_clear()
                refinement._even_film.cache_clear()
            start = process_time()
            work()
            times.append(process_time() - start)
        return median(times)

    def measure():
        return memscal.measure_stress(contacts, apparatus)

    def compare(cache=None):
        return memscal.compare(contacts, apparatus, friction=friction, cache=cache)

    compared = [compare(tmp_path), compare(tmp_path)]
    assert [len(result.measured.profiles) for result in compared] == [6, 6]
    calibration = cost(lambda: memscal.calibrate(scan), 7, forget=False)
    ratios = {
        "measure_stress of six profiles, contacts unknown": (cost(measure, 3, forget=True), 20),
        "measure_stress of six profiles, again": (cost(measure, 3, forget=False), 20),
        "compare, nine coefficients, two loadings": (cost(compare, 1, forget=True), 200),
        "compare, with its cache": (cost(lambda: compare(tmp_path), 3, forget=False), 30),
    }
    sys.stdout.write(f"\none calibration of 65 points: {calibration:.3g} s of processor time\n")
    for what, (seconds, stated) in ratios.items():
        show(f"{what}, over a calibration", seconds / calibration, stated)
