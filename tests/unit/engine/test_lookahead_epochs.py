"""The look-ahead extension past distance resets and loops, details of elements,
and the plan against what is driven. Engine and segment in this process.
"""

from __future__ import annotations

import cmath
import itertools
import math
import random
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from hli import layout
from hli.areas import Areas
from hli.queue import Ask, Queue, Told
from plc_client import clock
from plc_client.blocks import (
    ContourEnd,
    DistanceTrigger,
    EmptyReason,
    PathEstimate,
)
from support.inside import Inside
from support.seeds import few

MM = 10_000.0
BEYOND = layout.HLI_AHEAD_BEYOND
EVENTS = layout.HLI_AHEAD_EVENTS
DETAILS = layout.HLI_AHEAD_DETAILS
START, END = (
    layout.HLI_AHEAD_HAS_START_PLAN,
    layout.HLI_AHEAD_HAS_END_PLAN,
)
RESETS = """G01 X10 F1000
N2 X20
#DISTANCE PROG START CLEAR
N3 X23
N4 X30
#DISTANCE PROG START CLEAR
N5 X50
"""
ARC_LINE_ARC = "N1 G03 X40 Y0 I20 J0 F6000\nN2 G01 X80\nN3 G03 X120 Y0 I20 J0\n"
ARC = """N1 G01 X40 F6000
N2 G03 X60 Y20 I0 J20
N3 G01 Y60
"""
WITHOUT_JERK = "".join(f"[axes.{name}]\nj_max_mm_s3 = 0.0\n" for name in "XYZ")


def ask(cnc: Inside, *what: Any, **more: Any) -> Told:
    """One request of the queue, answered in the next cycle."""
    queue, wanted = Queue(Areas(cnc.segment).gpAhead[0]), Ask(*what, **more)
    slot = queue.ask(wanted)
    cnc.run(1)
    told = queue.take(slot, bool(wanted.flags & DETAILS))
    assert isinstance(told, Told)
    return told


def numbers(told: Told) -> list[int]:
    return [int(n) for n in told.blocks["block_number"]]


# ---- epochs
def test_beyond_a_reset_the_next_epochs_follow(tmp_path: Path) -> None:
    """With their own distances, and an epoch each; without BEYOND none of them."""
    with Inside(tmp_path, RESETS) as cnc:
        near = ask(cnc, 0.0, 1e9)
        assert numbers(near) == [0, 2]
        assert ContourEnd(near.facts.end) is ContourEnd.RESET
        far = ask(cnc, 0.0, 1e9, flags=BEYOND | DETAILS)
        assert numbers(far) == [0, 2, 3, 4, 5]
        assert list(far.blocks["start_position"] / MM) == [0, 10, 0, 3, 0]
        first = int(far.facts.epoch)
        epochs = [int(e) - first for e in far.details["epoch"]]
        assert epochs == [0, 0, 1, 1, 2]
        assert ContourEnd(far.facts.end) is ContourEnd.PROGRAM
        ways = far.details["way"] + far.facts.dist_prog_start
        assert ways == pytest.approx(np.array([0, 10, 20, 23, 30]) * MM)


def test_the_length_counts_on_over_a_reset(tmp_path: Path) -> None:
    """From 15 mm on 10 mm more: 5 of this epoch, 5 of the next."""
    with Inside(tmp_path, RESETS) as cnc:
        assert numbers(ask(cnc, 15 * MM, 10 * MM, flags=BEYOND)) == [2, 3, 4]
        assert numbers(ask(cnc, 15 * MM, 8 * MM, flags=BEYOND)) == [2, 3]


def test_a_later_epoch_may_be_asked_by_number(tmp_path: Path) -> None:
    """Its distances count from its own reset; behind the last one is the end."""
    with Inside(tmp_path, RESETS) as cnc:
        now = int(ask(cnc, 0.0, 1.0).facts.epoch)
        assert numbers(ask(cnc, 0.0, 4 * MM, epoch=now + 1)) == [3, 4]
        assert numbers(ask(cnc, 5 * MM, 1e9, epoch=now + 1)) == [4]
        told = ask(cnc, 5 * MM, 1e9, epoch=now + 1, flags=BEYOND)
        assert numbers(told) == [4, 5]
        told = ask(cnc, 0.0, 1e9, epoch=now + 3)
        assert EmptyReason(told.facts.empty) is EmptyReason.BEHIND_END
        cnc.until(lambda: ask(cnc, 0.0, 1.0).facts.epoch == now + 1)
        told = ask(cnc, 0.0, 1.0, epoch=now)
        assert EmptyReason(told.facts.empty) is EmptyReason.DROPPED


