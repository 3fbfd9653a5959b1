"""Python's handle on the jerk-limited planner of ``c_ext/jerk_*.c``: for tests,
benchmarks and pictures.

The engine calls the C functions itself; nothing here is on its way.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from .. import _engine
from ..errors import CncError
from ..units import AnyArray, FloatArray

_module: Any = _engine
ffi, lib = _module.ffi, _module.lib
AXES = int(lib.JERK_AXES)
STAND, RAPID = int(lib.JERK_STAND), int(lib.JERK_RAPID)

INTERVAL = np.dtype(
    [
        ("length", "f8"),
        ("d1", "f8", (2, AXES)),
        ("d2", "f8", (2, AXES)),
        ("d3", "f8", (2, AXES)),
        ("feed", "f8"),
        ("v_hard", "f8"),
        ("offset", "f8"),
        ("tag", "u8"),
        ("acc_share", "f4", AXES),
        ("jerk_share", "f4", AXES),
        ("path_acc", "f4"),
        ("path_jerk", "f4"),
        ("miss", "f4", AXES),
        ("blocks", "u4"),
        ("flags", "u4"),
    ],
    align=True,
)
LAW = np.dtype(
    [
        ("tag", "u8"),
        ("s0", "f8"),
        ("v0", "f8"),
        ("a0", "f8"),
        ("jerk", "f8"),
        ("snap", "f8"),
        ("crackle", "f8"),
        ("pop", "f8"),
        ("time", "f8"),
        ("length", "f8"),
        ("flags", "u4"),
        ("last", "u4"),
    ]
)
if (
    ffi.sizeof("jerk_interval") != INTERVAL.itemsize
    or ffi.sizeof("jerk_law") != LAW.itemsize
):
    raise ImportError("jerk_interval or jerk_law differ from their numpy types")


@dataclass(frozen=True)
class Limits:
    """Limits per axis: mm/s, mm/s2, mm/s3."""

    v: Sequence[float]
    a: Sequence[float]
    j: Sequence[float]


def intervals_from_knots(
    s: FloatArray,
    d1: FloatArray,
    d2: FloatArray,
    d3: FloatArray,
    feed: float | FloatArray,
) -> AnyArray:
    """Intervals of a path that is smooth over its knots: s (n+1,) mm,
    derivatives (n+1, axes), feed mm/s.
    """
    n, axes = len(s) - 1, d1.shape[1]
    out = np.zeros(n, INTERVAL)
    out["length"], out["offset"], out["tag"], out["blocks"] = (
        np.diff(s),
        s[:-1],
        np.arange(n),
        1,
    )
    out["feed"] = feed
    for name, d in (("d1", d1), ("d2", d2), ("d3", d3)):
        ends = out[name]
        ends[:, 0, :axes] = d[:-1]
        ends[:, 1, :axes] = d[1:]
    return out


def _config(limits: Limits, window: int, knots: int, cycle_s: float) -> Any:
    config = ffi.new("jerk_config *")
    config.axes, config.cycle_s = len(limits.v), cycle_s
    for i, (v, a, j) in enumerate(
        zip(limits.v, limits.a, limits.j, strict=True)
    ):
        config.v_max[i] = v
        config.a_max[i] = a
        config.j_max[i] = j
    config.window_blocks, config.window_knots = window, knots
    return config


class JerkPlanner:
    """One planner; ``window`` is its look-ahead in blocks, ``knots`` in
    intervals of its own grid.
    """

    def __init__(
        self,
        limits: Limits,
        *,
        window: int = 120,
        knots: int | None = None,
        cycle_s: float = 0.001,
        spacing_mm: float = 0.0,
        refresh: float = 0.0,
        capacity: int = 4096,
    ) -> None:
        config = _config(limits, window, knots or 2 * window, cycle_s)
        config.spacing_mm, config.refresh = spacing_mm, refresh
        handle = lib.jerk_new(config, capacity)
        if handle == ffi.NULL:
            raise CncError(
                0,
                "jerk planner: limits must be positive and finite, the window at least 8 knots",
            )
        self._handle = ffi.gc(handle, lib.jerk_free)
        self._laws = np.zeros(8192, LAW)

    def push(self, intervals: AnyArray) -> int:
        """Append as many intervals as there is room for; returns their number."""
        if not len(intervals):
            return 0
        rows = _rows_of(INTERVAL, intervals)
        taken = int(
            lib.jerk_push(
                self._handle,
                ffi.from_buffer("jerk_interval[]", rows),
                len(rows),
            )
        )
        if taken < 0:
            raise ValueError(f"interval refused: {taken}")
        return taken

    def finish(self, finished: bool = True) -> None:
        """Say that the path ends with what was pushed."""
        lib.jerk_finish(self._handle, finished)

    def override(self, feed: float, rapid: float = 1.0) -> None:
        """Factors on the feed of feed and rapid intervals, from the next law on."""
        lib.jerk_override(self._handle, feed, rapid)

    def read_plan(self, read: bool = True) -> None:
        """Whether somebody reads the plan (``jerk_read_plan``)."""
        lib.jerk_read_plan(self._handle, read)

    def hold(self, hold: bool) -> None:
        """Feed hold: stop in the shortest legal distance, stand until released."""
        lib.jerk_hold(self._handle, hold)

    def take(self, seconds: float = float("inf"), most: int = 8192) -> AnyArray:
        """The next laws, at least ``seconds`` of them if there are that many."""
        most = min(most, len(self._laws))
        n = int(
            lib.jerk_take(
                self._handle,
                ffi.from_buffer("jerk_law[]", self._laws),
                most,
                min(seconds, 1e300),
            )
        )
        return self._laws[:n].copy()

    def tail(self) -> AnyArray:
        """The stored stopping tail behind what was taken."""
        n = int(
            lib.jerk_tail(
                self._handle,
                ffi.from_buffer("jerk_law[]", self._laws),
                len(self._laws),
            )
        )
        return self._laws[:n].copy()

    def take_back(self, seconds: float) -> float:
        """The last ``seconds`` that were taken, or a little less, are the
        plan's again; 0: not so much is kept.
        """
        return float(lib.jerk_take_back(self._handle, seconds))

    def keep(self) -> None:
        """From here on the present plan is kept where another takes its place."""
        lib.jerk_keep(self._handle)

    def go_back(self, seconds: float) -> float:
        """The ``seconds`` that were taken since ``keep`` are taken back, and the
        plan of then follows; below 0: it cannot be done.
        """
        return float(lib.jerk_go_back(self._handle, seconds))

    def tail_driven(self) -> None:
        """Go on from the end of the tail, at rest."""
        lib.jerk_tail_driven(self._handle)

    @property
    def ready(self) -> bool:
        """Whether the whole look-ahead is known."""
        return bool(lib.jerk_ready(self._handle))

    @property
    def room(self) -> int:
        """Intervals that can be pushed."""
        return int(lib.jerk_room(self._handle))

    @property
    def stats(self) -> dict[str, float]:
        """Counters of solves, refusals and holds."""
        out = ffi.new("jerk_stats *")
        lib.jerk_get_stats(self._handle, out)
        return {
            name: getattr(out, name)
            for name, _ in ffi.typeof("jerk_stats").fields
        }


def _rows_of(dtype: np.dtype[Any], rows: AnyArray) -> AnyArray:
    if rows.dtype != dtype:
        raise TypeError(f"rows of {rows.dtype}: {dtype} is needed")
    return np.ascontiguousarray(rows)


def run(planner: JerkPlanner, intervals: AnyArray) -> AnyArray:
    """Push and take a whole path: all laws."""
    laws: list[AnyArray] = []
    done, chunk = 0, 0.02
    while True:
        if done < len(intervals):
            done += planner.push(intervals[done : done + planner.room])
            if done == len(intervals):
                planner.finish()
        got = planner.take(chunk if done < len(intervals) else float("inf"))
        if not len(got):
            return np.concatenate(laws) if laws else np.zeros(0, LAW)
        laws.append(got)


def sample(laws: AnyArray, dt: float) -> FloatArray:
    """(s, v, a) every dt over the laws, (n, 3); s is the law's own offset."""
    total = float(laws["time"].sum())
    out = np.zeros((int(total / dt) + 3, 3))
    phase = ffi.new("double *", 0.0)
    rows = _rows_of(LAW, laws)
    n = lib.jerk_sample(
        ffi.from_buffer("jerk_law[]", rows),
        len(rows),
        dt,
        phase,
        ffi.from_buffer("jerk_state[]", out),
        len(out),
    )
    return out[:n]


