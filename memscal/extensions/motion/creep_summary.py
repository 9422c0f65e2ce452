"""The creep of a sensor as an answer, tables and a mapping."""

from memscal.extensions.motion.creep import Creep
from memscal.model.arrays import Values
from memscal.model.quantities import measured_text
from memscal.summaries.declared import parameters_json
from memscal.summaries.table import Table, checks_json, checks_table, verdict


def answer(creep: Creep) -> str:
    """Return what was found, when a calibration with it holds, and what failed."""
    found = creep.parameters
    return (
        f"A share of {measured_text(found, 'share')} of a reading comes late, with a time of "
        f"{measured_text(found, 'time')}.\n{verdict(creep.checks)}\n"
        f"A calibration with it holds {found['record']:.4g} s after a contact, where the record "
        "ends: what creeps later is not seen."
    )


def tables(creep: Creep) -> list[Table]:
    """Return what was found, and the checks."""
    rows = [(name, measured_text(creep.parameters, name)) for name in creep.parameters.names[:3]]
    title = "Creep (± standard uncertainty, k = 1), with the level at the end of the record"
    return [Table(title, ("", ""), rows), checks_table(creep.checks)]


def mapping(creep: Creep) -> Values:
    """Return the object of ``creep --json``."""
    return {
        "schema_version": "1",
        **parameters_json(creep.parameters),
        "checks": checks_json(creep.checks),
    }
