"""What a scan does not state, and what that costs."""

import tomllib
from pathlib import Path

from memscal.model.arrays import Values
from memscal.model.scan import Scan


def not_stated(scan: Scan) -> list[Values]:
    """Return what a scan does not state: its ``words``, ``option`` of import and ``cost``."""
    text = Path(__file__).with_suffix(".toml").read_text(encoding="utf-8")
    shape = getattr(scan.indenter, "shape", "rod")
    rows = []
    for row in tomllib.loads(text)["row"]:
        owner = getattr(scan, row["of"]) if "of" in row else scan
        value = getattr(owner, row["name"], "")
        missing = value is None or (isinstance(value, str) and not value)
        applies = all(getattr(scan, name) is not None for name in row.get("needs", ()))
        if applies and shape in row and missing:
            rows.append({**row, "cost": row[shape]})
    return rows
