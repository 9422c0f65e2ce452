"""References from samples of a calculated stress, checked; and from tables."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from memscal.errors import InputError
from memscal.formats.files import FilePath
from memscal.formats.tables.columns import Column, Wanted
from memscal.formats.tables.sheets import open_table
from memscal.model.arrays import Arrays, Values, array_record, keyword_array_record
from memscal.model.checks import Message, import_notes, marked_texts
from memscal.model.provenance import SourceFile
from memscal.model.stress import StressProfile

# A larger difference between force and load is warned of, one beyond a factor is refused.
_WARNED = 0.03
_REFUSED = 2.0
# Samples whose stress has not decayed to this share of its maximum end early.
_DECAYED = 0.01
# Values at one radius that differ from their mean by this share of the maximum are of two steps.
_APART = 0.1
# In SI; a force calculated from larger numbers would overflow.
_ABSURD = 1e30


@array_record
class ImportedProfile:
    """A stress profile that was imported, and what was done on the way."""

    profile: StressProfile
    notes: tuple[Message, ...]


@keyword_array_record
class Samples:
    """Stress at the base as a file states it, in SI, and the words for it in messages."""

    columns: Arrays  # (n,): r, sigma_zz and perhaps sigma_rz
    source: SourceFile
    notes: Sequence[Message]
    kind: str
    item: str
    units: tuple[str, str]
    sign: int
    spacing: float  # in m
    discretisation: str = ""

    @property
    def plural(self) -> str:
        """What several samples are called."""
        return self.item.split()[-1] + "s"


def require_sign(name: str, value: int) -> None:
    """Refuse a sign other than 1 and -1."""
    if value not in (1, -1):
        raise InputError(f"The {name} is {value}.", cure="Give 1 or -1.")


def require_numbers(samples: Samples) -> None:
    """Refuse samples of which one is not a number that can be worked with."""
    for quantity, values in samples.columns.items():
        bad = np.flatnonzero(~(np.abs(values) < _ABSURD))
        if bad.size:
            wrong = "is too large" if np.isfinite(values[bad[0]]) else "is not a number"
            raise InputError(
                f"{samples.source.file_name}: {quantity} {wrong} in {samples.item} "
                f"{bad[0] + 1}" + (f" and {bad.size - 1} more." if bad.size > 1 else "."),
                cure=f"Remove these {samples.plural}, or calculate them.",
            )


def profile_of(samples: Samples, stated: Values, value: float | None) -> ImportedProfile:
    """Check samples of a stress, sort them by radius, and hold their force against the load."""
    # Without a load it is their force, to which they are scaled where a value in N is given.
    name = samples.source.file_name
    require_numbers(samples)
    lowest = samples.columns["r"].min()
    if lowest < 0:
        raise InputError(
            f"{name} has a negative radius ({lowest * 1e3:g} mm).",
            why="A reference is a profile against the distance from the axis.",
            cure="Give one half of a section through the axis, with r from 0.",
        )
    notes = list(samples.notes)
    # Stated is what no table or mesh holds: load, film, indenter.
    profile = StressProfile(
        **_sorted_by_radius(samples, notes),
        **{"load": 1.0, **stated},
        discretisation=samples.discretisation,
        source=samples.source,
    )
    if "load" not in stated:
        force = abs(profile.force) or 1.0
        load = value or force
        names = samples.columns.keys() - "r"
        scaled = {name: load / force * getattr(profile, name) for name in names}
        profile = replace(profile, load=load, **scaled)
        left = abs(profile.sigma_zz[-1]) / (np.abs(profile.sigma_zz).max() or 1.0)
        text = (
            f"No load is stated: the force up to the last radius is taken for it, where {left:.1%} "
            "of the largest stress is left."
        )
        notes.append(Message("force_as_load", text, "warning" if left > _DECAYED else "note"))
    notes += _compare_with_load(profile, samples)
    return ImportedProfile(replace(profile, notes="\n".join(marked_texts(notes))), tuple(notes))


def _sorted_by_radius(samples: Samples, notes: list[Message]) -> Values:
    """Sort, and average the values that element-wise output gives twice at a shared node."""
    columns = samples.columns
    order = np.argsort(columns["r"], kind="stable")
    columns = {name: values[order] for name, values in columns.items()}
    if samples.kind == "table" and np.any(np.diff(order) < 0):  # nodes of a mesh have no order
        notes += import_notes([f"The {samples.plural} were sorted by radius."])
    r = columns["r"]
    index = np.append(0, np.cumsum(np.diff(r) > samples.spacing))
    if index[-1] == r.size - 1:
        return columns
    number = np.bincount(index)
    means = {name: np.bincount(index, weights=v) / number for name, v in columns.items()}
    means["r"] = r[np.searchsorted(index, np.arange(number.size))]
    peak = np.abs(means["sigma_zz"]).max()
    apart = np.abs(columns["sigma_zz"] - means["sigma_zz"][index]).max()
    text = (
        f"{r.size - number.size} {samples.plural} repeat a radius; they were averaged "
        f"(normal stresses differ from the mean by up to {apart / peak if peak else 0:.2g} "
        "of the maximum)."
    )
    notes.append(Message("import", text, "warning" if apart > _APART * peak else "note"))
    return means


def _compare_with_load(profile: StressProfile, samples: Samples) -> list[Message]:
    """Hold the force that the samples carry against their load, which finds a wrong unit."""
    force = profile.force
    load = profile.load
    file_name = samples.source.file_name
    kind = samples.kind
    turned = -samples.sign
    if force <= 0:
        counted = "negative" if turned == -1 else "positive"
        raise InputError(
            f"The normal stress in {file_name} is mostly negative: it carries {force:.4g} N.",
            why=f"Here compression is positive, and the {kind}'s sign was taken as {samples.sign}.",
            cure=f"If the program counts compression as {counted}, say so (sign={turned}; "
            f"--sign {turned}).",
        )
    ratio = force / load
    reach = profile.r[-1] * 1e3
    tail = abs(profile.sigma_zz[-1]) / np.abs(profile.sigma_zz).max()
    early = tail > _DECAYED
    within = f"within r = {reach:.4g} mm"
    if ratio > _REFUSED or (ratio < 1 / _REFUSED and not early):
        raise InputError(
            f"The stress in {file_name} carries {force:.4g} N {within}, {ratio:.4g} times the load "
            f"of {load:g} N.",
            why="The force that the base carries must be the load.",
            cure=f'Check the unit of the stresses ("{samples.units[1]}"), the unit of the '
            f'lengths ("{samples.units[0]}"), the sign, that it is the normal stress at the base, '
            "and the load in N.",
        )
    carried = import_notes(
        [f"The {kind} carries {force:.4g} N of the load of {load:g} N ({ratio:.2%}) {within}."]
    )
    if abs(ratio - 1) <= _WARNED:
        return carried
    cure = (
        f"The {kind} ends with {tail:.1%} of its maximum left: extend it to where the stress has "
        "decayed."
        if early and ratio < 1
        else "Check the load, the units, and that the radii are fine enough under the indenter."
    )
    warning = (
        f"the {kind}'s force differs from the load by {abs(ratio - 1):.1%} of it. A "
        f"calibration takes stress per load from the {kind}, so its conversion constant would be "
        f"wrong by as much. {cure}"
    )
    return [*carried, Message("force_differs", warning, "warning")]


# Radii that differ by less than this share of the largest are the same, but for rounding.
_SAME = 1e-9


def read_reference_table(
    path: FilePath,
    *,
    r: Column,
    sigma: Column,
    r_unit: str | None = None,
    sigma_unit: str | None = None,
    sign: int = 1,
    shear: Column | None = None,
    shear_sign: int = 1,
    reading: Values | None = None,
    value: float | None = None,
    **stated: Any,
) -> ImportedProfile:
    """Read the stress at the base of the film from a table; ``stated`` are the profile's fields."""
    # sign is -1 where compression is negative, and turns the normal stress; shear_sign is -1 where
    # the shear is S13 with axis 3 from the base to the surface. Units are by default those of the
    # columns' heads; reading holds the options of open_table.
    require_sign("sign", sign)
    require_sign("shear sign", shear_sign)
    table = open_table(path, **(reading or {}))
    r_unit = table.unit_of(r, r_unit, "r_unit (--r-unit)")
    any_unit = "Pa" if value else None  # of what is scaled
    sigma_unit = table.unit_of(sigma, sigma_unit, "sigma_unit (--sigma-unit)", any_unit)
    wanted = {"r": Wanted(r, r_unit, "length"), "sigma_zz": Wanted(sigma, sigma_unit, "stress")}
    if shear is not None:
        wanted["sigma_rz"] = Wanted(shear, sigma_unit, "stress")
    columns = table.columns(wanted)
    columns["sigma_zz"] *= sign
    if shear is not None:
        columns["sigma_rz"] *= shear_sign
    samples = Samples(
        columns=columns,
        source=table.source or SourceFile("the table", ""),
        notes=import_notes(table.notes),
        kind="table",
        item="data row",
        units=(r_unit, sigma_unit),
        sign=sign,
        spacing=_SAME * np.nanmax(np.abs(columns["r"]), initial=0.0),
    )
    return profile_of(samples, stated, value)
