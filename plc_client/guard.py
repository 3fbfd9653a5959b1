"""The task watchdog: a ``cyclic()`` that does not return is an error with a
place, not a cell that hangs for ever.

A thread looks a few times a second whether the scan that runs has used up its
time on the wall's clock and then raises ``TaskOverrun`` inside the user's code.
Code that cannot be interrupted that way (a long call into C) is given up on:
the ``last_resort`` is called from the thread.  Nothing happens per scan but two
assignments.
"""

from __future__ import annotations

import ctypes
import sys
import threading
import time
from collections.abc import Callable

POLL_S = 0.1
LAST_RESORT_S = 2.0


class TaskOverrun(BaseException):
    """Raised inside a task by its watchdog."""


class Guard:
    """Watches the calls of one thread between ``begin(limit_s)`` and ``end()``.

    Time is counted by the watching thread itself, so a process that was
    suspended is not blamed for it. ``last_resort(text)``: what to do when the
    code does not react (the PLC process writes its report and exits).
    """

    def __init__(
        self, last_resort: Callable[[str], None] | None = None
    ) -> None:
        self._last_resort = last_resort
        self._limit_s = 0.0  # 0: nothing to watch
        self._call = 0  # which call: a new one has all its time again
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()
        self._target = threading.get_ident()

    def begin(self, limit_s: float) -> None:
        """A call begins; ``limit_s`` 0: not watched."""
        self._call += 1
        # somebody debugs: standing still is no fault
        watched = limit_s > 0.0 and sys.gettrace() is None
        self._limit_s = limit_s if watched else 0.0
        if self._thread is None and watched:
            self._start()

    def end(self) -> None:
        """The call has returned."""
        self._limit_s = 0.0

    def close(self) -> None:
        """End the thread."""
        self._limit_s = 0.0
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _start(self) -> None:
        self._stop.clear()
        self._target = threading.get_ident()
        self._thread = threading.Thread(
            target=self._watch, name="task watchdog", daemon=True
        )
        self._thread.start()

    def _watch(self) -> None:
        call, used_s, raised_s, before = -1, 0.0, 0.0, time.monotonic()
        while not self._stop.wait(POLL_S):
            now = time.monotonic()
            step_s, before = min(now - before, 2.0 * POLL_S), now
            if self._call != call or not self._limit_s:
                call, used_s, raised_s = self._call, 0.0, 0.0
                continue
            used_s += step_s
            if used_s < self._limit_s:
                continue
            if raised_s > LAST_RESORT_S and self._last_resort is not None:
                self._last_resort(
                    "a task hangs in a call that cannot be interrupted, or swallows its watchdog"
                )
            if raised_s == 0.0 or raised_s > LAST_RESORT_S:
                raised_s = 0.0
                self._raise()
            raised_s += step_s

    def _raise(self) -> None:
        ctypes.pythonapi.PyThreadState_SetAsyncExc(
            ctypes.c_ulong(self._target), ctypes.py_object(TaskOverrun)
        )
