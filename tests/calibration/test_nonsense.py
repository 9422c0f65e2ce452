"""Scans that cannot be right: refused by every method with their cause, and saturated peaks."""

import re
import shutil
import warnings
from dataclasses import replace
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.folders import SHIPPED
from helpers.scans import LINEAR_FILM, RING, TAILS, known_apparatus, simulated

import memscal
import memscal.calibration.calibrate as calibrate_module
from memscal.axisymmetry.hankel import Wavenumbers
from memscal.cli import main
from memscal.deconvolution.division import regulariser_names
from memscal.extensions.simulation import rod_scan
from memscal.mechanics.press_rod import press_rod

pytestmark = pytest.mark.filterwarnings("ignore::memscal.errors.UnitWarning")

FULL = pytest.mark.full_study
SCAN = memscal.simulate(film=LINEAR_FILM, seed=65)


def altered(scan=SCAN, film=1.0, x=1.0, rod=0.0):
    """Return a scan with thickness and positions times a factor, and a rod of another radius."""
    film_ = replace(scan.film, thickness=film * scan.film.thickness)
    rod_ = memscal.Rod(radius=rod or scan.indenter.radius)
    with warnings.catch_warnings():  # of films that none has
        warnings.simplefilter("ignore")
        return replace(scan, film=film_, x=x * scan.x, indenter=rod_)


def refused(scan, **options):
    with pytest.raises(memscal.MemscalError) as caught:
        memscal.calibrate(scan, **options)
    return str(caught.value)


def saturation(scan):
    checks = memscal.calibrate(scan).apparatus.checks
    return next(check for check in checks if check.name == "saturation")


SMALL, POINT = (memscal.GaussianMixture((1.0,), (sigma,)) for sigma in (0.3e-3, 1e-6))
THICK_ROD = simulated(rod=memscal.Rod(radius=0.7e-3), kernel=SMALL, noise=1e-4, seed=1)
# It does not state its film, which would be refused at once.
ELSEWHERE = replace(
    press_rod(altered(film=1.5).film, SCAN.indenter, SCAN.load).profile(), film=None
)


@pytest.mark.parametrize(
    ("scan", "options", "words", "truth", "within"),
    [
        pytest.param(altered(film=1.25), {}, r"thickness\) of NUMBER mm", 2.0, 0.1, marks=FULL),
        (altered(film=10), {}, r"thickness\) of NUMBER mm .*mm stated as cm", 2.0, 0.1),
        pytest.param(altered(x=0.8), {}, r"data/x\) NUMBER times", 1.25, 0.1, marks=FULL),
        pytest.param(altered(x=0.5), {}, r"data/x\) NUMBER times", 2.0, 0.1, marks=FULL),
        (altered(x=0.1), {}, r"data/x\) NUMBER times .*cm stated as mm", 10.0, 0.1),
        (altered(THICK_ROD, rod=1e-3), {}, r"radius\) of NUMBER mm", 0.7, 0.1),
        # A rod much narrower than the film is thick leaves no trace: a limit is all there is.
        (altered(rod=1e-3), {}, r"radius\) of at most NUMBER mm", 0.6, 0.5),
        (SCAN, {"reference": ELSEWHERE}, r"reference/r\) NUMBER times", 1 / 1.5, 0.1),
        # Nothing stated is wrong, but the film hides the sensor.
        (simulated(kernel=POINT, noise=0.02, seed=1), {}, "width below NUMBER mm", 0.2, 0.6),
    ],
)
def test_a_narrow_scan_is_refused_with_the_value_at_which_it_fits(
    scan, options, words, truth, within
):
    value = re.search(words.replace("NUMBER", r"([\d.]+)"), refused(scan, **options))
    assert float(value[1]) == pytest.approx(truth, rel=within)


@pytest.mark.parametrize(
    "method",
    [
        pytest.param(name, marks=[] if name == "white-noise" else FULL)
        for name in regulariser_names()
    ],
)
def test_no_method_writes_nonsense(method, tmp_path, capsys):
    path = Path(shutil.copy(SHIPPED / "rod_scan_65.h5", tmp_path / "scan.h5"))
    with h5py.File(path, "r+") as file:
        file["entry/sample/film/thickness"][...] = 2.5
    given = ["calibrate", str(path), "--accept-altered", "--method", method]
    assert main(given) == 3
    assert "scan.h5: the scan is narrower" in capsys.readouterr().err
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    ("scan", "words"),
    [
        (altered(x=1e3), r"data/x\).*mm stated as m,"),
        (altered(x=1e-3), r"data/x\).*\(m stated as mm"),
        (altered(x=1 / 25.4), r"data/x\).*inches stated as mm"),
        (altered(x=25.4), r"data/x\).*mm stated as inches"),
        (altered(film=0.01), r"thickness\) of 0.63 to 3.6 mm"),
        (altered(film=1e3), r"thickness\).*mm stated as m,"),
        (altered(rod=2.5e-3), r"radius\).*mm stated as cm"),
        (simulated(half_range=0.8e-3, points=33, seed=1), r"\d times its noise, but .* too short"),
        (simulated(noise=0.6, seed=1), "does not rise above its noise"),
        (
            replace(SCAN, u_zz=SCAN.u_zz + np.interp(SCAN.x - 5e-3, SCAN.x, SCAN.u_zz)),
            "second peak",
        ),
    ],
)
def test_what_cannot_be_is_refused_with_its_reason(scan, words):
    assert re.search(words, refused(scan))


