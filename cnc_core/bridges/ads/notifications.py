"""Device notifications: cyclic and on change, with time stamps.

Cycle times count on the wall's clock, in virtual time too.  A client that
does not take its samples is left, so nothing grows.
"""

from __future__ import annotations

import asyncio
import contextlib
import struct
import time
from collections.abc import Callable
from dataclasses import dataclass, field

from .codes import AdsError, Code, Mode
from .frames import Frame, filetime, notification
from .values import Span, Values

NOTIFICATIONS_MAX = 2048  # of one client
CYCLE_MIN_S = 0.001
CYCLE_MAX_S = 3600.0
FIRST_S = 0.05  # from the answer to the first sample
BEHIND_MAX = 5000
"""Cyclic samples that are made up for after a standstill."""
ASK_S = 0.02  # between two questions to the PLC for its symbols
CLOCK_SET_NS = 100_000_000
"""So far the wall's clock may be away before stamps follow it."""
HEAD = struct.Struct("<II")
STAMP = struct.Struct("<QI")
SAMPLE = struct.Struct("<II")


@dataclass
class Wish:
    """What a client wants to be told of."""

    number: int
    frame: Frame
    mode: Mode
    cycle_s: float
    take: Callable[[], bytes | None]
    span: Span | None = None
    due: float = 0.0
    last: bytes | None = None
    asked: bytes | None = field(default=None, repr=False)


class Notifications:
    """The wishes of one client."""

    def __init__(self, values: Values, send: Callable[[bytes], None]) -> None:
        self._values, self._send = values, send
        self._wishes: dict[int, Wish] = {}
        self._last = 0
        self._offset_ns = 0  # of the wall's clock to the steady one
        self._wake = asyncio.Event()
        self._tasks = [
            asyncio.ensure_future(self._run()),
            asyncio.ensure_future(self._ask()),
        ]

    def add(
        self,
        frame: Frame,
        source: Span | Callable[[], bytes | None],
        mode: int,
        cycle_s: float,
    ) -> int:
        """The handle.  AdsError."""
        if len(self._wishes) >= NOTIFICATIONS_MAX:
            raise AdsError(Code.NO_MORE_HANDLES)
        if mode not in (Mode.CYCLIC, Mode.ON_CHANGE):
            raise AdsError(Code.MODE_NOT_SUPPORTED, str(mode))
        self._last = self._last % 0xFFFF_FFF0 + 1
        wish = Wish(self._last, frame, Mode(mode), cycle_s, lambda: None)
        if isinstance(source, Span):
            wish.span = source
            wish.take = self._taker(wish, source)
        else:
            wish.take = source
        wish.cycle_s = min(max(cycle_s, CYCLE_MIN_S), CYCLE_MAX_S)
        # behind the answer, or the client does not know the handle yet
        wish.due = time.monotonic() + FIRST_S
        self._wishes[wish.number] = wish
        self._wake.set()
        return wish.number

    def _taker(self, wish: Wish, span: Span) -> Callable[[], bytes | None]:
        if span.place.of_plc:
            return lambda: wish.asked

        def take() -> bytes | None:
            with contextlib.suppress(AdsError):
                return self._values.read_now(span)
            return None

        return take

    def delete(self, number: int) -> None:
        """AdsError: there is none of this number."""
        if self._wishes.pop(number, None) is None:
            raise AdsError(Code.INVALID_NOTIFICATION, str(number))

    def close(self) -> None:
        """The client is gone."""
        self._wishes.clear()
        for task in self._tasks:
            task.cancel()

    # -- sampling
    async def _run(self) -> None:
        while True:
            self._wake.clear()
            now = time.monotonic()
            due = min((w.due for w in self._wishes.values()), default=None)
            if due is not None and due <= now:
                self._sample(now)
                await asyncio.sleep(0)
                continue
            wait = None if due is None else due - now
            with contextlib.suppress(asyncio.TimeoutError):
                await asyncio.wait_for(self._wake.wait(), wait)

    def _set_clock(self, now: float) -> None:
        """Stamps follow the wall's clock, and stay even while nobody sets it."""
        offset_ns = time.time_ns() - round(now * 1e9)
        if abs(offset_ns - self._offset_ns) > CLOCK_SET_NS:
            self._offset_ns = offset_ns

    def _sample(self, now: float) -> None:
        self._set_clock(now)
        found: dict[tuple[bytes, int], dict[int, list[bytes]]] = {}
        frames: dict[tuple[bytes, int], Frame] = {}
        for wish in self._wishes.values():
            if wish.due > now:
                continue
            to = wish.frame.source, wish.frame.source_port
            frames[to] = wish.frame
            stamps = found.setdefault(to, {})
            for due, data in _samples(wish, now):
                stamp = filetime(round(due * 1e9) + self._offset_ns)
                sample = SAMPLE.pack(wish.number, len(data)) + data
                stamps.setdefault(stamp, []).append(sample)
        for to, stamps in found.items():
            if stamps:
                self._send(notification(frames[to], _packed(stamps)))

    # -- symbols of the PLC
    async def _ask(self) -> None:
        while True:
            await asyncio.sleep(ASK_S)
            wishes = [
                w
                for w in self._wishes.values()
                if w.span is not None and w.span.place.of_plc
            ]
            if not wishes:
                continue
            spans = [w.span for w in wishes if w.span is not None]
            try:
                for wish, data in zip(
                    wishes, await self._values.read(spans), strict=True
                ):
                    wish.asked = data
            except AdsError:
                for wish in wishes:
                    wish.asked = None


def _samples(wish: Wish, now: float) -> list[tuple[float, bytes]]:
    """Times and bytes of what is due; cyclic samples are made up for."""
    data = wish.take()
    dues: list[float] = []
    while wish.due <= now and len(dues) < BEHIND_MAX:
        dues.append(wish.due)
        wish.due += wish.cycle_s
    if wish.due <= now:
        wish.due = now + wish.cycle_s
    if data is None:
        return []
    if wish.mode == Mode.CYCLIC:
        return [(due, data) for due in dues]
    if data == wish.last:
        return []
    wish.last = data
    return [(now, data)]


def _packed(stamps: dict[int, list[bytes]]) -> bytes:
    body = b"".join(
        STAMP.pack(stamp, len(samples)) + b"".join(samples)
        for stamp, samples in sorted(stamps.items())
    )
    return HEAD.pack(len(body) + 4, len(stamps)) + body
