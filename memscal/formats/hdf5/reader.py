"""The one safe HDF5 reader: for files that come from anywhere, in any state.

HDF5 sees bytes in memory and never the disk; only known paths are opened, along hard links, and
every dataset is checked before it is read.
"""

import json
import math
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import replace
from functools import partial, wraps
from pathlib import PurePath
from typing import Any, TypeVar, cast

import h5py
import numpy as np

from memscal.errors import FormatError, InputError, UnsafeFileError, placed
from memscal.formats.files import FilePath, damage_named, read_bytes
from memscal.formats.hdf5 import limits
from memscal.formats.hdf5.limits import MAX_TEXT_BYTES, refuse
from memscal.formats.hdf5.writer import SCHEMA_ATTRIBUTE
from memscal.formats.units import dimension_of, to_si
from memscal.model.arrays import FloatArray, Values
from memscal.model.notation import printable
from memscal.model.provenance import SourceFile, source_of
from memscal.model.quantities import DIMENSIONS
from memscal.model.sizes import MOST_HDF5_BYTES

_MAX_ATTRIBUTE_BYTES = 2**16
_MAX_ATTRIBUTE_ITEMS = 64
_MAX_ITEMS = 10_000
_SCALES = b"DIMENSION_LIST"
#: What changes the numbers of an array: beside it, and among its attributes, with which of them it
#: changes; a fill value may have been stored in fewer digits.
_BESIDE = ("_scaling_factor", "_offset", "_mask")
_OF_ALL = ("scaling_factor", "mask")  # the first of older NXdata
_FACTORS = "scale_factor scaling_factor scale slope conversion conversion_factor multiplier"
_SAME = partial(np.isclose, rtol=1e-6, atol=0)
_CHANGES: dict[str, Callable[[Any, Any], Any]] = {
    **dict.fromkeys(_FACTORS.split(), lambda _, factor: factor != 1),
    **dict.fromkeys(("add_offset", "offset", "intercept"), lambda _, offset: offset != 0),
    "_FillValue": _SAME,
    "missing_value": _SAME,
    "valid_min": np.less,
    "valid_max": np.greater,
    "valid_range": lambda values, ends: (values < ends.min()) | (values > ends.max()),
}
StoredAttribute = str | int | float | tuple[str, ...] | tuple[float, ...] | None
"""Text, a number, a few of either, or nothing."""

_Read = TypeVar("_Read", bound=Callable[..., Any])
_SIGNATURE = b"\x89HDF\r\n\x1a\n"


@contextmanager
def open_hdf5(path: FilePath, *, accept_altered: bool = False) -> Iterator["SafeFile"]:
    """Open an HDF5 file safely, for the time of a ``with`` block."""
    data = read_bytes(path, limit=MOST_HDF5_BYTES)
    name = PurePath(path).name
    if not data.startswith(_SIGNATURE):
        raise FormatError(
            f"{name} is not an HDF5 file.",
            why="It does not begin with HDF5's signature.",
            cure="Convert a table with `memscal import`.",
        )
    source = source_of(name, data)
    with damage_named(f"{name} cannot be opened as HDF5"):
        # The library's own copy of the bytes: no call of Python for each piece that it looks at.
        file = h5py.File(h5py.h5f.open_file_image(data))
        opened = SafeFile(file, source, data, accept_altered=accept_altered)
    try:
        # The dataclasses check values without knowing where they come from.
        with placed(name):
            yield opened
    finally:
        with suppress(Exception):
            file.close()


def _finite(text: str) -> float:
    """Return a number of JSON, which has no others."""
    number = float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is no finite number")
    return number


def _kept(read: _Read) -> _Read:
    """Keep what a method reads at a path, or of an attribute there; say where it is damaged."""

    @wraps(read)
    def kept(file: "SafeFile", *place: str) -> Any:
        key = (read, *place)
        if key not in file.kept:
            with damage_named(f"{file.where('@'.join(place))} cannot be read"):
                file.kept[key] = read(file, *place)
        return file.kept[key]

    return cast("_Read", kept)


