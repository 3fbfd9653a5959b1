"""The mock CNC with several channels."""

from __future__ import annotations

from typing import Any

import pytest

from cnc_core.pytest_plugin import PlcFactory
from hli import layout
from plc_client import ContourLookahead, FeedControl, TechnoServer, task
from plc_client.mock import MockCnc, line, m

SCRIPTS = [[line(10), m(8), line(20)], [line(7), m(9), line(8), line(9)]]


@task(interval=0.001)
class LoopsOverChannels:
    """Asks each channel, acknowledges each channel's functions a scan later."""

    def setup(self, hli: Any) -> None:
        self.hli = hli
        channels = [hli.gpCh[i] for i in range(hli.gNrCh)]
        self.asks = [ContourLookahead(ch) for ch in channels]
        self.feeds = [FeedControl(ch) for ch in channels]
        self.functions = TechnoServer(hli)
        numbers = enumerate((8, 9))
        self.m = [self.functions.on("M", n, channel=i) for i, n in numbers]
        self.done: list[int] = []
        self.held = False

    def cyclic(self) -> None:
        self.functions()
        for i, block in enumerate(self.m):
            if block.active:
                self.done.append(i)
            block(done=block.active)
        for i, feed in enumerate(self.feeds):
            feed(feedhold=self.held and i == 0)
        for ask in self.asks:
            ask(start_position=0.0, length=1e6)


def test_each_channel_plays_its_script(plc: PlcFactory) -> None:
    """Answers, functions and the end are those of the channel; the cell ends
    with the last one.
    """
    runner = plc(LoopsOverChannels, script=SCRIPTS)
    runner.step(5)
    lengths = [
        [100_000.0, 200_000.0],
        [70_000.0, 80_000.0, 90_000.0],
    ]
    found = [one.blocks["length"].tolist() for one in runner.task.asks]
    assert found == lengths
    assert [runner.hli.gpCh[i].head.channel_nr for i in range(2)] == [1, 2]
    runner.run_until(lambda: runner.ended)
    assert sorted(runner.task.done) == [0, 1]
    cnc = runner.cnc
    assert cnc is not None
    assert [one.functions for one in cnc.channels] == [[("M", 8)], [("M", 9)]]
    assert all(one.ended for one in cnc.channels)


def test_a_hold_of_one_channel_leaves_the_other(plc: PlcFactory) -> None:
    """It stands, the other one goes to its end; the cell has not ended."""
    runner = plc(LoopsOverChannels, script=SCRIPTS)
    runner.step(20)
    runner.task.held = True
    runner.step(5)
    stands = runner.hli.gpCh[0].bahn_state.dist_prog_start
    runner.run_until(lambda: bool(runner.hli.gpCh[1].bahn_state.program_end_r))
    assert runner.hli.gpCh[0].bahn_state.dist_prog_start == stands
    assert not runner.ended
    runner.task.held = False
    runner.run_until(lambda: runner.ended)


def test_axes_of_the_channels_are_counted_through() -> None:
    """``gpAx`` holds those of the first channel, then those of the second."""
    with MockCnc(SCRIPTS, axes=2) as cnc:
        numbers = [cnc.areas.gpAx[i].head.log_ax_n_r for i in range(4)]
        assert numbers == [1, 2, 3, 4]
        assert cnc.areas.gNrCh == 2
        assert cnc.areas.sidecar.cnc.phase == layout.HLI_PHASE_READY


def test_what_is_no_step_is_told() -> None:
    """In a script of several, too."""
    with pytest.raises(TypeError, match="a step is needed"):
        MockCnc([[line(1)], ["x"]])  # type: ignore[list-item]
