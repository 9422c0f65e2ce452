"""Numbers that stand in the documentation are those that memscal calculates."""

import runpy
from pathlib import Path

import pytest

DOCS = Path(__file__).parent.parent / "docs"


@pytest.mark.parametrize("poisson_ratio", [0.5, 0.495])
def test_the_table_of_the_paper_s_sphere_is_what_its_script_prints(poisson_ratio: float) -> None:
    rows = runpy.run_path(str(DOCS / "sphere_table.py"))["table"](poisson_ratio)
    printed = (DOCS / "mechanics.md").read_text(encoding="utf-8")
    section = printed.split(f"### ν = {poisson_ratio}\n")[1].split("###")[0]
    stated = [line for line in section.splitlines() if line.startswith("|")]
    assert len(stated) == len(rows) == 38
    for line, row in zip(stated[2:], rows[2:], strict=True):
        # Another processor may round the last digit differently.
        ours, theirs = ([cell.split("/") for cell in text.split("|")[3:7]] for text in (row, line))
        assert line.split("|")[1:3] == row.split("|")[1:3]
        for mine, its in zip(ours, theirs, strict=True):
            assert [float(x) for x in its] == pytest.approx([float(x) for x in mine], rel=7e-4)
