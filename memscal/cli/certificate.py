"""``memscal certificate``: an artifact and a laboratory's file to a certificate of calibration."""

from pathlib import Path

import click

from memscal.cli.failures import exit_code_of
from memscal.cli.options import FILE, accept_no_other_suffix, option, output_options
from memscal.cli.output import emit_json, emit_tables, message, note, prove_writable, write_files
from memscal.summaries.table import Table

EXAMPLES = """\b
Examples:
  memscal certificate scan.apparatus.h5 --lab lab.toml -o certificate.pdf
  memscal certificate scan.apparatus.h5 --lab lab.toml -o certificate.html -o certificate.xml

\b
The repository has an example of lab.toml in calibration_data, and docs/certificate.md describes
it. A PDF needs the extra certificate: pip install "memscal[certificate]".
"""

SUFFIXES = (".html", ".pdf", ".xml")


@click.command("certificate", epilog=EXAMPLES)
@click.argument("artifact", type=FILE)
@option("--lab laboratory", FILE, required=True, metavar="lab.toml")(
    "Laboratory's file: laboratory, customer, sensor, equipment, conditions, decision rule."
)
@option("-o --output outputs", FILE, multiple=True, required=True, metavar="FILE.html|pdf|xml",
        callback=accept_no_other_suffix(SUFFIXES))(
    "Certificate to write: a page, a tagged PDF/A-3 that holds the XML, or a Digital Calibration "
    "Certificate (DCC). May be repeated."
)  # fmt: skip
@output_options
def command(
    artifact: Path, laboratory: Path, outputs: tuple[Path, ...], as_json: bool, force: bool
) -> int:
    """Write a certificate of calibration, if nothing that is mandatory is missing.

    Who calibrated what for whom, with which equipment and when; the values with expanded
    uncertainties (k = 2), their correlations and budget; G(r); and, if the laboratory's file gives
    tolerances, a statement of conformity by its decision rule. It is no accredited certificate
    unless that file states an accreditation.
    """
    prove_writable(outputs, force=force, inputs=[artifact, laboratory])
    from memscal.apparatus import load_apparatus
    from memscal.certificate.certificate import certify
    from memscal.formats.laboratory import read_laboratory

    certificate = certify(load_apparatus(artifact), read_laboratory(laboratory))
    forms = {path.suffix.lower() for path in outputs}
    made: dict[str, bytes] = {}
    if forms - {".html"}:
        from memscal.certificate.dcc import certificate_xml

        made[".xml"] = certificate_xml(certificate)
    if forms - {".xml"}:
        from memscal.certificate.page import certificate_page, certificate_pdf

        page = certificate_page(certificate)
        made[".html"] = page.encode("utf-8")
        if ".pdf" in forms:
            made[".pdf"] = certificate_pdf(certificate, page, made[".xml"])
    write_files({path: made[path.suffix.lower()] for path in outputs}, force=force)
    result = {"number": certificate.number, "issued": certificate.issued}
    if as_json:
        decided = [
            {"name": of.of.quantity.name, "conforms": of.accepted, "probability": of.probability}
            for of in certificate.conformity
        ]
        head = {"schema_version": "1", "outputs": [str(path) for path in outputs]}
        emit_json({**head, **result, "conformity": decided})
    else:
        words = [(of.of.quantity.words, of.statement) for of in certificate.conformity]
        emit_tables(Table("Certificate", ("", ""), [*result.items(), *words]))
    if certificate.synthetic:
        note("The data are synthetic: the certificate says so on every page.")
    message(f"Written: {', '.join(map(str, outputs))}")
    return exit_code_of(certificate.apparatus.checks, then=" The certificate says so.")
