"""Damage to valid files: bytes, values of HDF5 with the digest made anew, cells of tables."""

import contextlib
import json
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import h5py
import numpy as np
from helpers.digests import rewrite_digest
from hypothesis import strategies as st

from memscal import MemscalError
from memscal.formats.hdf5.writer import CONTENTS_PATH, DIGEST_ATTRIBUTE

NUMBERS = (
    0.0,
    -0.0,
    1.0,
    -1.0,
    1e-9,
    1e9,
    1e-297,
    1e200,
    1e303,
    1e308,
    5e-324,
    float("nan"),
    float("inf"),
    float("-inf"),
)
SHAPES = ((), (0,), (1,), (2,), (7,), (7, 1), (1, 7), (3, 3), (2, 2, 2), (1, 1, 1, 1, 1))
TYPES = ("f2", "f4", "f8", ">f8", "i1", "u1", "i8", "u8", "bool", "c16", "S4", "O")
WORDS = json.loads(Path(__file__).with_name("damage.json").read_text(encoding="utf-8"))
UNITS = [*WORDS["units"], "x" * 5000]
TEXTS = [*WORDS["texts"], "[" * 5000, "x" * 100_000]
CELLS = [*WORDS["cells"], "9" * 400]


class ByteChange(NamedTuple):
    """A change of bytes: where (a share of the file), what, and how much."""

    kind: str
    where: float
    size: int
    value: int


BYTES = st.lists(
    st.builds(
        ByteChange,
        st.sampled_from(("flip", "set", "delete", "insert", "repeat", "truncate", "zero")),
        st.floats(0, 1),
        st.integers(1, 64),
        st.integers(0, 255),
    ),
    min_size=1,
    max_size=6,
)


def change_bytes(data, changes):
    """Return data with changes of bytes."""
    for kind, where, size, value in changes:
        at = int(where * max(len(data) - 1, 0))
        before = data[:at]
        piece = data[at : at + size]
        after = data[at + size :]
        data = {
            "flip": before + bytes(b ^ (1 << value % 8) for b in piece[:1]) + piece[1:] + after,
            "set": before + bytes([value]) * len(piece) + after,
            "delete": before + after,
            "insert": before + bytes([value]) * size + piece + after,
            "repeat": before + piece * 3 + after,
            "truncate": before,
            "zero": before + bytes(len(piece)) + after,
        }[kind]
    return data


class Edit(NamedTuple):
    """An edit of an HDF5 file: what is done to the item of a number, or at a path, with what."""

    kind: str
    item: int | str
    number: float = 1.0
    shape: tuple[int, ...] = ()
    dtype: str = "f8"
    text: str = ""
    unit: str = ""


EDITS = st.lists(
    st.builds(
        Edit,
        st.sampled_from(
            (
                "scale",
                "fill",
                "element",
                "replace",
                "units",
                "units",
                "text",
                "delete",
                "attribute",
                "drop attribute",
                "group",
                "sparse",
                "chunks",
            )
        ),
        st.integers(0, 10_000),
        st.sampled_from(NUMBERS),
        st.sampled_from(SHAPES),
        st.sampled_from(TYPES),
        st.sampled_from(TEXTS),
        st.sampled_from(UNITS),
    ),
    min_size=1,
    max_size=4,
)


def edit_hdf5(data, edits, *, digest):
    """Return an HDF5 file with edits; with ``digest`` it states that of what it then holds."""
    with TemporaryDirectory() as folder:
        path = Path(folder, "edited.h5")
        path.write_bytes(data)
        with h5py.File(path, "r+", libver=("earliest", "v110")) as file:
            for edit in edits:
                _edit(file, edit)
            listed = digest and DIGEST_ATTRIBUTE in file.attrs and _list_contents(file)
        if listed:
            with contextlib.suppress(MemscalError):  # no digest covers what is refused
                rewrite_digest(path)
        return path.read_bytes()


def _items(file):
    """What stands at each path, in one pass: to open an item by its path takes far longer."""
    items = {}
    file.visititems(lambda name, item: items.update({f"/{name}": item}))
    return {path: item for path, item in items.items() if not path.startswith("/entry/contents")}


