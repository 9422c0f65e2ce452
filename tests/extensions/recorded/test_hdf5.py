"""HDF5 files of other programs: what is refused names its path, and nothing is written."""

from pathlib import Path

import h5py
import numpy as np
import pytest

from memscal import import_table

X = np.linspace(-6.0, 6.0, 13)
HELD = {
    "x": (X, "mm"),
    "u": (X**2, "mV"),
    "t": (10**18 + 10**8 * np.arange(13), ["ns"]),
    "N": (X, "N"),
    "bare": (X, ""),
    "plane": (np.eye(13), "mm"),
    "short": (X[1:], "mm"),
    "text": ("x", "mm"),
}
REFUSED = {
    "N": "must be a length",
    "bare": "states no unit",
    "plane": "shape (13, 13)",
    "short": "shape (12,)",
    "text": "neither integers nor",
    ".": "is not a dataset",
    "absent": "is missing",
    "soft": "link",
    "endless": "claims",
}


@pytest.fixture
def path(folder):
    with h5py.File("run.nxs", "w") as file:
        file.attrs["default"] = "data"
        data = file.create_group("data")
        data.attrs.update(NX_class="NXdata", signal="u", axes=["x"])
        for name, (values, unit) in HELD.items():
            data[name] = values
            data[name].attrs["unit" if name == "u" else "units"] = unit
        data["soft"] = h5py.SoftLink("/data/x")
        data.create_dataset("endless", (2**44,), "f8", chunks=(2**10,))
    return folder / "run.nxs"


def test_datasets_and_what_nxdata_plots_are_read_in_their_units(path):
    for named in ({}, {"x": "/data/x", "u": "data/u"}):
        found = import_table(path, **named, time="/data/t")
        np.testing.assert_allclose([found.x, found.u_zz], [1e-3 * X, 1e-3 * X**2])
        np.testing.assert_allclose(found.time, 0.1 * np.arange(13), atol=1e-6)


@pytest.mark.parametrize("plotted", [True, False])
@pytest.mark.parametrize(("name", "why"), REFUSED.items())
def test_a_dataset_that_is_no_column_is_refused(run, path, plotted, name, why):
    with h5py.File(path, "r+") as file:
        file["data"].attrs["axes"] = name
    named = [] if plotted else ["--x", f"/data/{name}", "--u", "/data/u"]
    told = run("import", path, "-o", "out.h5", *named).exits(3).err.splitlines()[0]
    if name != ".":
        assert f"/data/{name}" in told
        assert why in told
    assert not Path("out.h5").exists()
