"""Programmed polynomials and B-splines as the intervals of a profile."""

from __future__ import annotations

import numpy as np

from cnc_core.blocks.profile_columns import ProfileChunk
from cnc_core.units import FloatArray

from ..shapes import bspline
from .curves import Intervals


def of_polynomials(chunk: ProfileChunk) -> Intervals:
    rapid = np.zeros(len(chunk), np.bool_)
    return Intervals(
        _padded(chunk.coef),
        chunk.span,
        chunk.feed,
        chunk.after.copy(),
        rapid,
        chunk.line,
        chunk.number,
    )


def of_bspline(chunk: ProfileChunk) -> Intervals:
    """Spans take feed and line of the control point in their middle."""
    degree = chunk.spec.degree
    coef, length, number = bspline.spans(chunk.values, chunk.knots, degree)
    at = number - degree + (degree + 1) // 2
    after = np.zeros(len(length), np.int64)
    after[-1] = chunk.after[-1]
    rapid = np.zeros(len(length), np.bool_)
    return Intervals(
        _padded(coef),
        length,
        chunk.feed[at],
        after,
        rapid,
        chunk.line[at],
        chunk.number[at],
    )


def _padded(coef: FloatArray) -> FloatArray:
    """A copy of the order that joining pieces have."""
    return np.concatenate(
        [
            coef,
            np.zeros(
                (
                    *coef.shape[:2],
                    6 - coef.shape[2],
                )
            ),
        ],
        axis=2,
    )
