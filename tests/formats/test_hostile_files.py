"""Files built to read, run, hang or exhaust something: each is refused, and says why."""

import os
import subprocess
import sys
import tracemalloc
import zlib
from functools import lru_cache
from pathlib import Path

import h5py
import numpy as np
import pytest
from helpers.bounds import FULL
from helpers.builders import make_scan

from memscal import read_scan, write_scan
from memscal.errors import FormatError, InputError, UnsafeFileError
from memscal.formats.hdf5 import limits
from memscal.formats.hdf5.writer import DIGEST_ATTRIBUTE

SIGNAL = "/entry/data/u_zz"
SWEEP = """
import pathlib, sys
from memscal.errors import MemscalError
from memscal.formats.scan import read_scan

path = pathlib.Path(sys.argv[1])
good = path.read_bytes()
heap = good.rfind(b"GCOL")
read = refused = 0
step = int(sys.argv[2])
for i in [*range(8, len(good), 293 * step), *range(heap, heap + 160, step)]:
    flipped = good[i] ^ (0xFF if i % 2 else 0x04)
    path.write_bytes(good[:i] + bytes([flipped]) + good[i + 1 :])
    try:
        read_scan(path)
        read += 1
    except MemscalError:
        refused += 1
print(read, refused)
"""


def filtered(group, size, chunk, flag, filters):
    """Make u_zz with filters in an order or of a kind that h5py's own interface does not offer."""
    plist = h5py.h5p.create(h5py.h5p.DATASET_CREATE)
    plist.set_chunk((chunk,))
    for code, options in filters:
        plist.set_filter(code, flag, options)
    space = h5py.h5s.create_simple((size,))
    kind = h5py.h5t.NATIVE_DOUBLE
    return h5py.Dataset(h5py.h5d.create(group.id, b"u_zz", kind, space, plist))


@pytest.fixture
def path(folder):
    """A good scan without a digest, as another program writes it."""
    path = folder / "scan.h5"
    write_scan(make_scan(), path)
    with h5py.File(path, "r+") as file:
        del file.attrs[DIGEST_ATTRIBUTE]
    return path


@pytest.fixture
def edited(path):
    """Return a function that replaces u_zz of a good scan by something else."""

    def edit(make):
        with h5py.File(path, "r+") as file:
            del file[SIGNAL]
            made = make(file["/entry/data"])
            if isinstance(made, h5py.Dataset):
                made.attrs["units"] = "mV"
        return path

    return edit


def assert_refused_cheaply(path, *words):
    """The refusal names file and path, and costs less memory than twenty times the file."""
    tracemalloc.start()
    try:
        with pytest.raises(UnsafeFileError) as caught:
            read_scan(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert f"scan.h5: {SIGNAL}" in caught.value.problem
    assert caught.value.why
    assert caught.value.cure
    for word in words:
        assert word in str(caught.value)
    assert peak < 20 * path.stat().st_size + 2**22


def test_an_external_link_to_a_pipe_is_refused_without_waiting(edited):
    os.mkfifo("pipe.h5")
    path = edited(lambda g: g.__setitem__("u_zz", h5py.ExternalLink("pipe.h5", "/x")))
    assert_refused_cheaply(path, "link")


def test_a_soft_link_half_way_along_the_path_is_refused(path):
    with h5py.File(path, "r+") as file:
        file.move("/entry/data", "/entry/hidden")
        file["/entry/data"] = h5py.SoftLink("/entry/hidden")
    with pytest.raises(UnsafeFileError, match="/entry/data"):
        read_scan(path)


def test_external_storage_is_refused_and_the_other_file_stays_unread(edited, tmp_path):
    secret = tmp_path / "secret.bin"
    secret.write_bytes(np.full(33, 42.0).tobytes())
    before = secret.stat().st_atime_ns
    path = edited(lambda g: g.create_dataset("u_zz", (33,), "f8", external=[(str(secret), 0, 264)]))
    assert_refused_cheaply(path, "external")
    assert secret.stat().st_atime_ns == before


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda g: g.__setitem__("u_zz", h5py.SoftLink("/entry/data/x")), "link"),
        (
            lambda g: g.create_dataset("u_zz", (2**45,), "f8", chunks=(1024,)),
            "claims 281,474,976,710,656 bytes",
        ),
        (lambda g: g.create_dataset("u_zz", (2**40, 2**22), "f8", chunks=(1, 1024)), "claims"),
        (
            lambda g: g.create_dataset("u_zz", (1,), "f8", maxshape=(None,), chunks=(2**26,)),
            "chunks of 536,870,912 bytes",
        ),
        (
            lambda g: g.create_dataset(
                "u_zz", (4096, 1), "f8", chunks=(1, 2**17), maxshape=(None, None)
            ),
            "chunks of 4,294,967,296 bytes",
        ),
        # Numbers count as they are held: of 163 kB 3.1 GB were.
        (
            lambda g: g.create_dataset("u_zz", data=np.ones(10**8, "i1"), compression="gzip"),
            "claims 800,000,000 bytes",
        ),
        (
            lambda g: g.create_dataset("u_zz", data=np.ones(2 * 10**7, "i1"), compression="gzip"),
            "bytes, as they are held",
        ),
        (lambda g: g.create_dataset("u_zz", (2**23,), "f8", chunks=(1,)), "8,388,608 chunks"),
        (lambda g: g.create_dataset("u_zz", (33,), "f8"), "never written"),
        (lambda g: g.create_dataset("u_zz", (33,), "f8", chunks=(11,)), "never written"),
        (lambda g: g.create_dataset("u_zz", data=[g.ref] * 3, dtype=h5py.ref_dtype), "references"),
        (lambda g: g.create_dataset("u_zz", data=h5py.Empty("f8")), "null dataspace"),
    ],
)
def test_a_dataset_that_cannot_be_read_safely_is_refused(edited, make, words):
    path = edited(make)
    assert path.stat().st_size < 2**20
    assert_refused_cheaply(path, words)


