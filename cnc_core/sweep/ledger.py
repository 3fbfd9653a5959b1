"""What is complete, in a file that survives whatever ends the sweep.

SQLite keeps it.  A run is complete when its row is in the ledger.  A worker
leaves a row as a file first, whole or not at all; a sweep that goes on takes
such files over.
"""

from __future__ import annotations

import json
import os
import sqlite3
from pathlib import Path
from typing import Any

from ..errors import CncError, Place

LEDGER = "ledger.sqlite"
ROWS = "rows"
TABLES = """
CREATE TABLE IF NOT EXISTS study (key TEXT PRIMARY KEY, value TEXT NOT NULL);
CREATE TABLE IF NOT EXISTS runs (
    number INTEGER PRIMARY KEY,
    complete_at TEXT NOT NULL DEFAULT (datetime('now')),
    row TEXT NOT NULL
);
"""


class Ledger:
    """The rows of one output folder."""

    def __init__(self, folder: Path) -> None:
        self._rows = folder / ROWS
        self._rows.mkdir(parents=True, exist_ok=True)
        self._file = folder / LEDGER
        try:
            self._base = sqlite3.connect(self._file, isolation_level=None)
            self._base.execute("PRAGMA journal_mode=WAL")
            self._base.execute("PRAGMA synchronous=FULL")
            self._base.executescript(TABLES)
        except sqlite3.DatabaseError as error:
            raise self._failed(error) from None

    def close(self) -> None:
        self._base.close()

    @property
    def fingerprint(self) -> str | None:
        """Of the study that began this folder."""
        found = self._base.execute(
            "SELECT value FROM study WHERE key = 'fingerprint'"
        ).fetchone()
        return found[0] if found else None

    def begin(self, fingerprint: str) -> None:
        self._write(
            "INSERT INTO study VALUES ('fingerprint', ?)", (fingerprint,)
        )

    def rows(self) -> dict[int, dict[str, Any]]:
        """Every complete row by its number."""
        found = self._base.execute("SELECT number, row FROM runs")
        return {number: json.loads(row) for number, row in found}

    def take_over(self) -> None:
        """Rows that a worker has left and nobody has entered; what is no row
        is dropped: its run is made again.
        """
        for file in sorted(self._rows.glob("*.json")):
            try:
                self.enter(int(file.stem))
            except ValueError:  # no number, or no JSON: of a machine that died
                file.unlink()

    def enter(self, number: int) -> None:
        """The row that a worker has left becomes complete."""
        file = row_file(self._rows.parent, number)
        self.keep(number, json.loads(file.read_text()))
        file.unlink()

    def keep(self, number: int, row: dict[str, Any]) -> None:
        self._write(
            "INSERT OR REPLACE INTO runs (number, row) VALUES (?, ?)",
            (number, json.dumps(row)),
        )

    def _write(self, text: str, values: tuple[Any, ...]) -> None:
        try:
            self._base.execute(text, values)
        except sqlite3.DatabaseError as error:
            raise self._failed(error) from None

    def _failed(self, error: Exception) -> CncError:
        return CncError(901004, f"ledger: {error}", Place(str(self._file)))


def row_file(folder: Path, number: int) -> Path:
    return folder / ROWS / f"{number:07d}.json"


def leave(folder: Path, number: int, row: dict[str, Any]) -> None:
    """A row as a file, whole or not at all.  OSError: it cannot be written."""
    file = row_file(folder, number)
    part = file.with_suffix(f".{os.getpid()}.part")
    try:
        with part.open("w") as out:
            json.dump(row, out)
            out.flush()
            os.fsync(out.fileno())
        part.replace(file)
    except OSError:
        part.unlink(missing_ok=True)
        raise
