"""What tests of the command line need: the outcome of a run, and a look at a folder."""

import json
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Self


@dataclass(frozen=True)
class Outcome:
    """What a run of the program left: its exit code and what it printed."""

    code: int
    out: str
    err: str

    @property
    def json(self) -> dict[str, Any]:
        """Standard output as the one object that it must be, in standard JSON."""

        def refuse(constant: str) -> None:
            raise AssertionError(f"{constant} is not JSON")

        value = json.loads(self.out, parse_constant=refuse)
        assert isinstance(value, dict)
        return value

    def exits(self, code: int, *words: str) -> Self:
        """Assert the exit code, and that words stand in the messages."""
        assert self.code == code, self.err
        for word in words:
            assert word in self.err, self.err
        return self


Run = Callable[..., Outcome]
"""Run ``memscal`` with arguments."""


def names(folder: Path) -> list[str]:
    """Names of everything in a folder, hidden files included."""
    return sorted(os.listdir(folder))