@lru_cache
def compressed(size):
    """Zeros, compressed."""
    return zlib.compress(bytes(size))


@pytest.mark.parametrize(
    "filters",
    [
        {"compression": "gzip"},
        {"compression": "gzip", "shuffle": True, "fletcher32": True},
    ],
    ids=["gzip", "all"],
)
@pytest.mark.parametrize("number", [2**25, 1023, 0])
def test_a_chunk_that_does_not_unpack_to_its_size_is_refused(edited, filters, number):
    """HDF5 unpacks all of it: of half a megabyte 562 MB were held, and the file passed."""

    def make(group):
        dataset = group.create_dataset("u_zz", (1024,), "f8", chunks=(1024,), **filters)
        dataset.id.write_direct_chunk((0,), compressed(8 * number))
        return dataset

    path = edited(make)
    assert path.stat().st_size < 2**20
    assert_refused_cheaply(path, "does not unpack to 8,192 bytes")


@pytest.mark.parametrize("order", ["shuffle deflate fletcher32", "fletcher32 deflate"])
def test_a_packed_chunk_is_read_whatever_the_order_of_its_filters(edited, order):
    options = {"deflate": (6,), "shuffle": (8,), "fletcher32": ()}
    filters = [
        (getattr(h5py.h5z, f"FILTER_{name.upper()}"), options[name]) for name in order.split()
    ]

    def make(group):
        dataset = filtered(group, 33, 20, h5py.h5z.FLAG_MANDATORY, filters)
        dataset[:] = np.arange(33.0)
        return dataset

    np.testing.assert_allclose(read_scan(edited(make)).u_zz, np.arange(33.0) * 1e-3)


def test_records_of_attributes_that_are_forged_by_the_thousand_are_not_all_followed(path):
    """Of 32 MB of them each was followed, which took 40 s."""
    copy = path.with_name("copy.h5")
    with h5py.File(path) as ours, h5py.File(copy, "w", libver="latest") as file:
        ours.copy("/entry", file)
        for i in range(30):
            file.attrs[f"further_{i}"] = "y"
        for name, value in ours.attrs.items():
            file.attrs[name] = value
    good = copy.read_bytes()
    forged = b"\3\0\17\0\x10\0\x10\0\0memscal_schema\0"
    path.write_bytes(good + forged * 10_000)
    with pytest.raises(FormatError, match="more namesakes than can be checked"):
        read_scan(path)
    path.write_bytes(good + forged * 9_000)
    read_scan(path)


def test_a_virtual_dataset_with_a_missing_source_is_refused(edited):
    layout = h5py.VirtualLayout((33,), "f8")
    layout[:] = h5py.VirtualSource("missing.h5", "/x", (33,))
    assert_refused_cheaply(edited(lambda g: g.create_virtual_dataset("u_zz", layout)), "virtual")


