"""What ``memscal simulate`` shows: the truth, which no experiment has."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from memscal.cli.output import emit_json
from memscal.model.quantities import TRUTH, estimated_quantity

if TYPE_CHECKING:
    from memscal.model.scan import Scan

__all__ = ["tell_experiment", "tell_scan"]


def tell_scan(scan: Scan, output: Path, as_json: bool) -> None:
    """Print the truth of one scan."""
    if as_json:
        emit_json({"schema_version": "1", **_described(scan, output)})
        return
    from memscal.cli.tables import Table, emit_tables

    rows = [
        ("kind", scan.kind),
        ("points", _shape(scan)),
        *(_entry(*item) for item in dict(scan.synthetic or {}).items()),
    ]
    emit_tables(Table("Synthetic scan (calculated, not measured) and its truth", ("", ""), rows))


def tell_experiment(scans: Mapping[Path, Scan], as_json: bool) -> None:
    """Print the truth of an experiment, one column for each scan."""
    if as_json:
        described = [_described(scan, path) for path, scan in scans.items()]
        emit_json({"schema_version": "1", "synthetic": True, "scans": described})
        return
    from memscal.cli.tables import Table, emit_tables

    truths = [dict(scan.synthetic or {}) for scan in scans.values()]
    names: list[str] = []
    for truth in sorted(truths, key=len, reverse=True):
        names += [name for name in truth if name not in names]
    rows: list[Sequence[str]] = [
        ("kind", *(scan.kind for scan in scans.values())),
        ("points", *(_shape(scan) for scan in scans.values())),
    ]
    for name in names:
        words = next(_entry(name, truth[name])[0] for truth in truths if name in truth)
        values = (_entry(name, truth[name])[1] if name in truth else "-" for truth in truths)
        rows.append((words, *values))
    head = ("", *(path.name for path in scans))
    emit_tables(Table("Synthetic experiment (calculated, not measured) and its truth", head, rows))


def _described(scan: Scan, path: Path) -> dict[str, Any]:
    return {
        "scan": str(path),
        "synthetic": True,
        "kind": scan.kind,
        "shape": list(scan.u_zz.shape),
        "truth_si": {name: _standard(value) for name, value in (scan.synthetic or {}).items()},
    }


def _standard(value: float | str) -> float | str:
    """Return what standard JSON can say: a friction that always sticks is ``"inf"``."""
    return "inf" if value == float("inf") else value


def _shape(scan: Scan) -> str:
    return " x ".join(str(n) for n in scan.u_zz.shape)


def _entry(name: str, value: float | str) -> tuple[str, str]:
    """Return a truth in words, and with its unit."""
    if isinstance(value, str):
        return name.replace("_", " "), value
    if name.startswith("load_") and name.removeprefix("load_").isdigit():
        return f"true load {name.removeprefix('load_')}", f"{value:.6g} N"
    shown = TRUTH.get(name) or estimated_quantity(name)
    return shown.words, f"{value / shown.scale:.6g} {shown.unit}".rstrip()
