"""The pool of a batch: coefficients of polynomial rows, batches joined."""

from __future__ import annotations

import numpy as np

from cnc_core.units import AnyArray, FloatArray

from . import NC_BLOCK, POLYNOMIAL, TANGENTS, BlockBatch

ORDER = 6  # coefficients per axis at the most


def coefficients(rows: AnyArray, pool: FloatArray, axes: int) -> FloatArray:
    """(n, axes, 6) of n polynomial rows, zero above each row's degree."""
    out = np.zeros((len(rows), axes, ORDER))
    degrees = rows["degree"]
    for order in range(1, ORDER + 1):
        which = np.flatnonzero(degrees == order - 1)
        first = rows["pool"][which].astype(np.int64)
        at = first[:, None] + np.arange(axes * order)
        out[which, :, :order] = pool[at].reshape(-1, axes, order)
    return out


def rows_joined(parts: list[AnyArray]) -> AnyArray:
    """One behind the other, as bytes: numpy copies such rows member by member."""
    return rows_of(b"".join([part.tobytes() for part in parts]))


def rows_of(raw: bytes) -> AnyArray:
    """Rows of their own from their bytes."""
    return np.frombuffer(bytearray(raw), NC_BLOCK)


def joined(batches: list[BlockBatch]) -> BlockBatch:
    """One batch; the pools are put one behind the other."""
    batches = [batch for batch in batches if len(batch)]
    if len(batches) == 1:
        return batches[0]
    if not batches:
        return BlockBatch.empty()
    parts, at = [], 0
    for batch in batches:
        rows = batch.rows
        owns = (rows["type"] == POLYNOMIAL) | (
            (rows["type"] < POLYNOMIAL) & (rows["degree"] == TANGENTS)
        )
        if at and owns.any():
            rows = rows.copy()
            rows["pool"][owns] += at
        parts.append(rows)
        at += len(batch.pool)
    return BlockBatch(
        rows_joined(parts), np.concatenate([b.pool for b in batches])
    )
