"""ContourQueue, ContourLookahead with a mode, and the plan against the mock CNC, the
twin of the engine's extension.
"""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import pytest

from plc_client import ContourLookahead, connect
from plc_client.blocks import (
    ContourEnd,
    ContourQueue,
    EmptyReason,
    LookaheadState,
    PathEstimate,
)
from plc_client.blocks.contour_lookahead import ERROR_LENGTH, ERROR_MODE
from plc_client.mock import (
    MockCnc,
    distance_reset,
    dwell,
    line,
    log_off,
    log_on,
    m,
    rapid,
)

MM = 10_000.0
SCRIPT = (
    log_on(),
    line(10),
    m(8, waits=False),
    line(20, feed_mm_s=50.0),
    log_off(),
    distance_reset(),
    dwell(0.1),
    rapid(30),
)


@pytest.fixture
def cnc() -> Iterator[MockCnc]:
    """Two epochs, a function, a dwell."""
    with MockCnc(SCRIPT) as mock:
        yield mock


@pytest.fixture
def ch(cnc: MockCnc) -> Iterator[Any]:
    """The PLC's view of its channel."""
    with connect(cnc.name) as hli:
        yield hli.gpCh[0]


def told(cnc: MockCnc, fb: ContourQueue, *what: Any, **more: Any) -> Any:
    """One request, answered."""
    fb(*what, execute=False)
    fb(*what, execute=True, **more)
    cnc.cycle()
    assert fb(*what, execute=True, **more)
    return fb


def test_elements_of_this_epoch_and_beyond(cnc: MockCnc, ch: Any) -> None:
    """As the real CNC answers them."""
    fb = ContourQueue(ch)
    told(cnc, fb, 0.0, 1e9)
    assert list(fb.blocks["length"]) == [10 * MM, 20 * MM]
    assert (fb.end, fb.empty) == (ContourEnd.RESET, EmptyReason.NOT_EMPTY)
    told(cnc, fb, 0.0, 1e9, beyond=True, events=True)
    assert fb.blocks["block_type"].tolist() == [1, 17, 1, 16, 1]
    assert fb.blocks["start_position"][-1] == 0.0
    assert fb.end is ContourEnd.PROGRAM
    told(cnc, fb, 0.0, 1e9, epoch=fb.epoch + 1)
    assert list(fb.blocks["length"]) == [30 * MM]


def test_why_there_is_nothing(cnc: MockCnc, ch: Any) -> None:
    """Behind a reset, behind the end, a bad field: error with its number."""
    fb = ContourQueue(ch)
    assert told(cnc, fb, 31 * MM, MM).empty is EmptyReason.BEFORE_RESET
    assert (
        told(cnc, fb, 61 * MM, MM, beyond=True).empty is EmptyReason.BEHIND_END
    )
    assert not fb.error
    told(cnc, fb, 0.0, 0.0)
    assert (fb.error, fb.error_id) == (True, EmptyReason.BAD_LENGTH)
    fb(0.0, MM, execute=False)
    told(cnc, fb, 0.0, MM)
    assert (fb.error, fb.error_id, fb.count) == (False, 0, 1)
    told(cnc, fb, 1.0, mode=1)
    assert (fb.count, fb.end) == (3, ContourEnd.LOG)


def test_details_tell_times_and_speeds(cnc: MockCnc, ch: Any) -> None:
    """10 mm at 100 mm/s, 20 mm at 50 mm/s, a dwell, a rapid motion."""
    fb = ContourQueue(ch)
    for _ in range(3):
        told(cnc, fb, 0.0, 1e9, beyond=True, details=True)
    begin = fb.details["time_start"][1:] / 1000.0 + cnc.cycles
    assert begin == pytest.approx([100.0, 600.0], abs=1.1)
    assert list(fb.details["speed_start"][1:]) == [50_000.0, 300_000.0]
    assert list(fb.details["feed"]) == [100_000.0, 50_000.0, 0.0]


def test_the_estimate_follows_the_plan(cnc: MockCnc, ch: Any) -> None:
    """The speed changes at 10 mm: the plan knows it, extrapolation does not."""
    path = PathEstimate(ch)
    path()
    cnc.run_to(50)
    here = path()
    assert path.planned
    assert path.at(0.1) - here == pytest.approx(7.5 * MM, rel=0.01)
    assert path.speed_at(0.1) == pytest.approx(50 * MM)


def test_states_of_the_queue(cnc: MockCnc, ch: Any) -> None:
    """Four slots: the fifth block is queued until one is free."""
    blocks = [ContourQueue(ch) for _ in range(5)]
    assert blocks[0].state is LookaheadState.IDLE
    for fb in blocks:
        fb(0.0, MM, execute=True)
    states = [fb.state for fb in blocks]
    assert states == [LookaheadState.PENDING] * 4 + [LookaheadState.QUEUED]
    cnc.cycle()
    for fb in blocks:
        fb(0.0, MM, execute=True)
    assert blocks[0].state is LookaheadState.DONE
    assert blocks[4].state is LookaheadState.PENDING
    cnc.cycle()
    assert blocks[4](0.0, MM, execute=True)


@pytest.mark.parametrize("answered", [False, True])
def test_the_next_plc_finds_all_slots(cnc: MockCnc, answered: bool) -> None:
    """The one before ended in mid request."""
    with connect(cnc.name) as hli:
        old = [ContourQueue(hli.gpCh[0]) for _ in range(4)]
        for fb in old:
            fb(0.0, MM, execute=True)
        if answered:
            cnc.cycle()
    with connect(cnc.name) as hli:
        new = [ContourQueue(hli.gpCh[0]) for _ in range(4)]
        for _ in range(3):
            for fb in new:
                fb(10 * MM, MM, execute=True)
            cnc.cycle()
        assert all(fb.done and fb.blocks["length"][0] == 20 * MM for fb in new)


def test_an_accident_is_told_apart_from_the_log(cnc: MockCnc, ch: Any) -> None:
    """mode 2 with a length of 0 or less, mode 1 with a length, any other mode."""
    fb = ContourLookahead(ch.contour_lookahead)
    for length, mode, error, name in (
        (0.0, 2, ERROR_LENGTH, "ERROR_LENGTH"),
        (-1.0, 2, ERROR_LENGTH, "ERROR_LENGTH"),
        (-1.0, 0, ERROR_LENGTH, "ERROR_LENGTH"),
        (5.0, 1, ERROR_LENGTH, "ERROR_LENGTH"),
        (5.0, 3, ERROR_MODE, "ERROR_MODE"),
    ):
        fb(0.0, length, mode=mode)
        cnc.cycle()
        assert (fb.error, fb.error_id, fb.error_name) == (True, error, name)
        assert cnc.requests == []
    for length, mode in ((0.0, 0), (0.0, 1), (MM, 2), (MM, 0)):
        fb(0.0, length, mode=mode)
        cnc.cycle()
        assert not fb.error
    assert [request[1] for request in cnc.requests] == [0.0, 0.0, MM, MM]


def test_an_accident_behind_a_pending_request_is_an_error(
    cnc: MockCnc, ch: Any
) -> None:
    """The continuous call takes its answer, and tells that the next one is wrong."""
    fb = ContourLookahead(ch.contour_lookahead)
    fb(0.0, MM, mode=2)
    cnc.cycle()
    fb(0.0, 0.0, mode=2)
    assert (fb.count, fb.error_name) == (1, "ERROR_LENGTH")
    cnc.cycle()
    assert cnc.requests == [(0.0, MM)]
