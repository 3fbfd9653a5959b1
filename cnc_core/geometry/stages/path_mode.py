"""What the programmed feed refers to, how fast corners and arcs are passed:
rows say it, this stage carries it out.

A ``PATH_MODE`` row holds until the next one.  ``code``: the length that F
counts along (``PATH`` .. ``PLANE_OR_ALL``). ``degree``, ``fill_1``: channel
indices of the plane's axes; ``plane``: index of the tangential axis or 255
(each axis outside the plane), ``length`` its largest speed (0: none).
``pool``: the corner test (``NO_TEST`` .. ``SPATIAL_ANGLE``); ``angle``: rad,
larger turns stop; ``radius``: rad, where slowing down begins (0: never);
``value``: smallest factor of the feed at a corner; ``end``: largest change of
direction per axis (0: not tested). ``programmed_radius``: mm/s2 on arcs (0: no
limit).

Corners that stop get ``EXACT_STOP``, corners that slow down ``end_speed``; what
is in force at the motion behind a corner judges it.  Motions that stop at their
end anyway are not judged.  The last motion, and what stands behind it, waits
for the next.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks import (
    BENT,
    CIRCULAR,
    ELEMENT,
    EXACT_STOP,
    FILTER,
    LINEAR,
    PATH_FEED,
    PATH_MODE,
    POLYNOMIAL,
    RAPID,
    STANDSTILL,
    BlockBatch,
    motion_planes,
)
from cnc_core.blocks.pool import joined
from cnc_core.units import AnyArray, FloatArray

Rows = AnyArray
PATH = 0
ALL_AXES = 1
PLANE = 2
PLANE_OR_STOP = 3
ALWAYS_PLANE = 4
PLANE_OR_ALL = 5
NO_TEST = 0
PLANAR = 1
THRESHOLDS = 2
PLANAR_OR_THRESHOLDS = 3
SPATIAL_ANGLE = 4
NO_AXIS = 255
SMALL = 1e-9


@dataclass
class Settings:
    """One ``PATH_MODE`` row, read."""

    code: int = PATH
    axes: tuple[int, int] = (0, 1)
    tangential: int = NO_AXIS
    tangential_speed: float = 0.0
    test: int = NO_TEST
    stop: float = np.inf
    slow: float = 0.0
    floor: float = 0.0
    arc_accel: float = 0.0
    thresholds: FloatArray = field(default_factory=lambda: np.zeros(0))

    @classmethod
    def of(cls, row: Any, count: int) -> Settings:
        return cls(
            int(row["code"]),
            (int(row["degree"]), int(row["fill_1"])),
            int(row["plane"]),
            float(row["length"]),
            int(row["pool"]),
            float(row["angle"]) or np.inf,
            float(row["radius"]),
            float(row["value"]),
            float(row["programmed_radius"]),
            np.array(row["end"][:count]),
        )

    @property
    def acts(self) -> bool:
        return self.code != PATH or self.test != NO_TEST or self.arc_accel > 0.0


def slowing(turn: FloatArray, start: float, floor: float) -> FloatArray:
    """Factor of the feed at corners of ``turn`` rad: 1 up to ``start``, then
    inverse to the angle, not below floor.
    """
    if start <= 0.0:
        return np.ones_like(turn)
    return np.clip(start / np.maximum(turn, SMALL), floor, 1.0)


class NoPathMode:
    """In the place of ``PathMode`` where nobody asks for feeds and stops:
    settings are consumed.
    """

    idle = True

    def push(self, batch: BlockBatch) -> BlockBatch:
        kind = batch.rows["type"]
        mine = (kind == PATH_MODE) | (kind == FILTER)
        if not mine.any():
            return batch
        return BlockBatch(batch.rows[~mine], batch.pool)

    def drain(self) -> BlockBatch:
        return BlockBatch.empty()

    def resync(self, position: FloatArray) -> None:
        pass


class PathMode:
    """Stage behind the filters.

    ``start``: (axes,); ``main``: channel index of X, Y, Z.
    """

    def __init__(self, start: FloatArray, main: tuple[int, int, int]) -> None:
        self._settings = Settings()
        self._main, self._count = main, len(start)
        self._last = start.copy()
        self._held = BlockBatch.empty()
        self._held_start = start.copy()

    @property
    def idle(self) -> bool:
        return not self._settings.acts and not len(self._held)

    def push(self, batch: BlockBatch) -> BlockBatch:
        """Rows whose ends are known; settings are consumed."""
        mine = (batch.rows["type"] == PATH_MODE) | (
            batch.rows["type"] == FILTER
        )
        if not mine.any() and not self._settings.acts:
            return self._passed(batch)
        out, begin = [], 0
        for place in [*np.flatnonzero(mine), len(batch)]:
            out.append(
                self._rows(BlockBatch(batch.rows[begin:place], batch.pool))
            )
            begin = int(place) + 1
            if place < len(batch) and batch.rows["type"][place] == PATH_MODE:
                self._settings = Settings.of(batch.rows[place], self._count)
                out.append(
                    BlockBatch.empty() if self._settings.acts else self.drain()
                )
        return joined([part for part in out if len(part)])

    def drain(self) -> BlockBatch:
        held, self._held = self._held, BlockBatch.empty()
        return held

    def resync(self, position: FloatArray) -> None:
        self._last = position[: self._count].copy()

    def _passed(self, batch: BlockBatch) -> BlockBatch:
        moving = np.flatnonzero(
            (batch.rows["type"] <= POLYNOMIAL)
            & ((batch.rows["flags"] & ELEMENT) == 0)
        )
        if len(moving):
            last = batch.rows["end"][moving[-1]]
            self._last = last[: self._count].copy()
        return batch

    def _rows(self, batch: BlockBatch) -> BlockBatch:
        """Rows under one setting."""
        if not len(batch) or not self._settings.acts:
            return self._passed(batch)
        batch = BlockBatch(batch.rows.copy(), batch.pool)
        moving = np.flatnonzero(
            (batch.rows["type"] <= POLYNOMIAL)
            & ((batch.rows["flags"] & ELEMENT) == 0)
        )
        rows, before = batch.rows[moving], self._last
        if len(moving):
            start = np.vstack(
                [
                    self._last,
                    rows["end"][:-1, : self._count],
                ]
            )
            self._last = rows["end"][-1, : self._count].copy()
            self._feeds(rows, start)
            batch.rows[moving] = rows
        return self._judged(batch, before)

    # feeds

    def _feeds(self, rows: Rows, start: FloatArray) -> None:
        """Path feeds of rows whose F counts along the reference length; arcs
        inside the centrifugal limit.
        """
        settings = self._settings
        delta = rows["end"][:, : self._count] - start
        arc = rows["type"] == CIRCULAR
        curve = np.abs(rows["angle"]) * rows["radius"]
        turning = np.zeros_like(delta, dtype=bool)
        for plane in (17, 18, 19):
            first, second, _ = motion_planes(plane)
            turning[
                np.ix_(
                    arc & (rows["plane"] == plane),
                    [self._main[first], self._main[second]],
                )
            ] = True
        straight = np.where(turning, 0.0, delta)
        whole = np.sqrt(
            (straight**2).sum(axis=1) + np.where(arc, curve, 0.0) ** 2
        )
        inside = np.hypot(
            straight[:, settings.axes[0]], straight[:, settings.axes[1]]
        )
        in_plane = (
            arc & turning[:, settings.axes[0]] & turning[:, settings.axes[1]]
        )
        inside = np.where(in_plane, curve, np.where(arc, whole, inside))
        others = [i for i in range(self._count) if i not in settings.axes]
        outside: npt.NDArray[np.bool_] = np.asarray(
            (np.abs(straight[:, others]) > SMALL).any(axis=1)
        )
        driven = (
            (rows["flags"] & (RAPID | PATH_FEED) == 0)
            & (rows["type"] != POLYNOMIAL)
            & (rows["feed"] > 0)
        )
        length = self._reference(rows, whole, inside, outside)
        rows["feed"] = np.where(
            driven,
            rows["feed"] * rows["length"] / np.maximum(length, SMALL),
            rows["feed"],
        )
        if settings.tangential_speed > 0.0:
            self._transported(rows, delta, whole, length, driven)
        if settings.arc_accel > 0.0:
            most = (
                np.sqrt(settings.arc_accel * np.where(arc, rows["radius"], 0.0))
                * rows["length"]
                / np.maximum(curve, SMALL)
            )
            rows["feed"] = np.where(
                arc & driven, np.minimum(rows["feed"], most), rows["feed"]
            )

    def _reference(
        self,
        rows: Rows,
        whole: FloatArray,
        inside: FloatArray,
        outside: npt.NDArray[np.bool_],
    ) -> FloatArray:
        """(n,) the length that F counts along."""
        code = self._settings.code
        if code == PATH:
            return np.array(rows["length"])
        if code == ALL_AXES:
            return whole
        if code == PLANE_OR_STOP:
            rows["flags"] |= np.where(outside, EXACT_STOP, 0).astype(np.uint16)
            return np.where(outside | (inside < SMALL), whole, inside)
        if code == PLANE_OR_ALL:
            return np.where(outside | (inside < SMALL), whole, inside)
        return np.where(inside < SMALL, whole, inside)

    def _transported(
        self,
        rows: Rows,
        delta: FloatArray,
        whole: FloatArray,
        length: FloatArray,
        driven: npt.NDArray[np.bool_],
    ) -> None:
        """Where a transported axis would be too fast, F counts along all axes."""
        settings = self._settings
        others = [i for i in range(self._count) if i not in settings.axes]
        axes = (
            others if settings.tangential == NO_AXIS else [settings.tangential]
        )
        way = np.abs(delta[:, axes]).max(axis=1, initial=0.0)
        speed = way * rows["feed"] / np.maximum(rows["length"], SMALL)
        fast = driven & (speed > self._settings.tangential_speed)
        rows["feed"] = np.where(
            fast, rows["feed"] * length / np.maximum(whole, SMALL), rows["feed"]
        )

    # corners

    def _judged(self, batch: BlockBatch, start: FloatArray) -> BlockBatch:
        """Corners between the motions known so far; what has to wait is held back.

        ``start``: (axes,) where the batch begins.
        """
        start = self._held_start if len(self._held) else start
        batch = joined([part for part in (self._held, batch) if len(part)])
        self._held = BlockBatch.empty()
        rows = batch.rows
        moving = np.flatnonzero(
            (rows["type"] <= POLYNOMIAL) & ((rows["flags"] & ELEMENT) == 0)
        )
        if not len(moving):
            return batch
        if len(moving) > 1:
            if self._settings.test != NO_TEST:
                self._corners(rows, moving, start)
            start = rows["end"][moving[-2], : self._count].copy()
        last = int(moving[-1])
        stands = (
            rows["flags"][last] & EXACT_STOP
            or (rows["flags"][last + 1 :] & STANDSTILL).any()
        )
        if stands:
            return batch
        self._held = BlockBatch(rows[last:].copy(), batch.pool)
        self._held_start = start
        return BlockBatch(rows[:last], batch.pool)

    def _corners(
        self, rows: Rows, moving: npt.NDArray[np.intp], start: FloatArray
    ) -> None:
        """Stops and slow corners between consecutive motions."""
        motions = rows[moving]
        into, outof = self._tangents(motions, start)
        before, after = outof[:-1], into[1:]
        # the joints of a curve's chords are no corners
        joint = (motions["degree"][1:] == BENT) & (
            motions["type"][1:] == LINEAR
        )
        judged = (motions["flags"][:-1] & EXACT_STOP == 0) & ~joint
        stop, turn = self._test(before, after)
        feeds = np.where(motions["feed"] > 0, motions["feed"], np.inf)
        slower = slowing(
            turn, self._settings.slow, self._settings.floor
        ) * np.minimum(feeds[:-1], feeds[1:])
        slow = (
            judged
            & ~stop
            & (self._settings.slow > 0.0)
            & (turn > self._settings.slow)
            & np.isfinite(slower)
        )
        at = moving[:-1]
        rows["flags"][at] |= np.where(judged & stop, EXACT_STOP, 0).astype(
            np.uint16
        )
        known = rows["end_speed"][at]
        limit = np.where((known > 0) & (known < slower), known, slower)
        rows["end_speed"][at] = np.where(slow, limit, known)

    def _test(
        self, before: FloatArray, after: FloatArray
    ) -> tuple[npt.NDArray[np.bool_], FloatArray]:
        """(n,) corners that stop, and the turns that the rule of slowing down
        counts.
        """
        settings = self._settings
        axes = list(settings.axes)
        a, b = before[:, axes], after[:, axes]
        sizes = np.hypot(*a.T), np.hypot(*b.T)
        flat = (sizes[0] > SMALL) & (sizes[1] > SMALL)
        turn = np.abs(
            plain.directions(
                a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1)
            )
        )
        turn = np.where(flat, turn, 0.0)
        if settings.test == PLANAR:
            return turn > settings.stop + SMALL, turn
        if settings.test == SPATIAL_ANGLE:
            cosine = (before * after).sum(axis=1)
            norms = np.linalg.norm(before, axis=1) * np.linalg.norm(
                after, axis=1
            )
            turn = plain.arc_cosines(
                np.clip(cosine / np.maximum(norms, SMALL), -1.0, 1.0)
            )
            return turn > settings.stop + SMALL, turn
        tested = settings.thresholds > 0
        beyond = np.asarray(
            (
                (np.abs(after - before) > settings.thresholds + SMALL) & tested
            ).any(axis=1)
        )
        if settings.test == THRESHOLDS:
            return beyond, np.zeros_like(turn)
        others = [i for i in range(self._count) if i not in axes]
        outside = (np.abs(before[:, others]) > SMALL).any(axis=1) | (
            np.abs(after[:, others]) > SMALL
        ).any(axis=1)
        return np.where(
            outside, beyond, turn > settings.stop + SMALL
        ), np.where(outside, 0.0, turn)

    def _tangents(
        self, motions: Rows, begin: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Unit directions over all axes at start and end, (n, axes)."""
        ends = motions["end"][:, : self._count]
        start = np.vstack([begin, ends[:-1]])
        into = ends - start
        outof = into.copy()
        for i in np.flatnonzero(motions["type"] == CIRCULAR):
            into[i], outof[i] = self._arc_tangents(
                motions[i], start[i], into[i]
            )
        into /= np.maximum(
            np.linalg.norm(into, axis=1),
            SMALL,
        )[:, None]
        outof /= np.maximum(
            np.linalg.norm(outof, axis=1),
            SMALL,
        )[:, None]
        return into, outof

    def _arc_tangents(
        self, row: Any, start: FloatArray, delta: FloatArray
    ) -> tuple[FloatArray, FloatArray]:
        """Velocities at both ends, as ways over the whole arc."""
        first, second, _ = motion_planes(int(row["plane"]))
        axes = [self._main[first], self._main[second]]
        into, outof = delta.copy(), delta.copy()
        for way, place in (
            (into, start[axes]),
            (outof, row["end"][axes]),
        ):
            radius = place - row["center"]
            normal = np.array([-radius[1], radius[0]])
            way[axes] = float(row["angle"]) * normal
        return into, outof
