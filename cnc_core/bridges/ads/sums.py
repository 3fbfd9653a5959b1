"""Sum commands: many reads, writes or questions in one frame."""

from __future__ import annotations

import struct
from collections.abc import Awaitable
from typing import Protocol

from .codes import AdsError, Code, Group
from .frames import FRAME_MAX, Frame
from .values import UINT, Span, Values

COMMANDS_MAX = 10_000
THREE = struct.Struct("<III")
FOUR = struct.Struct("<IIII")
PAIR = struct.Struct("<II")
WISH = 40
READS = (Group.SUM_READ, Group.SUM_READ_EX, Group.SUM_READ_EX_2)
Found = bytes | Span | AdsError


class Host(Protocol):
    """What sums need of a session."""

    values: Values

    def read(
        self, frame: Frame, group: int, offset: int, length: int
    ) -> bytes | Span:
        """The bytes, or what the PLC has to be asked for."""

    def read_write(
        self, frame: Frame, group: int, length: int, data: bytes
    ) -> bytes | Span:
        """Questions by name."""

    async def write(
        self, frame: Frame, group: int, offset: int, data: bytes
    ) -> None:
        """Set a value."""

    def add(self, frame: Frame, data: bytes) -> int:
        """The handle of a new notification."""

    @property
    def notifications(self) -> Deletes:
        """Those of the client."""


class Deletes(Protocol):
    """Takes notifications back."""

    def delete(self, number: int) -> None:
        """AdsError: there is none of this number."""


class Sums:
    """The sum commands of one client."""

    def __init__(self, host: Host) -> None:
        self._host = host

    @staticmethod
    def knows(group: int) -> bool:
        """It is a sum command."""
        return Group.SUM_READ <= group <= Group.SUM_DELETE

    def answer(
        self, frame: Frame, group: int, count: int, data: bytes
    ) -> bytes | Awaitable[bytes]:
        """AdsError: the command as a whole cannot be read."""
        if count > COMMANDS_MAX:
            raise AdsError(Code.INVALID_PARAMETER, f"{count} commands")
        if group in READS:
            return self._read(frame, group, count, data)
        if group == Group.SUM_READ_WRITE:
            return self._read_write(frame, count, data)
        if group == Group.SUM_WRITE:
            return self._write(frame, count, data)
        if group == Group.SUM_ADD:
            return self._add(frame, count, data)
        return self._delete(count, data)

    # -- reads
    def _read(
        self, frame: Frame, group: int, count: int, data: bytes
    ) -> bytes | Awaitable[bytes]:
        wanted = _rows(THREE, count, data)
        if sum(length for _, _, length in wanted) > FRAME_MAX // 2:
            raise AdsError(Code.INVALID_SIZE, "more than one frame holds")
        found = [self._one(frame, *row) for row in wanted]
        lengths = [length for _, _, length in wanted]
        if any(isinstance(one, Span) for one in found):
            return self._read_later(group, found, lengths)
        return _reads(group, found, lengths)

    def _one(self, frame: Frame, group: int, offset: int, length: int) -> Found:
        try:
            return self._host.read(frame, group, offset, length)
        except AdsError as error:
            return error

    async def _read_later(
        self, group: int, found: list[Found], lengths: list[int]
    ) -> bytes:
        return _reads(group, await self._asked(found), lengths)

    async def _asked(self, found: list[Found]) -> list[Found]:
        """The same with the PLC's values: one question for all of them."""
        spans = [one for one in found if isinstance(one, Span)]
        try:
            values = iter(await self._host.values.read(spans))
        except AdsError as error:
            return [error if isinstance(f, Span) else f for f in found]
        return [next(values) if isinstance(f, Span) else f for f in found]

    # -- questions
    def _read_write(
        self, frame: Frame, count: int, data: bytes
    ) -> bytes | Awaitable[bytes]:
        rows = _rows(FOUR, count, data)
        at = FOUR.size * count
        found: list[Found] = []
        for group, _, length, size in rows:
            part = data[at : at + size]
            at += size
            try:
                one = self._host.read_write(frame, group, length, part)
            except AdsError as error:
                found.append(error)
            else:
                found.append(one[:length] if isinstance(one, bytes) else one)
        if any(isinstance(one, Span) for one in found):
            return self._read_write_later(found)
        return _answers(found)

    async def _read_write_later(self, found: list[Found]) -> bytes:
        return _answers(await self._asked(found))

    # -- writes
    async def _write(self, frame: Frame, count: int, data: bytes) -> bytes:
        rows = _rows(THREE, count, data)
        at = THREE.size * count
        if at + sum(length for _, _, length in rows) != len(data):
            raise AdsError(Code.INVALID_SIZE, f"{len(data)} bytes")
        codes = []
        for group, offset, length in rows:
            part = data[at : at + length]
            at += length
            try:
                await self._host.write(frame, group, offset, part)
            except AdsError as error:
                codes.append(int(error.code))
            else:
                codes.append(0)
        return _sized(struct.pack(f"<{count}I", *codes))

    # -- notifications
    def _add(self, frame: Frame, count: int, data: bytes) -> bytes:
        if len(data) < WISH * count:
            raise AdsError(Code.INVALID_SIZE, f"{len(data)} bytes")
        found = b""
        for k in range(count):
            try:
                number = self._host.add(frame, data[k * WISH :][:WISH])
            except AdsError as error:
                found += PAIR.pack(error.code, 0)
            else:
                found += PAIR.pack(0, number)
        return _sized(found)

    def _delete(self, count: int, data: bytes) -> bytes:
        found = b""
        for (number,) in _rows(UINT, count, data):
            try:
                self._host.notifications.delete(number)
            except AdsError as error:
                found += UINT.pack(error.code)
            else:
                found += UINT.pack(0)
        return _sized(found)


def _rows(
    form: struct.Struct, count: int, data: bytes
) -> list[tuple[int, ...]]:
    if len(data) < form.size * count:
        raise AdsError(Code.INVALID_SIZE, f"{len(data)} bytes")
    return list(form.iter_unpack(data[: form.size * count]))


def _reads(group: int, found: list[Found], lengths: list[int]) -> bytes:
    """Results, then data: each as long as it was asked for, or as it is."""
    heads = b""
    parts = []
    for one, length in zip(found, lengths, strict=True):
        data = one if isinstance(one, bytes) else b""
        code = int(one.code) if isinstance(one, AdsError) else 0
        if group == Group.SUM_READ:
            heads += UINT.pack(code)
        else:
            heads += PAIR.pack(code, len(data))
        if group == Group.SUM_READ_EX_2:
            parts.append(data)
        else:
            parts.append(data.ljust(length, b"\0"))
    return _sized(heads + b"".join(parts))


def _answers(found: list[Found]) -> bytes:
    heads = b""
    parts = []
    for one in found:
        data = one if isinstance(one, bytes) else b""
        code = int(one.code) if isinstance(one, AdsError) else 0
        heads += PAIR.pack(code, len(data))
        parts.append(data)
    return _sized(heads + b"".join(parts))


def _sized(data: bytes) -> bytes:
    return UINT.pack(0) + UINT.pack(len(data)) + data
