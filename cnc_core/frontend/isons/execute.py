"""Words of one block to rows."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from cnc_core.blocks import DWELL, STANDSTILL, M, S, T
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, MotionWords, Row
from cnc_core.frontend.isons import codes
from cnc_core.frontend.isons.clock import Clock
from cnc_core.frontend.isons.direct import command, home, override, probe, stop
from cnc_core.frontend.isons.frame import Frame, Layer, check_slot
from cnc_core.frontend.isons.mode_words import mode_function
from cnc_core.frontend.isons.output import Output
from cnc_core.frontend.isons.parameters import Parameters
from cnc_core.frontend.isons.path_modes import PathModes
from cnc_core.frontend.isons.rotary import target_of
from cnc_core.frontend.isons.text import AXIS_LETTERS
from cnc_core.frontend.isons.tip import Tip
from cnc_core.frontend.isons.transform import Rotation, Scaling, Transform
from cnc_core.frontend.isons.words import WordBlock
from cnc_core.frontend.isons_cell import IsonsCell, ToolTable
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.port import ChannelPort, Wait

Array = npt.NDArray[np.float64]
Items = Sequence[Row | Wait]
DWELL_MAX_S = 1e6
PROGRAM_ENDS = (2, 30)
FIXED_ORIGINS = {55: "Y", 56: "Z", 57: "XY", 58: "YZ", 59: "XZ"}
PLANE_AXES = {17: ("X", "Y"), 18: ("Z", "X"), 19: ("Y", "Z")}
ROTARY_MODES = 5


@dataclass
class Words:
    """A block's words with their values.  ``used``: words that a function has taken."""

    block: WordBlock
    values: dict[str, float]
    indices: dict[int, float]
    used: set[str] = field(default_factory=set)

    @property
    def codes(self) -> dict[int, int]:
        """Offset by G function."""
        return {code: offset for code, offset, _ in self.block.g}

    def offset(self, name: str) -> int:
        return self.block.offsets.get(name, 0)

    def take(self, name: str) -> float | None:
        self.used.add(name)
        return self.values.get(name)


