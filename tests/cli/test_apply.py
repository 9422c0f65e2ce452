"""``memscal apply``: what it prints, what it writes, and its exit codes."""

from dataclasses import replace

from helpers.console import names
from helpers.scans import contact_scan

import memscal
from memscal.cli.failures import CHECK_FAILED

LOADS = (0.69, 2.75)


def test_a_wrong_gain_fails_the_check_and_is_exit_code_1(run, artifact, folder):
    scan = contact_scan(1, load=LOADS, noise=0.001, load_scatter=0.0)
    memscal.write_scan(replace(scan, u_zz=1.2 * scan.u_zz), folder / "gain.h5")
    done = run("apply", artifact, "gain.h5").exits(CHECK_FAILED)
    assert "FAILED: applied force" in done.out
    assert "gain, load or a unit differ" in done.err
    assert "gain.stress.h5" in names(folder)
