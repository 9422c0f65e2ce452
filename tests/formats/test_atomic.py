"""A file is written whole or not at all, never over an input, and never by surprise."""

import errno
import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest

from memscal.errors import OutputError
from memscal.formats import files
from memscal.formats.files import atomic_write_bytes, ensure_writable, together

OLD = b"the old output"


@pytest.fixture
def target(folder):
    path = folder / "out.h5"
    path.write_bytes(OLD)
    return path


def fail_with(code):
    def fail(*arguments, **options):
        raise OSError(code, os.strerror(code))

    return fail


def write_new(path):
    atomic_write_bytes(path, b"new", overwrite=True)


def prove_writable(path):
    ensure_writable(path, overwrite=True)


def assert_refused(path, words):
    for attempt in (prove_writable, write_new):
        with pytest.raises(OutputError, match=words) as caught:
            attempt(path)
        assert caught.value.exit_code == 4
        assert str(path) in caught.value.problem


def assert_untouched(target):
    assert target.read_bytes() == OLD
    assert os.listdir(target.parent) == [target.name]


@pytest.mark.parametrize("hard_links", [True, False])
def test_a_new_file_holds_the_bytes_and_nothing_else_is_left(monkeypatch, hard_links):
    if not hard_links:
        monkeypatch.setattr(os, "link", fail_with(errno.EPERM))
    atomic_write_bytes("new.bin", b"abc")
    assert Path("new.bin").read_bytes() == b"abc"
    assert os.listdir() == ["new.bin"]


@pytest.mark.parametrize("call", ["write", "fsync", "open"])
@pytest.mark.parametrize(
    ("code", "cure"),
    [
        (errno.ENOSPC, "Free some space"),
        (errno.EROFS, "read-only"),
        (errno.EACCES, "may write"),
        (errno.EDQUOT, "quota"),
        (errno.EIO, "another folder"),
    ],
    ids=["full disk", "read-only disk", "forbidden", "quota", "broken disk"],
)
def test_a_disk_that_refuses_leaves_the_old_output_and_says_what_to_do(
    target, monkeypatch, call, code, cure
):
    with monkeypatch.context() as patch:
        patch.setattr(os, call, fail_with(code))
        assert_refused(target, cure)
    assert_untouched(target)


def test_short_writes_are_continued(monkeypatch):
    write = os.write
    data = bytes(range(256)) * 10
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", lambda descriptor, part: write(descriptor, bytes(part)[:100]))
        atomic_write_bytes("a", data)
    assert Path("a").read_bytes() == data


def test_an_interrupt_leaves_no_temporary_file(target, monkeypatch):
    def interrupt(*arguments):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", interrupt)
        with pytest.raises(KeyboardInterrupt):
            write_new(target)
    assert_untouched(target)


def test_a_file_that_appears_late_is_not_replaced(monkeypatch):
    target = Path("out.h5")
    fsync = os.fsync

    def appear(descriptor):
        fsync(descriptor)
        target.write_bytes(OLD)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", appear)
        with pytest.raises(OutputError, match="File exists"):
            atomic_write_bytes(target, b"new")
    assert_untouched(target)


def test_the_permissions_are_those_of_the_umask():
    before = os.umask(0o027)
    try:
        atomic_write_bytes("a", b"")
    finally:
        os.umask(before)
    assert stat.S_IMODE(Path("a").stat().st_mode) == 0o640


def test_a_symbolic_link_is_followed_and_stays(target):
    link = target.parent / "link.h5"
    link.symlink_to(target)
    write_new(link)
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


def test_a_folder_a_pipe_and_a_device_are_refused_as_outputs():
    os.mkfifo("pipe")
    assert_refused(".", "is a folder")
    for path in ("pipe", os.devnull):
        assert_refused(path, "not a regular file")


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("missing/out.h5", "Create the folder"),
        ("file/out.h5", "a file, not a folder"),
        ("a" * 300, "shorter name"),
        ("", "not the name"),
    ],
)
def test_a_path_that_cannot_exist_is_refused_with_its_cure(name, words):
    Path("file").write_bytes(b"")
    assert_refused(name, words)


def test_a_folder_in_which_nothing_can_be_made_is_refused_before_the_work():
    with pytest.raises(OutputError) as caught:  # not even root can make a file there
        ensure_writable("/proc/self/out.h5")
    assert caught.value.exit_code == 4


def three():
    """Two old outputs and a new one."""
    paths = [Path(name) for name in ("a", "b", "c")]
    for path in paths[:2]:
        path.write_bytes(OLD)
    return paths


def write_together(paths, stop=None):
    """Write files into a folder that is made for them; then stop."""
    with together(paths[-1].parent):
        for path in paths:
            write_new(path)
        assert paths[0].read_bytes() == OLD
        if stop is not None:
            raise stop


@pytest.mark.parametrize("hard_links", [True, False])
@pytest.mark.parametrize("failing", ["a", "b", "c"])
def test_files_that_are_written_together_are_all_new_or_all_as_before(
    monkeypatch, hard_links, failing
):
    """Every rename in turn fails; without hard links the message says which file is new."""
    paths = three()
    rename = os.replace

    def replace(source, target):
        if Path(target).name == failing:
            raise OSError(errno.EIO, "broken")
        rename(source, target)

    with monkeypatch.context() as patch:
        patch.setattr(os, "replace", replace)
        if not hard_links:
            patch.setattr(os, "link", fail_with(errno.EPERM))
        with pytest.raises(OutputError, match=f"{failing} cannot be written") as caught:
            write_together(paths)
    new = [path.name for path in paths if path.exists() and path.read_bytes() != OLD]
    assert new == ([] if hard_links else ["a", "b", "c"][: "abc".index(failing)])
    stated = re.search(r"New is now: (.+?)\. As before is: ", caught.value.why)
    assert [Path(name).name for name in stated[1].split(", ")][::-1] == new if new else not stated
    assert sorted(os.listdir()) == ["a", "b"]


@pytest.mark.parametrize("mode", [0o600, 0o640, 0o444, 0o755])
def test_a_file_that_is_replaced_keeps_its_permissions(target, mode):
    target.chmod(mode)
    write_new(target)
    assert stat.S_IMODE(target.stat().st_mode) == mode


KILLED = """
import os, signal, sys
from memscal.formats.files import atomic_write_bytes
os.link = lambda *names: (print(flush=True), signal.pause())
atomic_write_bytes(sys.argv[1], b"new")
"""


def test_a_later_run_removes_what_a_killed_process_left_and_nothing_of_a_living_one():
    """However old it is, a file whose process lives stays; so does what is no file of ours."""
    command = [sys.executable, "-c", KILLED, "out"]
    with subprocess.Popen(command, stdout=subprocess.PIPE) as process:
        assert process.stdout.readline()
        (left,) = Path().iterdir()
        Path(".memscal-mine.tmp").write_bytes(OLD)
        for path in Path().iterdir():
            os.utime(path, (0, 0))
        atomic_write_bytes("a", b"")
        assert left.exists()
        process.kill()
    files._remove_orphans.cache_clear()
    os.utime(left)  # just now: another process may not have come to its lock
    atomic_write_bytes("b", b"")
    assert left.exists()
    files._remove_orphans.cache_clear()
    os.utime(left, (0, 0))
    ensure_writable("c")
    assert sorted(os.listdir()) == [".memscal-mine.tmp", "a", "b"]