@pytest.mark.parametrize(
    ("code", "options", "times", "words"),
    [
        (h5py.h5z.FILTER_DEFLATE, (9,), 2, "gzip more than once"),
        (h5py.h5z.FILTER_LZF, (), 1, f"filter {h5py.h5z.FILTER_LZF}"),
        (32015, (), 1, "filter 32015"),
    ],
)
def test_filters_that_expand_twice_or_load_foreign_code_are_refused(
    edited, code, options, times, words
):
    filters = [(code, options)] * times
    path = edited(lambda g: filtered(g, 2**20, 2**20, h5py.h5z.FLAG_OPTIONAL, filters))
    assert_refused_cheaply(path, words)


@pytest.mark.parametrize(
    ("dtype", "value"),
    [
        (h5py.vlen_dtype(np.float64), np.zeros(2**10)),
        (h5py.string_dtype(), "text"),
        (np.dtype([("a", "f8"), ("b", "i4")]), (1.0, 2)),
        (np.dtype("c16"), 1j),
        (np.dtype("S8"), b"text"),
        (np.dtype("V8"), b"12345678"),
        (h5py.enum_dtype({"a": 1}), 1),
    ],
    ids=["vlen", "vlen text", "compound", "complex", "text", "opaque", "enum"],
)
def test_a_type_that_is_no_plain_number_is_refused(edited, dtype, value):
    def make(group):
        dataset = group.create_dataset("u_zz", (2**16,), dtype)  # a bomb, were it to be expanded
        dataset[0] = value
        return dataset

    assert_refused_cheaply(edited(make), "numbers")


def test_a_group_in_the_place_of_a_dataset_is_refused(edited):
    with pytest.raises(FormatError, match=f"{SIGNAL} is not a dataset"):
        read_scan(edited(lambda g: g.create_group("u_zz")))


def test_one_dataset_of_many_names_meets_the_limit_of_the_file(edited, monkeypatch):
    monkeypatch.setattr(limits, "MOST_HDF5_BYTES", 2**17)

    def make(group):
        group.create_dataset("u_zz", data=np.zeros(2**13), compression="gzip")  # 64 KiB
        group["u_zz"].attrs["units"] = "mV"
        del group["u_xz"]
        group["u_xz"] = group["u_zz"]
        group["u_yz"] = group["u_xz"]

    with pytest.raises(UnsafeFileError, match="over the limit"):
        read_scan(edited(make))


@pytest.mark.parametrize(
    "value",
    [
        h5py.Empty("f8"),
        np.array([b"mm"] * 100),
        np.array([[b"m", b"V"], [b"m", b"V"]]),
        np.array([h5py.Reference()], dtype=h5py.ref_dtype),
        b"m" * 60_000,
    ],
    ids=["null", "many", "table", "reference", "long"],
)
def test_an_attribute_that_is_no_short_text_is_refused(edited, value):
    path = edited(lambda g: g.create_dataset("u_zz", data=np.zeros(33)))
    with h5py.File(path, "r+") as file:
        if isinstance(value, np.ndarray) and value.dtype == h5py.ref_dtype:
            value = np.array([file.ref], dtype=h5py.ref_dtype)
        del file[SIGNAL].attrs["units"]
        file[SIGNAL].attrs.create("units", value)
    with pytest.raises(InputError, match=SIGNAL):
        read_scan(path)


def test_text_from_a_file_cannot_steer_the_terminal(path):
    with h5py.File(path, "r+") as file:
        del file["/entry/title"]
        file["/entry/title"] = b"\x1b[2J\x07title \xff\xc3"
    assert read_scan(path).title == "[2Jtitle ��"


@pytest.mark.parametrize("libver", ["earliest", "v108", "latest"])
@pytest.mark.parametrize("further", [0, 5, 30])
def test_variable_text_is_read_in_every_version_of_the_format(libver, further):
    """Where attributes are many, HDF5 moves them out of the object's header."""
    write_scan(make_scan(), "ours.h5")
    path = "scan.h5"
    with h5py.File("ours.h5") as ours, h5py.File(path, "w", libver=libver) as file:
        ours.copy("/entry", file)
        x = file["/entry/data/x"]
        del file["/entry/title"], file["/entry/indenter/shape"], x.attrs["units"]
        file["/entry/title"] = "variable"
        file["/entry/indenter/shape"] = "sphere"
        file["/entry/data"].attrs["axes"] = ["x"]
        for item in (file, x):
            for i in range(further):
                item.attrs[f"further_{i}"] = "y" * i
        x.attrs["units"] = "um"
        for name in ours.attrs.keys() - {DIGEST_ATTRIBUTE}:
            file.attrs[name] = ours.attrs[name]
    scan = read_scan(path)
    assert (scan.title, scan.indenter.shape) == ("variable", "sphere")
    assert scan.x[0] == pytest.approx(-8e-6)


