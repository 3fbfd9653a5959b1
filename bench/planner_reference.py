"""Compare the planners with optima of COPP (offline, over the whole path):
``python bench/planner_reference.py``.

The optima that the tests store come from here.  A run takes some minutes;
``--blocks`` shortens the contour.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from cnc_core.benchmarks.jerk_paths import Knots, contour, raster_line
from cnc_core.engine.jerk_planner import JerkPlanner, Limits, Topp2, run
from planner_oracles import topp2_time, topp3_time

WINDOWS = (30, 60, 120, 190)


def limits(axes: int) -> Limits:
    """v 300 mm/s, a 3000 mm/s2, j 50000 mm/s3."""
    return Limits([300.0] * axes, [3000.0] * axes, [50000.0] * axes)


def compare(
    name: str, path: Knots, per_block: int, feed: float, optimum: bool
) -> None:
    """One line for each window: motion time, its ratio to the optimum, blocks a
    second.
    """
    axes = path.q.shape[1]
    lim = limits(axes)
    v, a = np.array(lim.v), np.array(lim.a)
    j = np.array(lim.j)
    rows = path.intervals(feed)
    rows["blocks"] = np.arange(len(rows)) % per_block == per_block - 1
    best3 = topp3_time(path, feed, v, a, j) if optimum else float("nan")
    best2 = topp2_time(path, feed, v, a)
    print(
        f"{name}, {axes} axes, F{feed:.0f}: TOPP2 {best2:.5f} s, TOPP3 {best3:.5f} s"
    )
    for window in WINDOWS:
        planner = JerkPlanner(lim, window=window)
        cpu = time.process_time()
        laws = run(planner, rows)
        cpu = time.process_time() - cpu
        stats, total = planner.stats, float(laws["time"].sum())
        speed = rows["blocks"].sum() / cpu
        print(
            f"  jerk  W{window:3d}: {total:.5f} s, ratio {total / best3:.5f},"
            f" {speed:8.0f} bl/s, failed {stats['failed']:.0f}"
            f" of {stats['solves']:.0f}"
        )
        _acceleration_limited(lim, window, per_block, rows, best2)


def _acceleration_limited(
    lim: Limits, window: int, per_block: int, rows: np.ndarray, best: float
) -> None:
    planner, total, done, cpu = (
        Topp2(lim, window=window, knots=per_block * window),
        0.0,
        0,
        time.process_time(),
    )
    while True:
        done += planner.push(rows[done : done + planner.room])
        laws = planner.take(0.5 if done < len(rows) else 1e9)
        if not len(laws):
            break
        total += float(laws["time"].sum())
    cpu = time.process_time() - cpu
    speed = rows["blocks"].sum() / cpu
    print(
        f"  accel W{window:3d}: {total:.5f} s, ratio {total / best:.5f},"
        f" {speed:9.0f} blocks/s"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--blocks", type=int, default=1200)
    parser.add_argument(
        "--speed",
        action="store_true",
        help="no optimum: times and blocks a second only",
    )
    options = parser.parse_args()
    for feed in (100.0, 300.0):
        compare(
            "contour",
            contour(options.blocks, per_block=2),
            2,
            feed,
            not options.speed,
        )
        compare(
            "raster line",
            raster_line(3, per_block=2),
            2,
            feed,
            not options.speed,
        )
    for axes in (3, 6):
        compare("contour", contour(options.blocks, axes), 1, 100.0, False)


if __name__ == "__main__":
    main()
