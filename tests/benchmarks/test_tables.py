"""Speed of importing tables: by their rows, and beside numpy's reader."""

import numpy as np
from helpers.machine import show, turns

from memscal import import_table, read_scan, write_scan


def table(folder, rows):
    x = np.linspace(-8.0, 8.0, rows)
    path = folder / f"{rows}.csv"
    head = "x/mm,u/mV,pass"
    columns = [x, np.exp(-(x**2)), np.arange(rows) // 1000]
    np.savetxt(path, np.stack(columns, axis=1), "%.6f", ",", header=head, comments="")
    return path


def work(path):
    """Import a table, write the scan and read it again."""
    scan = import_table(path, x="x", u="u", repeat="pass")
    write_scan(scan, path.with_suffix(".h5"), overwrite=True)
    assert read_scan(path.with_suffix(".h5")).u_zz.size == int(path.stem)


def test_the_time_of_a_row_does_not_grow_with_their_number(tmp_path):
    few, many = (table(tmp_path, rows) for rows in (50_000, 500_000))
    ratio = turns(lambda: work(many), lambda: work(few), rounds=3)
    show("import of 500,000 rows, over that of 50,000", ratio, 2 * 10, gross=2.0)


def test_a_table_is_read_as_fast_as_by_numpy(tmp_path):
    path = table(tmp_path, 200_000)
    ratio = turns(
        lambda: import_table(path, x="x", u="u", repeat="pass"),
        lambda: np.loadtxt(path, delimiter=",", skiprows=1),
        rounds=3,
    )
    show("table of 200,000 rows with its checks, over numpy.loadtxt", ratio, 6)
