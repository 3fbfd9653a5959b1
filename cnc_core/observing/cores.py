"""An observer leaves the processors alone on which a pinned CNC runs."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterable


def keep_off(pids: Iterable[int], allowed: set[int]) -> set[int]:
    """Leave the processors of these processes to them, as far as others are left.

    ``pids``: the CNCs that are watched.  One that may run on all of ``allowed``
    takes none.  ``allowed``: the processors that this process had at first.
    Returns the processors that it runs on now.
    """
    rest = set(allowed)
    for pid in pids:
        with contextlib.suppress(OSError):  # it has just ended
            rest -= _pinned(pid, allowed)
    rest = rest or set(allowed)
    if rest != os.sched_getaffinity(0):
        for thread in os.listdir("/proc/self/task"):
            with contextlib.suppress(OSError):  # it has just ended
                os.sched_setaffinity(int(thread), rest)
    return rest


def _pinned(pid: int, allowed: set[int]) -> set[int]:
    theirs = os.sched_getaffinity(pid)
    return theirs if theirs < allowed else set()
