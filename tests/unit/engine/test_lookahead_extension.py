"""The extension of the look-ahead: what an answer tells beside its elements, the
queue, epochs, details and the plan. Engine and segment in this process.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hli import layout
from hli.areas import Areas
from hli.queue import BUSY, GONE, Ask, Queue, Told
from plc_client.blocks import (
    ContourEnd,
    ContourLookahead,
    ContourQueue,
    EmptyReason,
)
from support.inside import Inside

LINES = "".join(f"N{10 * k} G01 X{k} Y{k % 2} F3000\n" for k in range(1, 7))
MM = 10_000.0


class Plc:
    """Views of an Inside, and the queue."""

    def __init__(self, cnc: Inside) -> None:
        self.cnc = cnc
        self.areas = Areas(cnc.segment)
        self.ch: Any = self.areas.gpCh[0]
        self.ahead: Any = self.areas.gpAhead[0]
        self.queue = Queue(self.ahead)

    def ask(self, *what: Any, **more: Any) -> Told:
        """One request of the queue, answered in the next cycle."""
        ask = Ask(*what, **more)
        slot = self.queue.ask(ask)
        assert slot >= 0
        self.cnc.run(1)
        told = self.queue.take(slot, bool(ask.flags & layout.HLI_AHEAD_DETAILS))
        assert isinstance(told, Told)
        return told

    def unit(self, start: float, length: float) -> tuple[Any, Any]:
        """One request of the manual's unit, and what the extension says of it."""
        return self.cnc.request(start, length), self.ahead.answer


def reason(told: Any) -> EmptyReason:
    return EmptyReason(told.empty)


# ---- point: how many, more, why none
def test_the_area_tells_its_version(tmp_path: Path) -> None:
    """A PLC looks at version and size first."""
    with Inside(tmp_path, LINES) as cnc:
        plc = Plc(cnc)
        assert plc.ahead.version_r == layout.HLI_AHEAD_VERSION
        assert plc.ahead.sizeof_r == layout.HLI_SEGMENT.ahead.size


def test_an_answer_tells_how_many_elements_it_holds(tmp_path: Path) -> None:
    """count is that of the blocks; the request stands beside it."""
    with Inside(tmp_path, LINES) as cnc:
        blocks, facts = Plc(cnc).unit(0.0, 2.5 * MM)
        assert (facts.count, facts.more, facts.empty) == (len(blocks), False, 0)
        assert (facts.start_position, facts.length) == (0.0, 2.5 * MM)
        assert ContourEnd(facts.end) is ContourEnd.PROGRAM


@pytest.mark.parametrize("motions", [127, 128, 129, 300])
def test_more_is_exact_at_the_page_end(tmp_path: Path, motions: int) -> None:
    """A full page alone does not mean that there is more."""
    text = "".join(
        f"N{k} G01 X{k % 50} Y{k / 7:.3f} F100\n" for k in range(1, motions + 1)
    )
    cell = "[channel]\ncontour_lookahead_log_max = 500\n"
    with Inside(tmp_path, text, cell, window=400) as cnc:
        cnc.run(20)
        blocks, facts = Plc(cnc).unit(0.0, 1e9)
        assert len(blocks) == min(motions, 128)
        assert facts.more is (motions > 128)


def test_why_an_answer_of_the_unit_is_empty(tmp_path: Path) -> None:
    """Behind the end, not usable by field; a full answer has no reason."""
    with Inside(tmp_path, LINES) as cnc:
        plc = Plc(cnc)
        assert reason(plc.unit(0.0, MM)[1]) is EmptyReason.NOT_EMPTY
        assert reason(plc.unit(1e9, MM)[1]) is EmptyReason.BEHIND_END
        assert reason(plc.unit(0.0, -1.0)[1]) is EmptyReason.BAD_LENGTH
        assert reason(plc.unit(0.0, math.inf)[1]) is EmptyReason.BAD_LENGTH
        assert reason(plc.unit(math.nan, MM)[1]) is EmptyReason.BAD_START
        assert reason(plc.unit(-5.0, 0.0)[1]) is EmptyReason.BAD_START
        assert reason(plc.unit(0.0, 0.0)[1]) is EmptyReason.BEHIND_END
        assert reason(plc.unit(-9.0, 5.0)[1]) is EmptyReason.DROPPED


def test_a_program_without_a_marked_area_has_none_to_come(
    tmp_path: Path,
) -> None:
    """Not known as long as the program is read, behind the end when it has
    been: a PLC that asks again would ask for ever.
    """
    with Inside(tmp_path, f"{LINES}#FLUSH WAIT\nG01 X0\n") as cnc:
        plc = Plc(cnc)
        _, facts = plc.unit(0.0, 0.0)
        assert reason(facts) is EmptyReason.NOT_KNOWN
        assert ContourEnd(facts.end) is ContourEnd.OPEN
        cnc.run(20_000)
        _, facts = plc.unit(0.0, 0.0)
        assert reason(facts) is EmptyReason.BEHIND_END
        assert ContourEnd(facts.end) is ContourEnd.PROGRAM


