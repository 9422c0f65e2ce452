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
    """The shipped artifact of a sensor without a name, so that the file names it."""
    shipped = memscal.load_apparatus(SHIPPED / "rod_scan_65.apparatus.h5")
    return replace(shipped, sensor=memscal.StressSensor())


@pytest.fixture(scope="session")
def certificate(apparatus, laboratory):
    return certify(apparatus, laboratory)
