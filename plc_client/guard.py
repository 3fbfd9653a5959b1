"""The task watchdog: a ``cyclic()`` that does not return is an error with a
place, not a cell that hangs for ever.

A thread looks a few times a second whether the scan that runs has used up its
time on the wall's clock and then raises ``TaskOverrun`` inside the user's code.
Code that cannot be interrupted that way (a long call into C) is given up on:
the ``last_resort`` is called from the thread.  Nothing happens per scan but two
assignments.  A call that lasts is told ahead of that, with the line it is at.
"""

from __future__ import annotations

import ctypes
import linecache
import sys
import threading
import time
from collections.abc import Callable
from pathlib import Path

from .task import is_users

POLL_S = 0.1
LAST_RESORT_S = 2.0
TELL_S, GAP_S, LAST_GAP_S = 3.0, 4.0, 60.0
"""A call that lasts so long is told, and again after gaps that grow."""
CALLER = str(Path(__file__).with_name("program.py"))
"""What calls the methods of a task."""


class TaskOverrun(BaseException):
    """Raised inside a task by its watchdog."""


class Guard:
    """Watches the calls of one thread between ``begin(limit_s)`` and ``end()``.

    Time is counted by the watching thread itself, so a process that was
    suspended is not blamed for it. ``last_resort(text)``: what to do when the
    code does not react (the PLC process writes its report and exits).
    ``tell(text)``: a call has lasted for ``TELL_S``, and where it is.
    """

    def __init__(
        self,
        last_resort: Callable[[str], None] | None = None,
        tell: Callable[[str], None] | None = None,
    ) -> None:
        self._last_resort, self._tell = last_resort, tell
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
        tell_at = TELL_S
        while not self._stop.wait(POLL_S):
            now = time.monotonic()
            step_s, before = min(now - before, 2.0 * POLL_S), now
            if self._call != call or not self._limit_s:
                call, used_s, raised_s = self._call, 0.0, 0.0
                tell_at = TELL_S
                continue
            used_s += step_s
            if used_s >= tell_at and self._tell is not None:
                tell_at = used_s + min(max(GAP_S, 0.5 * used_s), LAST_GAP_S)
                self._tell(self._place(used_s))
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

    def _place(self, used_s: float) -> str:
        """Where the watched call is: the innermost line of the user, and the
        method that the runtime called.
        """
        frame = sys._current_frames().get(self._target)
        called = inner = None
        while frame is not None and frame.f_code.co_filename != CALLER:
            if inner is None and is_users(frame.f_code.co_filename):
                inner = frame
            called, frame = frame, frame.f_back
        lasts = f"has not returned for {used_s:.1f} s; a task must not wait"
        if called is None:
            return f"a task {lasts}"
        method = f"{called.f_code.co_name}()"
        owner = called.f_locals.get("self")
        if owner is not None:
            method += f" of {type(owner).__name__}"
        if inner is None:  # Structured Text
            return f"{method} {lasts}"
        file, line = inner.f_code.co_filename, inner.f_lineno
        text = linecache.getline(file, line).strip()
        return f"{Path(file).name}:{line}: {method} {lasts}; it is at: {text}"

    def _raise(self) -> None:
        ctypes.pythonapi.PyThreadState_SetAsyncExc(
            ctypes.c_ulong(self._target), ctypes.py_object(TaskOverrun)
        )
