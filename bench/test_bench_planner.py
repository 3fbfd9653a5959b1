"""Planner and reader: blocks and lines per second on seeded workloads, beside a
reference of the same run.

``pytest bench --benchmark-enable``; figures stand in ``extra_info``. Nothing
timed is asserted.
"""

from typing import Any

from cnc_core.benchmarks import parser, planner


def test_planner(benchmark: Any) -> None:
    """All workloads at look-ahead 30, 120, 190: legal at the cycle, whatever
    the speed of the planner.
    """
    value = benchmark.pedantic(planner, args=(2.0,), rounds=1)
    benchmark.extra_info.update(value)
    ratios = [
        ratio
        for row in value.values()
        for ratio in row["max_ratio"].values()
        if ratio is not None
    ]
    assert max(ratios) <= 1.02


def test_parser(benchmark: Any) -> None:
    """Lines per second from text to rows, beside reading the same file line by
    line in Python.
    """
    value = benchmark.pedantic(parser, args=(2.0,), rounds=1)
    benchmark.extra_info.update(value["workloads"])
