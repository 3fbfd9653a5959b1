"""Offsets between programmed and machine coordinates.

A programmed value is mirrored first. Then #PSET, G92, the zero offset and the
tool length are added. #PSET acts at once. All other offsets act on an axis from
its next absolute word on.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cnc_core.blocks import motion_planes
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import FloatArray

NUMBER_MAX = 96
ZERO, ADD_ZERO, PSET, TOOL = "ZERO", "ADD_ZERO", "PSET", "TOOL"
KINDS = (ZERO, ADD_ZERO, PSET, TOOL)
ZERO_OFFSET, MIRROR = "zero offset", "mirror"
# without effect here: no such offset exists
EMPTY_KINDS = ("CLAMP", "MEASURE", "MANUAL")


@dataclass(frozen=True)
class Selected:
    """Zero offset, G92 and #PSET as they were selected: number and (axes,) values."""

    number: int
    active: FloatArray
    g92: FloatArray
    pset: FloatArray

    @classmethod
    def none(cls) -> Selected:
        """Nothing is brought back."""
        return cls(-1, *[np.empty(0)] * 3)


class Offsets:
    """Offsets of one channel, mm or degrees by channel index."""

    def __init__(self, machine: ProgramMachine, modal: Modal) -> None:
        self._modal, self._axes = modal, len(machine.axes)
        self.rotary = machine.rotary
        self.names = [name.upper() for name in machine.axes]
        self.first_main = machine.main[0]
        self.main = machine.main
        self.table: dict[int, FloatArray] = {}
        for number, values in machine.zero_offsets.items():
            row = self.stored(number)
            for name, value in values.items():
                row[self.names.index(name)] = value
        self.excluded: dict[int, npt.NDArray[np.bool_]] = {}
        self.number = 0
        self.active = self._zeros()
        self.g92 = self._zeros()
        self.pset = self._zeros()
        self.mirror = np.ones(self._axes)
        # how often it was chosen with a value: G159=, G351
        self.by_value = {ZERO_OFFSET: 0, MIRROR: 0}
        self.diameter = False
        self.factor = np.ones(self._axes)  # #SCALE
        self.suppressed: frozenset[str] = frozenset()
        self.tool_length_mm = 0.0
        # the tool length acts behind a coordinate system or a transformation
        self.length_elsewhere = False
        self.changed: Callable[[], None] = lambda: None
        self._outside: Selected | None = (
            None  # #MCS ON: what comes back with #MCS OFF
        )
        self._tool_off = self._ex_tool = False

    def _zeros(self) -> FloatArray:
        return np.zeros(self._axes)

    def scale(self, axis: int) -> float:
        """mm or degrees per programmed unit of an axis."""
        return 1.0 if self.rotary[axis] else self._modal.unit_mm

    def stored(self, number: int) -> FloatArray:
        """The row of the table, 1 is G54."""
        return self.table.setdefault(number, self._zeros())

    def check_number(self, number: int, offset: int) -> None:
        if not 0 <= number <= NUMBER_MAX:
            raise fail(
                907060,
                f"zero offset {number} out of range 0..{NUMBER_MAX}",
                offset,
            )

    # selections

    def select(self, number: int) -> None:
        """G53 (0), G54 (1), ... G159=i."""
        self.number = number
        self.active = (
            self._zeros() if number == 0 else self.stored(number).copy()
        )
        if number in self.excluded:
            self.active[self.excluded[number]] = 0.0
        self.update()

    def exclude(self, number: int, axes: dict[int, bool]) -> None:
        """G160: the offset does not act on the axes that are True."""
        mask = self.excluded.setdefault(
            number, np.zeros(self._axes, dtype=bool)
        )
        for axis, disabled in axes.items():
            mask[axis] = disabled
        if number == self.number:
            self.select(number)

    def set_g92(self, words: dict[int, float], *, add: bool) -> None:
        """Programmed values by axis."""
        for axis, value in words.items():
            self.g92[axis] = value * self.scale(axis) + (
                self.g92[axis] if add else 0.0
            )
        self.update()

    def set_pset(self, words: dict[int, float], offset: int) -> None:
        """The position of the axes gets these programmed values."""
        if (self.mirror < 0).any():
            raise fail(20612, ERRORS[20612], offset)
        position = self._modal.position
        for axis, value in words.items():
            share = (
                0.5 if self.diameter and axis == self.first_main else 1.0
            ) * float(self.factor[axis])
            rest = self._total()[axis] - self.pset[axis] + self._length(axis)
            self.pset[axis] = (
                position[axis] - rest - value * self.scale(axis) * share
            )
        self.update()
        for axis in words:
            self._modal.set_offset_of(axis)

    def clear_pset(self, axes: Iterable[int]) -> None:
        for axis in axes:
            self.pset[axis] = 0.0
        self.update()

    def set_mirror(self, x: float, y: float) -> None:
        """G20-G23: signs of the first and second main axis."""
        for axis, sign in zip(self.main, (x, y), strict=False):
            if axis >= 0:
                self.mirror[axis] = sign
        self.update()

    def signs(self) -> tuple[float, float]:
        """Of the first and second main axis."""
        first, second = (
            1.0 if axis < 0 else float(self.mirror[axis])
            for axis in self.main[:2]
        )
        return first, second

    def set_tool_length(self, length_mm: float) -> None:
        """Of a data set selected now."""
        self.tool_length_mm = length_mm
        if self._outside is not None and not self._ex_tool:
            self._tool_off = False
        self.update()

    def update(self) -> None:
        """Make a change of any part act from each axis's next absolute word on."""
        share = self.factor.copy()
        if self.diameter and self.first_main >= 0:
            share[self.first_main] *= 0.5
        self._modal.set_arc_scale(
            [float(self.factor[a]) if a >= 0 else 1.0 for a in self.main]
        )
        self._modal.set_mirror(self.mirror, share)
        self._modal.set_next_offset(self._total())
        self.place_length()
        self.changed()

    def place_length(self) -> None:
        """The tool length acts on the third axis of the plane, or elsewhere."""
        self._modal.set_tool_length(
            0.0 if self.length_elsewhere else self.length_in_force
        )

    @property
    def length_in_force(self) -> float:
        """mm"""
        return 0.0 if self._off(TOOL) else self.tool_length_mm

    def selected_total(self) -> FloatArray:
        """(axes,) sum of what is selected, without the tool length."""
        return self._total()

    # coordinate systems and machine coordinates take offsets over and give them back

    def put_away(self, axes: Iterable[int]) -> Selected:
        """Begin the offsets of some axes at 0; returns the offsets before."""
        before = Selected(
            self.number,
            self.active.copy(),
            self.g92.copy(),
            self.pset.copy(),
        )
        for axis in axes:
            if axis >= 0:
                self.active[axis] = self.g92[axis] = self.pset[axis] = 0.0
        self.number = 0
        self.update()
        return before

    def bring_back(self, selected: Selected) -> None:
        """As they were put away."""
        if selected.number < 0:
            return
        self.number = selected.number
        self.active, self.g92, self.pset = (
            selected.active.copy(),
            selected.g92.copy(),
            selected.pset.copy(),
        )
        self.update()

    def take_effect(self, axes: Iterable[int]) -> None:
        """At once on these axes: their coordinates have changed as a whole."""
        for axis in axes:
            if axis >= 0:
                self._modal.set_offset_of(axis)

    def enter_machine(self, *, ex_tool: bool) -> None:
        """#MCS ON: no offset acts. Offsets selected inside last until #MCS OFF."""
        self._tool_off, self._ex_tool = True, ex_tool
        self._outside = self.put_away(range(self._axes))

    def leave_machine(self) -> None:
        """#MCS OFF; the tool is the one selected last."""
        outside, self._outside, self._tool_off = self._outside, None, False
        if outside is not None:
            self.bring_back(outside)

    def _off(self, kind: str) -> bool:
        return kind in self.suppressed or (kind == TOOL and self._tool_off)

    def _total(self) -> FloatArray:
        """Without the tool length."""
        total = self._zeros()
        for kind, part in (
            (ZERO, self.active),
            (ADD_ZERO, self.g92),
            (PSET, self.pset),
        ):
            if not self._off(kind):
                total += part
        return total

    def _length(self, axis: int) -> float:
        return float(self._modal.offset_next[axis] - self._total()[axis])

    def _mm_per_word(self, axis: int) -> float:
        """How far a programmed 1 moves the axis: unit, mirror, #SCALE, diameter."""
        share = 0.5 if self.diameter and axis == self.first_main else 1.0
        turned = float(self.mirror[axis]) * float(self.factor[axis])
        return self.scale(axis) * turned * share

    def from_zero(self, axis: int, value: float) -> float:
        """Where a programmed absolute value is, from the zero of the workpiece."""
        return value * self._mm_per_word(axis)

    def word(self, axis: int, from_zero: float) -> float:
        """The programmed value of a place; the inverse of ``from_zero``."""
        return from_zero / self._mm_per_word(axis)

    def plane_factor(self, plane: int) -> float | None:
        """Factor of lengths in a plane, #SCALE.  None: its axes have different ones."""
        first, second = (
            float(self.factor[axis]) if axis >= 0 else 1.0
            for axis in (self.main[place] for place in motion_planes(plane)[:2])
        )
        return first if first == second else None

    def machine(self, axis: int, value: float) -> float:
        """Machine coordinate of a programmed absolute value, with the offsets
        of the next absolute word.
        """
        offset = float(self._modal.offset_next[axis])
        return self.from_zero(axis, value) + offset

    # what programs read

    def programmed(self, axis: int, machine_value: float) -> float:
        """A machine coordinate as a program would write it."""
        offset = float(self._modal.offset_in_force[axis])
        return self.word(axis, machine_value - offset)
