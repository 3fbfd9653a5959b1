"""A machine's chain with its limits: what front ends and stages ask for, on
single poses and whole arrays.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from cnc_core.units import FloatArray

from . import inverse, jets
from .chain import Chain


class Pose(NamedTuple):
    """``tip`` (n, 3) in the part frame, mm; ``direction`` (n, 3) tip to
    spindle; ``rotation`` (n, 3, 3) of the tool.
    """

    tip: FloatArray
    direction: FloatArray
    rotation: FloatArray


@dataclass(frozen=True)
class Kinematics:
    """One kinematic of a cell.

    Positions q are (axes,) or (n, axes) in channel order, mm and degrees.

    ``tip_axes``: channel index of the three axes under whose names the tip is
    programmed (X, Y, Z).  ``low``, ``high``: (axes,) software limits.
    ``modulo``: (axes,) True where positions may be taken by whole turns.
    ``kin_id``: number.
    """

    chain: Chain
    tip_axes: tuple[int, int, int]
    low: FloatArray
    high: FloatArray
    kin_id: int = 0

    @property
    def rotary_axes(self) -> tuple[int, ...]:
        """Channel index of the rotary axes, part to tool."""
        return self.chain.rotary

    def forward(self, q: FloatArray, length: float = 0.0) -> Pose:
        """Tip and direction of axis positions; one position (axes,) gives
        arrays of one row.
        """
        rows = np.atleast_2d(q)
        tip, direction, turned = self.chain.forward_jets(_still(rows), length)
        return Pose(tip[:, 0], direction[:, 0], turned[:, 0])

    def axes_of_tip(
        self, tip: FloatArray, q: FloatArray, length: float = 0.0
    ) -> FloatArray:
        """(n, axes) ``q`` with its linear axes set so that the tip (n, 3) is
        held; rotary and other axes as in q.
        """
        rows, points = np.atleast_2d(q), np.atleast_2d(tip)
        out = np.broadcast_to(
            rows, (max(len(rows), len(points)), rows.shape[1])
        ).copy()
        held = np.broadcast_to(points, (len(out), 3))
        out[:, list(self.chain.linear)] = self.chain.linear_jets(
            _still(held), _still(out), length
        )[:, 0]
        return out

    def orient(
        self, direction: Sequence[float] | FloatArray, near: FloatArray
    ) -> FloatArray:
        """(axes,) ``near`` with the rotary axes turned so that the tool points
        into ``direction`` (part frame).

        The nearest branch and turn within the limits; CncError 910101
        unreachable, 910102 only beyond the limits.
        """
        return inverse.nearest(self.chain, direction, near, self.low, self.high)

    def inverse(
        self,
        tip: FloatArray,
        direction: FloatArray,
        near: FloatArray,
        length: float = 0.0,
    ) -> FloatArray:
        """(n, axes) positions of poses one behind the other, each the nearest
        to the one before; ``near`` (axes,).
        """
        turned, last = [], near
        for d in np.atleast_2d(direction):
            last = self.orient(d, last)
            turned.append(last)
        return self.axes_of_tip(np.atleast_2d(tip), np.array(turned), length)

    def directions(self, q: FloatArray) -> FloatArray:
        """(n, 3) tool directions, tip to spindle, in the part frame."""
        return self.forward(q).direction

    def length_correction(self) -> LengthCorrection:
        """The same machine with the axes programmed."""
        return LengthCorrection(self)

    # programmed coordinates: tip in the tip axes, everything else as the axes stand

    def programmed(self, q: FloatArray, length: float) -> FloatArray:
        """(n, axes) the tip in place of the linear axes."""
        out = np.atleast_2d(q).copy()
        out[:, list(self.tip_axes)] = self.forward(q, length).tip
        return out

    def driven(self, programmed: FloatArray, length: float) -> FloatArray:
        """(n, axes) axis positions of programmed ones: the opposite of
        ``programmed``.
        """
        rows = np.atleast_2d(programmed)
        return self.axes_of_tip(rows[:, list(self.tip_axes)], rows, length)

    def driven_jets(self, programmed: FloatArray, length: float) -> FloatArray:
        """(n, 3, axes) the same with first and second derivatives."""
        out = programmed.copy()
        tip = programmed[:, :, list(self.tip_axes)]
        out[:, :, list(self.chain.linear)] = self.chain.linear_jets(
            tip, programmed, length
        )
        return out


@dataclass(frozen=True)
class LengthCorrection:
    """The axes are programmed for a tool that is ``length`` shorter: they are
    lifted by it along the tool (#TLC).
    """

    kinematics: Kinematics

    @property
    def tip_axes(self) -> tuple[int, int, int]:
        return self.kinematics.tip_axes

    @property
    def rotary_axes(self) -> tuple[int, ...]:
        """Channel index of the rotary axes, part to tool."""
        return self.kinematics.rotary_axes

    def forward(self, q: FloatArray, length: float = 0.0) -> Pose:
        """As tip the programmed axes."""
        pose = self.kinematics.forward(q)
        return Pose(
            self.programmed(q, length)[:, list(self.tip_axes)],
            pose.direction,
            pose.rotation,
        )

    def orient(
        self, direction: Sequence[float] | FloatArray, near: FloatArray
    ) -> FloatArray:
        """As without correction."""
        return self.kinematics.orient(direction, near)

    def directions(self, q: FloatArray) -> FloatArray:
        """(n, 3) tool directions, tip to spindle, in the part frame."""
        return self.kinematics.directions(q)

    def _shifted(self, q: FloatArray, length: float) -> FloatArray:
        out = np.atleast_2d(q).copy()
        out[:, list(self.kinematics.chain.linear)] += (
            self.kinematics.chain.shift_jets(_still(out), length)[:, 0]
        )
        return out

    def programmed(self, q: FloatArray, length: float) -> FloatArray:
        """(n, axes) positions as they are programmed."""
        return self._shifted(q, -length)

    def driven(self, programmed: FloatArray, length: float) -> FloatArray:
        """(n, axes) axis positions of programmed ones."""
        return self._shifted(programmed, length)

    def driven_jets(self, programmed: FloatArray, length: float) -> FloatArray:
        """(n, 3, axes) the same with first and second derivatives."""
        out = programmed.copy()
        out[:, :, list(self.kinematics.chain.linear)] += (
            self.kinematics.chain.shift_jets(programmed, length)
        )
        return out


def _still(rows: FloatArray) -> FloatArray:
    """Jets of points that do not move."""
    out = np.zeros((len(rows), 3, rows.shape[1]))
    out[:, 0] = rows
    return out


__all__ = ["Kinematics", "LengthCorrection", "Pose", "jets"]
