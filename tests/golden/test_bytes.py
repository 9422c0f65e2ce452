"""Two runs of the commands of ``commands_of_files.txt`` write the same bytes at the same time.

Set MEMSCAL_FULL_STUDY for two runs of them all; else the second runs those that simulate, calibrate
and compare.
"""

import hashlib
import os
import subprocess
import sys
from pathlib import Path

from golden.make import HERE, LINKS
from helpers.bounds import FULL

COMMANDS = (HERE / "commands_of_files.txt").read_text(encoding="utf-8").splitlines()
AGAIN = [c for c in COMMANDS if FULL or c.split()[0] in ("simulate", "calibrate", "compare")]
PROGRAM = """
import sys
from memscal.cli import main
if __name__ == "__main__":
    for command in sys.argv[1:]:
        code = main(command.split())
        if code not in (0, 1):
            sys.exit(f"memscal {command}: exit code {code}")
"""


def digests(folder: Path, hash_seed: str, commands: list[str]) -> dict[str, str]:
    """Run commands in a folder; return the digest of every file that they write."""
    folder.mkdir()
    for name, target in LINKS.items():
        (folder / name).symlink_to(target)
    run = subprocess.run(
        [sys.executable, "-c", PROGRAM, *commands],
        cwd=folder,
        env={**os.environ, "SOURCE_DATE_EPOCH": "1700000000", "PYTHONHASHSEED": hash_seed},
        capture_output=True,
        text=True,
        check=False,
    )
    assert run.returncode == 0, run.stderr
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_two_runs_write_the_same_bytes(tmp_path: Path):
    first = digests(tmp_path / "1", "1", COMMANDS)
    second = digests(tmp_path / "2", "2", AGAIN)
    assert {name: first[name] for name in second} == second
    kinds = {Path(name).suffix for name in first}
    assert kinds >= {".h5", ".html", ".pdf", ".png", ".svg", ".vtu"}
    assert {name.partition("/")[0] for name in first} >= {"contacts", "experiment", "figures"}
