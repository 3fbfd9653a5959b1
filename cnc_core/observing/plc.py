"""Orders to the PLC and the CNC of a cell: to the PLC one after the other."""

from __future__ import annotations

import asyncio
from typing import Any

from hli import orders
from hli.errors import HliError

OF_THE_CNC = ("answer",)
WAITING_MAX = 16  # orders at a time; more are refused


class RefusedError(Exception):
    """An order that is not given, with the reason."""


class PlcLine:
    """Asks the PLC of one cell beside the event loop."""

    def __init__(self, name: str, waiting_max: int = WAITING_MAX) -> None:
        self._name = name
        self._max = waiting_max
        self._one = asyncio.Lock()
        self._waiting = 0

    async def ask(self, order: dict[str, Any]) -> dict[str, Any]:
        """The answer of the PLC, or of the CNC to what is its own.

        RefusedError: it refuses, or there is none.
        """
        side = orders.CNC if order["do"] in OF_THE_CNC else orders.PLC
        if self._waiting >= self._max:
            raise RefusedError("too many orders wait already")
        self._waiting += 1
        try:
            async with self._one:
                return await self._sent(order, side)
        finally:
            self._waiting -= 1

    async def look(self, order: dict[str, Any]) -> dict[str, Any]:
        """What the CNC tells; it does not wait for the PLC.  RefusedError."""
        return await self._sent(order, orders.CNC)

    async def _sent(self, order: dict[str, Any], side: str) -> dict[str, Any]:
        try:
            return await asyncio.to_thread(
                orders.send, self._name, order, 0.0, side
            )
        except (HliError, ValueError, OSError) as error:
            raise RefusedError(str(error)) from None
