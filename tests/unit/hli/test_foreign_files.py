"""What others lay in /dev/shm: nothing waits for it, nothing of it is used."""

from __future__ import annotations

import os
import socket
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

import hli
from hli import segment
from hli.errors import HliTimeout
from hli.segment import SHM_DIR
from support.fake_cnc import unique_name

pytestmark = pytest.mark.sanitize("hli")

NOBODY = 65534
HOLD = """
import fcntl, os, sys
fd = os.open(sys.argv[1], os.O_RDONLY)
fcntl.flock(fd, fcntl.LOCK_EX)
print("locked", flush=True)
sys.stdin.read()
"""


@pytest.fixture
def place() -> Iterator[Path]:
    """A unique name in /dev/shm, removed after the test."""
    path = SHM_DIR / unique_name()
    yield path
    path.unlink(missing_ok=True)


@pytest.fixture
def locker() -> Iterator[Callable[[Path], None]]:
    """Another process locks a file until the test ends."""
    processes = []

    def lock(path: Path) -> None:
        process = subprocess.Popen(
            [sys.executable, "-c", HOLD, str(path)],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
        )
        assert process.stdout is not None
        assert process.stdout.readline() == b"locked\n"
        processes.append(process)

    yield lock
    for process in processes:
        process.communicate()


def a_fifo(path: Path) -> None:
    os.mkfifo(path, 0o600)


def a_link(path: Path) -> None:
    path.symlink_to("/etc/passwd")


def a_folder(path: Path) -> None:
    path.mkdir()


def a_socket(path: Path) -> None:
    with socket.socket(socket.AF_UNIX) as listening:
        listening.bind(str(path))


@pytest.mark.parametrize("lay", [a_fifo, a_link, a_folder, a_socket])
def test_what_is_no_file_is_refused_and_blocks_nobody(
    place: Path, lay: Callable[[Path], None]
) -> None:
    """``run``, ``cnc``, ``plc`` and every sweep go on or say why."""
    lay(place)
    try:
        with pytest.raises(hli.HliAccessError, match="regular"):
            hli.attach(place.name)
        with pytest.raises(hli.HliInUse, match="is no segment"):
            hli.create(place.name)
        assert place.name not in segment.sweep()
        assert os.path.lexists(place)
    finally:
        if lay is a_folder:
            place.rmdir()


def test_a_locked_file_of_another_content_blocks_nobody(
    place: Path, locker: Callable[[Path], None]
) -> None:
    """The magic is read before anybody waits for the lock."""
    place.write_bytes(bytes(8192))
    place.chmod(0o600)
    locker(place)
    assert place.name not in segment.sweep()
    with pytest.raises(hli.HliInUse):
        hli.create(place.name)


@pytest.mark.skipif(os.getuid() != 0, reason="only root can give files away")
@pytest.mark.parametrize("mode", [0o600, 0o666])
def test_another_users_segment_is_not_waited_for(
    place: Path, locker: Callable[[Path], None], mode: int
) -> None:
    """A whole segment with a dead owner, his, and locked by him."""
    with hli.create(place.name) as made:
        made.root.segment_head.owner_start += 1
        os.chown(place, NOBODY, NOBODY)
        place.chmod(mode)
        locker(place)
        assert place.name not in segment.sweep()
        with pytest.raises(hli.HliInUse):
            hli.create(place.name)
        with pytest.raises(hli.HliAccessError, match=f"user {NOBODY}"):
            hli.attach(place.name)
        with (
            pytest.raises(hli.HliAccessError, match=f"user {NOBODY}"),
            made.locked(),
        ):
            pass


def test_a_lock_is_waited_for_no_longer_than_said(
    place: Path, locker: Callable[[Path], None]
) -> None:
    """HliTimeout: a process of this user holds it, and may be stopped."""
    with hli.create(place.name) as made:
        locker(place)
        with pytest.raises(HliTimeout), made.locked(0.0):
            pass


def test_a_replaced_segment_is_not_locked(place: Path) -> None:
    """HliNotFound: the name leads to another file now."""
    with hli.create(place.name) as made:
        place.unlink()
        with (
            hli.create(place.name),
            pytest.raises(hli.HliNotFound),
            made.locked(),
        ):
            pass
