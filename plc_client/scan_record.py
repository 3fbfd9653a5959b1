"""The PLC's part of a recording: watched symbols at every scan, and what CNC
and PLC changed in the memory.

A scan keeps its numbers in memory.  A thread writes them, so that no scan waits
for a disk.
"""

from __future__ import annotations

import hashlib
import json
import queue
import threading
from array import array
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from hli.export import layout_hash
from hli.part_file import PartFile

from .client import Hli
from .memory_trace import MemoryTrace

ROWS = 512  # scans of a batch
BATCHES = 256  # that may wait for the disk
_END = None
Batch = dict[str, dict[str, Any]]
TABLES = ("plc", "exchange")
EXCHANGE = {
    "cycle": "uint64",
    "scan": "uint64",
    "by_plc": "bool",
    "word": "uint32",
    "value": "uint64",
}


class ScanRecord:
    """Writes one row a scan: cycle, time in s, number of the scan, symbols; and
    the words of the memory that changed.

    ``trace``: where the changes come from, None: they are not recorded.
    ``about``: what the recording's account says of the PLC.
    ``waits``: a scan waits for a slow disk (virtual time).
    ``lost``: rows that are not in the file, by table.
    """

    def __init__(
        self,
        path: Path,
        symbols: Sequence[str],
        about: dict[str, Any],
        trace: MemoryTrace | None = None,
        waits: bool = False,
    ) -> None:
        types = {"cycle": "uint64", "t": "double", "scan": "uint64"}
        types |= dict.fromkeys(symbols, "double")
        tables = {"plc": types}
        if trace is not None:
            tables["exchange"] = EXCHANGE
        units = {name: dict.fromkeys(tables[name], "") for name in tables}
        units["plc"]["t"] = "s"
        meta = json.dumps({"columns": units, **about}).encode()
        self._symbols = tuple(symbols)
        self._trace, self._waits = trace, waits
        self._broken: Exception | None = None
        self._file = PartFile(path, tables, meta)
        self._rows = self._empty()
        self._changes = _Changes()
        self.scan = 0  # number of the last scan; 0: setup()
        self._full: queue.Queue[Batch | None] = queue.Queue(BATCHES)
        self.lost: dict[str, int] = {}
        self._thread = threading.Thread(
            target=self._write, name="scan record", daemon=True
        )
        self._thread.start()

    def _empty(self) -> dict[str, array[Any]]:
        rows: dict[str, array[Any]] = {
            "cycle": array("Q"),
            "t": array("d"),
            "scan": array("Q"),
        }
        for name in self._symbols:
            rows[name] = array("d")
        return rows

    def look(self, cycle: int, by_plc: bool) -> None:
        """Note what changed since the last look, for the scan of this cycle."""
        if self._trace is not None:
            self._changes.add(cycle, self.scan, by_plc, *self._trace.look())

    def add(self, cycle: int, time_s: float, values: Sequence[float]) -> None:
        """One scan; what the disk cannot take in time counts as lost."""
        rows = self._rows
        rows["cycle"].append(cycle)
        rows["t"].append(time_s)
        rows["scan"].append(self.scan)
        for name, value in zip(self._symbols, values, strict=True):
            rows[name].append(value)

    def end_scan(self, cycle: int) -> None:
        """The last thing of a scan: what the PLC wrote."""
        self.look(cycle, True)
        if len(self._rows["cycle"]) >= ROWS or self._changes.many:
            self._hand_over()

    def _hand_over(self) -> None:
        batch: Batch = {"plc": self._rows}
        if self._changes.any:
            batch["exchange"] = self._changes.columns()
        self._rows, self._changes = self._empty(), _Changes()
        try:
            self._full.put(batch, block=self._waits)
        except queue.Full:
            self._lose(batch)

    def close(self) -> None:
        """Write the rest."""
        self._hand_over()
        self._full.put(_END)
        self._thread.join()
        self._file.close()

    @property
    def problem(self) -> str:
        """Why rows could not be written, empty if nothing was wrong."""
        error = self._file.problem
        if error:
            return error.strerror or str(error)
        return repr(self._broken) if self._broken else ""

    def _write(self) -> None:
        while (batch := self._full.get()) is not _END:
            if not self._written(batch):
                self._lose(batch)

    def _written(self, batch: Batch) -> bool:
        rows = {
            name: columns
            for name, columns in batch.items()
            if len(columns["cycle"])
        }
        try:
            return not rows or self._file.add(rows)
        except Exception as error:
            self._broken = self._broken or error
            return False

    def _lose(self, batch: Batch) -> None:
        for table, columns in batch.items():
            if len(columns["cycle"]):
                before = self.lost.get(table, 0)
                self.lost[table] = before + len(columns["cycle"])


class _Changes:
    """Changes of the memory that are not handed over yet."""

    def __init__(self) -> None:
        self._at, self._values = bytearray(), bytearray()
        self._looks: list[tuple[int, int, bool, int]] = []

    def add(
        self,
        cycle: int,
        scan: int,
        by_plc: bool,
        count: int,
        at: bytes,
        values: bytes,
    ) -> None:
        if count:
            self._looks.append((cycle, scan, by_plc, count))
            self._at += at
            self._values += values

    @property
    def any(self) -> bool:
        return bool(self._looks)

    @property
    def many(self) -> bool:
        return len(self._values) > _MANY_BYTES

    def columns(self) -> dict[str, Any]:
        cycle, scan, by_plc, count = zip(*self._looks, strict=True)
        return {
            "cycle": np.repeat(np.array(cycle, np.uint64), count),
            "scan": np.repeat(np.array(scan, np.uint64), count),
            "by_plc": np.repeat(np.array(by_plc, bool), count),
            "word": np.frombuffer(bytes(self._at), np.uint32),
            "value": np.frombuffer(bytes(self._values), np.uint64),
        }


_MANY_BYTES = 1 << 18


def missing_rows(record: ScanRecord) -> dict[str, Any]:
    """What is missing in the PLC's part, and why."""
    return {"lost": record.lost, "problem": record.problem}


def memory_of(hli: Hli) -> dict[str, Any]:
    """What a replay needs to know of the segment."""
    return {
        "layout": layout_hash().hex(),
        "channels": hli.gNrCh,
        "axes": hli.gNrAx,
        "generation": int(hli.plc.generation),
        "cycle_ns": int(hli.cnc.cycle_ns),
    }


def program_of(file: str | None, name: str) -> dict[str, Any]:
    """Name and hash of a PLC program; a folder and a built-in one have a name
    alone.
    """
    path = Path(file) if file else None
    if path is None or not path.is_file():
        return {"file": path.name if path else f"builtin:{name}"}
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return {"file": path.name, "sha256": digest}
