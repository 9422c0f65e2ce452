"""Files of SPEC and Bluesky: one scan is chosen of several."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from memscal import TableLayout, import_table
from memscal.errors import FormatError


@pytest.mark.parametrize(
    ("begun", "scan", "place"),
    [((1, 2, 3), 2, 1), ((3, 5, 9), 5, 1), ((3, 5, 9), 3, 0), ((7, 8, 9), 3, 2), ((4,), None, 0)],
)
def test_one_scan_of_a_file_is_read_and_several_are_refused(begun, scan, place, tmp_path: Path):
    """By the number after #S, else counted; names hold single blanks, and motors differ."""
    path = tmp_path / "run.spec"
    blocks = [
        f"#S {n}  ascan\n#N 3\n#L Motor {i}  Epoch  Sensor zz\n"
        + "".join(f"{x} {9 + x} {10 * i + x}\n" for x in range(-4, 5))
        for i, n in enumerate(begun)
    ]
    path.write_text("#F run\n\n" + "\n".join(blocks))
    names: Any = {"x": f"Motor {place}", "u": "Sensor zz"}
    units: Any = {"x_unit": "mm", "u_unit": "mV"}
    read = import_table(path, **names, layout=TableLayout(**units, scan=scan))
    np.testing.assert_allclose(read.u_zz * 1e3, 10 * place + np.arange(-4, 5), atol=1e-12)
    wrong = {99: "has no scan 99"} if len(begun) == 1 else {None: "several scans"}
    for number, why in wrong.items():
        with pytest.raises(FormatError, match=why):
            import_table(path, **names, layout=TableLayout(**units, scan=number))
