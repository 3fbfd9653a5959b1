"""The cell's clock as PLC function blocks see it: virtual or real time of the
CNC process, in ns.

The scan runtime latches it once per scan, so all timers of one scan agree.
Outside the runtime it is read live from the connection made last.
"""

from __future__ import annotations

from collections.abc import Callable


def _no_connection() -> int:
    return 0


_source: Callable[[], int] = _no_connection


def now_ns() -> int:
    """Cell time in ns since the CNC started (0 without a connection)."""
    return _source()


def set_source(source: Callable[[], int]) -> None:
    """Let ``now_ns`` read from `source` (connection, scan runtime, test)."""
    global _source  # noqa: PLW0603 (one process is one PLC)
    _source = source
