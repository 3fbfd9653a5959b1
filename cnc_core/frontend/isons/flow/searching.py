"""Restart: a place of the program is searched for without motion, then the
program is taken up there.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from cnc_core.blocks import EVENT, EVENT_OVERRIDE, BlockBatch, M, S, T
from cnc_core.frontend.base.scanner import Row
from cnc_core.units import FloatArray

from ..motion.direct import way
from .program import Program

NORMAL, GO_BLOCK, RETRACE = 0, 2, 3  # $_X7
M_GROUPS = ((3, 4, 5, 19), (7, 8, 9))  # M functions that replace each other


class Search:
    """``found``: no place is searched for, or it has been reached."""

    def __init__(self, program: Program) -> None:
        self._program = program
        self.found = True
        self._line: tuple[int, int] | None = (
            None  # of the place, and passes left
        )
        self._passed = -1  # blocks executed when the line was reached last
        # functions of the stretch that was searched, by what they replace
        self._last: dict[int, Row] = {}
        # level, place behind a macro
        self._return_to: tuple[int, FloatArray] | None = None

    def search(self, line: int, passes: int, marker: str, value: float) -> None:
        """Execute without a machine until the place is reached (``found``);
        every block goes through the parser.
        """
        program = self._program
        self.found = False
        program.scan_plain_lines(False)
        program.system.run_type = GO_BLOCK
        if marker:
            program.store.watched = (marker, value)
        else:
            self._line = (line, passes)

    def stop_here(self) -> bool:
        """The place is reached in front of the next block."""
        program = self._program
        if self.found:
            return False
        if self._line is None:
            self.found = program.store.watch_hit
        elif (program.flow.file.number, program.modal.line) == (
            0,
            self._line[0] - 1,
        ) and self._passed != program.steps:
            self._passed = program.steps
            self._line = (self._line[0], self._line[1] - 1)
            self.found = self._line[1] == 0
        return self.found

    def note(self, rows: BlockBatch) -> None:
        """Functions that the search has passed: the last ones of each kind are
        put out again.
        """
        override = (rows.rows["type"] == EVENT) & (
            rows.rows["code"] == EVENT_OVERRIDE
        )
        for row in rows.rows[
            np.isin(
                rows.rows["type"],
                (M, S, T),
            )
            | override
        ]:
            group = next(
                (
                    i
                    for i, codes in enumerate(M_GROUPS)
                    if int(row["code"]) in codes
                ),
                None,
            )
            if row["type"] != M or group is not None:
                self._last[
                    (100 + group)
                    if row["type"] == M and group is not None
                    else int(row["type"])
                ] = row.copy()

    @property
    def path_reaches_back(self) -> bool:
        """What is driven next depends on the blocks before: compensation, RTCP,
        corners, filters, MILD.
        """
        program = self._program
        channel = program.channel
        if program.compensated or channel.tip.on or channel.output.leaving:
            return True
        return (
            channel.output.corners.active
            or channel.modes.filtering
            or channel.modes.mild_on
        )

    @property
    def go_block_macro(self) -> Path | None:
        """The macro M_GOBLOCK, None if there is none."""
        return self._program.pause_macro("M_GOBLOCK")

    def go_on(self) -> BlockBatch:
        """The place has been found and the path is not left: functions again."""
        self._end_search()
        kinds = sorted(self._last, key=lambda k: (k != T, k != S, k))
        return (
            BlockBatch(np.array([self._last[kind] for kind in kinds]))
            if kinds
            else BlockBatch.empty()
        )

    def _end_search(self) -> None:
        program = self._program
        program.system.run_type, program.store.watched = NORMAL, None
        program.scan_plain_lines(True)

    def take_up(self, start: FloatArray) -> None:
        """The place has been found: functions again, the macro M_GOBLOCK, then
        the way from ``start`` to it.
        """
        program = self._program
        place = program.modal.position
        self._end_search()
        for kind in sorted(
            self._last,
            key=lambda k: (k != T, k != S, k),
        ):
            program.put_out([np.array([self._last[kind]])])
        program.modal.set_position(start)
        program.channel.output.moved_to(start)
        if program.call_event("M_GOBLOCK"):
            self._return_to = (len(program.flow.levels) - 1, place)
            program.channel.counter = place
            program.system.run_type = GO_BLOCK
        else:
            self.go_to(place)

    def go_to(self, place: FloatArray) -> None:
        """To where the program goes on, at VRIPOSO."""
        program = self._program
        program.channel.counter = None
        program.system.run_type = NORMAL
        speed = (
            program.parameters.speed("VRIPOSO")
            or program.modal.feed * program.parameters["FEEDRES"]
        )
        program.put_out(way(program.channel, place, speed, 0, 0))

    def arrived(self) -> None:
        """Back on the level of the program behind M_GOBLOCK: the rest of the way."""
        program = self._program
        if (
            self._return_to is not None
            and len(program.flow.levels) == self._return_to[0]
        ):
            (_, place), self._return_to = self._return_to, None
            program.put_out(program.held_rows())
            self.go_to(place)
