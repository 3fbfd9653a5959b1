"""The ContourLookahead function block against a fake CNC that is stepped cycle by cycle."""

from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from plc_client import ContourLookahead
from plc_client.blocks.contour_lookahead import ERROR_REQUEST
from support.fake_cnc import FakeCnc, elements


@pytest.fixture
def cnc() -> Iterator[FakeCnc]:
    """300 elements of 10 units of path, a log of 300 entries, standing still."""
    fake = FakeCnc(elements([10.0] * 300), elements([1.0] * 300), speed=0.0)
    yield fake
    fake.remove()


@pytest.fixture
def clah(cnc: FakeCnc) -> ContourLookahead:
    """A function block on channel 0."""
    return ContourLookahead(cnc.ch.contour_lookahead)


def test_continuous_call_takes_an_answer_and_places_the_next_request(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """One answer per CNC cycle; done for the call that brought it."""
    assert not clah(0.0, 25.0)
    assert clah.busy
    cnc.cycle()
    assert clah(100.0, 25.0)
    assert (list(clah.blocks["start_position"]), clah.answer_request) == (
        [0.0, 10.0, 20.0],
        (0.0, 25.0),
    )
    assert clah.busy
    assert not clah(200.0, 25.0)
    cnc.cycle()
    assert clah(300.0, 25.0)
    assert clah.answer_request == (100.0, 25.0)
    assert cnc.requests == [(0.0, 25.0), (100.0, 25.0)]


def test_call_never_waits_for_the_cnc(clah: ContourLookahead) -> None:
    """Without a CNC cycle nothing happens, call after call."""
    assert not any(clah(0.0, 1.0) for _ in range(1000))


def test_execute_places_one_request_per_rising_edge(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """done stays until execute falls; the inputs of the edge count."""
    clah(10.0, 5.0, execute=True)
    clah(99.0, 99.0, execute=True)
    cnc.cycle()
    assert clah(99.0, 99.0, execute=True)
    cnc.cycle()
    assert clah(99.0, 99.0, execute=True)
    assert not clah(99.0, 99.0, execute=False)
    assert cnc.requests == [(10.0, 5.0)]
    clah(20.0, 5.0, execute=True)
    assert not clah.done
    cnc.cycle()
    clah(0.0, 0.0, execute=True)
    assert cnc.requests == [(10.0, 5.0), (20.0, 5.0)]


def test_done_lasts_one_call_when_execute_fell_before_the_answer(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """IEC habit: the result is shown at least once."""
    clah(0.0, 5.0, execute=True)
    clah(0.0, 5.0, execute=False)
    cnc.cycle()
    assert clah(0.0, 5.0, execute=False)
    assert not clah(0.0, 5.0, execute=False)


@pytest.mark.parametrize("bad", [float("nan"), float("inf"), -float("inf")])
def test_request_that_is_not_finite_is_an_error_and_is_not_sent(
    cnc: FakeCnc, clah: ContourLookahead, bad: float
) -> None:
    """error and error_id, gone with the next good call."""
    clah(bad, 1.0)
    assert (clah.error, clah.error_id, clah.busy) == (
        True,
        ERROR_REQUEST,
        False,
    )
    cnc.cycle()
    assert cnc.requests == []
    clah(0.0, 1.0)
    assert (clah.error, clah.error_id) == (False, 0)


def test_answer_is_an_own_copy(cnc: FakeCnc, clah: ContourLookahead) -> None:
    """Later answers and writes to the memory change nothing in the hands of the user."""
    clah(0.0, 15.0)
    cnc.cycle()
    clah(100.0, 15.0)
    first = clah.blocks
    cnc.cycle()
    clah(0.0, 15.0)
    cnc.ch.contour_lookahead.response.as_array()["length"] = -1.0
    assert list(first["start_position"]) == [0.0, 10.0]
    assert list(first["length"]) == [10.0, 10.0]


def test_full_tells_that_there_may_be_more(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """128 elements: ask again; fewer: the end."""
    clah(0.0, 1e9)
    cnc.cycle()
    clah(2900.0, 1e9)
    assert (len(clah.blocks), clah.full) == (128, True)
    cnc.cycle()
    clah(0.0, 1e9)
    assert (len(clah.blocks), clah.full) == (10, False)


def test_index_behind_the_end_gives_an_empty_answer(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """done with no elements."""
    clah(300.0, 0.0)
    cnc.cycle()
    assert clah(300.0, 0.0)
    assert len(clah.blocks) == 0


def test_two_blocks_take_turns(cnc: FakeCnc) -> None:
    """Each gets every second answer and only answers to its own requests."""
    one, two = (ContourLookahead(cnc.ch.contour_lookahead) for _ in range(2))
    got = {1: 0, 2: 0}
    for _ in range(20):
        for key, block, start in ((1, one, 10.0), (2, two, 500.0)):
            if block(start, 5.0):
                got[key] += 1
                assert block.answer_request == (start, 5.0)
                assert list(block.blocks["start_position"]) == [start]
        cnc.cycle()
    assert got[1] + got[2] == 19
    assert abs(got[1] - got[2]) <= 1


def test_five_blocks_are_served_in_order_of_arrival(cnc: FakeCnc) -> None:
    """No starvation: in 50 cycles each gets its tenth, in turn."""
    blocks = [ContourLookahead(cnc.ch.contour_lookahead) for _ in range(5)]
    for _ in range(50):
        for i, block in enumerate(blocks):
            block(10.0 * i, 1.0)
        cnc.cycle()
    served = [int(start / 10.0) for start, _ in cnc.requests]
    assert served[:10] == [0, 1, 2, 3, 4] * 2
    assert {served.count(i) for i in range(5)} == {10}


def test_block_that_is_no_longer_called_does_not_hold_the_unit(
    cnc: FakeCnc,
) -> None:
    """Its answer is fetched for it, and kept until it is called again."""
    left, stays = (ContourLookahead(cnc.ch.contour_lookahead) for _ in range(2))
    left(70.0, 5.0)
    for _ in range(4):
        stays(500.0, 5.0)
        cnc.cycle()
    assert stays(500.0, 5.0)
    assert left(70.0, 5.0)
    assert list(left.blocks["start_position"]) == [70.0]


def test_request_of_a_foreign_plc_program_is_waited_for(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """While somebody else's request is pending none is placed, and its answer
    is not taken for ours.
    """
    unit = cnc.ch.contour_lookahead
    unit.request.length = 1.0
    unit.semaphor_rw = True
    assert not clah(50.0, 5.0)
    cnc.cycle()
    assert not clah(50.0, 5.0)
    cnc.cycle()
    assert clah(50.0, 5.0)
    assert clah.answer_request == (50.0, 5.0)
    assert list(clah.blocks["start_position"]) == [50.0]


def test_read_log_gives_every_entry_once_while_the_log_grows(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """Mode 1 over pages and over growth."""
    whole, read = cnc.log, []
    for grown in (0, 5, 5, 200, 290, 300, 300, 300, 300, 300, 300):
        cnc.log = whole[:grown]
        cnc.cycle()
        read += list(clah.read_log()["block_number"])
    assert read == list(whole["block_number"])


def test_read_log_begins_again_after_a_clear(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """A request under way when the log was cleared is dropped."""
    whole = cnc.log
    cnc.log = whole[:10]
    read = []
    for _ in range(4):
        cnc.cycle()
        read += list(clah.read_log()["block_number"])
    assert read == list(whole["block_number"][:10])
    cnc.log = whole[:13]
    cnc.cycle()
    assert len(clah.read_log()) == 0
    cnc.log = whole[100:104]
    again = []
    for _ in range(4):
        cnc.cycle()
        again += list(clah.read_log()["block_number"])
    assert again == list(whole["block_number"][100:104])


def follow_all(
    cnc: FakeCnc, clah: ContourLookahead, length: float, cycles: int
) -> list[int]:
    """Block numbers that follow() gives over some cycles."""
    numbers: list[int] = []
    for _ in range(cycles):
        cnc.cycle()
        numbers += [int(n) for n in clah.follow(length)["block_number"]]
    return numbers


def test_follow_gives_every_element_once_ahead_of_the_tool(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """The manual's rule for new elements, with a window that moves on."""
    cnc.speed, cnc.ahead = 7.0, 55.0
    assert follow_all(cnc, clah, 200.0, 500) == list(cnc.path["block_number"])


@pytest.mark.ci
@settings(max_examples=40, deadline=None)
@given(
    lengths=st.lists(st.floats(1e-3, 1e6), min_size=1, max_size=300),
    ahead=st.floats(1.0, 1e6),
    length=st.floats(1.0, 1e7),
    steps=st.integers(1, 60),
)
def test_follow_never_loses_or_repeats_an_element(
    lengths: list[float], ahead: float, length: float, steps: int
) -> None:
    """Any lengths, any window, any range of a request."""
    cnc = FakeCnc(elements(lengths), ahead=ahead)
    try:
        cnc.speed = cnc.end() / steps
        numbers = follow_all(
            cnc,
            ContourLookahead(cnc.ch.contour_lookahead),
            length,
            2 * len(lengths) + steps + 3,
        )
        assert numbers == list(cnc.path["block_number"])
    finally:
        cnc.remove()


def test_follow_asks_only_while_there_is_something_new(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """Once all is known the CNC is left alone."""
    follow_all(cnc, clah, 1e9, 10)
    asked = len(cnc.requests)
    assert follow_all(cnc, clah, 1e9, 50) == []
    assert len(cnc.requests) == asked


def test_follow_begins_again_after_a_distance_reset(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """#DISTANCE PROG START CLEAR: the elements behind it come with new distances, each once."""
    first, second = elements([10.0] * 5), elements([20.0] * 40)
    second["block_number"] += 1000
    cnc.path, cnc.speed = first, 12.0
    numbers = follow_all(cnc, clah, 100.0, 5)
    cnc.path, cnc.distance = second, 0.0
    numbers += follow_all(cnc, clah, 100.0, 60)
    assert numbers == [*first["block_number"], *second["block_number"]]
    assert clah.resets == 1


def test_follow_drops_an_answer_from_before_a_reset(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """The request was placed in old distances, the answer would be in old or
    new ones: it is not used.
    """
    cnc.path, cnc.speed, cnc.ahead = elements([10.0] * 20), 10.0, 30.0
    follow_all(cnc, clah, 15.0, 6)
    assert clah.busy
    cnc.path, cnc.distance, cnc.speed = elements([7.0] * 10), 0.0, 0.5
    assert follow_all(cnc, clah, 15.0, 140) == list(cnc.path["block_number"])


def test_follow_does_not_begin_again_in_backward_motion(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """The distance falls while backward_active_r is TRUE: no element is repeated."""
    cnc.speed = 50.0
    numbers = follow_all(cnc, clah, 1e9, 10)
    cnc.ch.bahn_state.backward_active_r = True
    cnc.speed = -20.0
    numbers += follow_all(cnc, clah, 1e9, 10)
    cnc.ch.bahn_state.backward_active_r = False
    cnc.speed = 50.0
    numbers += follow_all(cnc, clah, 1e9, 10)
    assert numbers == list(cnc.path["block_number"])


def test_follow_skips_elements_the_cnc_has_dropped(
    cnc: FakeCnc, clah: ContourLookahead
) -> None:
    """A PLC that comes late starts with the oldest element that is still there."""
    cnc.path = cnc.path[100:]
    numbers = follow_all(cnc, clah, 1.5, 250)
    assert numbers == list(cnc.path["block_number"])


@pytest.mark.parametrize("length", [0.0, -1.0, float("nan")])
def test_follow_needs_a_range(clah: ContourLookahead, length: float) -> None:
    """Length 0 would be mode 1."""
    with pytest.raises(ValueError, match="length"):
        clah.follow(length)


def test_both_modes_share_one_unit(cnc: FakeCnc) -> None:
    """A reader of the log and a follower of the contour, each complete."""
    log, contour = (
        ContourLookahead(cnc.ch.contour_lookahead) for _ in range(2)
    )
    cnc.speed, cnc.ahead = 20.0, 200.0
    entries, numbers = [], []
    for _ in range(400):
        entries += list(log.read_log()["block_number"])
        numbers += list(contour.follow(150.0)["block_number"])
        cnc.cycle()
    assert np.array_equal(entries, cnc.log["block_number"])
    assert np.array_equal(numbers, cnc.path["block_number"])
