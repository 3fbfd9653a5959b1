"""A recorded CNC: the memory of a run as the PLC found it, scan by scan.

Words that the CNC changed go into a segment ahead of each scan.  What the PLC
of the recorded run wrote is kept beside it, to compare with.
"""

from __future__ import annotations

import ctypes
import os
import secrets
from collections.abc import Sequence
from typing import Any

import numpy as np
from hli._sync import ffi, lib

from hli import layout, segment
from hli.areas import Areas
from hli.export import layout_hash
from hli.members import plc_bytes
from hli.view import View, root_of

from ..errors import CncError
from .reading import Recording
from .recorded_scans import Batch, Scan, Values, pointer

_apply, _differing = lib.hs_trace_apply, lib.hs_trace_differing
GAP = 8  # words between two runs that are compared as one


def no_scans(recording: Recording) -> CncError:
    """The error for a recording without a PLC."""
    return CncError(
        901002,
        f"{recording.path}: it holds no scans of a PLC to replay"
        " (recorded without a PLC, without the table exchange, or by"
        " an older version)",
    )


class Difference:
    """Words that differ, as C has them: as recorded and as they are."""

    def __init__(
        self, words: Sequence[int], old: Sequence[int], new: Sequence[int]
    ) -> None:
        self._content = list(words), list(old), list(new)
        self.words = ffi.new("uint32_t[]", self._content[0])
        self.old = ffi.new("uint64_t[]", self._content[1])
        self.new = ffi.new("uint64_t[]", self._content[2])

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Difference) and self._content == other._content

    __hash__ = None  # type: ignore[assignment]


def seek(row: Any, batch: Batch, scan: int) -> None:
    """The next scan of ``hs_replay``."""
    row.next = scan
    row.row = int(batch.ends[2 * scan - 1]) if scan else 0


def know(row: Any, known: Difference) -> None:
    """What may differ in the scans of ``hs_replay``.  The caller keeps it."""
    row.known, row.known_count = known.words, len(known.words)
    row.old, row.new_ = known.old, known.new


