"""A random operator at several channels: nothing is lost, doubled or mixed up.

The operator holds, releases, resets and starts channels, sets overrides and asks
for contours of any channel in any order.  What the channels then do is compared
with the texts of their programs, which nobody else reads here.
"""

from __future__ import annotations

import random
from collections import Counter
from pathlib import Path
from typing import Any

import pytest

from hli import layout
from hli.handshake import ContourUnit
from plc_client.blocks.program_flow import TechnoArea
from support.channels import AUTOMATIC, Channels

COUNT = 4
CONFIG = "".join(
    f"[channels.c{i}]\nm_synch = {{ {100 + i} = 'MVS_SVS' }}\n"
    f"[channels.c{i}.axes.X]\n"
    for i in range(COUNT)
)
LINES = 12


def length_of(channel: int, line: int) -> float:
    """mm; no two channels have a motion of the same length."""
    return 1.0 + 0.25 * channel + 0.01 * line


def text_of(channel: int) -> str:
    """Motions to and fro; an M function of the channel's own behind each third;
    a signal to the next channel, without a wait for one.
    """
    x, lines = 0.0, []
    for line in range(1, LINES + 1):
        x += length_of(channel, line) * (1 if line % 2 else -1)
        words = f" M{100 + channel}" if line % 3 == 0 else ""
        lines.append(f"N{line} G1 X{x:.6f} F6000{words}")
    receiver = (channel + 1) % COUNT + 1
    lines.append(f"N90 #SIGNAL SYN [ID={channel} CH={receiver}]")
    return "\n".join([*lines, "N99 M30", ""])


class Operator:
    """Acts by a seed, and notes what it has seen of each channel."""

    def __init__(self, cnc: Channels, seed: int) -> None:
        self.cnc, self.draw = cnc, random.Random(seed)
        self.units = [
            ContourUnit(cnc.hli.gpCh[i].contour_lookahead) for i in range(COUNT)
        ]
        self.techno = [
            TechnoArea(cnc.hli.gpCh[i], f"gpCh[{i}]") for i in range(COUNT)
        ]
        self.open: list[tuple[int, Any, int]] = []
        self.functions: Counter[tuple[int, int]] = Counter()
        self.answers = [0] * COUNT
        self.placed: set[int] = set()
        self.starts = [1] * COUNT

    def act(self) -> None:
        """One thing to one channel."""
        channel = self.draw.randrange(COUNT)
        what = self.draw.choice(
            ("hold", "go", "override", "ask", "ask", "ack", "reset", "start")
        )
        getattr(self, f"_{what}")(channel)

    def scan(self) -> None:
        """What is offered is fetched; answers are taken and compared."""
        for channel, area in enumerate(self.techno):
            for array, index, function in area.fetch_all():
                self.functions[channel, function.number] += 1
                self.open.append((channel, array, index))
        for channel in sorted(self.placed):
            self._take(channel)

    def _take(self, channel: int) -> None:
        count = self.units[channel].take()
        if count < 0:
            return
        self.placed.discard(channel)
        self.answers[channel] += 1
        known = {
            round(length_of(channel, line) * 1e4)
            for line in range(1, LINES + 1)
        }
        rows = self.units[channel].rows[:count]
        # a program that is started again begins where the axes stand
        kinds = (rows["block_type"] == layout.HLI_CLAH_LINEAR) & (
            rows["block_number"] > 1
        )
        found = {round(length) for length in rows["length"][kinds].tolist()}
        assert found <= known, (channel, found - known)

    def _hold(self, channel: int) -> None:
        self.cnc.level(channel, "feedhold", True)

    def _go(self, channel: int) -> None:
        self.cnc.level(channel, "feedhold", False)

    def _override(self, channel: int) -> None:
        self.cnc.level(channel, "override_valid", True)
        self.cnc.level(channel, "override", self.draw.choice((300, 1000, 1500)))

    def _ask(self, channel: int) -> None:
        at = float(self.draw.randrange(300_000))
        if channel not in self.placed and self.units[channel].request(at, 1e5):
            self.placed.add(channel)

    def _ack(self, _: int) -> None:
        if self.open:
            _, array, index = self.open.pop(self.draw.randrange(len(self.open)))
            array.acknowledge(index)

    def _reset(self, channel: int) -> None:
        if self.draw.random() < 0.2:
            self.cnc.command(
                channel, AUTOMATIC, layout.HLI_IMCM_PROCESS_RESETTING
            )
            self.open = [one for one in self.open if one[0] != channel]

    def _start(self, channel: int) -> None:
        run = self.cnc.channels[channel]
        if run.file is None or run.modes.running or not run.ended_at:
            return
        self.starts[channel] += 1
        self.cnc.command(
            channel, AUTOMATIC, layout.HLI_IMCM_PROCESS_ACTIVE, run.file.name
        )

    def finish(self) -> None:
        """Lets everything end."""
        for channel in range(COUNT):
            self._go(channel)
        for _ in range(20_000):
            self.scan()
            while self.open:
                self._ack(0)
            self.cnc.run(2)
            if not self.cnc._any_runs() and not self.placed:
                return
        raise AssertionError("it does not end")


def driven(folder: Path, seed: int) -> list[Any]:
    """A run with this operator; what is compared between two runs of it."""
    texts = [text_of(i) for i in range(COUNT)]
    with Channels(folder, texts, CONFIG) as cnc:
        operator, trace = Operator(cnc, seed), []
        for _ in range(120):
            operator.act()
            operator.scan()
            cnc.run(operator.draw.choice((1, 1, 2, 5, 20)))
            trace.append([tuple(cnc.positions(i)) for i in range(COUNT)])
        operator.finish()
        check(cnc, operator)
        cycles = {int(c.engine.state.cycle) for c in cnc.channels}
        assert len(cycles) == 1
        return [trace, operator.functions, operator.answers, cycles]


def check(cnc: Channels, operator: Operator) -> None:
    """Every function came in its own channel; one that ended alone came as often
    as its program has it.
    """
    for (channel, number), count in operator.functions.items():
        assert number == 100 + channel
        assert count <= operator.starts[channel] * (LINES // 3)
    for channel, run in enumerate(cnc.channels):
        if run.end != "completed" or operator.starts[channel] > 1:
            continue
        assert operator.functions[channel, 100 + channel] == LINES // 3
        length_sum = sum(
            length_of(channel, line) for line in range(1, LINES + 1)
        )
        shown = cnc.state(channel).dist_prog_start
        assert shown == pytest.approx(length_sum * 1e4, abs=1.0)
    assert operator.functions
    assert sum(operator.answers) > COUNT
    served = sum(int(c.engine.state.requests_mode2) for c in cnc.channels)
    assert served == sum(operator.answers)
    for channel, run in enumerate(cnc.channels):
        assert run.engine.state.requests_mode2 == operator.answers[channel]


@pytest.mark.parametrize(
    "seed",
    [
        1,
        2,
        *(pytest.param(seed, marks=pytest.mark.long) for seed in range(3, 40)),
    ],
)
def test_a_random_operator_mixes_nothing_up(tmp_path: Path, seed: int) -> None:
    """Functions, answers and distances of each channel are its own, whatever
    is held, reset or started beside it.
    """
    driven(tmp_path, seed)


def test_the_same_operator_gives_the_same_bits(tmp_path: Path) -> None:
    """Positions of all channels, functions and answers come again."""
    assert driven(tmp_path, 5) == driven(tmp_path, 5)
