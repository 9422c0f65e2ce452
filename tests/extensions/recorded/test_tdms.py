"""TDMS files of LabVIEW: units, times and scales of properties; what is not whole is refused."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from nptdms import ChannelObject, TdmsWriter

from memscal import import_table
from memscal.errors import MemscalError

X = np.arange(13)
SCALE = {
    "NI_UnitDescription": "Volts",
    "NI_Number_Of_Scales": 1,
    "NI_Scale[0]_Scale_Type": "Linear",
    "NI_Scale[0]_Linear_Slope": 1e-4,
    "NI_Scale[0]_Linear_Y_Intercept": 0.0,
}
WAVE = {"unit_string": "mV", "wf_increment": 0.02}


def write(u: dict[str, Any], x: dict[str, Any]) -> bytes:
    """Write x, and x once more as the readings, with their properties, in two segments."""
    held = [ChannelObject("A/b", "x", X, {"unit_string": "mm", **x})]
    with TdmsWriter("a.tdms") as writer:
        for _ in range(2):
            writer.write_segment([*held, ChannelObject("A/b", "u", X, u)])
    return Path("a.tdms").read_bytes()


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
def test_units_times_and_scales_of_the_properties_count(u, x, scale, why):
    write(u, x)
    if why:
        with pytest.raises(MemscalError, match=why):
            import_table("a.tdms", x="A/b/x", u="A/b/u")
        return
    found = import_table("a.tdms", x="A/b/x", u="A/b/u")
    np.testing.assert_allclose([found.x, found.u_zz], np.outer([1e-3, scale], np.tile(X, 2)))
    if u is WAVE:
        np.testing.assert_allclose(found.time, 0.02 * np.arange(26))


@pytest.mark.usefixtures("folder")
def test_a_file_that_is_cut_short_or_claims_too_much_is_refused():
    data = write(WAVE, {})
    altered = [data[:n] for n in range(4, len(data), 7) if n != data.rindex(b"TDSm")]
    altered += [data.replace(b"\x0d" + bytes(7), struct.pack("<Q", n)) for n in (2**62, 999, 14)]
    many = b"TDSm" + bytes(8) + struct.pack("<QQ", 10**4, 10**4) + bytes(10**4)
    for wrong in [*altered, many * 999, data.replace(b"A/b", b"A\xffb")]:
        Path("a.tdms").write_bytes(wrong)
        with pytest.raises(MemscalError, match=r"TDMS|does not end|values"):
            import_table("a.tdms", x="A/b/x", u="A/b/u")
