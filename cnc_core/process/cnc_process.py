"""The CNC process: owns the segment and the engine, prepares blocks, runs the
clock.

Started by the launcher (``--once``: one program, then the end) or by
``hli-cosim cnc`` (stays, serves whichever PLC comes).  Everything a PLC can see
is published by the engine's cycle; this module only moves things along.
"""

from __future__ import annotations

import os
import resource
import shutil
import sys
import time
from pathlib import Path
from typing import Any

from hli import layout, segment
from hli.errors import HliLost

from .. import frontend
from ..config import load_config
from ..engine import Engine, Event
from ..engine.external import BLOCK_BYTES
from ..errors import CncError
from ..frontend.operator import Operator, read_answers
from ..program.restart import Restart
from .identity import CLOCKS, SERVICES, fill_identity, scratch_folder
from .live_port import LivePort
from .modes import READY, SELECTED, ModeControl
from .operator_desk import OperatorDesk
from .options import OUT_FOLDER, CncOptions
from .plc_life import PlcLife
from .preparation import Preparation
from .recording import missing_rows, recorder_for
from .report import engine_figures
from .said import Said
from .scene import ENDED, NOT_STARTED, RUNNING, RunScene, place_now
from .start_units import NO_FUNCTIONS, execution_mode, skip_levels
from .waiting import StandWatch, TimeLimits, Waiting

RECORD_ROWS = 16384
BAD_COMMANDS = (
    "the PLC, or a real-time cycle, has commanded what is out of range: an"
    " override above 200 % (command_w 2000) counts as 200 %, a wrong insert_cmd"
    " and a value that is no finite number are left out"
)
ENDINGS = {
    "completed": "completed",
    "error": "ended by an error",
    "aborted": "aborted",
}
# how long one wait may last before signals and the PLC's life are looked at
SLICE_S = 0.1
CHUNK_CYCLES = 20_000  # cycles between two looks in virtual time
# longest wait, in wall time, for a PLC to finish behind the program's end
LINGER_S = 30.0
FIRST_SCAN_S = 5.0  # longest wait for the first scan of a PLC that has attached
IDLE_CYCLES = (
    1  # cycles served at a time while nothing moves and the clock is free
)


