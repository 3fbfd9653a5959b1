"""Interpolating splines through points, cubic (C2) and quintic (C4), solved in
windows: a curve may have any length.

The unknowns of a knot are its first derivative (cubic) or its first and second
(quintic).  They follow from a block tridiagonal system whose solution at a knot
depends on knots far away by less than rounding: a window of ``CORE`` knots with
``HALO`` knots on either side gives the same values as the whole curve does.
Windows of one batch are solved side by side.  Every knot belongs to one window,
so neighbouring polynomials share their values exactly.

Free ends: second derivative 0 (cubic), third and fourth derivative 0 (quintic).
A clamped start has a given first derivative.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cnc_core import plain
from cnc_core.units import FloatArray

CORE, HALO = 128, 48


@dataclass
class Window:
    """Knots of a stretch of a curve.

    ``points`` (n, columns), ``steps`` (n - 1,) of the parameter.

    ``core``: knots whose derivatives are wanted.  ``clamp``: (columns,) first
    derivative at the first knot.
    """

    points: FloatArray
    steps: FloatArray
    core: slice
    clamp: FloatArray | None = None


def derivatives(windows: list[Window], degree: int) -> list[FloatArray]:
    """(core, 2, columns) first and second derivatives of each window's core
    knots; ``degree`` 3 or 5.
    """
    if not windows:
        return []
    states = _solved(windows, degree)
    out = []
    for k, window in enumerate(windows):
        state = states[: len(window.points), k]
        whole = state if degree == 5 else _with_second(window, state[:, 0])
        out.append(whole[window.core])
    return out


def _with_second(window: Window, slope: FloatArray) -> FloatArray:
    """Cubic: the second derivative that both neighbours share, (n, 2, columns)."""
    h = window.steps[:, None]
    chord = np.diff(window.points, axis=0) / h
    begins, ends = slope[:-1], slope[1:]
    second = (6.0 * chord - 4.0 * begins - 2.0 * ends) / h
    bend = -6.0 * chord[-1:] + 2.0 * slope[-2:-1] + 4.0 * slope[-1:]
    last = bend / h[-1:]
    return np.stack([slope, np.concatenate([second, last])], axis=1)


def _solved(windows: list[Window], degree: int) -> FloatArray:
    """(knots, windows, unknowns, columns); windows shorter than the longest are
    filled up with zeros.
    """
    size, count = (2 if degree == 5 else 1), len(windows)
    longest = max(len(w.points) for w in windows)
    columns = windows[0].points.shape[1]
    before = np.zeros((longest, count, size, size))
    middle = np.tile(np.eye(size), (longest, count, 1, 1))
    behind = np.zeros((longest, count, size, size))
    right = np.zeros((longest, count, size, columns))
    fill = _quintic if degree == 5 else _cubic
    for k, window in enumerate(windows):
        n = len(window.points)
        fill(
            window,
            before[:n, k],
            middle[:n, k],
            behind[:n, k],
            right[:n, k],
        )
    for i in range(1, longest):
        solved = plain.solve(
            middle[i - 1], np.concatenate([behind[i - 1], right[i - 1]], axis=2)
        )
        taken = plain.product(before[i], solved)
        middle[i] -= taken[..., :size]
        right[i] -= taken[..., size:]
    right[-1] = plain.solve(middle[-1], right[-1])
    for i in range(longest - 2, -1, -1):
        right[i] = plain.solve(
            middle[i], right[i] - plain.product(behind[i], right[i + 1])
        )
    return right


def _cubic(
    w: Window,
    before: FloatArray,
    middle: FloatArray,
    behind: FloatArray,
    right: FloatArray,
) -> None:
    h = w.steps
    moved = np.diff(w.points, axis=0)
    pull = 3.0 * moved / (h * h)[:, None]
    middle[:, 0, 0] = 0.0
    middle[:-1, 0, 0] += 2.0 / h
    middle[1:, 0, 0] += 2.0 / h
    before[1:, 0, 0] = 1.0 / h
    behind[:-1, 0, 0] = 1.0 / h
    right[:-1, 0] += pull
    right[1:, 0] += pull
    if w.clamp is not None:
        middle[0, 0, 0] = 1.0
        behind[0, 0, 0] = 0.0
        right[0, 0] = w.clamp


def _quintic(
    w: Window,
    before: FloatArray,
    middle: FloatArray,
    behind: FloatArray,
    right: FloatArray,
) -> None:
    """Jumps of the fourth (first row, negative) and third derivative are 0; at
    free ends the derivatives themselves.
    """
    h = w.steps
    moved = np.diff(w.points, axis=0)
    h2, h3 = h * h, h * h * h
    middle[:] = 0.0
    # what the interval ahead of a knot adds, then the one behind it
    middle[1:, 0, 0] += 192.0 / h3
    middle[1:, 0, 1] -= 36.0 / h2
    middle[1:, 1, 0] -= 36.0 / h2
    middle[1:, 1, 1] += 9.0 / h
    before[1:, 0, 0] = 168.0 / h3
    before[1:, 0, 1] = 24.0 / h2
    before[1:, 1, 0] = -24.0 / h2
    before[1:, 1, 1] = -3.0 / h
    middle[:-1, 0, 0] += 192.0 / h3
    middle[:-1, 0, 1] += 36.0 / h2
    middle[:-1, 1, 0] += 36.0 / h2
    middle[:-1, 1, 1] += 9.0 / h
    behind[:-1, 0, 0] = 168.0 / h3
    behind[:-1, 0, 1] = -24.0 / h2
    behind[:-1, 1, 0] = 24.0 / h2
    behind[:-1, 1, 1] = -3.0 / h
    fourth = 360.0 * moved / (h2 * h2)[:, None]
    third = 60.0 * moved / h3[:, None]
    right[1:, 0] += fourth
    right[1:, 1] -= third
    right[:-1, 0] += fourth
    right[:-1, 1] += third
    if w.clamp is not None:
        middle[0, 0] = (1.0, 0.0)
        behind[0, 0] = 0.0
        right[0, 0] = w.clamp


def hermite(
    points: FloatArray, states: FloatArray, steps: FloatArray
) -> FloatArray:
    """(n - 1, columns, 6) quintics over 0..steps that meet points (n, columns)
    and states (n, 2, columns).

    Where the data are those of a cubic the highest coefficients come out as
    rounding.
    """
    return quintic(
        points[:-1],
        points[1:],
        states[:-1],
        states[1:],
        steps,
    )


def quintic(
    p0: FloatArray,
    p1: FloatArray,
    s0: FloatArray,
    s1: FloatArray,
    steps: FloatArray,
) -> FloatArray:
    """(n, columns, 6) quintics over 0..steps (n,) of values (n, columns),
    derivatives (n, 2, columns) at both ends.
    """
    h = steps[:, None]
    moved = p1 - p0
    d0 = s0[:, 0] * h
    d1 = s1[:, 0] * h
    c0 = s0[:, 1] * h * h
    c1 = s1[:, 1] * h * h
    a3 = 10.0 * moved - 6.0 * d0 - 4.0 * d1 - 1.5 * c0 + 0.5 * c1
    a4 = -15.0 * moved + 8.0 * d0 + 7.0 * d1 + 1.5 * c0 - c1
    a5 = 6.0 * moved - 3.0 * (d0 + d1) - 0.5 * (c0 - c1)
    coef = np.stack(
        [p0, d0, 0.5 * c0, a3, a4, a5],
        axis=2,
    )
    return np.asarray(coef / plain.powers(steps[:, None, None], np.arange(6)))


def cubic(
    points: FloatArray, states: FloatArray, steps: FloatArray
) -> FloatArray:
    """(n - 1, columns, 6) cubics (highest coefficients 0) that meet points and
    slopes.
    """
    h = steps[:, None]
    moved = np.diff(points, axis=0)
    d0 = states[:-1, 0] * h
    d1 = states[1:, 0] * h
    zero = np.zeros_like(moved)
    coef = np.stack(
        [
            points[:-1],
            d0,
            3.0 * moved - 2.0 * d0 - d1,
            d0 + d1 - 2.0 * moved,
            zero,
            zero,
        ],
        axis=2,
    )
    return np.asarray(coef / plain.powers(steps[:, None, None], np.arange(6)))
