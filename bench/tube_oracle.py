"""The fastest motion of any kind inside the tolerance of coarse polylines, beside
``plan --tolerance``: ``python bench/tube_oracle.py``.

The axes' jerk is constant over small steps of time, as many for each chord. For
given times at which the motion goes from one chord's strip to the next, a linear
program says whether a legal motion exists and how much of the jerk it needs. A
sequence of linear programs in a region of trust moves these times until the sum
stands still. Every time that counts belongs to a motion that the linear program of
fixed times has found, so it can be driven; the search may stop early. Strips are
mitred at corners: a vertex may be further from the motion than the tolerance. With
``--vertices`` it may not, as the planner's certificate asks for, which holds both
ways.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.optimize import linprog
from scipy.sparse import coo_matrix, vstack

from cnc_core.config import CellConfig
from cnc_core.planning import PlanResult, plan_program
from cnc_core.program import Program

FloatArray = npt.NDArray[np.float64]
NORMALS = 8  # of a strip in space
ROUNDS = 30
TRUST, TRUST_LEAST = 0.3, 2e-3  # largest change of a time, as a share of it
ENOUGH = 1.0 - 5e-4  # a round that gains less is the last
STEPS = 12


@dataclass(frozen=True)
class Tube:
    """A polyline (points, axes), mm; feed, mm/s; limits of every axis. ``vertices``:
    the motion passes them within the tolerance too.
    """

    points: FloatArray
    tolerance: float
    feed: float
    vertices: bool = False
    v: float = 300.0
    a: float = 3000.0
    j: float = 50000.0

    @property
    def axes(self) -> int:
        return self.points.shape[1]

    @property
    def chords(self) -> int:
        return len(self.points) - 1


@dataclass
class Rows:
    """Rows of a linear program, gathered."""

    at: list[FloatArray] = field(default_factory=list)
    columns: list[FloatArray] = field(default_factory=list)
    values: list[FloatArray] = field(default_factory=list)
    right: list[FloatArray] = field(default_factory=list)
    count: int = 0

    def add(self, terms: list[tuple[Any, Any]], right: Any) -> None:
        """Some rows at once: for each of the terms columns and factors."""
        size = max(np.size(columns) for columns, _ in terms)
        rows = np.arange(self.count, self.count + size)
        for columns, values in terms:
            self.at.append(rows)
            self.columns.append(np.broadcast_to(columns, size))
            self.values.append(np.broadcast_to(values, size))
        self.right.append(np.broadcast_to(right, size))
        self.count += size

    def matrix(self, width: int) -> Any:
        parts = (self.at, self.columns, self.values)
        at, columns, values = (np.concatenate(part) for part in parts)
        return coo_matrix((values, (at, columns)), (self.count, width)).tocsr()


def normals(chord: FloatArray) -> FloatArray:
    """Across a chord: one in the plane, half of a star in space."""
    if len(chord) == 2:
        return np.array([[-chord[1], chord[0]]])
    _, _, base = np.linalg.svd(chord[None])
    angle = np.pi * np.arange(NORMALS) / NORMALS
    return np.outer(np.cos(angle), base[1]) + np.outer(np.sin(angle), base[2])


def directions(chords: FloatArray, i: int) -> FloatArray:
    """In which the speed on chord i is bounded: along it, along the chords beside
    it and between them. Real speeds are at the most a little larger.
    """
    near = chords[max(i - 1, 0) : i + 2]
    between = near[1:] + near[:-1]
    all_of = np.vstack([near, between, near[1:] + between, near[:-1] + between])
    return np.asarray(all_of / np.linalg.norm(all_of, axis=1)[:, None])


class Motions:
    """The linear program over scaled states: position q, V = v h, A = a h2 / 2 at
    the places of each chord, K = j h3 / 6 between them; a step h for each chord;
    and the share of the jerk that is used.
    """

    def __init__(self, tube: Tube, steps: int) -> None:
        self.tube, self.steps = tube, steps
        shape = (tube.chords, tube.axes, steps + 1)
        count = int(np.prod(shape))
        self.q, self.v, self.a, self.k = np.arange(4 * count).reshape(4, *shape)
        self.k = self.k[:, :, :-1]
        self.h = 4 * count + np.arange(tube.chords)
        self.share = 4 * count + tube.chords
        self.width = self.share + 1
        self._fixed_rows()

    def _fixed_rows(self) -> None:
        """What does not depend on times: steps, joints of positions, the tube."""
        equal, below = Rows(), Rows()
        q, v, a, k = self.q, self.v, self.a, self.k
        now, then = np.s_[:, :, :-1], np.s_[:, :, 1:]

        def flat(part: Any) -> Any:
            return part.ravel()

        equal.add(
            [
                (flat(q[then]), 1.0),
                (flat(q[now]), -1.0),
                (flat(v[now]), -1.0),
                (flat(a[now]), -1.0),
                (flat(k), -1.0),
            ],
            0.0,
        )
        equal.add(
            [
                (flat(v[then]), 1.0),
                (flat(v[now]), -1.0),
                (flat(a[now]), -2.0),
                (flat(k), -3.0),
            ],
            0.0,
        )
        equal.add(
            [(flat(a[then]), 1.0), (flat(a[now]), -1.0), (flat(k), -3.0)], 0.0
        )
        equal.add([(flat(q[1:, :, 0]), 1.0), (flat(q[:-1, :, -1]), -1.0)], 0.0)
        for at, end in ((0, 0), (-1, -1)):
            equal.add([(q[at, :, end], 1.0)], self.tube.points[at])
            equal.add([(v[at, :, end], 1.0)], 0.0)
            equal.add([(a[at, :, end], 1.0)], 0.0)
        self._strips(below)
        self.equal, self.below = equal, below

    def _strips(self, below: Rows) -> None:
        tube = self.tube
        chords = np.diff(tube.points, axis=0)
        chords = chords / np.linalg.norm(chords, axis=1)[:, None]
        for i, chord in enumerate(chords):
            for normal in normals(chord):
                self._strip(below, i, normal, float(normal @ tube.points[i]))
        for i in range(1, tube.chords if tube.vertices else 0):
            between = chords[i - 1] + chords[i]
            for normal in normals(between / np.linalg.norm(between)):
                self._vertex(below, i, normal, float(normal @ tube.points[i]))

    def _vertex(
        self, below: Rows, i: int, normal: FloatArray, middle: float
    ) -> None:
        """Chord i begins near its vertex, across the middle of both directions."""
        at = self.q[i, :, :1]
        for sign in (1.0, -1.0):
            terms = list(zip(at, sign * normal, strict=True))
            below.add(terms, sign * middle + self.tube.tolerance)

    def _strip(
        self, below: Rows, i: int, normal: FloatArray, middle: float
    ) -> None:
        """All control points of the cubics of a chord within its strip."""
        q, v, a = self.q[i], self.v[i], self.a[i]
        inner: list[list[tuple[Any, float]]] = [[(q, 1.0)]]
        inner.append([(q[:, :-1], 1.0), (v[:, :-1], 1 / 3)])
        inner.append([(q[:, :-1], 1.0), (v[:, :-1], 2 / 3), (a[:, :-1], 1 / 3)])
        for points in inner:
            terms = [
                (part[axis], factor * normal[axis])
                for part, factor in points
                for axis in range(self.tube.axes)
            ]
            turned = [(part, -factor) for part, factor in terms]
            below.add(terms, middle + self.tube.tolerance)
            below.add(turned, self.tube.tolerance - middle)

    def solve(
        self, step: FloatArray, state: FloatArray | None, trust: float
    ) -> Any:
        """With a region of trust: the shortest time; without: the least share of
        the jerk at these times.
        """
        equal, below = Rows(), Rows()
        self._joints(equal, step, state)
        self._limits(below, step)
        cost, bounds = np.zeros(self.width), np.full((self.width, 2), np.inf)
        bounds[:, 0] = -np.inf
        bounds[self.h, 0] = step * (1.0 - trust)
        bounds[self.h, 1] = step * (1.0 + trust)
        cost[self.h] = 1.0 / step.mean()
        bounds[self.share] = (1.0, 1.0)
        if trust == 0.0:
            cost[self.share], bounds[self.share] = 1.0, (0.0, np.inf)
        return linprog(
            cost,
            vstack([self.below.matrix(self.width), below.matrix(self.width)]),
            np.concatenate(self.below.right + below.right),
            vstack([self.equal.matrix(self.width), equal.matrix(self.width)]),
            np.concatenate(self.equal.right + equal.right),
            bounds,
            method="highs-ipm",
        )

    def _joints(
        self, equal: Rows, step: FloatArray, state: FloatArray | None
    ) -> None:
        """Speed and acceleration go on: V' h = V h', A' h2 = A h'2; with a state
        linear in the change of h as well.
        """
        left, right = step[:-1, None], step[1:, None]
        for part, power in ((self.v, 1), (self.a, 2)):
            last, first = part[:-1, :, -1], part[1:, :, 0]
            ratio = np.broadcast_to((right / left) ** power, last.shape)
            terms = [(first.ravel(), 1.0), (last.ravel(), -ratio.ravel())]
            if state is not None:
                for h, sign, of in (
                    (self.h[:-1], power, left),
                    (self.h[1:], -power, right),
                ):
                    columns = np.broadcast_to(h[:, None], last.shape)
                    slope = sign * state[first] / of
                    terms.append((columns.ravel(), slope.ravel()))
            equal.add(terms, 0.0)

    def _limits(self, below: Rows, step: FloatArray) -> None:
        """The limits of the axes, linear in h, on the safe side; and the feed."""
        tube = self.tube
        for sign in (1.0, -1.0):
            self._box(below, sign * 6.0 / tube.j, self.k, step, 3)
            self._box(below, sign * 2.0 / tube.a, self.a, step, 2)
            self._box(below, sign / tube.v, self.v, step, 1)
        chords = np.diff(tube.points, axis=0)
        chords = chords / np.linalg.norm(chords, axis=1)[:, None]
        for i in range(tube.chords):
            for direction in directions(chords, i):
                terms = list(zip(self.v[i], direction, strict=True))
                below.add([*terms, (self.h[i], -tube.feed)], 0.0)

    def _box(
        self, below: Rows, scale: float, part: Any, step: FloatArray, power: int
    ) -> None:
        """scale * part <= h^power on its tangent; of the jerk the share is free."""
        shape = part.shape

        def wide(values: Any) -> Any:
            return np.broadcast_to(values[:, None, None], shape).ravel()

        slope = power * step ** (power - 1)
        terms = [(part.ravel(), scale), (wide(self.h), -wide(slope))]
        right = (1 - power) * step**power
        if power == 3:
            terms.append((np.full(part.size, self.share), -wide(step**3)))
            right = -3.0 * step**3
        below.add(terms, wide(right))


def _legal(program: Motions, step: FloatArray) -> tuple[FloatArray, Any]:
    """These times, longer if they need more than all of the jerk, and the state."""
    for _ in range(3):
        found = program.solve(step, None, 0.0).x
        if found is None or found[program.share] <= 1.0 + 1e-7:
            return step, found
        step = step * (found[program.share] * (1.0 + 1e-9)) ** (1 / 3)
    return step, None


def _start(program: Motions) -> tuple[FloatArray, Any]:
    """Times with a legal motion, and its state."""
    tube = program.tube
    lengths = np.linalg.norm(np.diff(tube.points, axis=0), axis=1)
    step = np.maximum(
        np.cbrt(4.0 * lengths / tube.j), 1.3 * lengths / tube.feed
    )
    step[[0, -1]] *= 2.0
    step = step / program.steps
    while program.solve(step, None, 0.0).x is None:
        step = 1.5 * step
    return _legal(program, step)


def fastest(tube: Tube, steps: int = STEPS) -> float:
    """Seconds of the fastest motion found. The first rounds are not made legal:
    they are far from the end.
    """
    program = Motions(tube, steps)
    step, state = _start(program)
    trust, rough = TRUST, True
    for _ in range(ROUNDS):
        best = float(step.sum())
        tried = program.solve(step, state, trust).x
        at, found = (step, None) if tried is None else (tried[program.h], tried)
        if rough and at.sum() > 0.97 * best:
            rough = False
            step, state = _legal(program, step)
            continue
        if not rough:
            at, found = _legal(program, at)
        if found is None or at.sum() >= best:
            trust *= 0.4
        else:
            step, state, trust = at, found, min(1.5 * trust, 0.5)
        small = not rough and ENOUGH * best < at.sum() <= best
        if trust < TRUST_LEAST or small:
            break
    return float(steps * step.sum())


def flat_polyline(
    rng: np.random.Generator, count: int, turn: float
) -> FloatArray:
    """Random chords of 0.5 to 3 mm with turns up to this, rad, in the plane."""
    lengths = rng.uniform(0.5, 3.0, count)
    angle = np.cumsum(rng.uniform(-turn, turn, count))
    way = np.column_stack([np.cos(angle), np.sin(angle)])
    ends = np.cumsum(lengths[:, None] * way, axis=0)
    return np.vstack([np.zeros(2), ends]).round(4)


def polyline(rng: np.random.Generator, count: int, turn: float) -> FloatArray:
    """The same in space."""
    lengths = rng.uniform(0.5, 3.0, count)
    way = [np.array([1.0, 0.0, 0.0])]
    for _ in range(count - 1):
        across = np.cross(way[-1], rng.normal(size=3))
        across /= np.linalg.norm(across)
        angle = rng.uniform(0.0, turn)
        turned = np.cross(across, way[-1])
        way.append(np.cos(angle) * way[-1] + np.sin(angle) * turned)
    ends = np.cumsum(lengths[:, None] * np.array(way), axis=0)
    return np.vstack([np.zeros(3), ends]).round(4)


def spiral(rng: np.random.Generator, count: int, growth: float) -> FloatArray:
    """A circle or a spiral in coarse chords."""
    radius = rng.uniform(1.5, 8.0)
    angle = np.arange(count + 1) * rng.uniform(0.8, 2.0) / radius
    radii = radius * (1.0 + growth * angle)
    curve = np.column_stack([radii * np.cos(angle), radii * np.sin(angle)])
    return np.asarray((curve - [radii[0], 0.0]).round(4))


def zigzag(rng: np.random.Generator, count: int) -> FloatArray:
    x = np.arange(count + 1) * rng.uniform(0.8, 2.0)
    y = rng.uniform(0.1, 0.8) * (np.arange(count + 1) % 2)
    return np.column_stack([x, y]).round(4)


Shape = Callable[[np.random.Generator], FloatArray]


def kinds() -> list[tuple[str, int, Shape]]:
    """Families: name, number of cases, shape."""
    found: list[tuple[str, int, Shape]] = []
    for turn in (10, 25, 60, 90):
        for axes, count, shape in ((2, 6, flat_polyline), (3, 3, polyline)):
            one = partial(shape, count=12, turn=np.radians(turn))
            found.append((f"turns to {turn} deg, {axes} axes", count, one))
    found.append(("circle", 4, partial(spiral, count=14, growth=0.0)))
    found.append(("spiral", 4, partial(spiral, count=14, growth=0.05)))
    found.append(("zigzag", 4, partial(zigzag, count=12)))
    return found


def cases() -> Iterator[tuple[str, Tube]]:
    """Name of the family and tube of 48 seeded cases."""
    names = [
        (name, shape) for name, count, shape in kinds() for _ in range(count)
    ]
    for seed, (name, shape) in enumerate(names):
        rng = np.random.default_rng((1000 if seed < 36 else 2000) + seed)
        tolerance = float(rng.choice([0.01, 0.02, 0.05]))
        feed = float(rng.choice([50.0, 100.0, 200.0]))
        yield name, Tube(shape(rng), tolerance, feed)


def planned(tube: Tube, path: Path) -> PlanResult:
    """``plan --tolerance`` of the polyline, written to a file."""
    lines = [f"G90 F{60.0 * tube.feed:.0f}"]
    for point in tube.points[1:]:
        words = zip("XYZ", point, strict=False)
        lines.append(" ".join(["G1", *(f"{n}{v:.4f}" for n, v in words)]))
    path.write_text("\n".join([*lines, "M30", ""]))
    return plan_program(
        Program(path, CellConfig(), "isg", tolerance=tube.tolerance)
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--every", type=int, default=1, help="of the cases")
    parser.add_argument("--steps", type=int, default=STEPS, help="of a chord")
    parser.add_argument(
        "--vertices",
        action="store_true",
        help="the motion passes them within the tolerance too",
    )
    options = parser.parse_args()
    families: dict[str, list[float]] = {}
    with TemporaryDirectory() as folder:
        for i, (name, tube) in enumerate(cases()):
            if i % options.every:
                continue
            found = planned(tube, Path(folder) / "part.nc")
            bound = replace(tube, vertices=options.vertices)
            best = fastest(bound, options.steps)
            ratio = found.motion_time_s / best
            families.setdefault(name, []).append(ratio)
            print(
                f"{name}, {tube.tolerance} mm, {tube.feed:.0f} mm/s: {best:.4f} s,"
                f" ratio {ratio:.4f}, jerk {found.max_ratio['jerk']:.3f},"
                f" deviation {found.path_deviation_mm / tube.tolerance:.3f}",
                flush=True,
            )
    families["all"] = [
        ratio for ratios in families.values() for ratio in ratios
    ]
    for name, ratios in families.items():
        print(f"{name}: mean {np.mean(ratios):.4f}, worst {max(ratios):.4f}")


if __name__ == "__main__":
    main()
