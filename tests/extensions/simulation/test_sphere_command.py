"""``memscal simulate --experiment sphere``."""

from helpers.console import names, run_program

import memscal
from memscal.extensions.simulation.command import FILES

SPHERE = ("simulate", "--experiment", "sphere")
FEW = ("--load", 0.69, "--lubricated-load", 0.69, "--contacts", 9, "--spacing", 2)


def test_existing_scans_are_replaced_only_if_it_is_asked_for(run, folder):
    assert run(*SPHERE, "-o", "run", *FEW).code == 0
    before = {name: (folder / "run" / name).read_bytes() for name in FILES}
    (folder / "run" / FILES[0]).unlink()
    run(*SPHERE, "-o", "run", *FEW, "--seed", 1).exits(4, "exists already")
    assert names(folder / "run") == sorted(FILES[1:])
    assert (folder / "run" / FILES[1]).read_bytes() == before[FILES[1]]
    (folder / "run" / "notes.txt").write_text("mine")
    assert run(*SPHERE, "-o", "run", *FEW, "--seed", 1, "--force").code == 0
    assert names(folder / "run") == sorted([*FILES, "notes.txt"])
    assert memscal.read_scan(f"run/{FILES[1]}").synthetic["seed"] == 1


def test_a_file_that_cannot_be_written_leaves_none_of_them(folder):
    # The last file has a longer table of contacts than the first, which alone would fit.
    few = [*map(str, FEW), "--repeats", "40", "--load-scatter", "0"]
    done = run_program(*SPHERE, "-o", "run", *few, cwd=folder, limit=42_000)
    assert done.returncode == 4, done.stderr
    assert "sphere" in done.stderr
    assert "Traceback" not in done.stderr
    assert names(folder) == []
