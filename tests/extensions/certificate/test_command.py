"""``memscal certificate``."""

import shutil
import sys
from pathlib import Path

import pytest
from helpers.folders import SHIPPED


@pytest.fixture
def inputs(tmp_path, monkeypatch):
    """The shipped artifact, of which two uncertainties are not stated, and a laboratory's file."""
    monkeypatch.chdir(tmp_path)
    shutil.copy(SHIPPED / "rod_scan_65.apparatus.h5", "scan.apparatus.h5")
    shutil.copy(SHIPPED / "lab.toml", "lab.toml")
    return ("scan.apparatus.h5", "--lab", "lab.toml")


def test_a_certificate_is_replaced_only_if_forced_and_is_told_as_json(run, inputs):
    run("certificate", *inputs, "-o", "c.xml").exits(3, "--gain-uncertainty", "--incomplete")
    inputs = (*inputs, "--incomplete", "-o", "c.xml")
    run("certificate", *inputs).exits(0, "Warning: The certificate is incomplete")
    run("certificate", *inputs).exits(4, "c.xml")
    made = run("certificate", *inputs, "--force", "--json").exits(0).json
    assert made["number"].encode() in Path("c.xml").read_bytes()
    assert made["conformity"] == []
    assert ["gain" in made["missing"][0], "scale" in made["missing"][1]] == [True, True]
    with Path("lab.toml").open("a", encoding="utf-8") as lab:
        lab.write('\n[[equipment]]\nname = "gauge"\n')
    lines = run("certificate", *inputs, "--force", "--json").exits(0).json["missing"]
    assert sum("serial" in line for line in lines) == 1
    run("certificate", *inputs[:-1], "c.html").exits(0)


def test_without_typst_the_pdf_is_refused_with_the_extra(run, inputs, monkeypatch):
    monkeypatch.setitem(sys.modules, "typst", None)
    inputs = (*inputs, "--incomplete")
    run("certificate", *inputs, "-o", "c.pdf").exits(3, ".[certificate]")
    run("certificate", *inputs, "-o", "c.html").exits(0)
