"""The path of the input that the optimizer may not leave: chords between
points, or the curve the NC would drive.

Points that stand close together keep the curve near its chords.  There the
chords are the reference.  Sparse points and unmarked corners let the curve bend
away from its chords.  There the reference is the curve, as a fine polyline.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from cnc_core.units import FloatArray

from ..geometry.profiles import jets, spline
from ..geometry.profiles.curves import steps_of

IntArray = npt.NDArray[np.int64]
LOOKS = 8  # at the driven curve over each chord
BENT_LEAST = 4  # pieces of a bent chord
HALVINGS = 10
FINE = 40.0  # .. halved until they lie within this part of the tolerance of the curve
STRAIGHT = 2  # of a straight one
# of the tolerance: a curve nearer than that to its chord counts as the chord
STRAIGHT_SHARE = 0.2


@dataclass
class Reference:
    """``values`` (n, columns) of the vertices, ``u`` (n,) their parameter,
    ``point`` (n,): number of the input's point at or ahead of each, ``weight``
    (n,) of each in a fit, ``given`` (n,): it is a point of the input.
    """

    values: FloatArray
    u: FloatArray
    point: IntArray
    weight: FloatArray
    given: npt.NDArray[np.bool_]

    def __getitem__(self, which: slice) -> Reference:
        return Reference(
            self.values[which],
            self.u[which],
            self.point[which],
            self.weight[which],
            self.given[which],
        )


@dataclass
class Driven:
    """The curve that the NC puts through the points: polynomials (n, columns,
    6) over ``steps`` (n,).
    """

    coef: FloatArray
    steps: FloatArray


def driven(
    values: FloatArray, linear: list[int], degree: int, begin: FloatArray | None
) -> Driven:
    """The curve through all points of a section; ``begin``: (2, columns) value
    and direction behind G62.
    """
    steps = np.maximum(steps_of(values, linear), 1e-9)
    degree = 3 if len(values) == 2 else degree
    windows = []
    for first in range(0, len(values), spline.CORE):
        low = max(0, first - spline.HALO)
        high = min(len(values), first + spline.CORE + spline.HALO)
        stop = min(first + spline.CORE, len(values))
        clamp = None
        if low == 0 and begin is not None:
            clamp = (
                begin[1]
                * float(np.linalg.norm((values[1] - values[0])[linear]))
                / steps[0]
            )
        windows.append(
            spline.Window(
                values[low:high],
                steps[low : high - 1],
                slice(first - low, stop - low),
                clamp,
            )
        )
    states = np.concatenate(spline.derivatives(windows, degree))
    return Driven(
        (spline.cubic if degree == 3 else spline.hermite)(
            values, states, steps
        ),
        steps,
    )


def _off_chords(made: Driven, xyz: FloatArray, linear: list[int]) -> FloatArray:
    """(n - 1,) how far the driven curve bends away from each chord."""
    off = np.zeros(len(xyz) - 1)
    line = np.diff(xyz, axis=0)
    square = np.maximum((line * line).sum(axis=1), 1e-300)
    for k in range(1, LOOKS):
        away = (
            jets.of_columns(
                made.coef[:, linear],
                k / LOOKS * made.steps,
            )[:, 0]
            - xyz[:-1]
        )
        along = np.clip((away * line).sum(axis=1) / square, 0.0, 1.0)
        off = np.maximum(
            off, np.linalg.norm(away - along[:, None] * line, axis=1)
        )
    return off


def _split(
    made: Driven, linear: list[int], sagitta: float, bent: npt.NDArray[np.bool_]
) -> tuple[IntArray, FloatArray]:
    """Number of the chord and share of its parameter of every vertex but the
    last: bent chords are halved until their pieces lie within ``sagitta`` of
    the curve, straight ones once.
    """
    chord = np.repeat(
        np.arange(len(bent)), np.where(bent, BENT_LEAST, STRAIGHT)
    )
    low = np.concatenate(
        [
            np.arange(BENT_LEAST) / BENT_LEAST
            if b
            else np.arange(STRAIGHT) / STRAIGHT
            for b in bent
        ]
    )
    width = np.where(bent, 1.0 / BENT_LEAST, 1.0 / STRAIGHT)[chord]
    open_ = bent[chord]
    for _ in range(HALVINGS):
        k = np.flatnonzero(open_)
        if not len(k):
            break
        at = (low[k] + width[k] * w for w in (0.0, 0.5, 1.0))
        a, m, b = (
            jets.of_columns(
                made.coef[chord[k]][:, linear], x * made.steps[chord[k]]
            )[:, 0]
            for x in at
        )
        line = b - a
        along = ((m - a) * line).sum(axis=1) / np.maximum(
            (line * line).sum(axis=1), 1e-300
        )
        wide = (
            np.linalg.norm(
                m - a - np.clip(along, 0.0, 1.0)[:, None] * line, axis=1
            )
            > sagitta
        )
        open_[k] = wide
        k = k[wide]
        width[k] *= 0.5
        chord = np.append(chord, chord[k])
        low = np.append(low, low[k] + width[k])
        width = np.append(width, width[k])
        open_ = np.append(open_, np.ones(len(k), np.bool_))
    order = np.lexsort((low, chord))
    return chord[order], low[order]


def reference_of(
    values: FloatArray, linear: list[int], tolerance: float, made: Driven
) -> Reference:
    """The reference of one section."""
    off = _off_chords(made, values[:, linear], linear)
    bent = (off > STRAIGHT_SHARE * tolerance) & (
        np.diff(values[:, linear], axis=0) ** 2 > 0.0
    ).any(axis=1)
    point, share = _split(made, linear, tolerance / FINE, bent)
    ways = np.diff(values, axis=0)
    out = values[point] + share[:, None] * ways[point]
    curved = bent[point] & (share > 0.0)
    out[curved] = jets.of_columns(
        made.coef[point[curved]], share[curved] * made.steps[point[curved]]
    )[:, 0]
    out = np.vstack([out, values[-1:]])
    given = np.append(share == 0.0, True)
    point = np.append(point, len(values) - 1)
    u = parameter(out, linear)
    weight = np.zeros(len(out))
    half = 0.5 * np.diff(u)
    weight[:-1] += half
    weight[1:] += half
    return Reference(out, u, point, np.maximum(weight, 1e-12), given)


def by_length(
    made: Driven, linear: list[int], pieces: int
) -> tuple[FloatArray, FloatArray]:
    """(n pieces, columns, 6) and (n pieces,): quintics over the length of the
    driven curve, C2, that meet its value, direction and curvature in every
    point and ``pieces`` - 1 times in between.
    """
    n = len(made.steps)
    share = np.tile(np.arange(pieces) / pieces, n) * np.repeat(
        made.steps, pieces
    )
    coef = np.concatenate(
        [np.repeat(made.coef, pieces, axis=0), made.coef[-1:]]
    )
    j = jets.of_columns(coef, np.append(share, made.steps[-1]))
    speed = np.linalg.norm(j[:, 1][:, linear], axis=1)
    speed = np.where(
        speed > 1e-9,
        speed,
        np.maximum(
            np.linalg.norm(j[:, 1], axis=1),
            1e-12,
        ),
    )[:, None]
    gain = (j[:, 1][:, linear] * j[:, 2][:, linear]).sum(axis=1)[
        :, None
    ] / speed
    first = j[:, 1] / speed
    states = np.stack(
        [
            first,
            (j[:, 2] - first * gain) / speed**2,
        ],
        axis=1,
    )
    length = _lengths(made, linear, pieces)
    return spline.hermite(j[:, 0], states, length), length


def _lengths(made: Driven, linear: list[int], pieces: int) -> FloatArray:
    """(n pieces,) lengths of the parts of every polynomial, by Gauss' formula."""
    x, w = np.polynomial.legendre.leggauss(8)
    h = np.repeat(made.steps / pieces, pieces)
    begin = np.tile(np.arange(pieces), len(made.steps)) * h
    at = begin[:, None] + 0.5 * h[:, None] * (x + 1.0)
    j = jets.of_columns(
        np.repeat(
            np.repeat(made.coef, pieces, axis=0),
            8,
            axis=0,
        ),
        at.ravel(),
        1,
    )[:, 0]
    speed = np.linalg.norm(j[:, linear], axis=1)
    speed = np.where(
        speed > 1e-9, speed, np.maximum(np.linalg.norm(j, axis=1), 1e-12)
    ).reshape(-1, 8)
    return np.asarray(0.5 * h * (speed @ w))


