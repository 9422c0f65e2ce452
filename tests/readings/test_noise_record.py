"""Noise records: their density and correlation, their files, and what is no record."""

from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.scans import simulated
from scipy.signal import lfilter

import memscal
from memscal.errors import MemscalError
from memscal.readings.noise_record import NoiseRecord, noise_of

STEP = 0.02
U = np.arange(99.0)


def record(u, step=STEP, **stated):
    """Return readings at rest as a record."""
    time = step * np.arange(len(u))
    return memscal.Scan(x=np.zeros(len(u)), u_zz=u, time=time, motion="rest", **stated)


def low_passed(rng, count, time):
    """Noise of variance one and one correlation time."""
    kept = np.exp(-STEP / time)
    steps = np.sqrt(1 - kept**2) * rng.standard_normal(count + 4000)
    return lfilter([1.0], [1.0, -kept], steps)[4000:]


def test_a_low_pass_has_its_density_and_correlation():
    found = []
    lags = np.array([0.0, 0.1, 0.3])
    for seed in range(12):
        noise = noise_of(record(low_passed(np.random.default_rng(seed), 6000, 0.16)))
        frequency = np.array([0.05, 1.0, 10.0])
        exact = 4 * 0.16 / (1 + (2 * np.pi * 0.16 * frequency) ** 2)
        ratio = np.log(noise.spectral_density(frequency) / exact)
        found.append([*ratio, *(noise.covariance(lags) - np.exp(-lags / 0.16))])
        assert noise.corner < 0.1
    scatter = np.std(found, axis=0, ddof=1)
    # Six correlation times a decade are right to some percent.
    assert (np.abs(np.mean(found, axis=0)) < 4 * scatter / np.sqrt(len(found)) + 0.05).all()
    assert scatter[3:].max() < 0.3


def test_white_noise_is_independent_and_means_of_it_are_quieter():
    noise = noise_of(record(np.random.default_rng(1).standard_normal(20_000)))
    assert noise.spectral_density(np.array([1.0]))[0] == pytest.approx(2 * STEP, rel=0.1)
    at_once = noise.covariance(np.array([0.0, 0.1]))
    assert at_once == pytest.approx([1.0, 0.0], abs=0.03)
    assert noise.covariance(np.zeros(1), 10)[0] == pytest.approx(0.1, rel=0.1)


def test_a_walk_is_drift_below_a_corner():
    rng = np.random.default_rng(2)
    u = rng.standard_normal(6000) + 0.05 * np.cumsum(rng.standard_normal(6000))
    # The densities 2 dt and 2 (0.05/(2 pi f))^2/dt meet.
    corner = 0.05 / (2 * np.pi * STEP)
    assert noise_of(record(u)).corner == pytest.approx(corner, rel=0.5)


def test_the_mean_of_samples_is_that_of_their_covariances():
    noise = NoiseRecord(STEP, 0.3, np.array([0.1]), np.array([2.0]), 10.0)
    single = noise.covariance(STEP * np.abs(np.subtract.outer(np.arange(8), np.arange(8))))
    means = noise.covariance(STEP * np.array([0.0, 4.0]), 4)
    assert means == pytest.approx([single[:4, :4].mean(), single[:4, 4:].mean()])


@pytest.mark.usefixtures("folder")
def test_a_record_comes_back_alone_and_in_a_scan():
    rest = record(1e-6 * np.random.default_rng(3).standard_normal(200), title="at rest")
    memscal.write_scan(rest, "noise.h5")
    found = memscal.read_scan("noise.h5")
    assert found.motion == "rest"
    assert np.array_equal(found.time, rest.time)
    assert np.allclose(found.u_zz, rest.u_zz, rtol=1e-12)
    with h5py.File("noise.h5") as file:
        assert list(file["/entry/data"].attrs["axes"]) == ["time"]
        assert "indenter" not in file["/entry"]
    scan = replace(simulated(seed=1), noise_record=rest, averaging_length=1e-4, dwell_time=2.0)
    memscal.write_scan(scan, "scan.h5")
    back = memscal.read_scan("scan.h5")
    assert np.allclose(back.noise_record.u_zz, rest.u_zz, rtol=1e-12)
    assert (back.averaging_length, back.dwell_time) == (1e-4, 2.0)