def test_every_element_comes_once_to_who_pages_over_resets(
    tmp_path: Path,
) -> None:
    """Epoch and end of the last element are where the next request begins."""
    text = "".join(
        f"N{k} G01 X{k} F6000\n"
        + ("#DISTANCE PROG START CLEAR\n" if k % 7 == 3 else "")
        for k in range(1, 60)
    )
    with Inside(tmp_path, text, window=12) as cnc:
        seen: list[int] = []
        epoch, at = 0, 0.0
        for _ in range(20_000):
            told = ask(cnc, at, 1e9, epoch=epoch, flags=BEYOND | DETAILS)
            seen += numbers(told)
            if len(told.blocks):
                epoch = int(told.details["epoch"][-1])
                last = told.blocks[-1]
                at = float(last["start_position"] + last["length"])
            if ContourEnd(told.facts.end) is ContourEnd.PROGRAM:
                break
            cnc.run(5)
        assert seen == list(range(1, 60))


def test_behind_a_loop_the_contour_goes_on(tmp_path: Path) -> None:
    """Distances as if the loop were left at the end of this pass; no time."""
    text = "N1 G01 X10 F1000\n#RT WHILE\nN2 X20\nN3 X10\n#RT ENDWHILE\nN4 X0\n"
    with Inside(tmp_path, text) as cnc:
        cnc.level(cnc.bahn.rt_loop_enable, True)
        near = ask(cnc, 0.0, 1e9)
        assert (numbers(near), near.facts.end) == ([1, 2, 3], ContourEnd.LOOP)
        far = ask(cnc, 0.0, 1e9, flags=BEYOND | DETAILS)
        assert numbers(far) == [1, 2, 3, 4]
        assert far.blocks["start_position"][3] == 30 * MM
        first, *_, last = (int(e) for e in far.details["epoch"])
        assert last == first + 2
        inside = ask(cnc, 10 * MM, 1e9, epoch=first + 1)
        assert numbers(inside) == [2, 3]
        assert not far.details["flags"][3] & (
            layout.HLI_AHEAD_HAS_WAY | START | END
        )


# ---- details
def test_functions_stand_in_place(tmp_path: Path) -> None:
    """M, H, S, T and dwells between the elements, each once, whatever the page."""
    text = (
        "N1 G01 X10 F1000 M8\nN2 S500\nN3 G04 X0.5\nN4 X20 H7\nN5 T3\nN6 M30\n"
    )
    with Inside(tmp_path, text) as cnc:
        told = ask(cnc, 0.0, 1e9, flags=EVENTS | DETAILS)
        rows = list(
            zip(
                told.blocks["block_type"].tolist(),
                told.blocks["block_number"].tolist(),
                told.details["code"].tolist(),
                told.details["value"].tolist(),
                strict=True,
            )
        )
        assert rows[:6] == [
            (layout.HLI_CLAH_M, 1, 8, 0.0),
            (layout.HLI_CLAH_LINEAR, 1, 0, 0.0),
            (layout.HLI_CLAH_S, 2, 0, 500.0),
            (layout.HLI_CLAH_DWELL, 3, 0, 0.5),
            (layout.HLI_CLAH_H, 4, 7, 0.0),
            (layout.HLI_CLAH_LINEAR, 4, 0, 0.0),
        ]
        assert (layout.HLI_CLAH_T, 5, 3, 0.0) in rows
        paged: list[int] = []
        for at in (0.0, 5 * MM, 10 * MM, 15 * MM):
            blocks = ask(cnc, at, 5 * MM, flags=EVENTS).blocks
            events = blocks[blocks["block_type"] >= layout.HLI_CLAH_DWELL]
            paged += events["block_number"].tolist()
        assert paged == [1, 2, 3, 4]


def test_places_directions_and_feeds(tmp_path: Path) -> None:
    """In axis positions, unit vectors, 1 um/s; a rapid motion has no feed."""
    text = "N1 G00 X10 Y5\nN2 G01 X20 F1200\nN3 G03 X30 Y15 I0 J10\n"
    with Inside(tmp_path, text) as cnc:
        told = ask(cnc, 0.0, 1e9, flags=DETAILS).details
        rapid = [bool(f & layout.HLI_AHEAD_RAPID) for f in told["flags"]]
        assert rapid == [True, False, False]
        assert list(told["feed"]) == [0.0, 20_000.0, 20_000.0]
        assert told["start"][1][:2].tolist() == [10 * MM, 5 * MM]
        assert told["end"][2][:2].tolist() == [30 * MM, 15 * MM]
        assert told["direction_start"][2] == pytest.approx([1, 0, 0])
        assert told["direction_end"][2] == pytest.approx([0, 1, 0], abs=1e-9)
        assert told["driven_length"][0] == pytest.approx(np.hypot(10, 5) * MM)


