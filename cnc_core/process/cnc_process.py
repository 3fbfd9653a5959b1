"""The CNC process: owns the segment and the engines, runs the clock.

Started by the launcher (``--once``: one program a channel, then the end) or by
``hli-cosim cnc`` (stays, serves whichever PLC comes).  Everything a PLC can see
is published by the engines' cycle; this module only moves things along.
"""

from __future__ import annotations

import resource
import shutil
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

from hli import layout, segment
from hli.errors import HliLost

from ..config import load_config, setups_of
from ..engine import Event
from ..engine.group import EngineGroup
from ..frontend.operator import Operator, read_answers
from .axes import AxisBoard
from .channel_run import ChannelRun, Shared
from .identity import fill_cell, scratch_folder
from .jobs import JobBoard
from .operator_desk import OperatorDesk
from .options import CncOptions
from .plc_life import PlcLife
from .recording import axes_of
from .report import joined_report, worst_end
from .signals import SignalBoard
from .waiting import TimeLimits, Waiting

# how long one wait may last before signals and the PLC's life are looked at
SLICE_S = 0.1
BESIDE_CYCLES = 100  # beside a dialog, between two looks for its answer
CHUNK_CYCLES = 20_000  # cycles between two looks in virtual time
# longest wait, in wall time, for a PLC to finish behind the program's end
LINGER_S = 30.0
FIRST_SCAN_S = 5.0  # longest wait for the first scan of a PLC that has attached
IDLE_CYCLES = (
    1  # cycles served at a time while nothing moves and the clock is free
)


