"""A file is written whole or not at all, never over an input, and never by surprise."""

import errno
import os
import signal
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from memscal.errors import OutputError
from memscal.formats.files import atomic_write_bytes, ensure_writable

OLD = b"the old output"


@pytest.fixture
def target(tmp_path: Path) -> Path:
    path = tmp_path / "out.h5"
    path.write_bytes(OLD)
    return path


def fail_with(code: int) -> Any:
    def fail(*arguments: Any, **options: Any) -> Any:
        raise OSError(code, os.strerror(code))

    return fail


def assert_refused(path: Path | str, words: str) -> None:
    with pytest.raises(OutputError, match=words):
        ensure_writable(path, overwrite=True)
    with pytest.raises(OutputError, match=words):
        atomic_write_bytes(path, b"new", overwrite=True)


def assert_untouched(target: Path) -> None:
    assert target.read_bytes() == OLD
    assert os.listdir(target.parent) == [target.name]


@pytest.mark.parametrize("hard_links", [True, False])
def test_a_new_file_holds_the_bytes_and_nothing_else_is_left(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, hard_links
):
    if not hard_links:
        monkeypatch.setattr(os, "link", fail_with(errno.EPERM))
    atomic_write_bytes(tmp_path / "new.bin", b"abc")
    assert (tmp_path / "new.bin").read_bytes() == b"abc"
    assert os.listdir(tmp_path) == ["new.bin"]


@pytest.mark.parametrize("call", ["write", "fsync", "open", "replace"])
@pytest.mark.parametrize(("code", "cure"), [
    (errno.ENOSPC, "Free some space"), (errno.EROFS, "read-only"), (errno.EACCES, "may write"),
    (errno.EDQUOT, "quota"), (errno.EIO, "another folder"),
], ids=["full disk", "read-only disk", "forbidden", "quota", "broken disk"])  # fmt: skip
def test_a_disk_that_refuses_leaves_the_old_output_and_says_what_to_do(
    target: Path, monkeypatch: pytest.MonkeyPatch, call, code, cure
):
    with monkeypatch.context() as patch:
        patch.setattr(os, call, fail_with(code))
        with pytest.raises(OutputError, match=cure) as caught:
            atomic_write_bytes(target, b"new", overwrite=True)
    assert caught.value.exit_code == 4
    assert str(target) in caught.value.problem
    assert_untouched(target)


def test_short_writes_are_continued(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    write = os.write
    data = bytes(range(256)) * 10
    with monkeypatch.context() as patch:
        patch.setattr(os, "write", lambda descriptor, part: write(descriptor, bytes(part)[:100]))
        atomic_write_bytes(tmp_path / "a", data)
    assert (tmp_path / "a").read_bytes() == data


def test_an_interrupt_leaves_no_temporary_file(target: Path, monkeypatch: pytest.MonkeyPatch):
    def interrupt(*arguments: Any) -> None:
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", interrupt)
        with pytest.raises(KeyboardInterrupt):
            atomic_write_bytes(target, b"new", overwrite=True)
    assert_untouched(target)


def test_a_process_killed_before_the_last_step_leaves_the_old_output(target: Path):
    script = (
        "import os, signal, sys\n"
        "from memscal.formats.files import atomic_write_bytes\n"
        "os.replace = lambda *names: os.kill(os.getpid(), signal.SIGKILL)\n"
        "atomic_write_bytes(sys.argv[1], b'new' * 1000, overwrite=True)\n"
    )
    done = subprocess.run([sys.executable, "-c", script, str(target)], check=False)
    assert done.returncode == -signal.SIGKILL
    assert target.read_bytes() == OLD


def test_a_file_that_appears_late_is_not_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    target = tmp_path / "out.h5"
    fsync = os.fsync

    def appear(descriptor: int) -> None:
        fsync(descriptor)
        target.write_bytes(OLD)

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", appear)
        with pytest.raises(OutputError, match="File exists"):
            atomic_write_bytes(target, b"new")
    assert_untouched(target)


def test_the_permissions_are_those_of_the_umask(tmp_path: Path):
    before = os.umask(0o027)
    try:
        atomic_write_bytes(tmp_path / "a", b"")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a").stat().st_mode) == 0o640


def test_a_symbolic_link_is_followed_and_stays(target: Path):
    link = target.parent / "link.h5"
    link.symlink_to(target)
    atomic_write_bytes(link, b"new", overwrite=True)
    assert link.is_symlink()
    assert target.read_bytes() == b"new"


def test_a_folder_a_pipe_and_a_device_are_refused_as_outputs(tmp_path: Path):
    os.mkfifo(tmp_path / "pipe")
    assert_refused(tmp_path, "is a folder")
    for path in (tmp_path / "pipe", os.devnull):
        assert_refused(path, "not a regular file")


@pytest.mark.parametrize(("name", "words"), [
    ("missing/out.h5", "Create the folder"), ("file/out.h5", "a file, not a folder"),
    ("a" * 300, "shorter name"), ("", "not the name"),
])  # fmt: skip
def test_a_path_that_cannot_exist_is_refused_with_its_cure(tmp_path: Path, name, words):
    (tmp_path / "file").write_bytes(b"")
    assert_refused(str(tmp_path / name) if name else "", words)


def test_a_folder_in_which_nothing_can_be_made_is_refused_before_the_work():
    with pytest.raises(OutputError) as caught:  # not even root can make a file there
        ensure_writable("/proc/self/out.h5")
    assert caught.value.exit_code == 4


@pytest.mark.parametrize(("call", "code", "cure"), [
    ("write", errno.ENOSPC, "Free some space"), ("fsync", errno.ENOSPC, "Free some space"),
    ("open", errno.EROFS, "read-only"),
])  # fmt: skip
def test_a_disk_that_refuses_is_found_before_the_work(target: Path, monkeypatch, call, code, cure):
    with monkeypatch.context() as patch:
        patch.setattr(os, call, fail_with(code))
        with pytest.raises(OutputError, match=cure):
            ensure_writable(target, overwrite=True)
    assert_untouched(target)


def test_a_proof_that_succeeds_leaves_no_trace(target: Path):
    ensure_writable(target, overwrite=True)
    ensure_writable(target.parent / "new.h5")
    assert_untouched(target)
