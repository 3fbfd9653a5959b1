"""Words of one block to rows, in the order of execution."""

from __future__ import annotations

from cnc_core.blocks import DWELL, HAS_VALUE, STANDSTILL, H, M, S, T
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.compensation import Compensation
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, Row
from cnc_core.frontend.isg.words import Function, Words
from cnc_core.frontend.machine import ProgramMachine, Tool

DWELL_MAX_S = 1e6
STOPS = (0, 1)
PROGRAM_ENDS = (2, 30)
SUBPROGRAM_ENDS = (17, 29)  # in the main program they end it
DWELL_WORDS = frozenset({"N", "S", "G motion"})


class Executor:
    """State of the channel beyond the modal state of the motions: spindle, tool."""

    def __init__(self, machine: ProgramMachine, modal: Modal) -> None:
        self._machine = machine
        self._modal = modal
        self.spindle_rev_min = 0.0
        self.tool = 0
        self.tool_data = Tool()
        self.compensation = Compensation(modal)
        self.ended = False

    def execute(self, words: Words) -> list[Row]:
        """Rows of one block; sets ``ended`` when the block ends the program."""
        if words.is_dwell:
            return [self._dwell(words)]
        self._check(words)
        before = self._switch_rows(words)
        plane = words.motion.plane or self._modal.plane
        before += self.compensation.update(words.codes, self.tool_data.radius_mm, plane, words.motion.n)
        motion = self._motion(words)
        self.compensation.settle()
        after = self._end_rows(words)
        self.ended = any(f.number in PROGRAM_ENDS + SUBPROGRAM_ENDS for f in words.functions["M"])
        return before + motion + after

    def _check(self, words: Words) -> None:
        for function in words.functions["M"]:
            self._check_m(function)
        if words.motion.block_stop and not words.motion.moves:
            raise fail(20003, ERRORS[20003], words.codes["G60"])
        if words.data and words.data not in self._machine.tools:
            raise fail(900014, f"D{words.data}: the machine has no tool {words.data}", words.offsets["D"])

    def _check_m(self, function: Function) -> None:
        number = function.number
        if number not in STOPS + PROGRAM_ENDS + SUBPROGRAM_ENDS and number not in self._machine.m_functions:
            raise fail(
                900009,
                f"M{number} is not defined: give its synchronisation in the cell configuration "
                f"(m_synch of M{number}, P-CHAN-00041)",
                function.offset,
            )

    def _switch_rows(self, words: Words) -> list[Row]:
        """S, T, D and the M and H functions that stand before the motion."""
        n, rows = words.motion.n, []
        if words.spindle is not None:
            self.spindle_rev_min = words.spindle
            rows.append(self._modal.row(S, n, value=words.spindle))
        if words.tool is not None:
            self.tool = words.tool
            rows.append(self._modal.row(T, n, code=words.tool))
        if words.data is not None:
            self._select_tool_data(words.data)
        at_end = STOPS + PROGRAM_ENDS + SUBPROGRAM_ENDS
        rows += [self._function(M, f, n) for f in words.functions["M"] if f.number not in at_end]
        return rows + [self._function(H, f, n) for f in words.functions["H"]]

    def _select_tool_data(self, number: int) -> None:
        self.tool_data = self._machine.tools[number] if number else Tool()
        self._modal.set_tool_length(self.tool_data.length_mm)

    def _function(self, kind: int, function: Function, n: int, flags: int = 0) -> Row:
        if function.value is None:
            return self._modal.row(kind, n, code=function.number, flags=flags)
        return self._modal.row(kind, n, code=function.number, value=function.value, flags=flags | HAS_VALUE)

    def _motion(self, words: Words) -> list[Row]:
        error, row = self._modal.apply(words.motion)
        if error:
            offset = words.motion.offset
            raise fail(error, ERRORS[error], offset if offset is not None else words.offsets.get("F", 0))
        return [] if row is None else [row]

    def _end_rows(self, words: Words) -> list[Row]:
        """M00 and M01, then the program end."""
        functions = sorted(words.functions["M"], key=lambda f: f.number in PROGRAM_ENDS)
        ends = [f for f in functions if f.number in STOPS + PROGRAM_ENDS]
        return [self._function(M, f, words.motion.n, STANDSTILL) for f in ends]

    def _dwell(self, words: Words) -> Row:
        self._check_alone(words)
        seconds = self._dwell_seconds(words)
        if not 0 <= seconds <= DWELL_MAX_S:
            raise fail(20752, f"G04: {seconds:g} s out of range 0..{DWELL_MAX_S:g} s", words.codes["G4"])
        return self._modal.row(DWELL, words.motion.n, value=seconds)

    def _check_alone(self, words: Words) -> None:
        names = {self._machine.axes[i].upper() for i in words.motion.axis}
        for name, offset in words.offsets.items():
            if name not in DWELL_WORDS and name not in names:
                raise fail(900018, f"{ERRORS[900018]}: {name.removeprefix('G ')}", offset)

    def _dwell_seconds(self, words: Words) -> float:
        axes, offset = words.motion.axis, words.codes["G4"]
        given = [v for v in (words.dwell, *axes.values(), words.spindle) if v is not None]
        if words.dwell is not None and axes:
            raise fail(20013, ERRORS[20013], offset)
        if any(axis != self._machine.main[0] for axis in axes):
            raise fail(20014, ERRORS[20014], offset)
        if len(given) != 1:
            raise fail(900004, "G04 takes one time or a number of spindle turns", offset)
        if words.spindle is None:
            return given[0]
        if self.spindle_rev_min <= 0:
            raise fail(900019, "G04 S: no spindle speed is programmed", offset)
        return words.spindle * 60.0 / self.spindle_rev_min