@pytest.mark.parametrize("further", [0, 30])
@pytest.mark.parametrize("place", ["dataset", "attribute"])
def test_a_variable_text_that_claims_four_gibibytes_is_refused(further, place):
    path = Path("scan.h5")
    marker = "a text of 33 bytes to be found..."
    write_scan(make_scan(), path)
    with h5py.File(path, "r+") as file:
        x = file["/entry/data/x"]
        del file["/entry/title"], x.attrs["units"]
        for i in range(further):
            x.attrs[f"further_{i}"] = "y"
        file["/entry/title"] = marker if place == "dataset" else "title"
        x.attrs["units"] = marker if place == "attribute" else "mm"
    data = path.read_bytes()
    descriptor = len(marker).to_bytes(4, "little") + data.rfind(b"GCOL").to_bytes(8, "little")
    assert data.count(descriptor) == 1
    path.write_bytes(data.replace(descriptor, b"\xff" * 4 + descriptor[4:]))
    with pytest.raises(UnsafeFileError, match="claims a text of 4,294,967,295 bytes"):
        read_scan(path)


def test_a_text_dataset_longer_than_any_text_is_refused(path):
    with h5py.File(path, "r+") as file:
        del file["/entry/title"]
        file["/entry"].create_dataset("title", data=np.bytes_(b"a" * (2**22 + 1)))
    with pytest.raises(UnsafeFileError, match="/entry/title claims"):
        read_scan(path)


def test_a_folder_a_device_and_a_pipe_are_refused_without_waiting():
    os.mkfifo("pipe")
    with pytest.raises(InputError, match="is not a regular file"):
        read_scan(".")
    for path in ("pipe", os.devnull):
        with pytest.raises(UnsafeFileError, match="not a regular file"):
            read_scan(path)


def test_a_missing_file_and_a_name_that_is_none_are_input_errors():
    with pytest.raises(InputError, match=r"missing\.h5 cannot be read: No such file"):
        read_scan("missing.h5")
    with pytest.raises(InputError, match="cannot be read"):
        read_scan("a\0b")


def test_a_file_over_the_size_limit_is_refused_unread():
    path = Path("large.h5")
    with path.open("wb") as file:
        file.truncate(2**30 + 1)  # sparse: it takes no room on the disk
    with pytest.raises(UnsafeFileError, match="1,073,741,825 bytes"):
        read_scan(path)


def test_every_truncation_is_an_error_of_ours(path):
    data = path.read_bytes()
    for length in [*range(0, 2048, 64), *range(2048, len(data), 1999), len(data) - 1]:
        path.write_bytes(data[:length])
        with pytest.raises(FormatError, match=r"scan\.h5") as caught:
            read_scan(path)
    assert "Get the file again" in caught.value.cure


def test_bytes_flipped_all_over_a_scan_neither_crash_nor_hang_a_process(path):
    """And all over a heap of texts. HDF5 could crash, or walk through them for ever."""
    with h5py.File(path, "r+") as file:
        del file["/entry/title"], file["/entry/data/x"].attrs["units"]
        file["/entry/title"] = "a title"
        file["/entry/data/x"].attrs["units"] = "mm"
    command = [sys.executable, "-c", SWEEP, str(path), "1" if FULL else "3"]
    done = subprocess.run(command, stdout=subprocess.PIPE, timeout=300, check=True)
    read, refused = map(int, done.stdout.split())
    assert min(read, refused) > 0


def test_the_plugin_path_is_off_before_the_hdf5_library_starts(tmp_path):
    plugins = tmp_path / "plugins"
    plugins.mkdir()
    (plugins / "libforeign.so").write_bytes(b"never loaded")
    watch = (
        "import os, sys\n"
        "class Watch:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        "        if name == 'h5py':\n"
        "            print(os.environ.get('HDF5_PLUGIN_PRELOAD'))\n"
        "sys.meta_path.insert(0, Watch())\n"
        "import memscal.formats.scan\n"
    )
    environment = {k: v for k, v in os.environ.items() if k != "HDF5_PLUGIN_PRELOAD"}
    environment["HDF5_PLUGIN_PATH"] = str(plugins)
    done = subprocess.run(
        [sys.executable, "-c", watch], capture_output=True, text=True, env=environment, check=True
    )
    assert done.stdout.strip() == "::"
