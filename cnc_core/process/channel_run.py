"""One channel of a CNC process: its engine, its programs and what they say.

The process gives it the cycles; ``handle`` carries out what the engine tells.
Nothing here knows of the other channels.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from hli import layout
from hli.segment import Segment

from .. import frontend
from ..config import ChannelSetup
from ..engine import Engine, Event
from ..engine.external import BLOCK_BYTES
from ..engine.placed import PlacedAxis, put_axes
from ..errors import CncError
from ..frontend.operator import Operator
from ..program.restart import Restart
from ..recording.schema import AXES_PLACED
from .axes import AxesOf, AxisBoard
from .identity import CLOCKS, SERVICES, fill_channel
from .jobs import JobBoard, JobsOf
from .live_port import LivePort
from .modes import READY, REFUSED, SELECTED, ModeControl
from .operator_desk import OperatorDesk
from .options import OUT_FOLDER, CncOptions
from .preparation import Preparation
from .recording import missing_rows, recorder_for
from .report import UNUSED_END, engine_figures
from .said import Said
from .scene import NOT_STARTED, RUNNING, UNUSED, RunScene, place_now
from .signals import SignalBoard, SignalsOf
from .start_units import NO_FUNCTIONS, execution_mode, skip_levels
from .waiting import StandWatch, Waiting

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


@dataclass(frozen=True)
class Shared:
    """What the channels of a process share.

    ``tell``, ``say``: a line of the cell's life, a line for the user.
    ``scratch``: folder of the process.  ``signals``: None: there is one channel.
    ``axes``: None: they stay where they are.  ``jobs``: as ``signals``.
    ``axis_names``: those of all channels.
    """

    options: CncOptions
    segment: Segment
    desk: OperatorDesk
    operator: Operator
    tell: Callable[[str], None]
    say: Callable[[str], None]
    scratch: Path
    signals: SignalBoard | None = None
    axes: AxisBoard | None = None
    jobs: JobBoard | None = None
    axis_names: frozenset[str] = frozenset()

    @property
    def realtime(self) -> bool:
        return self.options.run.clock == "realtime"

    @property
    def folder(self) -> Path:
        """Where programs are looked for that the PLC selects by name."""
        found = [file for file in self.options.programs if file is not None]
        return found[0].resolve().parent if found else Path.cwd()


class ChannelRun:
    """One channel with one program at a time.

    ``told_ended`` is called when a program has ended; the process looks then
    whether others run.
    """

    def __init__(self, setup: ChannelSetup, shared: Shared) -> None:
        self.setup, self.cell, self.shared = setup, setup.cell, shared
        self.options = options = shared.options
        index = setup.place.index
        more = options.programs
        self.file = more[index] if index < len(more) else None
        self.service = options.run.service or self.cell.channel.service
        root = shared.segment.root
        fill_channel(
            root, self.cell, setup.place, self.file.name if self.file else ""
        )
        self.area = root.channel[index]
        self.end, self.ended_at = "aborted" if self.file else UNUSED_END, 0.0
        self.said = Said(self.cell)
        self.preparation: Preparation | None = None
        self.watchdog: CncError | None = None
        self._restarted = False
        self._retained: dict[str, Any] = {}
        self.others_run: Callable[[], bool] = lambda: False
        # called between two looks for the answer to a dialog
        self.cycles_beside_dialog: Callable[[], None] = lambda: None
        board = shared.signals
        self.signals = SignalsOf(board, index) if board else None
        self.engine = Engine(
            self.cell,
            window=options.lookahead,
            segment=shared.segment,
            clock=CLOCKS[options.run.clock],
            service=SERVICES[self.service],
            record_rows=RECORD_ROWS if options.samples else 0,
            place=setup.place,
        )
        self.recorder = recorder_for(
            self.engine, setup, options, self.file, shared.axis_names
        )
        self.axes = AxesOf(shared.axes, index) if shared.axes else None
        self.jobs = JobsOf(shared.jobs, index) if shared.jobs else None
        if shared.jobs:
            shared.jobs.join(index, self)
        if shared.axes:
            shared.axes.join(index, self._put_axes, self._stand)
        if shared.axes and shared.signals:
            # an exchange changes some places; the engine shows all of them
            put_axes(self.engine, shared.axes.placed(index))
        self.engine.hold_start(True)
        self.engine.stay(not options.once)
        self.engine.stand_by()
        self._watch_waits(root)
        self._set_modes()

    @property
    def title(self) -> str:
        """Ahead of what is told of it, in a cell with several channels."""
        name = self.setup.place.name
        return f"channel {name}: " if name else ""

    @property
    def dialect(self) -> str | None:
        """As the command line or the cell names it; None: found by the file."""
        return self.options.run.dialect or self.setup.dialect

    def _put_axes(self, axes: Mapping[int, PlacedAxis]) -> None:
        """What stands at places of the channel from now on."""
        if self.recorder and axes:
            placed = (f"{at}={axis.number}" for at, axis in axes.items())
            self.recorder.event(AXES_PLACED, " ".join(placed))
        put_axes(self.engine, axes)

    def _watch_waits(self, root: Any) -> None:
        """Who tells what the run waits for."""
        cell_s, wall_s = self.options.run.report_wait
        cycles = max(1, round(cell_s / self.cell.cycle_s))
        self.engine.tell_standstill(cycles)
        self.scene = RunScene(
            self.engine, root, self.cell, self.options, self.setup.place
        )
        self.scene.others_run = self._others_run
        self.waits = StandWatch(
            self.scene,
            self.shared.say,
            (cell_s, wall_s),
            self.setup.place.name,
            lambda: int(self.engine.state.cycle) * self.cell.cycle_s,
        )
        self.waiting: list[Waiting] = []

    def _others_run(self) -> bool:
        return self.others_run()

    def _set_modes(self) -> None:
        after = (
            READY
            if self.cell.channel.state_after_program == "READY"
            else SELECTED
        )
        name = f"{self.setup.place.index}-MDI.nc"
        self._scratch = self.shared.scratch / name
        self.modes = ModeControl(
            self.engine,
            self,
            self.shared.folder,
            self._scratch,
            after,
            self.refuse_command,
        )
        if self.file is not None:
            self.modes.select(self.file)

    def ready(self) -> None:
        """The cell runs: the channel waits for its start."""
        self.scene.phase = NOT_STARTED if self.file else UNUSED

    def start(self) -> None:
        """Start the program that it has."""
        if self.file is not None and not self.modes.running:
            self.modes.start()

    # ---------------------------------------------------------------- programs
    def start_program(self, path: Path) -> None:
        """Begin a program where the axes stand (hli_reference 1.4)."""
        options, realtime = self.options, self.shared.realtime
        if realtime:
            self.engine.stop()
        self.collect_program()
        if self.axes:
            self.axes.begins()
        self.engine.begin_program()
        self.modes.show()
        self.end, self.ended_at = "aborted", 0.0
        self.engine.set_error(0)
        self.engine.set_program_name(path.name)
        self.engine.suppress_functions(
            bool(execution_mode(self.area, self.report_error) & NO_FUNCTIONS)
        )
        if self.signals:
            self.signals.begins()
        if self.jobs:
            self.jobs.begins()
        dialect = self._found_dialect(path)
        port = self._port(path, dialect)
        self.preparation = Preparation(
            path,
            self.cell,
            dialect,
            self.engine,
            port,
            lenient=options.run.lenient,
            restart=self._take_restart(),
            tolerance=options.run.tolerance,
            held=self.modes.held,
        )
        if self.recorder:
            self.preparation.told = self.recorder.event
        port.told = self._heard
        self.note("start", path.name)
        self.scene.phase, self.scene.preparation = RUNNING, self.preparation
        self.shared.tell(f"{self.title}program {path.name} started")
        self.preparation.pump()
        if self.recorder:
            self.recorder.elements()
        held = options.run.hold_start
        self.engine.set_phase(
            layout.HLI_PHASE_READY if held else layout.HLI_PHASE_RUNNING
        )
        if realtime and not held:
            self.engine.start()

    def _port(self, path: Path, dialect: str) -> LivePort:
        """What a program asks the channel through."""
        sizes = self.cell.external_bytes(dialect)
        port = LivePort(
            self.cell.axis_values("start_mm"),
            {
                scope: self.engine.external(area, sizes[scope])
                for area, scope in enumerate(("channel", "global"))
            },
            self.options.run.out or OUT_FOLDER,
            skip_levels(self.area) | self.cell.skip_mask,
            self.engine.write_external,
            self._retained,
            self.shared.operator,
        )
        shown = self.cell.command_slots(dialect)
        if shown:
            block, slots = shown
            self.engine.show_commands(block * BLOCK_BYTES, slots)
        port.manual_data = path == self._scratch
        port.signals, port.axes = self.signals, self.axes
        port.jobs = self.jobs
        port.channel = self.setup.place.index + 1
        port.channel_name = self.setup.place.name
        port.ended = self._ended_beside_dialog
        return port

    def _ended_beside_dialog(self) -> bool:
        """Whether the PLC has ended the program that asks."""
        self.cycles_beside_dialog()
        return self.modes.end_beside_dialog() or self.modes.aborted

    def _stand(self) -> list[float]:
        return list(self.engine.state.position)[: self.engine.axes]

    def _heard(self, kind: str, text: str) -> None:
        """What the program says."""
        self.shared.desk.say(kind, f"{self.title}{text}")
        if self.recorder:
            self.recorder.event(kind, text)

    def _take_restart(self) -> Restart | None:
        """Where the first program is taken up; those behind it begin at their
        beginning.
        """
        first, self._restarted = not self._restarted, True
        return Restart.of(*self.options.run.place) if first else None

    def _found_dialect(self, path: Path) -> str:
        """Dialect of a program; empty: what is wrong with its file is told where
        it is read.
        """
        try:
            return self.dialect or frontend.detect(path)
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

    def reset_channel(self) -> None:
        """Pending functions go, and signals to this channel."""
        self.engine.reset_channel()
        if self.signals:
            self.signals.reset()

    # a job of another channel's program
    def find_program(self, name: str) -> Path:
        return self.modes.find(name)

    def free_for_job(self) -> bool:
        return self.modes.free

    def start_job(self, path: Path) -> None:
        self.modes.start_job(path)

    def reset_by_job(self) -> None:
        self.modes.reset()

    def refuse_command(self, error: CncError) -> None:
        """A mode command that cannot be carried out."""
        self.report_error(error, class_=REFUSED)

    def report_error(self, error: CncError, class_: int = 2) -> None:
        """An error that belongs to no program: told to the PLC and in the
        report, it ends nothing.
        """
        self.engine.post_error(error, class_=class_)
        self.note("warning", error=error)
        self.said.warn(f"{self.title}{error}")
        if not self.options.once:
            print(f"{self.title}{error}", file=sys.stderr, flush=True)

    def collect_program(self) -> None:
        """Take over what the last program has said, ahead of the next one or of
        the end.
        """
        preparation, self.preparation = self.preparation, None
        if preparation is not None:
            preparation.take_commands()
            self.said.collect(preparation, self.engine.state)

    # ---------------------------------------------------------------- events
    def handle(self, event: Event) -> None:
        """What the engine has told."""
        if self.preparation:
            self._prepare(self.preparation, event)
        else:
            self.engine.take_commands()
        if event is Event.MODE_COMMAND:
            command = self.engine.take_mode_command()
            if command:
                self.modes.handle(command)
        elif event is Event.PLC_ERROR:
            self._plc_error()
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
        if self.jobs:
            self.jobs.serve()

    def _prepare(self, preparation: Preparation, event: Event) -> None:
        """What is for the program."""
        preparation.take_commands()
        if event is Event.NEED_BLOCKS:
            preparation.pump()
        elif event is Event.DRAINED:
            preparation.drained()
            preparation.pump()
        elif event is Event.RETRACED:
            preparation.retraced()

    def _plc_error(self) -> None:
        record = self.engine.take_plc_error()
        if record:
            text = f"{record[0]}, reaction class {record[1]}"
            self.note("plc error", text)
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
        self.scene.end()
        if self.signals:
            self.signals.ends()
        if self.axes:
            self.axes.ends()
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
        if self.jobs:
            self.jobs.ended(self.end)
        self.note("end", self.end)
        if error:
            self.note("error", error=error)
        self.engine.set_error(error.code if error else 0)
        self.shared.tell(f"{self.title}program {ENDINGS[self.end]}")
        if error and not self.options.once:
            print(f"{self.title}{error}", file=sys.stderr, flush=True)
        if not self.others_run():
            self.engine.set_phase(layout.HLI_PHASE_ENDED)
        self.modes.program_ended(error)

    def note(
        self, kind: str, text: str = "", error: CncError | None = None
    ) -> None:
        """An event: for the recording, and for whoever looks."""
        self.shared.desk.say(kind, f"{self.title}{text or error or ''}")
        if self.recorder:
            code, line = (error.code, error.place.line) if error else (0, 0)
            self.recorder.event(kind, text or str(error or ""), code, line)

    def prepared(self) -> dict[str, Any]:
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

    def told(self) -> dict[str, Any]:
        """The same with name and axis areas, which are always known."""
        place = self.setup.place
        areas = [place.axis_base, place.axis_base + self.setup.areas]
        found = {"name": place.name, "areas": areas}
        try:
            return found | self.prepared()
        except (AttributeError, TypeError, ValueError, LookupError):
            return found  # a program is just being changed

    # ---------------------------------------------------------------- the end
    def close(self) -> None:
        """Behind the last cycle: what has been said is kept."""
        self.collect_program()
        self._scratch.unlink(missing_ok=True)
        if int(self.engine.state.bad_commands):
            self.said.warn(f"{self.title}{BAD_COMMANDS}")
        if self.recorder:
            self.recorder.close()

    def report(self) -> dict[str, Any]:
        """What the launcher needs of it, as JSON."""
        figures = engine_figures(self.engine.state, self.cell.cycle_s)
        return figures | {
            "index": self.setup.place.index,
            "name": self.setup.place.name,
            "program": str(self.file) if self.file else None,
            "end": self.end,
            "aborted_by_plc": self.modes.aborted,
            **self.said.as_json(),
            "waiting": [waiting.as_json() for waiting in self.waiting],
            "recording": missing_rows(self.recorder),
        }
