"""An artifact, the shipped laboratory's file, and a certificate made of both."""

from dataclasses import replace

import pytest
from helpers.folders import SHIPPED

import memscal
from memscal.extensions.certificate.certificate import certify
from memscal.extensions.certificate.laboratory import read_laboratory


@pytest.fixture(scope="session")
def laboratory():
    return read_laboratory(SHIPPED / "lab.toml")


@pytest.fixture(scope="session")
def apparatus():
    """The shipped scan, with all that counts stated; the file names the sensor."""
    shipped = memscal.read_scan(SHIPPED / "rod_scan_65.h5")
    stated = {"gain_uncertainty": 0.005, "position_scale_uncertainty": 0.002}
    scan = replace(shipped, sensor=memscal.StressSensor(), **stated)
    return memscal.calibrate(scan).apparatus


@pytest.fixture(scope="session")
def certificate(apparatus, laboratory):
    return certify(apparatus, laboratory)
