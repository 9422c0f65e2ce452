"""Synthetic arrays: what each sensor reads is its own stress and a share of its neighbours'."""

import numpy as np
import pytest
from helpers.scans import STILL, simulate

import memscal
from memscal.errors import InputError


def of_sensor(scan, i, what):
    return scan.synthetic[f"{what}_{scan.sensors[i].lower()}"]


@pytest.mark.parametrize(("array", "shape"), [((1, 4), (65,)), ((2, 3), (29, 29))])
def test_a_sensor_reads_what_it_would_alone_and_a_share_of_its_neighbours(array, shape):
    scan = simulate(array=array, pitch=2e-3, crosstalk=0.03, **STILL)
    n = len(scan.sensors)
    assert scan.u_zz.shape == (n, *shape)
    assert scan.kind == ("line" if array[0] == 1 else "raster")
    alone = [
        simulate(
            points=shape[0],
            half_range=scan.x[-1],
            raster=array[0] > 1,
            conversion_constant=of_sensor(scan, i, "conversion_constant"),
            centre=(of_sensor(scan, i, "centre"), of_sensor(scan, i, "centre_y")),
            **STILL,
        ).u_zz
        for i in range(n)
    ]
    apart = np.hypot(*(scan.layout[:, None] - scan.layout).T)
    shares = np.select([apart == 0, apart < 2.1e-3], [1.0, 0.03])
    expected = np.tensordot(shares, alone, axes=1)
    np.testing.assert_allclose(scan.u_zz, expected, atol=1e-9 * expected.max())


def test_the_scan_goes_on_beyond_the_last_sensors_which_lie_by_the_layout():
    scan = memscal.simulate(array=(1, 10), seed=3)
    centres = np.array([of_sensor(scan, i, "centre") for i in range(10)])
    assert scan.x[-1] - centres.max() > 2 * scan.film.thickness
    assert np.diff(scan.x).max() == pytest.approx(0.25e-3, rel=0.03)
    off = centres - scan.synthetic["centre"] - scan.layout[:, 0]
    # Ten normal deviates of 20 um, one in 1e6 at these ends.
    assert 4e-6 < off.std() < 50e-6
    np.testing.assert_array_equal(scan.layout_uncertainty, 20e-6)


def test_the_command_writes_what_the_library_makes(run, folder):
    line = "simulate -o array.h5 --array 2x2 --pitch 3 --crosstalk 0.01 --seed 5 --json"
    shown = run(*line.split()).exits(0).json
    found = memscal.read_scan("array.h5")
    made = memscal.simulate(array=(2, 2), pitch=3e-3, crosstalk=0.01, seed=5)
    np.testing.assert_allclose(found.u_zz, made.u_zz, rtol=1e-12)
    assert found.sensors == ("T01", "T02", "T03", "T04")
    assert found.synthetic == pytest.approx(made.synthetic)
    assert shown["truth"]["conversion_constant_t03"]["unit"] == "mV/Pa"
    printed = run(*line.split()[:-1], "--force").exits(0).out
    assert "T04" in printed


@pytest.mark.parametrize(
    ("options", "code", "words"),
    [
        ("--array 4", 2, "'4' is not rows x columns, such as 4x4"),
        ("--array 0x3", 3, "number of rows or columns is 0"),
        ("--array 2x2 --crosstalk 1", 3, "crosstalk is 1"),
        ("--crosstalk 0.01", 2, "--crosstalk belongs to --array"),
        ("--experiment sphere --array 2x2", 2, "--array belongs to --experiment rod"),
        ("--array 2x2 --repeats 2", 3, "A raster has one repeat"),
    ],
)
def test_an_array_that_cannot_be_made_is_refused_in_words(run, folder, options, code, words):
    assert words in run("simulate", *options.split()).exits(code).err


def test_an_array_has_no_tangential_channel():
    with pytest.raises(InputError, match="further channels, u_xz"):
        memscal.simulate(array=(1, 2), shear=(memscal.GaussianMixture(), 1e-7))