class RecordedCnc:
    """The segment of a recorded run.  A context manager; ``close()`` removes it.

    CncError: the recording holds no scans, or they are of another layout.
    """

    def __init__(self, recording: Recording) -> None:
        about = recording.meta.get("memory")
        if not about or "exchange" not in recording.tables:
            raise no_scans(recording)
        if about["layout"] != layout_hash().hex():
            raise CncError(
                901002,
                f"{recording.path}: recorded with another layout of the HLI;"
                " replay it with the version that recorded it",
            )
        self.lockstep = recording.meta.get("clock", "lockstep") == "lockstep"
        self.name = f"hli-replay-{os.getpid()}-{secrets.token_hex(4)}"
        self.segment = segment.create(
            self.name, about["channels"], about["axes"], ready=False
        )
        self.areas = Areas(self.segment)
        self._identify(about)
        self._memory = ffi.cast("uint64_t *", self.segment.base)
        size = segment.SEGMENT_SIZE // 8
        self.recorded: Values = np.zeros(size, np.uint64)
        self._recorded = pointer("uint64_t *", self.recorded)
        # where the CNC runs on while the PLC scans, nobody knows what a member
        # that both write was at the scan's end
        self.masks: Values = plc_bytes(shared=self.lockstep).view(np.uint64)
        self._masks = pointer("uint64_t *", self.masks)
        runs = _runs(self.masks, _areas_of(self.areas))
        self._hot = len(runs) // 2
        self._external = _runs(self.masks, _external_of(self.areas))
        runs += self._external
        self._runs = ffi.new("uint32_t[]", runs)
        self._found = ffi.new("uint32_t[]", size)
        self._compared = (
            self._memory,
            self._recorded,
            self._masks,
            self._runs,
            len(runs) // 2,
            self._found,
        )
        self._side = self.areas.sidecar.cnc._c
        self._published = False
        self._all = False  # external variables are compared, too
        self._row: Any = None

    def _identify(self, about: dict[str, Any]) -> None:
        side, plc = self.areas.sidecar.cnc, self.areas.sidecar.plc
        side.pid, side.start = os.getpid(), lib.hs_process_start(os.getpid())
        side.cycle_ns, side.generation = about["cycle_ns"], 1
        side.clock = layout.HLI_CLOCK_LOCKSTEP
        # the queue's slots carry it
        plc.generation = (int(about["generation"]) - 1) & 0xFFFFFFFF

    def begin(self, scan: Scan) -> None:
        """What the CNC changed ahead of this scan; the clock stands at it."""
        _apply(self._memory, self._recorded, *scan.came)
        side = self._side
        side.cycle, side.cell_time_ns = scan.cycle, scan.cell_ns
        if not self._published:
            self._published = True
            self.segment.publish()

    def end(self, scan: Scan) -> list[int]:
        """Words that the recorded PLC left otherwise than the memory has them."""
        _apply(ffi.NULL, self._recorded, *scan.wrote)
        count = _differing(*self._compared)
        return list(self._found[0:count]) if count else []

    def compare_external(self) -> None:
        """From now on external variables are compared in every scan.  They are
        nine tenths of what a PLC may write; most PLCs use none.
        """
        self._all = True
        if self._row is not None:
            self._row.run_count = self._compared[4]

    def _uses_external(self, batch: Batch) -> bool:
        """Whether the recorded run changed external variables in these scans."""
        firsts, counts = self._external[::2], self._external[1::2]
        return any(
            bool(((batch.words >= first) & (batch.words < first + count)).any())
            for first, count in zip(firsts, counts, strict=True)
        )

    def rows(self, batch: Batch) -> Any:
        """``hs_replay`` for the scans of a batch; see ``seek`` and ``know``."""
        if not self._all and self._uses_external(batch):
            self.compare_external()
        memory, recorded, masks, runs, run_count, found = self._compared
        side = self.areas.sidecar.cnc
        self._row = ffi.new(
            "hs_replay *",
            {
                "cycle_at": side._pointer(layout.HLI_SIDE_CNC.cycle.offset),
                "cell_time_at": side._pointer(
                    layout.HLI_SIDE_CNC.cell_time_ns.offset
                ),
                "memory": memory,
                "recorded": recorded,
                "masks": masks,
                "runs": runs,
                "run_count": run_count if self._all else self._hot,
                "found": found,
                "cycles": pointer("uint64_t *", batch.cycles),
                "cell_ns": pointer("int64_t *", batch.cell_ns),
                "ends": pointer("uint32_t *", batch.ends),
                "at": batch.at,
                "values": batch.values,
                "count": len(batch.cycles),
            },
        )
        return self._row

    def difference(self, words: list[int]) -> Difference:
        """The words, what was recorded there, and what is there now."""
        old, new = self._recorded, self._memory
        return Difference(
            words, [old[i] for i in words], [new[i] for i in words]
        )

    @property
    def bytes(self) -> memoryview:
        """The memory as it is."""
        return memoryview(ffi.buffer(self._memory, segment.SEGMENT_SIZE))

    def close(self) -> None:
        """Remove the segment."""
        self.areas.sidecar.cnc.phase = layout.HLI_PHASE_SHUTDOWN
        self.segment.close()
        self.segment.unlink()

    def __enter__(self) -> RecordedCnc:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()


def _areas_of(areas: Areas) -> list[View]:
    """The configured areas without external variables."""
    return [
        areas.gpPform,
        *areas.gpCh[: areas.gNrCh],
        *areas.gpAx[: areas.gNrAx],
        *areas.gpAhead[: min(areas.gNrCh, len(areas.root.ahead))],
    ]


def _external_of(areas: Areas) -> list[View]:
    """External variables."""
    return [*areas.gpVECh[: areas.gNrCh], areas.gpVEGlobal]


def _runs(masks: Values, views: Sequence[View]) -> list[int]:
    """First word and length of the stretches of these areas that a PLC writes;
    small gaps are left in.
    """
    base = root_of(views[0])._address
    found: list[int] = []
    for view in views:
        begin = (view._address - base) // 8
        end = begin + ctypes.sizeof(view._c) // 8
        at = np.flatnonzero(masks[begin:end]) + begin
        if not len(at):
            continue
        breaks = np.flatnonzero(np.diff(at) > GAP)
        firsts = at[[0, *(breaks + 1)]]
        lasts = at[[*breaks, len(at) - 1]]
        for first, last in zip(firsts.tolist(), lasts.tolist(), strict=True):
            found += [first, last - first + 1]
    return found
