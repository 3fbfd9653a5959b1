"""The mock CNC: creates a segment and plays the CNC's side of it, cycle by
cycle, in the caller's thread.
"""

from __future__ import annotations

import os
import uuid
from collections.abc import Sequence

from hli._sync import lib

import hli
from hli import layout
from hli.areas import Areas
from hli.handshake import word_pointer

from ..blocks.mode import ProcessState
from .channel import ACTIVE, VERSION, MockChannel, MockSettings
from .script import Step, by_channel, numbered


class MockCnc(MockChannel):
    """A CNC that plays a script; with a list of scripts one a channel.

    ``feed_mm_s`` is the path speed at 100 % (reached at once: this CNC has no
    acceleration), ``ahead`` how many motions in front of the tool are known,
    ``auto_start`` whether the program runs at once or waits for the PLC's
    command, ``axes`` of each channel. ``cycle()`` is one CNC cycle of
    ``cycle_s``; nothing happens between two calls.  A context manager;
    ``close()`` removes the segment.  ``areas`` are its views, ``ch`` its first
    channel, ``channels`` all of them; its members are those of the first one.
    """

    def __init__(
        self,
        script: Sequence[Step] | Sequence[Sequence[Step]] = (),
        *,
        feed_mm_s: float = 100.0,
        rapid_mm_s: float = 300.0,
        cycle_s: float = 0.001,
        axes: int = 3,
        ahead: int = 120,
        auto_start: bool = True,
        program: str = "mock.nc",
        state_after_end: ProcessState = ProcessState.SELECTED,
        name: str = "",
    ) -> None:
        settings = MockSettings(
            feed_mm_s,
            rapid_mm_s,
            cycle_s,
            ahead,
            auto_start,
            program,
            state_after_end,
        )
        scripts = [numbered(one) for one in by_channel(script)]
        self.name = name or f"hli-mock-{os.getpid()}-{uuid.uuid4().hex[:8]}"
        self.segment = hli.create(
            self.name, len(scripts), axes * len(scripts), ready=False
        )
        areas = Areas(self.segment)
        self._turn = word_pointer(areas.root, "cnc_turn")
        self._begin(areas, cycle_s)
        super().__init__(areas, 0, axes, scripts[0], settings)
        self.channels: list[MockChannel] = [self]
        self.channels += [
            MockChannel(areas, i, axes, one, settings)
            for i, one in enumerate(scripts[1:], 1)
        ]
        for channel in self.channels:
            channel.others_run = self._any_runs
        self.segment.publish()

    @staticmethod
    def _begin(areas: Areas, cycle_s: float) -> None:
        side = areas.sidecar.cnc
        side.pid, side.start = os.getpid(), lib.hs_process_start(os.getpid())
        side.cycle_ns, side.clock, side.generation = (
            round(cycle_s * 1e9),
            layout.HLI_CLOCK_LOCKSTEP,
            1,
        )
        side.phase = layout.HLI_PHASE_READY
        areas.gpPform.nc_config.hli_version_r.zeichen = VERSION

    def _any_runs(self) -> bool:
        return any(
            one.mode.state == ACTIVE and not one.ended for one in self.channels
        )

    def close(self) -> None:
        """Shut down and remove the segment."""
        self.areas.sidecar.cnc.phase = layout.HLI_PHASE_SHUTDOWN
        self.segment.close()
        self.segment.unlink()

    def __enter__(self) -> MockCnc:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def cycle(self) -> None:
        """One cycle of all channels, in their order, and the clock."""
        for channel in self.channels:
            channel.act()
        for channel in self.channels:
            channel.show()
        side = self.areas.sidecar.cnc
        side.cell_time_ns, side.cycle = (
            round(self.cycles * self.cycle_s * 1e9),
            self.cycles,
        )
        lib.hs_word_post(self._turn, self.cycles & 0xFFFFFFFF)

    def run_to(self, cycle: int) -> None:
        """Cycles up to this one."""
        while self.cycles < cycle:
            self.cycle()
