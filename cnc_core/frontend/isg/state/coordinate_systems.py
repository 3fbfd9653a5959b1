"""Coordinate systems of a program: rotation by values, stored ones, active
ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from cnc_core import plain
from cnc_core.blocks.coordinates import Frame
from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.units import FloatArray

from .offsets import Selected

STORED_MAX = 5
UNDEFINED, TOO_MANY = 20821, 910109
SEQUENCES = ("XYZ", "XZY", "YXZ", "YZX", "ZXY", "ZYX")


@dataclass(frozen=True)
class Order:
    """How the angles of a coordinate system turn it: the sequence, about the
    axes turned already or fixed ones.
    """

    sequence: str = "ZYX"
    fixed: bool = False


def frame_of(
    values: Sequence[float], unit_mm: float, order: Order = Order()
) -> Frame:
    """v1 v2 v3 in programmed units, f1 f2 f3 in degrees about X, Y, Z.

    As a rule the rotation is about Z, then the new Y, then the new X.
    """
    v, rotation = np.zeros(6), np.eye(3)
    v[: len(values)] = values
    for axis in ("XYZ".index(letter) for letter in order.sequence):
        turned = turn(axis, v[3 + axis])
        rotation = turned @ rotation if order.fixed else rotation @ turned
    return Frame(rotation, v[:3] * unit_mm)


def turn(axis: int, degrees: float) -> FloatArray:
    """(3, 3) right-handed; multiples of 90 degrees exactly."""
    quarter, rest = divmod(degrees, 90.0)
    c = float(plain.cosines(np.radians(rest)))
    s = float(plain.sines(np.radians(rest)))
    for _ in range(int(quarter) % 4):
        c, s = -s, c
    first, second = (axis + 1) % 3, (axis + 2) % 3
    out = np.eye(3)
    out[first, first] = out[second, second] = c
    out[first, second], out[second, first] = -s, s
    return out


@dataclass
class Active:
    """A coordinate system in force: where it lies in the one around it, and the
    offsets it has taken over.
    """

    frame: Frame
    number: int | None
    offsets: Selected
    shift: FloatArray


@dataclass
class Systems:
    """#CS or #ACS: definitions by number, those without a name, and the stack
    in force.
    """

    name: str
    stored: dict[int, Frame] = field(default_factory=dict)
    unnamed: set[int] = field(default_factory=set)
    stack: list[Active] = field(default_factory=list)
    last: int | None = None

    def define(self, number: int | None, frame: Frame, offset: int) -> int:
        """Keep a definition; without a number under the next free one."""
        if number is None:
            number = next(
                i for i in range(1, STORED_MAX + 2) if i not in self.stored
            )
            self.unnamed.add(number)
        else:
            self.unnamed.discard(number)
        if number not in self.stored and len(self.stored) >= STORED_MAX:
            raise fail(
                TOO_MANY,
                f"#{self.name}: {ERRORS[TOO_MANY]} ({STORED_MAX})",
                offset,
            )
        self.stored[number] = frame
        self.last = number
        return number

    def find(self, number: int | None, offset: int) -> int:
        """A stored number.  None: the one defined last."""
        number = self.last if number is None else number
        if number is None or number not in self.stored:
            which = "" if number is None else f"{number} "
            text = f"#{self.name} ON: coordinate system {which}is not defined"
            raise fail(UNDEFINED, text, offset)
        return number

    def forget(self, number: int | None) -> None:
        """A definition without a name goes with its deselection."""
        if number in self.unnamed and all(
            active.number != number for active in self.stack
        ):
            self.unnamed.discard(number)
            self.stored.pop(number, None)