def test_why_nothing_of_the_log_is_there(tmp_path: Path) -> None:
    """Behind a closed area there is no more; in front of the closing, not yet."""
    text = f"#CONTOUR LOOKAHEAD LOG ON\n{LINES}#CONTOUR LOOKAHEAD LOG OFF\n"
    with Inside(tmp_path, text) as cnc:
        plc = Plc(cnc)
        _, facts = plc.unit(3.0, 0.0)
        assert (facts.count, ContourEnd(facts.end)) == (5, ContourEnd.LOG)
        assert reason(plc.unit(8.0, 0.0)[1]) is EmptyReason.BEHIND_END
    with Inside(
        tmp_path, f"#CONTOUR LOOKAHEAD LOG ON\n{LINES}#FLUSH WAIT\nG01 X0\n"
    ) as cnc:
        plc = Plc(cnc)
        _, facts = plc.unit(3.0, 0.0)
        assert ContourEnd(facts.end) is ContourEnd.OPEN
        assert reason(plc.unit(8.0, 0.0)[1]) is EmptyReason.NOT_KNOWN
        cnc.end()


@pytest.mark.parametrize(
    ("cell", "length"),
    [
        ('[channel]\ninterpolator_function = "FCT_IPO_DEFAULT"\n', MM),
        ('[channel]\ninterpolator_function = "FCT_IPO_DEFAULT"\n', 0.0),
        ("[channel]\ncontour_lookahead_log_max = 0\n", MM),
    ],
)
def test_a_function_that_is_not_configured_says_so(
    tmp_path: Path, cell: str, length: float
) -> None:
    """DISABLED, not "no elements"."""
    with Inside(tmp_path, LINES, cell) as cnc:
        assert reason(Plc(cnc).unit(0.0, length)[1]) is EmptyReason.DISABLED


def test_behind_the_window_nothing_is_known_yet(tmp_path: Path) -> None:
    """NOT_KNOWN: ask again; later the same request finds elements."""
    text = "".join(f"N{k} G01 X{k} F3000\n" for k in range(1, 60))
    with Inside(tmp_path, text, window=10) as cnc:
        plc = Plc(cnc)
        assert reason(plc.unit(30 * MM, MM)[1]) is EmptyReason.NOT_KNOWN
        cnc.until(lambda: cnc.state.dist_prog_start > 25 * MM)
        assert plc.unit(30 * MM, MM)[0]


def test_a_reset_ahead_is_told(tmp_path: Path) -> None:
    """Elements behind it have distances of their own: not here, not yet."""
    text = "G01 X10 F1000\n#DISTANCE PROG START CLEAR\nG01 X20\n"
    with Inside(tmp_path, text) as cnc:
        plc = Plc(cnc)
        blocks, facts = plc.unit(0.0, 1e9)
        assert (len(blocks), ContourEnd(facts.end)) == (1, ContourEnd.RESET)
        assert reason(plc.unit(11 * MM, MM)[1]) is EmptyReason.BEFORE_RESET
        cnc.until(lambda: plc.unit(5 * MM, MM)[1].end == ContourEnd.PROGRAM)


def test_the_block_tells_why(tmp_path: Path) -> None:
    """ContourLookahead: count, more, empty, of the answer that it shows."""
    with Inside(tmp_path, LINES) as cnc:
        fb = ContourLookahead(Plc(cnc).ch.contour_lookahead)
        seen = []
        for start in (0.0, 1e9, 0.0, 2e9):
            fb(start, MM)
            cnc.run(1)
            seen.append((fb.count, fb.empty, fb.more))
        fb(0.0, MM)
        assert seen[1][1:] == (EmptyReason.NOT_EMPTY, False)
        assert seen[1][0] == 1
        assert seen[2] == (0, EmptyReason.BEHIND_END, False)
        assert fb.empty is EmptyReason.BEHIND_END


# ---- the queue
def test_four_requests_are_answered_in_one_cycle(tmp_path: Path) -> None:
    """Beside the manual's unit; each with its tag; a fifth finds no slot."""
    with Inside(tmp_path, LINES) as cnc:
        plc = Plc(cnc)
        slots = [plc.queue.ask(Ask(k * MM, MM, tag=k + 7)) for k in range(4)]
        assert slots == [0, 1, 2, 3]
        assert plc.queue.ask(Ask(0.0, MM)) == BUSY
        blocks = cnc.request(0.0, 1e9)
        assert len(blocks) == 6
        for k, slot in enumerate(slots):
            told = plc.queue.take(slot)
            assert isinstance(told, Told)
            assert told.facts.tag == k + 7
            starts = [b["start_position"] for b in blocks]
            assert told.blocks["start_position"][0] == max(
                s for s in starts if s <= k * MM
            )
        assert plc.queue.ask(Ask(0.0, MM)) == 0


