"""Paths for tests and benchmarks of the planner: analytic curves, lines and
arcs as knots with exact derivatives.

All lengths in mm; derivatives are by path length.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from ..engine.jerk_planner import STAND, intervals_from_knots
from ..units import AnyArray, FloatArray

Curve = Callable[[FloatArray, int], FloatArray]
MAX_TURN_RAD = 0.1


BINOMIAL = (
    (1,),
    (1, 1),
    (1, 2, 1),
    (1, 3, 3, 1),
)
# (i, j): j over i; derivatives of t**j at 1 by i!
LOWER_BINOMIAL = np.array(
    [
        [1, 1, 1, 1],
        [0, 1, 2, 3],
        [0, 0, 1, 3],
        [0, 0, 0, 1],
    ]
)
# the same for j from 4 to 7
UPPER_BINOMIAL = np.array(
    [
        [1.0, 1, 1, 1],
        [4, 5, 6, 7],
        [6, 10, 15, 21],
        [4, 10, 20, 35],
    ]
)


@dataclass(frozen=True)
class Knots:
    """Knots of one smooth stretch: s (n+1,), q and its derivatives by s (n+1, axes)."""

    s: FloatArray
    q: FloatArray
    d1: FloatArray
    d2: FloatArray
    d3: FloatArray

    @property
    def length(self) -> float:
        """Path length."""
        return float(self.s[-1])

    def at(self, s: FloatArray) -> FloatArray:
        """Positions between the knots, by the polynomials of degree 7 that meet
        all derivatives at both ends.
        """
        before = np.searchsorted(self.s, s, side="right") - 1
        piece = np.clip(before, 0, len(self.s) - 2)
        h = np.diff(self.s)[piece][:, None]
        t = (s - self.s[piece])[:, None] / h
        c = [
            self.q[piece],
            h * self.d1[piece],
            h**2 / 2 * self.d2[piece],
            h**3 / 6 * self.d3[piece],
        ]
        end = [
            self.q[piece + 1],
            h * self.d1[piece + 1],
            h**2 / 2 * self.d2[piece + 1],
            h**3 / 6 * self.d3[piece + 1],
        ]
        upper = np.linalg.inv(UPPER_BINOMIAL)
        rest = [
            value - sum(row[j] * c[j] for j in range(4))
            for value, row in zip(end, LOWER_BINOMIAL, strict=True)
        ]
        c += [
            sum(factor * part for factor, part in zip(row, rest, strict=True))
            for row in upper
        ]
        return np.asarray(sum(c[i] * t**i for i in range(8)))

    def intervals(self, feed: float) -> AnyArray:
        """Planner intervals, one block each."""
        return intervals_from_knots(self.s, self.d1, self.d2, self.d3, feed)


def by_length(curve: Curve, t: FloatArray) -> Knots:
    """Turn a curve q(t), given with its derivatives up to the third, into knots
    over path length.
    """
    q, q1, q2, q3 = (curve(t, order) for order in range(4))
    speed = np.linalg.norm(q1, axis=1)[:, None]
    speed1 = (q1 * q2).sum(axis=1)[:, None] / speed
    speed2 = (
        (q2 * q2).sum(axis=1)[:, None]
        + (q1 * q3).sum(axis=1)[:, None]
        - speed1**2
    ) / speed
    d1 = q1 / speed
    d2 = (q2 - speed1 * d1) / speed**2
    d3 = (q3 - speed2 * d1 - 3 * speed * speed1 * d2) / speed**3
    nodes, weights = np.polynomial.legendre.leggauss(8)
    half = 0.5 * np.diff(t)
    middle = 0.5 * (t[1:] + t[:-1])
    inner = middle[:, None] + half[:, None] * nodes
    speeds = np.linalg.norm(curve(inner.ravel(), 1), axis=1)
    weighted = speeds.reshape(inner.shape) * weights
    lengths = weighted.sum(axis=1) * half
    s = np.concatenate([[0.0], np.cumsum(lengths)])
    return Knots(s, q, d1, d2, d3)


def refined(curve: Curve, t: FloatArray) -> Knots:
    """As ``by_length``, with further knots where the curve turns too much
    between two.
    """
    knots = by_length(curve, t)
    for _ in range(16):
        turns = np.linalg.norm(np.diff(knots.d1, axis=0), axis=1)
        wide = turns > MAX_TURN_RAD
        if not wide.any():
            break
        middle = 0.5 * (t[1:] + t[:-1])
        t = np.sort(np.concatenate([t, middle[wide]]))
        knots = by_length(curve, t)
    return knots


def contour(blocks: int, turned_into: int = 2, per_block: int = 1) -> Knots:
    """r(th) = 40 + 8 sin 7th + 2 sin 31th mm, 2500 points a turn, growing 0.05
    mm a turn.

    ``turned_into`` axes: the plane is rotated so that all of them move.
    ``per_block`` knots for every segment.
    """
    grow = 0.05 / (2 * np.pi)

    def curve(t: FloatArray, order: int) -> FloatArray:
        def r(n: int) -> FloatArray:
            base = (
                40.0 + grow * t
                if n == 0
                else np.full_like(t, grow if n == 1 else 0.0)
            )
            waves = 8 * 7.0**n * np.sin(
                7 * t + n * np.pi / 2
            ) + 2 * 31.0**n * np.sin(31 * t + n * np.pi / 2)
            return np.asarray(base + waves)

        e = []
        for n in range(4):
            u = t + n * np.pi / 2
            e.append(np.column_stack([np.cos(u), np.sin(u)]))
        binomial = BINOMIAL[order]
        return np.asarray(
            sum(
                binomial[n] * r(order - n)[:, None] * e[n]
                for n in range(order + 1)
            )
        )

    knots = by_length(
        curve,
        np.asarray(
            2 * np.pi / 2500 / per_block * np.arange(per_block * blocks + 1),
            dtype=np.float64,
        ),
    )
    if turned_into == 2:
        return knots
    rotation, _ = np.linalg.qr(
        np.random.default_rng(turned_into).normal(
            size=(turned_into, turned_into)
        )
    )
    into = rotation[:, :2].T
    return Knots(
        knots.s,
        knots.q @ into,
        knots.d1 @ into,
        knots.d2 @ into,
        knots.d3 @ into,
    )


def raster_line(row: int, per_block: int = 1) -> Knots:
    """One line of the raster z = 3 sin(x/7) cos(y/5): 100 mm in 0.25 mm steps
    of x, lines 0.25 mm apart.
    """
    y = 0.25 * row
    height = 3 * np.cos(y / 5)

    def curve(t: FloatArray, order: int) -> FloatArray:
        x = t if order == 0 else np.full_like(t, 1.0 if order == 1 else 0.0)
        z = height * 7.0**-order * np.sin(t / 7 + order * np.pi / 2)
        return np.column_stack(
            [x, np.full_like(t, y if order == 0 else 0.0), z]
        )

    return by_length(curve, np.linspace(0.0, 100.0, 400 * per_block + 1))


def random_waves(
    rng: np.random.Generator, axes: int, spacing_mm: float = 0.2
) -> Knots:
    """A smooth random curve: a drift and some waves in every axis."""
    count = int(rng.integers(2, 6))
    end = float(rng.uniform(2, 8))
    place = np.arange(1, count + 1)[:, None]
    size = rng.uniform(1, 12, (count, axes)) / place
    rate, phase = (
        rng.uniform(0.3, 4, (count, axes)),
        rng.uniform(0, 6.3, (count, axes)),
    )
    drift = rng.normal(size=axes) * rng.uniform(2, 20)

    def curve(t: FloatArray, order: int) -> FloatArray:
        turn = order * np.pi / 2
        waves = sum(
            size[i]
            * rate[i] ** order
            * np.sin(np.outer(t, rate[i]) + phase[i] + turn)
            for i in range(count)
        )
        straight = np.outer(t, drift) if order == 0 else drift * (order == 1)
        return np.asarray(waves + straight)

    t = np.linspace(0, end, 200)
    length = by_length(curve, t).length
    return refined(
        curve, np.linspace(0, end, max(20, int(length / spacing_mm)))
    )


class Piece(Protocol):
    """A line or an arc."""

    length: float
    turn: float

    def at(self, s: FloatArray) -> FloatArray:
        """Positions (n, axes)."""
        ...

    def derivatives(
        self, s: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """First to third derivative (n, axes)."""
        ...


class Line:
    """A straight line from ``start`` along the unit vector ``along``."""

    def __init__(
        self, start: FloatArray, along: FloatArray, length: float
    ) -> None:
        self.start, self.along, self.length, self.turn = (
            start,
            along,
            length,
            0.0,
        )

    def at(self, s: FloatArray) -> FloatArray:
        return np.asarray(self.start + np.outer(s, self.along))

    def derivatives(
        self, s: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        zero = np.zeros((len(s), len(self.start)))
        return np.tile(self.along, (len(s), 1)), zero, zero


class Arc:
    """An arc in the first two axes from ``start`` along ``along``; ``angle`` in
    rad, its sign the side.
    """

    def __init__(
        self, start: FloatArray, along: FloatArray, radius: float, angle: float
    ) -> None:
        self.start, self.along, self.radius, self.turn = (
            start,
            along,
            radius,
            abs(angle),
        )
        self.length = radius * self.turn
        self.normal = np.zeros_like(along)
        left = np.array([-along[1], along[0]])
        self.normal[:2] = np.sign(angle) * left

    def at(self, s: FloatArray) -> FloatArray:
        a = s / self.radius
        turned = np.outer(np.sin(a), self.along) + np.outer(
            1 - np.cos(a), self.normal
        )
        return np.asarray(self.start + self.radius * turned)

    def derivatives(
        self, s: FloatArray
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        a = s / self.radius
        tangent = np.outer(np.cos(a), self.along) + np.outer(
            np.sin(a), self.normal
        )
        normal = np.outer(-np.sin(a), self.along) + np.outer(
            np.cos(a), self.normal
        )
        return tangent, normal / self.radius, -tangent / self.radius**2


class Chain:
    """Lines and arcs one after the other, with the feed of each and whether the
    axes stand behind it.
    """

    def __init__(
        self,
        pieces: Sequence[Piece],
        feeds: Sequence[float],
        stands: Sequence[bool],
    ) -> None:
        self.pieces, self.feeds, self.stands = pieces, feeds, stands
        self.starts = np.concatenate(
            [[0.0], np.cumsum([p.length for p in pieces])]
        )

    @property
    def length(self) -> float:
        """Path length."""
        return float(self.starts[-1])

    def at(self, s: FloatArray) -> FloatArray:
        """Positions (n, axes)."""
        index = np.clip(
            np.searchsorted(self.starts, s, side="right") - 1,
            0,
            len(self.pieces) - 1,
        )
        first = self.pieces[0].at(np.zeros(1))
        out = np.zeros((len(s), first.shape[1]))
        for i in np.unique(index):
            mine = index == i
            within = s[mine] - self.starts[i]
            out[mine] = self.pieces[i].at(within)
        return out

    def intervals(self) -> AnyArray:
        """A line is one interval, an arc one per ``MAX_TURN_RAD``."""
        out = []
        for piece, feed, stand, start in zip(
            self.pieces, self.feeds, self.stands, self.starts[:-1], strict=True
        ):
            n = max(1, int(np.ceil(piece.turn / MAX_TURN_RAD)))
            s = np.linspace(0.0, piece.length, n + 1)
            rows = intervals_from_knots(s + start, *piece.derivatives(s), feed)
            rows["blocks"] = 0
            rows["blocks"][-1] = 1
            rows["flags"][-1] |= STAND if stand else 0
            out.append(rows)
        return np.concatenate(out)


def random_chain(rng: np.random.Generator, feed: float, tiny: bool) -> Chain:
    """Lines and arcs that join tangentially, with feed steps, and stands where
    the direction changes.
    """
    pieces: list[Piece] = []
    feeds, stands = [], []
    at, along = np.zeros(3), np.array([1.0, 0.0, 0.0])
    for _ in range(int(rng.integers(2, 14))):
        scale = (
            float(10 ** rng.uniform(-2, 1.5))
            if tiny
            else float(rng.uniform(1, 20))
        )
        piece: Line | Arc = Line(at, along, scale)
        if rng.random() < 0.5:
            piece = Arc(
                at,
                along,
                float(10 ** rng.uniform(-0.3, 1.5)),
                float(rng.choice([-1, 1]) * rng.uniform(0.05, 3)),
            )
        pieces.append(piece)
        end = np.array([piece.length])
        at = piece.at(end)[0]
        along = piece.derivatives(end)[0][0]
        feeds.append(
            feed * float(rng.uniform(0.2, 1.0)) if rng.random() < 0.5 else feed
        )
        stands.append(bool(rng.random() < 0.2))
        if stands[-1]:
            turn = rng.uniform(0, 6.28)
            along = np.array([np.cos(turn), np.sin(turn), 0.0])
    return Chain(pieces, feeds, stands)
