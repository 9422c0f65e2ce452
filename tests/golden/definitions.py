"""NXDL application definitions of memscal's files, from the records that declare their contents.

``python tests/golden/definitions.py`` writes them to ``memscal/formats/definitions``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree as ET

import memscal
from memscal.extensions.arrays.files import RECORDS
from memscal.formats.hdf5 import writer
from memscal.model import records
from memscal.model.quantities import Quantity, Record, record

FOLDER = Path(memscal.__file__).parent / "formats" / "definitions"
_NXDL = "http://definition.nexusformat.org/nxdl/3.1"
_XSI = "http://www.w3.org/2001/XMLSchema-instance"
# Of others any unit: readings have their own, and validators know no rad/mm and no 1 of a ratio.
_UNITS = {
    "length": "NX_LENGTH", "stress": "NX_PRESSURE", "angle": "NX_ANGLE", "per area": "NX_PER_AREA",
    "temperature": "NX_TEMPERATURE",
}  # fmt: skip
# Groups that no record declares by its class; a NXnote holds text, a NXcollection anything.
_CLASSES = {"instrument": "NXinstrument", "process": "NXprocess", "numerics": "NXparameters"}
_MEASURED_ON = {
    "indenter": records.INDENTER,
    "sample": records.SAMPLE,
    "sample/film": records.FILM,
    "instrument/stress_sensor": records.SENSOR,
    "instrument/stress_sensor/dynamics": records.DYNAMICS,
    "instrument/load_cell": records.LOAD_CELL,
}
_SCANNED = {**_MEASURED_ON, "instrument/stage": records.STAGE, "user": records.USER}
_ANYTHING = record("NXcollection")
_NOTE = record("NXnote")
#: Records of alternatives: what is required of one is not there in another.
_ALTERNATIVES = (records.REFERENCE_DATA, records.INDENTER)
#: What each kind of file holds, in words; its groups below the entry; those that it must have.
DEFINITIONS: Mapping[str, tuple[str, Mapping[str, Record], tuple[str, ...]]] = {
    writer.SCAN_SCHEMA: (
        "A sensor's readings against the position of the indenter that is pressed on its film.",
        {
            "data": replace(
                records.SCAN_DATA,
                quantities=records.SCAN_DATA.quantities + records.SENSORS,
            ),
            **_SCANNED,
            "reference": records.REFERENCE_DATA,
            "synthetic": _ANYTHING,
            "notes": _NOTE,
        },
        ("data",),
    ),
    writer.REFERENCE_SCHEMA: (
        "The calculated stress at the base of a film under an indenter.",
        {
            "reference": records.REFERENCE_DATA,
            "parameters": records.CONTACT,
            "parameters/film": records.FILM,
            "parameters/indenter": records.INDENTER,
            "process": records.SOLVER,
            "process/numerics": records.NUMERICS,
        },
        # An ideal reference is a NXcollection in its place.
        ("parameters",),
    ),
    writer.ARTIFACT_SCHEMA: (
        "The apparatus function of a stress sensor under a film, with all that it rests on.",
        {
            "apparatus_function": records.FIELD,
            "radial_profile": records.RADIAL,
            "radial_covariance": records.RADIAL_COVARIANCE,
            "kernel_changes": records.KERNEL_CHANGES,
            "shared_effects": records.SHARED_EFFECTS,
            "transfer_function": records.TRANSFER,
            "reconvolution": records.RECONVOLUTION,
            "parameters": _ANYTHING,
            "quality": _ANYTHING,
            "assumptions": _ANYTHING,
            **_SCANNED,
            "reference": records.REFERENCE_DATA,
            "process": records.PROCESS,
            **{f"radial_profile_{route}": records.RADIAL for route in ("bayesian", "division")},
            **{
                f"radial_covariance_{route}": records.RADIAL_COVARIANCE
                for route in ("bayesian", "division")
            },
        },
        (
            "radial_profile",
            "radial_covariance",
            "transfer_function",
            "reconvolution",
            "parameters",
            "quality",
            "process",
        ),
    ),
    writer.STRESS_SCHEMA: (
        "The stress that a calibrated sensor measured under contacts, load by load.",
        {
            # Each profile has a name of its own.
            "": record(
                "NXdata",
                *records.STRESS_PROFILE.quantities,
                *records.STRESS_NUMBERS.quantities,
                *records.SLID.quantities,
            ),
            **dict.fromkeys(("roots", "budgets", "curves"), _ANYTHING),
            **dict.fromkeys(("points_zz", "points_xz", "points_yz"), _ANYTHING),
            "sensor": records.CONVERSION,
            "scans": _ANYTHING,
            "inputs": _ANYTHING,
            "quality": _ANYTHING,
            **_MEASURED_ON,
            "process": records.PROCESS,
        },
        ("", "sensor", "scans", "inputs", "quality", "process"),
    ),
    writer.ARRAY_SCHEMA: (
        "The apparatus functions of sensors under one film, and their crosstalk.",
        {
            **RECORDS,
            "quality": _ANYTHING,
            **_SCANNED,
            "process": records.PROCESS,
        },
        (*RECORDS, "quality", "indenter", "sample", "process"),
    ),
}


def definition(schema: str) -> str:
    """Return the application definition of a kind of file, as XML."""
    words, groups, required = DEFINITIONS[schema]
    name = f"NX{schema.replace('-', '_')}"
    root = ET.Element(
        "definition",
        {
            "xmlns": _NXDL,
            "xmlns:xsi": _XSI,
            "xsi:schemaLocation": f"{_NXDL} ../nxdl.xsd",
            "name": name,
            "extends": "NXobject",
            "type": "group",
            "category": "application",
        },
    )
    _doc(root, f"{words} Written by memscal, version {writer.SCHEMA_VERSION} of its files.")
    entry = ET.SubElement(root, "group", {"type": "NXentry"})
    stated = _field(entry, "definition", "NX_CHAR")
    ET.SubElement(stated, "attribute", {"name": "version"})
    item = ET.SubElement(stated, "enumeration")
    ET.SubElement(item, "item", {"value": name})
    _field(entry, "title", "NX_CHAR", optional=True)
    if schema in (writer.SCAN_SCHEMA, writer.ARTIFACT_SCHEMA, writer.ARRAY_SCHEMA):
        for time in ("start_time", "end_time"):
            _field(entry, time, "NX_DATE_TIME", optional=True)
    if schema == writer.STRESS_SCHEMA:
        for listing in ("profiles", "overridden"):
            _field(entry, listing, "NX_CHAR", optional=listing == "overridden")
    made = {None: entry}
    for path, of in {**groups, "contents": _NOTE}.items():
        _group(made, path, of, needed=path in required)
    ET.indent(root)
    return ET.tostring(root, encoding="unicode", xml_declaration=False) + "\n"


def _group(made: dict[str | None, ET.Element], path: str, of: Record, *, needed: bool) -> None:
    folder, slash, name = path.rpartition("/")
    parent = folder if slash else None
    if parent not in made:
        _group(made, folder, record(_CLASSES[folder]), needed=needed)
    stated = {"type": of.nx_class} | ({"name": name} if name else {})
    stated |= {} if needed else {"optional": "true"}
    made[path] = group = ET.SubElement(made[parent], "group", stated)
    if of.signal:
        for attribute in ("signal", "axes"):
            ET.SubElement(group, "attribute", {"name": attribute})
    # Validators do not look into a NXcollection, and would miss what is required of it.
    some = of.nx_class == "NXcollection" or of in _ALTERNATIVES
    for quantity in {quantity.key: quantity for quantity in of.quantities}.values():
        _quantity(group, quantity, optional=some or not quantity.required)
    if of.nx_class in ("NXsample", "NXsensor", "NXpositioner"):
        _field(group, "depends_on", "NX_CHAR")
    if of in (records.KERNEL_CHANGES, records.SHARED_EFFECTS):
        _field(group, "names", "NX_CHAR")
    if of is _NOTE:
        _field(group, "data", "NX_CHAR")


def _quantity(group: ET.Element, quantity: Quantity, *, optional: bool) -> None:
    kind = quantity.dimension
    if kind in ("note", "mapping", "messages", "file"):
        note = ET.SubElement(
            group, "group", {"type": "NXnote", "name": quantity.key, "optional": "true"}
        )
        _doc(note, quantity.words)
        if kind != "file":
            _field(note, "data", "NX_CHAR")
        return
    whole = quantity.key in ("repeat", "branch") or kind == "truth"
    types = "NX_CHAR" if kind in ("text", "names") else "NX_INT" if whole else "NX_FLOAT"
    field = _field(group, quantity.key, types, optional=optional)
    if types == "NX_FLOAT":
        field.set("units", _UNITS.get(kind, "NX_ANY"))
    _doc(field, quantity.words)


def _field(parent: ET.Element, name: str, kind: str, *, optional: bool = False) -> ET.Element:
    stated = {"name": name, "type": kind} | ({"optional": "true"} if optional else {})
    return ET.SubElement(parent, "field", stated)


def _doc(parent: ET.Element, words: str) -> None:
    if words:
        ET.SubElement(parent, "doc").text = words


def path_of(schema: str) -> Path:
    """Return where the package keeps the definition of a kind of file."""
    return FOLDER / f"NX{schema.replace('-', '_')}.nxdl.xml"


if __name__ == "__main__":
    for kind in DEFINITIONS:
        path_of(kind).write_text(definition(kind), encoding="utf-8")
