"""A part program as it is driven beside the optimum over the same path:
``python bench/planner_parts.py PART.nc``.

The rows behind all geometry stages (``--tolerance``) are taken apart where the
axes have to stand; toppra's and COPP's optimum of every stretch (TOPP2; with
jerk TOPP3) are added up. For programs without technology functions; with jerk
of one feed. Without jerk the accelerations are looked at in the middle of
intervals, so q'' may jump where pieces meet.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cnc_core.benchmarks.jerk_paths import Knots, by_length
from cnc_core.blocks import CIRCULAR, ELEMENT, LINEAR, POLYNOMIAL, BlockBatch
from cnc_core.config import CellConfig
from cnc_core.engine.jerk_planner import FloatArray
from cnc_core.planning import plan_program
from cnc_core.program import Program
from planner_oracles import topp2_time_by_middles, topp3_time

# mm at the ends of lines, growth by the distance from them
FINEST, GROWTH = 0.004, 0.06
KINK = 1e-6  # jump of the direction at which the axes stand
PLANES = {
    17: (0, 1),
    18: (2, 0),
    19: (1, 2),
}
LEAST = 8  # intervals of a piece
RAPID = 1e5  # mm/s: no limit but those of the axes


@dataclass
class Stretch:
    """Path between two standstills; feed: the largest speed at each of its
    knots, mm/s. Pieces have an even number of intervals, so knots of odd
    numbers are never where two of them meet.
    """

    knots: Knots
    feed: FloatArray


def _places(length: float, turn: float, spacing: float) -> int:
    return 2 * max(
        LEAST, int(np.ceil(length / spacing)), int(np.ceil(turn / 0.02))
    )


def _graded(length: float, spacing: float) -> FloatArray:
    """Places on a line, closer together towards its ends: there the axes stand,
    or come from a tight bend.
    """
    half = [0.0]
    while half[-1] < 0.5 * length:
        half.append(half[-1] + min(spacing, FINEST + GROWTH * half[-1]))
    near = 0.5 * length * np.array(half) / half[-1]
    return np.concatenate([near, length - near[-2::-1]])


def _line(start: FloatArray, row: np.void, spacing: float) -> Knots:
    end, zero = row["end"][: len(start)], np.zeros
    s = _graded(row["length"], spacing)
    direction = (end - start) / row["length"]
    slope = np.repeat(direction[None], len(s), axis=0)
    return Knots(
        s,
        start + s[:, None] * slope,
        slope,
        zero(slope.shape),
        zero(slope.shape),
    )


def _arc(start: FloatArray, row: np.void, spacing: float) -> Knots:
    i, k = PLANES[int(row["plane"])]
    n = _places(row["length"], abs(row["angle"]), spacing)
    end, angle = row["end"][: len(start)], float(row["angle"])
    u = np.linspace(0.0, 1.0, n + 1)
    center = row["center"]
    across, up = start[i] - center[0], start[k] - center[1]
    w = (across + 1j * up) * np.exp(1j * angle * u)

    def derivative(order: int) -> FloatArray:
        slope = end - start if order == 1 else np.zeros(len(start))
        out = np.repeat(slope[None], n + 1, axis=0)
        if order == 0:
            out = start + u[:, None] * (end - start)
        turned = w * (1j * angle) ** order
        out[:, i], out[:, k] = turned.real, turned.imag
        if order == 0:
            out[:, i] += row["center"][0]
            out[:, k] += row["center"][1]
        return np.asarray(out / row["length"] ** order)

    return Knots(u * row["length"], *(derivative(order) for order in range(4)))


def _polynomial(
    axes: int, row: np.void, pool: FloatArray, spacing: float
) -> Knots:
    order = int(row["degree"]) + 1
    coef = pool[row["pool"] : row["pool"] + axes * order].reshape(axes, order)

    def curve(t: FloatArray, d: int) -> FloatArray:
        poly = np.polynomial.polynomial
        return np.stack(
            [poly.polyval(t, poly.polyder(c, d)) for c in coef], axis=1
        )

    first = by_length(curve, np.linspace(0.0, float(row["angle"]), 9))
    turns = np.linalg.norm(np.diff(first.d1, axis=0), axis=1)
    turn = float(turns.sum())
    return by_length(
        curve,
        np.linspace(
            0.0,
            float(row["angle"]),
            2 * _places(row["length"], turn, spacing) + 1,
        ),
    )


def _pieces(
    batches: Iterator[BlockBatch], start: FloatArray, spacing: float
) -> Iterator[tuple[Knots, float]]:
    at = start
    for batch in batches:
        for row in batch.rows:
            if row["flags"] & ELEMENT:
                continue
            feed = float(row["feed"]) if row["feed"] > 0 else RAPID
            if row["type"] == LINEAR:
                yield _line(at, row, spacing), feed
            elif row["type"] == CIRCULAR:
                yield _arc(at, row, spacing), feed
            elif row["type"] == POLYNOMIAL:
                yield _polynomial(len(at), row, batch.pool, spacing), feed
            else:
                continue
            at = row["end"][: len(at)].copy()


def stretches(
    batches: Iterator[BlockBatch], start: FloatArray, spacing: float = 0.1
) -> list[Stretch]:
    """The path between two standstills; where pieces meet the later one's
    derivatives count, and the lower feed.
    """
    groups: list[list[tuple[Knots, float]]] = []
    for piece in _pieces(batches, start, spacing):
        if groups and _meet(groups[-1][-1][0], piece[0]):
            groups[-1].append(piece)
        else:
            groups.append([piece])
    return [_joined(group) for group in groups]


def _meet(first: Knots, second: Knots) -> bool:
    """Whether a path goes on without a kink."""
    jump = first.d1[-1] - second.d1[0]
    return bool(np.abs(jump).max() < KINK)


def _joined(group: list[tuple[Knots, float]]) -> Stretch:
    pieces = [knots for knots, _ in group]
    ends = np.cumsum([knots.length for knots in pieces])
    offsets = np.concatenate([[0.0], ends])
    moved = [
        knots.s[:-1] + offset
        for knots, offset in zip(pieces, offsets, strict=False)
    ]
    s = np.concatenate([*moved, offsets[-1:]])
    feed = np.full(len(s), np.inf)
    at = 0
    for knots, value in group:
        feed[at : at + len(knots.s)] = np.minimum(
            feed[at : at + len(knots.s)], value
        )
        at += len(knots.s) - 1
    joined = (
        np.vstack(
            [getattr(g, name)[:-1] for g in pieces]
            + [getattr(pieces[-1], name)[-1:]]
        )
        for name in ("q", "d1", "d2", "d3")
    )
    return Stretch(Knots(s, *joined), feed)


def optimum(paths: list[Stretch], cell: CellConfig, *, jerk: bool) -> float:
    """Shortest motion time, s, from standstill to standstill over each of the paths."""
    v, a, j = (
        cell.axis_values(name)
        for name in ("v_max_mm_s", "a_max_mm_s2", "j_max_mm_s3")
    )
    if not jerk:
        return sum(
            topp2_time_by_middles(path.knots, path.feed, v, a) for path in paths
        )
    (feed,) = {float(f) for path in paths for f in path.feed}
    return sum(topp3_time(path.knots, feed, v, a, j) for path in paths)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("part", type=Path)
    parser.add_argument("--tolerance", type=float, default=0.01)
    parser.add_argument("--no-jerk", action="store_true")
    parser.add_argument(
        "--spacing",
        type=float,
        default=0.1,
        help="mm between two knots of the optimum at the most",
    )
    parser.add_argument(
        "--windows", type=int, nargs="*", default=[30, 120, 190]
    )
    options = parser.parse_args()
    cell, jerk = CellConfig(), not options.no_jerk

    def program() -> Program:
        return Program(options.part, cell, "isg", tolerance=options.tolerance)

    paths = stretches(
        program().batches(), cell.axis_values("start_mm"), options.spacing
    )
    best = optimum(paths, cell, jerk=jerk)
    print(
        f"{len(paths)} stretches, {sum(len(p.feed) for p in paths)} knots, optimum {best:.5f} s"
    )
    for window in options.windows:
        out = plan_program(program(), window=window, jerk=jerk).as_json()
        took, ratio = out["motion_time_s"], out["max_ratio"]
        print(
            f"W{window}: {took:.5f} s, {took / best:.5f} of the optimum, largest ratios {ratio}"
        )


if __name__ == "__main__":
    main()
