"""memscal-reference: a calculated stress profile at the base of the film, as HDF5, or by name."""

import os
import re
from io import BytesIO
from pathlib import PurePath
from typing import Any

import numpy as np
from numpy.typing import NDArray

from memscal.errors import InputError, placed
from memscal.formats.digest import require_schema, require_unaltered
from memscal.formats.files import FilePath, damage_named, read_bytes
from memscal.formats.groups import profile_groups, read_field, read_profile
from memscal.formats.hdf5.reader import SafeFile, open_hdf5
from memscal.formats.hdf5.writer import REFERENCE_SCHEMA, Group, file_tree, write_tree
from memscal.formats.units import to_si
from memscal.model.arrays import require_positive
from memscal.model.provenance import source_of
from memscal.model.sizes import MOST_PIXELS, too_large
from memscal.model.stress import IDEAL, IdealReference, StressField, StressProfile

_NAMED = re.compile(r"([A-Za-z]{3,})(?::(.*))?")
#: A source whose name and size are separated in another way.
_MISSPELT = re.compile(r"([A-Za-z]{3,})[\W_]*?([.,\d]+\s*[cmunµμ]?m)\W*")
_LENGTH = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*([A-Za-zµμ]+)\s*")
#: Files of pixels, which state no size of theirs; weights of red, green and blue in the luminance.
_PIXELS = (".npy", ".png", ".tif", ".tiff")
_LUMINANCE = (0.299, 0.587, 0.114)


def read_reference(
    path: FilePath, *, pixel_size: float | None = None, accept_altered: bool = False
) -> StressProfile:
    """Read a stress profile or a field from a file, or make that of an ideal reference.

    Parameters
    ----------
    path : path or str
        The file; units in it are converted to SI.  A text that names no file may be ``disc:R``
        (its radius), ``slit:W`` (its width), ``gaussian:S`` (its standard deviation), each with a
        unit, such as ``disc:0.5mm``, or ``point``: see :class:`memscal.IdealReference`.  Beside a
        memscal-reference it may be a field: HDF5 with x, y and sigma_zz, or with a NeXus plot; a
        2-D array (.npy) or an image (PNG, TIFF), whose rows follow y and columns x.
    pixel_size : float, optional
        Size of the pixels of an array or image, in m.
    accept_altered : bool
        Accept a file whose content does not fit its digest: ``source.altered`` records it.

    Returns
    -------
    StressProfile
        With ``source`` naming the file and its SHA-256.

    Raises
    ------
    FormatError, UnitError, UnsafeFileError, SchemaVersionError
        If the file does not hold a reference that this version can read, or was changed after it
        was written.
    InputError
        If the size of an ideal reference is none, that of pixels is missing, or a field cannot be
        used.

    Examples
    --------
    >>> import tempfile
    >>> profile = StressProfile(r=[0.0, 1e-3], sigma_zz=[2.0e5, 1.0e5], load=1.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_reference(profile, f"{folder}/rod.h5")
    ...     read_reference(f"{folder}/rod.h5").sigma_zz
    array([200000., 100000.])
    """
    ideal = ideal_reference(path)
    if ideal is not None:
        return ideal.profile()
    if os.fspath(path).lower().endswith(_PIXELS):
        return _read_pixels(path, pixel_size).profile()
    if pixel_size is not None:
        raise InputError(
            f"A pixel size is given, but {os.fspath(path)} is no array and no image.",
            cure="Leave it out (pixel_size, --pixel-size).",
        )
    with open_hdf5(path, accept_altered=accept_altered) as file:
        return profile_from(file)


