"""The scan of an array: its first axis is the sensor, in memory and in files."""

import h5py
import numpy as np
import pytest
from helpers.array_scans import make_array_scan
from helpers.builders import make_artifact, make_scan
from helpers.records import assert_same

import memscal
from memscal import read_scan, write_scan
from memscal.errors import InputError
from memscal.formats.artifact import write_artifact
from memscal.formats.inspection import describe

AXES = {"line": "x", "repeats": "repeat x", "raster": "y x", "points": "point"}


@pytest.mark.parametrize("kind", AXES)
def test_the_scan_of_an_array_comes_back_and_holds_that_of_each_sensor(kind):
    scan = make_array_scan(kind)
    write_scan(scan, "scan.h5")
    found = read_scan("scan.h5")
    assert_same(found, scan, but=("source",))
    one = make_scan(kind)
    assert (found.kind, found.planar, found.shape) == (one.kind, one.planar, one.u_zz.shape)
    third = found.of_sensor("µ 2")
    assert_same(third, found.of_sensor(2))
    assert (third.sensor.name, third.sensors) == ("µ 2", ())
    np.testing.assert_allclose(third.u_zz, 3 * one.u_zz)
    np.testing.assert_array_equal(third.normal_load, one.normal_load)
    assert describe("scan.h5")["layout"]["µ 2"] == [2, 0.1]
    with h5py.File("scan.h5") as file:
        data = file["/entry/data"]
        assert [*data.attrs["axes"]] == ["sensor", *AXES[kind].split()]
        assert data["u_zz"].shape == (3, *data["normal_load"].shape)


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"sensors": ("a", "b", "a")}, "names its sensors 'a', 'b', 'a'"),
        ({"sensors": ("a", "", "c")}, "names its sensors 'a', ''"),
        ({"sensors": ("a", "b\nc", "d")}, r"'b\\nc'(.|\n)*in one line"),
        ({"sensors": ("a", "b")}, r"names 2 sensors, and u_zz has shape \(3, 33\)"),
        ({"sensors": ()}, "layout, board or range, but names no sensors"),
        ({"normal_load": np.ones((3, 33))}, r"normal_load has shape \(3, 33\)"),
        ({"layout": [0, 1, 2]}, r"layout of the scan has shape \(3,\).*\(3, 2\)"),
        ({"layout": [[0, 0], [1, np.nan], [2, 0]]}, "finite"),
        ({"channels": {"u_xz": np.ones((3, 33))}}, "further channels, u_xz"),
    ],
)
def test_what_is_no_array_is_refused(changes, words):
    with pytest.raises(InputError, match=words):
        make_array_scan(**changes)


def test_a_sensor_that_an_array_has_not_is_refused():
    with pytest.raises(InputError, match=r"no sensor T9\.\s*Choose from"):
        make_array_scan().of_sensor("T9")


def renamed(names):
    return lambda data: data["sensor_names"].write_direct(np.array(names, dtype=object))


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (renamed('["T00", "T01"]'), r"names 2 sensors, and u_zz has shape \(3, 33\)"),
        (lambda data: data.pop("sensor_names"), r"sensor as axis 0(.|\n)*sensor_names"),
        (lambda data: data.pop("layout_y"), "finite"),
        (lambda data: data.attrs.update(axes=["x", "sensor"]), "x as axis 0, sensor as axis 1"),
    ],
)
def test_a_file_whose_sensors_do_not_fit_is_refused(change, words):
    write_scan(make_array_scan(), "scan.h5")
    with h5py.File("scan.h5", "r+") as file:
        del file.attrs["memscal_content_sha256"]
        change(file["/entry/data"])
    with pytest.raises(InputError, match=words):
        read_scan("scan.h5")


def test_a_reader_of_one_sensor_refuses_an_array():
    scan = make_array_scan(reference=None, synthetic=None)
    write_scan(scan, "scan.h5")
    write_artifact(make_artifact(), "a.h5")
    readers = [
        lambda: memscal.calibrate(scan),
        lambda: memscal.restore("scan.h5", "a.h5"),
        lambda: memscal.compare("scan.h5", "a.h5"),
    ]
    for read in readers:
        with pytest.raises(InputError, match=r"array of 3 sensors(.|\n)*calibrate_array"):
            read()
    [failed] = memscal.calibrate_many([scan])
    assert "array of 3 sensors" in str(failed.error)
