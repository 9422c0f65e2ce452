"""Certificates before the judges: PTB's rules of a DCC, and one of accessible PDF."""

import os
import subprocess
from dataclasses import replace

import pytest
from helpers.folders import SHIPPED

import memscal
from memscal.extensions.certificate.certificate import certify
from memscal.extensions.certificate.dcc import certificate_xml
from memscal.extensions.certificate.laboratory import read_laboratory
from memscal.extensions.certificate.page import certificate_pdf, page_of

pytestmark = pytest.mark.judges

SCHEMA = os.environ.get("MEMSCAL_DCC_SCHEMA", "")
NO_SCHEMA = (
    "No package brings the schema, which its authors serve over the network alone: set "
    "MEMSCAL_DCC_SCHEMA to the path of dcc.xsd 3.3.0, with what it imports beside it."
)


@pytest.fixture(scope="module")
def certificates():
    """A whole one, one of little whose tolerance is not met, and one that is incomplete."""
    laboratory = read_laboratory(SHIPPED / "lab.toml")
    shipped = replace(memscal.read_scan(SHIPPED / "rod_scan_65.h5"), sensor=memscal.StressSensor())
    stated = replace(shipped, gain_uncertainty=0.005, position_scale_uncertainty=0.002)
    apparatus = memscal.calibrate(stated).apparatus
    whole = {name: dict(section) for name, section in laboratory.sections.items()}
    few = {
        name: {k: v for k, v in section.items() if k not in ("street", "post_code", "email")}
        for name, section in whole.items()
    }
    few["laboratory"]["accreditation"] = "body X"
    few["decision"]["conversion_constant"] = {"lower": 2.0, "unit": "V/MPa"}
    keys = ("place", "condition", "deviations", "remarks", "replaces")
    whole["certificate"] = {"received": "2026-01-20", **dict.fromkeys(keys, "as agreed")}
    in_ampere = replace(shipped, unit="A")
    made = {
        "whole": (apparatus, whole),
        "few": (apparatus, few),
        "incomplete": (memscal.calibrate(in_ampere).apparatus, laboratory.sections),
    }
    return {
        name: certify(
            calibrated, replace(laboratory, sections=sections), incomplete=name == "incomplete"
        )
        for name, (calibrated, sections) in made.items()
    }


@pytest.fixture(scope="module")
def documents(certificates):
    return [certificate_xml(certificate) for certificate in certificates.values()]


def test_ptb_s_schematron_finds_no_error(documents):
    from dcclib.validation import SchematronValidator

    judge = SchematronValidator.for_dcc()
    for made in documents:
        said = judge.validate_str(made.decode())
        assert [item.text for item in said.failed_assertions] == []
        # Its reports of role "error" do not count for it; its warning of a list of units of which
        # all are equal is given for any list of units.
        assert [item.text for item in said.successful_reports if item.role == "error"] == []
        warnings = {item.text for item in said.successful_reports if item.role == "warning"}
        assert all("unit" in text for text in warnings)


@pytest.mark.skipif(not SCHEMA, reason=NO_SCHEMA)
def test_it_is_valid_by_the_schema(documents):
    from dcclib.validation import XsdValidator

    judge = XsdValidator.from_file(SCHEMA)
    for made in documents:
        assert [error.message for error in judge.validate_str(made.decode()).errors] == []


def test_pdfua_finds_nothing_in_the_pdf(certificates, documents, tmp_path):
    for (name, certificate), xml in zip(certificates.items(), documents, strict=True):
        path = tmp_path / f"{name}.pdf"
        path.write_bytes(certificate_pdf(page_of(certificate), xml))
        run = ["pdfua", "check", os.fspath(path)]
        outcome = subprocess.run(run, check=False, capture_output=True, text=True)
        assert outcome.returncode == 0, outcome.stdout
