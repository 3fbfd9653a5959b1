"""What a run waits for, as its CNC process sees it."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

from cnc_core._engine import lib

from ..config import CellConfig, ChannelPlace
from ..engine import Engine, Standstill
from ..program import Program
from .asking import AskingLoop
from .options import CncOptions
from .preparation import Preparation
from .stands import PlcSight, Reason, reasons
from .waiting import Scene

# phases of a run
ATTACHING, NOT_STARTED = "attaching", "not started"
RUNNING, ENDED = "running", "ended"
UNUSED = "unused"  # a channel that has no program
START = (
    "start of the program",
    "the PLC commands ACTIVE: StartProgram, or mode_and_state",
)
FINISH = (
    "the PLC behind the program's end",
    "the PLC: finished() of its tasks returns TRUE",
)
MOTION = (
    "the next motion",
    "the program computes: Ctrl-C ends a loop that does not end",
)

PROGRAM_WAITS = "what its program waits for"
SENDS = "the program of the other channel, by #SIGNAL"
GIVES = "the program of the other channel, by #PUT AX or its end"

ASKS = (
    "the end of its loop without motion, lines {} to {}",
    "the PLC, by a variable that the loop reads",
)
ASKS_AMONG = lib.ENGINE_STOP_NO_BLOCKS | lib.ENGINE_STOP_DWELL
"""Conditions that come and go while a loop asks."""

BLOCK = "the end of a block"
LOOP = (
    "the end of a real-time loop",
    "the PLC sets bahn_mc_control.rt_loop_enable.command_w to FALSE",
)
LASTS_WALL_S = 20.0
"""A block that lasts longer is told, wall time."""


def place_now(program: Program) -> tuple[tuple[str, int, int], str]:
    """File, line and N of the block that a program is at, and its text."""
    here = program.reader.place_now
    return (here.file, here.line, program.number_now), here.source.strip()


def computing(program: Program | None, key: object = "computes") -> Scene:
    """A program that has handed out no motion for long."""
    place = place_now(program)[0] if program else ("", 0, 0)
    return Scene([MOTION], place, key=key)


class RunScene:
    """Looks at one run; ``phase`` and ``preparation`` are kept true by its
    process.
    """

    def __init__(
        self,
        engine: Engine,
        root: Any,
        cell: CellConfig,
        options: CncOptions,
        channel: ChannelPlace = ChannelPlace(),  # noqa: B008 - a constant
    ) -> None:
        self._engine, self._root, self._cell = engine, root, cell
        self._channel = channel
        self.others_run: Callable[[], bool] = lambda: False
        self._options = options
        self.phase = ATTACHING
        self.preparation: Preparation | None = None
        self._scans, self._scanned_at = 0, time.monotonic()
        self._row, self._row_since, self._row_cycle = -1, self._scanned_at, 0
        self._asking = AskingLoop()
        self._ended = 0  # in which cycle

    def end(self) -> None:
        """The program has ended."""
        self.phase, self._ended = ENDED, int(self._engine.state.cycle)

    def __call__(self) -> Scene:
        if self.phase == UNUSED:
            return Scene([])
        if self.phase == ENDED and not self._options.once:
            return Scene([])
        plc = self._plc()
        of_cell = self._of_cell(plc)
        if of_cell is not None:
            # the first channel tells it for all
            return Scene([]) if self._channel.index else of_cell
        if self.phase == NOT_STARTED:
            return Scene([(START[0], plc.trouble() or START[1])])
        if self.phase == ENDED:
            passed = int(self._engine.state.cycle) - self._ended
            cell_s = passed * self._cell.cycle_s
            return Scene([] if self.others_run() else [FINISH], cell_s=cell_s)
        return self._standing(plc)

    def _of_cell(self, plc: PlcSight) -> Scene | None:
        """What all channels wait for."""
        if self.phase == ATTACHING or (self._lockstep and not plc.attached):
            return Scene([("a PLC", plc.missing)])
        if self._lockstep and plc.silent_s > 1.0:
            return Scene([("a scan of the PLC", plc.trouble())])
        return None

    @property
    def _lockstep(self) -> bool:
        return self._options.run.clock == "lockstep"

    def _plc(self) -> PlcSight:
        """The PLC; its scans are counted on from look to look."""
        side, now = self._root.sidecar.plc, time.monotonic()
        scans = int(side.scans)
        if scans != self._scans or not side.scans_due:
            self._scans, self._scanned_at = scans, now
        options = self._options
        missing = f"hli-cosim plc FILE.py --name {options.name}"
        if options.once:  # somebody has launched both
            starting = "its process has not attached yet"
            missing = starting if options.wait_plc else "give one by --plc"
        silent_s = now - self._scanned_at
        return PlcSight(bool(side.attached), silent_s, missing)

    def _standing(self, plc: PlcSight) -> Scene:
        stands = self._engine.standstill
        preparation = self.preparation
        # virtual time waits for the program, whether the path stands or not
        virtual = self._options.run.clock != "realtime"
        told = bool(stands.conditions) or virtual
        if preparation and preparation.computes and told:
            return computing(preparation.program)
        asks = None
        if not stands.conditions & ~ASKS_AMONG and not self._awaited():
            asks = self._asks(plc)
        if asks:
            return asks
        if not stands.conditions:
            return self._lasting()
        self._row = -1
        found = reasons(stands, self._root, self._cell, plc, self._channel)
        key = stands.since, stands.line, tuple(what for what, _ in found)
        place, text = self._place(stands)
        awaited = self._awaited()
        if awaited:
            found = [
                awaited if what == PROGRAM_WAITS else (what, other)
                for what, other in found
            ]
        elif text:
            named = f"what its program waits for ({text})"
            found = [
                (named if what == "what its program waits for" else what, who)
                for what, who in found
            ]
        cell_s = (stands.cycle - stands.since) * self._cell.cycle_s
        # a dwell is no wait: it is told by wall time alone
        dwells = bool(stands.conditions & lib.ENGINE_STOP_DWELL)
        return Scene(found, place, cell_s, key, dwells)

    def _awaited(self) -> Reason | None:
        """The signal, axis or condition that the program waits for."""
        if self.preparation is None:
            return None
        port = self.preparation.port
        if port.condition is not None:
            return f"until {port.condition.said}", port.condition.who
        awaited = port.signals.awaited if port.signals else ""
        who = GIVES if awaited.startswith("axis") else SENDS
        return (awaited, who) if awaited else None

    def _asks(self, plc: PlcSight) -> Scene | None:
        """A program that goes round without motion, as one that waits for a
        variable does.
        """
        preparation, state = self.preparation, self._engine.state
        if preparation is None or preparation.program is None:
            return None
        place = place_now(preparation.program)[0]
        cycle, position = int(state.cycle), list(state.position)
        found = self._asking.look(
            position, place[:2], preparation.blocks, cycle
        )
        if found is None:
            return None
        since, lines = found
        reason = ASKS[0].format(*lines), plc.trouble() or ASKS[1]
        cell_s = (cycle - since) * self._cell.cycle_s
        return Scene([reason], place, cell_s, key=("asks", since))

    def _lasting(self) -> Scene:
        """The path moves: a block or a loop that lasts for long is told."""
        program = self.preparation.program if self.preparation else None
        now, engine = time.monotonic(), self._engine.state
        cycle, row = int(engine.cycle), int(engine.row_done)
        if row != self._row:
            self._row, self._row_since, self._row_cycle = row, now, cycle
        if program is None or now - self._row_since < LASTS_WALL_S:
            return Scene([])
        state = self._root.channel[self._channel.index].bahn_state
        speed = f"{state.active_feed_r / 1000.0:.4g} mm/s"
        goes = (
            f"it goes on with {speed}, override {state.override_r / 10.0:g} %"
        )
        reason = LOOP if state.inside_rt_loop_r else (BLOCK, goes)
        place = (str(program.path), 0, int(state.block_number_r))
        cell_s = (cycle - self._row_cycle) * self._cell.cycle_s
        return Scene([reason], place, cell_s, key=("lasts", row))

    def _place(self, stands: Standstill) -> tuple[tuple[str, int, int], str]:
        """File, line and N where the path stands; the text of a block that
        waits.
        """
        program = self.preparation.program if self.preparation else None
        if program is None:
            return ("", 0, 0), ""
        files = program.reader.files
        waits = stands.conditions & lib.ENGINE_STOP_NO_BLOCKS
        others = stands.conditions & ~lib.ENGINE_STOP_NO_BLOCKS
        if waits and not others:
            return place_now(program)
        known = stands.line and stands.file < len(files)
        file = str(files[stands.file]) if known else str(program.path)
        return (file, stands.line, stands.n), ""

    def moves(self) -> str:
        """What a run does that waits for nothing."""
        state = self._root.channel[self._channel.index].bahn_state
        if self.phase == ENDED:
            return "the program has ended"
        return (
            f"the program goes on at N{state.block_number_r}"
            f" with {state.active_feed_r / 1000.0:.4g} mm/s"
        )
