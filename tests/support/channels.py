"""A CNC with several channels inside the test's own process; the test plays the
PLC on the raw memory.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

from cnc_core.config import CellConfig, parse_config, setups_of
from cnc_core.engine import Event
from cnc_core.engine.group import EngineGroup
from cnc_core.frontend.operator import Operator
from cnc_core.process.axes import AxisBoard
from cnc_core.process.channel_run import ChannelRun, Shared
from cnc_core.process.identity import fill_cell
from cnc_core.process.jobs import JobBoard
from cnc_core.process.operator_desk import OperatorDesk
from cnc_core.process.options import CncOptions, RunOptions
from cnc_core.process.signals import SignalBoard
from hli import layout, segment
from hli.areas import Areas

THREE = """
[channels.mill.axes.X]
[channels.mill.axes.Y]
[channels.loader.axes.X]
[channels.loader.axes.Z]
[channels.saw.axes.Y]
"""


class Channels:
    """``with Channels(tmp_path, ["N1 G1 X1 F1000", ...]) as cnc``: one program a
    channel, all in one thread and in virtual time.
    """

    def __init__(
        self,
        folder: Path,
        texts: Sequence[str | None],
        config: str | CellConfig = THREE,
        suffix: str = "nc",
        start: bool = True,
        samples: Path | None = None,
        **run: Any,
    ) -> None:
        cell = parse_config(config) if isinstance(config, str) else config
        files = [
            self._write(folder, text, suffix) if text is not None else None
            for text in texts
        ]
        name = f"t{os.getpid()}-{secrets.token_hex(4)}"
        setups = setups_of(cell)
        self.segment = segment.create(
            name, len(setups), sum(s.areas for s in setups), ready=False
        )
        options = CncOptions(
            files[0],
            name,
            RunOptions(**{"clock": "freerun", **run}),
            more=(*files[1:],),
            samples=samples,
        )
        self.root = self.segment.root
        clock = options.run.clock
        fill_cell(self.root, cell.cycle_s, clock, "cyclic")
        self.told: list[str] = []
        self.plc = False  # whether a PLC could start a program
        names = [setup.place.name for setup in setups]
        self.board = SignalBoard(names, lambda: self.plc)
        shared = Shared(
            options,
            self.segment,
            OperatorDesk(dict),
            Operator(),
            self.told.append,
            self.told.append,
            folder,
            self.board,
            AxisBoard(setups, self.board),
            JobBoard(self.board),
        )
        self.channels = [ChannelRun(setup, shared) for setup in setups]
        self.group = EngineGroup([one.engine for one in self.channels])
        self.hli = Areas(self.segment)
        for i in range(len(setups)):
            self.root.channel[i].head.plc_present_w = True
        for channel in self.channels:
            channel.others_run = self._any_runs
            channel.engine.hold_start(False)
            channel.ready()
            if start:
                channel.start()
        self.board.all_begun = True

    @staticmethod
    def _write(folder: Path, text: str, suffix: str) -> Path:
        path = folder / f"channel-{secrets.token_hex(4)}.{suffix}"
        path.write_text(text)
        return path

    def _any_runs(self) -> bool:
        return any(
            one.modes.running and not one.ended_at for one in self.channels
        )

    def __enter__(self) -> Channels:
        return self

    def __exit__(self, *_: object) -> None:
        for channel in self.channels:
            program = channel.preparation and channel.preparation.program
            if program:
                program.reader.close()
            channel.engine.close()
        self.segment.unlink()

    @property
    def cycle(self) -> int:
        return int(self.channels[0].engine.state.cycle)

    def run(self, cycles: int) -> None:
        """Cycles of all channels, events handled as the process does."""
        end = self.cycle + cycles
        while (left := end - self.cycle) > 0:
            event, who = self.group.run(left)
            assert event is not Event.FAULT
            self.channels[who].handle(event)

    def until(
        self, what: Callable[[], bool], step: int = 1, limit: int = 100_000
    ) -> None:
        """Cycles until something is true."""
        for _ in range(0, limit, step):
            if what():
                return
            self.run(step)
        raise AssertionError("it never becomes true")

    def end(self) -> list[str]:
        """Until no program runs; how each ended."""
        self.until(lambda: not self._any_runs(), 50)
        return [channel.end for channel in self.channels]

    def state(self, index: int) -> Any:
        """``gpCh[index]^.bahn_state``."""
        return self.root.channel[index].bahn_state

    def level(self, index: int, unit: str, value: Any) -> None:
        """Command a level unit of a channel's ``bahn_mc_control``."""
        control = getattr(self.root.channel[index].bahn_mc_control, unit)
        control.command_w, control.enable_w = value, True

    def command(
        self, index: int, mode: int, state: int, name: str = ""
    ) -> None:
        """A mode command of the PLC."""
        unit = self.root.channel[index].channel_mc_control.mode_and_state
        unit.command_w.to_mode, unit.command_w.to_state = mode, state
        unit.command_w.parameter = name.encode()
        unit.enable_w = True
        unit.command_semaphor_rw = True

    def positions(self, index: int) -> list[float]:
        """Of the channel's axes, mm."""
        channel = self.channels[index]
        state = channel.engine.state
        return [float(p) for p in list(state.position)[: channel.engine.axes]]


AUTOMATIC = layout.HLI_IMCM_AUTOMATIC_MODE
