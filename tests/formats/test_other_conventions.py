"""Scans in which other programs state axes, scales and missing values in their own ways."""

import h5py
import numpy as np
import pytest
from helpers.builders import make_scan

from memscal import read_scan, write_scan
from memscal.errors import InputError
from memscal.formats.inspection import check

SIDE = np.linspace(-4e-3, 4e-3, 9)
U = np.exp(-((SIDE - 1e-3) ** 2 + (SIDE[:, None] + 2e-3) ** 2) / 8e-6)


def scales(file, order):
    for i, name in enumerate(order):
        file[name].make_scale(name)
        file["u_zz"].dims[i].attach_scale(file[name])


WAYS = {
    "list": lambda file, order: file.attrs.update(axes=[*order]),
    "text": lambda file, order: file.attrs.update(axes=",".join(order)),
    "of the signal": lambda file, order: file["u_zz"].attrs.update(axes=":".join(order)),
    "indices": lambda file, order: file.attrs.update(
        x_indices=order.index("x"), y_indices=[order.index("y")]
    ),
    "one index": lambda file, order: file.attrs.update(x_indices=order.index("x")),
    "dimension scales": scales,
}


@pytest.fixture
def path(tmp_path):
    """A square raster whose axes nothing states, as another program may write it."""
    path = tmp_path / "scan.h5"
    write_scan(make_scan(), path)
    with h5py.File(path, "r+") as file:
        del file["/entry/data"], file.attrs["memscal_content_sha256"]
        for name, values in {"x": SIDE, "y": SIDE, "u_zz": U}.items():
            file[f"/entry/data/{name}"] = values
            file[f"/entry/data/{name}"].attrs["units"] = ["V" if name == "u_zz" else "m"]
    return path


@pytest.mark.parametrize("order", ["yx", "xy"])
@pytest.mark.parametrize("way", WAYS)
def test_a_square_raster_lies_as_its_axes_are_stated(path, way, order):
    with pytest.raises(InputError, match=r"nothing states which axis is which(.|\n)*axes to"):
        read_scan(path)
    with h5py.File(path, "r+") as file:
        data = file["/entry/data"]
        data["u_zz"][...] = U if order == "yx" else U.T
        WAYS[way](data, order)
    np.testing.assert_array_equal(read_scan(path).u_zz, U)
    with h5py.File(path, "r+") as file:
        other = "of the signal" if way != "of the signal" else "list"
        WAYS[other](file["/entry/data"], order[::-1])
    with pytest.raises(InputError, match=r"x as axis 0, .*x as axis 1(.|\n)*Transpose"):
        read_scan(path)


def test_names_of_a_signals_own_for_its_axes_state_nothing(path):
    with h5py.File(path, "r+") as file:
        WAYS["list"](file["/entry/data"], "yx")
        file["/entry/data/u_zz"].attrs["axes"] = "row:column"
    np.testing.assert_array_equal(read_scan(path).u_zz, U)


LARGEST = U.max()


@pytest.mark.parametrize(
    ("stated", "beside", "changed"),
    [
        ({"scale_factor": 1.0, "add_offset": 0, "_FillValue": np.nan}, (), False),
        ({"missing_value": [-9999.0, 7.0], "valid_range": [0.0, 5.0]}, (), False),
        ({"valid_max": 0.9 * LARGEST}, (), True),
        ({"valid_range": [0.0, 0.9 * LARGEST]}, (), True),
        ({"scale_factor": 1e-3}, (), True),
        ({"scale": "linear", "offset": [0, 0, 0], "conversion": 1}, (), False),
        ({"add_offset": [2.0]}, (), True),
        ({"offset": 2}, (), True),
        ({"_FillValue": np.float32(LARGEST)}, (), True),
        ({"missing_value": [-1.0, LARGEST]}, (), True),
        ({}, ("u_zz_scaling_factor",), True),
        ({}, ("x_offset",), True),
        ({}, ("scaling_factor",), True),
        ({}, ("u_zz_mask",), True),
        ({}, ("mask",), True),
    ],
)
def test_numbers_that_another_statement_changes_are_refused(path, stated, beside, changed):
    with h5py.File(path, "r+") as file:
        scales(file["/entry/data"], "yx")
        file["/entry/data/u_zz"].attrs.update(stated)
        for name in beside:
            file[f"/entry/data/{name}"] = 2.0
    assert check(path)[-1].passed is not changed
    if changed:
        with pytest.raises(InputError, match=f"{[*stated, *beside][0]} changes its numbers"):
            read_scan(path)
