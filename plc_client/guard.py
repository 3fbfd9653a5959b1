"""The task watchdog: a ``cyclic()`` that does not return is an error with a place, not a cell that hangs for ever.

A thread looks a few times a second whether the scan that runs has used up its time on the wall's clock and then raises
``TaskOverrun`` inside the user's code.  Code that cannot be interrupted that way (a long call into C) is given up on:
the ``last_resort`` is called from the thread.  Nothing happens per scan but two assignments.
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

    ``last_resort(text)``: what to do when the code does not react (the PLC process writes its report and exits).
    """

    def __init__(self, last_resort: Callable[[str], None] | None = None) -> None:
        self._last_resort = last_resort
        self._deadline = 0.0  # 0: nothing to watch
        self._raised = 0.0
        self._thread: threading.Thread | None = None
        self._stop = threading.Event()
        self._target = threading.get_ident()

    def begin(self, limit_s: float) -> None:
        """A call begins; ``limit_s`` 0: not watched."""
        watched = limit_s > 0.0 and sys.gettrace() is None  # somebody debugs: standing still is no fault
        self._deadline = time.monotonic() + limit_s if watched else 0.0
        if self._thread is None and watched:
            self._start()

    def end(self) -> None:
        """The call has returned."""
        self._deadline = 0.0

    def close(self) -> None:
        """End the thread."""
        self._deadline = 0.0
        self._stop.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None

    def _start(self) -> None:
        self._stop.clear()
        self._target = threading.get_ident()
        self._thread = threading.Thread(target=self._watch, name="task watchdog", daemon=True)
        self._thread.start()

    def _watch(self) -> None:
        while not self._stop.wait(POLL_S):
            deadline, now = self._deadline, time.monotonic()
            if not deadline or now < deadline:
                self._raised = 0.0
            elif not self._raised:
                self._raise(now)
            elif now - self._raised > LAST_RESORT_S:
                if self._last_resort is not None:
                    self._last_resort("a task hangs in a call that cannot be interrupted, or swallows its watchdog")
                self._raise(now)

    def _raise(self, now: float) -> None:
        self._raised = now
        ctypes.pythonapi.PyThreadState_SetAsyncExc(ctypes.c_ulong(self._target), ctypes.py_object(TaskOverrun))
