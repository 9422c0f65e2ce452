"""Scans that cannot be right: refused by every method with their cause, and saturated peaks."""

import re
import shutil
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.scans import RING, TAILS, simulated

import memscal
from memscal import Scan
from memscal.cli import main
from memscal.deconvolution.division import regulariser_names
from memscal.errors import FitError, InputError, MemscalError
from memscal.model.checks import QualityCheck

SHIPPED = Path(__file__).parents[2] / "calibration_data" / "rod_scan_65.h5"
SCAN = memscal.read_scan(SHIPPED)
FILM, RADIUS, X = "sample/film/thickness", "indenter/radius", "data/x"


def altered(path: str, factor: float) -> Scan:
    """Return the shipped scan with one length scaled."""
    if path == FILM:
        return replace(SCAN, film=replace(SCAN.film, thickness=factor * SCAN.film.thickness))
    if path == RADIUS:
        return replace(SCAN, indenter=memscal.Rod(radius=factor * SCAN.indenter.radius))
    return replace(SCAN, x=factor * SCAN.x)


def refused(scan: Scan, error: type[MemscalError] = FitError, **options: object) -> str:
    with pytest.raises(error) as caught:
        memscal.calibrate(scan, **options)
    return str(caught.value)


def number(before: str, after: str, text: str) -> float:
    """Return the number that stands between words of a message."""
    return float(re.search(re.escape(before) + r"([\d.]+)" + re.escape(after), text)[1])


def saturation(scan: Scan) -> QualityCheck:
    checks = memscal.calibrate(scan).apparatus.checks
    return next(check for check in checks if check.name == "saturation")


@pytest.mark.parametrize(("path", "factor", "unit"), [
    (FILM, 1.25, ""), (FILM, 2.0, ""), (FILM, 10.0, "mm stated as cm"),
    (X, 0.8, ""), (X, 0.5, ""), (X, 0.1, "cm stated as mm"),
])  # fmt: skip
def test_a_narrow_scan_is_refused_with_the_length_at_which_it_fits(path, factor, unit) -> None:
    said = refused(altered(path, factor))
    assert "narrower than its reference" in said
    assert unit in said
    if path == FILM:
        assert number(f"{FILM}) of ", " mm", said) == pytest.approx(2.0, rel=0.1)
    else:
        assert number(f"{X}) ", " times", said) == pytest.approx(1 / factor, rel=0.1)


def test_a_rod_stated_too_wide_is_refused_with_its_radius() -> None:
    # A rod much narrower than the film is thick leaves no trace: a limit is all that can be told.
    assert 0.25 < number(f"{RADIUS}) of at most ", " mm", refused(altered(RADIUS, 4.0))) < 1.0
    small = memscal.GaussianMixture((1.0,), (0.3e-3,))
    scan = simulated(rod=memscal.Rod(radius=0.7e-3), kernel=small, noise=1e-4, seed=1)
    said = refused(replace(scan, indenter=memscal.Rod(radius=1e-3)))
    assert number(f"{RADIUS}) of ", " mm", said) == pytest.approx(0.7, rel=0.1)


def test_a_reference_from_elsewhere_that_is_too_wide_is_refused_with_its_scale() -> None:
    film = replace(SCAN.film, thickness=1.5 * SCAN.film.thickness)
    wide = memscal.indent(film, SCAN.indenter, load=SCAN.load).profile()
    said = refused(SCAN, reference=wide)
    assert number("reference/r) ", " times", said) == pytest.approx(1 / 1.5, rel=0.1)


def test_a_sensor_that_the_film_hides_is_refused_with_the_width_that_is_hidden() -> None:
    point = memscal.GaussianMixture((1.0,), (1e-6,))
    said = refused(simulated(kernel=point, noise=0.02, seed=1))
    assert 0.05 < number("width below ", " mm", said) < 0.5


@pytest.mark.parametrize("method", regulariser_names())
def test_no_method_writes_nonsense(method: str, tmp_path: Path, capsys) -> None:
    path = Path(shutil.copy(SHIPPED, tmp_path / "scan.h5"))
    with h5py.File(path, "r+") as file:
        file["entry/sample/film/thickness"][...] = 2.5
    assert main(["calibrate", str(path), "--method", method]) == 3
    assert "scan.h5: the scan is narrower" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(("path", "factor", "words"), [
    (X, 1e3, "mm stated as m"), (X, 1e-3, "m stated as mm"), (X, 1 / 25.4, "inches stated as mm"),
    (X, 25.4, "mm stated as inches"), (FILM, 1e-2, "of 0.63 to 3.6 mm"),
    (FILM, 1e3, "mm stated as m"), (RADIUS, 10.0, "mm stated as cm"), (RADIUS, 1e3, "um as mm"),
])  # fmt: skip
def test_lengths_of_different_scale_are_refused_with_the_unit(path, factor, words) -> None:
    said = refused(altered(path, factor), InputError)
    assert words in said
    assert f"/entry/{path}" in said


@pytest.mark.parametrize(("scan", "words"), [
    (simulated(half_range=0.8e-3, points=33, seed=1), "noise, but the scan is too short"),
    (simulated(noise=0.6, seed=1), "does not rise above its noise"),
    (replace(SCAN, u_zz=SCAN.u_zz + np.interp(SCAN.x - 5e-3, SCAN.x, SCAN.u_zz)), "second peak"),
])  # fmt: skip
def test_what_is_not_determined_is_refused_with_its_reason(scan: Scan, words: str) -> None:
    assert words in refused(scan)


@pytest.mark.parametrize("kernel", [memscal.GaussianMixture(), RING, TAILS])
@pytest.mark.parametrize("noise", [0.001, 0.005])
def test_a_clipped_peak_fails_and_a_whole_one_passes(kernel, noise: float) -> None:
    clean = simulated(kernel=kernel, noise=0.0, seed=1)
    top, size = float(clean.u_zz.max()), clean.x.size
    clean = replace(clean, u_zz_errors=np.full(size, noise * top))
    scatter = np.random.default_rng(1).normal(0.0, noise * top, size)
    readings = clean.u_zz + scatter
    assert saturation(replace(clean, u_zz=readings)).passed
    # Readings of a coarse converter may be equal at the top.
    rounded = np.round(readings / top * 200) * top / 200
    assert saturation(replace(clean, u_zz=rounded, u_zz_errors=None)).passed
    # The converter clips after the noise, the amplifier before it.
    for clipped in (np.minimum(readings, 0.75 * top), np.minimum(clean.u_zz, 0.75 * top) + scatter):
        assert saturation(replace(clean, u_zz=clipped)).value >= 3


def test_the_check_of_saturation_names_the_points() -> None:
    ceiling = 0.9 * SCAN.u_zz.max()
    places = "; ".join(f"{x * 1e3:.4g}" for x in SCAN.x[SCAN.u_zz > ceiling])
    check = saturation(replace(SCAN, u_zz=np.minimum(SCAN.u_zz, ceiling)))
    assert f"here at {places} mm" in check.meaning
