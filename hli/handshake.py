"""Handshakes over views: thin Python around the C functions of ``hli._sync``,
which do all ordering and waiting.

``ContourUnit`` binds one contour look-ahead control unit to the waiter words of
its segment, with all pointers cast once, so that one exchange is one C call.
"""

from __future__ import annotations

import ctypes
import time
from typing import Any

import numpy as np

from . import layout
from ._sync import ffi, lib
from .errors import HliTimeout
from .structures import HLI_CONTOUR_LOOKAHEAD
from .view import BLOCK_DTYPE, View, expect, root_of, spelling, view_class

_ROW_BYTES = BLOCK_DTYPE.itemsize
BLOCK_ROWS = layout.HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1
_POOL_ROWS = 2 * BLOCK_ROWS
"""Answers that one piece of memory serves; who keeps one of them keeps it."""
_SNAPSHOT_TRIES = 1000
_YIELD_S = (
    50e-6  # a writer that lost its core in the middle of a write gets one
)
_SLICE_NS = 100_000_000  # Python looks for signals this often

OK: int = lib.HS_OK
TIMEOUT: int = lib.HS_TIMEOUT
BUSY: int = lib.HS_BUSY
REFUSED: int = lib.HS_REFUSED


def word_pointer(root: View, name: str) -> Any:
    """cffi pointer to a side word (``cnc_turn``, ``clah_bell`` ...) of a
    segment view.  TypeError: no segment view; ValueError: no side word.
    """
    expect(root, "word_pointer", "hli.root", layout.HLI_SEGMENT)
    words = dict(layout.HLI_SIDECAR._fields_)  # type: ignore[arg-type]
    if words.get(name) is not layout.HLI_SIDE_WORD:
        raise ValueError(f"{name!r} is no side word")
    sidecar: View = getattr(root, "sidecar")  # noqa: B009
    return sidecar._pointer(getattr(layout.HLI_SIDECAR, name).offset)


def snapshot(view: View, timeout_s: float = 1.0) -> Any:
    """A consistent private copy of ``bahn_state`` or
    ``contour_lookahead.state`` of a channel, as a view.

    These two are what the CNC writes under the seqlock; ValueError for any
    other view. Raises HliTimeout if no copy stayed undisturbed for
    ``timeout_s`` (the writer died while it wrote), TypeError for what is no
    view of the memory.
    """
    expect(
        view,
        "snapshot",
        "hli.gpCh[0].bahn_state or hli.gpCh[0].contour_lookahead.state",
        *layout.structures(),
    )
    root: Any = root_of(view)
    if not any(
        view in (channel.bahn_state, channel.contour_lookahead.state)
        for channel in root.channel
    ):
        raise ValueError(
            f"{spelling(view)}: only bahn_state and contour_lookahead.state of"
            " a channel have a seqlock"
        )
    structure: Any = type(view._c)
    copy = structure()
    target = ffi.cast("void *", ctypes.addressof(copy))
    source, seq, size = (
        view._pointer(),
        word_pointer(root, "channel_seq"),
        ctypes.sizeof(copy),
    )
    end = time.monotonic() + timeout_s
    while lib.hs_snapshot(seq, source, target, size, _SNAPSHOT_TRIES) != OK:
        if time.monotonic() > end:
            raise HliTimeout(
                f"{structure.__name__}: no undisturbed copy within {timeout_s} s"
            )
        time.sleep(_YIELD_S)
    return view_class(structure)(copy)


def _facts_of(root: Any, unit: View) -> Any:
    """Where the extension tells about answers of the unit; the unit of a channel
    without extension has none that ever says something.
    """
    for channel, area in zip(root.channel, root.ahead, strict=False):
        if channel.contour_lookahead._address == unit._address:
            return area._c.answer
    return layout.HLI_AHEAD_ANSWER()


_next = lib.hs_clah_next


