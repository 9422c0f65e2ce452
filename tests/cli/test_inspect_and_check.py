"""``memscal inspect`` and ``memscal check``."""

import re

import h5py


def test_inspect_speaks_the_units_of_the_command_line(run, folder):
    run("simulate", "-o", "scan.h5", "--seed", 1)
    with h5py.File("scan.h5", "r+") as file:  # as another program may write it
        del file.attrs["memscal_content_sha256"]
        thickness = file["/entry/sample/film/thickness"]
        thickness[()] = 2000.0
        thickness.attrs["units"] = "um"
    assert re.search(r"thickness +\(2\.000 ± 0\.020\) mm", run("inspect", "scan.h5").out)
    quantities = {q["name"]: q for q in run("inspect", "scan.h5", "--json").json["quantities"]}
    assert quantities["thickness"]["unit"] == "um"


def test_check_finds_a_number_that_was_changed(run, artifact):
    with h5py.File(artifact, "r+") as file:
        file["/entry/parameters/conversion_constant"][()] *= 1.01
    done = run("check", artifact, "--json").exits(3)
    assert done.json["passed"] is False
    (failed,) = [finding for finding in done.json["findings"] if not finding["passed"]]
    assert failed["name"] == "digest"
    assert "not in order" in done.err
    assert "FAILED" in run("check", artifact).exits(3).out
