"""Segments that cannot be created, and creators that die: what
docs/explanation/model/attach.pml and place.pml say, in the code.
"""

from __future__ import annotations

import os
import resource
import signal
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any

import posix_ipc
import pytest
from hli._sync import ffi, lib

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
def die(*_):
    begin = f".hli-new-{os.getpid()}-"
    left = [n for n in os.listdir("/dev/shm") if n.startswith(begin)]
    print(*left, flush=True)
    os.kill(os.getpid(), signal.SIGKILL)
setattr(segment, sys.argv[2], die)
segment.create(sys.argv[1])
"""


def drafts(pid: int | None = None) -> set[str]:
    """Of this process, or of another; those of tests beside this one are not
    looked at.
    """
    begin = f".hli-new-{pid or os.getpid()}-"
    return {n for n in os.listdir(SHM) if n.startswith(begin)}


def test_many_segments_of_a_process_are_guarded() -> None:
    """Views keep a segment mapped: more than a few may be there at a time."""
    memory = [ffi.new("char[4096]") for _ in range(200)]
    assert all(lib.hs_guard(each, 4096) == 0 for each in memory)
    for each in memory:
        lib.hs_unguard(each)


@pytest.mark.ci
def test_no_room_for_a_segment_is_an_error_and_leaves_nothing() -> None:
    """A full shared memory is named when the segment is created, not by a
    SIGBUS at a later store.
    """
    name = unique_name()
    process = subprocess.Popen(
        [sys.executable, "-P", "-c", SMALL, name],
        stderr=subprocess.PIPE,
        text=True,
    )
    _, told = process.communicate()
    assert "HliError: segment" in told, told
    assert "too large" in told
    assert not (SHM / name).exists()
    assert not drafts(process.pid)


@pytest.mark.ci_cases
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


@pytest.mark.parametrize("umask", [0o000, 0o777])
def test_segments_are_laid_sized_and_removed_by_posix_ipc(
    monkeypatch: pytest.MonkeyPatch, umask: int
) -> None:
    """Created exclusively under a name of its own with mode 0600 and whole
    size, linked, and unlinked again; the umask changes nothing.
    """
    name, before = unique_name(), drafts()
    laid: list[tuple[int, int, int]] = []
    gone: list[str] = []
    lay, unlink = posix_ipc.SharedMemory, posix_ipc.unlink_shared_memory

    def noted(draft: str, flags: int, mode: int, size: int) -> Any:
        laid.append((flags, mode, size))
        return lay(draft, flags, mode=mode, size=size)

    monkeypatch.setattr(posix_ipc, "SharedMemory", noted)
    monkeypatch.setattr(
        posix_ipc,
        "unlink_shared_memory",
        lambda n: (gone.append(n), unlink(n)),
    )
    old = os.umask(umask)
    try:
        with hli.create(name) as created:
            assert created.root.segment_head.ready == 1
            info = (SHM / name).stat()
            assert (info.st_nlink, stat.S_IMODE(info.st_mode)) == (1, 0o600)
            hli.attach(name).close()
            with pytest.raises(HliInUse, match=f"process {os.getpid()}"):
                hli.create(name)
            assert drafts() == before
    finally:
        os.umask(old)
    assert laid == [(posix_ipc.O_CREX, 0o600, segment.SEGMENT_SIZE)] * 2
    assert "/" + name in gone
    assert not (SHM / name).exists()


@pytest.mark.ci_cases
@pytest.mark.parametrize("step", ["_reserve", "_write_head", "_take_name"])
def test_a_draft_of_a_dead_creator_is_swept(step: str) -> None:
    """A creator that dies over its draft leaves it; sweep() removes it, and
    those of the living stay.
    """
    name = unique_name()
    living = (
        SHM / f".hli-new-{os.getpid()}-{lib.hs_process_start(os.getpid())}-77"
    )
    living.touch()
    try:
        process = subprocess.Popen(
            [sys.executable, "-P", "-c", KILLED, name, step],
            stdout=subprocess.PIPE,
            text=True,
        )
        left, _ = process.communicate()
        assert process.returncode == -signal.SIGKILL
        assert not (SHM / name).exists()
        assert left.startswith(f".hli-new-{process.pid}-")
        hli.sweep()
        assert not drafts(process.pid)
        assert living.name in drafts()
    finally:
        living.unlink()


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


@pytest.mark.ci
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
