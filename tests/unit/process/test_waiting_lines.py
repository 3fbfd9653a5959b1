"""How often a wait is told."""

from __future__ import annotations

from itertools import accumulate

from cnc_core.process.waiting import LAST_GAP_S, gap_s


def test_a_wait_is_told_every_few_seconds_and_then_seldom() -> None:
    """No gap above 5 s early on; later each gap is longer, up to the last one."""
    gaps = [gap_s(told) for told in range(1, 2000)]
    ends = accumulate(gaps)
    early = [gap for gap, end in zip(gaps, ends, strict=True) if end <= 20.0]
    assert len(early) >= 4
    assert max(early) <= 5.0
    assert gaps == sorted(gaps)
    assert gaps[-1] == LAST_GAP_S
