"""``memscal import``."""

import numpy as np
import pytest

import memscal

OPTIONS = (
    "--x x --u u --load-column F --holds --figure log.png "
    "--radius 0.25 --young-modulus 2.2 --poisson-ratio 0.5 --thickness 2"
)


def write_log(last, level=0.0):
    """Write 17 presses of 20 rows, over a sensor that is a Gaussian of 1 mm."""
    x = np.repeat(np.linspace(-8, 8, 17), 20)
    pressed = np.tile(np.repeat([0.0, 1.0], 10), 17)
    noise = np.random.default_rng(1).normal(size=(2, x.size)) * 1e-3
    rows = np.stack([x, level + pressed * np.exp(-(x**2)) + noise[0], pressed + noise[1]], axis=1)
    np.savetxt("log.csv", rows, delimiter=",", header=f"x/mm,u/mV,{last}", comments="")


def gaussian():
    """Return what was imported, which is that sensor's."""
    scan = memscal.read_scan("scan.h5")
    np.testing.assert_allclose(scan.u_zz, 1e-3 * np.exp(-(scan.x**2) * 1e6), atol=2e-6)
    return scan


def test_a_log_of_presses_is_averaged_and_drawn(run, folder):
    write_log("F [N]")
    told = run("import", "log.csv", "-o", "scan.h5", *OPTIONS.split()).exits(0).out
    assert "17 holds of 10 to 10 rows, the first in lines 12 to 21" in told
    assert (folder / "log.png").read_bytes().startswith(b"\x89PNG")
    gaussian()


@pytest.mark.usefixtures("folder")
def test_a_depth_tells_the_presses_and_is_not_kept(run):
    write_log("z", level=0.3)
    told = "import log.csv -o scan.h5 --x x --u u --depth z --depth-unit mm --baseline before-each"
    run(*told.split()).exits(2)
    run(*told.split(), "--holds").exits(0)
    assert gaussian().normal_load is None


@pytest.mark.usefixtures("folder")
def test_an_import_ends_with_what_is_not_stated(run):
    write_log("F [N]")
    told = run("import", "log.csv", "-o", "scan.h5", *OPTIONS.split()).exits(0).out.splitlines()
    last = [line for line in told if line.startswith("Not stated: ")]
    assert told[-len(last) :] == last
    options = [line.split("--")[1].split()[0] for line in last]
    assert {"gain-uncertainty", "position-scale-uncertainty", "film-law"} < {*options}
    stated = ["--film-law", "linear", "--gain-uncertainty", "0.5", "--force"]
    told = run("import", "log.csv", "-o", "scan.h5", *OPTIONS.split(), *stated).exits(0).out
    assert "--film-law" not in told
    assert "--gain-uncertainty" not in told
    assert "--load-uncertainty" in told


@pytest.mark.usefixtures("folder")
def test_an_import_without_film_rod_and_load_names_them_and_no_cost_of_theirs(run):
    write_log("F [N]")
    told = run("import", "log.csv", "-o", "scan.h5", "--x", "x", "--u", "u").exits(0).out
    options = [line.split("--")[1].split()[0] for line in told.splitlines() if "Not st" in line]
    assert options[:3] == ["thickness,", "radius", "load"]
    assert not {"load-uncertainty", "radius-uncertainty", "film-law", "rod-friction"} & {*options}


def test_a_refusal_shows_the_command_for_the_own_table(run, folder):
    (folder / "my log.csv").write_text("Weg,Signal,Kraft\n" + "0.5,1.5,1\n" * 9, encoding="utf-8")
    shown = "memscal import 'my log.csv' --x Weg --u Signal -o"
    run("import", "my log.csv", "-o", "scan.h5").exits(2, shown)
    run("import", "my log.csv", "-o", "scan.h5", "--u", "Kraft").exits(2, "--x Weg --u Kraft -o")
    asked = ("import", "my log.csv", "-o", "scan.h5", "--x", "Weg", "--u", "Signal")
    run(*asked).exits(3, "as in 'Signal/mV'")
    run(*asked, "--u-unit", "mV").exits(3, "as in 'Weg/mm'")
    moved = ("import", "my log.csv", "-o", "scan.h5", "--time", "Weg", "--speed", "1")
    run(*moved).exits(2, "memscal import 'my log.csv' --u Signal -o")
    refusal = run("batch", "my log.csv", "-o", "results").exits(3, "recipe").err
    assert str(folder) not in refusal


def test_film_indenter_and_time_are_named_by_options_or_by_the_laboratory(run, folder):
    write_log("F [N]")
    names = ["--film-name", "F7", "--indenter-name", "R2", "--start-time", "2026-11-20T09:30:00Z"]
    made = ("import", "log.csv", "-o", "scan.h5", *OPTIONS.split())
    run(*made, *names).exits(0)
    scan = memscal.read_scan("scan.h5")
    assert (scan.film.name, scan.indenter.name) == ("F7", "R2")
    assert scan.start_time == "2026-11-20T09:30:00Z"
    run(*made, "--start-time", "20.11.2026", "--force").exits(2, "20.11.2026")
    lab = "film.name = 'F8'\nindenter.name = 'R3'\nconditions.start_time = 2026-11-21\n"
    (folder / "lab.toml").write_text(lab, encoding="utf-8")
    run(*made, "--lab", "lab.toml", "--force").exits(0)
    scan = memscal.read_scan("scan.h5")
    assert (scan.film.name, scan.indenter.name, scan.start_time) == ("F8", "R3", "2026-11-21")
    run(*made, *names, "--lab", "lab.toml", "--force").exits(3, "lab.toml")


def test_a_sliding_scan_and_a_slow_sensor_are_stated_on_the_command_line(run, folder):
    lines = "".join(f"{i},{i % 9},{0.3 * i},{1 if i < 8 else -1}\n" for i in range(17))
    (folder / "slid.csv").write_text(f"t/s,U/mV,Q/N,way\n{lines}")
    lab = folder / "lab.toml"
    lab.write_text("sensor.resonance = 90.0\nsensor.quality = 8.0\n")
    made = "import slid.csv -o slid.h5 --time t --speed 2 --u U --sliding way --tangential-load Q "
    made += "--sliding-friction 0.3 --low-pass 5 --lab lab.toml --force"
    told = run(*made.split()).exits(0).out
    assert "Sensor: low-pass 5 Hz" in told
    # Also of what the laboratory adds.
    said = "With lab.toml: Sensor: low-pass 5 Hz (no uncertainty stated), resonance 90 Hz"
    assert said in told
    scan = memscal.read_scan("slid.h5")
    assert (scan.motion, scan.speed, scan.x.max()) == ("sliding", 2e-3, 14e-3)
    assert scan.sliding_friction == 0.3
    assert said in scan.notes
    assert scan.sensor.dynamics == memscal.Dynamics(low_pass=5.0, resonance=90.0, quality=8.0)
    shown = run("inspect", "slid.h5").exits(0).out
    for path in ("data/direction", "data/tangential_load", "indenter/speed", "dynamics/quality"):
        assert path in shown
    lab.write_text("sensor.low_pass = 6.0\n")
    run(*made.split()).exits(3, "low pass of the sensor is 6.0 in lab.toml")
