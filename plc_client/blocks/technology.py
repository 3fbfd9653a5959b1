"""Technology functions that take more than one scan: M, H, S and T of channels
and axes (hli_reference 6).
"""

from __future__ import annotations

from enum import Enum
from typing import Any

from hli.areas import Areas

from .base import FunctionBlock
from .owner import areas_of
from .program_flow import TechnoArray, TechnoFunction, techno_areas


class TechnoState(Enum):
    """States of a ``TechnoBlock`` (docs/reference/plc.md draws them)."""

    IDLE = "idle"
    EXECUTING = "executing"  # fetched, not acknowledged: the CNC may be waiting


class TechnoBlock(FunctionBlock):
    """One function of the server, by kind and number: made by
    ``TechnoServer.on("M", 8)``.

    ``active`` from the fetch to the acknowledgement; call it once per scan,
    with ``done`` TRUE when the work is done. Outputs ``rising`` (TRUE for the
    scan that fetched it), ``payload`` (HLI_M_H_PROZESS, HLI_S_PROZESS or
    HLI_T_PROZESS; the last one fetched), ``function``, ``count``.
    """

    def __init__(self) -> None:
        super().__init__()
        self.state = TechnoState.IDLE
        self.active = self.rising = False
        self.function: TechnoFunction | None = None
        self.payload: Any = None
        self.count = 0
        self._units: list[tuple[TechnoArray, int, TechnoFunction]] = []

    def __call__(self, done: bool = True) -> bool:
        """One scan, after the server's; returns ``active``."""
        if done and self._units:
            array, index, _ = self._units.pop(0)
            array.acknowledge(index)
        self._show()
        return self.active

    def offer(
        self, array: TechnoArray, index: int, function: TechnoFunction
    ) -> None:
        """The server has fetched a function for this block; several at once are
        worked off in order.
        """
        self._units.append((array, index, function))
        self.rising = True
        self.count += 1
        self._show()

    def _show(self) -> None:
        self.active = self.busy = bool(self._units)
        self.done = not self.active
        self.state = TechnoState.EXECUTING if self.active else TechnoState.IDLE
        if self._units:
            self.function = self._units[0][2]
            self.payload = self.function.payload


def _is_number(number: Any) -> bool:
    whole = isinstance(number, int) and not isinstance(number, bool)
    return whole and number >= 0


class TechnoServer:
    """Fetches every technology function at once and hands it to the block that
    is registered for it.

    ``server.on(kind, number)`` registers a block, ``number`` None: all of the
    kind.  What nobody registered for is acknowledged at once, as
    ``AcknowledgeAll`` does.  Call the server first in the scan, then its
    blocks.

    >>> functions = TechnoServer(hli)                                       #
    doctest: +SKIP
    >>> coolant = functions.on("M", 8)                                      #
    doctest: +SKIP
    >>> functions(); coolant(done=pump_is_running)                          #
    doctest: +SKIP
    """

    def __init__(self, hli: Areas) -> None:
        self._areas = techno_areas(areas_of(self, hli))
        self._blocks: dict[tuple[str, int | None, str], TechnoBlock] = {}
        self._channels = range(hli.gNrCh)

    def on(
        self, kind: str, number: int | None = None, channel: int | None = None
    ) -> TechnoBlock:
        """The block for a kind (M, H, S, T) and number; ValueError if there is
        one already.

        ``channel``: index of the channel that puts it out; None: of any.
        """
        if kind not in ("M", "H", "S", "T"):
            raise ValueError(f"technology function {kind!r}: M, H, S or T")
        if not (number is None or _is_number(number)):
            raise ValueError(
                f"technology function {kind}, number {number!r}: a whole number"
                " from 0 on, or None for all of the kind"
            )
        if channel is not None and channel not in self._channels:
            raise ValueError(
                f"channel {channel}: the CNC has 0..{len(self._channels) - 1}"
            )
        area = "" if channel is None else f"gpCh[{channel}]"
        if (kind, number, area) in self._blocks:
            whose = f" of {area}" if area else ""
            raise ValueError(
                f"{kind}{'' if number is None else number}{whose} has a block"
                " already"
            )
        block = self._blocks[kind, number, area] = TechnoBlock()
        return block

    def __call__(self) -> list[TechnoFunction]:
        """One scan: all functions fetched in it, in order."""
        fetched = []
        for block in self._blocks.values():
            block.rising = False
        for area in self._areas:
            for array, index, function in area.fetch_all():
                fetched.append(function)
                registered = self._find(function)
                if registered is None:
                    array.acknowledge(index)
                else:
                    registered.offer(array, index, function)
        return fetched

    def _find(self, function: TechnoFunction) -> TechnoBlock | None:
        for number in (function.number, None):
            for area in (function.area, ""):
                found = self._blocks.get((function.kind, number, area))
                if found is not None:
                    return found
        return None
