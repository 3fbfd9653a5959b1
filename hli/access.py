"""Opening and locking a file in /dev/shm that somebody else may have laid.

The directory belongs to all users.  So kind, owner and mode of a file are
looked at before anything waits for it or a byte of it is used.  No call
here blocks for longer than its caller allows.
"""

from __future__ import annotations

import fcntl
import os
import stat
import time
from pathlib import Path

from .errors import HliAccessError, HliNotFound

SHM_DIR = Path("/dev/shm")
MODE = 0o600
LOCK_PAUSE_S = 0.002
_CAUTIOUS = os.O_CLOEXEC | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_NOCTTY


def open_file(name: str, flags: int) -> int:
    """A descriptor of a file of this user alone.

    HliNotFound; HliAccessError: a link, no regular file, another user's, or
    open to other users.
    """
    try:
        fd = os.open(SHM_DIR / name, flags | _CAUTIOUS)
    except FileNotFoundError:
        raise HliNotFound(
            f"segment {name!r} does not exist; is the CNC running?"
        ) from None
    except PermissionError:
        raise HliAccessError(
            f"segment {name!r} may not be opened by this user"
        ) from None
    except OSError as error:  # a link; a socket; a FIFO without a reader
        raise HliAccessError(
            f"segment {name!r} is no regular file: {error.strerror}"
        ) from None
    problem = problem_of(os.fstat(fd))
    if problem:
        os.close(fd)
        raise HliAccessError(f"segment {name!r} {problem}")
    return fd


def problem_of(info: os.stat_result) -> str:
    """Why a file is not this user's alone; empty if it is."""
    if not stat.S_ISREG(info.st_mode):
        return "is no regular file"
    if info.st_uid != os.getuid():
        return (
            f"belongs to user {info.st_uid}, this process runs as {os.getuid()}"
        )
    mode = stat.S_IMODE(info.st_mode)
    if mode != MODE:
        return f"has mode {mode:04o}, expected {MODE:04o}"
    return ""


def lock(fd: int, wait_s: float) -> bool:
    """Lock the file; False: somebody else has held it for ``wait_s``."""
    end = time.monotonic() + wait_s
    while True:
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            if time.monotonic() >= end:
                return False
            time.sleep(LOCK_PAUSE_S)
        else:
            return True
