"""One contour look-ahead request through the real handshake, before the first
motion or after the program's end.

Arguments: ``mode`` 1 or 2, ``start`` (index, or distance in 0.1 um), ``length``
(mode 2: range in 0.1 um), ``at`` "start" (preparation saturated, no motion yet)
or "end", ``page`` (ask on until the answer ends).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from hli import layout
from hli.handshake import BLOCK_ROWS
from hli.view import BLOCK_FIELDS

from ..blocks import ContourLookahead
from ..blocks.contour_lookahead import ERROR_LENGTH
from ..task import task
from . import acknowledge
from .arguments import checked

DEFAULTS: dict[str, Any] = {
    "mode": 1,
    "start": 0.0,
    "length": 0.0,
    "at": "end",
    "page": True,
}


class AnyRequest(ContourLookahead):
    """Sends a range without elements, too, which the block refuses."""

    def _wrong(self, start_position: float, length: float) -> int:
        wrong = super()._wrong(start_position, length)
        return 0 if wrong == ERROR_LENGTH else wrong


@task(interval=0.001)
class Plc:
    """Waits for the moment, asks page by page, tells the CNC that it is finished."""

    def __init__(self, args: dict[str, Any]) -> None:
        self._args = checked(args, DEFAULTS)
        if self._args["mode"] not in (1, 2):
            raise ValueError(f"argument mode = {self._args['mode']}: 1 or 2")
        if self._args["at"] not in ("start", "end"):
            raise ValueError(
                f"argument at = {self._args['at']!r}: 'start' or 'end'"
            )
        if self._args["mode"] == 2 and self._args["length"] == 0:
            raise ValueError(
                "argument length = 0: mode 2 needs a range (0 is mode 1)"
            )
        self._answer: dict[str, Any] | None = None

    def setup(self, hli: Any) -> None:
        self._hli = hli
        self._ch = hli.gpCh[0]
        self._clah = AnyRequest(self._ch.contour_lookahead)
        self._others = acknowledge.Plc({})
        self._others.setup(hli)
        self._position = float(self._args["start"])
        self._length = (
            float(self._args["length"]) if self._args["mode"] == 2 else 0.0
        )
        self._end = self._position + self._length
        self._pages: list[Any] = []
        self._asked = False

    def cyclic(self) -> None:
        if self._args["at"] == "end":
            self._others.cyclic()
        if self._answer is not None or not (self._asked or self._is_time()):
            return
        if self._clah.poll():
            self._take()
        if self._answer is None:
            self._asked = True
            self._clah.ask(self._position, self._length)
            if self._clah.error:
                raise ValueError(
                    f"request {self._position}, {self._length}: not finite numbers"
                )

    def finished(self) -> bool:
        return self._answer is not None

    def result(self) -> dict[str, Any] | None:
        return self._answer

    def _is_time(self) -> bool:
        if self._args["at"] == "end":
            return bool(self._hli.phase == layout.HLI_PHASE_ENDED)
        # ended: nothing to move, or refused
        ready = (layout.HLI_PHASE_READY, layout.HLI_PHASE_ENDED)
        return bool(self._ch.head.init_done_r) and self._hli.phase in ready

    def _take(self) -> None:
        """Keep the page; ask for the next one as long as the answers are full."""
        blocks = self._clah.blocks
        self._pages.append(blocks)
        if (
            self._args["page"]
            and len(blocks) == BLOCK_ROWS
            and self._advance(blocks[-1])
        ):
            return
        self._answer = self._collect()
        self._hli.finish()

    def _advance(self, last: Any) -> bool:
        if self._args["mode"] == 1:
            self._position += BLOCK_ROWS
            return True
        self._position = float(last["start_position"] + last["length"])
        self._length = self._end - self._position
        return self._length > 0.0

    def _collect(self) -> dict[str, Any]:
        state = self._ch.contour_lookahead.state
        return {
            "mode": self._args["mode"],
            "request": {
                "start_position": float(self._args["start"]),
                "length": self._requested_length(),
            },
            "state": {
                "max_dist_prog_start": state.max_dist_prog_start,
                "count_logged_blocks": state.count_logged_blocks,
                "f_log_is_active": state.f_log_is_active,
            },
            "response": [
                block for page in self._pages for block in as_dicts(page)
            ],
        }

    def _requested_length(self) -> float:
        return float(self._args["length"]) if self._args["mode"] == 2 else 0.0


def as_dicts(blocks: np.ndarray[Any, Any]) -> list[dict[str, Any]]:
    """Elements as dicts with the HLI's field names, without fills."""
    return [{name: row[name].item() for name in BLOCK_FIELDS} for row in blocks]
