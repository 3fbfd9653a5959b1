"""The mock's side of the look-ahead extension: what an answer is, epochs, the
queue, a plan without acceleration.
"""

from __future__ import annotations

import ctypes
import math
from typing import Any

import numpy as np
from hli._sync import lib

from hli import layout
from hli.handshake import BLOCK_ROWS
from hli.queue import BUSY, DETAIL_DTYPE, Queue
from hli.structures import HLI_SEGMENT
from hli.view import BLOCK_DTYPE

from .script import TENTH_UM_PER_MM, Step

Rows = np.ndarray[Any, Any]
EVENTS = {
    "dwell": layout.HLI_CLAH_DWELL,
    "M": layout.HLI_CLAH_M,
    "H": layout.HLI_CLAH_H,
    "S": layout.HLI_CLAH_S,
    "T": layout.HLI_CLAH_T,
    "stop": layout.HLI_CLAH_M,
    "optional_stop": layout.HLI_CLAH_M,
}
_LOG, _CONTOUR = (
    layout.HLI_AHEAD_MODE_LOG,
    layout.HLI_AHEAD_MODE_CONTOUR,
)
_FLAGS = (
    layout.HLI_AHEAD_BEYOND | layout.HLI_AHEAD_EVENTS | layout.HLI_AHEAD_DETAILS
)
_US = 1e6
_KNOT = np.dtype(layout.HLI_AHEAD_KNOT)


class Contour:
    """All rows of a script in order, motions and events, each with its epoch and
    with its place in a distance that no reset interrupts.
    """

    def __init__(self, steps: list[Step], path: Rows) -> None:
        rows, details, motion, places = [], [], [], []
        epoch, zero, distance, element = 1, 0.0, 0.0, 0
        for i, step in enumerate(steps):
            if step.kind == "distance_reset":
                epoch, zero, distance = epoch + 1, zero + distance, 0.0
                continue
            if not step.is_motion and step.kind not in EVENTS:
                continue
            detail = np.zeros(1, DETAIL_DTYPE)[0]
            detail["epoch"] = epoch
            if step.is_motion:
                row = path[element]
                element += 1
            else:
                row = np.zeros(1, BLOCK_DTYPE)[0]
                row["block_type"] = EVENTS[step.kind]
                row["block_number"], row["block_count_r"] = step.n, i + 1
                row["start_position"] = distance
                detail["code"], detail["value"] = step.number, step.seconds
            rows.append(row)
            details.append(detail)
            motion.append(element if step.is_motion else 0)
            places.append(zero + distance)
            distance += float(row["length"])
        self.rows = np.array(rows, BLOCK_DTYPE)
        self.details = np.array(details, DETAIL_DTYPE)
        self.element = np.array(motion, int)  # number of the motion, from 1
        self.place = np.array(places)
        self.epochs = epoch


