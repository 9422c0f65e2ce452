"""What a file holds, and whether it can be trusted: for ``memscal inspect`` and ``check``."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from memscal.errors import FormatError, MemscalError
from memscal.formats.artifact import artifact_from
from memscal.formats.fields import json_value, require_schema, units_of
from memscal.formats.hdf5_reader import SafeFile, open_hdf5
from memscal.formats.process import read_quality
from memscal.formats.reference import profile_from
from memscal.formats.scan import scan_from
from memscal.formats.schema import (
    ARTIFACT_SCHEMA,
    DIGEST_ATTRIBUTE,
    REFERENCE_SCHEMA,
    SCAN_SCHEMA,
    SCHEMA_ATTRIBUTE,
    STRESS_SCHEMA,
)
from memscal.formats.stress import PROFILE_ARRAYS, PROFILE_NUMBERS, profile_paths, stress_from
from memscal.formats.units import dimension_of, to_si
from memscal.formats.verify import altered
from memscal.model.checks import messages_from_json

__all__ = ["Finding", "check", "describe"]

_READERS: dict[str, Callable[[SafeFile], Any]] = {
    SCAN_SCHEMA: scan_from,
    REFERENCE_SCHEMA: profile_from,
    ARTIFACT_SCHEMA: artifact_from,
    STRESS_SCHEMA: stress_from,
}
_ARRAYS = {
    SCAN_SCHEMA: {
        "/entry/data": "x y repeat x_errors y_errors u_zz u_zz_errors u_zz_correlation "
        "normal_load normal_load_errors u_xz u_xz_errors u_yz u_yz_errors",
        "/entry/reference": "r sigma_zz sigma_zz_errors sigma_rz",
    },
    REFERENCE_SCHEMA: {"/entry/reference": "r sigma_zz sigma_zz_errors sigma_rz"},
    ARTIFACT_SCHEMA: {
        "/entry/apparatus_function": "x y g g_errors",
        "/entry/radial_profile": "r g g_errors g_gaussian g_covariance conversion_correlation",
        "/entry/transfer_function": "k modulus modulus_errors window",
        "/entry/reconvolution": "x u_zz u_zz_errors u_zz_predicted u_zz_gaussian residual",
    },
    STRESS_SCHEMA: {},
}
_FILM = "young_modulus poisson_ratio thickness roughness_rms"
_PROFILE = "load depth contact_radius stick_radius friction_coefficient loading"
_QUANTITIES = {
    SCAN_SCHEMA: {"/entry/indenter": "shape radius load", "/entry/sample/film": _FILM},
    REFERENCE_SCHEMA: {
        "/entry/parameters": _PROFILE,
        "/entry/parameters/indenter": "shape radius inclination",
        "/entry/parameters/film": _FILM,
        "/entry/process/numerics": "convergence discretisation",
    },
    ARTIFACT_SCHEMA: {
        "/entry/transfer_function": "resolved_wavenumber",
        "/entry/indenter": "shape radius load",
        "/entry/sample/film": _FILM,
    },
    STRESS_SCHEMA: {
        "/entry/indenter": "shape radius",
        "/entry/sample/film": _FILM,
        "/entry/sensor": "conversion_constant",
    },
}
_PROVENANCE = {
    "start_time": "/entry/start_time",
    "end_time": "/entry/end_time",
    "notes": "/entry/notes/data",
    "reference_notes": "/entry/process/notes/data",
    "lubrication": "/entry/sample/lubrication",
    "lubricant": "/entry/sample/lubricant",
    "sensor": "/entry/instrument/stress_sensor/name",
    "sensor_model": "/entry/instrument/stress_sensor/model",
    "channel": "/entry/instrument/stress_sensor/channel",
    "program": "/entry/process/program",
    "version": "/entry/process/version",
    "date": "/entry/process/date",
    "input_scan": "/entry/process/input_scan/file_name",
    "input_scan_sha256": "/entry/process/input_scan/checksum",
    "input_reference": "/entry/process/input_reference/file_name",
    "input_reference_sha256": "/entry/process/input_reference/checksum",
    "synthetic": "/entry/synthetic/description",
}
_OPTIONS = ("configuration", "environment")


@dataclass(frozen=True)
class Finding:
    """One finding about a file: what was looked at, whether it is in order, and what it means."""

    name: str
    passed: bool
    meaning: str


def describe(path: str | os.PathLike[str]) -> dict[str, Any]:
    """Return what a file of memscal holds, in plain values that JSON can say.

    Parameters
    ----------
    path : path
        A scan, reference or artifact.

    Returns
    -------
    dict
        ``file``, ``sha256``, ``schema``, ``schema_version``, ``title``, ``quantities`` (each
        with path, value, standard_uncertainty or ``None``, unit), ``arrays`` (each with path,
        shape, unit, minimum, maximum, missing), ``checks``, ``provenance``.  Numbers are in
        the units of the file.

    Raises
    ------
    FormatError
        If it is not a file of memscal, or not a sound one.
    """
    with open_hdf5(path) as file:
        schema = _schema(file)
        version = require_schema(file, schema)
        _READERS[schema](file)
        return {
            "file": file.name,
            "sha256": file.source.sha256,
            "schema": schema,
            "schema_version": version,
            "title": file.text("/entry/title") if file.has("/entry/title") else "",
            "quantities": list(_quantities(file, schema)),
            "arrays": list(_arrays(file, schema)),
            "checks": list(_checks(file)),
            "provenance": _provenance(file),
        }


def check(path: str | os.PathLike[str]) -> list[Finding]:
    """Check a file step by step: safety, schema, completeness, digest.

    It stops at the first step that fails, because what follows would rest on it.

    Parameters
    ----------
    path : path
        The file.

    Returns
    -------
    list of Finding
        Never empty; the file is in order if every one passed.
    """
    findings: list[Finding] = []
    step = "safety"
    try:
        with open_hdf5(path) as file:
            schema = _schema(file)
            findings.append(Finding(step, True, "A regular file that opens as HDF5."))
            step = "schema"
            version = require_schema(file, schema)
            findings.append(Finding(step, True, f"{schema}, version {version}."))
            step = "digest"
            findings.append(_digest(file, schema))
            if not findings[-1].passed:
                return findings
            step = "content"
            _READERS[schema](file)
            findings.append(Finding(step, True, "Complete, with units of the right dimension."))
    except MemscalError as error:
        findings.append(Finding(step, False, str(error)))
    return findings


def _digest(file: SafeFile, schema: str) -> Finding:
    """Results must have a digest: scans and references may come from other programs."""
    if (
        schema not in (ARTIFACT_SCHEMA, STRESS_SCHEMA)
        and file.attribute("/", DIGEST_ATTRIBUTE) is None
    ):
        return Finding("digest", True, "None: the file was written by another program.")
    problem = altered(file)
    if problem:
        return Finding("digest", False, f"The file was changed after it was written: {problem}")
    return Finding("digest", True, "The content is what was written.")


def _schema(file: SafeFile) -> str:
    schema = file.attribute("/", SCHEMA_ATTRIBUTE)
    if isinstance(schema, str) and schema in _READERS:
        return schema
    raise FormatError(
        f"{file.name} is not a file of memscal.",
        why=f"Its root attribute {SCHEMA_ATTRIBUTE} is {schema!r}, not one of "
        f"{', '.join(_READERS)}.",
        cure="Convert a table with `memscal import`.",
    )


def _quantities(file: SafeFile, schema: str) -> Iterator[dict[str, Any]]:
    names = json_value(file, "/entry/parameters/names", list, [])
    groups = {"/entry/parameters": " ".join(map(str, names)), **_QUANTITIES[schema]}
    groups |= dict.fromkeys(profile_paths(file), PROFILE_NUMBERS)
    for group, listed in groups.items():
        for name in listed.split():
            path = f"{group}/{name}"
            if not file.has(path):
                continue
            text = file.is_text(path)
            yield {
                "path": path,
                "name": name,
                "value": file.text(path) if text else _plain(file.array(path)),
                "standard_uncertainty": _uncertainty(file, path),
                "unit": None if text else units_of(file, path) or "1",
            }


def _uncertainty(file: SafeFile, path: str) -> float | int | None:
    """Return the uncertainty of a quantity in the unit of the quantity, whatever its own is."""
    errors = f"{path}_errors"
    if not file.has(errors):
        return None
    spread, unit, own = file.array(errors), units_of(file, path), units_of(file, errors)
    if own != unit:
        dimension = dimension_of(unit or "1", file.where(path))
        spread = to_si(spread, own, dimension, file.where(errors)) / to_si(
            1.0, unit, dimension, file.where(path)
        )
    return _plain(spread)


def _arrays(file: SafeFile, schema: str) -> Iterator[dict[str, Any]]:
    groups = _ARRAYS[schema] | dict.fromkeys(profile_paths(file), PROFILE_ARRAYS)
    for group, listed in groups.items():
        for name in listed.split():
            path = f"{group}/{name}"
            if not file.has(path):
                continue
            values = file.array(path)
            known = values[np.isfinite(values)]
            yield {
                "path": path,
                "shape": list(values.shape),
                "unit": units_of(file, path) or "1",
                "minimum": _plain(known.min()) if known.size else None,
                "maximum": _plain(known.max()) if known.size else None,
                "missing": int(np.isnan(values).sum()),
            }


def _checks(file: SafeFile) -> Iterator[dict[str, Any]]:
    for found in read_quality(file, "/entry/quality"):
        yield {
            "name": found.name,
            "value": _plain(found.value),
            "limit": _plain(found.limit),
            "passed": found.passed,
            "meaning": found.meaning,
        }


def _provenance(file: SafeFile) -> dict[str, Any]:
    found: dict[str, Any] = {
        name: file.text(path) for name, path in _PROVENANCE.items() if file.has(path)
    }
    for name in _OPTIONS:
        value = json_value(file, f"/entry/process/{name}/data", object, None)
        if value is not None:
            found[name] = value
    if file.has(path := "/entry/process/messages/data"):
        messages = messages_from_json(json_value(file, path, list, []))
        found["messages"] = [message.text for message in messages]
    return found


def _plain(value: Any) -> float | int | None:
    """Return a number that standard JSON can say."""
    number = np.asarray(value).reshape(-1)[0].item()
    return number if np.isfinite(number) else None
