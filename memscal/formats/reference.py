"""memscal-reference: a calculated stress profile at the base of the film, as HDF5, or by name."""

import os
import re

from memscal.errors import InputError
from memscal.formats.groups import profile_groups, read_profile
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.formats.hdf5.writer import REFERENCE_SCHEMA, Group, file_tree, write_tree
from memscal.formats.units import to_si
from memscal.formats.values import require_schema
from memscal.model.stress import IDEAL, IdealReference, StressProfile

_NAMED = re.compile(rf"({'|'.join(IDEAL)})(?::([^A-Za-zµμ]*)(.*))?")


def read_reference(path: str | os.PathLike[str]) -> StressProfile:
    """Read a stress profile from a memscal-reference file, or make that of an ideal reference.

    Parameters
    ----------
    path : path or str
        The file; units in it are converted to SI.  A text that names no file may be ``disc:R``
        (its radius), ``slit:W`` (its width), ``gaussian:S`` (its standard deviation), each with a
        unit, such as ``disc:0.5mm``, or ``point``: see :class:`memscal.IdealReference`.

    Returns
    -------
    StressProfile
        With ``source`` naming the file and its SHA-256.

    Raises
    ------
    FormatError, UnitError, UnsafeFileError, SchemaVersionError
        If the file does not hold a reference that this version can read.
    InputError
        If the size of an ideal reference is none.

    Examples
    --------
    >>> import tempfile
    >>> profile = StressProfile(r=[0.0, 1e-3], sigma_zz=[2.0e5, 1.0e5], load=1.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_reference(profile, f"{folder}/rod.h5")
    ...     read_reference(f"{folder}/rod.h5").sigma_zz
    array([200000., 100000.])
    """
    if (ideal := ideal_reference(path)) is not None:
        return ideal.profile()
    with open_hdf5(path) as file:
        return profile_from(file)


def ideal_reference(text: str | os.PathLike[str]) -> IdealReference | None:
    """Return the ideal reference that a text names; nothing of a file that exists."""
    match = None if os.path.exists(text) else _NAMED.fullmatch(os.fspath(text).strip())
    if match is None:
        return None
    shape, number, unit = match.groups(default="")
    if shape == "point" and not number:
        return IdealReference(shape)
    size = f"The {IDEAL[shape] or 'size'} of the reference {os.fspath(text)!r}"
    try:
        return IdealReference(shape, float(to_si(float(number), unit.strip(), "length", size)))
    except ValueError:
        cure = "Write it with its unit, as disc:0.5mm, slit:200um, gaussian:0.3mm; or point."
        raise InputError(f"{size} is no length.", cure=cure) from None


def profile_from(file: SafeFile) -> StressProfile:
    """Read the profile of an open memscal-reference file."""
    require_schema(file, REFERENCE_SCHEMA)
    return read_profile(file, "/entry/reference", "/entry/parameters", "/entry/process")


def write_reference(
    profile: StressProfile, path: str | os.PathLike[str], *, overwrite: bool = False
) -> None:
    """Write a stress profile as a memscal-reference file, whole or not at all.

    Parameters
    ----------
    profile : StressProfile
        The profile; its ``source`` is not written.
    path : path
        The file.
    overwrite : bool
        Whether an existing file may be replaced.

    Raises
    ------
    OutputError
        If the file exists or cannot be written.
    """
    data, parameters, process = profile_groups(profile)
    stored = {"reference": data, "parameters": parameters, "process": process}
    entry = Group("NXentry", stored, {"default": "reference"})
    write_tree(file_tree(REFERENCE_SCHEMA, entry), path, overwrite=overwrite)
