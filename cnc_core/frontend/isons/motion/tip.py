"""RTCP: G103 passes values, G104 lets the tool tip be programmed, G105 the axes
again.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cnc_core.blocks import COORDINATES
from cnc_core.blocks.coordinates import Coordinates
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Row
from cnc_core.frontend.machine import TipMachine
from cnc_core.frontend.port import Wait

from ..base.text import AXIS_LETTERS

if TYPE_CHECKING:
    from ..language.words import Words
    from .executor import Array, Executor

VALUES, ON = 103, 104
NO_KINEMATICS = 910106
# of the values of G103: tool length; the others are kept for the machine's
# geometry
LENGTH = "Z"


class Tip:
    """``values``: of G103 by axis letter.  ``on``: the tool tip is programmed."""

    def __init__(self, executor: Executor) -> None:
        self._executor = executor
        self.values: dict[str, float] = {}
        self.on = False
        self._length = 0.0

    @property
    def _machine(self) -> TipMachine | None:
        machine = self._executor.machine
        return (
            None
            if machine.kin_id is None
            else machine.kinematics.get(machine.kin_id)
        )

    def function(
        self, code: int, words: Words, offset: int
    ) -> list[Row | Wait]:
        """G103, G104, G105."""
        executor = self._executor
        executor.not_compensated(f"G{code}", offset)
        if code == VALUES:
            for letter in AXIS_LETTERS:
                value = words.take(letter)
                if value is not None:
                    self.values[letter] = value
            return []
        machine = self._machine
        if machine is None:
            raise fail(
                NO_KINEMATICS, f"G{code}: {ERRORS[NO_KINEMATICS]}", offset
            )
        if self.on == (code == ON):
            return []
        return [
            *executor.output.flush(),
            *self._switch(machine, words.block.n, on=code == ON),
        ]

    def _switch(self, machine: TipMachine, n: int, *, on: bool) -> list[Row]:
        """No axis moves; what is programmed from here on is another point."""
        executor, modal = self._executor, self._executor.modal
        if on:
            self._length = self.values.get(LENGTH, executor.table[1])
            place = machine.programmed(modal.position[None, :], self._length)[0]
        else:
            place = machine.driven(modal.position[None, :], self._length)[0]
        self.on = on
        coordinates = (
            Coordinates(kinematics=executor.machine.kin_id, length=self._length)
            if on
            else Coordinates()
        )
        row = modal.row(COORDINATES, n)
        coordinates.fill(row, place)
        modal.set_position(place)
        executor.output.moved_to(place)
        executor.refresh()
        return executor.emit(row)

    def programmed(self, axes: Array) -> Array:
        """(axes,) what is programmed where the axes stand."""
        machine = self._machine
        if not self.on or machine is None:
            return axes
        return np.asarray(machine.programmed(axes[None, :], self._length)[0])
