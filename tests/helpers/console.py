"""What tests of the command line need: runs, their outcomes, and a look at a folder."""

import json
import os
import re
import resource
import subprocess
import sys
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

        def refuse(constant):
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


NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


def numbers(line: str) -> list[float]:
    """Return the numbers of a line of a table."""
    return [float(text) for text in NUMBER.findall(line)]


def words(line: str) -> list[str]:
    """What is left of a line of a table without its numbers and rules."""
    return NUMBER.sub("", line).replace("-", "").split()


def names(folder: Path) -> list[str]:
    """Names of everything in a folder, hidden files included."""
    return sorted(os.listdir(folder))


def run_program(
    *arguments: str, cwd: Path, limit: int | None = None, stdout: int = subprocess.PIPE, **env: str
) -> subprocess.CompletedProcess[str]:
    """Run the program, with a limit to the size of every file, which holds for root too."""
    return subprocess.run(
        [sys.executable, "-m", "memscal", *arguments],
        cwd=cwd,
        env={**os.environ, **env},
        stdout=stdout,
        stderr=subprocess.PIPE,
        text=True,
        encoding="utf-8",
        check=False,
        preexec_fn=limit and (lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))),
    )
