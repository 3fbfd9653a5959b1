"""Programmed coordinates: work offsets, G92, tool length, home positions, all
kept in parameters.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from cnc_core.frontend.base.scanner import Modal, MotionWords
from cnc_core.frontend.iso import parameters as p
from cnc_core.frontend.iso.codes import AXIS_LETTERS
from cnc_core.frontend.iso.parameters import Parameters
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import FloatArray

TOOL, LENGTH, POSITION = 5400, 5401, 5420
AXES = len(AXIS_LETTERS)


class Frame:
    """Offsets between programmed and machine coordinates.

    Lengths in parameters are mm.
    ``slot``: place among X Y Z A B C U V W by channel index.  -1: another name.
    """

    def __init__(self, machine: ProgramMachine, modal: Modal) -> None:
        self._modal = modal
        self.parameters = Parameters(self._computed)
        self.rotary = machine.rotary
        self.slot = [
            AXIS_LETTERS.find(name.upper()) if len(name) == 1 else -1
            for name in machine.axes
        ]
        self.z = machine.main[2]
        self.length_mm = 0.0
        self.tool = 0
        for axis, slot in enumerate(self.slot):
            if slot >= 0:
                self.parameters[p.HOME_1 + slot] = self.parameters[
                    p.HOME_2 + slot
                ] = float(machine.start[axis])
        self.update()

    @property
    def system(self) -> int:
        """1..9: G54..G59.3."""
        return round(self.parameters[p.SYSTEM])

    def select(self, system: int) -> None:
        self.parameters[p.SYSTEM] = float(system)

    def system_at(self, system: int, slot: int) -> int:
        """Number of the parameter that holds the offset of one axis."""
        return p.SYSTEMS + p.SYSTEM_STEP * (system - 1) + slot

    def parts(self, axis: int) -> tuple[float, float, float]:
        """Work offset, G92 and tool length of an axis."""
        slot, values = self.slot[axis], self.parameters
        if slot < 0:
            return 0.0, 0.0, 0.0
        g92 = values[p.G92 + slot] if values[p.G92_ACTIVE] else 0.0
        length = self.length_mm if axis == self.z else 0.0
        return values[self.system_at(self.system, slot)], g92, length

    def update(self) -> None:
        """Make a change of any part act."""
        self._modal.set_offset(
            np.array([sum(self.parts(axis)) for axis in range(len(self.slot))])
        )

    def scale(self, axis: int) -> float:
        """mm or degrees per programmed unit of an axis."""
        return 1.0 if self.rotary[axis] else self._modal.unit_mm

    def home(self, first: int) -> FloatArray:
        """(axes,) machine position in the parameters from ``first`` on.

        Axes without a letter stay.
        """
        position = self._modal.position
        return np.array(
            [
                position[i] if s < 0 else self.parameters[first + s]
                for i, s in enumerate(self.slot)
            ]
        )

    def store_home(self, first: int) -> None:
        for axis, slot in enumerate(self.slot):
            if slot >= 0:
                self.parameters[first + slot] = float(
                    self._modal.position[axis]
                )

    def set_g92(self, values: dict[int, float]) -> None:
        """The position gets these programmed coordinates, mm or degrees by
        axis.

        G92 of other axes stays.
        """
        for axis, slot in enumerate(self.slot):
            work, g92, length = self.parts(axis)
            if axis in values:
                g92 = (
                    float(self._modal.position[axis])
                    - values[axis]
                    - work
                    - length
                )
            if slot >= 0:
                self.parameters[p.G92 + slot] = g92
        self.parameters[p.G92_ACTIVE] = 1.0

    def clear_g92(self) -> None:
        for slot in range(AXES):
            self.parameters[p.G92 + slot] = 0.0
        self.parameters[p.G92_ACTIVE] = 0.0

    def _computed(self, number: int) -> float | None:
        if number == TOOL:
            return float(self.tool)
        if number == LENGTH + 2:
            return self.length_mm / self._modal.unit_mm
        if (
            POSITION <= number < POSITION + AXES
            and number - POSITION in self.slot
        ):
            axis = self.slot.index(number - POSITION)
            return float(
                self._modal.position[axis] - self._modal.offset[axis]
            ) / self.scale(axis)
        return None


@contextmanager
def machine_coordinates(modal: Modal, *, mm: bool) -> Iterator[None]:
    """Inside, axis words are absolute machine coordinates, in mm if ``mm``.

    The modal state is restored behind it.
    """
    offset, absolute, inch = modal.offset, modal.absolute, modal.unit_mm != 1.0
    modal.set_offset(np.zeros(len(offset)))
    modal.set_absolute(True)
    if mm:
        modal.apply(MotionWords(inch=False))
    try:
        yield
    finally:
        modal.apply(MotionWords(inch=inch))
        modal.set_absolute(absolute)
        modal.set_offset(offset)
