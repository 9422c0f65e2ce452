"""What a scan does not state, and what that costs."""

import tomllib
from pathlib import Path

from memscal.model.arrays import Values
from memscal.model.scan import Scan


def not_stated(scan: Scan) -> list[Values]:
    """Return what a scan does not state: its ``words``, ``option`` of import and ``cost``."""
    shape = getattr(scan.indenter, "shape", "rod")
    rows = []
    for row in tomllib.loads(Path(__file__).with_suffix(".toml").read_text("utf-8"))["row"]:
        owner = getattr(scan, row["of"]) if "of" in row else scan
        if owner is not None and shape in row and getattr(owner, row["name"], None) in (None, ""):
            rows.append({**row, "cost": row[shape]})
    return rows
