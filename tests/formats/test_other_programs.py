"""The files as other programs of the field see them."""

import h5py
import netCDF4
import pytest
import silx.io.nxdata
import xarray
from helpers.builders import BARE, make_artifact, make_profile, make_scan
from nexusformat.nexus.validate import validate_file

from memscal import write_reference, write_scan
from memscal.formats.artifact import write_artifact

WRITERS = {
    "line": lambda path: write_scan(make_scan("line"), path),
    "repeats": lambda path: write_scan(make_scan("repeats"), path),
    "raster": lambda path: write_scan(make_scan("raster"), path),
    "points": lambda path: write_scan(make_scan("points"), path),
    "plain line": lambda path: write_scan(make_scan(**BARE), path),
    "reference": lambda path: write_reference(make_profile(), path),
    "artifact": lambda path: write_artifact(make_artifact(), path),
}
DEFAULTS = {"reference": "/entry/reference", "artifact": "/entry/apparatus_function"}


@pytest.fixture(params=WRITERS)
def kind(request):
    return str(request.param)


@pytest.fixture
def path(kind, tmp_path):
    file = tmp_path / f"{kind}.h5"
    WRITERS[kind](file)
    return file


def items(path):
    """Return the paths of all groups, and of all datasets with shape and attributes."""
    groups = ["/"]
    datasets = {}

    def visit(name, item):
        if isinstance(item, h5py.Group):
            groups.append(f"/{name}")
        else:
            datasets[f"/{name}"] = (item.shape, item.dtype, dict(item.attrs))

    with h5py.File(path) as file:
        file.visititems(visit)
    return groups, datasets


def test_silx_finds_every_nxdata_valid_and_the_right_default(path, kind):
    found = 0
    with h5py.File(path) as file:
        for group in items(path)[0]:
            if file[group].attrs["NX_class"] == "NXdata":
                assert silx.io.nxdata.NXdata(file[group]).issues == []
                found += 1
        default = silx.io.nxdata.get_default(file)
        assert default.group.name == DEFAULTS.get(kind, "/entry/data")
    assert found == {"artifact": 6, "reference": 1, "plain line": 1}.get(kind, 2)


def test_nexusformat_reports_no_error(path):
    warnings, errors = validate_file(str(path))
    assert errors == 0
    # Our own are the root's schema, its version and digest; the sensor's channel, serial number,
    # manufacturer and temperature; serial number and certificate of load cell and stage.
    assert warnings <= 11


def test_xarray_opens_every_group_without_a_warning(path):
    for group in items(path)[0]:
        with xarray.open_dataset(path, engine="h5netcdf", group=group) as dataset:
            dataset.load()
            assert not [dim for dim in dataset.dims if str(dim).startswith("phony")]


@pytest.mark.parametrize(("kind", "group", "name", "dims", "units"), [
    ("artifact", "apparatus_function", "g", ("y", "x"), "1/mm^2"),
    ("artifact", "radial_covariance", "g_covariance", ("r", "r_prime"), "1/mm^4"),
    ("artifact", "parameters", "covariance", ("parameter", "parameter_prime"), "1"),
    ("raster", "data", "u_zz", ("y", "x"), "mV"),
    ("repeats", "data", "u_zz", ("repeat", "x"), "mV"),
    ("points", "data", "y", ("point",), "mm"),
], indirect=["kind"])  # fmt: skip
def test_xarray_gives_dimensions_in_order_with_units(path, group, name, dims, units):
    with xarray.open_dataset(path, engine="h5netcdf", group=f"/entry/{group}") as dataset:
        assert dataset[name].dims == dims
        assert dataset[name].attrs["units"] == units
        for dim in dims:
            assert dim in dataset.coords


def test_netcdf4_opens_every_group_and_reads_every_variable(path):
    groups, datasets = items(path)
    read = 0
    with netCDF4.Dataset(path) as file:
        for group in groups:
            opened = file if group == "/" else file[group]
            for variable in opened.variables.values():
                variable[...]
                read += 1
    assert read == len(datasets)


def test_every_number_has_a_unit_and_every_array_a_scale_on_every_axis(path):
    for name, (shape, dtype, attributes) in items(path)[1].items():
        if h5py.check_string_dtype(dtype) is not None:
            continue
        assert attributes["units"], name
        with h5py.File(path) as file:
            if attributes.get("CLASS") == b"DIMENSION_SCALE":
                continue
            for i, length in enumerate(shape):
                assert [scale.shape for scale in file[name].dims[i].values()] == [(length,)], name


def test_names_are_lower_case_and_links_are_hard(path):
    groups, datasets = items(path)
    for name in [*groups, *datasets]:
        assert name == name.lower()
        assert name.isascii()
    with h5py.File(path) as file:
        for group in groups:
            for child in file[group]:
                assert isinstance(file[group].get(child, getlink=True), h5py.HardLink)
        assert not any("long_name" in attributes for *_, attributes in datasets.values())