@pytest.mark.usefixtures("folder")
def test_the_noise_of_a_record_takes_the_place_of_what_is_stated():
    scan = simulated(seed=1)
    rng = np.random.default_rng(4)
    size = 3 * float(scan.u_zz_errors[0])
    memscal.write_scan(record(size * low_passed(rng, 6000, 0.5)), "noise.h5")
    timed = replace(scan, time=0.5 * np.arange(scan.x.size))
    plain = memscal.calibrate(scan, other=False).apparatus
    noisy = memscal.calibrate(timed, noise_record=Path("noise.h5"), other=False).apparatus
    noise = [each.budget["conversion_constant"]["noise"] for each in (plain, noisy)]
    assert noise[1] > 2 * noise[0]
    carried = replace(timed, noise_record=memscal.read_scan("noise.h5"))
    again = memscal.calibrate(carried, other=False).apparatus
    assert again.budget == noisy.budget


def timed(times):
    """Calibrate a scan of such times with a record."""
    return memscal.calibrate(replace(simulated(seed=1), time=times), noise_record=record(U))


@pytest.mark.parametrize(
    ("made", "words"),
    [
        (lambda: noise_of(simulated(seed=1)), "is no noise record"),
        (lambda: noise_of(record(np.full(300, 1e-3))), "are equal"),
        (lambda: noise_of(record(np.arange(20.0))), "even steps"),
        (lambda: noise_of(record(np.r_[U, np.full(50, np.nan), U])), "even steps"),
        (lambda: memscal.calibrate(record(U)), "is a noise record or a dwell record"),
        (lambda: timed(np.r_[np.nan, 1:65]), "no time of 1 reading,"),
        (lambda: timed(np.full(65, np.nan)), "no time of 65 readings"),
        (lambda: timed(np.r_[0:64, 63]), "of 1 that of another"),
        (lambda: replace(simulated(seed=1), noise_record="n.h5"), "noise record of the scan"),
        (lambda: replace(simulated(seed=1), noise_record=simulated(seed=1)), "noise record of the"),
        (
            lambda: memscal.calibrate(simulated(seed=1), noise_record=record(U)),
            "time",
        ),
        (
            lambda: memscal.calibrate(
                replace(simulated(seed=1), time=np.arange(65.0)),
                noise_record=record(U, unit="A"),
            ),
            "in V, those of its noise record in A",
        ),
    ],
)
def test_what_is_no_record_of_a_scan_is_refused(made, words):
    with pytest.raises(MemscalError, match=words):
        made()


def test_a_record_is_imported_and_used_on_the_command_line(run, artifact, scan):
    rng = np.random.default_rng(5)
    rows = "\n".join(f"{0.02 * i:.2f},{0.01 * u:.6f}" for i, u in enumerate(rng.normal(size=900)))
    Path("rest.csv").write_text(f"t [s],U [mV]\n{rows}\n", encoding="utf-8")
    stated = "import rest.csv --u U --time t -o noise.h5 --noise-record"
    done = run(*stated.split()).exits(0)
    assert "mV (rms) at 50 readings a second" in done.out
    assert "Not stated" not in done.out
    run("import", "rest.csv", "--u", "U", "--noise-record", "-o", "b.h5").exits(3, "in time")
    run(*stated.split(), "--force", "--speed", "2").exits(3, "in time, at rest")
    run("calibrate", "noise.h5").exits(3, "noise record")
    run("restore", str(artifact), "noise.h5").exits(3)
    run("inspect", "noise.h5").exits(0)
    timed = replace(memscal.read_scan(scan), time=np.arange(65.0))
    memscal.write_scan(timed, "timed.h5")
    for command in (["calibrate"], ["restore", "a.h5"], ["apply", "a.h5"]):
        written = ["-o", "a.h5" if command == ["calibrate"] else "out.h5"]
        done = run(
            *command, "timed.h5", "--noise-record", "noise.h5", "--json", "--force", *written
        )
        assert done.code in (0, 1), done.err
        assert "noise are those of noise.h5" in done.out
    given = ["compare", "a.h5", "out.h5", "--noise-record", "noise.h5"]
    assert "measured stress" in run(*given).err
    run("restore", str(artifact), str(scan), "--noise-record", "noise.h5").exits(3, "--time")
