"""Orders to the PLC of a cell, one after the other."""

from __future__ import annotations

import asyncio
from typing import Any

from hli.errors import HliError
from plc_client import orders

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
        """The PLC's answer.  RefusedError: it refuses, or there is none."""
        if self._waiting >= self._max:
            raise RefusedError("too many orders wait already")
        self._waiting += 1
        try:
            async with self._one:
                return await asyncio.to_thread(orders.send, self._name, order)
        except (HliError, ValueError, OSError) as error:
            raise RefusedError(str(error)) from None
        finally:
            self._waiting -= 1
