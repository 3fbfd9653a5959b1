"""One client: its commands, answered at once or after the PLC was asked."""

from __future__ import annotations

import struct
from collections.abc import Awaitable, Callable
from typing import Any

from .codes import AdsError, Code, Command, Group
from .devices import Devices
from .entries import address, handle_details, symbol_entry
from .frames import FRAME_MAX, Frame
from .notifications import Notifications
from .sums import Sums
from .values import UINT, Span, Values

Answer = bytes | Awaitable[bytes]
THREE = struct.Struct("<III")
FOUR = struct.Struct("<IIII")
WISH = struct.Struct("<IIIIII")
CONTROL = struct.Struct("<HHI")
OK = UINT.pack(0)


def unpacked(form: struct.Struct, data: bytes) -> tuple[Any, ...]:
    """The numbers at the front.  AdsError: there are not enough bytes."""
    if len(data) < form.size:
        raise AdsError(Code.INVALID_SIZE, f"{len(data)} bytes")
    return form.unpack_from(data)


class Session:
    """Answers the frames of one connection."""

    def __init__(self, devices: Devices, send: Callable[[bytes], None]) -> None:
        self._devices = devices
        self.values = Values(devices.cell)
        self.notifications = Notifications(self.values, send)
        self._sums = Sums(self)
        self._commands: dict[int, Callable[[Frame], Answer]] = {
            Command.DEVICE_INFO: self._device_info,
            Command.READ: self._read,
            Command.WRITE: self._write,
            Command.READ_STATE: self._read_state,
            Command.WRITE_CONTROL: self._write_control,
            Command.ADD_NOTIFICATION: self._add,
            Command.DELETE_NOTIFICATION: self._delete,
            Command.READ_WRITE: self._read_write,
        }

    def close(self) -> None:
        """The connection is gone."""
        self.notifications.close()

    def answer(self, frame: Frame) -> Answer:
        """What goes behind the head.  AdsError: an error for it."""
        command = self._commands.get(frame.command)
        if command is None:
            raise AdsError(Code.SERVICE_NOT_SUPPORTED, str(frame.command))
        return command(frame)

    # -- the device
    def _device_info(self, frame: Frame) -> bytes:
        return OK + self._devices.info(frame.target_port)

    def _read_state(self, frame: Frame) -> bytes:
        state = self._devices.state(frame.target_port)
        return OK + struct.pack("<HH", state, 0)

    def _write_control(self, frame: Frame) -> Answer:
        state, _, _ = unpacked(CONTROL, frame.data)
        return self._controlled(frame.target_port, state)

    async def _controlled(self, port: int, state: int) -> bytes:
        await self._devices.control(port, state)
        return OK

    # -- values
    def _read(self, frame: Frame) -> Answer:
        group, offset, length = unpacked(THREE, frame.data)
        found = self.read(frame, group, offset, length)
        if isinstance(found, Span):
            return self._later(found)
        return with_length(found)

    async def _later(self, span: Span) -> bytes:
        (data,) = await self.values.read([span])
        return with_length(data)

    def read(
        self, frame: Frame, group: int, offset: int, length: int
    ) -> bytes | Span:
        """The bytes, or what the PLC has to be asked for.  AdsError."""
        port = frame.target_port
        if group == Group.HLI:  # the usual case
            self._devices.need(port)
            return self.values.read_bytes(offset, length)
        if group == Group.DEVICE_DATA:
            state = self._devices.state(port)
            return struct.pack("<HH", state, 0)[offset:][:length]
        self._devices.need(port)
        listed = self._listed(group)
        if listed is not None:
            if length < len(listed) and group != Group.UPLOAD_INFO_2:
                raise AdsError(Code.INVALID_SIZE, f"{len(listed)} bytes")
            return listed[:length]
        if self._devices.is_object(port, group):
            return self._devices.read_object(port, group, offset, length)
        span = self.values.span(group, offset, length)
        now = self.values.read_now(span)
        return span if now is None else now

    def _listed(self, group: int) -> bytes | None:
        uploads = self._devices.uploads
        if group == Group.VERSION:
            return bytes([self._devices.version])
        if group == Group.UPLOAD_INFO:
            return uploads.info(8)
        if group == Group.UPLOAD_INFO_2:
            return uploads.info(24)
        if group == Group.UPLOAD:
            uploads.refresh()
            return uploads.symbols
        if group == Group.TYPE_UPLOAD:
            uploads.refresh()
            return uploads.types
        return None

    def _write(self, frame: Frame) -> Answer:
        group, offset, length = unpacked(THREE, frame.data)
        data = frame.data[THREE.size :]
        if length != len(data):
            raise AdsError(Code.INVALID_SIZE, f"{len(data)} of {length} bytes")
        return self._written(frame, group, offset, data)

    async def _written(
        self, frame: Frame, group: int, offset: int, data: bytes
    ) -> bytes:
        await self.write(frame, group, offset, data)
        return OK

    async def write(
        self, frame: Frame, group: int, offset: int, data: bytes
    ) -> None:
        """Set a value, or give a handle back.  AdsError."""
        self._devices.need(frame.target_port)
        if group == Group.RELEASE_HANDLE:
            (number,) = unpacked(UINT, data)
            self.values.release(number)
            return
        if self._devices.is_object(frame.target_port, group):
            group, offset = self._devices.object_place(group, offset)
        await self.values.write(group, offset, data)

    def _read_write(self, frame: Frame) -> Answer:
        group, offset, length, count = unpacked(FOUR, frame.data)
        data = frame.data[FOUR.size :]
        if count != len(data):
            raise AdsError(Code.INVALID_SIZE, f"{len(data)} of {count} bytes")
        if self._sums.knows(group):
            return self._sums.answer(frame, group, offset, data)
        found = self.read_write(frame, group, length, data)
        if isinstance(found, Span):
            return self._later(found)
        return with_length(found[:length])

    def read_write(
        self, frame: Frame, group: int, length: int, data: bytes
    ) -> bytes | Span:
        """Questions by name.  AdsError."""
        self._devices.need(frame.target_port)
        if group == Group.HANDLE_BY_NAME:
            number = self.values.new_handle(data)
            return UINT.pack(number) + handle_details(self.values.by_name(data))
        if group == Group.TYPE_BY_NAME:
            name = data.partition(b"\0")[0].decode("cp1252", "replace")
            return self._devices.uploads.type_of(name)
        if group == Group.VALUE_BY_NAME:
            place = self.values.by_name(data)
            span = Span(place, 0, min(length, place.size))
            now = self.values.read_now(span)
            return span if now is None else now
        if group == Group.INFO_BY_NAME_EX:
            return symbol_entry(self.values.by_name(data))
        if group == Group.INFO_BY_NAME:
            place = self.values.by_name(data)
            return THREE.pack(*address(place), place.size)
        raise AdsError(Code.INVALID_GROUP, f"{group:#x}")

    # -- notifications
    def _add(self, frame: Frame) -> bytes:
        return OK + UINT.pack(self.add(frame, frame.data))

    def add(self, frame: Frame, data: bytes) -> int:
        """The handle of a new notification.  AdsError."""
        group, offset, length, mode, _, cycle = unpacked(WISH, data)
        cycle_s = cycle * 1e-7 or self._devices.cell.cycle_s
        source: Span | Callable[[], bytes | None]
        if group in (Group.VERSION, Group.DEVICE_DATA):
            source = lambda: self._quiet(frame, group, offset, length)  # noqa: E731
        else:
            self._devices.need(frame.target_port)
            if self._devices.is_object(frame.target_port, group):
                group, offset = self._devices.object_place(group, offset)
            source = self.values.span(group, offset, length)
            if source.length > FRAME_MAX // 64:
                raise AdsError(Code.INVALID_SIZE, f"{length} bytes")
        return self.notifications.add(frame, source, mode, cycle_s)

    def _quiet(
        self, frame: Frame, group: int, offset: int, length: int
    ) -> bytes | None:
        try:
            found = self.read(frame, group, offset, length)
        except AdsError:
            return None
        return found if isinstance(found, bytes) else None

    def _delete(self, frame: Frame) -> bytes:
        (number,) = unpacked(UINT, frame.data)
        self.notifications.delete(number)
        return OK


def with_length(data: bytes) -> bytes:
    """Result 0, the length, the data."""
    return OK + UINT.pack(len(data)) + data