def _edit(file, edit):
    paths = _items(file)
    datasets = {path: item for path, item in paths.items() if isinstance(item, h5py.Dataset)}
    # What an edit made to claim gigabytes is not filled with them.
    small = {path: item for path, item in datasets.items() if (item.size or 0) < 10**6}
    numbers = [path for path, item in small.items() if item.dtype.kind in "fiu"]
    chosen = {"text": [p for p in datasets if p not in numbers], "delete": [*paths]}
    chosen |= {"attribute": ["/", *paths], "drop attribute": ["/", *paths], "group": [*datasets]}
    among = chosen.get(edit.kind, numbers)
    if not among:
        return
    path = edit.item if isinstance(edit.item, str) else among[edit.item % len(among)]
    place = len(path) if isinstance(edit.item, str) else edit.item
    item = file[path]
    with np.errstate(all="ignore"):
        if edit.kind == "scale":
            item[...] = np.nan_to_num(item[()] * edit.number).astype(item.dtype)
        elif edit.kind == "fill":
            item[...] = _as(edit.number, item.dtype)
        elif edit.kind == "element" and item.size:
            values = item[()].reshape(-1)
            values[place % values.size] = _as(edit.number, item.dtype)
            item[...] = values.reshape(item.shape)
        elif edit.kind in ("replace", "sparse", "chunks"):
            _replace(file, path, edit)
        elif edit.kind == "units":
            item.attrs["units"] = edit.unit
        elif edit.kind == "text":
            del file[path]
            file[path] = edit.text.replace("\x00", "")
        elif edit.kind in ("delete", "group"):
            del file[path]
            if edit.kind == "group":
                file.create_group(path)
        elif edit.kind == "attribute":
            names = sorted(set(item.attrs) - {DIGEST_ATTRIBUTE}) or ["units"]
            item.attrs[names[place % len(names)]] = edit.text[:1000].replace("\x00", "")
        elif edit.kind == "drop attribute" and (names := sorted(item.attrs)):
            del item.attrs[names[place % len(names)]]


def _as(number, dtype):
    return number if dtype.kind == "f" else int(np.clip(np.nan_to_num(number), 0, 100))


def _replace(file, path, edit):
    attributes = dict(file[path].attrs)
    of = file[path].parent
    name = path.rpartition("/")[2]
    del file[path]
    shape = edit.shape
    options = {}
    if edit.kind == "sparse":  # claims much, and holds nothing
        shape = (2**27, 3)
        options = {"chunks": (2**12, 3), "compression": "gzip"}
    elif edit.kind == "chunks":
        shape = (40,)
        options = {"chunks": (20,), "compression": "gzip", "shuffle": True}
    dtype = h5py.string_dtype() if edit.dtype == "O" else edit.dtype
    made = of.create_dataset(name, shape, dtype, **options)
    if edit.kind != "sparse" and np.dtype(made.dtype).kind in "fiu" and made.size:
        made[...] = _as(min(max(np.nan_to_num(edit.number), -6e4), 6e4), made.dtype)
    for key in attributes.keys() & {"units"}:
        made.attrs[key] = attributes[key]


def _list_contents(file):
    """Have the file list its contents, as its writer would; return whether it can."""
    items = _items(file)
    sizes = [item.size or 0 for item in items.values() if isinstance(item, h5py.Dataset)]
    if "/entry/contents" not in file or max(sizes, default=0) > 10**6:
        return False
    contents = {"/": sorted(set(file.attrs) - {DIGEST_ATTRIBUTE})}
    for path, item in [*items.items(), ("/entry/contents", file["/entry/contents"])]:
        names = set(item.attrs) - {"DIMENSION_LIST", "REFERENCE_LIST", "CLASS", "NAME"}
        contents[path] = sorted(names)
    contents |= {f"/entry/contents/{name}": [] for name in file["/entry/contents"]}
    contents[CONTENTS_PATH] = []
    if CONTENTS_PATH in file:
        del file[CONTENTS_PATH]
    file[CONTENTS_PATH] = json.dumps(contents, sort_keys=True)
    return True


class CellChange(NamedTuple):
    """A change of the text of a table."""

    kind: str
    row: int
    column: int
    text: str


TABLE = st.lists(
    st.builds(
        CellChange,
        st.sampled_from(
            (
                "cell",
                "cell",
                "drop",
                "double",
                "insert",
                "separator",
                "encoding",
                "line ends",
            )
        ),
        st.integers(0, 100),
        st.integers(0, 5),
        st.sampled_from(CELLS),
    ),
    min_size=1,
    max_size=5,
)


def change_table(data, changes):
    """Return a table of text with changes of cells, rows, separators or encoding."""
    lines = data.decode().splitlines()
    end = "\n"
    encoding = "utf-8"
    for kind, row, column, text in changes:
        row %= max(len(lines), 1)
        cells = lines[row].split(",") if lines else [""]
        if kind == "cell" and lines:
            cells[column % len(cells)] = text
            lines[row] = ",".join(cells)
        elif kind in ("drop", "double") and lines:
            lines[row : row + 1] = [] if kind == "drop" else [lines[row]] * 2
        elif kind == "insert":
            lines.insert(row, text)
        elif kind == "separator":
            lines = [line.replace(",", (";", "\t", " ", "|")[column % 4]) for line in lines]
        elif kind == "encoding":
            encoding = ("utf-16", "utf-8-sig", "latin-1", "utf-32")[column % 4]
        else:
            end = ("\r\n", "\r", "\n\n", "\x0b")[column % 4]
    return end.join(lines).encode(encoding, "replace")