@pytest.mark.parametrize(
    ("x", "words"),
    [
        (1e3, r"data/x\).*mm stated as m,"),
        (201.168e3, r"1.2e-06 to 2.5e-05 times"),
        (1e-3, "too short|So short"),
        (1e200, r"8e\+197 m(.|\n)*Check the values and their unit"),
    ],
    ids=["m", "furlongs", "um", "1e200"],
)
@pytest.mark.parametrize("measured", [memscal.measure_stress, memscal.restore])
def test_no_stress_is_measured_over_lengths_that_no_film_is_scanned_over(
    measured, x, words, monkeypatch
):
    """In m it took minutes and gigabytes: nothing may be built before it is refused."""
    apparatus = known_apparatus(conversion_uncertainty=0.005, width_uncertainty=0.01)
    monkeypatch.setattr(Wavenumbers, "covering", lambda *_: pytest.fail("it went on"))
    with pytest.raises(memscal.MemscalError) as caught:
        measured(altered(x=x), apparatus, override=True)
    assert re.search(words, str(caught.value))


@pytest.mark.parametrize(
    ("plan", "words"),
    [
        ({"rod": memscal.Rod(radius=0.25)}, "rod's width is 500 mm"),
        ({"film": replace(SCAN.film, thickness=1e-9)}, "step is 0.25 mm"),
        ({"half_range": 3.0, "step": 2e-3}, "span 6000 mm"),
        ({"step": 1.0}, "span 0 mm"),
    ],
)
def test_a_plan_of_such_lengths_is_refused_before_its_rod_is_solved(plan, words, monkeypatch):
    monkeypatch.setattr(rod_scan, "press_rod", lambda *_: pytest.fail("it went on"))
    with pytest.raises(memscal.MemscalError, match=words):
        memscal.design(**plan)


@pytest.mark.parametrize("factor", [1e303, 1e-297, 1e-40])
def test_readings_of_a_size_that_no_quantity_has_are_refused(factor):
    with pytest.raises(memscal.MemscalError, match="u_zz of the scan is"):
        replace(SCAN, u_zz=SCAN.u_zz * factor)
    errors = np.full(SCAN.u_zz.size, 1e-3 * factor)
    with pytest.raises(memscal.MemscalError, match="u_zz_errors of the scan is"):
        replace(SCAN, u_zz_errors=errors)


@pytest.mark.parametrize(
    ("kernel", "noise"), [(memscal.GaussianMixture(), 0.001), (RING, 0.005), (TAILS, 0.005)]
)
def test_a_clipped_peak_fails_and_names_its_points(kernel, noise):
    clean = simulated(kernel=kernel, noise=0.0, seed=1)
    u = clean.u_zz
    top = float(clean.u_zz.max())
    clean = replace(clean, u_zz_errors=np.full(u.size, noise * top))
    scatter = np.random.default_rng(1).normal(0.0, noise * top, u.size)
    assert saturation(replace(clean, u_zz=u + scatter)).passed
    # Readings of a coarse converter may be equal at the top.
    rounded = np.round((u + scatter) / top * 200) * top / 200
    assert saturation(replace(clean, u_zz=rounded, u_zz_errors=None)).passed
    # The converter clips after the noise, the amplifier before it.
    assert saturation(replace(clean, u_zz=np.minimum(u, 0.75 * top) + scatter)).value >= 3
    check = saturation(replace(clean, u_zz=np.minimum(u + scatter, 0.75 * top)))
    places = "; ".join(f"{x * 1e3:.4g}" for x in clean.x[u + scatter > 0.75 * top])
    assert f"here at {places} mm" in check.meaning


@pytest.mark.parametrize("method", ["white-noise", "bayesian", "wiener"])
def test_an_a_that_its_method_does_not_tell_from_zero_is_refused(method, monkeypatch):
    told = calibrate_module.propagate

    def wide(*given):
        results = told(*given)
        sources = {**results.budget["conversion_constant"], "window": results.parameters.values[0]}
        return replace(results, budget={**results.budget, "conversion_constant": sources})

    monkeypatch.setattr(calibrate_module, "propagate", wide)
    assert f"by method {method}: it is not distinct from zero" in refused(SCAN, method=method)


@pytest.mark.parametrize("noise", [0.0, 0.002])
@pytest.mark.parametrize("sentinel", [-40.0, -1.3, 5.0, 40.0, 4e3])
@pytest.mark.parametrize("places", [[0], [34], [64], [2, 40]])
def test_a_sentinel_of_any_size_anywhere_moves_neither_route(places, sentinel, noise):
    scan = simulated(noise=noise)
    u = scan.u_zz.copy()
    u[places] = sentinel * u.max()
    found = memscal.calibrate(replace(scan, u_zz=u)).apparatus
    assert sum(message.kind == "outlier" for message in found.process.messages) == len(places)
    for each in (found, found.other):
        a = each.parameters["conversion_constant"]
        assert a == pytest.approx(1e-7, rel=max(6 * noise, 1e-4))


def test_a_dragged_rod_is_refused_with_a_reference_of_its_own_too():
    own = press_rod(SCAN.film, SCAN.indenter, 1.0).profile(np.linspace(0.0, 20e-3, 200))
    dragged = replace(SCAN, motion="sliding", sliding_direction=1.0, reference=own)
    for reference in (None, "point"):
        with pytest.raises(memscal.MemscalError, match="sliding indenter"):
            memscal.calibrate(dragged, reference=reference)
