"""How often a wait is told."""

from __future__ import annotations

from itertools import accumulate

from cnc_core.process.waiting import LAST_GAP_S, Scene, StandWatch, gap_s


def test_a_wait_is_told_every_few_seconds_and_then_seldom() -> None:
    """No gap above 5 s early on; later each gap is longer, up to the last one."""
    gaps = [gap_s(told) for told in range(1, 2000)]
    ends = accumulate(gaps)
    early = [gap for gap, end in zip(gaps, ends, strict=True) if end <= 20.0]
    assert len(early) >= 4
    assert max(early) <= 5.0
    assert gaps == sorted(gaps)
    assert gaps[-1] == LAST_GAP_S


def test_what_ends_by_itself_is_told_with_its_cell_time() -> None:
    """By the wall's clock alone; a dwell was told as one of 0.0 s."""
    told: list[str] = []
    dwell = Scene([("the end of a dwell", "it ends")], cell_s=8.4, by_wall=True)
    StandWatch(lambda: dwell, told.append, (1.0, 1000.0)).look_now()
    assert not told
    StandWatch(lambda: dwell, told.append, (1.0, 0.0)).look_now()
    assert told == ["waits for the end of a dwell for 8.4 s; it ends"]
