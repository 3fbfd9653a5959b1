"""Coordinate systems behind the contour: the stages inside work in programmed
coordinates, their rows are turned.

Compensation and smoothing see the programmed plane; ``COORDINATES`` rows end
what they hold and change the frame.  Smoothing is told how the frame turns and
shapes curves for the axes that drive them.  Lines stay lines.  A circle stays a
circle where its plane stays parallel to two axes.  Any other circle becomes
quintic pieces that leave it by at most ``TOLERANCE``, behind an element that is
the circle.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks import (
    CIRCULAR,
    COORDINATES,
    ELEMENT,
    PIECE,
    POLYNOMIAL,
    TANGENTS,
    BlockBatch,
    motion_planes,
)
from cnc_core.blocks.coordinates import Coordinates, Frame
from cnc_core.blocks.pool import joined
from cnc_core.units import AnyArray, FloatArray

from .paths import Paths
from .pieces import cut, element_rows, merged, piece_rows
from .stage import DropZeroLength, RefusedRow, Stage

TOLERANCE = 1e-6  # mm, of a circle in a tilted plane
SWEEP = np.radians(30.0)  # of one piece of it at most
PLANES = {motion_planes(plane)[:2]: plane for plane in (17, 18, 19)}


class _Turned:
    """Carrier into the coordinates around a frame."""

    def __init__(self, frame: Frame, main: tuple[int, int, int]) -> None:
        present = [place for place, axis in enumerate(main) if axis >= 0]
        self._main = [main[place] for place in present]
        self._rotation = frame.rotation[np.ix_(present, present)]
        self._origin = frame.origin[present]

    def carry(self, jets: FloatArray) -> FloatArray:
        out = jets.copy()
        points = plain.product(jets[:, :, self._main], self._rotation.T)
        points[:, 0] += self._origin
        out[:, :, self._main] = points
        return out

    def miss(self, driven: FloatArray, programmed: FloatArray) -> FloatArray:
        back = plain.product(
            driven[:, self._main] - self._origin, self._rotation
        )
        return np.asarray(
            np.linalg.norm(back - programmed[:, self._main], axis=1)
        )

    def coefficients(self, coef: FloatArray) -> None:
        """Turn (axes, order) in place."""
        points = plain.product(self._rotation, coef[self._main])
        points[:, 0] += self._origin
        coef[self._main] = points


class Frames:
    """Stage around stages: ``inside`` in programmed coordinates, what comes out
    turned by the frame in force.

    ``start``: (axes,) position before the first row.  ``main``: channel index
    of X, Y, Z, -1 where absent.  ``turn``: told the rotation of a new frame, (3,
    3), while nothing is held inside.
    """

    def __init__(
        self,
        inside: Stage,
        start: FloatArray,
        main: tuple[int, int, int],
        turn: Callable[[FloatArray], None],
    ) -> None:
        self._inside = inside
        self._turn = turn
        self._main = main
        self._axes = len(start)
        self._plain: Stage = DropZeroLength()
        self._coordinates = Coordinates()
        # where pieces and elements stand, frame coordinates
        self._driven = start.copy()
        self._element = start.copy()
        # an element of this frame names its tangents
        self._naming = False
        self.deviation = 0.0

    @property
    def idle(self) -> bool:
        coordinates = self._coordinates
        plain = coordinates.frame.identity and not coordinates.ptp
        return plain and self._inside.idle

    def push(self, batch: BlockBatch) -> BlockBatch:
        switches = np.flatnonzero(batch.rows["type"] == COORDINATES)
        if (
            not len(switches)
            and self._coordinates.frame.identity
            and not self._coordinates.ptp
        ):
            self._follow(batch.rows)
            return self._inside.push(batch)
        parts, first = [], 0
        try:
            for at in [*switches, len(batch)]:
                parts.append(
                    self._out(
                        self._stage,
                        BlockBatch(batch.rows[first:at], batch.pool),
                    )
                )
                if at < len(batch):
                    parts.append(
                        self._out(
                            lambda _: self._inside.drain(), BlockBatch.empty()
                        )
                    )
                    parts.append(self._switch(batch.rows[at : at + 1]))
                first = int(at) + 1
        except RefusedRow as refused:
            raise RefusedRow(
                refused.error, joined([*parts, refused.ahead]), refused.count
            ) from None
        return joined(parts)

    def _stage(self, batch: BlockBatch) -> BlockBatch:
        """Through the stages inside; lines of the axes are not smoothed."""
        return (self._plain if self._coordinates.ptp else self._inside).push(
            batch
        )

    def _out(
        self, step: Callable[[BlockBatch], BlockBatch], batch: BlockBatch
    ) -> BlockBatch:
        try:
            return self._turned(step(batch))
        except RefusedRow as refused:
            raise RefusedRow(
                refused.error, self._turned(refused.ahead), refused.count
            ) from None

    def _switch(self, row: AnyArray) -> BlockBatch:
        """A new frame: the position in it is told by the row, which goes on in
        the coordinates around it.
        """
        self._coordinates = Coordinates.of(row[0])
        self._naming = False
        self._driven = row["end"][0][: self._axes].copy()
        self._element = self._driven.copy()
        self._turn(self._coordinates.frame.rotation)
        self._inside.resync(self._driven)
        out = row.copy()
        self._turn_ends(out)
        return BlockBatch(out)

    def _turn_ends(self, rows: AnyArray) -> None:
        frame = self._coordinates.frame
        if frame.identity:
            return
        for place, axis in enumerate(self._main):
            if axis < 0 and (
                frame.rotation[place, place] != 1.0 or frame.origin[place]
            ):
                raise AssertionError("a frame needs its axes")
        present = [place for place, axis in enumerate(self._main) if axis >= 0]
        axes = [self._main[place] for place in present]
        points = np.zeros((len(rows), 3))
        points[:, present] = rows["end"][:, axes]
        rows["end"][:, axes] = frame.outer(points)[:, present]

    def _turned(self, batch: BlockBatch) -> BlockBatch:
        """Rows in the coordinates around the frame."""
        frame, rows = self._coordinates.frame, batch.rows
        if frame.identity or not len(rows):
            self._follow(rows)
            return batch
        starts = self._starts(rows)
        out = rows.copy()
        moving = np.flatnonzero(rows["type"] <= POLYNOMIAL)
        ends = out[moving]
        self._turn_ends(ends)
        out[moving] = ends
        pool = self._turned_pool(out, rows, batch.pool)
        tilted = self._turn_circles(out)
        self._naming |= len(tilted) > 0
        named = self._named(out, tilted)
        if not len(tilted) and not len(named):
            return BlockBatch(out, pool)
        return self._cut_circles(out, rows, starts, (tilted, named), pool)

    def _named(
        self, out: AnyArray, tilted: npt.NDArray[np.int64]
    ) -> npt.NDArray[np.int64]:
        """Elements that name their tangents: tilted circles, and what is
        smoothed behind one.  Nobody else knows where such an element begins.
        """
        flags, kind = out["flags"], out["type"]
        smoothed = (flags & ELEMENT != 0) & (out["degree"] != TANGENTS)
        name = smoothed & (kind <= CIRCULAR) & self._naming
        name[tilted] = flags[tilted] & PIECE == 0
        return np.flatnonzero(name)

    def _starts(self, rows: AnyArray) -> FloatArray:
        """(n, axes) where each motion begins, in the frame; elements and pieces
        each behind their own.
        """
        starts = np.zeros((len(rows), self._axes))
        moving = rows["type"] <= POLYNOMIAL
        ends = rows["end"][:, : self._axes]
        seen = np.flatnonzero(moving & (rows["flags"] & PIECE == 0))
        if len(seen):
            starts[seen] = np.vstack([self._element, ends[seen[:-1]]])
        driven = np.flatnonzero(moving & (rows["flags"] & ELEMENT == 0))
        if len(driven):
            starts[driven] = np.vstack([self._driven, ends[driven[:-1]]])
        self._follow(rows)
        return starts

    def _follow(self, rows: AnyArray) -> None:
        if not len(rows):
            return
        if not (rows["flags"] & (ELEMENT | PIECE)).any():
            moving = (rows["type"] <= POLYNOMIAL).nonzero()[0]
            if len(moving):
                self._driven = rows["end"][moving[-1], : self._axes].copy()
                self._element = self._driven
            return
        for flag, name in ((ELEMENT, "_driven"), (PIECE, "_element")):
            which = np.flatnonzero(
                (rows["type"] <= POLYNOMIAL) & (rows["flags"] & flag == 0)
            )
            if len(which):
                setattr(
                    self,
                    name,
                    rows["end"][which[-1], : self._axes].copy(),
                )

    def _turned_pool(
        self, out: AnyArray, rows: AnyArray, pool: FloatArray
    ) -> FloatArray:
        """Coefficients of polynomials, turned; every polynomial has its own."""
        carrier, turned = _Turned(self._coordinates.frame, self._main), pool
        for i in np.flatnonzero(
            (rows["type"] == POLYNOMIAL) & (rows["flags"] & ELEMENT == 0)
        ):
            order = int(rows["degree"][i]) + 1
            first = int(rows["pool"][i])
            if turned is pool:
                turned = pool.copy()
            coef = (
                pool[first : first + self._axes * order]
                .reshape(self._axes, order)
                .copy()
            )
            carrier.coefficients(coef)
            turned[first : first + self._axes * order] = coef.ravel()
        return turned

    def _turn_circles(self, out: AnyArray) -> npt.NDArray[np.int64]:
        """Circles that stay circles get their plane and centre; the others' places."""
        frame = self._coordinates.frame
        tilted = []
        for i in np.flatnonzero(out["type"] == CIRCULAR):
            first, second, third = motion_planes(int(out["plane"][i]))
            a = frame.rotation[:, first]
            b = frame.rotation[:, second]
            along_a = int(np.argmax(np.abs(a)))
            along_b = int(np.argmax(np.abs(b)))
            places = along_a, along_b
            if abs(a[along_a]) == 1.0 and abs(b[along_b]) == 1.0:
                self._turn_circle(
                    out[i : i + 1], frame, (first, second, third), places
                )
            elif frame.rotation[third, third] == 1.0:
                self._spin_circle(out[i : i + 1], frame, (first, second))
            else:
                tilted.append(i)
        return np.array(tilted, dtype=np.int64)

    @staticmethod
    def _turn_circle(
        row: AnyArray,
        frame: Frame,
        plane: tuple[int, int, int],
        places: tuple[int, int],
    ) -> None:
        """The axes of the plane become axes: another plane, perhaps the other sense."""
        centre = np.zeros(3)
        centre[list(plane[:2])] = row["center"][0]
        centre = frame.outer(centre)
        pair = places if places in PLANES else places[::-1]
        signs = (
            frame.rotation[places[0], plane[0]]
            * frame.rotation[places[1], plane[1]]
        )
        row["plane"] = PLANES[pair]
        row["center"] = centre[list(pair)]
        row["angle"] *= signs * (1.0 if pair == places else -1.0)

    @staticmethod
    def _spin_circle(
        row: AnyArray, frame: Frame, plane: tuple[int, int]
    ) -> None:
        """A turn about the normal of the plane."""
        centre = np.zeros(3)
        centre[list(plane)] = row["center"][0]
        row["center"] = frame.outer(centre)[list(plane)]

    def _cut_circles(
        self,
        out: AnyArray,
        rows: AnyArray,
        starts: FloatArray,
        which: tuple[npt.NDArray[np.int64], npt.NDArray[np.int64]],
        pool: FloatArray,
    ) -> BlockBatch:
        """Elements and pieces in place of the tilted circles, ``which[0]``;
        tangents for the elements ``which[1]``.
        """
        tilted, named = which
        keep = np.setdiff1d(np.arange(len(rows)), np.union1d(tilted, named))
        circles = rows[tilted]
        carrier = _Turned(self._coordinates.frame, self._main)
        driven = np.flatnonzero(circles["flags"] & ELEMENT == 0)
        pools = [pool]
        parts = [(keep, 0, out[keep])]
        if len(named):
            elements, tangents = element_rows(
                out[named],
                Paths(rows[named], starts[named], np.empty(0), self._main),
                len(pool),
            )
            turned = (
                tangents.reshape(-1, 3) @ self._coordinates.frame.rotation.T
            )
            pools.append(turned.ravel())
            parts.append((named, 0, elements))
        if len(driven):
            paths = Paths(
                circles[driven], starts[tilted[driven]], np.empty(0), self._main
            )
            counts = np.ceil(np.abs(circles["angle"][driven]) / SWEEP).astype(
                np.int64
            )
            pieces = cut(paths, np.maximum(counts, 1), carrier, TOLERANCE)
            self.deviation = max(self.deviation, 2.0 * pieces.miss)
            first = sum(map(len, pools))
            parts.append(
                (
                    tilted[driven][pieces.index],
                    1,
                    piece_rows(circles[driven], pieces, first),
                )
            )
            pools.append(pieces.coef.ravel())
        return merged(parts, np.concatenate(pools))

    def drain(self) -> BlockBatch:
        return self._out(lambda _: self._inside.drain(), BlockBatch.empty())

    def resync(self, position: FloatArray) -> None:
        self._driven = position[: self._axes].copy()
        self._element = position[: self._axes].copy()
        self._inside.resync(position)
