"""Records as groups of files, and the paths at which each kind of file holds them."""

from __future__ import annotations

from memscal.formats.codec import Record
from memscal.formats.schema import ARTIFACT_SCHEMA, REFERENCE_SCHEMA, SCAN_SCHEMA, STRESS_SCHEMA
from memscal.model import records

__all__ = [
    "CHECK",
    "CONE",
    "CONTACT",
    "FIELD",
    "FILM",
    "INDENTER",
    "INDENTER_FACE",
    "LAYOUTS",
    "LOAD",
    "NUMERICS",
    "PROCESS",
    "PROFILE",
    "PROFILE_NOTES",
    "RADIAL",
    "RADIAL_COVARIANCE",
    "RADIAL_VERSION_1_0",
    "RECONVOLUTION",
    "ROUND_INDENTER",
    "SENSOR",
    "SOLVER",
    "STRESS_PROFILE",
    "TRANSFER",
]

FILM = Record("NXcollection", records.FILM)
INDENTER = Record("NXcollection", records.INDENTER)
LOAD = Record("NXcollection", records.LOAD)
ROUND_INDENTER = Record("NXcollection", records.ROUND_INDENTER)
CONE = Record("NXcollection", records.CONE)
INDENTER_FACE = Record("NXdata", records.INDENTER_FACE, "z")
SENSOR = Record("NXsensor", records.SENSOR)
PROFILE = Record("NXdata", records.PROFILE, "sigma_zz")
CONTACT = Record("NXcollection", records.CONTACT)
SOLVER = Record("NXprocess", records.SOLVER)
NUMERICS = Record("NXparameters", records.NUMERICS)
PROFILE_NOTES = Record("NXprocess", records.PROFILE_NOTES)
FIELD = Record("NXdata", records.FIELD, "g")
RADIAL = Record("NXdata", records.RADIAL, "g")
RADIAL_COVARIANCE = Record("NXdata", records.RADIAL_COVARIANCE, "g_covariance")
RADIAL_VERSION_1_0 = Record("NXdata", records.RADIAL_VERSION_1_0, "g")
TRANSFER = Record("NXdata", records.TRANSFER, "modulus")
RECONVOLUTION = Record("NXdata", records.RECONVOLUTION, "u_zz")
CHECK = Record("NXcollection", records.CHECK)
PROCESS = Record("NXprocess", records.PROCESS)
STRESS_PROFILE = Record("NXdata", records.STRESS_PROFILE, "s_zz")

_MEASURED_ON = {
    "/entry/indenter": INDENTER,
    "/entry/sample/film": FILM,
    "/entry/sample": Record("NXsample", records.SAMPLE),
    "/entry/instrument/stress_sensor": SENSOR,
}
LAYOUTS: dict[str, dict[str, Record]] = {
    SCAN_SCHEMA: {
        "/entry": Record("NXentry", records.EXPERIMENT),
        "/entry/data": Record("NXdata", records.SCAN_DATA, "u_zz"),
        "/entry/reference": PROFILE,
        **_MEASURED_ON,
        "/entry/synthetic": Record("NXcollection", records.SYNTHETIC),
    },
    REFERENCE_SCHEMA: {
        "/entry/reference": PROFILE,
        "/entry/parameters": CONTACT,
        "/entry/parameters/indenter": INDENTER,
        "/entry/parameters/film": FILM,
        "/entry/process/numerics": NUMERICS,
        "/entry/process": Record("NXprocess", records.PROFILE_NOTES + records.SOLVER),
    },
    ARTIFACT_SCHEMA: {
        "/entry/apparatus_function": FIELD,
        "/entry/radial_profile": RADIAL_VERSION_1_0,
        "/entry/radial_covariance": RADIAL_COVARIANCE,
        "/entry/transfer_function": TRANSFER,
        "/entry/reconvolution": RECONVOLUTION,
        **_MEASURED_ON,
        "/entry/process": PROCESS,
    },
    STRESS_SCHEMA: {
        **_MEASURED_ON,
        "/entry/sensor": Record("NXcollection", records.CONVERSION),
        "/entry/process": PROCESS,
    },
}
"""Records of each kind of file by their paths, in the order in which ``memscal inspect`` lists."""
