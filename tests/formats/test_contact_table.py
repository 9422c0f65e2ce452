"""Contact tables that are kept in a folder: found whole, or not at all."""

import os
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import h5py
import numpy as np
import pytest

from memscal.formats import cache as contact_table
from memscal.formats.cache import (
    find_contact_table,
    keep_contact_table,
    table_key,
)
from memscal.formats.hdf5.writer import Group, file_tree, write_tree

KEY = table_key({"load": 0.34})


def table(values=3):
    rng = np.random.default_rng(1)
    whole = (values, 2, 64)
    part = (values, 2)
    return {
        "value": np.append(np.arange(values - 1) / 3, np.inf),
        "load": np.array([0.34, 2.75]),
        "k": np.linspace(1.0, 1e4, 64),
        "spectra": rng.normal(size=whole),
        "by_load": rng.normal(size=whole),
        "change_thickness": rng.normal(size=whole),
        "change_poisson_ratio": rng.normal(size=whole),
        "depths": np.full(part, np.nan),
        "contact_radii": rng.normal(size=part),
        "convergence": rng.normal(size=part),
    }


def entry(key=KEY):
    return Path(f"{key}.h5")


def keep(key=KEY):
    keep_contact_table(Path(), key, table())


def find(key=KEY):
    return find_contact_table(Path(), key)


def test_a_table_comes_back_bit_for_bit_also_what_is_infinite_or_unknown():
    one = table()
    anew = Path("made", "anew")
    keep_contact_table(anew, KEY, one)
    found = find_contact_table(anew, KEY)
    assert list(found) == list(one)
    for name, array in one.items():
        np.testing.assert_array_equal(found[name], array)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.99])
def test_a_file_that_was_cut_off_is_not_found_and_is_replaced(share):
    keep()
    data = entry().read_bytes()
    entry().write_bytes(data[: int(share * len(data))])
    assert find() is None
    keep()
    assert find() is not None


def test_bytes_that_were_changed_never_give_other_numbers():
    keep()
    data = entry().read_bytes()
    one = table()
    for place in np.linspace(0, len(data) - 1, 60).astype(int):
        changed = bytearray(data)
        changed[place] ^= 0xFF
        entry().write_bytes(changed)
        found = find()
        assert found is None or np.array_equal(found["spectra"], one["spectra"])


def test_a_table_under_the_name_of_another_is_not_taken_for_it():
    other = table_key({"load": 2.75})
    keep(other)
    entry(other).rename(entry())
    assert find() is None


def test_a_file_of_another_kind_or_version_is_not_found():
    write_tree(file_tree("another-kind", Group("NXentry", {"key": KEY})), entry())
    assert find() is None
    keep()
    with h5py.File(entry(), "r+") as file:
        file.attrs["memscal_schema_version"] = "0.9.0"
    assert find() is None


def test_a_folder_that_cannot_be_made_costs_no_result():
    file = Path("file")
    file.write_text("not a folder")
    for folder in (file, file / "below"):
        keep_contact_table(folder, KEY, table())
        assert find_contact_table(folder, KEY) is None
    assert file.read_text() == "not a folder"


def test_the_tables_used_longest_ago_make_room(monkeypatch):
    monkeypatch.setattr(contact_table, "_MOST_ENTRIES", 3)
    keys = [table_key({"number": number}) for number in range(4)]
    for age, key in enumerate(keys[:3]):
        keep(key)
        os.utime(entry(key), (1e9 + age, 1e9 + age))
    assert find(keys[0]) is not None  # used again
    keep(keys[3])
    assert {key for key in keys if entry(key).exists()} == {keys[0], keys[2], keys[3]}


def test_several_may_write_and_read_one_entry_at_a_time():
    large = table(3)
    small = {name: array for name, array in large.items() if not name.startswith("change_")}

    def work(number):
        keep_contact_table(Path(), KEY, small if number % 2 else large)
        found = find()
        return found is not None and np.array_equal(found["spectra"], small["spectra"])

    with ThreadPoolExecutor(4) as pool:
        assert all(pool.map(work, range(24)))
    assert [path.name for path in Path().iterdir()] == [f"{KEY}.h5"]
