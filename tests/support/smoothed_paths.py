"""Smoothing of rows in tests, and the judgement of every smoothed path."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from cnc_core.blocks import ELEMENT, PIECE, POLYNOMIAL, BlockBatch
from cnc_core.blocks.pool import coefficients, joined
from cnc_core.geometry.shapes.polynomial import derivative, value
from cnc_core.geometry.stages.smoothing import (
    Smoothing,
    SmoothingMachine,
    SmoothingReport,
)
from support.drive import FloatArray

MACHINE = SmoothingMachine((0, 1, 2), 0, 3000.0, 100.0)
FIVE_AXES = SmoothingMachine((0, 1, 2), 0b11000, 3000.0, 100.0)


def smooth(
    rows: Any,
    start: FloatArray,
    tolerance: float,
    chunk: int = 4096,
    machine: SmoothingMachine = MACHINE,
    **more: Any,
) -> tuple[BlockBatch, SmoothingReport]:
    stage = Smoothing(start, machine, tolerance, **more)
    parts = [
        stage.push(BlockBatch(rows[i : i + chunk]))
        for i in range(0, len(rows), chunk)
    ]
    return joined([p for p in [*parts, stage.drain()] if len(p)]), stage.report


def executed(batch: BlockBatch) -> Any:
    rows = batch.rows
    return rows[(rows["type"] <= POLYNOMIAL) & ((rows["flags"] & ELEMENT) == 0)]


def programmed(batch: BlockBatch) -> Any:
    rows = batch.rows
    return rows[(rows["type"] <= POLYNOMIAL) & ((rows["flags"] & PIECE) == 0)]


def sampled(batch: BlockBatch, start: FloatArray, n: int = 8) -> FloatArray:
    """(pieces, n + 1, axes): every executed piece, ends included."""
    rows, axes = executed(batch), len(start)
    curves = coefficients(rows[rows["type"] == POLYNOMIAL], batch.pool, axes)
    out, at, k, w = [], start, 0, np.linspace(0.0, 1.0, n + 1)
    for row in rows:
        end = row["end"][:axes]
        if row["type"] == POLYNOMIAL:
            out.append((curves[k] @ (w ** np.arange(6)[:, None])).T)
            k += 1
        else:
            out.append(at + w[:, None] * (end - at))
        at = end
    return np.array(out)


def distance(corners: FloatArray, points: FloatArray) -> float:
    """Largest distance of the points from the polyline, over all of its chords."""
    a, u = corners[:-1], np.diff(corners, axis=0)
    a, u = a[(u != 0).any(axis=1)], u[(u != 0).any(axis=1)]
    square, worst = (u * u).sum(axis=1), 0.0
    for i in range(0, len(points), 400):
        off = points[i : i + 400, None, :] - a
        t = np.clip((off * u).sum(axis=2) / square, 0.0, 1.0)[..., None]
        worst = max(
            worst, float(np.linalg.norm(off - t * u, axis=2).min(axis=1).max())
        )
    return worst


def judge(
    rows: Any, start: FloatArray, tolerance: float, batch: BlockBatch
) -> FloatArray:
    """What holds of every result; returns the sampled path."""
    axes = len(start)
    corners = np.vstack([start, rows["end"][:, :axes]])
    path = sampled(batch, start)
    points = path.reshape(-1, axes)
    assert distance(corners, points) <= tolerance * (1 + 1e-9)
    assert (
        distance(points, corners) <= tolerance * 1.05
    )  # the path is sampled here
    assert np.abs(path[1:, 0] - path[:-1, -1]).max(initial=0.0) < 1e-9
    assert np.abs(points[-1] - corners[-1]).max() < 1e-9
    pieces = executed(batch)
    covered = np.where(
        pieces["flags"] & PIECE, pieces["value"], pieces["length"]
    )
    assert covered.sum() == pytest.approx(rows["length"].sum(), abs=1e-7)
    same = programmed(batch)
    assert all(
        (same[name] == rows[name]).all()
        for name in ("end", "length", "line", "count", "n", "type")
    )
    return path


def rounded_curve(rng: np.random.Generator, n: int, chord: float) -> FloatArray:
    t = np.cumsum(rng.uniform(0.5, 1.0, n)) * chord / 25
    return np.column_stack(
        [25 * np.cos(t) - 25, 20 * np.sin(1.3 * t), 3 * np.sin(5 * t)]
    ).round(4)


def derivatives(batch: BlockBatch, axes: int = 3) -> FloatArray:
    """(pieces, 2 ends, 2 orders, axes): tangent and curvature vector of successive polynomials."""
    curves = executed(batch)
    coef = coefficients(curves[curves["type"] == POLYNOMIAL], batch.pool, axes)
    out = []
    for w in (0.0, 1.0):
        at = np.full(len(coef), w)
        d1 = value(derivative(coef), at)
        d2 = value(derivative(derivative(coef)), at)
        v = np.linalg.norm(d1, axis=1)[:, None]
        t = d1 / v
        out.append(
            np.stack(
                [t, (d2 - t * (d2 * t).sum(axis=1)[:, None]) / v**2], axis=1
            )
        )
    return np.stack(out, axis=1)
