"""The laboratory's file: what it may hold, and what scans and artifacts take from it."""

from pathlib import Path

import pytest
from helpers.folders import SHIPPED

import memscal
from memscal import MemscalError
from memscal.cli import main
from memscal.extensions.certificate.laboratory import Measured, read_laboratory

pytestmark = pytest.mark.usefixtures("folder")


def read(text):
    Path("lab.toml").write_text(text, encoding="utf-8")
    return read_laboratory("lab.toml")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("[laboratories]\nname = 'a'", "Did you mean laboratory?"),
        ("[load_cell]\nname = 'a'", "equipment, conditions, certificate"),
        ("[sensor]\nserial_number = '1'", "Did you mean serial?"),
        ("[decision]\ngaussian_sigm = {lower = 1, unit = 'mm'}", "Did you mean gaussian_sigma?"),
        ("[laboratory]\nname = 5", "[laboratory] name is 5, but should be text"),
        ("[laboratory]\nname = ' '", "should be text"),
        ("[laboratory]\ncountry = 'France'", "two capital letters"),
        ("[laboratory]\nprefix = 'a\"<b'", "up to 40 letters"),
        ("[decision]\nrule = 'lenient'", '"guarded acceptance"'),
        ("[decision]\ncentre = {lower = 2, upper = 1, unit = 'mm'}", "lower below the upper"),
        ("[decision]\ncentre = {unit = 'mm'}", "should be limits"),
        ("[decision]\nguard_band = '1'", "should be a number"),
        ("customer = 1", "as a table"),
        ("[conditions]\ntemperature = 23.0", "a table of value, unit, uncertainty"),
        ("[conditions]\ntemperature = {value = 23.0, unit = 'mm'}", "must be a temperature"),
        ("[conditions]\ntemperature = {value = 23.0, unit = 'degC', u = 1}", "uncertainty"),
        ("[conditions]\nhumidity = {value = 45, unit = '%', uncertainty = -1}", "u not negative"),
        ("[conditions]\nhumidity = {value = nan, unit = '%'}", "should be a number"),
        ("[conditions]\nstart_time = 'noon'", "2026-11-20T09:30:00+01:00"),
        ("[[equipment]]\nname = 'a'\ndate = 2026-01-01T10:00:00", "be a date"),
        ("[[equipment]]\nkind = 'stage'\n[[equipment]]\nkind = 'stage'", "more than one stage"),
        ("[[equipment]]\nkind = 'volt meter'", "or left out (did you mean voltmeter?)."),
        ("[certificate]\nlanguage = 'xx'", "should be en"),
        ("[equipment]\nname = 'a'", "[[equipment]]"),
        ("[sensor\n", "no TOML"),
    ],
)
def test_what_a_file_may_not_hold_is_refused_by_name(text, words):
    with pytest.raises(MemscalError) as refusal:
        read(text)
    assert words in str(refusal.value)
    assert "lab.toml" in str(refusal.value)


def test_degrees_celsius_are_kelvins_of_another_zero_and_the_same_uncertainty():
    for value, unit in ((23.0, "degC"), (23.0, "°C"), (296.15, "K")):
        quantity = f'{{value = {value}, unit = "{unit}", uncertainty = 0.3}}'
        found = read(f"[conditions]\ntemperature = {quantity}")
        assert found.stated("conditions", "temperature") == pytest.approx(Measured(296.15, 0.3))


IMPORT = (
    "--x x --x-unit mm --u U --u-unit mV --load 1 --radius 0.25 "
    "--young-modulus 2.2 --poisson-ratio 0.5 --thickness 2 --force"
)


def imported(*options):
    """Import a simulated scan from a table with the shipped file; return the exit code."""
    scan = memscal.simulate(seed=1)
    lines = [f"{x * 1e3},{u * 1e3}" for x, u in zip(scan.x, scan.u_zz, strict=True)]
    Path("scan.csv").write_text("\n".join(["x,U", *lines]), encoding="utf-8")
    given = [*IMPORT.split(), "-o", "scan.h5", "--lab", str(SHIPPED / "lab.toml"), *options]
    return main(["import", "scan.csv", *given])


def test_an_imported_scan_and_its_artifact_carry_the_file_but_no_customer():
    assert imported() == 0
    scan = Path("scan.h5")
    artifact = Path("artifact.h5")
    memscal.calibrate(scan).apparatus.save(artifact)
    for held in (memscal.read_scan(scan), memscal.load_apparatus(artifact)):
        assert held.sensor.serial_number == "SN-PLACEHOLDER-1"
        assert held.sensor.manufacturer == "Example Manufacturer (placeholder)"
        assert held.sensor.temperature == pytest.approx(296.15)
        assert held.sensor.temperature_uncertainty == pytest.approx(0.3)
        assert held.load_cell.certificate == "CERT-PLACEHOLDER-1"
        assert (held.stage.name, held.stage.certificate_date) == ("example stage", "2026-01-16")
        assert held.user.name == "B. Placeholder"
        assert held.user.affiliation == "Example Laboratory (placeholder)"
        assert held.start_time == "2026-02-02T09:00:00+01:00"
    for content in (scan.read_bytes(), artifact.read_bytes()):
        assert b"B. Placeholder" in content
        assert b"Customer" not in content
        assert b"A. Placeholder" not in content


def test_a_scan_that_says_otherwise_than_the_file_is_refused(capsys):
    assert imported("--sensor-name", "another") == 3
    assert "name of the sensor is 'a simulated sensor'" in capsys.readouterr().err