def test_the_driven_length_under_smoothing(tmp_path: Path) -> None:
    """Rounded corners are shorter than programmed; together, as the path is."""
    text = "G01 F3000\n#HSC ON [CONTERROR 0.5]\n" + "".join(
        f"N{k} X{4 * k} Y{4 * (k % 2)}\n" for k in range(1, 12)
    )
    text += "#HSC OFF\nX60\n"
    with Inside(tmp_path, text) as cnc:
        told = ask(cnc, 0.0, 1e9, flags=DETAILS)
        has = [
            bool(f & layout.HLI_AHEAD_HAS_DRIVEN) for f in told.details["flags"]
        ]
        assert all(has)
        programmed = told.blocks["length"]
        driven = told.details["driven_length"]
        assert (driven[1:10] < programmed[1:10]).all()
        cnc.end()
        path = np.concatenate(cnc.paths)[-1]
        assert driven.sum() / MM == pytest.approx(path, rel=1e-6)


# ---- the plan
class Noted:
    """What the estimate said in every cycle."""

    def __init__(self, cnc: Inside, ahead: tuple[float, ...]) -> None:
        self.cnc, self.ahead = cnc, ahead
        self.areas = Areas(cnc.segment)
        clock.set_source(lambda: int(cnc.engine.state.cycle) * 1_000_000)
        self.fb = PathEstimate(self.areas.gpCh[0])
        self.rows: list[Any] = []

    def cycle(self, override: int = 1000) -> None:
        cnc, state = self.cnc, self.cnc.state
        cnc.level(cnc.bahn.override, override)
        cnc.level(cnc.bahn.override_valid, True)
        cnc.run(1)
        self.fb()
        plan = self.fb.plan
        fits = self.fb.planned and abs(plan.override - override / 1000) < 1e-9
        reach = plan.horizon if self.fb.planned else 0.0
        told = [
            (self.fb.at(t), self.fb.speed_at(t))
            if fits and t <= reach
            else None
            for t in self.ahead
        ]
        now = (state.dist_prog_start, state.active_feed_r * 10.0)
        self.rows.append((override, now, told))

    def wrong(self) -> tuple[float, float, int]:
        """Largest errors: of distance against the way driven since, of speed
        against the highest; how many estimates were compared.
        """
        place = speed = 0.0
        compared = 0
        top = max(now[1] for _, now, _ in self.rows)
        for i, (override, now, told) in enumerate(self.rows):
            for seconds, one in zip(self.ahead, told, strict=True):
                k = i + round(seconds * 1000)
                if one is None or k >= len(self.rows):
                    continue
                between = self.rows[i : k + 1]
                if any(row[0] != override for row in between):
                    continue
                _, then, _ = self.rows[k]
                way = then[0] - now[0]
                if way > 0.1 * MM:
                    place = max(place, abs(one[0] - then[0]) / way)
                speed = max(speed, abs(one[1] - then[1]) / top)
                compared += 1
        return place, speed, compared


@pytest.mark.ci
@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "acceleration"])
def test_arc_line_arc_as_foreseen(tmp_path: Path, jerk: bool) -> None:
    """Place and speed in 20 to 200 ms are right to 1 %, also behind a change of
    the override, as soon as the plan was made with it.
    """
    with Inside(tmp_path, ARC_LINE_ARC, "" if jerk else WITHOUT_JERK) as cnc:
        noted = Noted(cnc, (0.02, 0.1, 0.2))
        overrides = itertools.cycle([1000, 500, 1200, 300, 800])
        override = next(overrides)
        for i in range(1, 20_000):
            if i % 400 == 0:
                override = next(overrides)
            noted.cycle(override)
            if cnc.state.program_end_r:
                break
        place, speed, compared = noted.wrong()
        assert compared > 1.5 * len(noted.rows)
        assert place < 0.01
        assert speed < 0.01


