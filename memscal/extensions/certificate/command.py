"""``memscal certificate``: an artifact and a laboratory's file to a certificate of calibration."""

from pathlib import Path

import click

from memscal.cli import output as out
from memscal.cli.failures import exit_code_of
from memscal.cli.options import FILE, artifact_argument, flag, option, output_options, repeatable
from memscal.summaries.table import Table

EXAMPLES = """\b
Examples:
  memscal certificate scan.apparatus.h5 --lab lab.toml -o certificate.pdf
  memscal certificate scan.apparatus.h5 --lab lab.toml -o certificate.html -o certificate.xml

\b
docs/certificate.md describes lab.toml; calibration_data has an example.
A PDF needs the extra certificate: pip install ".[certificate]".
"""

_FORM = out.FigurePath((".html", ".pdf", ".xml"))


@click.command("certificate", epilog=EXAMPLES)
@artifact_argument
@option("--lab laboratory", FILE, required=True, metavar="lab.toml")(
    "Laboratory's file: laboratory, customer, sensor, equipment, conditions, decision rule."
)
@repeatable("-o --output outputs", _FORM, required=True, metavar="FILE.html|pdf|xml")(
    "Certificate to write: a page, a tagged PDF/A-3 that holds the XML, or a Digital Calibration "
    "Certificate (DCC). May be repeated."
)
@flag("--incomplete")("Write a certificate that says what it lacks, and states no conformity.")
@output_options
def command(
    artifact: Path,
    laboratory: Path,
    outputs: tuple[Path, ...],
    incomplete: bool,
    as_json: bool,
    force: bool,
) -> int:
    """Write a certificate of calibration, if it lacks nothing; what it lacks is all named.

    Values with expanded uncertainties (k = 2), correlations, G(r) and budget; and, if the
    laboratory's file gives tolerances, a statement of conformity by its decision rule. It is no
    accredited certificate unless that file states an accreditation.
    """
    out.prove_writable(outputs, force=force, inputs=[artifact, laboratory])
    from memscal.apparatus import load_apparatus
    from memscal.extensions.certificate.certificate import certify
    from memscal.extensions.certificate.dcc import certificate_xml
    from memscal.extensions.certificate.laboratory import read_laboratory

    held = load_apparatus(artifact)
    certificate = certify(held, read_laboratory(laboratory), incomplete=incomplete)
    forms = {path.suffix.lower() for path in outputs}
    made = {".xml": certificate_xml(certificate)} if forms - {".html"} else {}
    if forms - {".xml"}:
        from memscal.extensions.certificate.page import certificate_page, certificate_pdf, page_of

        with out.working("Drawing"):
            page = page_of(certificate)
            if ".html" in forms:
                made[".html"] = certificate_page(page).encode()
            if ".pdf" in forms:
                made[".pdf"] = certificate_pdf(page, made[".xml"])
    out.write_files({path: made[path.suffix.lower()] for path in outputs}, force=force)
    result = {"number": certificate.number, "issued": certificate.issued}
    lacking = [f"{item.words}: {item.cure}" for item in certificate.missing]
    if as_json:
        decided = [
            {
                "name": item.certified.quantity.name,
                "conforms": item.accepted,
                "probability": item.probability,
            }
            for item in certificate.conformity
        ]
        written = {"schema_version": "1", "outputs": [str(path) for path in outputs]}
        out.emit_json({**written, **result, "conformity": decided, "missing": lacking})
    else:
        rows = list(result.items())
        for item in certificate.conformity:
            words = certificate.words("statements", item.statement)
            rows.append((item.certified.quantity.words, words))
        out.emit_tables(Table("Certificate", ("", ""), rows))
    if lacking:
        out.warn(f"The certificate is incomplete: it lacks {'; '.join(lacking)}.")
    if certificate.synthetic:
        out.note("The data are synthetic: the certificate says so on every page.")
    out.message(f"Written: {', '.join(map(str, outputs))}")
    return exit_code_of(certificate.apparatus.checks, then=" The certificate says so.")
