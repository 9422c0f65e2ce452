"""A comparison of measured with calculated stress as one JSON object."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from memscal.cli.interface_view import interface_json
from memscal.cli.output import finite, texts_of
from memscal.cli.quality_view import checks_json
from memscal.friction.results import (
    DryAgainstLubricated,
    EffectiveFriction,
    FrictionComparison,
    LoadComparison,
)
from memscal.model.provenance import SourceFile
from memscal.model.quantities import KPA
from memscal.model.validation import FloatArray

__all__ = ["comparison_json"]


def comparison_json(
    found: FrictionComparison,
    artifact: SourceFile,
    references: Sequence[SourceFile | None] = (),
    files: Sequence[Path] = (),
) -> dict[str, Any]:
    """Return the object that ``compare --json`` prints; its form is part of the contract.

    A friction coefficient of infinity is ``null``, with ``"sticking": true``; an interval's open
    end is ``null``.
    """
    return {
        "schema_version": "1",
        "artifact": _file(artifact),
        "scans": [
            _file(scan.source) | {"lubrication": scan.lubrication} for scan in found.measured.scans
        ],
        "references": [_file(source) for source in references],
        "figures": [str(path) for path in files],
        "loads": [
            _load(i, found, next(iter(found.loads.values()))[i])
            for i in range(len(found.measured.profiles))
        ],
        "joint": [
            {"lubrication": lubrication, "loading": loading, **_reading(joint)}
            for lubrication, by_loading in found.joint.items()
            for loading, joint in by_loading.items()
        ],
        "dry_against_lubricated": [_difference(one) for one in found.dry_against_lubricated],
        "interface": None if found.interface is None else interface_json(found.interface),
        "macroscopic": None if found.macroscopic is None else _quantity(*found.macroscopic, "1"),
        "checks": checks_json(found.checks),
        "overridden": list(found.measured.overridden),
        "warnings": texts_of(found.messages),
    }


def _file(source: SourceFile | None) -> dict[str, Any]:
    if source is None:
        return {"file_name": None, "sha256": None}
    return {"file_name": source.file_name, "sha256": source.sha256}


def _quantity(value: float, uncertainty: float | None, unit: str) -> dict[str, Any]:
    return {"value": finite(value), "standard_uncertainty": finite(uncertainty), "unit": unit}


def _coefficient(friction: float) -> dict[str, Any]:
    return {"friction_coefficient": finite(friction), "sticking": math.isinf(friction)}


def _load(index: int, found: FrictionComparison, first: LoadComparison) -> dict[str, Any]:
    """Return what was measured at one load, and what each loading makes of it."""
    profile = first.profile
    source = profile.scan.source
    return {
        "scan": None if source is None else source.file_name,
        "lubrication": first.lubrication,
        "load": {"value": finite(first.load), "unit": "N"},
        "force": _quantity(profile.force, profile.force_uncertainty, "N"),
        "S_max": _quantity(first.s_max / KPA, first.s_max_uncertainty / KPA, "kPa"),
        "p0_max": _quantity(first.p0_max / KPA, first.p0_max_uncertainty / KPA, "kPa"),
        "ratio": _quantity(first.ratio, first.ratio_uncertainty, "1"),
        "by_loading": {
            loading or "given": _by_loading(found, loads[index])
            for loading, loads in found.loads.items()
        },
    }


def _by_loading(found: FrictionComparison, one: LoadComparison) -> dict[str, Any]:
    return {
        "effective_friction_coefficient": {
            "by_maximum": _reading(one.by_maximum),
            "by_profile": _reading(one.by_profile),
        },
        "bracketed": finite(one.bracketed),
        "degrees": one.degrees,
        "profiles": [
            {
                **_coefficient(float(mu)),
                "p_max": {"value": finite(one.p_max[i] / KPA), "unit": "kPa"},
                "chi2": finite(float(one.chi_square[i])),
                "p_value": finite(float(one.p_values[i])),
            }
            for i, mu in enumerate(found.friction)
        ],
    }


def _reading(reading: EffectiveFriction) -> dict[str, Any]:
    """Return a coefficient with its interval; without a value there is a reason."""
    return {
        "value": finite(reading.value),
        "standard_uncertainty": finite(reading.standard_uncertainty),
        "interval": {
            "low": finite(reading.interval.low),
            "high": finite(reading.interval.high),
            "level": reading.interval.level,
        },
        "reason": reading.reason or None,
        "budget": {name: finite(u) for name, u in reading.budget.items()},
        "chi2": finite(reading.least),
        "degrees": reading.degrees,
        "p_value": finite(reading.p_value),
        "profile_likelihood": {
            "friction_coefficient": _shortened(reading.values),
            "chi2": _shortened(reading.chi_square),
        },
    }


def _shortened(values: FloatArray) -> list[float | None]:
    """Return numbers of a curve with six digits, infinity as null."""
    return [finite(float(f"{value:.6g}")) for value in values]


def _difference(one: DryAgainstLubricated) -> dict[str, Any]:
    return {
        "load": {"value": finite(one.load), "unit": "N"},
        "on_axis": _quantity(one.maximum / KPA, one.maximum_uncertainty / KPA, "kPa"),
        "relative": _quantity(one.relative, one.relative_uncertainty, "1"),
        "chi2": finite(one.chi_square),
        "degrees": one.degrees,
        "p_value": finite(one.p_value),
    }
