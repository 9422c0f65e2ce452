"""An artifact, the shipped laboratory's file, and a certificate made of both."""

from dataclasses import replace
from pathlib import Path

import pytest

import memscal
from memscal.extensions.certificate.certificate import Certificate, certify
from memscal.extensions.certificate.laboratory import LaboratoryFile, read_laboratory

DATA = Path(__file__).parents[3] / "calibration_data"


@pytest.fixture(scope="session")
def laboratory() -> LaboratoryFile:
    return read_laboratory(DATA / "lab.toml")


@pytest.fixture(scope="session")
def apparatus() -> memscal.ApparatusFunction:
    """The shipped artifact of a sensor without a name, so that the file names it."""
    shipped = memscal.load_apparatus(DATA / "rod_scan_65.apparatus.h5")
    return replace(shipped, sensor=memscal.StressSensor())


@pytest.fixture(scope="session")
def certificate(apparatus, laboratory) -> Certificate:
    return certify(apparatus, laboratory)
