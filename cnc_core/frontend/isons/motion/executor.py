"""Words of one block to rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
import numpy.typing as npt

from cnc_core.blocks import DWELL, STANDSTILL, M
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, MotionWords, Row
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.frontend.port import ChannelPort, Wait

from ..base import codes
from ..base.machine import IsonsCell, ToolTable
from ..base.parameters import Parameters
from ..base.text import AXIS_LETTERS
from ..devices.clock import Clock
from ..language.words import WordBlock, Words
from .direct import command, home, override, probe, stop
from .frame import Frame
from .mode_words import mode_function
from .motions import motion
from .origins import frame_function, origin_words
from .output import Output
from .path_modes import PathModes
from .planes import PLANE_AXES, plane_function, set_plane, transform_function
from .selections import selections
from .tip import Tip
from .transform import Transform

Array = npt.NDArray[np.float64]
Items = Sequence[Row | Wait]
DWELL_MAX_S = 1e6
PROGRAM_ENDS = (2, 30)
ROTARY_MODES = 5


class Executor:
    """State of the channel beyond the modal state of the motions.

    Behind ``execute``: ``ended``, and ``calls`` with (M or HM, number, offset,
    arguments) of macros to call. ``macro``: whether a PC macro of this number
    exists.
    """

    def __init__(
        self,
        machine: ProgramMachine,
        modal: Modal,
        port: ChannelPort,
        cell: IsonsCell,
        parameters: Parameters,
        clock: Clock,
        warn: Callable[[int, str, int], None],
        macro: Callable[[str, int], bool],
    ) -> None:
        self.machine, self.modal, self._port, self.cell = (
            machine,
            modal,
            port,
            cell,
        )
        self.parameters, self._clock, self.warn, self._macro = (
            parameters,
            clock,
            warn,
            macro,
        )
        self.axes = {
            name.upper(): i
            for i, name in enumerate(machine.axes)
            if len(name) == 1
        }
        self.frame = Frame(machine, modal, cell)
        self.transform = Transform(len(machine.axes))
        self.output = Output(machine, modal, parameters)
        self.tip = Tip(self)
        self.modes, self.modes_changed = (
            PathModes(machine.axes, modal, parameters),
            True,
        )
        self.rotary_modes: dict[int, int] = {}
        self.plane_pair, self.plane_code, self.plane_reversed = (
            (0, 1),
            17,
            False,
        )
        set_plane(self, "X", "Y", 0)
        self.spindle = parameters["SPEEDDEF"]
        self.tool = 0
        self.tables: dict[int, list[float]] = {}
        self.diameter: float | None = None
        self.pause_mode = 0
        self.depth_axis: int | None = None
        self.ended = False
        self.stopping = (
            False  # the axes are being stopped where they are (G101)
        )
        # what ends the program behind the rows of the block
        self.failure: CncError | None = None
        self.homed: set[int] = set()
        self.without_tools_told = False
        self.tool_instead: int | None = None  # of the next T (RESUME_T)
        self.counter: Array | None = (
            None  # what $_C tells while a restart leads there
        )
        self.completed = False  # the program has come to its end
        self.calls: list[tuple[str, int, int, list[float]]] = []
        self.positioner_offset: Callable[[float, float, bool, int], None] = (
            lambda *_: None
        )
        self.speed_copied: Callable[[float], None] = lambda _: None
        self.refresh()

    def refresh(self) -> None:
        """Take over parameters that the geometry uses."""
        modal, p = self.modal, self.parameters
        modal.set_feed_factor(p["FEEDRES"])
        if modal.feed == 0.0:
            modal.feed = p.speed("FEEDDEF") / p["FEEDRES"]
        modal.apply(MotionWords(centre_absolute=not p["ARC_REL"]))
        self.output.refresh(limits=not self.tip.on)
        self.modes_changed = True

    def parameter_in_force(self, name: str) -> float:
        """Value of a machine parameter; what is not given but has a key of the
        cell, as the cell has it.
        """
        what, _, letter = name.rpartition("_")
        axis = self.axes.get(letter)
        if self.parameters.given(name) or axis is None:
            return self.parameters[name]
        if what == "VMAX" and self.machine.velocity is not None:
            return (
                float(self.machine.velocity[axis])
                * 60.0
                / self.parameters.speed_unit
            )
        if what in ("LIMITE_N", "LIMITE_P"):
            limits = (
                self.output.limits.low
                if what == "LIMITE_N"
                else self.output.limits.high
            )
            return float(limits[axis]) * 1000.0
        return self.parameters[name]

    def follow_scanner(self) -> None:
        """Plain lines may have changed the plane."""
        if self.plane_code and self.plane_code != self.modal.plane:
            set_plane(self, *PLANE_AXES[self.modal.plane], 0)
            self.transform.plane = self.plane_pair
            self.transform.rebuild()

    @property
    def plain(self) -> bool:
        """The scanner may read plain lines."""
        standard = bool(self.plane_code) and not self.plane_reversed
        return (
            standard
            and self.transform.identity
            and self.output.plain
            and not self.modes.mild_on
            and not self.modes_changed  # the stages are told by the next block
            and not any(self.rotary_modes.values())
        )

    @property
    def table(self) -> list[float]:
        """Of the selected tool: diameter, length, largest speed, 17 values of
        the user.
        """
        if self.tool not in self.tables:
            given = self.cell.tools.get(self.tool)
            tool = self.machine.tools.get(self.tool)
            if given is None:
                given = (
                    ToolTable(2.0 * tool.radius_mm, tool.length_mm)
                    if tool
                    else ToolTable()
                )
            self.tables[self.tool] = given.values()
        return self.tables[self.tool]

    # one block

    def execute(self, block: WordBlock) -> list[Row | Wait]:
        values = {name: value() for name, value in block.values.items()}
        words = Words(
            block,
            values,
            {code: index() for code, _, index in block.g if index},
        )
        self.follow_scanner()
        self.output.follow(self.modal)
        self.ended, self.calls = False, []
        if block.n:
            self.modal.n = block.n
        items: list[Row | Wait] = []
        items += selections(self, words)
        for code, offset, _ in block.g:
            items += self._function(code, offset, words)
        origin_words(self, words)
        if self.modes_changed:
            items += self.mode_rows(block.n)
        items += self._functions_m(words, behind=False)
        if not words.codes.keys() & DIRECT.keys():
            items += motion(self, words)
        items += self._functions_m(words, behind=True)
        self._check_used(words)
        self._calls(words)
        return items

    def mode_rows(self, n: int) -> list[Row]:
        """What has changed of modes and filters."""
        self.modes_changed = False
        return [
            out
            for row in self.modes.rows(self.plane_pair, self.depth_axis, n)
            for out in self.emit(row)
        ]

    def emit(self, row: Row) -> list[Row]:
        return self.output.push(row)

    def _check_used(self, words: Words) -> None:
        for name, offset in words.block.offsets.items():
            if name not in words.used:
                raise fail(
                    908001, f"no function of the block uses {name}", offset
                )
        for name, offset in words.block.named.items():
            if name not in words.used:
                raise fail(900004, f"{name} without a value", offset)

    def not_compensated(self, name: str, offset: int) -> None:
        if self.output.side != 40:
            raise fail(906003, f"{name}: {ERRORS[906003]}", offset)

    # axes of a function

    def axis(self, letter: str, offset: int) -> int:
        if letter not in self.axes:
            raise fail(900001, f"the machine has no axis {letter}", offset)
        return self.axes[letter]

    def scale(self, axis: int) -> float:
        """mm or degrees per programmed unit."""
        return 1.0 if self.machine.rotary[axis] else self.modal.unit_mm

    def named_axes(self, words: Words) -> list[int]:
        """Axes that are named without values."""
        words.used |= set(words.block.named)
        return [
            self.axis(letter, offset)
            for letter, offset in words.block.named.items()
        ]

    def given(self, words: Words, current: Array) -> dict[int, float]:
        """Values of X ..

        W, and of DX .. DW beside ``current``, mm or degrees by axis.
        """
        found = {}
        for letter in AXIS_LETTERS:
            for name in (letter, "D" + letter):
                value = words.take(name)
                if value is not None:
                    axis = self.axis(letter, words.offset(name))
                    found[axis] = value * self.scale(axis) + (
                        current[axis] if name != letter else 0.0
                    )
        return found

    # G functions

    def _function(
        self, code: int, offset: int, words: Words
    ) -> list[Row | Wait]:
        if code in codes.ROWS:
            return self._function_with_rows(code, offset, words)
        if code in MODES:
            self._mode(code, offset)
        elif code in TRANSFORMS:
            transform_function(self, code, offset, words)
        elif code in (30, 31, 32, 33, 34, 35):
            self._corner(code, words)
        elif code in codes.PATH_FUNCTIONS:
            mode_function(self, code, words, offset)
        elif code in (83, 84):
            words.used |= set(words.block.named)
        elif code in SETTINGS:
            SETTINGS[code](self, words, offset)
        elif code != 940:
            frame_function(self, code, offset, words)
        return []

    def _function_with_rows(
        self, code: int, offset: int, words: Words
    ) -> list[Row | Wait]:
        """Functions that put something out by themselves."""
        rows: list[Row | Wait] = []
        if code in (40, 41, 42):
            rows += self.output.compensate(
                code, self._radius(), self.plane_code, words.block.n, offset
            )
        elif code in DIRECT:
            rows += DIRECT[code](self, words, offset)
        elif code in (103, 104, 105):
            rows += self.tip.function(code, words, offset)
        elif code in (10, 11):
            rows += override(self, code == 10, words.block.n)
        elif code == 62:
            self.not_compensated("G62", offset)
            rows += [*self.output.flush(), Wait.DRAINED]
        elif code in (4, 80):
            rows += (
                self._dwell(words, offset) if code == 4 else self._pause(words)
            )
        else:
            rows += self.output.flush()
            plane_function(self, code, offset, words)
        return rows

    def _mode(self, code: int, offset: int) -> None:
        if code in codes.MOTIONS:
            self.modal.apply(MotionWords(motion=code))
        elif code in (90, 91):
            self.modal.set_absolute(code == 90)
        elif code in (20, 21):
            self.modal.apply(MotionWords(inch=code == 20))
        elif code in (60, 61):
            self.modal.apply(MotionWords(exact_stop=code == 61))

    def _radius(self) -> float:
        diameter = self.table[0] if self.diameter is None else self.diameter
        return diameter / 2.0

    def _dwell(self, words: Words, offset: int) -> list[Row]:
        seconds = words.take("F")
        if seconds is None or not 0 <= seconds <= DWELL_MAX_S:
            raise fail(
                900012,
                f"G4: F with seconds 0..{DWELL_MAX_S:g} is expected",
                offset,
            )
        self._clock.passes(seconds)
        return self.emit(self.modal.row(DWELL, words.block.n, value=seconds))

    def _pause(self, words: Words) -> list[Row]:
        code = words.take("X")
        self._port.message(
            "NO CODE PAUSE" if code is None else f"PAUSE {code:g}"
        )
        return self.emit(
            self.modal.row(M, words.block.n, code=0, flags=STANDSTILL)
        )

    def _rotary_mode(self, words: Words, offset: int) -> None:
        mode = words.take("X")
        axes = self.named_axes(words)
        if mode is None or mode not in range(ROTARY_MODES):
            raise fail(900012, "G36: X0..X4 is expected", offset)
        for axis in axes:
            if not self.machine.rotary[axis]:
                raise fail(
                    909113,
                    f"G36: {self.machine.axes[axis]} is not a rotary axis",
                    offset,
                )
            self.rotary_modes[axis] = int(mode)
        if not axes:
            raise fail(900004, "G36: an axis is expected", offset)

    def _limit(self, words: Words, offset: int) -> None:
        if not words.values.keys() & set(AXIS_LETTERS):
            raise fail(900004, "G81: an axis with 0..3 is expected", offset)
        for letter in AXIS_LETTERS:
            mode = words.take(letter)
            if mode is None:
                continue
            if mode not in range(4):
                raise fail(900012, f"G81 {letter}{mode:g} is not 0..3", offset)
            self.output.limits.choose(self.axis(letter, offset), int(mode))
        self.output.refresh(limits=not self.tip.on)

    def _corner(self, code: int, words: Words) -> None:
        corners = self.output.corners
        corner = corners.fillet if code in (30, 31, 32) else corners.bevel
        other = corners.bevel if corner is corners.fillet else corners.fillet
        if code in (31, 34):
            corner.on = False
            return
        if code in (30, 33):
            size, angle = words.take("R"), words.take("A")
            for name, value in (("R", size), ("A", angle)):
                if value is not None and value < 0:
                    raise fail(
                        900012,
                        f"G{code}: {name}{value:g} is negative",
                        words.offset(name),
                    )
            corner.size = (
                corner.size if size is None else size * self.modal.unit_mm
            )
            corner.angle = corner.angle if angle is None else angle
        corner.on = True
        other.on = other.on and not corner.active

    def _entry(self, words: Words, offset: int) -> None:
        mode = words.take("X")
        if mode not in (0.0, 1.0):
            raise fail(900012, "G47: X0 or X1 is expected", offset)

    @property
    def plain_geometry(self) -> bool:
        return (
            self.transform.identity
            and bool(self.plane_code)
            and not self.plane_reversed
        )

    # M functions

    def _functions_m(self, words: Words, behind: bool) -> list[Row]:
        rows: list[Row] = []
        for number, offset, stands_behind in words.block.m:
            if stands_behind != behind or self._macro("M", number):
                continue
            if number in PROGRAM_ENDS:
                self.ended = True
            elif number not in self.machine.m_functions:
                text = f"M{number}: no macro of this number, and the cell has no such M function (m_synch)"
                raise fail(900009, text, offset)
            rows += self.emit(
                self.modal.row(M, words.block.n, code=number, flags=STANDSTILL)
            )
        return rows

    def _calls(self, words: Words) -> None:
        for number, offset, _ in words.block.m:
            if self._macro("M", number):
                self.calls.append(("M", number, offset, []))
        if words.block.hm:
            number, offset, arguments = words.block.hm
            self.calls.append(
                ("HM", number, offset, [argument() for argument in arguments])
            )
        if len(self.calls) > 1:
            raise fail(
                900011, "more than one macro call in a block", self.calls[1][2]
            )


MODES = frozenset({*codes.MOTIONS, 90, 91, 20, 21, 60, 61})
DIRECT: dict[int, Callable[[Executor, Words, int], list[Row | Wait]]] = {
    71: home,
    100: command,
    101: lambda executor, words, offset: stop(executor, offset),
    102: probe,
}
SETTINGS: dict[int, Callable[[Executor, Words, int], None]] = {
    36: Executor._rotary_mode,
    81: Executor._limit,
    47: Executor._entry,
}
TRANSFORMS = frozenset(
    {120, 121, 24, 25, 22, 23, 26, 27, 28, 50, 51, 52, 1051, 1050}
)
