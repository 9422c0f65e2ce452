"""Files of SPEC and Bluesky: one scan is chosen of several."""

import pytest

from memscal import TableLayout, import_table
from memscal.errors import FormatError


@pytest.mark.parametrize(
    ("begun", "scan", "place"),
    [((3, 5, 9), 5, 1), ((3, 5, 9), 3, 0), ((7, 8, 9), 3, 2), ((4,), None, 0), ((4, 4), None, -1)],
)
def test_one_scan_of_a_file_is_read_and_several_are_refused(begun, scan, place, tmp_path):
    """By the number after #S, else counted; names hold single blanks, and motors differ."""
    path = tmp_path / "run.spec"
    path.write_text("#F run\n")
    with path.open("a") as file:
        for i, n in enumerate(begun):
            file.write(f"\n#S {n}  ascan\n#L Motor {i}  Sensor zz\n0 {i}\n1 {10 * i}\n")
    layout = TableLayout(x_unit="mm", u_unit="V", scan=scan)
    if place < 0:
        with pytest.raises(FormatError, match="several scans"):
            import_table(path, x="Motor 0", u="Sensor zz", layout=layout)
    else:
        found = import_table(path, x=f"Motor {place}", u="Sensor zz", layout=layout)
        assert [*found.u_zz] == [place, 10 * place]