class SafeFile:
    """An open file whose content is reached by known paths only."""

    def __init__(self, file: Any, source: SourceFile, data: bytes, *, accept_altered: bool) -> None:
        self.name = source.file_name
        self.source = source
        self._accept_altered = accept_altered
        self._data = data
        self._opened = {"/": file["/"].id}
        # Of a small file no more than it may well stand for.
        self._budget = self._most = limits.most_held(len(data))
        self.kept: dict[Any, Any] = {}
        self._listed: frozenset[str] | None = None
        self._heaps: set[int] = set()  # addresses of those that are sound

    def where(self, path: str) -> str:
        """Return file and path as messages name them."""
        return f"{self.name}: {path}"

    @property
    def schema(self) -> StoredAttribute:
        """What the file says that it holds; nothing in most files of other programs."""
        return self.attribute("/", SCHEMA_ATTRIBUTE)

    @property
    def verified(self) -> bool:
        """Whether the content was found to be what was written, or accepted as it is."""
        return self._listed is not None or bool(self.source.altered)

    def limit_to(self, paths: Iterable[str]) -> None:
        """From now on refuse what stands at any other path: no digest covers it."""
        self._listed = frozenset(paths)

    def refuse_altered(self, problem: str) -> None:
        """Refuse a file that is not as it was written; where that is accepted, record it."""
        if not self._accept_altered:
            raise FormatError(
                f"{self.name} was changed after it was written: {problem}.",
                why="Its numbers may not be those that were measured or calculated.",
                cure="Get the original file, or make it again (repeat the calibration). To use it "
                "as it is, accept it (accept_altered=True; --accept-altered): that is recorded.",
            )
        if not self.source.altered:
            self.source = replace(self.source, altered=problem)

    def has(self, path: str) -> bool:
        """Return whether a path exists; a link that is not a hard link is refused."""
        with damage_named(f"{self.where(path)} cannot be opened"):
            return self._open(path) is not None

    def is_group(self, path: str) -> bool:
        """Return whether a path exists and is a group."""
        with damage_named(f"{self.where(path)} cannot be opened"):
            return isinstance(self._open(path), h5py.h5g.GroupID)

    @_kept
    def array(self, path: str) -> np.ndarray[Any, Any]:
        """Return the numbers at a path: 64-bit floats, or 64-bit integers where stored so."""
        dataset = self._dataset(path)
        of = limits.check_layout(self.where(path), dataset, self._data, text=False)
        self._spend(path, of.held)
        whole = of.kind.get_class() == h5py.h5t.INTEGER
        values = np.empty(of.shape, dtype=np.int64 if whole else np.float64)
        dataset.read(h5py.h5s.ALL, h5py.h5s.ALL, values)
        self._require_plain(path, values)
        values.setflags(write=False)
        return values

    @_kept
    def claimed_number(self, path: str) -> int:
        """Return how many numbers a dataset claims to hold, of which none is read; 0 if absent."""
        if not self.has(path):
            return 0
        return math.prod(limits.Layout.of(self.where(path), self._dataset(path)).shape)

    @_kept
    def text(self, path: str) -> str:
        """Return the text at a path, without characters that do not print."""
        dataset = self._dataset(path, "It should hold text.")
        of = limits.check_layout(self.where(path), dataset, self._data, text=True)
        self._spend(path, of.size)
        if of.kind.is_variable_str():
            offset = dataset.get_offset() or -1
            self._check_length(
                path, limits.claimed_length(self._data, self._data, offset, self._heaps)
            )
        value = np.empty((), dtype=of.kind.dtype)
        dataset.read(h5py.h5s.ALL, h5py.h5s.ALL, value)
        return printable(value[()], MAX_TEXT_BYTES)

    @_kept
    def is_text(self, path: str) -> bool:
        """Return whether a path holds a string and not a number."""
        return bool(self._dataset(path).get_type().get_class() == h5py.h5t.STRING)

    @_kept
    def attribute(self, path: str, name: str) -> StoredAttribute:
        """Return an attribute: text, a number, a few texts, or ``None`` where there is none."""
        item = self._existing(path)
        key = name.encode("ascii")
        if not h5py.h5a.exists(item, key):
            return None
        attribute = h5py.h5a.open(item, key)
        where = f"{self.where(path)}@{name}"
        kind, shape, size = limits.Layout.of(where, attribute)
        number = math.prod(shape)
        if len(shape) > 1 or number > _MAX_ATTRIBUTE_ITEMS or size > _MAX_ATTRIBUTE_BYTES:
            raise refuse(where, f"has {number} values", "An attribute is one value or a few names.")
        text = kind.get_class() == h5py.h5t.STRING
        limits.check_type(where, kind, text=text)
        self._spend(path, size)
        if text and kind.is_variable_str():
            self._check_texts(path, item, key, number)
        values = np.empty(shape, dtype=kind.dtype)
        attribute.read(values)
        if not text:
            numbers = tuple(values.ravel().tolist())
            return numbers if number > 1 else next(iter(numbers), None)
        texts = tuple(printable(text, _MAX_ATTRIBUTE_BYTES) for text in values.flat)
        return texts if shape else texts[0]

    def units_of(self, path: str) -> str | None:
        """Return the unit that stands at a path, or ``None``."""
        units = self.attribute(path, "units") or self.attribute(path, "unit")
        if isinstance(units, tuple) and len(units) == 1:
            units = units[0]
        return None if units is None else str(units)

    def require_array(self, path: str, dimension: str, *, ndim: int | None = None) -> FloatArray:
        """Return the array at a path in SI units."""
        if not self.has(path):
            raise FormatError(
                f"{self.where(path)} is missing.",
                why=f"It should hold values of dimension {dimension}.",
                cure=f'Write it, with an attribute units such as "{DIMENSIONS[dimension].si}".',
            )
        values = self.array(path)
        if ndim is not None and values.ndim != ndim:
            raise FormatError(
                f"{self.where(path)} has {values.ndim} dimensions, but {ndim} are expected.",
                cure="Check the shape of the array.",
            )
        return to_si(values, self.units_of(path), dimension, self.where(path))

    def require_scalar(self, path: str, dimension: str) -> float:
        """Return the one number at a path in SI units; an array of one is accepted."""
        return self.only_number(path, self.require_array(path, dimension))

    def only_number(self, path: str, values: FloatArray) -> float:
        """Return the one number that is stored at a path."""
        if values.size != 1:
            raise FormatError(
                f"{self.where(path)} has {values.size} values, but one number is expected."
            )
        return values.item()

    def any_scalar(self, path: str) -> tuple[float, str]:
        """Return a number of any dimension in SI units, with its SI unit."""
        dimension = dimension_of(self.units_of(path) or "1", self.where(path))
        return self.require_scalar(path, dimension), DIMENSIONS[dimension].si

    def optional_text(self, path: str) -> str:
        """Return the text at a path, empty where there is none."""
        return self.text(path) if self.has(path) else ""

    def json_value(self, path: str, kind: type[list[Any] | Values], default: Any) -> Any:
        """Return JSON of a type (``list`` or ``dict``), or the default where there is none."""
        if not self.has(path):
            return default
        try:
            value = json.loads(self.text(path), parse_constant=_finite, parse_float=_finite)
        except (ValueError, RecursionError) as error:
            raise InputError(
                f"{self.where(path)} is not JSON: {error}.", cure="Write the file again."
            ) from error
        if not isinstance(value, kind):
            raise FormatError(f"{self.where(path)} should hold a JSON {kind.__name__}.")
        if len(value) > _MAX_ITEMS:
            raise FormatError(f"{self.where(path)} lists {len(value):,} items.")
        return value

    def text_list(self, path: str) -> list[str]:
        """Return the texts of a JSON list, such as names; none where there is no list."""
        return [str(text) for text in self.json_value(path, list, [])]

    def scaled_by(self, path: str, scale: str) -> list[int]:
        """Return the axes of a dataset to which the dimension scale at a path is attached."""
        item = self._existing(path)
        axes = []
        if h5py.h5a.exists(item, _SCALES):
            with damage_named(f"{self.where(path)}@DIMENSION_LIST cannot be read"):
                attribute = h5py.h5a.open(item, _SCALES)
                lists = np.empty(attribute.shape, dtype=attribute.dtype)
                self._check_texts(path, item, _SCALES, lists.size)
                attribute.read(lists)
                for i, references in enumerate(lists):
                    with suppress(KeyError):  # of a scale that was deleted
                        scales = [h5py.h5r.dereference(at, item) for at in references]
                        axes += [i] * (self._open(scale) in scales)
        return axes

    def _require_plain(self, path: str, values: np.ndarray[Any, Any]) -> None:
        """Refuse numbers that others scale, shift or leave out before they use them."""
        beside = [path + name for name in _BESIDE]
        beside += [f"{path.rpartition('/')[0]}/{name}" for name in _OF_ALL]
        changes = [other for other in beside if values.ndim and self._open(other)]
        for name, change in _CHANGES.items():
            if h5py.h5a.exists(self._opened[path], name.encode()):
                with suppress(ValueError):  # a word, such as a linear scale
                    stated = np.array(self.attribute(path, name), float)
                    if np.any(change(values[..., None], stated)):
                        changes.append(f"{path}@{name}")
        if changes:
            raise FormatError(
                f"{self.where(path)} is not as it is meant: {changes[0]} changes its numbers.",
                why="Numbers are read as they are stored.",
                cure="Store them as they are meant, NaN where one is missing, and nothing beside.",
            )

    def _open(self, path: str) -> Any:
        """Return the object at a path, each part of which is a hard link; ``None`` if absent."""
        if path not in self._opened:
            folder, _, name = path.rpartition("/")
            self._opened[path] = self._follow(self._open(folder or "/"), path, name)
        item = self._opened[path]
        if item is not None and self._listed is not None and path not in self._listed:
            self.refuse_altered(f"{path} was added")
        return item

    def _follow(self, folder: Any, path: str, name: str) -> Any:
        key = name.encode()
        links = folder.links if isinstance(folder, h5py.h5g.GroupID) else None
        if links is None or not links.exists(key):
            return None
        if links.get_info(key).type != h5py.h5l.TYPE_HARD:
            raise UnsafeFileError(
                f"{self.where(path)} is reached through a soft, external or other link.",
                why="A link can lead to another file, to a pipe, or round in a circle.",
                cure="Copy the linked data into the file.",
            )
        return h5py.h5o.open(folder, key)

    def _existing(self, path: str, why: str = "") -> Any:
        item = self._open(path)
        if item is None:
            raise FormatError(f"{self.where(path)} is missing.", why=why)
        return item

    def _dataset(self, path: str, why: str = "") -> Any:
        item = self._existing(path, why)
        if not isinstance(item, h5py.h5d.DatasetID):
            raise FormatError(f"{self.where(path)} is not a dataset.")
        return item

    def _spend(self, path: str, size: int) -> None:
        self._budget -= size
        if self._budget < 0:
            raise refuse(
                self.where(path),
                "brings the data of this file over the limit",
                f"At most {self._most:,} bytes, as they are held, are read from it.",
            )

    def _check_length(self, path: str, length: int) -> None:
        if length > MAX_TEXT_BYTES:
            raise refuse(
                self.where(path),
                f"claims a text of {length:,} bytes",
                f"More than {MAX_TEXT_BYTES:,} bytes are not read, however small the file is.",
            )
        self._spend(path, length)

    def _check_texts(self, path: str, item: Any, key: bytes, number: int) -> None:
        address = h5py.h5o.get_info(item).addr
        for length in limits.attribute_text_lengths(self._data, address, key, number, self._heaps):
            self._check_length(path, length)
