"""The stage behind the waist's last geometry: rows of the tool tip become rows
of the machine axes.

A motion goes on as an element and as pieces.  The element is the programmed
contour, which the PLC sees.  Where the rotary axes rest, the piece is a straight
line of the axes.  Else the pieces are quintics by path length of the tip.  They
are halved until the tip leaves its programmed path by at most ``TOLERANCE``.
The path parameter of the pieces is the tip's path length, so the feed is the
tip's.  The engine bounds the feed by the axes' limits, through the exact
derivatives of the pieces.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks import (
    BY_LENGTH,
    BY_PARAMETER,
    CIRCULAR,
    COORDINATES,
    ELEMENT,
    LINEAR,
    OF_TIP,
    PIECE,
    POLYNOMIAL,
    TANGENTS,
    BlockBatch,
)
from cnc_core.blocks.coordinates import Coordinates
from cnc_core.blocks.pool import joined
from cnc_core.errors import ERRORS, CncError, Place
from cnc_core.kinematics.chain import SingularMachine
from cnc_core.kinematics.machine import Kinematics, LengthCorrection
from cnc_core.units import AnyArray, FloatArray

from ..shapes.polynomial import derivative
from .parameter_feed import fastest, stretches
from .paths import IntArray, Paths
from .pieces import (
    NotCarried,
    Pieces,
    cut,
    element_rows,
    line_rows,
    merged,
    piece_rows,
)
from .stage import RefusedRow

TOLERANCE = 1e-4  # mm, of the tool tip
SWEEP = (
    30.0  # degrees that rotary axes and arcs together turn in one piece at most
)
STANDS = 1e-9
# of a polynomial whose parameter runs with time: each shows one mean speed
PARAMETER_PIECES = 4
# of rotary axes; where they turn more, the path parameter is stretched
DEGREES_A_MM = 20.0
NO_KINEMATICS, TOO_CLOSE, ONLY_LINES = 910106, 910104, 910105


class _Driven:
    """Carrier from the tip to the axes."""

    def __init__(
        self, kinematics: Kinematics | LengthCorrection, length: float
    ) -> None:
        self._kinematics, self._length = kinematics, length

    def carry(self, jets: FloatArray) -> FloatArray:
        return self._kinematics.driven_jets(jets, self._length)

    def miss(self, driven: FloatArray, programmed: FloatArray) -> FloatArray:
        tip = self._kinematics.forward(driven, self._length).tip
        return np.asarray(
            np.linalg.norm(
                tip - programmed[:, list(self._kinematics.tip_axes)], axis=1
            )
        )


class KinematicsStage:
    """``machines``: kinematics by number.  ``start``: (axes,) position of the
    axes.  ``place``: of (file, line). ``tolerance``: mm, how far the tip may
    leave its path now.

    ``deviation``: mm, bound of what the tip has left its programmed path by so
    far.  ``used``: there was one.
    """

    def __init__(
        self,
        machines: Mapping[int, Kinematics],
        start: FloatArray,
        main: tuple[int, int, int],
        place: Callable[[int, int], Place],
        tolerance: Callable[[], float] = lambda: TOLERANCE,
    ) -> None:
        self._machines, self._main, self._place = machines, main, place
        self._tolerance = tolerance
        self._count = len(start)
        self._kinematics: Kinematics | LengthCorrection | None = None
        self._length, self._ptp = 0.0, False
        self._axes = start.copy()  # where the machine stands
        self._tip = start.copy()  # the same, programmed
        self._element = start.copy()  # where the elements stand, programmed
        self.deviation, self.used = 0.0, False

    @property
    def idle(self) -> bool:
        return self._kinematics is None

    def push(self, batch: BlockBatch) -> BlockBatch:
        switches = np.flatnonzero(batch.rows["type"] == COORDINATES)
        if not len(switches) and self._kinematics is None:
            self._follow(batch.rows)
            return batch
        parts: list[BlockBatch] = []
        first = 0
        try:
            for at in [*switches, len(batch)]:
                parts.append(
                    self._segment(BlockBatch(batch.rows[first:at], batch.pool))
                )
                if at < len(batch):
                    self._switch(batch.rows[at])
                first = int(at) + 1
        except RefusedRow as refused:
            raise RefusedRow(
                refused.error, joined([*parts, refused.ahead]), refused.count
            ) from None
        return joined(parts)

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        """``position`` is programmed."""
        self._tip = self._element = position[: self._count].copy()
        self._axes = (
            self._tip
            if self._kinematics is None
            else self._kinematics.driven(self._tip, self._length)[0]
        )

    def _switch(self, row: Any) -> None:
        """Other coordinates; the axes stay where they are."""
        chosen = Coordinates.of(row)
        if chosen.kinematics is None:
            self._kinematics = None
        elif chosen.kinematics in self._machines:
            machine = self._machines[chosen.kinematics]
            self._kinematics = (
                machine.length_correction() if chosen.length_only else machine
            )
            self.used = True
        else:
            raise self._refused(row, NO_KINEMATICS, BlockBatch.empty())
        self._length, self._ptp = chosen.length, chosen.ptp
        self._tip = self._axes
        if self._kinematics is not None:
            self._tip = self._kinematics.programmed(self._axes, self._length)[0]
        self._element = self._tip.copy()

    def _refused(self, row: Any, number: int, ahead: BlockBatch) -> RefusedRow:
        error = CncError(
            number,
            ERRORS[number],
            self._place(int(row["file"]), int(row["line"])),
        )
        return RefusedRow(error, ahead, int(row["count"]))

    def _follow(self, rows: AnyArray) -> None:
        """No transformation: axes are programmed."""
        driven = np.flatnonzero(
            (rows["type"] <= POLYNOMIAL) & (rows["flags"] & ELEMENT == 0)
        )
        if len(driven):
            self._axes = rows["end"][driven[-1], : self._count].copy()
            self._tip = self._element = self._axes

    def _segment(self, batch: BlockBatch) -> BlockBatch:
        """Rows between two switches."""
        if self._kinematics is None:
            self._follow(batch.rows)
            return batch
        if not (batch.rows["type"] <= POLYNOMIAL).any():
            return batch
        return self._points(batch) if self._ptp else self._paths(batch)

    # lines of the axes

    def _points(self, batch: BlockBatch) -> BlockBatch:
        """#PTP: every motion is a straight line of the axes to its end."""
        assert self._kinematics is not None
        rows = batch.rows
        moving = np.flatnonzero(batch.rows["type"] <= POLYNOMIAL)
        wrong = moving[rows["type"][moving] != LINEAR]
        if len(wrong):
            ahead = self._segment(BlockBatch(rows[: wrong[0]], batch.pool))
            raise self._refused(rows[wrong[0]], ONLY_LINES, ahead)
        out = rows.copy()
        ends = self._driven_ends(rows, moving, batch)
        length = self._axis_lengths(
            np.vstack([self._axes, ends[:-1]]),
            ends,
        )
        whole = out[moving]
        whole["end"][:, : self._count] = ends
        whole["length"] = whole["length_min"] = length
        out[moving] = whole
        self._axes = ends[-1].copy()
        self._tip = rows["end"][moving[-1], : self._count].copy()
        self._element = self._axes
        keep = np.ones(len(out), dtype=bool)
        keep[moving] = length > 0.0
        return BlockBatch(out[keep], batch.pool)

    def _axis_lengths(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Over the main axes, over the others where those rest, as in the waist."""
        moved = ends - starts
        main = [i for i in self._main if i >= 0]
        others = [i for i in range(self._count) if i not in main]
        over_main, over_others = (
            np.linalg.norm(moved[:, which], axis=1) for which in (main, others)
        )
        return np.where(
            over_main >= STANDS,
            over_main,
            np.where(over_others >= STANDS, over_others, 0.0),
        )

    def _driven_ends(
        self, rows: AnyArray, moving: IntArray, batch: BlockBatch
    ) -> FloatArray:
        """Axis positions at the ends of the motions ``moving``."""
        assert self._kinematics is not None
        try:
            return self._kinematics.driven(
                rows["end"][moving, : self._count], self._length
            )
        except SingularMachine as singular:
            raise self._refused_at(
                int(moving[singular.row]), singular.code, batch
            ) from None

    def _refused_at(
        self, at: int, number: int, batch: BlockBatch
    ) -> RefusedRow:
        """The row is refused; the rows ahead of its block go on."""
        row = batch.rows[at]
        first = at
        while first and batch.rows["count"][first - 1] == row["count"]:
            first -= 1
        return self._refused(
            row,
            number,
            self._segment(BlockBatch(batch.rows[:first], batch.pool)),
        )

    # paths of the tip

    def _paths(self, batch: BlockBatch) -> BlockBatch:
        assert self._kinematics is not None
        rows, kinematics = batch.rows, self._kinematics
        moving = rows["type"] <= POLYNOMIAL
        driven = np.flatnonzero(moving & (rows["flags"] & ELEMENT == 0))
        seen = np.flatnonzero(moving & (rows["flags"] & PIECE == 0))
        ends = rows["end"][:, : self._count]
        parts: list[tuple[IntArray, int, AnyArray]] = []
        other = np.flatnonzero(~moving)
        parts.append((other, 0, rows[other]))
        pools: list[FloatArray] = [np.empty(0)]
        if len(driven):
            axis_ends = self._driven_ends(rows, driven, batch)
            starts = np.vstack([self._tip, ends[driven[:-1]]])
            straight = self._straight(rows[driven], starts, ends[driven])
            lines, curves = np.flatnonzero(straight), np.flatnonzero(~straight)
            parts.append(
                (
                    driven[lines],
                    1,
                    line_rows(rows[driven[lines]], axis_ends[lines]),
                )
            )
            if len(curves):
                parts.append(
                    self._curves(
                        batch, driven[curves], starts[curves], kinematics, pools
                    )
                )
        if len(seen):
            self._elements(
                batch,
                seen,
                np.vstack([self._element, ends[seen[:-1]]]),
                parts,
                pools,
            )
            self._element = ends[seen[-1]].copy()
        if len(driven):
            self._axes = axis_ends[-1].copy()
            self._tip = ends[driven[-1]].copy()
        return merged(parts, np.concatenate(pools))

    def _straight(
        self, rows: AnyArray, starts: FloatArray, ends: FloatArray
    ) -> npt.NDArray[np.bool_]:
        """Lines during which no rotary axis of the chain moves are lines of the
        axes too.
        """
        assert self._kinematics is not None
        rotary = list(self._kinematics.rotary_axes)
        rests = (starts[:, rotary] == ends[:, rotary]).all(axis=1)
        return np.asarray((rows["type"] == LINEAR) & rests)

    def _curves(
        self,
        batch: BlockBatch,
        which: IntArray,
        starts: FloatArray,
        kinematics: Kinematics | LengthCorrection,
        pools: list[FloatArray],
    ) -> tuple[IntArray, int, AnyArray]:
        """Pieces of the motions ``which``."""
        rows = _by_parameter(batch.rows[which])
        paths = Paths(rows, starts, batch.pool, self._main)
        rotary = list(kinematics.rotary_axes)
        sweep = np.abs(
            rows["end"][:, rotary] - starts[:, rotary],
        ).sum(axis=1)
        sweep += np.where(
            rows["type"] == CIRCULAR, np.degrees(np.abs(rows["angle"])), 0.0
        )
        least = np.where(rows["flags"] & BY_PARAMETER != 0, PARAMETER_PIECES, 1)
        counts = np.maximum(np.ceil(sweep / SWEEP), least).astype(np.int64)
        try:
            pieces = cut(
                paths,
                counts,
                _Driven(kinematics, self._length),
                self._tolerance(),
            )
        except NotCarried as reason:
            raise self._refused_at(
                int(which[reason.index]), TOO_CLOSE, batch
            ) from None
        except SingularMachine:
            raise self._refused_at(
                self._first_singular(batch, which, starts), 910103, batch
            ) from None
        self.deviation = max(self.deviation, 2.0 * pieces.miss)
        made = piece_rows(rows, pieces, sum(map(len, pools)))
        self._cover_tip(made, pieces, batch.rows[which], starts, batch.pool)
        stretch = self._stretch(rows, starts)[pieces.index]
        for name in ("length", "length_min", "angle", "feed"):
            made[name] *= stretch
        pools.append(
            (
                pieces.coef / plain.powers(stretch[:, None, None], np.arange(6))
            ).ravel()
        )
        return which[pieces.index], 1, made

    def _cover_tip(
        self,
        made: AnyArray,
        pieces: Pieces,
        rows: AnyArray,
        starts: FloatArray,
        pool: FloatArray,
    ) -> None:
        """What pieces that run with the parameter of their polynomial cover of
        the tip's path, mm.
        """
        which = np.flatnonzero(made["flags"] & BY_PARAMETER != 0)
        if not len(which):
            return
        index, u0 = pieces.index[which], pieces.u0[which]
        u1 = np.minimum(
            u0
            + pieces.length[which] / (rows["angle"] * stretches(rows))[index],
            1.0,
        )
        covered = Paths(rows, starts, pool, self._main).lengths(index, u0, u1)
        total = np.bincount(index, covered, len(rows))
        made["value"][which] = covered * rows["length"][index] / total[index]
        made["flags"][which] |= OF_TIP

    def _stretch(self, rows: AnyArray, starts: FloatArray) -> FloatArray:
        """(n,) factor of the path parameter: it stays a good measure where
        rotary axes turn about a resting tip.
        """
        assert self._kinematics is not None
        rotary = list(self._kinematics.rotary_axes)
        turn = np.abs(
            rows["end"][:, rotary] - starts[:, rotary],
        ).sum(axis=1)
        stretch = np.maximum(1.0, turn / (DEGREES_A_MM * rows["length"]))
        return np.where(rows["flags"] & BY_PARAMETER != 0, 1.0, stretch)

    def _first_singular(
        self, batch: BlockBatch, which: IntArray, starts: FloatArray
    ) -> int:
        """Which of the motions meets a singular position."""
        for k, at in enumerate(which):
            paths = Paths(
                batch.rows[at : at + 1],
                starts[k : k + 1],
                batch.pool,
                self._main,
            )
            u = np.linspace(0.0, 1.0, 257)
            try:
                assert self._kinematics is not None
                self._kinematics.driven_jets(
                    paths.jets(np.zeros(len(u), np.int64), u), self._length
                )
            except SingularMachine:
                return int(at)
        return int(which[0])

    def _elements(
        self,
        batch: BlockBatch,
        seen: IntArray,
        starts: FloatArray,
        parts: list[tuple[IntArray, int, AnyArray]],
        pools: list[FloatArray],
    ) -> None:
        """What the PLC sees, with its tangents; elements that have them already
        keep them.
        """
        rows = batch.rows[seen]
        named = (rows["flags"] & ELEMENT != 0) & (rows["degree"] == TANGENTS)
        at = sum(map(len, pools))
        if named.any():
            mine = rows[named].copy()
            values = batch.pool[
                mine["pool"].astype(np.int64)[:, None] + np.arange(6)
            ]
            mine["pool"] = at + 6 * np.arange(len(mine))
            parts.append((seen[named], 0, mine))
            pools.append(values.ravel())
            at += values.size
        if not named.all():
            fresh = ~named
            paths = Paths(rows[fresh], starts[fresh], batch.pool, self._main)
            made, tangents = element_rows(rows[fresh], paths, at)
            # as that of the pieces
            made["feed"] *= self._stretch(rows[fresh], starts[fresh])
            curves = np.flatnonzero(made["flags"] & BY_PARAMETER != 0)
            slope = derivative(paths.coef[paths.curve[curves]])
            span = made["angle"][curves]
            made["feed"][curves] = rows[fresh]["feed"][curves] * fastest(
                slope, span, [i for i in self._main if i >= 0]
            )
            made["flags"] &= ~np.uint16(BY_PARAMETER)
            parts.append((seen[fresh], 0, made))
            pools.append(tangents)


def _by_parameter(rows: AnyArray) -> AnyArray:
    """Motions whose path is to be their parameter, where they are flagged so."""
    flagged = rows["flags"] & BY_PARAMETER != 0
    if not flagged.any():
        return rows
    out = rows.copy()
    out["flags"][flagged] |= BY_LENGTH
    stretch = stretches(rows)[flagged]
    out["length"][flagged] = rows["angle"][flagged] * stretch
    out["feed"][flagged] *= stretch
    return out


class ProgrammedView:
    """The rows ahead of the kinematics, for those who look at the program; what
    they become is checked behind it.
    """

    def __init__(self, behind: Any) -> None:
        self._behind = behind

    @property
    def idle(self) -> bool:
        return bool(self._behind.idle)

    def push(self, batch: BlockBatch) -> BlockBatch:
        rows = batch.rows
        try:
            self._behind.push(batch)
        except RefusedRow as refused:
            mine = np.flatnonzero(rows["count"] == refused.count)
            rows = rows[: mine[0]] if len(mine) else rows[:0]
            raise RefusedRow(
                refused.error, BlockBatch(rows, batch.pool), refused.count
            ) from None
        return batch

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        self._behind.resync(position)
