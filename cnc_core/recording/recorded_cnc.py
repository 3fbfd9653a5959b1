"""A recorded CNC: the memory of a run as the PLC found it, scan by scan.

Words that the CNC changed go into a segment ahead of each scan.  What the PLC
of the recorded run wrote is kept beside it, to compare with.
"""

from __future__ import annotations

import ctypes
import os
import secrets
from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from hli._sync import ffi, lib

from hli import layout, segment
from hli.areas import Areas
from hli.export import layout_hash
from hli.members import plc_bytes

from ..errors import CncError
from .reading import Recording

Values = npt.NDArray[np.uint64]
_apply, _differing = lib.hs_trace_apply, lib.hs_trace_differing
GAP = 8  # words between two runs that are compared as one


class Changes(NamedTuple):
    """Words of the memory that changed: C pointers to their numbers and values,
    how many, and what keeps both alive.
    """

    words: Any
    values: Any
    number: int
    held: Any


class Scan(NamedTuple):
    """One scan of the recorded PLC: what the CNC changed ahead of it, what the
    PLC changed in it, the watched symbols at its end.
    """

    number: int
    cycle: int
    time_s: float
    came: list[Changes]
    wrote: list[Changes]
    watched: tuple[float, ...]


def scans_of(recording: Recording) -> Iterator[Scan]:
    """All scans in order, ``setup()`` first; memory for a chunk of the tables.

    Of a recording that was cut, the scans whose changes are whole.
    """
    changes = _changes(recording)
    key, part = next(changes, _END)
    for number, cycle, time_s, *watched in _times(recording):
        found: tuple[list[Changes], list[Changes]] = ([], [])
        while key >> 1 <= number:
            found[key & 1].append(part)
            key, part = next(changes, _END)
        if part is None and not recording.complete:
            return
        yield Scan(number, cycle, time_s, *found, tuple(watched))


_END: tuple[int, Any] = (1 << 62, None)


def symbols_of(recording: Recording) -> tuple[str, ...]:
    """The watched symbols."""
    return tuple(
        name
        for name in recording.plc.columns
        if name not in ("cycle", "t", "scan")
    )


def _times(recording: Recording) -> Iterator[tuple[Any, ...]]:
    """Scan, cycle, time and symbols; ahead of the first scan ``setup()``."""
    columns = ["scan", "cycle", "t", *symbols_of(recording)]
    first = True
    for chunk in recording.plc.chunks(columns):
        rows = zip(
            *(column.to_pylist() for column in chunk.columns), strict=True
        )
        for row in rows:
            if first:
                yield (0, *row[1:3])
                first = False
            yield row


def _changes(recording: Recording) -> Iterator[tuple[int, Changes]]:
    """Twice the scan, 1 more where the PLC wrote them; and the words."""
    for chunk in recording.exchange.chunks(["scan", "by_plc", "word", "value"]):
        scan, by_plc, words, values = (
            chunk.column(i).to_numpy() for i in range(4)
        )
        key = scan.astype(np.int64) * 2 + by_plc
        ends = [*(np.flatnonzero(np.diff(key)) + 1).tolist(), len(key)]
        held = (
            np.ascontiguousarray(words, np.uint32),
            np.ascontiguousarray(values, np.uint64),
        )
        at = _pointer("uint32_t *", held[0])
        value = _pointer("uint64_t *", held[1])
        begin = 0
        for head, end in zip(
            key[np.array(ends) - 1].tolist(), ends, strict=True
        ):
            yield head, Changes(at + begin, value + begin, end - begin, held)
            begin = end


def no_scans(recording: Recording) -> CncError:
    """The error for a recording without a PLC."""
    return CncError(
        901002,
        f"{recording.path}: it holds no scans of a PLC to replay"
        " (recorded without a PLC, without the table exchange, or by"
        " an older version)",
    )


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
        self._recorded = _pointer("uint64_t *", self.recorded)
        # where the CNC runs on while the PLC scans, nobody knows what a member
        # that both write was at the scan's end
        self.masks: Values = plc_bytes(shared=self.lockstep).view(np.uint64)
        self._masks = _pointer("uint64_t *", self.masks)
        runs = _runs(self.masks, self.areas)
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

    def _identify(self, about: dict[str, Any]) -> None:
        side, plc = self.areas.sidecar.cnc, self.areas.sidecar.plc
        side.pid, side.start = os.getpid(), lib.hs_process_start(os.getpid())
        side.cycle_ns, side.generation = about["cycle_ns"], 1
        side.clock = layout.HLI_CLOCK_LOCKSTEP
        # the queue's slots carry it
        plc.generation = (int(about["generation"]) - 1) & 0xFFFFFFFF

    def begin(self, scan: Scan) -> None:
        """What the CNC changed ahead of this scan; the clock stands at it."""
        self._apply(scan.came, self._memory)
        side = self._side
        side.cycle, side.cell_time_ns = scan.cycle, round(scan.time_s * 1e9)
        if not self._published:
            self._published = True
            self.segment.publish()

    def end(self, scan: Scan) -> list[int]:
        """Words that the recorded PLC left otherwise than the memory has them."""
        self._apply(scan.wrote, ffi.NULL)
        count = _differing(*self._compared)
        return list(self._found[0:count]) if count else []

    def _apply(self, changes: list[Changes], memory: Any) -> None:
        for words, values, count, _ in changes:
            _apply(memory, self._recorded, words, values, count)

    def values(self, words: list[int]) -> tuple[Any, ...]:
        """The words, what was recorded there, and what is there now."""
        old, new = self._recorded, self._memory
        return words, [old[i] for i in words], [new[i] for i in words]

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


def _pointer(kind: str, array: npt.NDArray[Any]) -> Any:
    return ffi.cast(kind, array.ctypes.data)


def _runs(masks: Values, areas: Areas) -> list[int]:
    """First word and length of the stretches of configured areas that a PLC
    writes; small gaps are left in.
    """
    base = areas.root._address
    views = [
        areas.gpPform,
        *areas.gpCh[: areas.gNrCh],
        *areas.gpAx[: areas.gNrAx],
        *areas.gpVECh[: areas.gNrCh],
        areas.gpVEGlobal,
        *areas.gpAhead[: min(areas.gNrCh, len(areas.root.ahead))],
    ]
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
