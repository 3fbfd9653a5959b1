"""Motions carried into other coordinates: what the PLC sees stays as
programmed, what is driven are quintic pieces.

A *carrier* maps a motion's positions with their derivatives by path length.
Between two points a quintic that meets both takes its place.  The quintic is
halved until it misses the carried motion by no more than a tolerance.  Pieces
run with the programmed path length (flag ``BY_LENGTH``).  So feed, distances
and look-ahead stay those of the programmed contour.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks import (
    BY_LENGTH,
    ELEMENT,
    EXACT_STOP,
    LINEAR,
    NC_BLOCK,
    PIECE,
    POLYNOMIAL,
    TANGENTS,
    BlockBatch,
)
from cnc_core.units import AnyArray, FloatArray

from ..shapes.polynomial import quintics
from .paths import IntArray, Paths

# of a piece, where the miss is measured; its shape is (x (1 - x))^3 to first
# order
SAMPLES = (0.25, 0.5, 0.75)
HALVINGS = 24
FLOOR = 1e-10  # mm that rounding may miss anyway


class Carrier(Protocol):
    """How motions come into the other coordinates."""

    def carry(self, jets: FloatArray) -> FloatArray:
        """(m, 3, axes) to (m, 3, axes)."""
        ...

    def miss(self, driven: FloatArray, programmed: FloatArray) -> FloatArray:
        """(m,) how far, in mm of the programmed contour, driven positions (m,
        axes) are from programmed ones.
        """
        ...


@dataclass
class Pieces:
    """Quintics of several motions: which motion, length, (axes, 6) over
    0..length, end, largest miss measured.
    """

    index: IntArray
    u0: FloatArray
    length: FloatArray
    coef: FloatArray
    end: FloatArray
    miss: float


class NotCarried(Exception):  # noqa: N818 - a reason, the stage makes the error
    """Motion ``index`` does not become smooth, however short the pieces."""

    def __init__(self, index: int) -> None:
        super().__init__(str(index))
        self.index = index


def cut(
    paths: Paths, counts: IntArray, carrier: Carrier, tolerance: float
) -> Pieces:
    """All motions of ``paths`` in at least counts (n,) pieces each, in order;
    NotCarried.
    """
    index = np.repeat(np.arange(len(counts)), counts)
    place = (
        np.concatenate([np.arange(c) for c in counts])
        if len(counts)
        else np.empty(0)
    )
    u0 = place / counts[index]
    u1 = (place + 1) / counts[index]
    done: list[Pieces] = []
    for _ in range(HALVINGS):
        if not len(index):
            break
        made, good = _tried(paths, index, u0, u1, carrier, tolerance)
        done.append(made)
        index = index[~good]
        u0 = u0[~good]
        u1 = u1[~good]
        middle = 0.5 * (u0 + u1)
        index = np.repeat(index, 2)
        u0 = np.column_stack([u0, middle]).ravel()
        u1 = np.column_stack([middle, u1]).ravel()
    if len(index):
        raise NotCarried(int(index[0]))
    return _sorted(done, paths.axes)


def _tried(
    paths: Paths,
    index: IntArray,
    u0: FloatArray,
    u1: FloatArray,
    carrier: Carrier,
    tolerance: float,
) -> tuple[Pieces, npt.NDArray[np.bool_]]:
    """The pieces that are good enough, and which of the intervals they are."""
    a = carrier.carry(paths.jets(index, u0))
    b = carrier.carry(paths.jets(index, u1))
    length = paths.lengths(index, u0, u1)
    coef = quintics(a, b, length)
    worst = np.zeros(len(index))
    for sample in SAMPLES:
        u = u0 + sample * (u1 - u0)
        s = paths.lengths(index, u0, u)
        driven = plain.summed(
            "nak,nk->na", coef, plain.powers(s[:, None], np.arange(6))
        )
        worst = np.maximum(
            worst, carrier.miss(driven, paths.jets(index, u)[:, 0])
        )
    good = worst <= np.maximum(
        np.minimum(0.5 * tolerance, 1e-5 * length), FLOOR
    )
    most = float(worst[good].max(initial=0.0))
    return Pieces(
        index[good],
        u0[good],
        length[good],
        coef[good],
        b[good, 0],
        most,
    ), good


def _sorted(parts: list[Pieces], axes: int) -> Pieces:
    if not parts:
        nothing = np.empty(0)
        return Pieces(
            np.empty(0, np.int64),
            nothing,
            nothing,
            np.empty((0, axes, 6)),
            np.empty((0, axes)),
            0.0,
        )
    index = np.concatenate([p.index for p in parts])
    u0 = np.concatenate([p.u0 for p in parts])
    order = np.lexsort((u0, index))
    return Pieces(
        index[order],
        u0[order],
        np.concatenate([p.length for p in parts])[order],
        np.concatenate([p.coef for p in parts])[order],
        np.concatenate([p.end for p in parts])[order],
        max(p.miss for p in parts),
    )


def piece_rows(source: AnyArray, pieces: Pieces, first: int) -> AnyArray:
    """Polynomial rows (m,) of ``source`` motions (n,); their coefficients stand
    in the pool from ``first`` on.
    """
    rows = source[pieces.index].copy()
    axes = pieces.end.shape[1]
    rows["type"] = POLYNOMIAL
    rows["degree"] = 5
    rows["angle"] = pieces.length
    rows["length"] = pieces.length
    rows["pool"] = first + axes * 6 * np.arange(len(rows))
    rows["end"][:, :axes] = pieces.end
    _share(rows, source[pieces.index], pieces.length)
    rows["flags"] |= BY_LENGTH
    last = (
        np.append(np.diff(pieces.index) != 0, [True])
        if len(rows)
        else np.empty(0, bool)
    )
    rows["flags"][~last] &= ~np.uint16(EXACT_STOP)
    return rows


def line_rows(source: AnyArray, ends: FloatArray) -> AnyArray:
    """Motions (n,) that are straight lines of the axes to ``ends`` (n, axes)."""
    rows = source.copy()
    rows["type"] = LINEAR
    rows["degree"] = 0
    rows["pool"] = 0
    rows["end"][:, : ends.shape[1]] = ends
    _share(rows, source, source["length"])
    return rows


def _share(rows: AnyArray, source: AnyArray, length: FloatArray) -> None:
    """What each piece covers of the elements, and that it is one."""
    whole = source["flags"] & PIECE != 0
    rows["value"] = np.where(
        whole, source["value"] * length / source["length"], length
    )
    rows["length_min"] = length
    rows["flags"] |= PIECE


def element_rows(
    source: AnyArray, paths: Paths, first: int
) -> tuple[AnyArray, FloatArray]:
    """Motions (n,) as elements with their tangents over the main axes, and the
    pool values (6 n,) from ``first`` on.
    """
    n = len(source)
    index = np.arange(n)
    main = [i for i in paths.main if i >= 0]
    tangents = np.zeros((n, 2, 3))
    where = [k for k, i in enumerate(paths.main) if i >= 0]
    for side, u in enumerate((0.0, 1.0)):
        tangents[:, side, where] = paths.jets(index, np.full(n, u))[:, 1][
            :, main
        ]
    rows = source.copy()
    rows["flags"] |= ELEMENT
    rows["degree"] = TANGENTS
    rows["pool"] = first + 6 * index
    return rows, tangents.ravel()


def merged(
    parts: list[tuple[IntArray, int, AnyArray]], pool: FloatArray
) -> BlockBatch:
    """Rows with their places, in order: (place (m,), rank among rows of the
    same place, rows).
    """
    rows = (
        np.concatenate([r for _, _, r in parts])
        if parts
        else np.empty(0, NC_BLOCK)
    )
    place = np.concatenate([p for p, _, _ in parts]) if parts else np.empty(0)
    rank = (
        np.concatenate(
            [np.full(len(p), k) for p, k, _ in parts],
        )
        if parts
        else np.empty(0)
    )
    order = np.lexsort((np.arange(len(rows)), rank, place))
    return BlockBatch(rows[order], pool)
