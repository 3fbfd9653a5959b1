"""Handshake latency: raw C, Python on both sides, immediate and cyclic service
of the engine, in the same run.

``pytest bench --benchmark-enable``; each round is one measurement of a quarter
of a second, whose distribution stands in ``extra_info`` (ns).  Nothing timed is
asserted.
"""

from typing import Any

import numpy as np
import pytest

from cnc_core.benchmarks import handshake
from hli.bench import Measurement, measure_python_both, measure_raw

SECONDS = 0.25


def distribution(measured: Measurement) -> dict[str, Any]:
    """mean, p50, p99, p999, max in ns, and what the numbers are worth."""
    p50, p99, p999 = (
        float(q) for q in np.percentile(measured.ns, [50, 99, 99.9])
    )
    return {
        "mean": float(measured.ns.mean()),
        "p50": p50,
        "p99": p99,
        "p999": p999,
        "max": int(measured.ns.max()),
        "n": len(measured.ns),
        "torn": measured.torn,
        "pinned": measured.pinned,
        "payload_bytes": measured.payload_bytes,
    }


@pytest.mark.parametrize("n_blocks", [50, 128])
@pytest.mark.parametrize("measure", [measure_raw, measure_python_both])
def test_handshake(benchmark: Any, measure: Any, n_blocks: int) -> None:
    """No torn read; the distribution goes to the benchmark's record."""
    measured = benchmark.pedantic(measure, args=(n_blocks, SECONDS), rounds=1)
    benchmark.extra_info.update(distribution(measured))
    assert measured.torn == 0


def test_python_on_both_sides_beside_the_raw_reference(benchmark: Any) -> None:
    """Median ratio for 50 elements of 72 bytes; the goal is 2.5."""

    def both() -> tuple[Measurement, Measurement]:
        return measure_raw(50, SECONDS), measure_python_both(50, SECONDS)

    raw, python = benchmark.pedantic(both, rounds=1)
    ratio = float(np.median(python.ns) / np.median(raw.ns))
    benchmark.extra_info.update(
        ratio=ratio, raw=distribution(raw), python=distribution(python)
    )
    assert raw.torn == python.torn == 0


def test_all_services_beside_the_raw_reference(benchmark: Any) -> None:
    """What ``hli-cosim bench handshake`` measures; goals: immediate 2, Python
    on both sides 2.5 times raw C.
    """
    value = benchmark.pedantic(handshake, args=(4.0,), rounds=1)
    benchmark.extra_info.update(value)
    assert value["torn_reads"] == 0
