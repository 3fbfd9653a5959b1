"""The PLC's part of a recording: watched symbols at every scan.

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

from hli.part_file import PartFile

ROWS = 512  # scans of a batch
BATCHES = 256  # that may wait for the disk
_END = None


class ScanRecord:
    """Writes one row a scan: cycle, time in s, number of the scan, symbols."""

    def __init__(
        self, path: Path, symbols: Sequence[str], plc: dict[str, Any]
    ) -> None:
        types = {"cycle": "uint64", "t": "double", "scan": "uint64"}
        types |= dict.fromkeys(symbols, "double")
        units = {"plc": dict.fromkeys(types, "") | {"t": "s"}}
        meta = json.dumps({"columns": units, "plc": plc}).encode()
        self._symbols = tuple(symbols)
        self._file = PartFile(path, {"plc": types}, meta)
        self._rows = self._empty()
        self._full: queue.Queue[dict[str, array[Any]] | None] = queue.Queue(
            BATCHES
        )
        self.lost = 0
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

    def add(
        self, cycle: int, time_s: float, scan: int, values: Sequence[float]
    ) -> None:
        """One scan; what the disk cannot take in time counts as lost."""
        rows = self._rows
        rows["cycle"].append(cycle)
        rows["t"].append(time_s)
        rows["scan"].append(scan)
        for name, value in zip(self._symbols, values, strict=True):
            rows[name].append(value)
        if len(rows["cycle"]) >= ROWS:
            self._hand_over()

    def _hand_over(self) -> None:
        rows, self._rows = self._rows, self._empty()
        try:
            self._full.put_nowait(rows)
        except queue.Full:
            self.lost += len(rows["cycle"])

    def close(self) -> None:
        """Write the rest."""
        self._hand_over()
        self._full.put(_END)
        self._thread.join()
        self._file.close()

    def _write(self) -> None:
        while (rows := self._full.get()) is not _END:
            count = len(rows["cycle"])
            if count and not self._file.add({"plc": rows}):
                self.lost += count


def program_of(file: str | None, name: str) -> dict[str, Any]:
    """Name and hash of a PLC program; a folder and a built-in one have a name
    alone.
    """
    path = Path(file) if file else None
    if path is None or not path.is_file():
        return {"file": path.name if path else f"builtin:{name}"}
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    return {"file": path.name, "sha256": digest}
