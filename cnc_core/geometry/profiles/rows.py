"""Polynomials of channel axes as rows of the waist: coefficients, length, feed,
flags.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core import plain
from cnc_core.blocks import (
    EXACT_STOP,
    LINEAR,
    NC_BLOCK,
    POLYNOMIAL,
    RAPID,
    BlockBatch,
)
from cnc_core.units import AnyArray, FloatArray

NODES, WEIGHTS = np.polynomial.legendre.leggauss(12)
STANDS = 1e-9  # as in c_ext/curve/curve.c
EXACT = 1e-9
HALVINGS = 40
SAME = 1e-9  # mm or degrees by which evaluation may round


def lengths(coef: FloatArray, span: FloatArray, main: list[int]) -> FloatArray:
    """(n,) path length of polynomials (n, axes, order): over the main axes, or
    all others where those rest.
    """
    if not len(span):
        return np.empty(0)
    order = np.arange(coef.shape[2])
    moving = (np.abs(coef[:, :, 1:]) * span[:, None, None] ** order[1:]).sum(
        axis=2
    ) > STANDS
    metric = np.zeros_like(moving)
    metric[:, main] = moving[:, main]
    others = ~metric.any(axis=1)
    metric[others] = moving[others]
    slope = coef[:, :, 1:] * order[1:] * metric[:, :, None]
    return _integral(slope, span)


def _integral(slope: FloatArray, span: FloatArray) -> FloatArray:
    """(n,) integrals of the speed; what is not exact is halved, so that a curve
    that nearly stops somewhere costs a few halvings of that place.
    """
    out = np.zeros(len(span))
    index, begin, size = np.arange(len(span)), np.zeros(len(span)), span
    whole = _quadrature(slope, begin, size)
    for _ in range(HALVINGS):
        size = 0.5 * size
        first = _quadrature(slope[index], begin, size)
        second = _quadrature(slope[index], begin + size, size)
        finer = first + second
        bad = np.abs(finer - whole) > EXACT * (1.0 + finer) * 0.1
        np.add.at(out, index[~bad], finer[~bad])
        begin = np.concatenate([begin[bad], begin[bad] + size[bad]])
        whole = np.concatenate([first[bad], second[bad]])
        index, size = np.tile(index[bad], 2), np.tile(size[bad], 2)
        if not len(index):
            return out
    np.add.at(out, index, whole)
    return out


def _quadrature(
    slope: FloatArray, begin: FloatArray, size: FloatArray
) -> FloatArray:
    t = begin[:, None] + size[:, None] * (0.5 * (NODES + 1.0))
    speed2 = np.zeros_like(t)
    for axis in range(slope.shape[1]):
        if slope[:, axis].any():
            d = np.zeros_like(t)
            for k in range(slope.shape[2] - 1, -1, -1):
                d = d * t + slope[:, axis, k, None]
            speed2 += d * d
    return np.asarray(plain.product(np.sqrt(speed2), 0.5 * WEIGHTS) * size)


def rows_of(
    coef: FloatArray,
    span: FloatArray,
    degree: npt.NDArray[np.int64],
    main: list[int],
    **fields: Any,
) -> BlockBatch:
    """Rows (n,) of polynomials (n, axes, 6); ``fields``: line, n, count, file,
    and feed, mm/s along their path.
    """
    n, axes, order = coef.shape
    rows = np.zeros(n, NC_BLOCK)
    rows["type"] = POLYNOMIAL
    rows["degree"] = degree
    rows["angle"] = span
    rows["end"][:, :axes] = plain.summed(
        "nak,nk->na", coef, plain.powers(span[:, None], np.arange(order))
    )
    begins = coef[1:, :, 0]  # exact points, where evaluation rounds
    ends = rows["end"][:-1, :axes]
    rows["end"][:-1, :axes] = np.where(
        np.abs(ends - begins) < SAME, begins, ends
    )
    rows["length"] = rows["length_min"] = lengths(coef, span, main)
    size = axes * (degree + 1)
    rows["pool"] = (
        np.concatenate(
            [[0], np.cumsum(size)[:-1]],
        )
        if n
        else 0
    )
    pool = np.empty(int(size.sum()))
    for terms in range(1, order + 1):
        which = np.flatnonzero(degree == terms - 1)
        at = rows["pool"][which].astype(np.int64)[:, None] + np.arange(
            axes * terms
        )
        pool[at] = coef[which, :, :terms].reshape(len(which), axes * terms)
    for name, value in fields.items():
        rows[name] = value
    return BlockBatch(rows, pool)


def line_row(
    start: FloatArray,
    end: FloatArray,
    main: list[int],
    rapid: bool,
    **fields: Any,
) -> AnyArray:
    """(1,) a straight line that ends at standstill."""
    row = np.zeros(1, NC_BLOCK)
    moved = end - start
    far = float(np.linalg.norm(moved[main]))
    if far < STANDS:  # what rounding left of it is no length
        far = float(np.linalg.norm(moved))
    row["type"] = LINEAR
    row["length"] = far
    row["length_min"] = far
    row["end"][0, : len(end)] = end
    row["flags"] = EXACT_STOP | (RAPID if rapid else 0)
    for name, value in fields.items():
        row[name] = value
    if rapid:
        row["feed"] = 0.0
    return row
