"""The CNC process: owns the segment and the engine, prepares blocks, runs the
clock.

Started by the launcher (``--once``: one program, then the end) or by
``hli-cosim cnc`` (stays, serves whichever PLC comes).  Everything a PLC can see
is published by the engine's cycle; this module only moves things along.
"""

from __future__ import annotations

import argparse
import ctypes
import json
import os
import resource
import signal
import sys
import tempfile
import time
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

from hli._sync import lib as sync

from hli import layout, segment
from hli.errors import HliError

from .. import frontend
from ..config import CellConfig, load_config
from ..engine import Engine, Event
from ..engine.external import BLOCK_BYTES
from ..errors import CncError, Place
from ..frontend.isons.base.machine import EVENT_PLACE, EVENT_SLOTS
from ..frontend.operator import Operator, read_answers
from ..program.restart import Restart
from .modes import READY, SELECTED, ModeControl
from .preparation import OUT_FOLDER, LivePort, Preparation
from .recording import PartWriter

KERNEL_VERSION = b"hli-cosim 0.1"
CLOCKS = {
    "lockstep": layout.HLI_CLOCK_LOCKSTEP,
    "freerun": layout.HLI_CLOCK_FREERUN,
    "realtime": layout.HLI_CLOCK_REALTIME,
}
SERVICES = {
    "cyclic": layout.HLI_SERVICE_CYCLIC,
    "immediate": layout.HLI_SERVICE_IMMEDIATE,
}
RECORD_ROWS = 16384
# how long one wait may last before signals and the PLC's life are looked at
SLICE_S = 0.1
CHUNK_CYCLES = 20_000  # cycles between two looks in virtual time
# longest wait, in wall time, for a PLC to finish behind the program's end
LINGER_S = 30.0
FIRST_SCAN_S = 5.0  # longest wait for the first scan of a PLC that has attached
SKIP_LEVELS = 0x3FF  # program_block_ignore: bit n - 1 is level n
NO_FUNCTIONS = 0x2000  # execution_mode: no output of M, H and T functions
KEPT_TEXTS = 1000
PATH_OPTIONS = ("file", "config", "report", "record", "out", "answers")
IDLE_CYCLES = (
    1  # cycles served at a time while nothing moves and the clock is free
)


@dataclass(frozen=True)
class CncOptions:
    """What one CNC process is to do."""

    file: Path
    name: str
    config: Path | None = None
    dialect: str | None = None
    clock: str = "lockstep"
    service: str | None = None
    report: Path | None = None
    record: Path | None = None
    once: bool = False
    hold_start: bool = False
    wait_plc: bool = True
    lookahead: int | None = None
    core: int = -1
    lenient: bool = False
    out: Path | None = None
    autostart: bool = True
    answers: Path | None = None
    start_line: int | None = None
    start_pass: int = 1
    start_marker: str | None = None
    terminal: bool = True  # an operator sits there, if standard input is one

    def as_json(self) -> str:
        """The options as the process takes them on its command line."""
        return json.dumps(
            {
                k: str(v) if isinstance(v, Path) else v
                for k, v in asdict(self).items()
            }
        )


def keep(texts: list[str], text: str) -> None:
    """Add a text that a PLC can cause at its scan rate: no more than KEPT_TEXTS
    are kept.
    """
    if len(texts) < KEPT_TEXTS:
        texts.append(text)
    elif len(texts) == KEPT_TEXTS:
        texts.append("further messages are not kept")


