"""memscal-reference: a calculated stress profile at the base of the film, as HDF5."""

import os

from memscal.formats.groups import profile_groups, read_profile
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.formats.hdf5.writer import REFERENCE_SCHEMA, Group, file_tree, write_tree
from memscal.formats.values import require_schema
from memscal.model.stress import StressProfile


def read_reference(path: str | os.PathLike[str]) -> StressProfile:
    """Read a stress profile from a memscal-reference file.

    Parameters
    ----------
    path : path
        The file; units in it are converted to SI.

    Returns
    -------
    StressProfile
        With ``source`` naming the file and its SHA-256.

    Raises
    ------
    FormatError, UnitError, UnsafeFileError, SchemaVersionError
        If the file does not hold a reference that this version can read.

    Examples
    --------
    >>> import tempfile
    >>> profile = StressProfile(r=[0.0, 1e-3], sigma_zz=[2.0e5, 1.0e5], load=1.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_reference(profile, f"{folder}/rod.h5")
    ...     read_reference(f"{folder}/rod.h5").sigma_zz
    array([200000., 100000.])
    """
    with open_hdf5(path) as file:
        return profile_from(file)


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