def test_the_queue_answers_as_the_unit(tmp_path: Path) -> None:
    """Byte for byte, for many ranges, while the path runs."""
    rng = np.random.default_rng(5)
    with Inside(tmp_path, LINES) as cnc:
        plc = Plc(cnc)
        for _ in range(40):
            start, length = rng.uniform(0, 9 * MM), rng.uniform(1, 5 * MM)
            slot = plc.queue.ask(Ask(start, length))
            cnc.request(start, length)
            told = plc.queue.take(slot)
            assert isinstance(told, Told)
            mine = plc.ch.contour_lookahead.response.as_array()
            assert mine[: len(told.blocks)].tobytes() == told.blocks.tobytes()
            assert mine[len(told.blocks)]["block_type"] == 0
            cnc.run(3)


@pytest.mark.parametrize(
    ("what", "why"),
    [
        ({"mode": 3}, EmptyReason.BAD_MODE),
        ({"mode": 0}, EmptyReason.BAD_MODE),
        ({"length": 0.0}, EmptyReason.BAD_LENGTH),
        ({"length": -1.0}, EmptyReason.BAD_LENGTH),
        ({"length": math.nan}, EmptyReason.BAD_LENGTH),
        ({"start_position": math.inf}, EmptyReason.BAD_START),
        ({"flags": 8}, EmptyReason.BAD_FLAGS),
        ({"mode": 1}, EmptyReason.BAD_LENGTH),
        ({"mode": 1, "length": 0.0, "epoch": 1}, EmptyReason.BAD_EPOCH),
        ({"epoch": 99}, EmptyReason.BEHIND_END),
    ],
)
def test_a_bad_field_of_a_request_is_named(
    tmp_path: Path, what: dict[str, Any], why: EmptyReason
) -> None:
    """The queue says its mode: a length of 0 is never the log by accident."""
    with Inside(tmp_path, LINES) as cnc:
        told = Plc(cnc).ask(**{"length": MM, **what})
        assert (reason(told.facts), len(told.blocks)) == (why, 0)


@pytest.mark.parametrize("phase", ["claimed", "asked", "answered"])
def test_slots_of_a_dead_plc_are_free_for_the_next(
    tmp_path: Path, phase: str
) -> None:
    """It died in mid request: nothing is lost, nobody gets its answer."""
    with Inside(tmp_path, LINES) as cnc:
        plc = Plc(cnc)
        cnc.side.plc.generation = 1
        for slot in range(4):
            if phase == "claimed":
                plc.ahead.slot_rw[slot] = 1 << 8 | layout.HLI_AHEAD_CLAIMED
            else:
                assert plc.queue.ask(Ask(0.0, MM, tag=1)) == slot
        if phase == "answered":
            cnc.run(1)
        cnc.side.plc.generation = 2
        if phase == "asked":
            assert plc.queue.ask(Ask(0.0, MM)) == BUSY
            cnc.run(1)
        slots = [plc.queue.ask(Ask(0.0, MM, tag=2)) for _ in range(4)]
        assert sorted(slots) == [0, 1, 2, 3]
        cnc.run(1)
        for slot in slots:
            told = plc.queue.take(slot)
            assert isinstance(told, Told)
            assert told.facts.tag == 2
        assert plc.queue.take(0) == GONE


def test_two_blocks_ask_without_waiting_for_each_other(tmp_path: Path) -> None:
    """Both have an answer in every cycle."""
    with Inside(tmp_path, LINES) as cnc:
        plc = Plc(cnc)
        one, two = ContourQueue(plc.ch), ContourQueue(plc.ch)
        one(0.0, MM)
        two(2 * MM, MM)
        for _ in range(5):
            cnc.run(1)
            assert one(0.0, MM)
            assert two(2 * MM, MM)
            assert one.blocks["block_number"][0] == 10
            assert two.blocks["block_number"][0] != 10


def test_a_block_that_is_gone_gives_its_slot_back(tmp_path: Path) -> None:
    """Also with an answer under way: a restarted PLC program finds four slots."""
    with Inside(tmp_path, LINES) as cnc:
        plc = Plc(cnc)
        for _ in range(3):
            old = [ContourQueue(plc.ch) for _ in range(4)]
            for fb in old:
                fb(0.0, MM)
            cnc.run(1)
            del old, fb
        fbs = [ContourQueue(plc.ch) for _ in range(4)]
        for fb in fbs:
            fb(0.0, MM)
        cnc.run(1)
        assert all(fb(0.0, MM) for fb in fbs)