@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "acceleration"])
def test_the_plan_reaches_over_tangential_joints(
    tmp_path: Path, jerk: bool
) -> None:
    """A quarter, a line, a quarter: 0.1 s ahead is always known and right to
    1 %, as soon as the plan has the override of now.
    """
    text = "G03 X10 Y10 J10 F6000\nG01 Y30\nG02 X20 Y40 I10 J0\n"
    with Inside(tmp_path, text, "" if jerk else WITHOUT_JERK) as cnc:
        noted = Noted(cnc, (0.1,))
        overrides = [1000, 400, 1200]
        while not cnc.state.program_end_r or len(noted.rows) < 100:
            noted.cycle(overrides[len(noted.rows) // 250 % 3])
        place, speed, compared = noted.wrong()
        unknown = sum(told[0] is None for *_, told in noted.rows)
        changes = len(noted.rows) // 250
        assert unknown <= 20 * (changes + 1)
        assert compared > len(noted.rows) - 120 * (changes + 1)
        assert place < 0.01
        assert speed < 0.01


def _tangential(rng: random.Random) -> str:
    """Arcs and lines in turn, tangential to each other."""
    text, at, course = "F6000\n", complex(0.0, 0.0), 0.0
    for k in range(rng.randint(3, 6)):
        if k % 2:
            at += cmath.rect(rng.uniform(5, 40), course)
            text += f"G01 X{at.real:.9f} Y{at.imag:.9f}\n"
            continue
        radius, side = rng.uniform(5, 25), rng.choice([1, -1])
        arm = cmath.rect(radius, course + side * math.pi / 2)
        turn = side * rng.uniform(0.3, 2.5)
        course += turn
        at += arm - arm * cmath.rect(1.0, turn)
        text += (
            f"G0{3 if side > 0 else 2} X{at.real:.9f} Y{at.imag:.9f}"
            f" I{arm.real:.9f} J{arm.imag:.9f}\n"
        )
    return text


@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "acceleration"])
@pytest.mark.parametrize("seed", few([6, 0, 1, 2, 3, 4, 5, 7, 11], 1))
def test_random_arcs_and_lines_as_foreseen(
    tmp_path: Path, seed: int, jerk: bool
) -> None:
    """Under a random override: known but for some milliseconds behind each of
    its changes, and right to 1 %.
    """
    rng = random.Random(seed)
    text = _tangential(rng)
    with Inside(tmp_path, text, "" if jerk else WITHOUT_JERK) as cnc:
        noted, override, changes = Noted(cnc, (0.02, 0.1)), 1000, [0]
        while not cnc.state.program_end_r or len(noted.rows) < 100:
            noted.cycle(override)
            if len(noted.rows) > changes[-1] + rng.randint(130, 500):
                override = rng.choice([200, 500, 800, 1000, 1200, 1500])
                changes.append(len(noted.rows))
        place, speed, compared = noted.wrong()
        unknown = sum(told[1] is None for *_, told in noted.rows)
        assert compared > 0
        assert unknown <= 20 * len(changes)
        assert place < 0.01
        assert speed < 0.01


def test_the_plan_reaches_to_where_the_path_stands(tmp_path: Path) -> None:
    """The brake to a sharp corner is known to its end; only what is behind the
    corner is not.
    """
    text = "G03 X20 Y0 I10 J0 F6000\nG01 X30\n"
    with Inside(tmp_path, text) as cnc:
        noted = Noted(cnc, (0.02,))
        while not cnc.state.program_end_r or len(noted.rows) < 100:
            noted.cycle()
        place, speed, _ = noted.wrong()
        unknown = sum(told[0] is None for *_, told in noted.rows)
        assert unknown <= 30
        assert place < 0.01
        assert speed < 0.01


def test_without_a_plan_nothing_is_reached(tmp_path: Path) -> None:
    """The horizon is 0 then."""
    with Inside(tmp_path, ARC) as cnc:
        path = PathEstimate(Areas(cnc.segment).gpCh[0])
        assert path.plan.horizon == 0.0
        assert not path.planned
        assert path.at(1.0) == 0.0


def test_a_zigzag_as_foreseen(tmp_path: Path) -> None:
    """A plan that brakes for its own end over several pieces is shown up to
    that brake only: place and speed are right to 1 %.
    """
    rng, x, text = random.Random(0), 0.0, "G01 F6000\n"
    for _ in range(60):
        x += rng.uniform(0.3, 6)
        text += f"X{x:.4f} Y{rng.uniform(-3, 3):.4f}\n"
    with Inside(tmp_path, text) as cnc:
        cnc.run(1900)
        noted = Noted(cnc, (0.02, 0.1))
        for _ in range(350):
            noted.cycle()
        place, speed, compared = noted.wrong()
        assert compared > 120
        assert place < 0.01
        assert speed < 0.01


