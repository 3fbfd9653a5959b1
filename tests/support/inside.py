"""A CNC inside the test's own process: engine, segment and one program; the
test plays the PLC on the raw memory.
"""

from __future__ import annotations

import os
import secrets
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from cnc_core.config import CellConfig, parse_config
from cnc_core.engine import Engine, Event
from cnc_core.engine.external import AREA_BYTES
from cnc_core.process.identity import fill_identity
from cnc_core.process.live_port import LivePort
from cnc_core.process.preparation import Preparation
from hli import layout, segment
from support.limits import FloatArray


class Inside:
    """``with Inside(tmp_path, "N10 G1 X10 F1000") as cnc``; ``cnc.channel`` is
    the channel's memory.

    ``levels``: units of ``bahn_mc_control`` commanded a cycle ahead of the
    program.
    """

    def __init__(
        self,
        folder: Path,
        text: str,
        config: str | CellConfig = "",
        dialect: str | None = None,
        suffix: str = "nc",
        levels: dict[str, Any] | None = None,
        **engine: Any,
    ) -> None:
        self.cell = parse_config(config) if isinstance(config, str) else config
        path = folder / f"inside-{secrets.token_hex(4)}.{suffix}"
        path.write_text(text)
        self.segment = segment.create(
            f"t{os.getpid()}-{secrets.token_hex(4)}",
            1,
            len(self.cell.axes),
            ready=False,
        )
        root = self.segment.root
        fill_identity(root, self.cell, "freerun", "cyclic", path.name)
        self.channel, self.axes = root.channel[0], root.axis
        self.state, self.bahn, self.side = (
            self.channel.bahn_state,
            self.channel.bahn_mc_control,
            root.sidecar,
        )
        self.clah = self.channel.contour_lookahead
        self.channel.head.plc_present_w = True
        self.engine = Engine(
            self.cell,
            segment=self.segment,
            clock=layout.HLI_CLOCK_FREERUN,
            record_rows=200_000,
            **engine,
        )
        for name, value in (levels or {}).items():
            self.level(getattr(self.bahn, name), value)
        if levels:
            self.engine.expect_cycle()
            assert self.engine.run(1) is Event.DONE
        self.preparation = Preparation(
            path, self.cell, dialect, self.engine, self._port()
        )
        self.preparation.pump()
        self.parts: list[FloatArray] = []
        self.paths: list[FloatArray] = []
        self.events: list[Event] = []

    def _port(self) -> LivePort | None:
        """A port to the external variables, if the cell has any."""
        if not self.cell.externals:
            return None
        areas = {
            scope: self.engine.external(area, AREA_BYTES)
            for area, scope in enumerate(("channel", "global"))
        }
        start = self.cell.axis_values("start_mm")
        return LivePort(start, areas, put_out=self.engine.write_external)

    def __enter__(self) -> Inside:
        return self

    def __exit__(self, *_: object) -> None:
        self.engine.close()
        self.segment.unlink()

    def run(self, cycles: int) -> None:
        """Cycles, preparation pumped as the engine asks for it."""
        end = int(self.engine.state.cycle) + cycles
        while (left := end - int(self.engine.state.cycle)) > 0:
            event = self.engine.run(left)
            self.events.append(event)
            assert self.prepare(event) or event in (
                Event.DONE,
                Event.PROGRAM_END,
                Event.RECORD_FULL,
            ), event
            if event is Event.RECORD_FULL:
                self._take()
        self._take()

    def prepare(self, event: Event) -> bool:
        """What preparation does on an event; False: it is not for preparation."""
        if event is Event.NEED_BLOCKS:
            self.preparation.pump()
        elif event is Event.DRAINED:
            self.preparation.drained()
            self.preparation.pump()
        elif event is Event.RETRACED:
            self.preparation.retraced()
        else:
            return False
        return True

    def _take(self) -> None:
        samples = self.engine.take_samples()
        self.parts.append(samples.pos)
        self.paths.append(samples.path)

    def until(
        self, what: Callable[[], bool], step: int = 1, limit: int = 200_000
    ) -> None:
        """Cycles until something is true."""
        for _ in range(0, limit, step):
            if what():
                return
            self.run(step)
        raise AssertionError("it never becomes true")

    def end(self, limit: int = 400_000) -> None:
        """Until the program has ended."""
        self.until(lambda: bool(self.state.program_end_r), 50, limit)

    @property
    def pos(self) -> FloatArray:
        """Positions at the cycle (n, axes), mm."""
        return (
            np.concatenate(self.parts)
            if self.parts
            else np.empty((0, len(self.cell.axes)))
        )

    def level(self, unit: Any, value: Any) -> None:
        """Command a level control unit."""
        unit.command_w = value
        unit.enable_w = True

    def request(self, start: float, length: float) -> list[Any]:
        """One look-ahead request, answered in the next cycle; its blocks up to type 0."""
        self.clah.request.start_position, self.clah.request.length = (
            start,
            length,
        )
        self.clah.semaphor_rw = True
        self.run(1)
        assert not self.clah.semaphor_rw
        out = []
        for block in self.clah.response.block:
            if block.block_type == 0:
                break
            out.append(
                {
                    name: getattr(block, name)
                    for name, _ in layout.HLI_CONTOUR_LOOKAHEAD_BLOCK._fields_
                }  # type: ignore[misc]
            )
        return out
