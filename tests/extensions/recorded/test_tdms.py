"""TDMS files of LabVIEW: units, times and scales of properties; what is not whole is refused."""

import struct
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from memscal import MemscalError, import_table

X = np.arange(13)
SCALE = {
    "NI_UnitDescription": "Volts",
    "NI_Number_Of_Scales": 1,
    "NI_Scale[0]_Scale_Type": "Linear",
    "NI_Scale[0]_Linear_Slope": 1e-4,
    "NI_Scale[0]_Linear_Y_Intercept": 0.0,
}
WAVE = {"unit_string": "mV", "wf_increment": 0.02}


@pytest.mark.usefixtures("folder")
@pytest.mark.parametrize(
    ("u", "x", "scale", "why"),
    [
        (WAVE, {}, 1e-3, ""),
        (SCALE, {}, 1e-4, ""),
        ({}, {}, 1, "no unit"),
        (WAVE | {"wf_increment": "often"}, {}, 1, "cannot be read"),
        (WAVE, {"unit_string": "N"}, 1, "must be a length"),
        (WAVE, {"wf_increment": 0.1}, 1, "differs between the channels"),
        (SCALE | {"NI_Number_Of_Scales": 10**9}, {}, 1, "scales"),
    ],
)
def test_what_the_properties_state_counts_and_a_file_that_is_not_whole_is_refused(u, x, scale, why):
    with TdmsWriter("a.tdms") as writer:
        for name, stated in (("x", {"unit_string": "mm", **x}), ("u", u)) * 2:
            writer.write_segment([ChannelObject("A/b", name, X, stated)])
    read = partial(import_table, "a.tdms", x="A/b/x", u="A/b/u")
    if why:
        with pytest.raises(MemscalError, match=why):
            read()
        return
    found = read()
    np.testing.assert_allclose([found.x, found.u_zz], np.outer([1e-3, scale], np.tile(X, 2)))
    if u is WAVE:
        np.testing.assert_allclose(found.time, 0.02 * np.arange(26))
    data = Path("a.tdms").read_bytes()
    claims = [data.replace(b"\x0d" + bytes(7), struct.pack("<Q", n)) for n in (2**62, 999, 14)]
    many = b"TDSm" + bytes(8) + struct.pack("<QQ", 10**4, 10**4) + bytes(10**4)
    unequal = data[: data.rindex(b"TDSm")]
    for wrong in [*claims, many * 999, data[:-1], data[:-130], unequal, data + b"TDSm"]:
        Path("a.tdms").write_bytes(wrong)
        with pytest.raises(MemscalError, match=r"TDMS|does not end|values"):
            read()
