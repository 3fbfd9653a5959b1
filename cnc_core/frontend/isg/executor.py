"""Words of one block to rows, in the order of execution."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from cnc_core.blocks import (
    DWELL,
    FLUSH,
    HAS_VALUE,
    NO_OVERRIDE,
    RAPID,
    SOFT_LIMITS,
    STANDSTILL,
    H,
    M,
    S,
    T,
    motion_planes,
)
from cnc_core.errors import ERRORS

from ..base.compensation import Compensation
from ..base.lexer import fail
from ..base.scanner import NO_CORRECTION, MotionWords, Row
from ..machine import Tool
from .commands.corner import CornerWords
from .commands.spline import Splines, refused_with_compensation
from .cycles.registry import find
from .language import gcodes
from .language.calls import Call, positional
from .language.words import Function, WordBlock, Words
from .state.contouring import Contouring, Smooth
from .state.dynamics import WEIGHTS, Dynamics
from .state.feeds import Feeds
from .state.measuring import place_functions
from .state.spaces import Rotation
from .state.state import Context
from .state.turning import RIGID, Turning

DWELL_MAX_S = 1e6
STOPS = (0, 1)
PROGRAM_ENDS = (2, 30)
SUBPROGRAM_ENDS = (17, 29)  # in the main program they end it
AT_END = STOPS + PROGRAM_ENDS + SUBPROGRAM_ENDS
DWELL_WORDS = frozenset({"N", "S", "G motion"})


class Executor:
    """State of the channel beyond the modal state of the motions: spindle,
    tool, offsets, feed mode.

    Behind ``execute``: ``program_end`` and ``level_end`` say what the block
    ends, ``calls`` what it calls.
    """

    def __init__(self, context: Context) -> None:
        self._context = context
        self._machine, self._modal, self._offsets = (
            context.machine,
            context.modal,
            context.offsets,
        )
        self.feeds: Feeds = Feeds(context.machine, context.modal)
        self.turning = Turning(context.machine, context.modal)
        self.turning.diameter = self._diameter
        self.dynamics = Dynamics(
            context.modal, len(context.machine.axes), context.warn
        )
        self.contouring = Contouring(context.modal, context.offsets)
        self.smooth = Smooth(context.modal)
        self.splines = Splines(context.modal)
        self.corner_words = CornerWords(context.modal)
        # lowest, highest, (axes,); None: the machine's
        self.soft_limits: tuple[Any, Any] | None = None
        self._due_limits: list[Row] = []
        self.corner_param = False  # #CORNER PARAM has been given
        self.tool: int = 0
        self.data: int = 0
        self.tool_data = Tool()
        self.compensation: Compensation = Compensation(context.modal)
        self.stored: dict[str, float] = {}
        self._mentioned: set[str] = set()
        self.program_end = self.level_end = False
        self.calls: list[Call] = []

    def execute(self, block: WordBlock) -> list[Row]:
        """Rows of one block."""
        words = block.evaluate()
        spaces = self._context.spaces
        due = (
            self._coordinates(words)
            if spaces.due or spaces.watches_plane
            else []
        )
        if block.simple and self.plain and not self.compensation.choice.active:
            return due + self._plain_motion(words) if block.words else due
        self.program_end = self.level_end = False
        self.calls = []
        if words.is_dwell:
            return [*due, self._dwell(words)]
        self._check(words)
        words = self._turning_words(self._non_motions(words))
        before = due + self._switch_rows(words)
        before += self._coordinate_rows(words.motion.n)
        plane = words.motion.plane or self._modal.plane
        before += self.compensation.update(
            words.codes, self._radius(plane), plane, words.motion.n
        )
        words, corner = self._corner_row(words)
        ahead, behind = self._contour_rows(words)
        for name in ("G150", "G151"):
            if name in words.codes:
                ahead += self.switch_spline(
                    name == "G151", words.motion.n, words.codes[name]
                )
        if self.splines.active and self.compensation.choice.active:
            raise refused_with_compensation(0)
        start = self._modal.position
        before, driven = place_functions(
            before, self._motion(words), start, self._machine
        )
        motion = ahead + driven + behind + corner
        self.compensation.settle()
        if "G61" in words.codes:
            self.contouring.last_once = self._modal.position
        after = self._end_rows(words)
        numbers = [f.number for f in words.functions["M"]]
        self.program_end = any(n in PROGRAM_ENDS for n in numbers)
        self.level_end = any(n in SUBPROGRAM_ENDS for n in numbers)
        self._calls(words)
        return before + motion + after

    @property
    def plain(self) -> bool:
        """The scanner knows what plain motion lines mean."""
        return self.feeds.plain and self.turning.plain

    @property
    def spindle_rev_min(self) -> float:
        """Speed of the spindle as the program wants it."""
        return self.turning.rev_min

    def _diameter(self) -> float:
        """mm, programmed at the first main axis."""
        axis = self._machine.main[0]
        if axis < 0:
            return 0.0
        return 2.0 * abs(
            float(
                self._modal.position[axis] - self._modal.offset_in_force[axis]
            )
        )

    def _turning_words(self, words: Words) -> Words:
        functions = {f.number for f in words.functions["M"]}
        for name in ("G33", "G96"):
            if name in words.codes and self.smooth.hsc is not None:
                raise fail(
                    120433, f"{ERRORS[120433]}: {name}", words.codes[name]
                )
        motion = self.turning.take(
            words.codes, words.motion, functions, self.feeds.mode, words.spindle
        )
        return replace(words, motion=motion)

    def stored_without_effect(self, name: str, offset: int) -> None:
        """Say once that something is only kept."""
        if name not in self._mentioned:
            self._mentioned.add(name)
            self._context.warn(
                907042,
                f"{name} is stored, it has no effect on the motion",
                offset,
            )

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
        rows = self.corner_words.g(
            code, motion.centre.get("I"), motion.n, offset
        )
        return replace(words, motion=replace(motion, centre={})), rows

    def switch_spline(self, on: bool, n: int, offset: int) -> list[Row]:
        """G150, G151, #SPLINE."""
        if on and self.compensation.choice.active:
            raise refused_with_compensation(offset)
        return self.splines.switch(on, n)

    def check_contouring(self, on: bool, offset: int) -> None:
        """G61 and G261 do not go together with #HSC."""
        if on and self.smooth.hsc is not None:
            raise fail(120433, f"{ERRORS[120433]}: G61, G261", offset)

    def check_hsc(self, offset: int) -> None:
        """#HSC does not go together with G261, G95, G96."""
        active = [f"G{self.feeds.mode}"] if self.feeds.mode == 95 else []
        if self.contouring.active or active:
            raise fail(
                120433,
                f"{ERRORS[120433]}: {(active or ['G261'])[0]} is active",
                offset,
            )

    def not_compensated(self, name: str, offset: int) -> None:
        if self.compensation.choice.active:
            raise fail(906003, f"{name}: {ERRORS[906003]}", offset)

    def change_tool(self, radius: bool, value_mm: float) -> None:
        """V.G.WZ_AKT.R and .L."""
        self.tool_data = (
            replace(self.tool_data, radius_mm=value_mm)
            if radius
            else replace(self.tool_data, length_mm=value_mm)
        )
        self._offsets.set_tool_length(self.tool_data.length_mm)

    def rotation_in_cycle(self, offset: int) -> None:
        """Cycles expect coordinate systems that are made with #CS."""
        levels = self._context.store.arguments
        if (
            self._context.spaces.rotation is not None
            and levels[-1] is not levels[0]
        ):
            self._context.warn(910111, ERRORS[910111], offset)

    def _coordinates(self, words: Words) -> list[Row]:
        """What the assignments of the block, or a new plane, change in the
        coordinates.
        """
        spaces, plane = self._context.spaces, words.motion.plane
        if (
            spaces.watches_plane
            and plane is not None
            and plane != self._modal.plane
        ):
            if self.compensation.choice.active:
                raise fail(20133, ERRORS[20133], words.motion.offset or 0)
            self._modal.apply(MotionWords(plane=plane))
            if spaces.rotation is not None:
                self._context.warn(
                    910110, ERRORS[910110], words.motion.offset or 0
                )
                spaces.set_rotation(None)
            spaces.touch()
        return self._coordinate_rows(words.motion.n) if spaces.due else []

    def _coordinate_rows(self, n: int) -> list[Row]:
        rows = self._context.spaces.rows(n)
        if rows and self.compensation.choice.active:
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
        if not self._context.lenient:
            raise fail(900009, text, function.offset)
        self._context.warn(907041, text, function.offset)

    def _m6(self) -> str:
        return self._context.programs.get("M6", self._machine.m6_program)

    def _radius(self, plane: int) -> float:
        """Of the tool; negative swaps the side, as mirroring one axis of the
        plane does.
        """
        sign = 1.0
        for place in motion_planes(plane)[:2]:
            axis = self._machine.main[place]
            sign *= 1.0 if axis < 0 else float(self._offsets.mirror[axis])
        return self.tool_data.radius_mm * sign

    # functions that move nothing

    def _non_motions(self, words: Words) -> Words:
        """Offsets, mirroring, diameter, feed modes; the words that are left for
        the motion.
        """
        codes = words.codes
        if not codes:
            return self._feed_word(words)
        takers = [code for code in gcodes.AXIS_TAKERS if f"G{code}" in codes]
        if len(takers) > 1:
            raise fail(908005, ERRORS[908005], codes[f"G{takers[1]}"])
        if words.motion.absolute is not None or words.motion.inch is not None:
            self._select_first(words)
        self._modes(words)
        self._selections(words)
        self._weights(words)
        if takers:
            words = self._take_axes(takers[0], words)
        self._stored_codes(words)
        return self._feed_word(words)

    def _select_first(self, words: Words) -> None:
        """G90, G91, G70, G71 count for everything in their block."""
        self._modal.apply(
            MotionWords(absolute=words.motion.absolute, inch=words.motion.inch)
        )

    def _modes(self, words: Words) -> None:
        for mode in gcodes.FEED_MODES:
            if f"G{mode}" in words.codes:
                if mode == 95 and self.smooth.hsc is not None:
                    raise fail(
                        120433, f"{ERRORS[120433]}: G95", words.codes["G95"]
                    )
                self.feeds.choose(mode)
        if "G51" in words.codes or "G52" in words.codes:
            self._offsets.diameter = "G51" in words.codes
            self._offsets.update()
        if "G69" in words.codes and self._context.spaces.rotation is not None:
            self.not_compensated("G69", words.codes["G69"])
            self._context.spaces.set_rotation(None)
        if "G164" in words.codes or "G165" in words.codes:
            self._modal.set_rule(NO_CORRECTION, "G164" in words.codes)

    def _selections(self, words: Words) -> None:
        """Zero offsets and mirroring."""
        codes = words.codes
        for code in range(53, 60):
            if f"G{code}" in codes:
                self._zero_offset(code - 53, codes[f"G{code}"])
        if 159 in words.values:
            self._zero_offset(round(words.values[159]), codes["G159"])
        for code, (x, y) in gcodes.MIRRORS.items():
            if f"G{code}" in codes and (x, y) != self._signs():
                self.not_compensated(f"G{code}", codes[f"G{code}"])
                self._offsets.set_mirror(x, y)

    def _signs(self) -> tuple[float, float]:
        signs = [
            1.0 if axis < 0 else float(self._offsets.mirror[axis])
            for axis in self._machine.main[:2]
        ]
        return signs[0], signs[1]

    def _zero_offset(self, number: int, offset: int) -> None:
        self._offsets.check_number(number, offset)
        if number != self._offsets.number:
            self.not_compensated("a change of the zero offset", offset)
        self._offsets.select(number)

    def _take_axes(self, code: int, words: Words) -> Words:
        offset, axes = words.codes[f"G{code}"], words.motion.axis
        if code == 92:
            self.not_compensated("G92", offset)
            self._offsets.set_g92(axes, add=not self._modal.absolute)
        elif code == 68:
            return self._rotate(words, offset)
        elif code == 160:
            self._exclude(words, offset)
        elif code == 351:
            self._mirror_axes(axes, offset)
        elif code in gcodes.SOFT_LIMITS:
            self._soft_limits(code, axes, offset)
        elif code in WEIGHTS and not axes:
            raise fail(900004, f"G{code} without axis words", offset)
        elif code in WEIGHTS:
            self.dynamics.weigh(code, axes, offset)
        elif code != 74:
            for axis, value in axes.items():
                self.stored[f"G{code} {self._offsets.names[axis]}"] = value
        elif not axes:
            raise fail(900004, "G74 without axis words", offset)
        return replace(words, motion=replace(words.motion, axis={}))

    def _rotate(self, words: Words, offset: int) -> Words:
        """G68 R30 X10 Y5: contour rotation about a point of the plane, the
        present one where no word names it.
        """
        self.not_compensated("G68", offset)
        modal, axes = self._modal, words.motion.axis
        plane = words.motion.plane or modal.plane
        first, second, third = (
            self._machine.main[place] for place in motion_planes(plane)
        )
        if third in axes:
            raise fail(22156, ERRORS[22156], offset)
        if set(axes) - {first, second} or min(first, second) < 0:
            raise fail(
                900010,
                "G68: only words of the plane's axes name the centre",
                offset,
            )
        self._context.spaces.set_rotation(None)
        self._context.spaces.touch()
        present = self._context.spaces.position_in(
            self._context.spaces.wanted(), self._context.spaces.axes()
        )
        total = self._offsets.selected_total()
        centre = [
            axes[a] * modal.unit_mm
            if a in axes
            else float(present[a] - total[a])
            for a in (first, second)
        ]
        rotation = Rotation(
            plane, words.motion.r or 0.0, (centre[0], centre[1])
        )
        self._context.spaces.set_rotation(rotation)
        self.rotation_in_cycle(offset)
        return replace(words, motion=replace(words.motion, axis={}, r=None))

    def _soft_limits(
        self, code: int, axes: dict[int, float], offset: int
    ) -> None:
        """G98, G99: lowest and highest position of axes, machine coordinates,
        within the machine's own range.
        """
        if not axes:
            raise fail(900004, f"G{code} without axis words", offset)
        side = code - 98
        wide = np.full(len(self._offsets.names), 1e9)
        machine = self._machine.limits or (-wide, wide)
        if self.soft_limits is None:
            self.soft_limits = machine[0].copy(), machine[1].copy()
        for axis, word in axes.items():
            own = float(machine[side][axis])
            value = word * self._offsets.scale(axis) + (
                0.0 if self._modal.absolute else own
            )
            if (own - value) * (1, -1)[side] > 0:
                self._context.warn(
                    21648,
                    f"G{code} {self._offsets.names[axis]}{word:g}: {ERRORS[21648]}",
                    offset,
                )
                value = own
            self.soft_limits[side][axis] = value
            if self.soft_limits[0][axis] >= self.soft_limits[1][axis]:
                raise fail(
                    21649,
                    f"G{code} {self._offsets.names[axis]}{word:g}: {ERRORS[21649]}",
                    offset,
                )
        row = self._modal.row(SOFT_LIMITS, 0, code=code)
        row["end"] = np.nan
        row["end"][0][: len(self._offsets.names)] = self.soft_limits[side]
        self._due_limits.append(row)

    def _exclude(self, words: Words, offset: int) -> None:
        if 160 not in words.values:
            raise fail(900004, "G160 without =number", offset)
        number = round(words.values[160])
        self._offsets.check_number(number, offset)
        for axis, value in words.motion.axis.items():
            if value not in (0.0, 1.0):
                raise fail(
                    900012,
                    f"G160 {self._offsets.names[axis]}{value:g}: 0 or 1 is expected",
                    offset,
                )
        self._offsets.exclude(
            number,
            {axis: value == 1.0 for axis, value in words.motion.axis.items()},
        )

    def _mirror_axes(self, axes: dict[int, float], offset: int) -> None:
        if any(value not in (1.0, -1.0) for value in axes.values()):
            raise fail(20860, ERRORS[20860], offset)
        self.not_compensated("G351", offset)
        for axis, value in axes.items():
            self._offsets.mirror[axis] = value
        self._offsets.update()

    def _weights(self, words: Words) -> None:
        """G128=, G131= ..: one weight for all axes."""
        for code, value in words.values.items():
            if code in WEIGHTS:
                every = dict.fromkeys(range(len(self._machine.axes)), value)
                self.dynamics.weigh(code, every, words.codes[f"G{code}"])

    def _contour_rows(self, words: Words) -> tuple[list[Row], list[Row]]:
        """What G61, G260, G261 and G360 say to the stage: ahead of the motion,
        and behind it.
        """
        codes, n = words.codes, words.motion.n
        for name in ("G61", "G261"):
            if name in codes:
                self.check_contouring(True, codes[name])
        if "G61" in codes:
            return self.contouring.once(n)
        if "G260" in codes or "G360" in codes:
            return self.contouring.switch(False, n), []
        return (self.contouring.switch(True, n) if "G261" in codes else []), []

    def _stored_codes(self, words: Words) -> None:
        if not 0 <= words.values.get(115, 0) <= 14:
            raise fail(20151, ERRORS[20151], words.codes["G115"])
        if "G13" in words.codes and not self.corner_param:
            raise fail(20795, ERRORS[20795], words.codes["G13"])
        for name, offset in words.codes.items():
            code = int(name[1:])
            if code in gcodes.STORED:
                self.stored[name] = words.values.get(code, 1.0)
                self.stored_without_effect(name, offset)

    def _feed_word(self, words: Words) -> Words:
        if self.feeds.per_minute or words.motion.f is None:
            return words
        self.feeds.word(words.motion.f, words.offsets["F"])
        return replace(words, motion=replace(words.motion, f=None))

    # rows

    def _switch_rows(self, words: Words) -> list[Row]:
        """Limits, S, T, D and the M and H functions that stand before the motion."""
        n = words.motion.n
        rows = self.dynamics.rows(n)
        speed = self.turning.speed(
            words.codes, words.spindle, words.offsets.get("S", 0)
        )
        if speed is not None:
            rows.append(self._modal.row(S, n, value=speed))
        if words.tool is not None:
            self.tool = words.tool
            rows.append(self._modal.row(T, n, code=words.tool))
        if words.data is not None:
            self._select_tool_data(words.data)
        rows += self._due_limits
        self._due_limits = []
        if "G74" in words.codes:
            rows.append(self._modal.row(FLUSH, n, flags=STANDSTILL))
            self.stored_without_effect(
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
        self.data = number
        self.tool_data = self._machine.tools[number] if number else Tool()
        self._context.spaces.tool_kinematic(self.tool_data.kin_id, 0)
        self._offsets.set_tool_length(self.tool_data.length_mm)

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
        start = None if self.plain else self._modal.position
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
            row["feed"] /= self.feeds.factor
        return made

    def _applied(self, motion: MotionWords) -> tuple[int, Row | None]:
        """The motion; threads need no F."""
        feed, fed = self._modal.feed, self.turning.mode in (0, RIGID)
        if not fed and motion.f is None and feed <= 0:
            self._modal.assume_feed()
        error, row = self._modal.apply(motion)
        if not fed and motion.f is None:
            self._modal.feed = feed
        return error, row

    def _with_feed(self, row: Row, start: Any, offset: int) -> list[Row]:
        """A motion whose feed, or whose spindle speed, the scanner does not know."""
        changed = not row["flags"][0] & RAPID and self.turning.follow()
        self.feeds.apply(row, start, self.spindle_rev_min, offset)
        self.turning.apply(row, start, offset)
        return (
            [
                self._modal.row(
                    S, int(row["n"][0]), value=self.spindle_rev_min
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
            program = self._context.programs.get(
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
        if cycles and self._context.spaces.rotation is not None:
            self._context.warn(910111, ERRORS[910111], cycles[0].offset)
        if len(self.calls) > 1:
            raise fail(
                900011,
                "more than one subprogram call in a block",
                self.calls[1].offset,
            )

    # dwell

    def _dwell(self, words: Words) -> Row:
        self._check_alone(words)
        seconds = self._dwell_seconds(words)
        if not 0 <= seconds <= DWELL_MAX_S:
            raise fail(
                20752,
                f"G04: {seconds:g} s out of range 0..{DWELL_MAX_S:g} s",
                words.codes["G4"],
            )
        return self._modal.row(DWELL, words.motion.n, value=seconds)

    def _check_alone(self, words: Words) -> None:
        names = {self._machine.axes[i].upper() for i in words.motion.axis}
        for name, offset in words.offsets.items():
            if name not in DWELL_WORDS and name not in names:
                raise fail(
                    900018,
                    f"{ERRORS[900018]}: {name.removeprefix('G ')}",
                    offset,
                )

    def _dwell_seconds(self, words: Words) -> float:
        axes, offset = words.motion.axis, words.codes["G4"]
        given = [
            v
            for v in (words.dwell, *axes.values(), words.spindle)
            if v is not None
        ]
        if words.dwell is not None and axes:
            raise fail(20013, ERRORS[20013], offset)
        if any(axis != self._machine.main[0] for axis in axes):
            raise fail(20014, ERRORS[20014], offset)
        if len(given) != 1:
            raise fail(
                900004,
                "G04 takes one time or a number of spindle turns",
                offset,
            )
        if words.spindle is None:
            return given[0]
        if self.spindle_rev_min <= 0:
            raise fail(900019, "G04 S: no spindle speed is programmed", offset)
        return words.spindle * 60.0 / self.spindle_rev_min
