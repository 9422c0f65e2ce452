"""Two runs of a command write the same bytes, if they are told the same time."""

from __future__ import annotations

import hashlib
import os
import subprocess
import sys
from pathlib import Path

from golden.make import LINKS, SPHERE

COMMANDS = [
    "simulate -o scan.h5 --points 17",
    "simulate --experiment sphere -o experiment --points 33 --contacts 25 --spacing 0.6 --load 1",
    (
        "import meshes/vtk_film.vtu -o mesh.h5 --format reference --r-unit mm --sigma S"
        " --sigma-unit MPa --load 1"
    ),
    "reference rod --backend fem --rings 24 -o rod.h5 --figure rod.svg --mesh rod.vtu",
    "reference sphere --load 1 -o mu0.h5",
    "reference sphere --load 1 --friction inf -o sticking.h5",
    "calibrate data/rod_scan_33.h5 -o sensor.h5 --report report.html --figure scan.png",
    f"apply sensor.h5 {SPHERE}/sphere_lubricated.h5 -o stress.h5 --figure stress.svg --override",
    "restore sensor.h5 experiment/sphere_dry.h5 -o restored.h5 --figure restored.svg",
    (
        "compare sensor.h5 experiment/sphere_dry.h5 --friction 0.2 --loading total"
        " --cache contacts --figures figures --figure-format svg --override"
    ),
    "design --figure design.pdf",
]
PROGRAM = """
import sys
from memscal.cli import main
if __name__ == "__main__":
    for command in sys.argv[1:]:
        code = main(command.split())
        if code not in (0, 1):
            sys.exit(f"memscal {command}: exit code {code}")
"""


def digests(folder: Path, hash_seed: str) -> dict[str, str]:
    """Run the commands in a folder; return the digest of every file that they write."""
    folder.mkdir()
    for name, target in LINKS.items():
        (folder / name).symlink_to(target)
    environment = {"SOURCE_DATE_EPOCH": "1700000000", "PYTHONHASHSEED": hash_seed}
    done = subprocess.run(
        [sys.executable, "-c", PROGRAM, *COMMANDS],
        cwd=folder, env={**os.environ, **environment}, capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    return {
        path.relative_to(folder).as_posix(): hashlib.sha256(path.read_bytes()).hexdigest()
        for path in folder.rglob("*")
        if path.is_file()
    }


def test_two_runs_write_the_same_bytes(tmp_path: Path) -> None:
    first = digests(tmp_path / "first", hash_seed="1")
    second = digests(tmp_path / "second", hash_seed="2")
    assert first == second
    kinds = {Path(name).suffix for name in first}
    assert kinds >= {".h5", ".html", ".pdf", ".png", ".svg", ".vtu"}
    assert {name.partition("/")[0] for name in first} >= {"contacts", "experiment", "figures"}
