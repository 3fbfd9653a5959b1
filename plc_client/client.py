"""Connection of a PLC process (or a mere reader) to a running CNC.

The PLC registers in the sidecar: process id and start time, a new generation,
``attached`` last.  In lockstep the CNC then runs only as far as the PLC lets
it: ``Hli.step()`` by hand, or the scan runtime.
"""

from __future__ import annotations

import operator
import os
import time
from typing import Any, Literal

from hli._sync import ffi, lib

from hli import layout
from hli.areas import Areas
from hli.errors import HliError, HliInUse, HliNotFound, HliNotReady, HliTimeout
from hli.handshake import ContourUnit, snapshot, word_pointer
from hli.segment import Segment, attach
from hli.structures import HLI_BAHN_STATE

from . import clock

DEFAULT_NAME = "hli-cosim"
SPIN_NS = 500_000
MAX_STEP = 1 << 30  # cycles of one step(); the turn counter has 32 bits
SLICE_NS = 100_000_000
FREE_RUN = (
    0x3FFFFFFF  # turns ahead: more than any CNC runs before it looks again
)
_RETRY_S = 0.02
_OK: int = lib.HS_OK

Role = Literal["plc", "reader"]


class Hli(Areas):
    """The HLI of one running CNC: ``gpPform``, ``gpCh[i]``, ``gpAx[i]``,
    ``gpVECh[i]``, ``gpVEGlobal``, ``gNrCh`` ...

    A context manager; ``close()`` gives the PLC's place back.  Made by
    ``connect()``.
    """

    def __init__(
        self, segment: Segment, role: Role = "plc", scans_due: bool = False
    ) -> None:
        super().__init__(segment)
        self.name = segment.name
        self.role = role
        self.cnc = self.sidecar.cnc
        self.plc = self.sidecar.plc
        self._cnc_turn = word_pointer(self.root, "cnc_turn")
        self._plc_turn = word_pointer(self.root, "plc_turn")
        self._attached = self.plc._pointer(layout.HLI_SIDE_PLC.attached.offset)
        self._cycle = self.cnc._pointer(layout.HLI_SIDE_CNC.cycle.offset)
        self._cell_time = self.cnc._pointer(
            layout.HLI_SIDE_CNC.cell_time_ns.offset
        )
        self._phase = self.cnc._pointer(layout.HLI_SIDE_CNC.phase.offset)
        self._seen = self._cnc_identity()
        head = segment.root.segment_head
        self._process = (
            (self.cnc.pid, self.cnc.start)
            if self.cnc.pid
            else (head.owner_pid, head.owner_start)
        )
        self._open = True
        if role == "plc":
            with segment.locked():
                self._register(scans_due)
        clock.set_source(lambda: self.cell_time_ns)

    def __repr__(self) -> str:
        channels, axes = self.gNrCh, self.gNrAx
        return f"<hli {self.name!r}: gNrCh {channels}, gNrAx {axes}>"

    # -- registration
    def _register(self, scans_due: bool) -> None:
        plc, me = self.plc, os.getpid()
        attached = lib.hs_load_u32(self._attached)
        if attached and lib.hs_process_alive(plc.pid, plc.start):
            raise HliInUse(
                f"segment {self.name!r} already has a PLC, process {plc.pid}; end it first"
            )
        lib.hs_store_u32(self._attached, 0)
        plc.pid, plc.start = me, lib.hs_process_start(me)
        plc.finished = plc.scans = plc.heartbeat = 0
        plc.scans_due = scans_due
        # a dead predecessor may have left some
        self.sidecar.cnc_turn.waiters = self.sidecar.clah_answer.waiters = 0
        self.release_until(lib.hs_load_u32(self._cnc_turn))
        lib.hs_plc_register(ffi.cast("void *", self.segment.base))

    def set_present(self, present: bool = True) -> None:
        """``plc_present_w`` of platform, channels and configured axes: the
        control units and technology output live.
        """
        self.gpPform.plc_present_w = present
        for channel in self.gpCh[: self.gNrCh]:
            channel.head.plc_present_w = present
        for axis in self.gpAx[: self.gNrAx]:
            axis.head.plc_present_w = present

    def finish(self) -> None:
        """Tell the CNC that the PLC does not need the cell any longer."""
        lib.hs_store_u32(
            self.plc._pointer(layout.HLI_SIDE_PLC.finished.offset), 1
        )

    def close(self) -> None:
        """Detach and give the memory up; the CNC runs on, in lockstep it waits
        for the next PLC.

        Views taken earlier stay readable.
        """
        if not self._open:
            return
        self._open = False
        if self.role == "plc" and self.plc.pid == os.getpid():
            lib.hs_store_u32(self._attached, 0)
            turn = lib.hs_load_u32(self._cnc_turn)
            lib.hs_word_post(self._plc_turn, (turn + FREE_RUN) & 0xFFFFFFFF)
        self.segment.close()

    def __enter__(self) -> Hli:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    # -- state of the cell
    @property
    def cycle(self) -> int:
        """Completed CNC cycles."""
        return int(lib.hs_load_u64(self._cycle))

    @property
    def cell_time_ns(self) -> int:
        """The cell's clock in ns since the CNC started."""
        return int(lib.hs_load_u64(self._cell_time))

    @property
    def cell_time_s(self) -> float:
        """The cell's clock in s since the CNC started."""
        return self.cell_time_ns / 1e9

    @property
    def cycle_s(self) -> float:
        """Cycle time of the CNC in s."""
        return max(int(self.cnc.cycle_ns), 1) / 1e9

    @property
    def phase(self) -> int:
        """Phase of the CNC: HLI_PHASE_* of ``hli.layout``."""
        return int(lib.hs_load_u32(self._phase))

    def alive(self) -> bool:
        """Whether the CNC this connection was made to still runs and has not
        started anew.
        """
        return self._cnc_identity() == self._seen and bool(
            lib.hs_process_alive(*self._process)
        )

    def _cnc_identity(self) -> tuple[int, int, int]:
        return (self.cnc.pid, self.cnc.start, self.cnc.generation)

    def snapshot(self, channel: int = 0) -> HLI_BAHN_STATE:
        """A consistent private copy of ``gpCh[channel].bahn_state``."""
        copy: HLI_BAHN_STATE = snapshot(self.gpCh[channel].bahn_state)
        return copy

    # -- lockstep by hand
    def release_until(self, cycle: int) -> None:
        """Let the CNC run until `cycle` cycles are completed (modulo 2**32)."""
        lib.hs_word_post(self._plc_turn, cycle & 0xFFFFFFFF)

    def wait_cycle(self, cycle: int, timeout_ns: int = SLICE_NS) -> bool:
        """Wait until the CNC completed `cycle` cycles; False after the time or
        when a signal came.
        """
        return bool(
            lib.hs_word_wait(
                self._cnc_turn, cycle & 0xFFFFFFFF, SPIN_NS, timeout_ns
            )
            == lib.HS_OK
        )

    def turn(self, cycle: int) -> bool:
        """``release_until`` and ``wait_cycle`` in one call into C: what a scan
        runtime does once a scan.
        """
        return bool(
            lib.hs_word_turn(
                self._plc_turn,
                self._cnc_turn,
                cycle & 0xFFFFFFFF,
                SPIN_NS,
                SLICE_NS,
            )
            == _OK
        )

    def step(self, cycles: int = 1, timeout_s: float = 5.0) -> int:
        """Lockstep: let the CNC run `cycles` cycles and wait for them; returns
        the completed cycles.

        Raises ValueError (not 1..2**30 cycles), HliError (a reader, another
        clock, the CNC has ended), HliTimeout.
        """
        cycles = operator.index(cycles)
        if not 1 <= cycles <= MAX_STEP:
            raise ValueError(f"step of {cycles} cycles: 1..{MAX_STEP}")
        self._check_step()
        target = lib.hs_load_u32(self._cnc_turn) + cycles
        self.release_until(target)
        end = time.monotonic() + timeout_s
        while not self.wait_cycle(target):
            if not self.alive() or self.phase == layout.HLI_PHASE_SHUTDOWN:
                raise HliError(
                    f"the CNC behind segment {self.name!r} has ended"
                )
            if time.monotonic() > end:
                raise HliTimeout(
                    f"the CNC did not complete {cycles} cycles within {timeout_s} s"
                )
        return self.cycle

    def _check_step(self) -> None:
        if self.role != "plc":
            raise HliError(
                "step() needs role='plc'; a reader does not take part in the cell"
            )
        if self.cnc.clock != layout.HLI_CLOCK_LOCKSTEP:
            raise HliError(
                "step() needs a CNC in lockstep; with other clocks the CNC runs by itself"
            )

    def exchange(
        self,
        start_position: float,
        length: float,
        channel: int = 0,
        timeout_s: float = 5.0,
    ) -> Any:
        """One contour look-ahead request with its answer (own numpy copy), with
        any clock.

        In lockstep the CNC is stepped until it has answered.  Raises
        HliTimeout.
        """
        unit = ContourUnit(self.gpCh[channel].contour_lookahead)
        by_itself = self.cnc.clock != layout.HLI_CLOCK_LOCKSTEP
        if self.role != "plc" or by_itself:
            return unit.exchange(start_position, length, timeout_s).copy()
        end = time.monotonic() + timeout_s
        while not unit.request(start_position, length):
            self._step_before(end)
        while (n := unit.take()) < 0:
            self._step_before(end)
        return unit.rows[:n].copy()

    def _step_before(self, end: float) -> None:
        if time.monotonic() > end:
            raise HliTimeout("the CNC runs but does not answer the request")
        self.step()


