"""Words of one block to rows, in the order of execution."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from cnc_core.blocks import (
    FLUSH,
    HAS_VALUE,
    NO_OVERRIDE,
    RAPID,
    STANDSTILL,
    H,
    M,
    S,
    T,
    motion_planes,
)
from cnc_core.errors import ERRORS, CncError

from ..base.lexer import fail
from ..base.scanner import MotionWords, Row
from ..machine import Tool
from .cycles.registry import find
from .dwell import dwell
from .language import gcodes
from .language.calls import positional
from .language.g_functions import GFunctions
from .language.word_block import Function, WordBlock, Words
from .selections import Selections
from .state.call import Call
from .state.measuring import place_functions
from .state.splines import refused_with_compensation
from .state.state import ProgramState
from .state.turning import RIGID

STOPS = (0, 1)
PROGRAM_ENDS = (2, 30)
SUBPROGRAM_ENDS = (17, 29)  # in the main program they end it
AT_END = STOPS + PROGRAM_ENDS + SUBPROGRAM_ENDS


class Executor:
    """Executes blocks of words.

    ``program_end``, ``level_end``: the last block ends the program, the level.
    ``calls``: the subprograms that the last block calls.
    """

    def __init__(self, state: ProgramState) -> None:
        self._state, self._channel = state, state.channel
        self._machine, self._modal = state.machine, state.modal
        self._offsets = state.offsets
        self._selections = Selections(state)
        self.program_end = self.level_end = False
        self.calls: list[Call] = []

    def execute(self, block: WordBlock) -> list[Row]:
        """Rows of one block."""
        words = block.evaluate()
        spaces = self._state.spaces
        due = (
            self._coordinates(words)
            if spaces.due or spaces.watches_plane
            else []
        )
        if (
            block.simple
            and self._channel.plain
            and not self._channel.compensation.choice.active
        ):
            return due + self._plain_motion(words) if block.words else due
        self.program_end = self.level_end = False
        self.calls = []
        if words.is_dwell:
            return [*due, dwell(self._state, words)]
        compensation = self._channel.compensation
        chosen = compensation.choice
        try:
            return self._moved(words, due)
        except CncError:
            compensation.take_back(chosen)
            raise

    def give_back(self, saved: GFunctions) -> list[Row]:
        """Rows of the end of a cycle: the caller's G functions are in force again."""
        self._channel.feeds.choose(saved.feed_mode)
        self._modal.restore(saved.modal)
        self._channel.turning.thread = saved.thread
        rows = self._channel.contouring.switch(saved.contouring, self._modal.n)
        now = GFunctions.of(self._state)
        parts = [saved.others_again(now), saved.compensation_again(now)]
        if not saved.compensation.active:
            parts.reverse()  # offsets are not changed while it is active
        for codes in parts:
            if codes:
                rows += self._select(codes, saved.zero_offset)
        return rows

    def _select(self, codes: list[str], zero_offset: int) -> list[Row]:
        """A block of G functions alone.  ``zero_offset``: value of G159."""
        words = Words(codes=dict.fromkeys(codes, 0))
        words.motion.n = self._modal.n
        if "G159" in codes:
            words.values[159] = zero_offset
        return self._moved(words, [])

    def _moved(self, words: Words, due: list[Row]) -> list[Row]:
        """Rows of a block that may choose tool radius compensation."""
        self._check(words)
        words = self._turning_words(self._selections.take(words))
        before = due + self._switch_rows(words)
        before += self._coordinate_rows(words.motion.n)
        plane = words.motion.plane or self._modal.plane
        before += self._channel.compensation.update(
            words.codes, self._radius(plane), plane, words.motion.n
        )
        words, corner = self._corner_row(words)
        ahead, behind = self._contour_rows(words)
        for name in ("G150", "G151"):
            if name in words.codes:
                ahead += self._channel.switch_spline(
                    name == "G151", words.motion.n, words.codes[name]
                )
        if (
            self._channel.splines.active
            and self._channel.compensation.choice.active
        ):
            raise refused_with_compensation(0)
        start = self._modal.position
        before, driven = place_functions(
            before, self._motion(words), start, self._machine
        )
        motion = ahead + driven + behind + corner
        self._channel.compensation.settle()
        if "G61" in words.codes:
            self._channel.contouring.last_once = self._modal.position
        after = self._end_rows(words)
        numbers = [f.number for f in words.functions["M"]]
        self.program_end = any(n in PROGRAM_ENDS for n in numbers)
        self.level_end = any(n in SUBPROGRAM_ENDS for n in numbers)
        self._calls(words)
        return before + motion + after

    def _turning_words(self, words: Words) -> Words:
        functions = {f.number for f in words.functions["M"]}
        for name in ("G33", "G96"):
            if name in words.codes and self._channel.smooth.hsc is not None:
                raise fail(
                    120433, f"{ERRORS[120433]}: {name}", words.codes[name]
                )
        motion = self._channel.turning.take(
            words.codes,
            words.motion,
            functions,
            self._channel.feeds.mode,
            words.spindle,
        )
        return replace(words, motion=motion)

    def _corner_row(self, words: Words) -> tuple[Words, list[Row]]:
        """G301, G302: their I is no centre word, and nothing else of the block
        moves.
        """
        code = next((c for c in gcodes.CORNERS if f"G{c}" in words.codes), 0)
        if not code:
            return words, []
        offset, motion = words.codes[f"G{code}"], words.motion
        if motion.axis or set(motion.centre) - {"I"} or motion.r is not None:
            raise fail(
                900010, f"G{code} stands in a block of its own, with I", offset
            )
        rows = self._channel.corner_words.g(
            code, motion.centre.get("I"), motion.n, offset
        )
        return replace(words, motion=replace(motion, centre={})), rows

    def _coordinates(self, words: Words) -> list[Row]:
        """Changes of coordinates by the assignments of the block, or by a new
        plane.
        """
        spaces, plane = self._state.spaces, words.motion.plane
        if (
            spaces.watches_plane
            and plane is not None
            and plane != self._modal.plane
        ):
            if self._channel.compensation.choice.active:
                raise fail(20133, ERRORS[20133], words.motion.offset or 0)
            self._modal.apply(MotionWords(plane=plane))
            if spaces.rotation is not None:
                self._state.warn(
                    910110, ERRORS[910110], words.motion.offset or 0
                )
                spaces.set_rotation(None)
            spaces.touch()
        return self._coordinate_rows(words.motion.n) if spaces.due else []

    def _coordinate_rows(self, n: int) -> list[Row]:
        rows = self._state.spaces.rows(n)
        if rows and self._channel.compensation.choice.active:
            raise fail(906003, f"a change of coordinates: {ERRORS[906003]}", 0)
        return list(rows)

    def _plain_motion(self, words: Words) -> list[Row]:
        error, row = self._modal.apply(words.motion)
        if error:
            raise fail(error, ERRORS[error], words.motion.offset or 0)
        return [] if row is None else [row]

    # checks

    def _check(self, words: Words) -> None:
        for function in words.functions["M"]:
            self._check_m(function)
        if words.motion.block_stop and not words.motion.moves:
            raise fail(20003, ERRORS[20003], words.codes["G60"])
        if words.data and words.data not in self._machine.tools:
            raise fail(
                900014,
                f"D{words.data}: the machine has no tool {words.data}",
                words.offsets["D"],
            )

    def _check_m(self, function: Function) -> None:
        number = function.number
        if (
            number in AT_END
            or number in self._machine.m_functions
            or (number == 6 and self._m6())
        ):
            return
        text = (
            f"M{number} is not defined: give its synchronisation in the cell configuration "
            f"(m_synch of M{number}, P-CHAN-00041)"
        )
        if not self._state.lenient:
            raise fail(900009, text, function.offset)
        self._state.warn(907041, text, function.offset)

    def _m6(self) -> str:
        return self._state.programs.get("M6", self._machine.m6_program)

    def _radius(self, plane: int) -> float:
        """Radius of the tool; negative swaps the side.

        Mirroring one axis of the plane swaps the side.
        """
        sign = 1.0
        for place in motion_planes(plane)[:2]:
            axis = self._machine.main[place]
            sign *= 1.0 if axis < 0 else float(self._offsets.mirror[axis])
        return self._channel.tool_data.radius_mm * sign

    # rows

    def _contour_rows(self, words: Words) -> tuple[list[Row], list[Row]]:
        """Rows of G61, G260, G261 and G360: ahead of the motion, and behind it."""
        codes, n = words.codes, words.motion.n
        for name in ("G61", "G261"):
            if name in codes:
                self._channel.check_contouring(True, codes[name])
        if "G61" in codes:
            return self._channel.contouring.once(n)
        if "G260" in codes or "G360" in codes:
            return self._channel.contouring.switch(False, n), []
        return (
            self._channel.contouring.switch(True, n) if "G261" in codes else []
        ), []

    def _switch_rows(self, words: Words) -> list[Row]:
        """Limits, S, T, D and the M and H functions that stand before the motion."""
        n = words.motion.n
        rows = self._channel.dynamics.rows(n)
        speed = self._channel.turning.speed(
            words.codes, words.spindle, words.offsets.get("S", 0)
        )
        if speed is not None:
            rows.append(self._modal.row(S, n, value=speed))
        if words.tool is not None:
            self._channel.tool = words.tool
            rows.append(self._modal.row(T, n, code=words.tool))
        if words.data is not None:
            self._select_tool_data(words.data)
        rows += self._selections.limit_rows()
        if "G74" in words.codes:
            rows.append(self._modal.row(FLUSH, n, flags=STANDSTILL))
            self._channel.stored_without_effect(
                "G74 (the axes are referenced)", words.codes["G74"]
            )
        for function in words.functions["M"]:
            if function.number == 6 and self._m6():
                continue
            if function.number == 19 and words.position is not None:
                rows.append(
                    self._modal.row(
                        M, n, code=19, value=words.position, flags=HAS_VALUE
                    )
                )
            elif function.number not in AT_END:
                rows.append(self._function(M, function, n))
        return rows + [self._function(H, f, n) for f in words.functions["H"]]

    def _select_tool_data(self, number: int) -> None:
        self._channel.data = number
        self._channel.tool_data = (
            self._machine.tools[number] if number else Tool()
        )
        self._state.spaces.tool_kinematic(self._channel.tool_data.kin_id, 0)
        self._offsets.set_tool_length(self._channel.tool_data.length_mm)

    def _function(
        self, kind: int, function: Function, n: int, flags: int = 0
    ) -> Row:
        if function.value is None:
            return self._modal.row(kind, n, code=function.number, flags=flags)
        return self._modal.row(
            kind,
            n,
            code=function.number,
            value=function.value,
            flags=flags | HAS_VALUE,
        )

    def _motion(self, words: Words) -> list[Row]:
        start = None if self._channel.plain else self._modal.position
        error, row = self._applied(words.motion)
        offset = words.motion.offset
        if error:
            raise fail(
                error,
                ERRORS[error],
                offset if offset is not None else words.offsets.get("F", 0),
            )
        if row is None:
            return []
        made = (
            [row] if start is None else self._with_feed(row, start, offset or 0)
        )
        if "G166" in words.codes and not row["flags"][0] & RAPID:
            row["flags"] |= NO_OVERRIDE
            row["feed"] /= self._channel.feeds.factor
        return made

    def _applied(self, motion: MotionWords) -> tuple[int, Row | None]:
        """The motion; threads need no F."""
        feed, fed = self._modal.feed, self._channel.turning.mode in (0, RIGID)
        if not fed and motion.f is None and feed <= 0:
            self._modal.assume_feed()
        error, row = self._modal.apply(motion)
        if not fed and motion.f is None:
            self._modal.feed = feed
        return error, row

    def _with_feed(self, row: Row, start: Any, offset: int) -> list[Row]:
        """A motion whose feed, or whose spindle speed, the scanner does not know."""
        changed = not row["flags"][0] & RAPID and self._channel.turning.follow()
        self._channel.feeds.apply(
            row,
            start,
            self._channel.spindle_rev_min,
            self._state.spaces.turned,
            offset,
        )
        self._channel.turning.apply(row, start, offset)
        return (
            [
                self._modal.row(
                    S, int(row["n"][0]), value=self._channel.spindle_rev_min
                ),
                row,
            ]
            if changed
            else [row]
        )

    def _end_rows(self, words: Words) -> list[Row]:
        """M00 and M01, then the program end."""
        functions = sorted(
            words.functions["M"], key=lambda f: f.number in PROGRAM_ENDS
        )
        ends = [f for f in functions if f.number in STOPS + PROGRAM_ENDS]
        return [self._function(M, f, words.motion.n, STANDSTILL) for f in ends]

    # calls

    def _calls(self, words: Words) -> None:
        """Subprograms that are executed at the end of the block."""
        self.calls = [] if words.call is None else [words.call]
        if (
            words.call is not None
            and words.call.arguments is not None
            and set(words.offsets) - {"N", "L"}
        ):
            raise fail(907108, ERRORS[907108], words.call.offset)
        for function in words.functions["M"]:
            if function.number == 6 and self._m6():
                self.calls.append(Call(self._m6(), False, function.offset))
        for name, offset in words.codes.items():
            code = int(name[1:])
            if code not in gcodes.USER_CODES:
                continue
            program = self._state.programs.get(
                name, self._machine.g_programs.get(code, "")
            )
            if not program:
                raise fail(
                    20131,
                    f"unknown G function G{code:02d}: no subprogram is assigned to it",
                    offset,
                )
            arguments = positional(words.arguments) if words.arguments else None
            self.calls.append(Call(program, False, offset, arguments))
        cycles = [
            call
            for call in self.calls
            if call.arguments is not None and find(call.name) is None
        ]
        # built-in ones warn themselves
        if cycles and self._state.spaces.rotation is not None:
            self._state.warn(910111, ERRORS[910111], cycles[0].offset)
        if len(self.calls) > 1:
            raise fail(
                900011,
                "more than one subprogram call in a block",
                self.calls[1].offset,
            )
