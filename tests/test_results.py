"""Results of a calibration show themselves as the command line, JSON and arrays say it."""

import sys

import numpy as np
import pytest
from helpers.records import assert_same
from helpers.scans import contact_scan, simulate

import memscal
from memscal.extensions import VIEWS, module


@pytest.fixture(scope="module")
def scan(tmp_path_factory):
    path = tmp_path_factory.mktemp("results") / "scan.h5"
    memscal.write_scan(simulate(seed=1, points=33, drift=0.2), path)
    return path


@pytest.fixture(scope="module")
def calibration(scan):
    return memscal.calibrate(scan)


@pytest.fixture(scope="module")
def loaded(calibration, scan):
    path = scan.with_name("saved.h5")
    calibration.apparatus.save(path)
    return memscal.load_apparatus(path)


@pytest.fixture(scope="module")
def drawn(calibration):
    return memscal.monte_carlo(calibration, draws=6, seed=4)


@pytest.mark.parametrize("methods", [("white-noise", "bayesian"), ("bayesian", "white-noise")])
def test_a_file_holds_both_estimates_and_a_is_that_of_the_method(scan, methods):
    path = scan.with_name("both.h5")
    apparatus = memscal.calibrate(scan, method=methods[0]).apparatus
    apparatus.save(path, overwrite=True)
    loaded = memscal.load_apparatus(path)
    for ours, theirs in ((loaded, apparatus), (loaded.other, apparatus.other)):
        assert ours.parameters.names == theirs.parameters.names
        for record in ("parameters", "radial_profile"):
            for name, stored in vars(getattr(theirs, record)).items():
                if isinstance(stored, np.ndarray):
                    found = getattr(getattr(ours, record), name)
                    np.testing.assert_allclose(found, stored, atol=1e-9 * np.abs(stored).max())
    a = loaded.conversion_constant
    values = loaded.to_dict()
    assert a == pytest.approx(apparatus.parameters["conversion_constant"], rel=1e-12)
    assert list(values["estimates"]) == [*methods, "gaussian"]
    assert loaded.other.method == methods[1]
    first, other = (values["estimates"][method]["conversion_constant"] for method in methods)
    assert_same(first, values["conversion_constant"], rtol=1e-9)
    in_volts = [a, loaded.other.parameters["conversion_constant"]]
    assert [first["value"], other["value"]] == pytest.approx(1e3 * np.array(in_volts), rel=1e-9)
    assert first["value"] != pytest.approx(other["value"], rel=1e-6)
    r = np.linspace(0.0, 12e-3, 200)
    stress = np.exp(-((r / 1e-3) ** 2))
    np.testing.assert_allclose(loaded.predict(r, stress), a * loaded.convolve(r, stress))
    contacts = contact_scan(load=(1.0,), film=loaded.film)
    assert memscal.measure_stress(contacts, loaded).conversion_constant == a


def test_ufloats_have_the_covariance_of_the_parameters(calibration, loaded):
    uncertainties = pytest.importorskip("uncertainties")
    own = calibration.apparatus.parameters
    for result, parameters in ((calibration, own), (loaded, loaded.parameters)):
        numbers = result.ufloats()
        assert tuple(numbers) == parameters.names
        scale = np.sqrt(np.diag(parameters.covariance))
        covariance = np.array(uncertainties.covariance_matrix(list(numbers.values())))
        expected = parameters.covariance / np.outer(scale, scale)
        np.testing.assert_allclose(covariance / np.outer(scale, scale), expected, atol=1e-9)
    ratio = numbers["conversion_constant"] / numbers["conversion_constant_gaussian"]
    assert ratio.nominal_value == pytest.approx(1, abs=0.1)


def test_arrays_stand_on_their_axes_in_si_units(calibration, loaded):
    pytest.importorskip("xarray")
    for result, apparatus in ((calibration, calibration.apparatus), (loaded, loaded)):
        arrays = result.to_xarray()
        profile = apparatus.radial_profile
        field = apparatus.field
        for name, dims, values, unit in (
            ("g", ("r",), profile.g, "1/m^2"),
            ("r", ("r",), profile.r, "m"),
            ("g_covariance", ("r", "r_prime"), profile.g_covariance, "1/m^4"),
            ("modulus", ("k",), apparatus.transfer.modulus, "1"),
            ("k", ("k",), apparatus.transfer.k, "rad/m"),
            ("u_zz", ("position",), apparatus.reconvolution.u_zz, "V"),
            ("field", ("y", "x"), field.g, "1/m^2"),
            ("x", ("x",), field.x, "m"),
        ):
            assert (arrays[name].dims, arrays[name].attrs["units"]) == (dims, unit)
            np.testing.assert_allclose(arrays[name].values, values)
        assert set(arrays.sizes) == {"r", "r_prime", "k", "position", "x", "y"}
    swept = calibration.sweep(amplitudes=3, draws=2).to_xarray()
    assert swept["seed_conversion_constant"].sizes == {"amplitude": 3, "draw": 2}


def test_draws_are_rows_of_a_data_frame(drawn):
    pytest.importorskip("pandas")
    draws = drawn.to_dataframe()
    np.testing.assert_allclose(draws["gaussian_sigma (m)"], drawn.samples[:, 1])
    assert draws.shape == drawn.samples.shape


def test_parameters_are_rows_of_a_data_frame(calibration, loaded):
    pytest.importorskip("pandas")
    for result, apparatus in ((calibration, calibration.apparatus), (loaded, loaded)):
        rows = result.to_dataframe()
        parameters = apparatus.parameters
        assert (rows.index.name, tuple(rows.index)) == ("name", parameters.names)
        a = rows.loc["conversion_constant"]
        expected = [apparatus.conversion_constant, parameters.uncertainty("conversion_constant")]
        assert list(a[["value", "standard_uncertainty"]]) == pytest.approx(expected, rel=1e-12)
        assert list(rows["unit"][:4]) == ["V/Pa", "m", "m", "m"]


FORMS = {"plot": None, "to_dataframe": "frame", "to_xarray": "dataset", "ufloats": "correlated"}


@pytest.mark.parametrize("name", VIEWS)
def test_a_result_has_the_methods_that_its_module_answers(name):
    summary, figure = VIEWS[name]
    hidden = ["fleet.results", "motion.compare_sliding", "motion.creep"]
    places = ["model.holds", *(f"extensions.{place}" for place in hidden)]
    held = [getattr(memscal, name, None), *(vars(module(place)).get(name) for place in places)]
    [kind] = {one for one in held if isinstance(one, type)}
    for method, function in FORMS.items():
        answered = bool(summary) and hasattr(module(summary), function or "")
        assert hasattr(kind, method) is (bool(figure) if function is None else answered)


def test_a_report_is_written_where_a_path_is_given(calibration, tmp_path):
    page = calibration.report(tmp_path / "page.html")
    assert (tmp_path / "page.html").read_text(encoding="utf-8") == page == calibration.report()
    with pytest.raises(memscal.MemscalError, match="folder"):
        calibration.report(tmp_path / "none" / "page.html")


def test_a_missing_library_is_named_with_the_extra_that_brings_it(calibration, monkeypatch):
    monkeypatch.setitem(sys.modules, "xarray", None)
    said = r"(?s)xarray is not installed.*\.\[interop\]"
    with pytest.raises(memscal.MemscalError, match=said):
        calibration.to_xarray()
