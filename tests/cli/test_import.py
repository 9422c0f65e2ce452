"""``memscal import``."""

import numpy as np

import memscal

OPTIONS = (
    "--x x --u u --load-column F --holds --figure log.png "
    "--radius 0.25 --young-modulus 2.2 --poisson-ratio 0.5 --thickness 2"
)


def test_a_log_of_presses_is_averaged_and_drawn(run, folder):
    x = np.repeat(np.linspace(-8, 8, 17), 20)
    load = np.tile(np.repeat([0.0, 1.0], 10), 17)
    noise = np.random.default_rng(1).normal(size=(2, x.size)) * 1e-3
    rows = np.stack([x, load * np.exp(-(x**2)) + noise[0], load + noise[1]], axis=1)
    np.savetxt("log.csv", rows, delimiter=",", header="x/mm,u/mV,F [N]", comments="")
    told = run("import", "log.csv", "-o", "scan.h5", *OPTIONS.split()).exits(0).out
    assert "17 holds of 10 to 10 rows, the first in lines 12 to 21" in told
    assert (folder / "log.png").read_bytes().startswith(b"\x89PNG")
    scan = memscal.read_scan("scan.h5")
    np.testing.assert_allclose(scan.u_zz, 1e-3 * np.exp(-(scan.x**2) * 1e6), atol=2e-6)


def test_a_depth_tells_the_presses_and_is_not_kept(run, folder):
    x = np.repeat(np.linspace(-8, 8, 17), 20)
    down = np.tile(np.repeat([0.0, 1.0], 10), 17)
    noise = np.random.default_rng(1).normal(size=x.size) * 1e-3
    rows = np.stack([x, 0.3 + down * np.exp(-(x**2)) + noise, down], axis=1)
    np.savetxt("log.csv", rows, delimiter=",", header="x/mm,u/mV,z", comments="")
    told = "import log.csv -o s.h5 --x x --u u --depth z --depth-unit mm --baseline before-each"
    run(*told.split()).exits(2)
    run(*told.split(), "--holds").exits(0)
    scan = memscal.read_scan(folder / "s.h5")
    assert scan.normal_load is None
    np.testing.assert_allclose(scan.u_zz, 1e-3 * np.exp(-(scan.x**2) * 1e6), atol=2e-6)
