"""Tables imported with many options."""

from dataclasses import fields

from memscal import ImportedScan, ScanConditions, ScanUncertainties, TableLayout, import_table

RECORDS = {
    "layout": TableLayout,
    "conditions": ScanConditions,
    "uncertainties": ScanUncertainties,
}


def imported(source, **options) -> ImportedScan:
    """Import a table, with the fields of its records among the options."""
    records = {}
    for name, record in RECORDS.items():
        stated = options.keys() & {item.name for item in fields(record)}
        records[name] = record(**{key: options.pop(key) for key in stated})
    return import_table(source, **records, **options)
