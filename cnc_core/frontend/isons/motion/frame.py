"""From programmed to machine coordinates: origins, offsets, heads, tool length,
presets.

machine = programmed + origin + offset + head + length + home.  ``home`` is what
G89 and G86 have shifted: coordinates "from home" are machine coordinates
without it.
"""

from __future__ import annotations

import copy
from collections.abc import Iterable

import numpy as np

from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.scanner import Modal
from cnc_core.frontend.machine import ProgramMachine
from cnc_core.units import FloatArray

from ..base.machine import SLOTS, Head, IsonsCell


class Layer:
    """A table of slots and what is in force of it: work origins, or work offsets."""

    def __init__(
        self, names: tuple[str, ...], table: dict[int, dict[str, float]]
    ) -> None:
        self._names = names
        self._slots = {
            number: self._array(values) for number, values in table.items()
        }
        self.index = 0
        self.on = True
        self.value: FloatArray = self.slot(0).copy()

    def _array(self, values: dict[str, float]) -> FloatArray:
        return np.array([values.get(name, 0.0) for name in self._names])

    def slot(self, number: int) -> FloatArray:
        """Stored values of a slot, (axes,)."""
        return self._slots.setdefault(number, np.zeros(len(self._names)))

    @property
    def acting(self) -> FloatArray:
        return self.value if self.on else np.zeros(len(self._names))

    def select(self, number: int) -> None:
        """USER_ZERO, USER_OFFSET: the slot and what is stored in it."""
        self.index, self.on = number, True
        self.value = self.slot(number).copy()

    def recall(self, axes: Iterable[int], number: int) -> None:
        """Some axes from a slot; the index in force stays."""
        for axis in axes:
            self.value[axis] = self.slot(number)[axis]
        self.on = True

    def store(self, values: dict[int, float]) -> None:
        """Values in force at once and in the slot."""
        for axis, value in values.items():
            self.value[axis] = self.slot(self.index)[axis] = value
        self.on = True

    def clear(self) -> None:
        self.value = np.zeros(len(self._names))


class Frame:
    """All layers of one channel; ``update`` gives their sum to the modal state."""

    def __init__(
        self, machine: ProgramMachine, modal: Modal, cell: IsonsCell
    ) -> None:
        self._modal = modal
        self.names = tuple(name.upper() for name in machine.axes)
        self._heads = cell.heads
        self.origin = Layer(self.names, cell.origins)
        self.offset = Layer(self.names, cell.offsets)
        count = len(self.names)
        self.head_number, self.head_on = -1, True
        self.length: FloatArray = np.zeros(count)
        self.length_extra: FloatArray = np.zeros(count)
        self.home: FloatArray = np.zeros(count)
        self.length_axis = -1
        self.update()

    def take_over(self, other: Frame) -> None:
        """Everything as another frame of the same machine has it."""
        self.origin = copy.deepcopy(other.origin)
        self.offset = copy.deepcopy(other.offset)
        self.head_number, self.head_on = other.head_number, other.head_on
        self.length = other.length.copy()
        self.length_extra = other.length_extra.copy()
        self.home = other.home.copy()
        self.length_axis = other.length_axis
        self.update()

    @property
    def head(self) -> Head:
        return self._heads.get(self.head_number, Head())

    @property
    def sensor(self) -> FloatArray:
        """Sensor offset of the head, (axes,)."""
        return np.array(
            [self.head.sensor.get(name, 0.0) for name in self.names]
        )

    def _head(self) -> FloatArray:
        values = [self.head.offset.get(name, 0.0) for name in self.names]
        return np.array(values) if self.head_on else np.zeros(len(self.names))

    @property
    def below(self) -> FloatArray:
        """Everything but origin and offset."""
        return self._head() + self.length + self.length_extra + self.home

    @property
    def total(self) -> FloatArray:
        return self.origin.acting + self.offset.acting + self.below

    def update(self) -> None:
        self._modal.set_offset(self.total)

    def position_from_home(self) -> FloatArray:
        return self._modal.position - self.home

    def set_here(self, layer: Layer, axes: Iterable[int], sensor: bool) -> None:
        """G92, G82, G95, G85: the axes read 0 (or the sensor offset stands there)."""
        other = self.offset if layer is self.origin else self.origin
        here = self._modal.position - self.below - other.acting
        for axis in axes:
            layer.value[axis] = here[axis] + (
                self.sensor[axis] if sensor else 0.0
            )
        layer.on = True
        self.update()

    def select_head(self, number: int, offset: int) -> None:
        self.head_number, self.head_on = check_slot("H", number, offset), True
        self.update()

    def preset(self, values: dict[int, float]) -> None:
        """G89: the axes' positions get these values; origins and offsets are gone."""
        self.origin.clear()
        self.offset.clear()
        position = self._modal.position
        for axis, value in values.items():
            self.home[axis] = position[axis] - value
        self.update()

    def preset_turns(self, axes: Iterable[int]) -> None:
        """G86: position modulo 360 degrees."""
        here = self.position_from_home()
        for axis in axes:
            self.home[axis] += 360.0 * np.floor(here[axis] / 360.0)
        self.update()


def check_slot(name: str, number: float, offset: int) -> int:
    """The number of a slot 0..255."""
    if number != int(number) or not 0 <= number < SLOTS:
        raise fail(
            909110,
            f"{name} {number:g}: a whole number 0..{SLOTS - 1} is expected",
            offset,
        )
    return int(number)