def ideal_reference(text: FilePath) -> IdealReference | None:
    """Return the ideal reference that a text names; nothing of a file that exists."""
    given = os.fspath(text).strip()
    named = _NAMED.fullmatch(given)
    match = named or _MISSPELT.fullmatch(given)
    if match is None or os.path.exists(text):
        return None
    shape = match[1].lower()
    size = match[2]
    if named is None or shape not in IDEAL:
        example = f"{shape}:{size}" if shape in IDEAL else "disc:0.5mm"
        cure = (
            f"Sources are disc:R, slit:W and gaussian:S, each with a unit ({example}), and point."
        )
        raise InputError(f"{text} cannot be read: it is no file, and no source.", cure=cure)
    if shape == "point" and not size:
        return IdealReference(shape)
    what = f"The {IDEAL[shape] or 'size'} of the reference {os.fspath(text)!r}"
    return IdealReference(shape, length(size or "", what))


def length(text: str, what: str) -> float:
    """Read a length with its unit, such as 0.5mm, in m."""
    match = _LENGTH.fullmatch(text)
    if match is None:
        raise InputError(
            f"{what}, {text!r}, is no length.",
            cure="Give a number with a decimal point and a unit of length, such as 0.5mm or 200um.",
        )
    return float(to_si(float(match[1]), match[2], "length", what))


def _read_pixels(path: FilePath, pixel_size: float | None) -> StressField:
    """Read a field from a 2-D array or an image."""
    data = read_bytes(path)
    name = PurePath(path).name
    if pixel_size is None:
        raise InputError(
            f"The size of the pixels of {name} is not given.",
            why="An array or image does not state it.",
            cure="Give it, as pixel_size=5e-6 (in m), --pixel-size 5um on the command line.",
        )
    require_positive("pixel size", pixel_size, "m")
    with damage_named(f"{name} cannot be read"):
        array = name.lower().endswith(".npy")
        values = np.load(BytesIO(data), allow_pickle=False) if array else _image(data)
    notes = ""
    channels = values.shape[2] if values.ndim == 3 and not array else 0
    if channels in (2, 3, 4):
        notes = "Of the image the luminance was taken."
        values = values[..., :3] @ _LUMINANCE if channels > 2 else values[..., 0]
    if values.ndim != 2 or values.dtype.kind not in "biuf":
        raise InputError(
            f"{name} holds an array of shape {values.shape} and type {values.dtype}.",
            cure="Give one of numbers, in rows along y and columns along x.",
        )
    y, x = (pixel_size * np.arange(count) for count in values.shape)
    source = source_of(name, data)
    with placed(name):
        return StressField(x=x, y=y, values=values, unit="1", notes=notes, source=source)


def _image(data: bytes) -> NDArray[Any]:
    from PIL import Image

    with Image.open(BytesIO(data), formats=("PNG", "TIFF")) as image:
        side = max(image.size)
        if side > MOST_PIXELS:
            raise too_large(
                "The image",
                side,
                MOST_PIXELS,
                "pixels along a side",
                cure="Cut out the field, or average neighbouring pixels.",
            )
        return np.asarray(image.convert("RGB") if image.mode == "P" else image)


def profile_from(file: SafeFile) -> StressProfile:
    """Read the profile of an open memscal-reference file, or a field of another program."""
    if file.schema is None:
        require_unaltered(file)
        path = ""
        while isinstance(name := file.attribute(path or "/", "default"), str) and len(path) < 99:
            path = f"{path}/{name}"
        return read_field(file, path).profile()
    require_schema(file, REFERENCE_SCHEMA)
    require_unaltered(file)
    return read_profile(file, prefix="")


def write_reference(profile: StressProfile, path: FilePath, *, overwrite: bool = False) -> None:
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

    Examples
    --------
    >>> import memscal, tempfile
    >>> film = memscal.ElasticFilm(young_modulus=2.2e6, poisson_ratio=0.5, thickness=2e-3)
    >>> rod = memscal.indent(film, memscal.Rod(radius=0.25e-3), load=1.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     write_reference(rod.profile(), f"{folder}/rod.h5")
    ...     read_reference(f"{folder}/rod.h5").load
    1.0
    """
    entry = Group("NXentry", profile_groups(profile, prefix=""), {"default": "reference"})
    write_tree(file_tree(REFERENCE_SCHEMA, entry), path, overwrite=overwrite)