class Executor:
    """State of the channel beyond the modal state of the motions.

    Behind ``execute``: ``ended``, and ``calls`` with (M or HM, number, offset, arguments) of macros to call.
    ``macro``: whether a PC macro of this number exists.
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
        self.machine, self.modal, self._port, self.cell = machine, modal, port, cell
        self.parameters, self._clock, self.warn, self._macro = parameters, clock, warn, macro
        self.axes = {name.upper(): i for i, name in enumerate(machine.axes) if len(name) == 1}
        self.frame = Frame(machine, modal, cell)
        self.transform = Transform(len(machine.axes))
        self.output = Output(machine, modal, parameters)
        self.tip = Tip(self)
        self.modes, self.modes_changed = PathModes(machine.axes, modal, parameters), True
        self.rotary_modes: dict[int, int] = {}
        self.plane_pair, self.plane_code, self.plane_reversed = (0, 1), 17, False
        self._set_plane("X", "Y", 0)
        self.spindle = parameters["SPEEDDEF"]
        self.tool = 0
        self.tables: dict[int, list[float]] = {}
        self.diameter: float | None = None
        self.pause_mode = 0
        self.depth_axis: int | None = None
        self.ended = False
        self.stopping = False  # the axes are being stopped where they are (G101)
        self.failure: CncError | None = None  # what ends the program behind the rows of the block
        self.homed: set[int] = set()
        self.tool_instead: int | None = None  # of the next T (RESUME_T)
        self.counter: Array | None = None  # what $_C tells while a restart leads there
        self.completed = False  # the program has come to its end
        self.calls: list[tuple[str, int, int, list[float]]] = []
        self.positioner_offset: Callable[[float, float, bool, int], None] = lambda *_: None
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
        """Value of a machine parameter; what is not given but has a key of the cell, as the cell has it."""
        what, _, letter = name.rpartition("_")
        axis = self.axes.get(letter)
        if self.parameters.given(name) or axis is None:
            return self.parameters[name]
        if what == "VMAX" and self.machine.velocity is not None:
            return float(self.machine.velocity[axis]) * 60.0 / self.parameters.speed_unit
        if what in ("LIMITE_N", "LIMITE_P"):
            limits = self.output.limits.low if what == "LIMITE_N" else self.output.limits.high
            return float(limits[axis]) * 1000.0
        return self.parameters[name]

    def follow_scanner(self) -> None:
        """Plain lines may have changed the plane."""
        if self.plane_code and self.plane_code != self.modal.plane:
            self._set_plane(*PLANE_AXES[self.modal.plane], 0)
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
        """Of the selected tool: diameter, length, largest speed, 17 values of the user."""
        if self.tool not in self.tables:
            given = self.cell.tools.get(self.tool)
            tool = self.machine.tools.get(self.tool)
            if given is None:
                given = ToolTable(2.0 * tool.radius_mm, tool.length_mm) if tool else ToolTable()
            self.tables[self.tool] = given.values()
        return self.tables[self.tool]

    # one block

    def execute(self, block: WordBlock) -> list[Row | Wait]:
        values = {name: value() for name, value in block.values.items()}
        words = Words(block, values, {code: index() for code, _, index in block.g if index})
        self.follow_scanner()
        self.output.follow(self.modal)
        self.ended, self.calls = False, []
        if block.n:
            self.modal.n = block.n
        items: list[Row | Wait] = []
        items += self._selections(words)
        for code, offset, _ in block.g:
            items += self._function(code, offset, words)
        self._origin_words(words)
        if self.modes_changed:
            items += self.mode_rows(block.n)
        items += self._functions_m(words, behind=False)
        items += self._motion(words)
        items += self._functions_m(words, behind=True)
        self._check_used(words)
        self._calls(words)
        return items

    def mode_rows(self, n: int) -> list[Row]:
        """What has changed of modes and filters."""
        self.modes_changed = False
        return [out for row in self.modes.rows(self.plane_pair, self.depth_axis, n) for out in self.emit(row)]

    def emit(self, row: Row) -> list[Row]:
        return self.output.push(row)

    def _check_used(self, words: Words) -> None:
        for name, offset in words.block.offsets.items():
            if name not in words.used:
                raise fail(908001, f"no function of the block uses {name}", offset)
        for name, offset in words.block.named.items():
            if name not in words.used:
                raise fail(900004, f"{name} without a value", offset)

    # words that select

    def _selections(self, words: Words) -> list[Row]:
        rows: list[Row] = []
        for name, layer in (("USER_ZERO", self.frame.origin), ("USER_OFFSET", self.frame.offset)):
            number = words.take(name)
            if number is not None:
                self.not_compensated(name, words.offset(name))
                layer.select(check_slot(name, number, words.offset(name)))
                self.frame.update()
        head = words.take("H")
        if head is not None:
            self.not_compensated("H", words.offset("H"))
            self.frame.select_head(check_slot("H", head, words.offset("H")), words.offset("H"))
        mode = words.take("PAUSE_MODE")
        if mode is not None:
            if mode not in range(5):
                raise fail(900012, f"PAUSE_MODE {mode:g} is not 0..4", words.offset("PAUSE_MODE"))
            self.pause_mode = int(mode)
        if "F" in words.values and 4 not in words.codes:
            self._feed(words)
        rows += self._tool(words)
        return rows + self._speed(words)

    def _feed(self, words: Words) -> None:
        feed = words.take("F") or 0.0
        if feed <= 0:
            raise fail(900006, f"F{feed:g}: {ERRORS[900006]}", words.offset("F"))
        error, _ = self.modal.apply(MotionWords(f=feed))
        if error:
            raise fail(error, ERRORS[error], words.offset("F"))
        self.modes_changed = self.modes_changed or self.modes.mild_on

    def _tool(self, words: Words) -> list[Row]:
        rows = []
        number = words.take("T")
        if number is not None:
            number, self.tool_instead = number if self.tool_instead is None else self.tool_instead, None
            self.check_tool(number, words.offset("T"))
            self.not_compensated("T", words.offset("T"))
            self.tool, self.diameter = int(number), None
            rows += self.emit(self.modal.row(T, words.block.n, code=self.tool))
        diameter = words.take("D")
        if diameter is not None:
            self.not_compensated("D", words.offset("D"))
            if diameter < 0:
                raise fail(900012, f"D{diameter:g} is negative", words.offset("D"))
            self.diameter = diameter * self.modal.unit_mm
        return rows

    def check_tool(self, number: float, offset: int) -> None:
        """A tool of the machine, or 0."""
        known = {**self.cell.tools, **self.machine.tools}
        if number != int(number) or number < 0 or (number and known and number not in known):
            raise fail(900014, f"T{number:g}: the machine has no such tool", offset)
        if number and not known and not self._without_tools_told:
            self._without_tools_told = True
            self.warn(907042, f"T{number:g}: the machine has no tool table, diameter and length are 0", offset)

    _without_tools_told = False

    def _speed(self, words: Words) -> list[Row]:
        speed = words.take("S")
        if speed is None:
            return []
        if speed < 0:
            raise fail(900012, f"S{speed:g} is negative", words.offset("S"))
        highest = self.parameters["SPEEDMAX"]
        speed = max(speed, self.parameters["SPEEDMIN"])
        self.spindle = min(speed, highest) if highest else speed
        if self.parameters["WR_SPD"]:
            self.speed_copied(self.spindle)
        return self.emit(self.modal.row(S, words.block.n, value=self.spindle))

    def not_compensated(self, name: str, offset: int) -> None:
        if self.output.side != 40:
            raise fail(906003, f"{name}: {ERRORS[906003]}", offset)

    # axes of a function

    def axis(self, letter: str, offset: int) -> int:
        if letter not in self.axes:
            raise fail(900001, f"the machine has no axis {letter}", offset)
        return self.axes[letter]

    def _scale(self, axis: int) -> float:
        """mm or degrees per programmed unit."""
        return 1.0 if self.machine.rotary[axis] else self.modal.unit_mm

    def named_axes(self, words: Words) -> list[int]:
        """Axes that are named without values."""
        words.used |= set(words.block.named)
        return [self.axis(letter, offset) for letter, offset in words.block.named.items()]

    def _given(self, words: Words, current: Array) -> dict[int, float]:
        """Values of X .. W, and of DX .. DW beside ``current``, mm or degrees by axis."""
        found = {}
        for letter in AXIS_LETTERS:
            for name in (letter, "D" + letter):
                value = words.take(name)
                if value is not None:
                    axis = self.axis(letter, words.offset(name))
                    found[axis] = value * self._scale(axis) + (current[axis] if name != letter else 0.0)
        return found

    # G functions

    def _function(self, code: int, offset: int, words: Words) -> list[Row | Wait]:
        if code in codes.ROWS:
            return self._function_with_rows(code, offset, words)
        if code in MODES:
            self._mode(code, offset)
        elif code in TRANSFORMS:
            self._transform(code, offset, words)
        elif code in (30, 31, 32, 33, 34, 35):
            self._corner(code, words)
        elif code in codes.PATH_FUNCTIONS:
            mode_function(self, code, words, offset)
        elif code in (83, 84):
            words.used |= set(words.block.named)
        elif code in SETTINGS:
            SETTINGS[code](self, words, offset)
        elif code != 940:
            self._frame(code, offset, words)
        return []

    def _function_with_rows(self, code: int, offset: int, words: Words) -> list[Row | Wait]:
        """Functions that put something out by themselves."""
        rows: list[Row | Wait] = []
        if code in (40, 41, 42):
            rows += self.output.compensate(code, self._radius(), self.plane_code, words.block.n, offset)
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
            rows += self._dwell(words, offset) if code == 4 else self._pause(words)
        else:
            rows += self.output.flush()
            self._plane(code, offset, words)
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
            raise fail(900012, f"G4: F with seconds 0..{DWELL_MAX_S:g} is expected", offset)
        self._clock.passes(seconds)
        return self.emit(self.modal.row(DWELL, words.block.n, value=seconds))

    def _pause(self, words: Words) -> list[Row]:
        code = words.take("X")
        self._port.message("NO CODE PAUSE" if code is None else f"PAUSE {code:g}")
        return self.emit(self.modal.row(M, words.block.n, code=0, flags=STANDSTILL))

    def _rotary_mode(self, words: Words, offset: int) -> None:
        mode = words.take("X")
        axes = self.named_axes(words)
        if mode is None or mode not in range(ROTARY_MODES):
            raise fail(900012, "G36: X0..X4 is expected", offset)
        for axis in axes:
            if not self.machine.rotary[axis]:
                raise fail(909113, f"G36: {self.machine.axes[axis]} is not a rotary axis", offset)
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
                    raise fail(900012, f"G{code}: {name}{value:g} is negative", words.offset(name))
            corner.size = corner.size if size is None else size * self.modal.unit_mm
            corner.angle = corner.angle if angle is None else angle
        corner.on = True
        other.on = other.on and not corner.active

    def _entry(self, words: Words, offset: int) -> None:
        mode = words.take("X")
        if mode not in (0.0, 1.0):
            raise fail(900012, "G47: X0 or X1 is expected", offset)

    # planes and transformations

    def _plane(self, code: int, offset: int, words: Words) -> None:
        self.not_compensated(f"G{code}", offset)
        if code == 48:
            self._depth(words, offset)
        elif code == 70:
            letters = list(words.block.named)
            self.named_axes(words)
            if len(letters) != 2:
                raise fail(900004, "G70: two axes are expected", offset)
            self._set_plane(letters[0], letters[1], offset)
        else:
            self._set_plane(*PLANE_AXES[code], offset)
        self.transform.plane = self.plane_pair
        self.transform.rebuild()

    def _depth(self, words: Words, offset: int) -> None:
        axes = self.named_axes(words)
        if len(axes) != 1:
            raise fail(900004, "G48: one axis is expected", offset)
        if axes[0] in self.plane_pair:
            raise fail(909114, f"{ERRORS[909114]} ({self.machine.axes[axes[0]]})", offset)
        self.depth_axis = axes[0]
        self.modes_changed = True

    def _set_plane(self, first: str, second: str, offset: int) -> None:
        if first not in self.axes or second not in self.axes:
            if offset:
                raise fail(900016, ERRORS[900016], offset)
            return
        self.plane_pair = (self.axes[first], self.axes[second])
        self.modes_changed = True
        pairs = {pair: code for code, pair in PLANE_AXES.items()}
        self.plane_reversed = (second, first) in pairs
        self.plane_code = pairs.get((first, second), pairs.get((second, first), 0))
        if self.plane_code:
            self.modal.apply(MotionWords(plane=self.plane_code))
        corners = self.output.corners
        corners.plane, corners.code, corners.reversed = self.plane_pair, self.plane_code, self.plane_reversed

    def _transform(self, code: int, offset: int, words: Words) -> None:
        self.not_compensated(f"G{code}", offset)
        transform = self.transform
        if code in (120, 121, 24, 25):
            axis = self.axis("Y" if code > 100 else "X", offset)
            (transform.mirrored.add if code in (120, 24) else transform.mirrored.discard)(axis)
        elif code in (22, 23):
            transform.plane_swap = self.plane_pair if code == 22 else None
        elif code in (26, 27, 28):
            self._swap(code, offset, words)
        elif code in (50, 51, 52):
            self._rotation(code, words)
        else:
            self._scaling(code, offset, words)
        transform.rebuild()
        similar = transform.similarity(*self.plane_pair)
        self.output.corners.factor = similar[0] if similar else 1.0

    def _swap(self, code: int, offset: int, words: Words) -> None:
        if code == 26:
            axes = self.named_axes(words)
            if len(axes) != 2:
                raise fail(900004, "G26: two axes are expected", offset)
            self.transform.named_swap = (axes[0], axes[1])
        self.transform.named_swap_on = code != 27

    def _rotation(self, code: int, words: Words) -> None:
        rotation = self.transform.rotation
        if code == 50:
            unit = self.modal.unit_mm
            here = self.transform.backward(self.modal.position - self.frame.total)
            values = [rotation.first, rotation.second]
            for i, letter in enumerate("XY"):
                absolute, relative = words.take(letter), words.take("D" + letter)
                if absolute is not None:
                    values[i] = absolute * unit
                elif relative is not None:
                    values[i] = float(here[self.plane_pair[i]]) + relative * unit
            angle = words.take("Z")
            self.transform.rotation = Rotation(values[0], values[1], rotation.degrees if angle is None else angle, True)
        else:
            rotation.on = code == 52

    def _scaling(self, code: int, offset: int, words: Words) -> None:
        scaling = self.transform.scaling
        if code == 1050:
            scaling.on = False
            return
        given = {letter: words.take(letter) for letter in (*AXIS_LETTERS, *"IJKP")}
        if all(value is None for value in given.values()):
            scaling.on = True
            return
        ratio = dict(scaling.ratio)
        centre: dict[int, float] = {}
        program = self.transform.backward(self.modal.position - self.frame.total)
        here = self.transform.before_scaling() @ program
        for letter, word in zip("XYZ", "IJK", strict=True):
            value = given["P"] if given["P"] is not None else given[word]
            axis = self.axes.get(letter)
            if axis is None:
                continue
            if value is not None:
                if value == 0:
                    raise fail(900012, "G1051: a ratio is 0", offset)
                ratio[axis] = value
            at = given[letter]
            centre[axis] = float(here[axis]) if at is None else at * self._scale(axis)
        self.transform.scaling = Scaling(ratio, centre, True)

    # origins, offsets, heads, lengths

    def _frame(self, code: int, offset: int, words: Words) -> None:
        frame = self.frame
        self.not_compensated(f"G{code}", offset)
        if code in (98, 53, 99):
            frame.origin.on = code == 99
        elif code in (96, 97):
            frame.offset.on = code == 97
        elif code in (87, 88):
            frame.head_on = code == 88
        elif code == 94 and "USER_OFFSET" not in words.values:
            frame.origin.store(self._some_given(words, frame.origin.value, code, offset))
        elif code in (93, 94):  # the guide's example of USER_OFFSET has G94
            self._offsets(words, code, offset)
        elif code in (92, 82, 95, 85):
            layer = frame.origin if code in (92, 82) else frame.offset
            frame.set_here(layer, self._some(words, code, offset), code in (82, 85))
        elif code in range(54, 60):
            self._recall(code, offset, words)
        elif code == 89:
            self.frame.preset(self._some_given(words, frame.position_from_home(), code, offset))
        elif code == 86:
            frame.preset_turns(self._rotary_axes(words, offset))
        else:
            self._length(code, offset, words)
        frame.update()

    def _some(self, words: Words, code: int, offset: int) -> list[int]:
        axes = self.named_axes(words)
        if not axes:
            raise fail(900004, f"G{code}: axes are expected", offset)
        return axes

    def _some_given(self, words: Words, current: Array, code: int, offset: int) -> dict[int, float]:
        """As ``_given``, at least one."""
        values = self._given(words, current)
        if not values:
            raise fail(900004, f"G{code}: axes with values are expected", offset)
        return values

    def _offsets(self, words: Words, code: int, offset: int) -> None:
        layer = self.frame.offset
        values = self._given(words, layer.value)
        for letter in AXIS_LETTERS:
            value = words.take("DO" + letter)
            if value is not None:
                axis = self.axis(letter, words.offset("DO" + letter))
                values[axis] = value * self._scale(axis)
        if not values and not words.block.indexed:
            raise fail(900004, f"G{code}: axes with values are expected", offset)
        layer.store(values)
        for name, (number, value_of, place) in words.block.indexed.items():
            words.used.add(name)
            self.positioner_offset(number(), value_of(), name == "DP", place)

    def _recall(self, code: int, offset: int, words: Words) -> None:
        layer: Layer = self.frame.origin
        number = layer.index
        if code == 54:
            axes = self.named_axes(words) or [self.axis("X", offset)]
            if 54 in words.indices:
                number = check_slot("G54", words.indices[54], offset)
        else:
            axes = [self.axis(letter, offset) for letter in FIXED_ORIGINS[code]]
        layer.recall(axes, number)

    def _rotary_axes(self, words: Words, offset: int) -> list[int]:
        axes = self._some(words, 86, offset)
        for axis in axes:
            if not self.machine.rotary[axis]:
                raise fail(909113, f"G86: {self.machine.axes[axis]} is not a rotary axis", offset)
        return axes

    def _length(self, code: int, offset: int, words: Words) -> None:
        frame = self.frame
        if code in (44, 46):
            frame.length[:] = frame.length_extra[:] = 0.0
            frame.length_axis = -1
            return
        signs = words.block.signs
        if len(signs) != 1:
            raise fail(900004, f"G{code}: one axis with + or - is expected", offset)
        letter, sign = next(iter(signs.items()))
        words.used.add(letter)
        axis = self.axis(letter, offset)
        length = self._length_word(code, axis, words)
        if words.take("K") == 1.0:
            frame.length_extra[axis] = length or self.table[1]
        else:
            frame.length[:] = 0.0
            frame.length[axis] = sign * (length or self.table[1])
        frame.length_axis = axis

    def _length_word(self, code: int, axis: int, words: Words) -> float:
        if code == 45:
            return 0.0
        value, relative = words.take("X"), words.take("DX")
        if relative is not None:
            return float(abs(self.frame.length[axis])) + relative * self.modal.unit_mm
        return (value or 0.0) * self.modal.unit_mm

    def _origin_words(self, words: Words) -> None:
        """OX0 OY1: origins of single axes from slots."""
        for letter in AXIS_LETTERS:
            number = words.take("O" + letter)
            if number is None:
                continue
            offset = words.offset("O" + letter)
            self.not_compensated(f"O{letter}", offset)
            self.frame.origin.recall([self.axis(letter, offset)], check_slot(f"O{letter}", number, offset))
            self.frame.update()

    # motion

    def _motion(self, words: Words) -> list[Row]:
        if words.codes.keys() & DIRECT.keys():
            return []
        given = self.targets(words)
        arc = self.modal.motion >= 2
        centre = {}
        if arc:
            centre = {letter: words.values[letter] for letter in "IJ" if letter in words.values}
            words.used |= {"I", "J", "R"}
        radius = words.values.get("R") if arc else None
        if radius is not None and not (given or centre):
            raise fail(
                900007, "wrong circle: R needs an end point, a full circle has I and J", words.block.offsets["R"]
            )
        if not (given or centre):
            return []
        offset = min(words.block.offsets[name] for name in words.block.offsets if name.lstrip("D") in "XYZABCUVWIJ")
        return self._move(given, centre, radius, 940 in words.codes, words.block.n, offset)

    def targets(self, words: Words) -> dict[int, tuple[float, bool]]:
        """Axis words of a motion: value, and whether it counts from where the axis is, by axis."""
        given: dict[int, tuple[float, bool]] = {}
        names = [letter for letter in AXIS_LETTERS if letter not in words.used]
        for letter in names:
            for name in (letter, "D" + letter):
                if name in words.values and name not in words.used:
                    axis = self.axis(letter, words.offset(name))
                    if axis in given:
                        raise fail(900005, f"{letter} twice in one block", words.offset(name))
                    given[axis] = (words.values[name], name != letter or not self.modal.absolute)
                    words.used.add(name)
        return given

    def place_of(self, given: dict[int, tuple[float, bool]]) -> Array:
        """(axes,) machine position that axis words lead to, through transformations, origins and offsets."""
        position, frame = self.modal.position, self.frame.total
        now = self.transform.backward(position - frame)
        point = now.copy()
        for axis, (value, relative) in given.items():
            point[axis] = self._target(axis, value * self._scale(axis), relative, float(now[axis]))
        place = self.transform.forward(point) + frame
        moved = self.transform.matrix[:, list(given)].any(axis=1)
        return np.where(moved, place, position)

    def _move(
        self,
        given: dict[int, tuple[float, bool]],
        centre: dict[str, float],
        radius: float | None,
        without_origin: bool,
        n: int,
        offset: int,
    ) -> list[Row]:
        modal = self.modal
        relative = {is_relative for _, is_relative in given.values()}
        simple = self.plain_geometry and not without_origin and relative <= {not modal.absolute}
        if simple and not any(self.rotary_modes.get(axis) for axis in given):
            words = MotionWords(axis={axis: value for axis, (value, _) in given.items()}, centre=centre, r=radius, n=n)
            return self._apply(words, offset)
        return self._general(given, centre, radius, without_origin, n, offset)

    @property
    def plain_geometry(self) -> bool:
        return self.transform.identity and bool(self.plane_code) and not self.plane_reversed

    def _apply(self, words: MotionWords, offset: int) -> list[Row]:
        error, row = self.modal.apply(words)
        if error:
            text = ERRORS[error]
            if error == 900007:
                text += f"; allowed is {self.parameters.length('SGLR'):g} mm (SGLR)"
            raise fail(error, text, offset)
        return [] if row is None else self.emit(row)

    def _general(
        self,
        given: dict[int, tuple[float, bool]],
        centre: dict[str, float],
        radius: float | None,
        without_origin: bool,
        n: int,
        offset: int,
    ) -> list[Row]:
        """Through the transformations, in machine coordinates."""
        modal, transform = self.modal, self.transform
        position = modal.position
        frame = self.frame.total - (self.frame.origin.acting if without_origin else 0.0)
        now = transform.backward(position - frame)
        point = now.copy()
        for axis, (value, relative) in given.items():
            point[axis] = self._target(axis, value * self._scale(axis), relative, float(now[axis]))
        place = transform.forward(point) + frame
        moved = transform.matrix[:, list(given)].any(axis=1)
        words = MotionWords(axis={int(i): float(place[i]) for i in np.flatnonzero(moved)}, n=n, motion=modal.motion)
        if modal.motion >= 2:
            self._arc(words, centre, radius, now, frame, offset)
        return self.in_machine_coordinates(words, offset)

    def _target(self, axis: int, value: float, relative: bool, now: float) -> float:
        if relative:
            return now + value
        mode = self.rotary_modes.get(axis, 0)
        if mode == 4:
            mode = 1 if self.modal.motion < 2 else 0
        return target_of(mode, now, value)

    def _arc(
        self, words: MotionWords, centre: dict[str, float], radius: float | None, now: Array, frame: Array, offset: int
    ) -> None:
        first, second = self.plane_pair
        similar = self.transform.similarity(first, second)
        if not self.plane_code:
            raise fail(909115, ERRORS[909115], offset)
        if similar is None:
            raise fail(909116, ERRORS[909116], offset)
        scale, kept = similar
        if kept == self.plane_reversed:
            words.motion = 5 - self.modal.motion
        if radius is not None:
            words.r = radius * self.modal.unit_mm * scale
        if not centre:
            return
        absolute = self.modal.absolute and not self.parameters["ARC_REL"]
        point = now.copy()
        for letter, axis in (("I", first), ("J", second)):
            point[axis] = centre.get(letter, 0.0) * self.modal.unit_mm + (0.0 if absolute else now[axis])
        place = self.transform.forward(point) + frame
        pair = (second, first) if self.plane_reversed else (first, second)
        words.centre = {letter: float(place[axis]) for letter, axis in zip("IJ", pair, strict=True)}

    def in_machine_coordinates(self, words: MotionWords, offset: int) -> list[Row]:
        modal = self.modal
        absolute, inch, motion = modal.absolute, modal.unit_mm != 1.0, modal.motion
        modal.set_offset(np.zeros(len(self.machine.axes)))
        modal.set_absolute(True)
        modal.apply(MotionWords(inch=False, centre_absolute=True))
        try:
            return self._apply(words, offset)
        finally:
            modal.apply(MotionWords(inch=inch, centre_absolute=not self.parameters["ARC_REL"], motion=motion))
            modal.set_absolute(absolute)
            self.frame.update()

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
            rows += self.emit(self.modal.row(M, words.block.n, code=number, flags=STANDSTILL))
        return rows

    def _calls(self, words: Words) -> None:
        for number, offset, _ in words.block.m:
            if self._macro("M", number):
                self.calls.append(("M", number, offset, []))
        if words.block.hm:
            number, offset, arguments = words.block.hm
            self.calls.append(("HM", number, offset, [argument() for argument in arguments]))
        if len(self.calls) > 1:
            raise fail(900011, "more than one macro call in a block", self.calls[1][2])


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
TRANSFORMS = frozenset({120, 121, 24, 25, 22, 23, 26, 27, 28, 50, 51, 52, 1051, 1050})
