"""Segments that cannot be created, and creators that die: what
docs/explanation/model/attach.pml and place.pml say, in the code.
"""

from __future__ import annotations

import errno
import os
import resource
import signal
import stat
import subprocess
import sys
from pathlib import Path

import pytest
from hli._sync import lib

import hli
from hli import segment
from hli.errors import HliError, HliInUse
from support.fake_cnc import unique_name

SHM = Path("/dev/shm")
SMALL = (
    "import resource; resource.setrlimit(resource.RLIMIT_FSIZE, "
    "(100_000, 100_000)); import signal;"
)
SMALL += "signal.signal(signal.SIGXFSZ, signal.SIG_IGN); import hli, sys; hli.create(sys.argv[1])"
KILLED = """
import os, signal, sys
from hli import segment
def die(*_): os.kill(os.getpid(), signal.SIGKILL)
setattr(segment, sys.argv[2], die)
segment.create(sys.argv[1])
"""


def test_no_room_for_a_segment_is_an_error_and_leaves_nothing() -> None:
    """A full shared memory is named when the segment is created, not by a
    SIGBUS at a later store.
    """
    name = unique_name()
    done = subprocess.run(
        [sys.executable, "-P", "-c", SMALL, name],
        capture_output=True,
        text=True,
        check=False,
    )
    assert "HliError: segment" in done.stderr, done.stderr
    assert "File too large" in done.stderr
    assert not (SHM / name).exists()


@pytest.mark.parametrize("step", ["_reserve", "_write_head", "_take_name"])
def test_a_creator_that_dies_leaves_no_name(step: str) -> None:
    """The name comes with the head in one step, so that it can be had again
    whenever the creator died.
    """
    name, before = unique_name(), set(os.listdir(SHM))
    done = subprocess.run(
        [sys.executable, "-P", "-c", KILLED, name, step], check=False
    )
    assert done.returncode == -signal.SIGKILL
    assert not {n for n in set(os.listdir(SHM)) - before if n.startswith(name)}
    with hli.create(name) as created:
        assert created.root.segment_head.ready == 1


NO_UNNAMED = """
import errno, os, sys
from hli import segment
plain = os.open
def refuse(path, flags, *rest, **more):
    if flags & os.O_TMPFILE == os.O_TMPFILE:
        raise OSError(errno.EOPNOTSUPP, "Operation not supported")
    return plain(path, flags, *rest, **more)
os.open = refuse
"""


def drafts() -> set[str]:
    return {n for n in os.listdir(SHM) if n.startswith(".hli-new-")}


@pytest.mark.parametrize(
    "number", [errno.EOPNOTSUPP, errno.EISDIR, errno.ENOENT]
)
def test_without_unnamed_files_the_segment_comes_by_a_draft(
    monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    """Where O_TMPFILE is unknown the segment is written under a name of its own
    and linked; nothing else differs.
    """
    plain, name, before = os.open, unique_name(), drafts()

    def refuse(path: str | Path, flags: int, *rest: int) -> int:
        if flags & os.O_TMPFILE == os.O_TMPFILE:
            raise OSError(number, os.strerror(number))
        return plain(path, flags, *rest)

    monkeypatch.setattr(os, "open", refuse)
    with hli.create(name) as created:
        assert created.root.segment_head.ready == 1
        info = (SHM / name).stat()
        assert (info.st_nlink, stat.S_IMODE(info.st_mode)) == (1, 0o600)
        hli.attach(name).close()
        with pytest.raises(HliInUse, match=f"in use by process {os.getpid()}"):
            hli.create(name)
        assert drafts() == before
    assert not (SHM / name).exists()


@pytest.mark.parametrize("step", ["_reserve", "_write_head", "_take_name"])
def test_a_draft_of_a_dead_creator_is_swept(step: str) -> None:
    """A creator that dies over its draft leaves it; sweep() removes it, and
    those of the living stay.
    """
    name, before = unique_name(), drafts()
    head = (
        SHM / f".hli-new-{os.getpid()}-{lib.hs_process_start(os.getpid())}-77"
    )
    head.touch()
    try:
        done = subprocess.run(
            [sys.executable, "-P", "-c", NO_UNNAMED + KILLED, name, step],
            check=False,
        )
        assert done.returncode == -signal.SIGKILL
        assert not (SHM / name).exists()
        assert len(drafts() - before) == 2
        hli.sweep()
        assert drafts() - before == {head.name}
    finally:
        head.unlink()


def test_no_room_without_unnamed_files_leaves_nothing() -> None:
    """The draft of a segment that does not fit is removed."""
    name, before = unique_name(), drafts()
    call = [sys.executable, "-P", "-c", NO_UNNAMED + SMALL, name]
    done = subprocess.run(call, capture_output=True, text=True, check=False)
    assert "HliError: segment" in done.stderr, done.stderr
    assert "File too large" in done.stderr
    assert not (SHM / name).exists()
    assert drafts() == before


def test_a_foreign_file_keeps_its_name() -> None:
    """A file that is no segment is neither replaced nor removed."""
    path = SHM / unique_name()
    path.write_bytes(bytes(4096))
    try:
        with pytest.raises(HliError, match="is no segment"):
            hli.create(path.name)
        assert path.name not in hli.sweep()
        assert path.read_bytes() == bytes(4096)
    finally:
        path.unlink()


def test_segments_do_not_keep_descriptors_or_names() -> None:
    """A thousand segments, created and removed, leave descriptors and memory as they were."""
    name = unique_name()
    fds, rss = len(os.listdir("/proc/self/fd")), 0
    for k in range(1000):
        with segment.create(name):
            pass
        if k == 100:
            rss = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    assert len(os.listdir("/proc/self/fd")) == fds
    if (
        "libasan" not in Path("/proc/self/maps").read_text()
    ):  # it keeps what is freed for a while
        assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss < rss + 2000
    assert not (SHM / name).exists()
