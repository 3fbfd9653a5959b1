"""State of the channel that the words of a block change: frames, tip, modes,
output, tool.
"""

from __future__ import annotations

from collections.abc import Callable

from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal, MotionWords, Row
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import FloatArray

from ..base.machine import IsonsCell, ToolTable
from ..base.parameters import Parameters
from ..base.text import AXIS_LETTERS
from ..base.words import Words
from .frame import Frame
from .output import OFF, Output
from .path_modes import PathModes
from .tip import Tip
from .transform import Transform

# number, value, relative, place in the block
PositionerOffset = Callable[[float, float, bool, int], None]
PLANE_AXES = {
    17: ("X", "Y"),
    18: ("Z", "X"),
    19: ("Y", "Z"),
}


class ChannelState:
    """State of the channel beyond the modal state of the motions."""

    def __init__(
        self,
        machine: ProgramMachine,
        modal: Modal,
        cell: IsonsCell,
        parameters: Parameters,
        warn: Callable[[int, str, int], None],
    ) -> None:
        self.machine, self.modal, self.cell = machine, modal, cell
        self.parameters, self.warn = parameters, warn
        self.axes = {
            name.upper(): i
            for i, name in enumerate(machine.axes)
            if len(name) == 1
        }
        self.frame = Frame(machine, modal, cell)
        self.transform = Transform(len(machine.axes))
        self.modes = PathModes(machine, modal, parameters)
        self.output = Output(machine, modal, parameters, self.modes)
        self.tip = Tip(machine)
        self.modes_changed = True
        self.rotary_modes: dict[int, int] = {}
        self.plane_pair, self.plane_code = (0, 1), 17
        self.plane_reversed = False
        self.set_plane("X", "Y", 0)
        self.spindle = parameters["SPEEDDEF"]
        self.tool = 0
        self.tables: dict[int, list[float]] = {}
        self.diameter: float | None = None
        self.pause_mode = 0
        self.depth_axis: int | None = None
        # the axes are being stopped where they are (G101)
        self.stopping = False
        # ends the program behind the rows of the block
        self.failure: CncError | None = None
        self.homed: set[int] = set()
        self.without_tools_told = False
        self.tool_instead: int | None = None  # of the next T (RESUME_T)
        # the value of $_C while a restart leads there
        self.counter: FloatArray | None = None
        self.completed = False  # the program has come to its end
        self.positioner_offset: PositionerOffset = lambda *_: None
        self.speed_copied: Callable[[float], None] = lambda _: None
        self.refresh()

    def refresh(self) -> None:
        """Take over parameters that the geometry uses."""
        modal, p = self.modal, self.parameters
        modal.set_feed_factor(p["FEEDRES"])
        modal.set_centre_limit(p.length("SGLR"))
        if modal.feed == 0.0:
            modal.feed = p.speed("FEEDDEF") / p["FEEDRES"]
        modal.apply(MotionWords(centre_absolute=not p["ARC_REL"]))
        self.output.refresh(limits=not self.tip.on)
        self.modes_changed = True

    def parameter_in_force(self, name: str) -> float:
        """Value of a machine parameter.

        A parameter that is not given takes the value of its key in the cell.
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
            self.set_plane(*PLANE_AXES[self.modal.plane], 0)
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

    # rows

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

    # plane

    def set_plane(self, first: str, second: str, offset: int) -> None:
        """The plane of two axes.

        With ``offset`` 0 an axis that the machine lacks is no error.
        """
        if first not in self.axes or second not in self.axes:
            if offset:
                raise fail(900016, ERRORS[900016], offset)
            return
        self.plane_pair = (self.axes[first], self.axes[second])
        self.modes_changed = True
        pairs = {pair: code for code, pair in PLANE_AXES.items()}
        self.plane_reversed = (second, first) in pairs
        self.plane_code = pairs.get(
            (first, second), pairs.get((second, first), 0)
        )
        if self.plane_code:
            self.modal.apply(MotionWords(plane=self.plane_code))
        corners = self.output.corners
        corners.plane = self.plane_pair
        corners.code = self.plane_code
        corners.reversed = self.plane_reversed

    @property
    def plain_geometry(self) -> bool:
        return (
            self.transform.identity
            and bool(self.plane_code)
            and not self.plane_reversed
        )

    # words of a function

    def not_compensated(self, name: str, offset: int) -> None:
        """Refuse a function while the tool radius is compensated."""
        if self.output.side != OFF:
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

    def given(self, words: Words, current: FloatArray) -> dict[int, float]:
        """Values by axis, mm or degrees.

        The words are X to W, and DX to DW, which count from ``current``.
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
