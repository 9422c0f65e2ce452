"""Signals that end the program: the same clean-up, and an exit code of each."""

import os
import signal
import subprocess
import sys
import time

import pytest
from helpers.console import names

OLD = b"from last week"
OUTPUTS = ["rod_scan.h5", "sphere_dry.h5", "sphere_lubricated.h5"]
#: Tells when the program stands with all its outputs beside their targets.
STOPPED = """
import os, signal, sys, time
from memscal.formats import files
from memscal.cli import main
from memscal.__main__ import run
files.os.replace = lambda *_: (print("now", flush=True), time.sleep(60))
sys.argv[0] = "memscal"
sys.exit(run())
"""
ENDING = [(signal.SIGINT, 130), (signal.SIGTERM, 143), (signal.SIGHUP, 129)]


EXPERIMENT = ("simulate", "--experiment", "sphere", "--contacts", "2", "--load", "1", "--force")


def started(folder):
    """Begin to simulate over old outputs, deaf to hang-ups, and stop before they are renamed."""
    for name in OUTPUTS:
        (folder / name).write_bytes(OLD)
    command = [sys.executable, "-c", STOPPED, *EXPERIMENT, "-o", "."]
    process = subprocess.Popen(
        ["nohup", *command],
        cwd=folder,
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
    )
    assert process.stdout
    for line in process.stdout:
        if line == "now\n":
            break
    assert len(names(folder)) > 3
    return process


def ends(process, folder, code):
    """Assert that a program that was signalled says so and leaves what was there."""
    shown = process.communicate(timeout=300)[1]
    assert process.returncode == code
    assert "Interrupted. Nothing was left half-written." in shown
    assert "Traceback" not in shown
    assert names(folder) == OUTPUTS
    assert {(folder / name).read_bytes() for name in OUTPUTS} == {OLD}


def test_a_signal_that_is_ignored_stays_ignored(folder):
    with started(folder) as process:
        process.send_signal(signal.SIGHUP)
        time.sleep(0.2)
        assert process.poll() is None
        process.send_signal(signal.SIGTERM)
        ends(process, folder, 143)


@pytest.mark.parametrize(("number", "code"), ENDING)
@pytest.mark.parametrize("module", ["memscal.cli", "memscal.cli.output", "memscal.model.checks"])
def test_a_signal_during_an_import_has_no_traceback(tmp_path, number, code, module):
    """Wherever the program is while it starts: within an exec of text, too."""
    hook = (
        "import os, sys\n"
        "class Hook:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {module!r}:\n"
        f"            exec('os.kill(os.getpid(), {int(number)})')\n"
        "sys.meta_path.insert(0, Hook())\n"
        "from memscal.__main__ import run\n"
        "sys.exit(run())\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", hook, "inspect", "missing.h5"],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={**os.environ},
    )
    assert (done.returncode, "Traceback" in done.stderr) == (code, False)


@pytest.mark.parametrize(("number", "code"), ENDING)
@pytest.mark.parametrize("destructor", [False, True])
def test_a_signal_ends_the_program_wherever_it_comes(tmp_path, number, code, destructor):
    """Python kills itself by SIGINT after one in text that is run; in a destructor it is lost."""
    place = "class Late:\n    __del__ = lambda _: os.kill(os.getpid(), {n})\nLate(); time.sleep(9)"
    text = place if destructor else "os.kill(os.getpid(), {n})"
    script = (
        "import time\n"
        "import os, sys\n"
        "from memscal.cli import commands, main\n"
        "def stopped(*_, **__):\n"
        f"    exec({text.format(n=int(number))!r}, globals())\n"
        "commands.module = stopped\n"
        "sys.exit(main(['inspect', 'missing.h5']))\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, check=False)
    assert (done.returncode, b"Interrupted" in done.stderr) == (code, True)
    assert b"Traceback" not in done.stderr