def parameter(values: FloatArray, linear: list[int]) -> FloatArray:
    """(n,) length along the vertices; where the linear axes rest, of what else
    moves.
    """
    moved = np.diff(values, axis=0)
    chord = np.linalg.norm(moved[:, linear], axis=1)
    rest = np.linalg.norm(moved, axis=1)
    return np.concatenate(
        [
            [0.0],
            np.cumsum(
                np.where(
                    chord > 0.0,
                    chord,
                    np.maximum(rest, 1e-9),
                )
            ),
        ]
    )


def polyline(points: FloatArray, tolerance: float) -> IntArray:
    """Numbers of the points that a polyline within ``tolerance`` of all points
    needs (Douglas and Peucker).
    """
    keep = np.zeros(len(points), np.bool_)
    stack = [(0, len(points) - 1)]
    keep[[0, -1]] = True
    while stack:
        a, b = stack.pop()
        if b - a < 2:
            continue
        chord = points[b] - points[a]
        inside = points[a + 1 : b] - points[a]
        share = np.clip(
            inside @ chord / max(float(chord @ chord), 1e-300), 0.0, 1.0
        )
        far = np.linalg.norm(inside - share[:, None] * chord, axis=1)
        worst = int(far.argmax())
        if far[worst] > tolerance:
            keep[a + 1 + worst] = True
            stack += [(a, a + 1 + worst), (a + 1 + worst, b)]
    return np.flatnonzero(keep)


def graph_polyline(
    u: FloatArray, values: FloatArray, tolerance: float
) -> IntArray:
    """The same for the graph of one column over the parameter; the deviation is
    that of the value.
    """
    keep = np.zeros(len(u), np.bool_)
    stack = [(0, len(u) - 1)]
    keep[[0, -1]] = True
    while stack:
        a, b = stack.pop()
        if b - a < 2:
            continue
        along = u[a + 1 : b] - u[a]
        share = along / max(u[b] - u[a], 1e-300)
        far = np.abs(
            values[a + 1 : b] - values[a] - share * (values[b] - values[a])
        )
        worst = int(far.argmax())
        if far[worst] > tolerance:
            keep[a + 1 + worst] = True
            stack += [(a, a + 1 + worst), (a + 1 + worst, b)]
    return np.flatnonzero(keep)
