"""Kinematic chains: from the part to the tool as a product of constant steps
and joints.

A machine is described from its bed outwards, to the part and to the tool (HSM
specification, sections 9.3 to 10.2).  Every element has a frame whose +Z
is its axis; a ``Step`` leads from the frame before it to its own one::

    step(e, q) = Tr(offset) Rx(a) Ry(b) Rz(c) J(q)     J = Tr(0, 0, q) linear,
    Rz(q) rotary, identity for part and tool
    T_part_tool = inv(T_bed_part) T_bed_tool           tip = T_part_tool (0, 0,
    -L),  direction = its third column
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import product
from typing import Protocol

import numpy as np

from cnc_core.units import FloatArray

from ..errors import CncError
from . import jets

Vector = tuple[float, float, float]
# of the rotary axes, at which a chain is looked at
ANGLES_DEG = (0.0, 37.0, 90.0, 143.0)
SINGULAR = 1e-6  # volume that the directions of the linear axes span at least


class SingularMachine(CncError):  # noqa: N818 - the machine is singular
    """At position ``row`` the linear axes do not span the space (chains with a
    rotary axis between linear ones).
    """

    def __init__(self, row: int) -> None:
        super().__init__(910103)
        self.row = row


def rotation(rx: float, ry: float, rz: float) -> FloatArray:
    """(3, 3) Rx(rx) Ry(ry) Rz(rz), degrees; multiples of 90 degrees are exact."""
    c, s = zip(
        *(_cos_sin(angle) for angle in (rx, ry, rz)),
        strict=True,
    )
    x = np.array(
        [
            [1.0, 0, 0],
            [0, c[0], -s[0]],
            [0, s[0], c[0]],
        ]
    )
    y = np.array(
        [
            [c[1], 0, s[1]],
            [0, 1.0, 0],
            [-s[1], 0, c[1]],
        ]
    )
    z = np.array(
        [
            [c[2], -s[2], 0],
            [s[2], c[2], 0],
            [0, 0, 1.0],
        ]
    )
    return np.asarray(x @ y @ z)


def _cos_sin(degrees: float) -> tuple[float, float]:
    quarter, rest = divmod(degrees, 90.0)
    c = float(np.cos(np.radians(rest)))
    s = float(np.sin(np.radians(rest)))
    return (
        (c, s),
        (-s, c),
        (-c, -s),
        (s, -c),
    )[int(quarter) % 4]


@dataclass(frozen=True)
class Step:
    """From the frame before to the frame of an element: offset (mm) first, then
    turns about X, Y, Z (degrees).
    """

    offset: Vector = (0.0, 0.0, 0.0)
    turns: Vector = (0.0, 0.0, 0.0)

    @property
    def matrix(self) -> FloatArray:
        """(4, 4)"""
        out = np.eye(4)
        out[:3, :3] = rotation(*self.turns)
        out[:3, 3] = self.offset
        return out


class HasMatrix(Protocol):
    """A constant transformation."""

    @property
    def matrix(self) -> FloatArray:
        """(4, 4)"""
        ...


@dataclass(frozen=True)
class Fixed:
    """A constant transformation given by its matrix."""

    matrix: FloatArray


@dataclass(frozen=True)
class Joint:
    """An axis in the chain: ``axis`` is its channel index, ``rotary`` its kind."""

    axis: int
    rotary: bool
    step: HasMatrix = Step()


@dataclass(frozen=True)
class _Link:
    """One joint of the chain part to tool, and the constant transformation in
    front of it.
    """

    axis: int
    rotary: bool
    sign: float
    rotation: FloatArray
    offset: FloatArray


class Chain:
    """``part`` and ``tool``: joints from the bed outwards; ``part_step``,
    ``tool_step``: the last steps (w and t).
    """

    def __init__(
        self,
        part: Sequence[Joint],
        part_step: HasMatrix,
        tool: Sequence[Joint],
        tool_step: HasMatrix,
    ) -> None:
        self.part = tuple(part)
        self.tool = tuple(tool)
        self.part_step = part_step
        self.tool_step = tool_step
        joints = [*part, *tool]
        self.linear = tuple(
            j.axis for j in [*reversed(self.part), *tool] if not j.rotary
        )
        self.rotary = tuple(
            j.axis for j in [*reversed(self.part), *tool] if j.rotary
        )
        if len(self.linear) != 3 or len(self.rotary) > 2:
            raise ValueError(
                "a chain has three linear axes and at most two rotary ones"
            )
        if len({j.axis for j in joints}) < len(joints):
            raise ValueError("an axis stands twice in the chain")
        self._links, self._last = self._flat()
        self._check()

    def _flat(self) -> tuple[list[_Link], FloatArray]:
        """Links from the part to the tool, and the constant transformation
        behind the last one.
        """
        links: list[_Link] = []
        before: FloatArray = np.linalg.inv(self.part_step.matrix).astype(
            np.float64
        )
        for joint in reversed(self.part):
            links.append(
                _Link(
                    joint.axis,
                    joint.rotary,
                    -1.0,
                    before[:3, :3].copy(),
                    before[:3, 3].copy(),
                )
            )
            before = np.linalg.inv(joint.step.matrix).astype(np.float64)
        for joint in self.tool:
            before = before @ joint.step.matrix
            links.append(
                _Link(
                    joint.axis,
                    joint.rotary,
                    1.0,
                    before[:3, :3].copy(),
                    before[:3, 3].copy(),
                )
            )
            before = np.eye(4)
        return links, before @ self.tool_step.matrix

    def _check(self) -> None:
        """The linear axes may be dependent at single poses (of rotary axes
        below them), not at all of them.
        """
        turns = np.array(list(product(ANGLES_DEG, repeat=len(self.rotary))))
        q = np.zeros(
            (
                len(turns),
                3,
                1 + max([*self.linear, *self.rotary]),
            )
        )
        q[:, 0, list(self.rotary)] = turns
        _, map_, _, _ = self._walk(q, 0.0)
        size = np.abs(np.linalg.det(map_[:, 0]))
        if size.max() < 1e-6:
            raise ValueError("the three linear axes do not span the space")

    def _walk(
        self, q: FloatArray, length: float
    ) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
        """Of jets q (n, 3, axes): tip without linear axes, their directions as
        columns, tool direction, orientation.
        """
        n = len(q)
        turned = jets.constant(np.eye(3), n)
        place = np.zeros((n, 3, 3))
        columns = {}
        for link in self._links:
            place = place + turned @ link.offset
            turned = turned @ link.rotation
            if link.rotary:
                turned = jets.product(
                    turned,
                    jets.turn(np.radians(link.sign * q[:, :, link.axis])),
                )
            else:
                columns[link.axis] = link.sign * turned[..., 2]
        place = place + turned @ self._last[:3, 3]
        turned = turned @ self._last[:3, :3]
        direction = turned[..., 2]
        map_ = np.stack([columns[axis] for axis in self.linear], axis=-1)
        return place - length * direction, map_, direction, turned

    def forward_jets(
        self, q: FloatArray, length: float
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """(tip, direction, orientation) jets of axis jets q (n, 3, axes)."""
        base, map_, direction, turned = self._walk(q, length)
        return (
            base + jets.times(map_, q[:, :, list(self.linear)]),
            direction,
            turned,
        )

    def linear_jets(
        self, tip: FloatArray, q: FloatArray, length: float
    ) -> FloatArray:
        """(n, 3, 3) jets of the linear axes (in the order of ``linear``) that
        hold the tip jet (n, 3, 3).

        q (n, 3, axes): only its rotary axes count.
        """
        base, map_, _, _ = self._walk(q, length)
        singular = np.flatnonzero(
            np.abs(np.linalg.det(map_[:, 0])) < SINGULAR,
        )
        if len(singular):
            raise SingularMachine(int(singular[0]))
        return jets.solve(map_, tip - base)

    def shift_jets(self, q: FloatArray, length: float) -> FloatArray:
        """(n, 3, 3) jets of the motion of the linear axes that lifts the tip by
        ``length`` along the tool.
        """
        _, map_, direction, _ = self._walk(q, 0.0)
        singular = np.flatnonzero(
            np.abs(np.linalg.det(map_[:, 0])) < SINGULAR,
        )
        if len(singular):
            raise SingularMachine(int(singular[0]))
        return jets.solve(map_, length * direction)

    # angles of a tool direction

    def orientation_form(
        self,
    ) -> tuple[
        FloatArray, FloatArray, FloatArray, tuple[tuple[int, float], ...]
    ]:
        """(A, B, c, ((axis, sign), ..)): direction = A Rz(s1 q1) B Rz(s2 q2) c;
        B is 1 for one rotary axis.
        """
        constants, joints = [np.eye(3)], []
        for link in self._links:
            constants[-1] = constants[-1] @ link.rotation
            if link.rotary:
                joints.append((link.axis, link.sign))
                constants.append(np.eye(3))
        c = constants[-1] @ self._last[:3, 2]
        first = constants[0]
        second = constants[1] if len(joints) == 2 else np.eye(3)
        return first, second, c, tuple(joints)