class CncProcess:
    """One CNC with one program.

    ``run`` returns when the program's work is done or a signal came.
    """

    def __init__(self, options: CncOptions) -> None:
        self.options = options
        self.cell = load_config(options.config)
        self.service = options.run.service or self.cell.channel.service
        self.stop_signal = 0
        self.end = "aborted"
        self.ended_at = 0.0
        # wall time of the first cycle and, at the end, what the cycles took
        self.driving_since = 0.0
        self.wall_time_s = 0.0
        self.started_with_plc = False
        self.said = Said(self.cell)
        self.preparation: Preparation | None = None
        self._restarted = False
        self._retained: dict[str, Any] = {}
        script = (
            read_answers(options.run.answers) if options.run.answers else []
        )
        self.desk = OperatorDesk(self._prepared, attended=options.attended)
        self._operator = Operator(
            script,
            terminal=options.terminal and sys.stdin.isatty(),
            desk=self.desk,
        )
        self.watchdog: CncError | None = None
        segment.sweep()
        axes = len(self.cell.axes) + len(self.cell.spindles)
        self.segment = segment.create(options.name, 1, axes, ready=False)
        try:
            self._set_up(options)
        except BaseException:
            self.segment.unlink()
            raise

    def _set_up(self, options: CncOptions) -> None:
        """Engine, recorder and preparation behind the segment."""
        root = self.segment.root
        fill_identity(
            root, self.cell, options.run.clock, self.service, options.file.name
        )
        self.side = root.sidecar
        self.channel = root.channel[0]
        self.engine = Engine(
            self.cell,
            window=options.lookahead,
            segment=self.segment,
            clock=CLOCKS[options.run.clock],
            service=SERVICES[self.service],
            record_rows=RECORD_ROWS if options.samples else 0,
        )
        self.recorder = recorder_for(self.engine, self.cell, options)
        self.engine.hold_start(True)
        self.engine.stay(not options.once)
        self.engine.stand_by()
        self.plc = PlcLife(self.segment, self._tell)
        self._watch_waits(root)
        # the launcher's folder, or one of this process: of this user alone
        self._own_folder = None if options.report else scratch_folder()
        folder = options.report.parent if options.report else self._own_folder
        assert folder is not None
        self._scratch = folder / f"hli-cosim-{os.getpid()}-MDI.nc"
        after = (
            READY
            if self.cell.channel.state_after_program == "READY"
            else SELECTED
        )
        self.modes = ModeControl(
            self.engine,
            self,
            options.file.resolve().parent,
            self._scratch,
            after,
            self._report_error,
        )
        self.modes.select(options.file)
        self._operator.ended = self.modes.end_beside_dialog

    def _watch_waits(self, root: Any) -> None:
        """Who tells what the run waits for."""
        options = self.options
        cell_s, wall_s = options.run.report_wait
        cycles = max(1, round(cell_s / self.cell.cycle_s))
        self.engine.tell_standstill(cycles)
        self.scene = RunScene(self.engine, root, self.cell, options)
        self.waits = StandWatch(self.scene, self._say, (cell_s, wall_s))
        self.waiting: list[Waiting] = []
        self.limits = TimeLimits(options.run, self.cell.cycle_s)

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

    # ---------------------------------------------------------------- life
    def on_signal(self, number: int, _frame: Any) -> None:
        self.stop_signal = number
        if self.preparation:
            self.preparation.port.interrupted = True

    def run(self) -> None:
        """Publish, wait for the PLC, drive the program, stay for the PLC's last
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
                self.waiting = self.waits.last
            self._close()

    def _close(self) -> None:
        self.engine.stop()
        self.engine.serve_stop()
        self._collect_program()
        self._scratch.unlink(missing_ok=True)
        if self._own_folder:
            shutil.rmtree(self._own_folder, ignore_errors=True)
        if self.driving_since:
            self.wall_time_s = time.monotonic() - self.driving_since
        if int(self.engine.state.bad_commands):
            self.said.warn(BAD_COMMANDS)
        if self.recorder:
            self.recorder.close()
        self.engine.set_phase(layout.HLI_PHASE_SHUTDOWN)
        self.segment.unlink()
        deadline = time.monotonic() + 2.0
        while self.plc.alive and time.monotonic() < deadline:
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
        self.scene.phase = NOT_STARTED
        self.engine.hold_start(self.options.run.hold_start)
        if (
            self.options.run.clock == "realtime"
            and not self.options.run.hold_start
        ):
            self.engine.start()
        if not self._first_scan():
            return
        if not self.modes.running and self.options.run.autostart:
            self.modes.start()
        if self.options.run.hold_start:
            self._serve_held()
            return
        while not self.stop_signal and self._once_round() and self._in_time():
            self.waits.look()

    def _in_time(self) -> bool:
        """Whether the run may go on; if not, its error says what it did."""
        error = self.limits.spent(self.engine, self.waits, self.scene.moves)
        if error is None:
            return True
        self.waiting = self.waits.last
        self.said.errors.append(error)
        self.end = "error"
        return False

    def _first_scan(self) -> bool:
        """Until the PLC has scanned once, so that what it commands before the
        start counts; False if it was lost.

        A client that asks or steps by hand does not scan (``scans_due`` 0, or
        it releases a cycle).
        """
        plc, until = self.side.plc, time.monotonic() + FIRST_SCAN_S
        while (
            not self.stop_signal
            and plc.attached
            and plc.scans_due
            and not plc.scans
            and time.monotonic() < until
        ):
            if self._released():
                break
            self.plc.look()
            time.sleep(0.0005)
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
            self._handle(self.engine.run(1, int(SLICE_S * 1e9)))
            self.plc.look()
            self.waits.look()
            if not self.side.plc.attached:
                break
        return not self._plc_lost()

    def _released(self) -> bool:
        """Whether the PLC has let a cycle begin (lockstep)."""
        ahead = (
            self.side.plc_turn.word - int(self.engine.state.cycle)
        ) & 0xFFFFFFFF
        return self.options.run.clock == "lockstep" and 0 < ahead < 1 << 31

    # ---------------------------------------------------------------- programs
    def start_program(self, path: Path) -> None:
        """Begin a program where the axes stand (hli_reference 1.4)."""
        if self.options.run.clock == "realtime":
            self.engine.stop()
        self._collect_program()
        self.engine.begin_program()
        self.end, self.ended_at = "aborted", 0.0
        self.engine.set_error(0)
        self.engine.set_program_name(path.name)
        self.engine.suppress_functions(
            bool(
                execution_mode(self.channel, self._report_error) & NO_FUNCTIONS
            )
        )
        sizes = self.cell.external_bytes(self._dialect(path))
        port = LivePort(
            self.cell.axis_values("start_mm"),
            {
                scope: self.engine.external(area, sizes[scope])
                for area, scope in enumerate(("channel", "global"))
            },
            self.options.run.out or OUT_FOLDER,
            skip_levels(self.channel) | self.cell.skip_mask,
            self.engine.write_external,
            self._retained,
            self._operator,
        )
        shown = self.cell.command_slots(self._dialect(path))
        if shown:
            block, slots = shown
            self.engine.show_commands(block * BLOCK_BYTES, slots)
        port.manual_data = path == self._scratch
        self.preparation = Preparation(
            path,
            self.cell,
            self.options.run.dialect,
            self.engine,
            port,
            lenient=self.options.run.lenient,
            restart=self._take_restart(),
            tolerance=self.options.run.tolerance,
            held=self.modes.held,
        )
        if self.recorder:
            self.preparation.told = self.recorder.event
        port.told = self._heard
        self._note("start", path.name)
        self.scene.phase, self.scene.preparation = RUNNING, self.preparation
        self._tell(f"program {path.name} started")
        self.preparation.pump()
        if self.recorder:
            self.recorder.elements()
        self.engine.set_phase(
            layout.HLI_PHASE_READY
            if self.options.run.hold_start
            else layout.HLI_PHASE_RUNNING
        )
        if (
            self.options.run.clock == "realtime"
            and not self.options.run.hold_start
        ):
            self.engine.start()

    def _heard(self, kind: str, text: str) -> None:
        """What the program says."""
        self.desk.say(kind, text)
        if self.recorder:
            self.recorder.event(kind, text)

    def _take_restart(self) -> Restart | None:
        """Where the first program is taken up; those behind it begin at their
        beginning.
        """
        first, self._restarted = not self._restarted, True
        return Restart.of(*self.options.run.place) if first else None

    def _dialect(self, path: Path) -> str:
        """Dialect of a program; what is wrong with its file is told where it is
        read.
        """
        try:
            return self.options.run.dialect or frontend.detect(path)
        except CncError:
            return ""

    def hold_program(self) -> bool:
        """HOLD, with the program's macros; False if the program does not allow it."""
        return self.preparation is not None and self.preparation.hold()

    def resume_program(self) -> None:
        """ACTIVE from HOLD."""
        if self.preparation:
            self.preparation.resume()

    def abort_program(self) -> None:
        """Brake and leave out the rest."""
        if self.preparation and self.preparation.stop():
            return
        if self.preparation:
            self.preparation.close()
        self.engine.abort()

    def _report_error(self, error: CncError) -> None:
        """An error that belongs to no program: told to the PLC and in the
        report, it ends nothing.
        """
        self.engine.post_error(error)
        self._note("warning", error=error)
        self.said.warn(str(error))
        if not self.options.once:
            print(error, file=sys.stderr, flush=True)

    def _collect_program(self) -> None:
        """Take over what the last program has said, ahead of the next one or of
        the end.
        """
        preparation, self.preparation = self.preparation, None
        if preparation is not None:
            preparation.take_commands()
            self.said.collect(preparation, self.engine.state)

    def _wait_for_plc(self) -> bool:
        """Until a PLC has attached (at once if none is awaited); False if a
        signal or the end of the run's time came first.
        """
        while self.options.wait_plc and not self.side.plc.attached:
            if self.stop_signal or not self._in_time():
                return False
            self.waits.look()
            time.sleep(0.001)
        return not self.stop_signal

    def _serve_held(self) -> None:
        """Cycles with motion held, until the PLC is finished (command
        ``lookahead --at start``).
        """
        while not self.stop_signal and not self.side.plc.finished:
            event = self.engine.run(1, int(SLICE_S * 1e9))
            self._handle(event)
            self.plc.look()
            if self._plc_lost():
                return
        self.end = (
            "error"
            if self.preparation and self.preparation.error
            else "completed"
        )

    def _once_round(self) -> bool:
        """Run a stretch, handle its event; False when the work is done."""
        if self.options.run.clock == "realtime":
            event = self.engine.wait(SLICE_S)
        else:
            event = self.engine.run(self._stretch(), int(SLICE_S * 1e9))
        if event in (Event.DONE, Event.PLC_WAIT) or self.segment.lost:
            self._look_at_plc()
            if event is Event.PLC_WAIT and not self.side.plc.attached:
                time.sleep(0.002)
        self._handle(event)
        if (
            self.ended_at
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

    def _stretch(self) -> int:
        cycles = IDLE_CYCLES if self.ended_at else CHUNK_CYCLES
        return min(cycles, self.limits.cycles_left(self.engine))

    def _handle(self, event: Event) -> None:
        preparation = self.preparation
        if preparation:
            preparation.take_commands()
        if event is Event.NEED_BLOCKS and preparation:
            preparation.pump()
        elif event is Event.DRAINED and preparation:
            preparation.drained()
            preparation.pump()
        elif event is Event.MODE_COMMAND:
            command = self.engine.take_mode_command()
            if command:
                self.modes.handle(command)
        elif event is Event.PLC_ERROR:
            self._plc_error()
        elif event is Event.RETRACED and preparation:
            preparation.retraced()
        elif event is Event.WATCHDOG:
            self._watchdog()
        elif event is Event.PROGRAM_END:
            self._program_ended()
        elif event is Event.STANDS:
            self.waits.look_now()
        elif event is Event.RECORD_FULL and self.recorder:
            self.recorder.make_room()
        if self.recorder:
            self.recorder.elements()

    def _plc_error(self) -> None:
        record = self.engine.take_plc_error()
        if record:
            text = f"{record[0]}, reaction class {record[1]}"
            self._note("plc error", text)
            self.said.message(f"PLC error {text}")

    def _watchdog(self) -> None:
        """The PLC has not shown that it lives: the program ends with an error;
        a restart is required.
        """
        self.watchdog = CncError(270053)
        if self.modes.running:
            self.modes.abort()

    def _program_ended(self) -> None:
        self.ended_at = time.monotonic()
        self.scene.phase = ENDED
        error = self.preparation.error if self.preparation else None
        if self.watchdog:
            error, self.watchdog = self.watchdog, None
            self.said.errors.append(error)
        elif error:
            self.engine.post_error(error)
        self.end = (
            "error"
            if error
            else "aborted"
            if self.modes.aborted
            else "completed"
        )
        self._note("end", self.end)
        if error:
            self._note("error", error=error)
        self.engine.set_error(error.code if error else 0)
        self._tell(f"program {ENDINGS[self.end]}")
        if error and not self.options.once:
            print(error, file=sys.stderr, flush=True)
        self.engine.set_phase(layout.HLI_PHASE_ENDED)
        self.modes.program_ended(error)

    def _work_is_done(self, event: Event) -> bool:
        if not self.ended_at or not self.options.once or self.modes.running:
            return False
        if event is Event.PLC_FINISHED or not self.started_with_plc:
            return True
        return time.monotonic() - self.ended_at > LINGER_S

    def _note(
        self, kind: str, text: str = "", error: CncError | None = None
    ) -> None:
        """An event: for the recording, and for whoever looks."""
        self.desk.say(kind, text or str(error or ""))
        if self.recorder:
            code, line = (error.code, error.place.line) if error else (0, 0)
            self.recorder.event(kind, text or str(error or ""), code, line)

    def _prepared(self) -> dict[str, Any]:
        """How far the program is read and planned."""
        state, preparation = self.engine.state, self.preparation
        found: dict[str, Any] = {
            "rows": int(state.rows_taken) - int(state.row_done),
            "elements": int(state.elements) - int(state.element),
            "window": self.options.lookahead
            or self.cell.channel.lookahead_blocks,
            "planned_s": float(state.motion_time_s) - float(state.consumed_s),
        }
        if preparation and preparation.program:
            (_, line, n), text = place_now(preparation.program)
            found |= {"line": line, "n": n, "text": text}
            found["read"] = preparation.done
        return found

    # ---------------------------------------------------------------- report
    def report(self) -> dict[str, Any]:
        """Everything the launcher needs, as JSON."""
        figures = engine_figures(self.engine.state, self.cell.cycle_s)
        return figures | {
            "wall_time_s": self.wall_time_s,
            "end": self.end,
            "aborted_by_plc": self.modes.aborted,
            **self.said.as_json(),
            "waiting": [waiting.as_json() for waiting in self.waiting],
            "recording": missing_rows(self.recorder),
            "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            / 1024.0,
        }