def connect(
    name: str = DEFAULT_NAME,
    wait_s: float = 0.0,
    role: Role = "plc",
    present: bool = True,
) -> Hli:
    """Attach to a running CNC, waiting up to ``wait_s`` seconds for it (0: not
    at all).

    ``role="plc"`` takes the PLC's place and, with ``present``, sets
    ``plc_present_w`` everywhere; in lockstep the CNC then stands until
    ``step()``, with other clocks the program starts.  ``present=False`` is for
    a scan runtime, which sets it with its first scan: the program starts behind
    that one.  ``role="reader"`` only looks. Raises HliNotFound, HliNotReady,
    HliVersionError, HliAccessError, HliInUse (there is a PLC already).
    """
    if role not in ("plc", "reader"):
        raise ValueError(f"role {role!r}: 'plc' or 'reader'")
    end = time.monotonic() + wait_s
    while True:
        try:
            segment = attach_running(name)
            break
        except (HliNotFound, HliNotReady):
            if time.monotonic() >= end:
                raise
            time.sleep(_RETRY_S)
    try:
        hli = Hli(segment, role, scans_due=not present)
    except HliError:
        segment.close()
        raise
    if role == "plc" and present:
        hli.set_present()
    return hli


def attach_running(name: str) -> Segment:
    """``hli.attach`` that takes a segment whose CNC is dead or shutting down as
    not there (HliNotFound).
    """
    segment = attach(name)
    owner, phase = (
        segment.root.segment_head.owner_pid,
        segment.root.sidecar.cnc.phase,
    )
    problem = (
        ""
        if segment.owner_alive()
        else f"is left over: its CNC, process {owner}, is gone"
    )
    if phase == layout.HLI_PHASE_SHUTDOWN:
        problem = problem or f"is being closed by its CNC, process {owner}"
    if problem:
        segment.close()
        raise HliNotFound(f"segment {name!r} {problem}")
    return segment
