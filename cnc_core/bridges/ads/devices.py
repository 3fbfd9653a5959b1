"""The devices behind the AMS ports: PLC, tasks of the CNC, system service."""

from __future__ import annotations

import struct
from importlib.metadata import version

from ...observing.plc import RefusedError
from ..symbols.cell import GoneError, ServedCell
from .codes import AdsError, Code, State
from .objects import CncObjects
from .uploads import Uploads

PLC, SYSTEM = 851, 10_000
CNC = {550: "CNC", 551: "CNC GEO", 552: "CNC SDA", 553: "CNC COM"}
NAMES = {PLC: "hli-cosim PLC", SYSTEM: "hli-cosim", **CNC}
NAME_LENGTH = 16


class Devices:
    """What all clients of a cell share."""

    def __init__(self, cell: ServedCell) -> None:
        self.cell = cell
        self.uploads = Uploads(cell)
        self._objects = CncObjects(cell)
        self._config = False
        self._restarts = 0

    @property
    def version(self) -> int:
        """Grows when symbols may have changed, modulo 256."""
        return (self.cell.edition + self._restarts) % 256

    def need(self, port: int) -> None:
        """AdsError: nothing is behind the port, or the system is in CONFIG."""
        if port not in NAMES or (self._config and port != SYSTEM):
            raise AdsError(Code.NO_TARGET_PORT, str(port))

    def info(self, port: int) -> bytes:
        """Version and name of a device.  AdsError."""
        self.need(port)
        numbers = [*map(int, version("hli-cosim").split(".")[:3])]
        name = NAMES[port].encode().ljust(NAME_LENGTH, b"\0")
        return struct.pack("<BBH", *numbers) + name

    def state(self, port: int) -> State:
        """RUN, STOP or CONFIG.  AdsError."""
        if port == SYSTEM:
            return State.CONFIG if self._config else State.RUN
        self.need(port)
        there = self.cell.there
        if port == PLC:
            there = self.cell.plc_there and not self.cell.halted
        return State.RUN if there else State.STOP

    async def control(self, port: int, state: int) -> None:
        """CONFIG takes the devices away from clients, RUN gives them back.

        STOP at the PLC's port leaves its tasks' logic out until RUN.
        AdsError: the state is not possible.
        """
        if port == SYSTEM:
            self._control_system(state)
            return
        self.need(port)
        if port != PLC or state not in (State.RUN, State.START, State.STOP):
            raise AdsError(Code.SERVICE_NOT_SUPPORTED, f"state {state}")
        try:
            await self.cell.halt(state == State.STOP)
        except (GoneError, RefusedError) as error:
            raise AdsError(Code.NOT_READY, str(error)) from None

    def _control_system(self, state: int) -> None:
        if state in (State.RECONFIG, State.CONFIG):
            self._config = True
        elif state in (State.RESET, State.RUN, State.START):
            self._config = False
            self._restarts += 1
        else:
            raise AdsError(Code.INVALID_STATE, str(state))

    # -- objects of the CNC
    def is_object(self, port: int, group: int) -> bool:
        """The group is one of the CNC's objects."""
        return port in CNC and self._objects.knows(group)

    def read_object(
        self, port: int, group: int, offset: int, length: int
    ) -> bytes:
        """The bytes of an object.  AdsError."""
        del port
        return self._objects.read(group, offset, length)

    def object_place(self, group: int, offset: int) -> tuple[int, int]:
        """Group and offset of the HLI's member behind an object.  AdsError."""
        return self._objects.place(group, offset)
