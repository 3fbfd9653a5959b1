"""The contour in front of the tool, always complete: mode 2 with everything
around it done.
"""

from __future__ import annotations

from enum import Enum
from typing import Any

import numpy as np

from hli.structures import HLI_CHANNEL, HLI_CONTOUR_LOOKAHEAD
from hli.view import BLOCK_DTYPE

from .base import FunctionBlock
from .contour_lookahead import ContourLookahead
from .owner import channel_of


class AheadState(Enum):
    """States of the block (docs/reference/plc.md draws them)."""

    EMPTY = "empty"  # nothing known in front of the tool
    FOLLOWING = "following"  # more is known than was fetched
    COMPLETE = "complete"  # all that is known is here


class ContourAhead(FunctionBlock):
    """``ContourAhead(ch)()`` once per scan: ``elements`` is all that is known
    of the path from the tool on.

    ``elements`` is a numpy structured array with the fields of
    HLI_CONTOUR_LOOKAHEAD_BLOCK, the active element first; it is replaced, never
    changed.  ``distance``: where the tool is, ``known``: end of the last
    element (0.1 um). ``length`` of a call: range of one request.  Starts again
    at a new program and at a distance reset.
    """

    def __init__(self, ch: HLI_CHANNEL | HLI_CONTOUR_LOOKAHEAD) -> None:
        ch = channel_of(self, ch, "contour_lookahead")
        super().__init__()
        self._status, self._unit = ch.bahn_state, ch.contour_lookahead
        self.fb = ContourLookahead(self._unit)
        self.state = AheadState.EMPTY
        self.elements: np.ndarray[Any, Any] = np.zeros(0, BLOCK_DTYPE)
        self.distance = self.known = 0.0
        self._resets = 0
        self._first_end = 0.0

    def __call__(self, length: float = 1_000_000.0) -> np.ndarray[Any, Any]:
        """One scan; returns ``elements``."""
        new = self.fb.follow(length)
        self.distance = self._status.dist_prog_start
        if self.fb.resets != self._resets:
            self._resets = self.fb.resets
            self._keep(self.elements[:0])
        if len(new):
            self._keep(np.concatenate([self.elements, new]))
        if len(self.elements) and self._first_end <= self.distance:
            ends = self.elements["start_position"] + self.elements["length"]
            self._keep(
                self.elements[
                    int(np.searchsorted(ends, self.distance, "right")) :
                ]
            )
        self._show()
        return self.elements

    def window(self, length: float) -> np.ndarray[Any, Any]:
        """The elements that begin within ``length`` (0.1 um) in front of the
        tool, the active one included.
        """
        return self.elements[
            : int(
                np.searchsorted(
                    self.elements["start_position"], self.distance + length
                )
            )
        ]

    def _keep(self, elements: np.ndarray[Any, Any]) -> None:
        self.elements = elements
        if len(elements):
            self._first_end = float(
                elements["start_position"][0] + elements["length"][0]
            )
            self.known = float(
                elements["start_position"][-1] + elements["length"][-1]
            )

    def _show(self) -> None:
        more = (
            self.fb.busy
            and self._unit._c.state.max_dist_prog_start > self.known
        )
        following = AheadState.FOLLOWING if more else AheadState.COMPLETE
        self.state = following if len(self.elements) else AheadState.EMPTY
        self.done, self.busy = self.state is AheadState.COMPLETE, more
