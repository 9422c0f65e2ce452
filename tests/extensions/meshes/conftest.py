"""Meshes read without a process each, where that is not what a test is about."""

import builtins
import os
import resource
import sys
import tempfile
import types
import warnings
from pathlib import Path

import h5py
import pytest

from memscal.extensions.meshes import mesh_files, worker


def limit_memory(memory, _):
    """Let this process have so much more memory than it has, and no other limit."""
    pages = int(Path("/proc/self/statm").read_text().split()[0])
    most = pages * resource.getpagesize() + memory
    resource.setrlimit(resource.RLIMIT_AS, (most, resource.RLIM_INFINITY))
    return True


@pytest.fixture
def at_once(monkeypatch):
    """Let the program that reads meshes run in this process, where memory can be limited."""
    limits = resource.getrlimit(resource.RLIMIT_AS)
    if sys.platform != "linux" or limits[1] != resource.RLIM_INFINITY:
        return

    def run(parts, *_):
        with tempfile.TemporaryFile() as given, tempfile.TemporaryFile() as answer:
            given.writelines(parts)
            given.seek(0)
            duplicate = os.dup
            output = {1: answer.fileno()}
            with pytest.MonkeyPatch.context() as patch, warnings.catch_warnings():
                # The program leaves its output, and what it puts in the place of these, to its end.
                warnings.simplefilter("ignore", ResourceWarning)
                patch.setattr(os, "dup", lambda number: duplicate(output.get(number, number)))
                patch.setattr(builtins, "open", open)
                patch.setattr(sys, "stdin", types.SimpleNamespace(buffer=given))
                patch.setitem(sys.modules, "h5py", h5py)
                patch.setattr(worker, "_limit", limit_memory)
                patch.setattr(worker, "_forbid_files", lambda: None)
                try:
                    worker.main()
                finally:
                    resource.setrlimit(resource.RLIMIT_AS, limits)
            answer.seek(0)
            return answer.read()

    monkeypatch.setattr(mesh_files, "_run", run)
