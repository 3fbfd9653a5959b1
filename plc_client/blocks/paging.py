"""Reading everything, page by page, across scans: the marked log (mode 1) and
the coming contour (mode 2).

An answer holds at most 128 elements; the next page is asked for in the same
call that took the last one.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from hli.view import BLOCK_DTYPE

from .arbiter import Request

Blocks = np.ndarray[Any, Any]
TOLERANCE = 0.01  # 1 nm: a distance that fell by less did not fall
NOTHING: Blocks = np.zeros(0, BLOCK_DTYPE)


class Asker(Protocol):
    """The look-ahead block as its readers use it: ask, poll, take the answer."""

    unit: Any
    busy: bool
    blocks: Blocks

    @property
    def answer_request(self) -> Request | None:
        """The request of the last answer."""
        ...

    def poll(self) -> bool:
        """Take an answer that has arrived."""
        ...

    def ask(self, start_position: float, length: float) -> None:
        """Place a request unless one is under way."""
        ...


class LogReader:
    """Mode 1: all entries of the marked area in order, each once.

    ``index`` is the next entry.  When fewer entries are readable than were read
    (LOG CLEAR, program start), reading begins again at 0; an area that was
    replaced by a longer one between two calls cannot be told from one that
    grew.
    """

    def __init__(self, fb: Asker) -> None:
        self._fb = fb
        self._state = (
            fb.unit._c.state
        )  # the memory itself, never older than the answer
        self.index = 0
        # the request under way was placed before the log was cleared
        self._stale = False

    def __call__(self) -> Blocks:
        """The new entries (maybe none); asks for more as long as the CNC
        reports more.
        """
        fresh = self._fb.poll()
        count = self._state.count_logged_blocks
        if count < self.index:
            self.index = 0
            self._stale = self._fb.busy
            fresh = False
        blocks = self._take() if fresh else NOTHING
        if count > self.index:
            self._fb.ask(float(self.index), 0.0)
        return blocks

    def _take(self) -> Blocks:
        if self._stale:
            self._stale = False
            return NOTHING
        self.index += len(self._fb.blocks)
        return self._fb.blocks


class ContourFollower:
    """Mode 2: the elements of the path in order, each once, as far ahead as the
    CNC knows them.

    The manual's rule: there are new elements while ``start_position(last) +
    length(last) < max_dist_prog_start``, and they are requested from the end of
    the last one.  ``position`` is that end.  After a distance reset (the
    displayed distance fell although the path does not run backwards, or stands
    at 0 while the known distance lies behind ``position``: a new program) an
    answer still under way is dropped and everything begins again at 0.
    Elements that the CNC dropped before they were asked for (they lay too far
    behind the tool) are skipped; ``gaps`` counts these places and
    ``lost_distance`` adds up their length (0.1 um): a task too slow for short
    blocks loses some because one answer holds 128 elements and the CNC keeps
    P-CHAN-00658 behind the tool.
    """

    def __init__(self, fb: Asker) -> None:
        self._fb = fb
        self._known = (
            fb.unit._c.state
        )  # the memory itself, never older than the answer
        self._path = (
            None if fb.unit._parent is None else fb.unit._parent._c.bahn_state
        )
        self.position = 0.0
        self.resets = 0
        self.gaps = 0
        self.lost_distance = 0.0
        self._last_start = -1.0
        self._distance = 0.0
        self._backward = False
        self._known_when_asked = 0.0
        # the range asked for was empty: ask for all that is known
        self._catch_up = False
        self._stale = False

    def __call__(self, length: float) -> Blocks:
        """The new elements (maybe none); ``length`` is the range of one request
        in 0.1 um, above 0.
        """
        if not length > 0.0:
            raise ValueError(
                f"length {length}: a range above 0 (0.1 um) is needed"
            )
        # first the answer, then the distances: a reset seen here makes the
        # answer stale
        fresh = self._fb.poll()
        known = self._known.max_dist_prog_start
        if self._was_reset(known):
            self._begin_again()
            fresh = False
        blocks = self._take() if fresh else NOTHING
        if self.position < known and not self._fb.busy:
            self._known_when_asked = known
            self._fb.ask(
                self.position,
                max(length, known - self.position)
                if self._catch_up
                else length,
            )
        return blocks

    def _was_reset(self, known: float) -> bool:
        fell, backward = False, False
        state = self._path
        if state is not None:
            before, self._distance = self._distance, state.dist_prog_start
            before_backward, self._backward = (
                self._backward,
                state.backward_active_r,
            )
            backward = before_backward or self._backward
            fell = self._distance < before - TOLERANCE
        at_begin = (
            self._distance <= TOLERANCE and known < self.position - TOLERANCE
        )
        return (fell or at_begin) and not backward

    def _begin_again(self) -> None:
        self.position, self._last_start = 0.0, -1.0
        self.resets += 1
        self._stale = self._fb.busy

    def _take(self) -> Blocks:
        if self._stale:
            self._stale = False
            return NOTHING
        blocks = self._fb.blocks[
            self._fb.blocks["start_position"] > self._last_start
        ]
        self._catch_up = len(blocks) == 0 and self._whole_range_was_known()
        if len(blocks):
            self._note_gap(float(blocks[0]["start_position"]))
            last = blocks[-1]
            self._last_start = float(last["start_position"])
            self.position = self._last_start + float(last["length"])
        return blocks

    def _note_gap(self, start: float) -> None:
        missing = start - self.position
        if missing > TOLERANCE:
            self.gaps += 1
            self.lost_distance += missing

    def _whole_range_was_known(self) -> bool:
        """Then an empty answer means that the CNC has dropped the elements of
        this range.
        """
        request = self._fb.answer_request
        return (
            request is not None
            and request.start_position + request.length
            <= self._known_when_asked
        )