class Topp2:
    """The acceleration-limited sibling: same intervals in, same laws out."""

    def __init__(
        self,
        limits: Limits,
        *,
        window: int = 120,
        knots: int | None = None,
        capacity: int = 4096,
    ) -> None:
        config = _config(limits, window, knots or window, 0.001)
        handle = lib.topp2_new(config, capacity)
        if handle == ffi.NULL:
            raise CncError(
                0,
                "acceleration-limited planner: limits must be positive and finite",
            )
        self._handle = ffi.gc(handle, lib.topp2_free)
        self._laws = np.zeros(8192, LAW)

    def push(self, intervals: AnyArray) -> int:
        """Append as many intervals as there is room for; returns their number."""
        if not len(intervals):
            return 0
        rows = _rows_of(INTERVAL, intervals)
        taken = int(
            lib.topp2_push(
                self._handle,
                ffi.from_buffer("jerk_interval[]", rows),
                len(rows),
            )
        )
        if taken < 0:
            raise ValueError(f"interval refused: {taken}")
        return taken

    def override(self, feed: float, rapid: float = 1.0) -> None:
        """Factors on the feed of feed and rapid intervals."""
        lib.topp2_override(self._handle, feed, rapid)

    def hold(self, hold: bool) -> None:
        """Brake with all that is allowed, stand until released."""
        lib.topp2_hold(self._handle, hold)

    def take(self, seconds: float = float("inf"), most: int = 8192) -> AnyArray:
        """The next laws, at least ``seconds`` of them if there are that many."""
        most = min(most, len(self._laws))
        n = int(
            lib.topp2_take(
                self._handle,
                ffi.from_buffer("jerk_law[]", self._laws),
                most,
                min(seconds, 1e300),
            )
        )
        return self._laws[:n].copy()

    @property
    def room(self) -> int:
        """Intervals that can be pushed, at one part each."""
        return int(lib.topp2_room(self._handle))

    @property
    def steps(self) -> int:
        """Backward and forward steps done so far."""
        return int(lib.topp2_steps(self._handle))