class ContourUnit:
    """One contour look-ahead unit and its bells: request, take, exchange (PLC);
    wait_request, answer (CNC).
    """

    def __init__(self, unit: HLI_CONTOUR_LOOKAHEAD) -> None:
        expect(
            unit,
            "ContourUnit",
            "hli.gpCh[0].contour_lookahead",
            layout.HLI_CONTOUR_LOOKAHEAD,
        )
        root = root_of(unit)
        self.view = unit
        self.address = unit._address
        self._unit = unit._pointer()
        self._bell = word_pointer(root, "clah_bell")
        self._answer = word_pointer(root, "clah_answer")
        self.rows: np.ndarray[Any, Any] = np.zeros(BLOCK_ROWS, BLOCK_DTYPE)
        self._rows = ffi.cast("void *", self.rows.ctypes.data)
        self._bytes = memoryview(self.rows.view(np.uint8).data)
        self._request = ffi.new("double[2]")
        self._port = ffi.new("hs_clah_port *")
        self._port.unit, self._port.bell = self._unit, self._bell
        self._ahead = _facts_of(root, unit)
        self._answered = layout.HLI_AHEAD_ANSWER()
        self._port.facts_from = ffi.cast(
            "void *", ctypes.addressof(self._ahead)
        )
        self._port.facts = ffi.cast("void *", ctypes.addressof(self._answered))
        self.taken: np.ndarray[Any, Any] = np.zeros(0, BLOCK_DTYPE)
        self._new_pool()

    def _new_pool(self) -> None:
        """Room for the answers that ``next`` takes; each keeps its own rows."""
        self._pool = np.zeros(_POOL_ROWS, BLOCK_DTYPE)
        self._used = 0
        self._port.blocks = ffi.cast("void *", self._pool.ctypes.data)

    # -- PLC side
    def request(self, start_position: float, length: float) -> bool:
        """Place a request; False while an earlier one is pending."""
        return bool(
            lib.hs_clah_request(self._unit, self._bell, start_position, length)
        )

    def take(self) -> int:
        """Copy the answer into ``rows``: number of elements, or -1 while the
        request is pending.
        """
        n: int = lib.hs_clah_take(self._unit, self._rows)
        if n in (0, BLOCK_ROWS):
            ctypes.memmove(
                ctypes.addressof(self._answered),
                ctypes.addressof(self._ahead),
                ctypes.sizeof(self._answered),
            )
        return n if n >= 0 else -1

    def rest(self, n: int) -> tuple[bool, int]:
        """(more, empty) of the answer of `n` elements that was taken last:
        whether there are more, why there are none (HLI_AHEAD_EMPTY_*).
        """
        if 0 < n < BLOCK_ROWS:
            return False, layout.HLI_AHEAD_NOT_EMPTY
        return bool(self._answered.more), int(self._answered.empty)

    def next(self, start_position: float, length: float) -> int:
        """``take`` and ``request`` in one C call, for whoever owns the pending
        request.

        Number of elements; below 0 nothing was done: BUSY, or REFUSED for a
        request that is not finite.  ``taken``: the elements, in memory of their
        own.
        """
        n: int = _next(self._port, start_position, length)
        if n >= 0:
            first = self._used
            self._used = end = first + n
            self.taken = self._pool[first:end]
            if end > _POOL_ROWS - BLOCK_ROWS:
                self._new_pool()
        return n

    @property
    def asked_ns(self) -> int:
        """Monotonic time at which the pending request was placed."""
        return int(self._port.asked_ns)

    @asked_ns.setter
    def asked_ns(self, ns: int) -> None:
        self._port.asked_ns = ns

    @property
    def took_ns(self) -> int:
        """From the request until ``next`` took its answer."""
        took: int = self._port.took_ns
        return took

    def copy(self, n: int) -> np.ndarray[Any, Any]:
        """An own array with the first `n` rows: bytes as a whole, where numpy
        would copy member by member.
        """
        return np.frombuffer(
            bytearray(self._bytes[: n * _ROW_BYTES]), BLOCK_DTYPE
        )

    def exchange(
        self, start_position: float, length: float, timeout_s: float = 1.0
    ) -> np.ndarray[Any, Any]:
        """Request, wait, copy: the answer's elements (a view of ``rows``, valid
        until the next exchange).

        Only where the CNC runs on by itself; in lockstep use
        ``plc_client.Hli.exchange``.  Raises HliTimeout.
        """
        end = lib.hs_monotonic_ns() + int(timeout_s * 1e9)
        while True:
            left = max(end - lib.hs_monotonic_ns(), 0)
            n = lib.hs_clah_call(
                self._unit,
                self._bell,
                self._answer,
                start_position,
                length,
                self._rows,
                min(left, _SLICE_NS),
            )
            if n != BUSY:
                break
            if not left:
                raise HliTimeout(
                    f"an earlier request stays unanswered for {timeout_s} s"
                )
        while n < 0:
            left = end - lib.hs_monotonic_ns()
            if left <= 0:
                raise HliTimeout(f"no answer within {timeout_s} s")
            n = lib.hs_clah_await(
                self._unit, self._answer, self._rows, min(left, _SLICE_NS)
            )
        return self.rows[:n]

    # -- CNC side (tests, benchmarks, servers in Python)
    def wait_request(
        self, timeout_s: float = 1.0
    ) -> tuple[float, float] | None:
        """Wait for a request: (start_position, length), or None after the time
        or a signal.
        """
        if (
            lib.hs_clah_wait_request(
                self._unit, self._bell, self._request, int(timeout_s * 1e9)
            )
            != OK
        ):
            return None
        return self._request[0], self._request[1]

    def answer(self, blocks: np.ndarray[Any, Any]) -> None:
        """Answer with these elements (BLOCK_DTYPE, contiguous, the first 128
        are used) and clear the semaphore.  TypeError: other elements.
        """
        if blocks.dtype != BLOCK_DTYPE:
            raise TypeError(f"blocks of {blocks.dtype}: BLOCK_DTYPE is needed")
        rows = np.ascontiguousarray(blocks, BLOCK_DTYPE)
        lib.hs_clah_answer(
            self._unit,
            self._answer,
            ffi.cast("void *", rows.ctypes.data),
            len(rows),
        )
