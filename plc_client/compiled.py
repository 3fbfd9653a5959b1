"""Scans of compiled tasks: C runs them, one after the other, as long as nothing
of a scan needs Python.
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


def entries_of(programs: Sequence[Program]) -> list[tuple[int, int]] | None:
    """(call, entry) of every task, both addresses; None: one is not compiled."""
    found = []
    for program in programs:
        native: Callable[[Any], tuple[int, int] | None] | None = getattr(
            type(program.instance), "native_scan", None
        )
        entry = native(program.instance) if native is not None else None
        if entry is None:
            return None
        found.append(entry)
    return found or None


class CompiledScans:
    """The tasks as C takes them; made when a PLC starts."""

    def __init__(
        self,
        hli: Hli,
        image: InputImage,
        programs: Sequence[Program],
        entries: Sequence[tuple[int, int]],
    ) -> None:
        self._programs = programs
        self._rows = ffi.new("hs_task[]", len(entries))
        for row, (call, entry) in zip(self._rows, entries, strict=True):
            row.guarded = ffi.cast("int32_t (*)(void (*)(void), int64_t)", call)
            row.entry = ffi.cast("void (*)(void)", entry)
        self._scans = ffi.new("hs_scans *")
        scans, plc = self._scans, layout.HLI_SIDE_PLC
        scans.image = image.now
        scans.scans_at = hli.plc._pointer(plc.scans.offset)
        scans.heartbeat_at = hli.plc._pointer(plc.heartbeat.offset)
        scans.mine = word_pointer(hli.root, "plc_turn")
        scans.others = word_pointer(hli.root, "cnc_turn")
        scans.tasks, scans.count = self._rows, len(entries)
        scans.slice_ns = SLICE_OF_SCANS_NS
        scans.spin_ns, scans.timeout_ns = SPIN_NS, SLICE_NS

    def run(self, loop: Callable[[Any], int] = lib.hs_scan_tasks) -> int:
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

    @property
    def trapped(self) -> Program:
        """The task that its trap has stopped."""
        number: int = self._scans.trapped
        return self._programs[number]


def _note(row: Any, program: Program) -> None:
    """The statistics of the scans in C go to those of the task."""
    program.due, program.started_ns = row.due, row.started_ns
    program.jitter_ns = row.jitter_ns
    program.overruns += row.missed
    if row.scans:
        times = (row.scans, row.total_ns, row.shortest_ns, row.longest_ns)
        program.times.add_many(*times)
