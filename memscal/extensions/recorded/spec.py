"""One scan of a file of SPEC or Bluesky, a text in which each scan begins with #S."""

import re
from collections.abc import Iterator, Sequence
from pathlib import PurePath
from typing import Any

from memscal.errors import FormatError
from memscal.formats.files import FilePath, read_pieces
from memscal.formats.tables.text_table import CELLS, TextTable
from memscal.model.sizes import MOST_TABLE_BYTES

_SCAN = re.compile(r"^#S\s+(\d+)", re.MULTILINE)
#: Labels of columns, which may hold single spaces.
_LABELS = re.compile(r"#L\s+(.+)")


class SpecScan(TextTable):
    """The table of one scan, by the number after #S or counted from 1; of several one is chosen."""

    def __init__(self, path: FilePath, *, scan: int | None = None, **reading: Any) -> None:
        self._scan = None if scan is None else self._place_of(path, scan)
        self._scans = 0
        self._labelled = False
        super().__init__(path, **reading)

    @staticmethod
    def _place_of(path: FilePath, scan: int) -> int:
        text = b"".join(read_pieces(path, limit=MOST_TABLE_BYTES)).decode("latin-1")
        numbers = [int(number) for number in _SCAN.findall(text.replace("\r", "\n"))]
        place = numbers.index(scan) + 1 if numbers.count(scan) == 1 else scan
        if not 0 < place <= len(numbers):
            raise FormatError(
                f"{PurePath(path).name} has no scan {scan}.",
                why=f"It has {len(numbers)} (lines that begin with #S).",
                cure="Give another.",
            )
        return place

    def _bare_numbers(self, block: bytes) -> None:
        """Look at each line: another scan may begin in any block."""

    def _table_of(self, lines: Sequence[str]) -> Iterator[str]:
        """Yield lines, those of other scans empty, and those below labels with tabs."""
        for line in lines:
            labels = _LABELS.match(line)
            text = line
            if _SCAN.match(line):
                self._scans += 1
                self._labelled = False
            elif labels and self._scans:
                self._labelled = True
                text = "\t".join(re.split(r"\t|\s{2,}", labels[1].strip()))
            elif self._labelled and CELLS.match(line):
                text = "\t".join(line.split())
            if self._scan is None and self._scans > 1:
                raise FormatError(
                    f"{self._name} holds several scans.",
                    why="Each begins with #S, and may have columns of its own.",
                    cure="Choose one: scan=N (--scan N), the number after #S or counted from 1.",
                )
            yield text if self._scan in (None, self._scans) else ""