def fill_identity(
    root: Any, cell: CellConfig, clock: str, service: str, program: str
) -> None:
    """Constant members of the areas: versions, sizes, numbers, names, the
    sidecar's identity.
    """
    for version in (
        root.platform.nc_config.hli_version_r,
        root.platform.nc_config.nc_kernel_version_r,
    ):
        version.zeichen = KERNEL_VERSION
    channel = root.channel[0]
    channel.head.version_r.zeichen = KERNEL_VERSION
    channel.head.sizeof_interface_r = ctypes.sizeof(layout.HLI_CHANNEL)
    channel.head.channel_nr = 1
    channel.bahn_state.prog_name_r = program.encode("latin-1", "replace")[:259]
    channel.bahn_state.file_offset_r = -1
    channel.bahn_mc_control.insert_cmd.state_r.distance_of_next_stop = -1.0
    for i, (name, axis) in enumerate(cell.axes.items()):
        number, kind = axis.id or i + 1, 2 if axis.kind == "rotary" else 1
        coord, head = channel.bahn_state.coord_r[i], root.axis[i].head
        coord.log_axis_nr_r = head.log_ax_n_r = number
        coord.axis_type_r = head.axis_type_r = kind
        coord.name = name.encode()
        head.sizeof_interface_r = ctypes.sizeof(layout.HLI_AXIS)
    for i, spindle in enumerate(cell.spindles.values(), len(cell.axes)):
        head = root.axis[i].head
        head.log_ax_n_r, head.axis_type_r = spindle.id, 4
        head.sizeof_interface_r = ctypes.sizeof(layout.HLI_AXIS)
    side = root.sidecar.cnc
    side.pid, side.start = os.getpid(), sync.hs_process_start(os.getpid())
    side.cycle_ns = round(cell.cycle_s * 1e9)
    side.clock, side.service = CLOCKS[clock], SERVICES[service]
    side.generation = (time.monotonic_ns() // 1000) & 0x7FFFFFFF or 1
    side.phase = layout.HLI_PHASE_STARTING


class CncProcess:
    """One CNC with one program.

    ``run`` returns when the program's work is done or a signal came.
    """

    def __init__(self, options: CncOptions) -> None:
        self.options = options
        self.cell = load_config(options.config)
        self.service = options.service or self.cell.channel.service
        self.stop_signal = 0
        self.end = "aborted"
        self.ended_at = 0.0
        # wall time of the first cycle and, at the end, what the cycles took
        self.driving_since = 0.0
        self.wall_time_s = 0.0
        self.started_with_plc = False
        self.warnings = list(self.cell.warnings())
        self.errors: list[CncError] = []
        self.messages: list[str] = []
        self.blocks = 0
        self.dialect: str | None = None
        self.preparation: Preparation | None = None
        self._restarted = False
        self._retained: dict[str, Any] = {}
        script = read_answers(options.answers) if options.answers else []
        self._operator = Operator(
            script, terminal=options.terminal and sys.stdin.isatty()
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
            root, self.cell, options.clock, self.service, options.file.name
        )
        self.side = root.sidecar
        self.channel = root.channel[0]
        self.engine = Engine(
            self.cell,
            window=options.lookahead,
            segment=self.segment.base,
            clock=CLOCKS[options.clock],
            service=SERVICES[self.service],
            record_rows=RECORD_ROWS if options.record else 0,
        )
        self.recorder = PartWriter(options.record) if options.record else None
        self.engine.hold_start(True)
        self.engine.stay(not options.once)
        self.engine.stand_by()
        folder = (
            options.report.parent
            if options.report
            else Path(tempfile.gettempdir())
        )
        scratch = folder / f"hli-cosim-{os.getpid()}-MDI.nc"
        self._scratch = scratch
        after = (
            READY
            if self.cell.channel.state_after_program == "READY"
            else SELECTED
        )
        self.modes = ModeControl(
            self.engine,
            self,
            options.file.resolve().parent,
            scratch,
            after,
            self._report_error,
        )
        self.modes.select(options.file)

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
            self.segment.publish()
            self._drive()
        finally:
            self._close()

    def _close(self) -> None:
        self.engine.stop()
        self.engine.serve_stop()
        self._collect_program()
        self._scratch.unlink(missing_ok=True)
        if self.driving_since:
            self.wall_time_s = time.monotonic() - self.driving_since
        self._take_samples()
        if self.recorder:
            self.recorder.close()
        self.engine.set_phase(layout.HLI_PHASE_SHUTDOWN)
        self.segment.unlink()
        deadline = time.monotonic() + 2.0
        while self.plc_alive() and time.monotonic() < deadline:
            time.sleep(0.002)

    # ---------------------------------------------------------------- the PLC's life
    def plc_alive(self) -> bool:
        plc = self.side.plc
        return bool(plc.attached) and bool(
            sync.hs_process_alive(plc.pid, plc.start)
        )

    def _look_at_plc(self) -> None:
        """A PLC that died is taken off the segment, so that the next one finds
        it free.
        """
        if not self.side.plc.attached or self.plc_alive():
            return
        with self.segment.locked():  # the next PLC may be registering
            if self.side.plc.attached and not self.plc_alive():
                self.side.plc.attached = 0
                self.side.plc.finished = 0

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
        self.driving_since = time.monotonic()
        self.engine.hold_start(self.options.hold_start)
        if self.options.clock == "realtime" and not self.options.hold_start:
            self.engine.start()
        if not self._first_scan():
            return
        if not self.modes.running and self.options.autostart:
            self.modes.start()
        if self.options.hold_start:
            self._serve_held()
            return
        while not self.stop_signal and self._once_round():
            pass

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
            self._look_at_plc()
            time.sleep(0.0005)
        if self.options.clock == "realtime":
            return not self._plc_lost()
        cycle = int(self.engine.state.cycle)
        while (
            not self.stop_signal
            and int(self.engine.state.cycle) == cycle
            and not self._plc_lost()
        ):
            self._handle(self.engine.run(1, int(SLICE_S * 1e9)))
            self._look_at_plc()
            if not self.side.plc.attached:
                break
        return not self._plc_lost()

    def _released(self) -> bool:
        """Whether the PLC has let a cycle begin (lockstep)."""
        ahead = (
            self.side.plc_turn.word - int(self.engine.state.cycle)
        ) & 0xFFFFFFFF
        return self.options.clock == "lockstep" and 0 < ahead < 1 << 31

    # ---------------------------------------------------------------- programs
    def start_program(self, path: Path) -> None:
        """Begin a program where the axes stand (hli_reference 1.4)."""
        if self.options.clock == "realtime":
            self.engine.stop()
        self._collect_program()
        self.engine.begin_program()
        self.end, self.ended_at = "aborted", 0.0
        self.engine.set_error(0)
        self.engine.set_program_name(path.name)
        self.engine.suppress_functions(
            bool(self._execution_mode() & NO_FUNCTIONS)
        )
        sizes = self.cell.external_bytes(self._dialect(path))
        port = LivePort(
            self.cell.axis_values("start_mm"),
            {
                scope: self.engine.external(area, sizes[scope])
                for area, scope in enumerate(("channel", "global"))
            },
            self.options.out or OUT_FOLDER,
            self._skip_levels() | self.cell.skip_mask,
            self.engine.write_external,
            self._retained,
            self._operator,
        )
        if self._dialect(path) == "isons":
            self.engine.show_commands(
                (self.cell.isons.io_block - 1 + EVENT_PLACE) * BLOCK_BYTES,
                EVENT_SLOTS,
            )
        port.manual_data = path == self._scratch
        self.preparation = Preparation(
            path, self.cell, self.options.dialect, self.engine, port, lenient=self.options.lenient,
            restart=self._take_restart(), held=self.modes.held,
        )  # fmt: skip
        self.preparation.pump()
        self.engine.set_phase(
            layout.HLI_PHASE_READY
            if self.options.hold_start
            else layout.HLI_PHASE_RUNNING
        )
        if self.options.clock == "realtime" and not self.options.hold_start:
            self.engine.start()

    def _take_restart(self) -> Restart | None:
        """Where the first program is taken up; those behind it begin at their
        beginning.
        """
        options, first = self.options, not self._restarted
        self._restarted = True
        return (
            Restart.of(
                options.start_line, options.start_pass, options.start_marker
            )
            if first
            else None
        )

    def _dialect(self, path: Path) -> str:
        """Dialect of a program; what is wrong with its file is told where it is
        read.
        """
        try:
            return self.options.dialect or frontend.detect(path)
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

    def _enabled(self, unit: Any) -> int:
        """Command of a level unit that is evaluated at program start; 0 if the
        PLC does not enable it.
        """
        return (
            int(unit.command_w)
            if self.channel.head.plc_present_w and unit.enable_w
            else 0
        )

    def _skip_levels(self) -> int:
        unit = self.channel.decoder_mc_control.program_block_ignore
        levels = self._enabled(unit) & SKIP_LEVELS
        unit.state_r = levels
        return levels

    def _execution_mode(self) -> int:
        unit = self.channel.decoder_mc_control.execution_mode
        mode = self._enabled(unit)
        if mode & ~NO_FUNCTIONS:
            self._report_error(
                CncError(905021, f"execution_mode {mode:#x} is not supported")
            )
            mode = 0
        unit.state_r = mode
        return mode

    def _report_error(self, error: CncError) -> None:
        """An error that belongs to no program: told to the PLC and in the
        report, it ends nothing.
        """
        self.engine.post_error(error)
        keep(self.warnings, str(error))
        if not self.options.once:
            print(error, file=sys.stderr, flush=True)

    def _collect_program(self) -> None:
        """Take over what the last program has said, ahead of the next one or of
        the end.
        """
        preparation, self.preparation = self.preparation, None
        if preparation is None:
            return
        preparation.take_commands()
        self.blocks += preparation.blocks
        warned = (
            [str(warning) for warning in preparation.program.reader.warnings]
            if preparation.program
            else []
        )
        self.messages += [
            text for text in preparation.port.messages if text not in warned
        ]
        for text in warned:
            keep(self.warnings, text)
        self.warnings += self.log_warnings()
        if preparation.program:
            self.dialect = preparation.program.dialect
        if preparation.error and preparation.error not in self.errors:
            self.errors += [preparation.error, *preparation.error.also]

    def _wait_for_plc(self) -> bool:
        """Until a PLC has attached (at once if none is awaited); False if a
        signal came first.
        """
        while self.options.wait_plc and not self.side.plc.attached:
            if self.stop_signal:
                return False
            time.sleep(0.001)
        return not self.stop_signal

    def _serve_held(self) -> None:
        """Cycles with motion held, until the PLC is finished (command
        ``lookahead --at start``).
        """
        while not self.stop_signal and not self.side.plc.finished:
            event = self.engine.run(1, int(SLICE_S * 1e9))
            self._handle(event)
            self._look_at_plc()
            if self._plc_lost():
                return
        self.end = (
            "error"
            if self.preparation and self.preparation.error
            else "completed"
        )

    def _once_round(self) -> bool:
        """Run a stretch, handle its event; False when the work is done."""
        if self.options.clock == "realtime":
            event = self.engine.wait(SLICE_S)
        else:
            event = self.engine.run(self._stretch(), int(SLICE_S * 1e9))
        if event in (Event.DONE, Event.PLC_WAIT):
            self._look_at_plc()
            if event is Event.PLC_WAIT and not self.side.plc.attached:
                time.sleep(0.002)
        self._handle(event)
        if (
            self.ended_at
            and not self.options.once
            and self.options.clock != "realtime"
        ):
            # nothing moves any more: serve, but leave the processor to others
            time.sleep(self.cell.cycle_s)
        return not (
            event is Event.FAULT
            or self._plc_lost()
            or self._work_is_done(event)
        )

    def _stretch(self) -> int:
        return IDLE_CYCLES if self.ended_at else CHUNK_CYCLES

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
        elif event is Event.RECORD_FULL:
            self._take_samples()

    def _plc_error(self) -> None:
        record = self.engine.take_plc_error()
        if record:
            keep(
                self.messages,
                f"PLC error {record[0]}, reaction class {record[1]}",
            )

    def _watchdog(self) -> None:
        """The PLC has not shown that it lives: the program ends with an error;
        a restart is required.
        """
        self.watchdog = CncError(270053)
        if self.modes.running:
            self.modes.abort()

    def _program_ended(self) -> None:
        self.ended_at = time.monotonic()
        error = self.preparation.error if self.preparation else None
        if self.watchdog:
            error, self.watchdog = self.watchdog, None
            self.errors.append(error)
        elif error:
            self.engine.post_error(error)
        self.end = (
            "error"
            if error
            else "aborted"
            if self.modes.aborted
            else "completed"
        )
        self.engine.set_error(error.code if error else 0)
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

    def _take_samples(self) -> None:
        while self.recorder:
            samples = self.engine.take_samples()
            if not len(samples.cycle):
                return
            self.recorder.add(samples)

    # ---------------------------------------------------------------- report
    def log_warnings(self) -> list[str]:
        """Warnings that only show when the log is written, one each per program."""
        state, texts = self.engine.state, []
        if state.techno_unseen:
            texts.append(
                f"{state.techno_unseen} technology functions counted as acknowledged: plc_present_w is FALSE"
            )
        if state.log_disabled:
            texts.append(
                "contour look-ahead: nothing is logged"
                " (needs FCT_CONTOUR_LAH, fb_storage_size and contour_lookahead_log_max)"
            )
        if state.log_dropped:
            texts.append(
                f"contour look-ahead: {state.log_dropped} entries dropped,"
                f" contour_lookahead_log_max is {self.cell.channel.contour_lookahead_log_max}"
            )
        if state.log_ignored_areas:
            texts.append(
                "contour look-ahead: a further marked area is ignored, LOG CLEAR frees the log"
            )
        if state.log_stray_params:
            texts.append(
                "contour look-ahead: LOG PARAM outside a marked area has no effect"
            )
        if state.log_on_closed:
            texts.append(
                "contour look-ahead: LOG ON inside a marked area closes it (meant as LOG OFF?)"
            )
        return texts

    def report(self) -> dict[str, Any]:
        """Everything the launcher needs, as JSON."""
        state = self.engine.state
        errors = [error.as_json() for error in self.errors]
        source = self.errors[0].place.source if self.errors else ""
        return {
            "cycles": int(state.cycle),
            "sim_time_s": int(state.cycle) * self.cell.cycle_s,
            "wall_time_s": self.wall_time_s,
            "blocks": self.blocks,
            "requests": {
                "mode1": int(state.requests_mode1),
                "mode2": int(state.requests_mode2),
                "bad": int(state.requests_bad),
            },
            "overruns": int(state.overruns),
            "bad_commands": int(state.bad_commands),
            "techno_functions": int(state.techno_functions),
            "techno_wait_cycles": int(state.techno_wait_cycles),
            "record_lost": int(state.record_lost),
            "end": self.end,
            "aborted_by_plc": self.modes.aborted,
            "messages": self.messages,
            "warnings": self.warnings,
            "errors": errors,
            "source": source,
            "dialect": self.dialect,
            "fault": int(state.fault),
            "peak_mb": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
            / 1024.0,
        }


def write_json(path: Path, value: Any) -> None:
    """Write beside the name, then rename: a reader sees the whole or nothing."""
    part = path.with_name(f"{path.name}.{os.getpid()}.part")
    part.write_text(json.dumps(value))
    part.replace(path)


def run_cnc(options: CncOptions) -> int:
    """Run one CNC process to its end; 0, 1 (program error or fault), 130
    (interrupted).
    """
    if options.core >= 0:
        os.sched_setaffinity(0, {options.core})
    if not options.file.is_file():
        raise CncError(901001, "file not found", Place(str(options.file)))
    process = CncProcess(options)
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, process.on_signal)
    process.run()
    if options.report:
        write_json(options.report, process.report())
    if process.stop_signal == signal.SIGINT:
        return 130
    return 0 if process.end == "completed" or process.stop_signal else 1


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point of the launcher: options as one JSON object."""
    parser = argparse.ArgumentParser(prog="cnc_core.process")
    parser.add_argument("options", type=json.loads)
    parser.add_argument("--parent", type=int)
    args = parser.parse_args(argv)
    if (
        args.parent is not None
        and sync.hs_die_with_parent(signal.SIGTERM, args.parent) != 0
    ):
        return 1
    given: dict[str, Any] = {
        k: Path(v) if k in PATH_OPTIONS and v else v
        for k, v in args.options.items()
    }
    try:
        return run_cnc(CncOptions(**given))
    except (CncError, HliError) as error:
        print(error, file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