class MockAhead:
    """Serves the extension of a mock CNC.

    The HLI has the first channel's alone. That of another one is seen by nobody.
    """

    def __init__(self, cnc: Any) -> None:
        self._cnc = cnc
        self._area: Any = (
            cnc.areas.gpAhead[0]
            if cnc.index == 0
            else HLI_SEGMENT(layout.HLI_SEGMENT()).ahead[0]
        )
        self._area.version_r = layout.HLI_AHEAD_VERSION
        self._area.sizeof_r = ctypes.sizeof(layout.HLI_AHEAD)
        self._queue = Queue(self._area)
        self._seq = self._area.plan._pointer(layout.HLI_AHEAD_PLAN.seq.offset)
        self._steps: list[Step] = []
        self._contour = Contour([], np.zeros(0, BLOCK_DTYPE))
        self._base = 0  # epochs of the programs before

    @property
    def contour(self) -> Contour:
        """Of the program that runs."""
        steps = self._cnc.steps
        if self._steps is not steps:
            self._base += self._contour.epochs if self._steps else 0
            self._steps = steps
            self._contour = Contour(steps, self._cnc.path)
        return self._contour

    @property
    def _epoch(self) -> int:
        """The present epoch of this program, from 1."""
        steps: list[Step] = self._cnc.steps[: self._cnc._at]
        return 1 + sum(step.kind == "distance_reset" for step in steps)

    # -- one cycle
    def publish(self) -> None:
        """State and plan; called under the channel's seqlock."""
        state = self._area.state
        contour = self.contour
        state.epoch = self._base + self._epoch
        state.plan_valid = bool(self._area.plan_enable_w)
        if not state.plan_valid:
            return
        state.motion_time = self._cnc.cycles * self._cnc.cycle_s * _US
        state.edition = self._cnc.cycles
        self._write_plan(self._knots(contour))

    def serve(self) -> None:
        """Answer everything that the queue holds."""
        slot = self._queue.asked()
        while slot != BUSY:
            request = self._area.slot[slot].request
            blocks, details, facts = self.answer(
                request.start_position,
                request.length,
                request.mode,
                request.flags,
                request.epoch,
            )
            self._queue.answer(slot, blocks, details, facts)
            slot = self._queue.asked(slot + 1)

    def tell(self, start: float, length: float) -> Rows:
        """Elements for the manual's unit; the extension says the rest."""
        mode = _CONTOUR if length else _LOG
        blocks, _, facts = self.answer(start, length, mode)
        told = self._area.answer
        told.start_position, told.length = start, length
        told.mode, told.count = mode, len(blocks)
        for name, value in facts.items():
            setattr(told, name, value)
        return blocks

    # -- answers
    def answer(
        self,
        start: float,
        length: float,
        mode: int,
        flags: int = 0,
        epoch: int = 0,
    ) -> tuple[Rows, Rows, dict[str, Any]]:
        """(elements, details, facts) of a request."""
        facts = {
            "more": False,
            "end": layout.HLI_AHEAD_END_OPEN,
            "epoch": 0,
            "dist_prog_start": self._cnc.distance,
            "empty": _bad(start, length, mode, flags, epoch),
        }
        if facts["empty"]:
            return self._cnc.path[:0], np.zeros(0, DETAIL_DTYPE), facts
        if mode == _LOG:
            return self._log(start, facts)
        return self._range(start, length, flags, epoch, facts)

    def _log(
        self, start: float, facts: dict[str, Any]
    ) -> tuple[Rows, Rows, dict[str, Any]]:
        log, first = self._cnc.log, int(start)
        facts["end"] = layout.HLI_AHEAD_END_LOG if len(log) else 0
        facts["more"] = first + BLOCK_ROWS < len(log)
        if first >= len(log):
            facts["empty"] = (
                layout.HLI_AHEAD_EMPTY_BEHIND_END
                if len(log)
                else layout.HLI_AHEAD_EMPTY_NOT_KNOWN
            )
        rows = log[first : first + BLOCK_ROWS]
        return rows, np.zeros(0, DETAIL_DTYPE), facts

    def _known(self) -> int:
        """Motions that are known: the window."""
        cnc = self._cnc
        return int(min(cnc._element + 1 + cnc.ahead, len(cnc.path)))

    def _range(
        self,
        start: float,
        length: float,
        flags: int,
        epoch: int,
        facts: dict[str, Any],
    ) -> tuple[Rows, Rows, dict[str, Any]]:
        contour, now = self.contour, self._epoch
        facts["epoch"] = self._base + now
        asked = epoch - self._base if epoch else now
        epochs = contour.details["epoch"].astype(int)
        known = np.cumsum(contour.element > 0) <= self._known()
        inside = known & (epochs >= now)
        mine = inside & (epochs == asked)
        later = bool(flags & layout.HLI_AHEAD_BEYOND)
        ahead = inside & (epochs >= asked) if later else mine
        zero = _zero(contour, epochs, asked)
        begin = contour.place - zero
        end = begin + contour.rows["length"]
        chosen = ahead & (begin < start + length)
        chosen &= np.where(contour.element > 0, end > start, begin >= start)
        if not flags & layout.HLI_AHEAD_EVENTS:
            chosen &= contour.element > 0
        found = np.flatnonzero(chosen)
        facts["more"] = len(found) > BLOCK_ROWS
        found = found[:BLOCK_ROWS]
        facts["end"] = self._end(inside, epochs, asked, later)
        if not len(found):
            facts["empty"] = self._why(mine, begin, start + length, facts)
        wanted = bool(flags & layout.HLI_AHEAD_DETAILS)
        details = self._details(found if wanted else found[:0])
        return contour.rows[found], details, facts

    def _end(self, inside: Any, epochs: Any, asked: int, later: bool) -> int:
        if not later and (inside & (epochs > asked)).any():
            return layout.HLI_AHEAD_END_RESET
        whole = self._known() == len(self._cnc.path)
        return layout.HLI_AHEAD_END_PROGRAM if whole else 0

    @staticmethod
    def _why(mine: Any, begin: Any, end: float, facts: dict[str, Any]) -> int:
        if mine.any() and end <= begin[mine][0]:
            return layout.HLI_AHEAD_EMPTY_DROPPED
        return {
            layout.HLI_AHEAD_END_OPEN: layout.HLI_AHEAD_EMPTY_NOT_KNOWN,
            layout.HLI_AHEAD_END_PROGRAM: layout.HLI_AHEAD_EMPTY_BEHIND_END,
        }.get(facts["end"], layout.HLI_AHEAD_EMPTY_BEFORE_RESET)

    # -- details and plan
    def _here(self) -> float:
        """The present place, in the distance that no reset interrupts."""
        contour = self.contour
        epochs = contour.details["epoch"].astype(int)
        return _zero(contour, epochs, self._epoch) + float(self._cnc.distance)

    def _details(self, found: Any) -> Rows:
        contour, cnc = self.contour, self._cnc
        details: Rows = contour.details[found].copy()
        details["epoch"] += self._base
        details["way"] = contour.place[found] - self._here()
        details["flags"] = layout.HLI_AHEAD_HAS_WAY
        motions = [step for step in cnc.steps if step.is_motion]
        for row, at in zip(details, found, strict=True):
            if not contour.element[at]:
                continue
            step = motions[contour.element[at] - 1]
            row["flags"] |= layout.HLI_AHEAD_HAS_DRIVEN
            row["driven_length"] = contour.rows["length"][at]
            if step.rapid:
                row["flags"] |= layout.HLI_AHEAD_RAPID
            else:
                row["feed"] = (step.feed_mm_s or cnc.feed_mm_s) * 1000.0
        if self._area.plan_enable_w:
            self._put_plan(details, contour.rows["length"][found])
        return details

    def _put_plan(self, details: Rows, lengths: Rows) -> None:
        knots = self._knots(self.contour)
        times, places = knots["motion_time"], knots["distance"]
        now = self._cnc.cycles * self._cnc.cycle_s * _US
        for row, length in zip(details, lengths, strict=True):
            for side, way in (
                ("start", row["way"]),
                ("end", row["way"] + length),
            ):
                begins = side == "start"
                at = (
                    int(np.searchsorted(places, way + 1e-6, side="right")) - 1
                    if begins
                    else int(np.searchsorted(places, way - 1e-6)) - 1
                )
                if way < 0.0 or way > places[-1] + 1e-6:
                    continue
                if not begins and not length:
                    continue
                low = min(max(at, 0), len(places) - 2)
                pair = slice(low, low + 2)
                time = np.interp(way, places[pair], times[pair])
                if begins and at >= 0 and way - places[at] < 1e-6:
                    time = times[at]
                row[f"time_{side}"] = max(float(time) - now, 0.0)
                row[f"speed_{side}"] = knots["speed"][max(at, 0)]
                row["flags"] |= {
                    "start": layout.HLI_AHEAD_HAS_START_PLAN,
                    "end": layout.HLI_AHEAD_HAS_END_PLAN,
                }[side]

    def _knots(self, contour: Contour) -> Rows:
        """From the present place on: every motion at its own speed."""
        cnc, motions = self._cnc, 0
        time, place = cnc.cycles * cnc.cycle_s * _US, 0.0
        found: list[tuple[float, float, float, float]] = []
        for i in range(cnc._at, len(cnc.steps)):
            step = cnc.steps[i]
            speed = cnc._speed(step) if step.is_motion else 0.0
            if step.is_motion and (speed <= 0.0 or motions > cnc.ahead):
                break
            done = cnc._inside_mm if step.is_motion and i == cnc._at else 0.0
            way = (step.length_mm - done) * step.is_motion
            lasts = way / speed if step.is_motion else step.seconds
            rate = speed * TENTH_UM_PER_MM
            found.append((time, place, rate, speed * 1000.0))
            time, place = time + lasts * _US, place + way * TENTH_UM_PER_MM
            found.append((time, place, rate, speed * 1000.0))
            motions += step.is_motion
        found = found[: layout.HLI_AHEAD_KNOT_MAXIDX] or [(time, 0, 0, 0)]
        if found[-1][2] or len(found) < 2:
            found.append((*found[-1][:2], 0.0, 0.0))
        return np.array(found, _KNOT)

    def _write_plan(self, knots: Rows) -> None:
        plan = self._area.plan
        lib.hs_seq_begin(self._seq)
        plan.knot.as_array()[: len(knots)] = knots
        plan.count, plan.edition = len(knots), self._cnc.cycles
        plan.complete = self._known() == len(self._cnc.path)
        plan.override = self._cnc._percent / 100.0
        lib.hs_seq_end(self._seq)


def _zero(contour: Contour, epochs: Any, asked: int) -> float:
    """Where the distances of an epoch begin."""
    before = np.flatnonzero(epochs < asked)
    if not len(before):
        return 0.0
    last = before[-1]
    return float(contour.place[last] + contour.rows["length"][last])


def _bad(start: float, length: float, mode: int, flags: int, epoch: int) -> int:
    if mode not in (_LOG, _CONTOUR):
        return layout.HLI_AHEAD_EMPTY_BAD_MODE
    if not math.isfinite(start) or (mode == _LOG and start <= -1.0):
        return layout.HLI_AHEAD_EMPTY_BAD_START
    if length != 0.0 if mode == _LOG else not 0.0 < length < math.inf:
        return layout.HLI_AHEAD_EMPTY_BAD_LENGTH
    if mode == _LOG and epoch:
        return layout.HLI_AHEAD_EMPTY_BAD_EPOCH
    if flags & ~(0 if mode == _LOG else _FLAGS):
        return layout.HLI_AHEAD_EMPTY_BAD_FLAGS
    return layout.HLI_AHEAD_NOT_EMPTY