@pytest.mark.parametrize("jerk", [True, False], ids=["jerk", "acceleration"])
def test_elements_are_reached_when_and_as_fast_as_told(
    tmp_path: Path, jerk: bool
) -> None:
    """Told once at the beginning: true to a cycle, and the speed lies between
    those of the cycles around it.
    """
    with Inside(tmp_path, ARC, "" if jerk else WITHOUT_JERK) as cnc:
        areas = Areas(cnc.segment)
        areas.gpAhead[0].plan_enable_w = True
        cnc.run(60)
        told = ask(cnc, 0.0, 1e9, flags=DETAILS)
        begin = int(cnc.engine.state.cycle)
        reached: dict[int, tuple[int, list[float]]] = {}
        before = 0.0
        while not cnc.state.program_end_r:
            cnc.run(1)
            number = int(cnc.state.block_number_r)
            cycle = int(cnc.engine.state.cycle) - begin
            speed = float(cnc.state.active_feed_r)
            reached.setdefault(number, (cycle, sorted([before, speed])))
            before = speed
        known = 0
        for block, row in zip(told.blocks, told.details, strict=True):
            number = int(block["block_number"])
            if number == 1 or not row["flags"] & START:
                continue
            cycle, (low, high) = reached[number]
            assert abs(row["time_start"] / 1000.0 - cycle) <= 1.5
            assert low - 2.0 <= row["speed_start"] <= high + 2.0
            known += 1
        assert known == 2
        assert told.details["flags"][2] & END
        assert told.details["speed_end"][2] == pytest.approx(0.0, abs=1.0)


def test_a_plan_nobody_wants_is_not_made(tmp_path: Path) -> None:
    """Details then have neither times nor speeds."""
    with Inside(tmp_path, ARC) as cnc:
        told = ask(cnc, 0.0, 1e9, flags=DETAILS)
        assert not (told.details["flags"] & (START | END)).any()
        assert not Areas(cnc.segment).gpAhead[0].state.plan_valid


@pytest.mark.ci
@pytest.mark.parametrize("seed", few(range(6), 1))
def test_switches_on_arc_line_arc_do_not_chatter(
    tmp_path: Path, seed: int
) -> None:
    """Each output rises once, however the override moves meanwhile, and within
    what a change of the override in its dead time makes.
    """
    lead_s = 0.02
    places = [10 * MM, 62 * MM, 63 * MM, 90 * MM, 103 * MM, 140 * MM]
    with Inside(tmp_path, ARC_LINE_ARC) as cnc:
        noted = Noted(cnc, ())
        channel = noted.areas.gpCh[0]
        switches = [
            DistanceTrigger(channel, 0.001, noted.fb, 0.05 * MM) for _ in places
        ]
        shuffle = random.Random(seed)
        override, rises = 1000.0, [list[float]() for _ in places]
        while not cnc.state.program_end_r or not cnc.state.dist_prog_start:
            override += shuffle.choice((-20.0, -5.0, 0.0, 5.0, 20.0))
            override = min(max(override, 100.0), 1500.0)
            before = [switch.q for switch in switches]
            noted.cycle(int(override))
            for i, switch in enumerate(switches):
                if switch(places[i], lead_s) and not before[i]:
                    rises[i].append(cnc.state.dist_prog_start)
        top = max(now[1] for _, now, _ in noted.rows)
    assert [len(one) for one in rises] == [1] * len(places)
    for place, (at,) in zip(places, rises, strict=True):
        assert 0 <= place - at <= top * (lead_s + 0.001)


def test_a_reset_crossed_backward_gives_the_distance_ahead_of_it(
    tmp_path: Path,
) -> None:
    """Also where the path stands there: distance and epoch belong together, and
    what lies ahead begins where the path is.
    """
    text = "N10 G01 X5 F6000\n#DISTANCE PROG START CLEAR\nN60 X25 F1000\n"
    with Inside(tmp_path, text) as cnc:
        ahead = cnc.segment.root.ahead[0].state
        cnc.run(2)
        first = int(ahead.epoch)
        cnc.until(lambda: ahead.epoch == first + 1)
        cnc.run(20)
        cnc.level(cnc.bahn.single_block, True)
        cnc.level(cnc.bahn.backward_motion, True)
        cnc.until(lambda: cnc.state.dist_prog_start < 500)
        cnc.level(cnc.bahn.feedhold, True)
        cnc.run(200)
        assert cnc.pos[-1, 0] == 5.0
        assert ahead.epoch == first
        assert cnc.state.dist_prog_start == 5 * MM
        assert cnc.clah.state.max_dist_prog_start == 5 * MM
