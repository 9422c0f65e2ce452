"""Columns of recorded files, whose names are paths and hold no units."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from memscal.formats.tables.sheets import FrameTable
from memscal.model.provenance import SourceFile


class RecordedColumns(FrameTable):
    """Arrays by their paths, in which what follows a slash is no unit."""

    _cut = staticmethod(lambda name: (name,))

    def __init__(
        self,
        source: SourceFile,
        arrays: Mapping[str, Any],
        units: Sequence[str],
        rows: int,
        defaults: Mapping[str, str],
        **reading: Any,
    ) -> None:
        values = [*arrays.values()]
        super().__init__(
            source.file_name,
            [*arrays],
            rows,
            lambda i: _in_seconds(values[i][...]),
            units=units,
            source=source,
            **reading,
        )
        self.defaults = defaults


def _in_seconds(values: Any) -> Any:
    """Return time stamps in seconds from the first of them, and other values as they are."""
    if values.dtype.kind != "M":
        return values
    return (values - values.min()) / np.timedelta64(1, "s")
