"""Python's handle on the C engine: one owner, rows in, samples and events out.

On import the numpy dtype of the waist is compared with the C struct, offset by offset.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import IntEnum
from typing import Any

import numpy as np
import numpy.typing as npt

from cnc_core._engine import ffi, lib
from hli.segment import Segment

from ..blocks import NC_AXES, NC_BLOCK, BlockBatch
from ..blocks.to_c import pool_pointer, row_pointer
from ..config import CellConfig, ChannelPlace, synch_value
from ..errors import ERRORS, CncError
from ..frontend.port import RtOp
from .left_out import LeftOut, left_out_of
from .recorded import ROW_STRUCTS, Recorded, Rows, row_type


def _check_waist() -> None:
    members = ffi.typeof("nc_block").fields
    names = {name: member.offset for name, member in members}
    fields: Any = NC_BLOCK.fields
    mine = {name: spec[1] for name, spec in fields.items()}
    if (
        names != mine
        or ffi.sizeof("nc_block") != NC_BLOCK.itemsize
        or lib.NC_AXES != NC_AXES
    ):
        raise ImportError(
            f"nc_block and NC_BLOCK differ: {names} against {mine}"
        )


_check_waist()


class Event(IntEnum):
    """Why ``Engine.run`` or ``Engine.wait`` returned."""

    DONE = lib.ENGINE_DONE
    NEED_BLOCKS = lib.ENGINE_NEED_BLOCKS
    DRAINED = lib.ENGINE_DRAINED
    PROGRAM_END = lib.ENGINE_PROGRAM_END
    PLC_WAIT = lib.ENGINE_PLC_WAIT
    RECORD_FULL = lib.ENGINE_RECORD_FULL
    PLC_FINISHED = lib.ENGINE_PLC_FINISHED
    FAULT = lib.ENGINE_FAULT
    MODE_COMMAND = lib.ENGINE_MODE_COMMAND
    WATCHDOG = lib.ENGINE_WATCHDOG
    PLC_ERROR = lib.ENGINE_PLC_ERROR
    RETRACED = lib.ENGINE_RETRACED
    STANDS = lib.ENGINE_STANDS
    COMMANDS = lib.ENGINE_COMMANDS


@dataclass(frozen=True)
class ModeCommand:
    """HLI_PROC_TRANS_TO_MODE_STATE as the PLC wrote it."""

    from_mode: int
    from_state: int
    to_mode: int
    to_state: int
    parameter: str
    state: int  # in which it came


@dataclass(frozen=True)
class PathCommand:
    """A command that the path has passed: its number, the position there
    (axes,), the cycle, the source line.
    """

    value: float
    position: list[float]
    cycle: int
    line: int


@dataclass(frozen=True)
class Standstill:
    """Why the path stands (``lib.ENGINE_STOP_*``; 0: it moves), since which
    cycle, and at which block.
    """

    conditions: int
    held_axes: int
    since: int
    cycle: int
    line: int
    n: int
    file: int


@dataclass(frozen=True)
class Samples:
    """One row a cycle: cycle number (n,), axes (n, axes) mm, path (n,) mm,
    speed (n,) mm/s, active element (n,).
    """

    cycle: npt.NDArray[np.float64]
    pos: npt.NDArray[np.float64]
    path: npt.NDArray[np.float64]
    speed: npt.NDArray[np.float64]
    element: npt.NDArray[np.int64]

    @classmethod
    def of(cls, rows: Rows) -> Samples:
        """From rows of ``Engine.take``."""
        return cls(
            rows["cycle"].astype(np.float64),
            np.ascontiguousarray(rows["position"]),
            rows["path"].copy(),
            rows["speed"].copy(),
            rows["element"].astype(np.int64),
        )


def _engine_config(
    cell: CellConfig,
    window: int | None,
    clock: int,
    service: int,
    place: ChannelPlace,
    jerk: bool,
) -> Any:
    config = ffi.new("engine_config *")
    config.cycle_s = cell.cycle_s
    names = cell.axis_names
    for target, key in (
        ("v_max", "v_max_mm_s"),
        ("a_max", "a_max_mm_s2"),
        ("j_max", "j_max_mm_s3"),
        ("start", "start_mm"),
    ):
        getattr(config, target)[0 : len(names)] = list(
            cell.axis_values(key) * (jerk or target != "j_max")
        )
    config.axis_count, config.guest_count = len(names), cell.guests
    config.main = list(cell.main_axes)
    config.window = window or cell.channel.window
    known = (
        "FCT_CONTOUR_LAH",
        "FCT_CALC_TIME",
        "FCT_CALC_POS_V_0",
        "FCT_CALC_STATE_AT_T",
    )
    config.functions = sum(
        getattr(lib, f"ENGINE_{n}")
        for n in known
        if n in cell.channel.functions
    )
    for i, seconds in enumerate(cell.channel.esa_time):
        config.esa_time[i] = seconds
    config.log_max = cell.channel.contour_lookahead_log_max
    config.fb_storage_size = cell.channel.storage
    config.rapid_override_mode = cell.channel.rapid_override_mode
    config.retrace_feed = cell.retrace_mm_s
    config.channel, config.axis_base = place.index, place.axis_base
    config.service, config.clock = service, clock
    config.axis_id[0 : len(names)] = [
        axis.id or i for i, axis in enumerate(cell.axes.values(), 1)
    ]
    config.spindle_count = len(cell.spindles)
    config.spindle_id[0 : len(cell.spindles)] = [
        spindle.id for spindle in cell.spindles.values()
    ]
    return config


def bare_loop(
    period_s: float, rows: int, fifo: bool = True
) -> npt.NDArray[np.int64]:
    """(rows,) ns by which a bare clock_nanosleep loop wakes late: the reference
    for ``Engine.time_cycles``.
    """
    late = np.zeros(rows, np.int64)
    if (
        lib.engine_bare_loop(
            int(period_s * 1e9),
            ffi.from_buffer("int64_t[]", late),
            rows,
            int(fifo),
        )
        != 0
    ):
        raise OSError("no thread could be started")
    return late


class Engine:
    """Owner of one C engine.

    ``segment``: a mapped HLI segment, kept as long as the engine, or None for
    offline planning.

    ``jerk`` False: the cell's jerk limits are left aside.
    ``place``: of the channel in the segment.
    """

    def __init__(
        self,
        cell: CellConfig,
        *,
        window: int | None = None,
        segment: Segment | None = None,
        clock: int = 1,
        service: int = 0,
        record_rows: int = 0,
        jerk: bool = True,
        place: ChannelPlace = ChannelPlace(),  # noqa: B008 - a constant
    ) -> None:
        self.axes = len(cell.axes)
        self.started = False  # threads drive it
        config = _engine_config(cell, window, clock, service, place, jerk)
        self._segment = segment  # C works on its memory
        pointer = segment.pointer(0) if segment else ffi.NULL
        handle = lib.engine_new(config, pointer)
        if handle == ffi.NULL:
            raise MemoryError("engine")
        self._handle = ffi.gc(handle, lib.engine_free)
        self._set_synchronisation(cell)
        self._rows = record_rows
        self._room: dict[Recorded, Rows] = {}
        if record_rows and lib.engine_record(self._handle, record_rows):
            raise MemoryError("sample ring")

    def _set_synchronisation(self, cell: CellConfig) -> None:
        pre = cell.channel.m_pre_outp
        functions = [
            (lib.NC_M, n, name, pre.get(str(n), 0.0))
            for n, name in cell.m_functions.items()
        ]
        functions += [
            (lib.NC_H, int(n), name, 0.0)
            for n, name in cell.channel.h_synch.items()
        ]
        functions.append((lib.NC_T, 0, cell.channel.tool_synch, 0.0))
        for kind, number, name, pre_output in functions:
            synch = synch_value(name)
            if (
                synch
                and lib.engine_set_synch(
                    self._handle, kind, number, synch, pre_output
                )
                != 0
            ):
                raise MemoryError("synchronisation tables")
        for spindle in cell.spindles.values():
            for what, name in spindle.functions.items():
                lib.engine_set_spindle_synch(
                    self._handle, what, synch_value(name)
                )

    def close(self) -> None:
        """Stop all threads and free the engine; further calls are errors."""
        if self._handle is not None:
            ffi.release(self._handle)
            self._handle = None

    def push(self, batch: BlockBatch, first: int = 0) -> int:
        """Hand over rows from ``first`` on; returns how many were taken.
        CncError for a row the engine refuses.
        """
        rows = np.ascontiguousarray(batch.rows[first:])
        pointer = row_pointer(rows)
        pool = pool_pointer(batch.pool)
        taken = int(
            lib.engine_push(
                self._handle, pointer, len(rows), pool, len(batch.pool)
            )
        )
        if taken < 0:
            number, line = -taken, int(rows[0]["line"])
            raise CncError(
                number,
                f"line {line}: {ERRORS[number]} (row of type {int(rows[0]['type'])})",
            )
        return taken

    def finish(self) -> None:
        """No further rows will come."""
        lib.engine_finish(self._handle)

    def stand_by(self) -> None:
        """No program is active: the engine only serves and publishes until
        ``begin_program``.
        """
        lib.engine_stand_by(self._handle)

    def begin_program(self) -> None:
        """A program starts where the axes stand; distance, block count and log
        begin anew. No thread may run.
        """
        lib.engine_begin_program(self._handle)

    def abort(self) -> None:
        """Brake, leave out the rest, report ``Event.PROGRAM_END``; no row may
        be pushed after it.
        """
        lib.engine_abort(self._handle)

    def reset_channel(self) -> None:
        """Clear pending technology units."""
        lib.engine_reset_channel(self._handle)

    def external(self, area: int, size: int) -> Any:
        """Buffer of ``size`` bytes: external variables (area 0: channel, 1:
        global) as the last cycle latched them.
        """
        pointer = lib.engine_external(self._handle, area, size)
        if pointer == ffi.NULL:
            raise MemoryError("external variables")
        return ffi.buffer(pointer, size)

    def write_external(self, area: int, offset: int, data: bytes) -> None:
        """Bytes for the external variables that the next cycle puts out.

        CncError if it keeps no more of them.
        """
        if (
            lib.engine_write_external(
                self._handle, area, offset, data, len(data)
            )
            != 1
        ):
            raise CncError(904005)

    def rt_cycle(
        self, slot: int, state: int, program: bool, ops: Sequence[RtOp]
    ) -> None:
        """A real-time cycle, from the next cycle on.

        ``ops``: new instructions, if there are any. ``program``: it ends with
        the program. CncError if the engine does not keep it.
        """
        code = ffi.new("engine_rt_op[]", [tuple(op) for op in ops])
        taken = lib.engine_rt_cycle(
            self._handle, slot, state, program, code, len(ops)
        )
        if taken != 1:
            raise CncError(904010)

    def show_commands(self, offset: int, slots: int) -> None:
        """Commands on the path appear in the global external variables from
        ``offset`` (bytes) on: count, numbers.
        """
        if lib.engine_show_commands(self._handle, offset, slots):
            raise ValueError("no such place for commands")

    def set_program_name(self, name: str) -> None:
        """``prog_name_r``, from the next cycle on."""
        lib.engine_set_program_name(
            self._handle, name.encode("latin-1", "replace")[:259]
        )

    def set_error(self, code: int) -> None:
        """``error_id_r`` and ``error_r``, from the next cycle on; 0: no error."""
        lib.engine_set_error(self._handle, code)

    def suppress_functions(self, suppressed: bool) -> None:
        """Count technology functions as acknowledged instead of putting them
        out (execution mode 0x2000).
        """
        lib.engine_suppress_functions(self._handle, int(suppressed))

    def set_mode(self, mode: int, state: int) -> None:
        """Publish the operation mode and its state (``hli.layout.HLI_IMCM_*``)."""
        lib.engine_set_mode(self._handle, mode, state)

    @property
    def mode_state(self) -> int:
        """State of the operation mode; HOLD and back happen inside the engine."""
        return int(lib.engine_mode_state(self._handle))

    def take_mode_command(self) -> ModeCommand | None:
        """The command that ``Event.MODE_COMMAND`` told of."""
        return self._mode_command(lib.engine_take_mode_command)

    def see_mode_command(self) -> ModeCommand | None:
        """The same; it stays to be taken."""
        return self._mode_command(lib.engine_see_mode_command)

    def _mode_command(self, get: Any) -> ModeCommand | None:
        out = ffi.new("engine_mode_command *")
        if not get(self._handle, out):
            return None
        parameter = ffi.string(out.parameter).decode("latin-1").strip()
        return ModeCommand(
            out.from_mode,
            out.from_state,
            out.to_mode,
            out.to_state,
            parameter,
            out.state,
        )

    def post_error(self, error: CncError, n: int = 0, class_: int = 2) -> None:
        """Send an error record to the PLC (MC_ERROR)."""
        out = ffi.new("engine_error *")
        out.id, out.line, out.column, out.n = (
            error.code,
            error.place.line,
            max(0, error.place.column),
            n,
        )
        out.reaction_class = out.recovery_class = class_
        file = error.place.file.rsplit("/", 1)[-1]
        name = file.encode("latin-1", "replace")[:255]
        ffi.memmove(out.program, name, len(name))
        lib.engine_post_error(self._handle, out)

    def take_plc_error(self) -> tuple[int, int] | None:
        """(number, reaction class) of the error record that the PLC sent."""
        number, reaction = ffi.new("uint32_t *"), ffi.new("uint32_t *")
        if not lib.engine_take_plc_error(self._handle, number, reaction):
            return None
        return int(number[0]), int(reaction[0])

    def expect_drain(self) -> None:
        """Report ``Event.DRAINED`` when all rows pushed so far are executed."""
        lib.engine_expect_drain(self._handle)

    def expect_cycle(self) -> None:
        """``Event.NEED_BLOCKS`` not before the next cycle has passed."""
        lib.engine_expect_cycle(self._handle)

    def halt(self) -> None:
        """Brake, leave out what has been pushed, report ``Event.DRAINED``."""
        lib.engine_halt(self._handle)

    def left_out(self) -> LeftOut:
        """What the halt has left out; ahead of ``resync``."""
        return left_out_of(self._handle)

    def hold_by_cell(self, by_cell: bool) -> None:
        """HOLD and its end come as ``Event.MODE_COMMAND``."""
        lib.engine_hold_by_cell(self._handle, int(by_cell))

    def hold(self, hold: bool) -> None:
        """HOLD or its end, for a cell that has asked for them."""
        lib.engine_hold(self._handle, int(hold))

    def macro_runs(self, runs: bool) -> None:
        """The transient state of the mode stays until ``set_mode``."""
        lib.engine_macro_runs(self._handle, int(runs))

    def resync(self, *, in_block: bool = False) -> None:
        """Behind ``Event.DRAINED``: on from where the axes stand, in a block or not."""
        lib.engine_resync(self._handle, int(in_block))

    def await_functions(self) -> None:
        """What is pushed next waits for acknowledgements that are missing."""
        lib.engine_await_functions(self._handle)

    def take_commands(self) -> list[PathCommand]:
        """Commands of the program that the path has passed since the last call."""
        out, found = ffi.new("engine_command *"), []
        while lib.engine_take_command(self._handle, out):
            found.append(
                PathCommand(
                    out.value,
                    list(out.position)[: self.axes],
                    int(out.cycle),
                    int(out.line),
                )
            )
        return found

    def hold_start(self, hold: bool) -> None:
        """Hold motion before the program start, or release it."""
        lib.engine_hold_start(self._handle, int(hold))

    def stay(self, stay: bool) -> None:
        """Stay behind the program's end although the PLC needs the cell no longer."""
        lib.engine_stay(self._handle, int(stay))

    def set_override(self, factor: float, hold: bool = False) -> None:
        """Override and feed hold of an engine without a segment."""
        lib.engine_set_override(self._handle, factor, int(hold))

    def stall_planner(self, stalled: bool) -> None:
        """Fault injection: the planner does not get its turn; GEO follows the
        stored stopping tail.
        """
        lib.engine_stall_planner(self._handle, int(stalled))

    def set_phase(self, phase: int) -> None:
        """Publish the life phase (``hli.layout.HLI_PHASE_*``)."""
        lib.engine_set_phase(self._handle, phase)

    def run(self, cycles: int, wait_ns: int = 100_000_000) -> Event:
        """Pump planner and GEO on this thread for up to ``cycles`` cycles."""
        return Event(lib.engine_run(self._handle, cycles, wait_ns))

    def start(self, fifo: bool = True) -> bool:
        """Start the real-time threads; True if GEO runs with SCHED_FIFO."""
        result = lib.engine_start(self._handle, int(fifo))
        self.started = result >= 0
        if result < 0:
            raise OSError("the engine's threads could not be started")
        return bool(fifo and result == 0)

    def time_cycles(self, rows: int) -> tuple[npt.NDArray[np.int64], ...]:
        """Three arrays (rows,) that real-time cycles fill, ns: what a cycle
        took, how late it began, what the rehearsal ahead of it took (0: there
        was no time for one). Call before ``start``.
        """
        self._timing = tuple(np.zeros(rows, np.int64) for _ in range(3))
        pointers = [ffi.from_buffer("int64_t[]", a) for a in self._timing]
        lib.engine_time(self._handle, *pointers, rows)
        return self._timing

    @property
    def timed(self) -> int:
        """How many cycles have been measured."""
        return int(lib.engine_timed(self._handle))

    def wait(self, timeout_s: float) -> Event:
        """Real time: wait for an event."""
        return Event(lib.engine_wait(self._handle, int(timeout_s * 1e9)))

    def stop(self) -> None:
        """Stop the real-time threads."""
        lib.engine_stop(self._handle)
        self.started = False

    def serve_start(self) -> None:
        """Start the immediate look-ahead service."""
        if lib.engine_serve_start(self._handle) != 0:
            raise OSError("the service thread could not be started")

    def serve_stop(self) -> None:
        """Stop the immediate look-ahead service."""
        lib.engine_serve_stop(self._handle)

    def take(self, what: Recorded) -> Rows:
        """Rows recorded since the last call, a structured array with the members
        of the C struct; at most as many as the ring holds.
        """
        room = self._room.get(what)
        if room is None:
            room = np.empty(self._rows, row_type(ROW_STRUCTS[what], self.axes))
            self._room[what] = room
        n = lib.engine_record_take(
            self._handle, what.value, ffi.from_buffer(room), len(room)
        )
        return room[:n].copy()  # a view would keep the whole room alive

    def lost(self, what: Recorded) -> int:
        """Rows of this kind that found no room in real time."""
        return int(lib.engine_record_lost(self._handle, what.value))

    def end_record(self) -> None:
        """Record what is still open: functions that were not acknowledged."""
        lib.engine_record_end(self._handle)

    def elements_from(self, first: int) -> Rows:
        """The elements pushed from number ``first`` on; by who pushes them."""
        count = max(0, int(self.state.elements) - first)
        out = np.empty(count, row_type("engine_element"))
        n = lib.engine_elements(
            self._handle,
            first,
            ffi.from_buffer("engine_element[]", out),
            count,
        )
        return out[:n]

    def take_samples(self) -> Samples:
        """The motion of the cycles recorded since the last call."""
        return Samples.of(self.take(Recorded.SAMPLES))

    def tell_standstill(self, cycles: int) -> None:
        """``Event.STANDS`` after so many cycles of a standstill; 0: never."""
        lib.engine_tell_standstill(self._handle, cycles)

    @property
    def standstill(self) -> Standstill:
        """Why the path stands now."""
        out = ffi.new("engine_standstill *")
        lib.engine_get_standstill(self._handle, out)
        members = Standstill.__annotations__
        return Standstill(**{name: getattr(out, name) for name in members})

    @property
    def state(self) -> Any:
        """Snapshot of the C struct ``engine_state``."""
        out = ffi.new("engine_state *")
        lib.engine_get_state(self._handle, out)
        return out
