"""Words of one block to rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cnc_core.blocks import DWELL, STANDSTILL, M
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import MotionWords, Row
from cnc_core.frontend.port import ChannelPort, Wait

from ..base import codes
from ..base.text import AXIS_LETTERS
from ..base.words import WordBlock, Words
from ..devices.clock import Clock
from .direct import command, home, override, probe, stop
from .mode_words import mode_function
from .motions import motion
from .origins import frame_function, origin_words
from .planes import plane_function, transform_function
from .selections import selections
from .state import ChannelState
from .tip_words import tip_function

Items = Sequence[Row | Wait]
DWELL_MAX_S = 1e6
PROGRAM_ENDS = (2, 30)
# words of ``selections`` and of ``origin_words``
SELECTING = frozenset(
    {"USER_ZERO", "USER_OFFSET", "PAUSE_MODE", "H", "F", "T", "D", "S"}
)
UNITS = (20, 21)
ORIGINS = frozenset("O" + letter for letter in AXIS_LETTERS)
ROTARY_MODES = 5


class Executor:
    """Executes the words of a block on the state of the channel.

    Behind ``execute``: ``ended``, and ``calls`` with (M or HM, number, offset,
    arguments) of macros to call.  ``macro``: whether a PC macro of this number
    exists.
    """

    def __init__(
        self,
        channel: ChannelState,
        port: ChannelPort,
        clock: Clock,
        macro: Callable[[str, int], bool],
    ) -> None:
        self.channel = channel
        self._port, self._clock, self._macro = port, clock, macro
        self.ended = False
        self.calls: list[tuple[str, int, int, list[float]]] = []

    # one block

    def execute(self, block: WordBlock) -> list[Row | Wait]:
        for code, offset, _ in block.g:
            if code in UNITS:  # for all that the block writes and reads
                self._mode(code, offset)
        values = {name: value() for name, value in block.values.items()}
        words = Words(
            block,
            values,
            {code: index() for code, _, index in block.g if index},
        )
        self.channel.follow_scanner()
        self.channel.output.follow(self.channel.modal)
        self.ended, self.calls = False, []
        if block.n:
            self.channel.modal.n = block.n
        items: list[Row | Wait] = []
        if not SELECTING.isdisjoint(values):
            items += selections(self.channel, words)
        for code, offset, _ in block.g:
            items += self._function(code, offset, words)
        if not ORIGINS.isdisjoint(values):
            origin_words(self.channel, words)
        if self.channel.modes_changed:
            items += self.channel.mode_rows(block.n)
        items += self._functions_m(words, behind=False)
        if values and DIRECT.keys().isdisjoint(words.codes):
            items += motion(self.channel, words)
        items += self._functions_m(words, behind=True)
        self._check_used(words)
        self._calls(words)
        return items

    def _check_used(self, words: Words) -> None:
        for name, offset in words.block.offsets.items():
            if name not in words.used:
                raise fail(
                    908001, f"no function of the block uses {name}", offset
                )
        for name, offset in words.block.named.items():
            if name not in words.used:
                raise fail(900004, f"{name} without a value", offset)

    # G functions

    def _function(
        self, code: int, offset: int, words: Words
    ) -> list[Row | Wait]:
        if code in codes.ROWS:
            return self._function_with_rows(code, offset, words)
        if code in MODES:
            self._mode(code, offset)
        elif code in TRANSFORMS:
            transform_function(self.channel, code, offset, words)
        elif code in (30, 31, 32, 33, 34, 35):
            self._corner(code, words)
        elif code in codes.PATH_FUNCTIONS:
            mode_function(self.channel, code, words, offset)
        elif code in (83, 84):
            words.used |= set(words.block.named)
        elif code in SETTINGS:
            SETTINGS[code](self, words, offset)
        elif code != 940:
            frame_function(self.channel, code, offset, words)
        return []

    def _function_with_rows(
        self, code: int, offset: int, words: Words
    ) -> list[Row | Wait]:
        """Functions that put something out by themselves."""
        rows: list[Row | Wait] = []
        if code in (40, 41, 42):
            if code != 40 and not self._has_tool():
                raise fail(
                    906007,
                    f"G{code}: {ERRORS[906007]}: program T or D before",
                    offset,
                )
            rows += self.channel.output.compensate(
                code,
                self._radius(),
                self.channel.plane_code,
                words.block.n,
                offset,
            )
        elif code in DIRECT:
            rows += DIRECT[code](self.channel, words, offset)
        elif code in (103, 104, 105):
            rows += tip_function(self.channel, code, words, offset)
        elif code in (10, 11):
            rows += override(self.channel, code == 10, words.block.n)
        elif code == 62:
            self.channel.not_compensated("G62", offset)
            rows += [*self.channel.output.flush(), Wait.DRAINED]
        elif code in (4, 80):
            rows += (
                self._dwell(words, offset) if code == 4 else self._pause(words)
            )
        else:
            rows += self.channel.output.flush()
            plane_function(self.channel, code, offset, words)
        return rows

    def _mode(self, code: int, offset: int) -> None:
        if code == self.channel.modal.motion:
            return
        if code in codes.MOTIONS:
            self.channel.modal.apply(MotionWords(motion=code))
        elif code in (90, 91):
            self.channel.modal.set_absolute(code == 90)
        elif code in UNITS:
            self.channel.modal.apply(MotionWords(inch=code == 20))
        elif code in (60, 61):
            self.channel.modal.apply(MotionWords(exact_stop=code == 61))
            self.channel.modes_changed = True

    def _has_tool(self) -> bool:
        return self.channel.diameter is not None or self.channel.tool != 0

    def _radius(self) -> float:
        diameter = (
            self.channel.table[0]
            if self.channel.diameter is None
            else self.channel.diameter
        )
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
        return self.channel.emit(
            self.channel.modal.row(DWELL, words.block.n, value=seconds)
        )

    def _pause(self, words: Words) -> list[Row]:
        code = words.take("X")
        self._port.message(
            self.channel.cell.pauses.get(code, "NO CODE PAUSE")
            if code is not None
            else "NO CODE PAUSE"
        )
        return self.channel.emit(
            self.channel.modal.row(M, words.block.n, code=0, flags=STANDSTILL)
        )

    def _rotary_mode(self, words: Words, offset: int) -> None:
        mode = words.take("X")
        axes = self.channel.named_axes(words)
        if mode is None or mode not in range(ROTARY_MODES):
            raise fail(900012, "G36: X0..X4 is expected", offset)
        for axis in axes:
            if not self.channel.machine.rotary[axis]:
                raise fail(
                    909113,
                    f"G36: {self.channel.machine.axes[axis]} is not a rotary axis",
                    offset,
                )
            self.channel.rotary_modes[axis] = int(mode)
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
            self.channel.output.limits.choose(
                self.channel.axis(letter, offset), int(mode)
            )
        self.channel.output.refresh(limits=not self.channel.tip.on)

    def _corner(self, code: int, words: Words) -> None:
        corners = self.channel.output.corners
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
                corner.size
                if size is None
                else size * self.channel.modal.unit_mm
            )
            corner.angle = corner.angle if angle is None else angle
        corner.on = True
        other.on = other.on and not corner.active

    def _entry(self, words: Words, offset: int) -> None:
        mode = words.take("X")
        if mode not in (0.0, 1.0):
            raise fail(900012, "G47: X0 or X1 is expected", offset)

    # M functions

    def _functions_m(self, words: Words, behind: bool) -> list[Row]:
        rows: list[Row] = []
        for number, offset, stands_behind in words.block.m:
            if stands_behind != behind or self._macro("M", number):
                continue
            if number in PROGRAM_ENDS:
                self.ended = True
            elif number not in self.channel.machine.m_functions:
                text = (
                    f"M{number}: no macro of this number, and the cell has "
                    "no such M function (m_synch)"
                )
                raise fail(900009, text, offset)
            rows += self.channel.emit(
                self.channel.modal.row(
                    M, words.block.n, code=number, flags=STANDSTILL
                )
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


MODES = frozenset({*codes.MOTIONS, 90, 91, *UNITS, 60, 61})
Function = Callable[[ChannelState, Words, int], list[Row | Wait]]
DIRECT: dict[int, Function] = {
    71: home,
    100: command,
    101: lambda channel, words, offset: stop(channel, offset),
    102: probe,
}
SETTINGS: dict[int, Callable[[Executor, Words, int], None]] = {
    36: Executor._rotary_mode,
    81: Executor._limit,
    47: Executor._entry,
}
TRANSFORMS = frozenset({120, 121, *range(22, 29), 50, 51, 52, 1051, 1050})