class CncProcess:
    """One CNC with one program a channel.

    ``run`` returns when the programs' work is done or a signal came.
    """

    def __init__(self, options: CncOptions) -> None:
        self.options = options
        self.cell = load_config(options.config)
        self.setups = setups_of(self.cell)
        self.stop_signal = 0
        self.out_of_time = False  # of --max-time or --max-wall
        # wall time of the first cycle and, at the end, what the cycles took
        self.driving_since = 0.0
        self.wall_time_s = 0.0
        self.started_with_plc = False
        script = (
            read_answers(options.run.answers) if options.run.answers else []
        )
        self.desk = OperatorDesk(self._prepared, attended=options.attended)
        self._operator = Operator(
            script,
            terminal=options.terminal and sys.stdin.isatty(),
            desk=self.desk,
        )
        segment.sweep()
        areas = sum(setup.areas for setup in self.setups)
        self.segment = segment.create(
            options.name, len(self.setups), areas, ready=False
        )
        try:
            self._set_up(options)
        except BaseException:
            self.segment.unlink()
            raise

    def _set_up(self, options: CncOptions) -> None:
        """The channels behind the segment."""
        root = self.segment.root
        # the launcher's folder, or one of this process: of this user alone
        self._own_folder = None if options.report else scratch_folder()
        folder = options.report.parent if options.report else self._own_folder
        assert folder is not None
        self.board = self._new_board()
        self.jobs = JobBoard(self.board) if self.board else None
        shared = Shared(
            options,
            self.segment,
            self.desk,
            self._operator,
            self._tell,
            self._say,
            folder,
            self.board,
            AxisBoard(self.setups, self.board),
            self.jobs,
            frozenset(axes_of(self.setups)),
        )
        services = {
            options.run.service or setup.cell.channel.service
            for setup in self.setups
        }
        self.service = "immediate" if "immediate" in services else "cyclic"
        fill_cell(root, self.cell.cycle_s, options.run.clock, self.service)
        self.side = root.sidecar
        self.channels = [ChannelRun(setup, shared) for setup in self.setups]
        for channel in self.channels:
            channel.others_run = self._any_runs
            channel.cycles_beside_dialog = partial(self._beside_dialog, channel)
        self.engine = self.channels[0].engine
        self.group = EngineGroup([one.engine for one in self.channels])
        self.plc = PlcLife(self.segment, self._tell)
        self.limits = TimeLimits(options.run, self.cell.cycle_s)

    def _new_board(self) -> SignalBoard | None:
        """The signals between the channels; None: there is one."""
        if len(self.setups) == 1:
            return None
        names = [setup.place.name for setup in self.setups]
        plc = self.segment.root.sidecar.plc
        return SignalBoard(names, lambda: bool(plc.attached))

    def _tell(self, text: str) -> None:
        """A line of the cell's life with its times; a run in virtual time is
        told by its result.
        """
        if self.options.once and self.options.run.clock != "realtime":
            return
        cell_s = int(self.side.cnc.cycle) * self.cell.cycle_s
        self._say(f"{time.strftime('%H:%M:%S')} {cell_s:9.3f} s  {text}")

    def _say(self, line: str) -> None:
        """A line for the user; the launcher passes on standard output."""
        file = sys.stdout if self.options.once else sys.stderr
        print(line, file=file, flush=True)

    def _any_runs(self) -> bool:
        """Whether a channel executes a program: none has come to its end yet."""
        return any(
            one.modes.running and not one.ended_at for one in self.channels
        )

    # ---------------------------------------------------------------- life
    def on_signal(self, number: int, _frame: Any) -> None:
        self.stop_signal = number
        for channel in self.channels:
            if channel.preparation:
                channel.preparation.port.interrupted = True

    def run(self) -> None:
        """Publish, wait for the PLC, drive the programs, stay for the PLC's last
        scans.
        """
        try:
            if self.service == "immediate":
                self.engine.serve_start()
            self.desk.open(self.options.name)
            self.segment.publish()
            self._drive()
        finally:
            self.desk.close()
            if self.stop_signal:
                self._keep_waits()
            self._close()

    def _keep_waits(self) -> None:
        """What the channels waited for goes into the report."""
        for channel in self.channels:
            channel.waiting = channel.waits.kept()

    def _close(self) -> None:
        for channel in self.channels:
            channel.engine.stop()
        self.engine.serve_stop()
        if self._own_folder:
            shutil.rmtree(self._own_folder, ignore_errors=True)
        if self.driving_since:
            self.wall_time_s = time.monotonic() - self.driving_since
        for channel in self.channels:
            channel.close()
        self.engine.set_phase(layout.HLI_PHASE_SHUTDOWN)
        self.segment.unlink()
        deadline = time.monotonic() + 2.0
        while (
            self.plc.alive
            and not self.out_of_time
            and time.monotonic() < deadline
        ):
            time.sleep(0.002)

    # ---------------------------------------------------------------- the PLC's life
    def _look_at_plc(self) -> None:
        if self.segment.lost:
            raise HliLost(
                f"segment {self.options.name!r} has been cut or written over"
                " while it was in use; the CNC ends"
            )
        self.plc.look()

    def _plc_lost(self) -> bool:
        """Whether a run that depends on its PLC has lost it."""
        return (
            self.options.once
            and self.started_with_plc
            and not self.side.plc.attached
        )

    # ---------------------------------------------------------------- driving
    def _drive(self) -> None:
        self.engine.set_phase(layout.HLI_PHASE_STARTING)
        if not self._wait_for_plc():
            return
        self.started_with_plc = bool(self.side.plc.attached)
        self.plc.look()
        self.driving_since = time.monotonic()
        held = self.options.run.hold_start
        for channel in self.channels:
            channel.ready()
            channel.engine.hold_start(held)
        if self.options.run.clock == "realtime" and not held:
            for channel in self.channels:
                channel.engine.start()
        if not self._first_scan():
            return
        if self.options.run.autostart:
            for channel in self.channels:
                channel.start()
        if self.board:
            self.board.all_begun = True
        if held:
            self._serve_held()
            return
        while not self.stop_signal and self._once_round() and self._in_time():
            self._look_at_waits()

    def _look_at_waits(self) -> None:
        for channel in self.channels:
            channel.waits.look()

    def _in_time(self) -> bool:
        """Whether the run may go on; if not, its error says what it did."""
        error = self.limits.spent(self.engine, self._waits_now, self._moves)
        if error is None:
            return True
        self.out_of_time = True
        self._keep_waits()
        self.channels[0].said.errors.append(error)
        for channel in self.channels:
            if channel.modes.running or channel is self.channels[0]:
                channel.end = "error"
        return False

    def _waits_now(self) -> list[Waiting]:
        return [one for each in self.channels for one in each.waits.now()]

    def _moves(self) -> str:
        """What the channels do that wait for nothing."""
        return "; ".join(
            f"{each.title}{each.scene.moves()}" for each in self.channels
        )

    def _first_scan(self) -> bool:
        """Until the PLC has scanned once, so that what it commands before the
        start counts; False if it was lost.

        A client that asks or steps by hand does not scan (``scans_due`` 0, or
        it releases a cycle).
        """
        plc = self.side.plc
        if not self._scans_until(lambda: plc.scans > 0 or self._released()):
            return False
        if self.options.run.clock == "realtime":
            return not self._plc_lost()
        cycle = int(self.engine.state.cycle)
        while (
            not self.stop_signal
            and int(self.engine.state.cycle) == cycle
            and not self._plc_lost()
        ):
            if not self._in_time():
                return False
            self._handle(*self.group.run(1, int(SLICE_S * 1e9)))
            self.plc.look()
            self._look_at_waits()
            if not self.side.plc.attached:
                break
        # what the start of a program changes comes behind the scan of this cycle
        if self.options.run.clock == "lockstep" and not self._scans_until(
            self._released
        ):
            return False
        return not self._plc_lost()

    def _scans_until(self, done: Callable[[], bool]) -> bool:
        """While a PLC that scans has not brought this about; False if the run's
        time is over.
        """
        plc, until = self.side.plc, time.monotonic() + FIRST_SCAN_S
        while (
            not self.stop_signal
            and plc.attached
            and plc.scans_due
            and not done()
            and time.monotonic() < until
        ):
            if not self._in_time():
                return False
            self.plc.look()
            self._look_at_waits()
            time.sleep(0.0005)
        return True

    def _released(self) -> bool:
        """Whether the PLC has let a cycle begin (lockstep)."""
        ahead = (
            self.side.plc_turn.word - int(self.engine.state.cycle)
        ) & 0xFFFFFFFF
        return self.options.run.clock == "lockstep" and 0 < ahead < 1 << 31

    def _wait_for_plc(self) -> bool:
        """Until a PLC has attached (at once if none is awaited); False if a
        signal or the end of the run's time came first.
        """
        while self.options.wait_plc and not self.side.plc.attached:
            if self.stop_signal or not self._in_time():
                return False
            self._look_at_waits()
            time.sleep(0.001)
        return not self.stop_signal

    def _serve_held(self) -> None:
        """Cycles with motion held, until the PLC is finished (command
        ``lookahead --at start``).
        """
        while not self.stop_signal and not self.side.plc.finished:
            self._handle(*self.group.run(1, int(SLICE_S * 1e9)))
            self.plc.look()
            if self._plc_lost():
                return
        for channel in self.channels:
            preparation = channel.preparation
            failed = preparation is not None and preparation.error
            channel.end = "error" if failed else "completed"

    def _once_round(self) -> bool:
        """Run a stretch, handle its event; False when the work is done."""
        if self.options.run.clock == "realtime":
            event, who = self.group.wait(SLICE_S)
        else:
            event, who = self.group.run(self._stretch(), int(SLICE_S * 1e9))
        if event in (Event.DONE, Event.PLC_WAIT) or self.segment.lost:
            self._look_at_plc()
            if event is Event.PLC_WAIT and not self.side.plc.attached:
                time.sleep(0.002)
        self._handle(event, who)
        if (
            self._stands_by
            and not self.options.once
            and self.options.run.clock != "realtime"
        ):
            # nothing moves any more: serve, but leave the processor to others
            time.sleep(self.cell.cycle_s)
        return not (
            event is Event.FAULT
            or self._plc_lost()
            or self._work_is_done(event)
        )

    def _beside_dialog(self, asks: ChannelRun) -> None:
        """While a program asks no cycle runs in virtual time, so the PLC could
        hand nothing over: those run that an operator's command needs.
        """
        if self.options.run.clock == "realtime":
            return
        for _ in range(BESIDE_CYCLES):
            if not self.desk.takes_cycle() or not self._cycle_beside(asks):
                return

    def _cycle_beside(self, asks: ChannelRun) -> bool:
        """One cycle, which asks the program for nothing; False: not more now."""
        asks.engine.expect_cycle()
        event, who = self.group.run(1, int(SLICE_S * 1e9))
        if event is Event.MODE_COMMAND and self.channels[who] is asks:
            self.desk.no_more_cycles()
            return False
        if event is Event.PLC_WAIT:
            self._look_at_plc()
            return False
        if event is not Event.DONE:
            self._handle(event, who)
        return True

    def _handle(self, event: Event, who: int) -> None:
        self.channels[who].handle(event)

    @property
    def _ended_at(self) -> float:
        """When the last program ended; 0: none has."""
        return max(channel.ended_at for channel in self.channels)

    @property
    def _stands_by(self) -> bool:
        """A program has ended and none is executed."""
        return bool(self._ended_at) and not self._any_runs()

    def _stretch(self) -> int:
        cycles = IDLE_CYCLES if self._stands_by else CHUNK_CYCLES
        return min(cycles, self.limits.cycles_left(self.engine))

    def _work_is_done(self, event: Event) -> bool:
        if not self._ended_at or not self.options.once:
            return False
        if any(channel.modes.running for channel in self.channels):
            return False
        if self.jobs and self.jobs.open:
            return False
        if event is Event.PLC_FINISHED or not self.started_with_plc:
            return True
        return time.monotonic() - self._ended_at > LINGER_S

    def _prepared(self) -> dict[str, Any]:
        """How far the first channel's program is read and planned; of several
        channels also of each.
        """
        if len(self.channels) == 1:
            return self.channels[0].prepared()
        told = [channel.told() for channel in self.channels]
        return told[0] | {"channels": told}

    # ---------------------------------------------------------------- report
    def report(self) -> dict[str, Any]:
        """Everything the launcher needs, as JSON."""
        reports = [each.report() for each in self.channels]
        return joined_report(reports, self.end) | {
            "wall_time_s": self.wall_time_s,
            "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            / 1024.0,
        }

    @property
    def end(self) -> str:
        """How the run ended: as the channel that ended worst."""
        return worst_end([each.end for each in self.channels])
