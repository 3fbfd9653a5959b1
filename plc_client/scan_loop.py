"""Scans that C runs, one after the other, as long as nothing but the tasks needs
Python: compiled tasks directly, Python tasks by a call each.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

from hli._sync import ffi, lib

from hli import layout
from hli.handshake import word_pointer

from .client import SLICE_NS, SPIN_NS, Hli
from .image import InputImage
from .program import Program

SLICE_OF_SCANS_NS = 2_000_000
"""Wall time of one call: signals and orders wait as long."""
NOT_DUE, DUE, TRAPPED = lib.HS_TIMEOUT, lib.HS_OK, lib.HS_TRAPPED


def entry_of(program: Program) -> tuple[int, int] | None:
    """Addresses of a compiled task: its guarded call and its entry.

    None: it runs in Python.
    """
    native: Callable[[Any], tuple[int, int] | None] | None = getattr(
        type(program.instance), "native_scan", None
    )
    return native(program.instance) if native is not None else None


_CALL = "int32_t (*)(void (*)(void), int64_t)"
_ENTRY = "void (*)(void)"


class ScanLoop:
    """The tasks as C takes them; made when a PLC starts."""

    def __init__(
        self, hli: Hli, image: InputImage, programs: Sequence[Program]
    ) -> None:
        self._programs = programs
        self._error: BaseException | None = None
        self._rows = ffi.new("hs_task[]", len(programs))
        self._calls: list[Any] = []  # kept alive here
        for row, program in zip(self._rows, programs, strict=True):
            self._enter(row, program)
        self._scans = ffi.new("hs_scans *")
        scans, plc = self._scans, layout.HLI_SIDE_PLC
        scans.image = image.now
        scans.scans_at = hli.plc._pointer(plc.scans.offset)
        scans.heartbeat_at = hli.plc._pointer(plc.heartbeat.offset)
        scans.mine = word_pointer(hli.root, "plc_turn")
        scans.others = word_pointer(hli.root, "cnc_turn")
        scans.tasks, scans.count = self._rows, len(programs)
        scans.slice_ns = SLICE_OF_SCANS_NS
        scans.spin_ns, scans.timeout_ns = SPIN_NS, SLICE_NS

    def _enter(self, row: Any, program: Program) -> None:
        """How C calls a task."""
        native = entry_of(program)
        if native is not None:
            row.guarded = ffi.cast(_CALL, native[0])
            row.entry = ffi.cast(_ENTRY, native[1])
            return
        cyclic = program.call_cyclic

        def call(_entry: Any, _now_ns: int) -> int:
            cyclic()
            return 0

        def failed(_kind: Any, error: BaseException, _trace: Any) -> None:
            self._error = error

        callback = ffi.callback(_CALL, call, error=1, onerror=failed)
        self._calls.append(callback)
        row.guarded = callback

    def run(self, loop: Callable[[Any], int]) -> int:
        """Scans from the one that is due on: ``DUE``, ``NOT_DUE``, ``TRAPPED``
        or another number: the next scan is the caller's.

        ``loop``: runs them; it gets ``hs_scans``.
        """
        for row, program in zip(self._rows, self._programs, strict=True):
            row.due, row.interval = program.due, program.interval_ticks
            row.interval_ns = round(program.spec.interval * 1e9)
            row.started_ns, row.jitter_ns = (
                program.started_ns,
                program.jitter_ns,
            )
            row.total_ns = row.shortest_ns = row.longest_ns = 0
            row.scans = row.missed = 0
        result: int = loop(self._scans)
        for row, program in zip(self._rows, self._programs, strict=True):
            _note(row, program)
        return result

    def stopped(self) -> None:
        """What a task that did not return has left: its error, or its trap.

        Raises the error.
        """
        if self._error is not None:
            raise self._error
        number: int = self._scans.trapped
        self._programs[number].call("trapped")


def _note(row: Any, program: Program) -> None:
    """The statistics of the scans in C go to those of the task."""
    program.due, program.started_ns = row.due, row.started_ns
    program.jitter_ns = row.jitter_ns
    program.overruns += row.missed
    if row.scans:
        times = (row.scans, row.total_ns, row.shortest_ns, row.longest_ns)
        program.times.add_many(*times)
