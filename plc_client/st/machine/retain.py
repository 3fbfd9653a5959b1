"""RETAIN and PERSISTENT variables in a file, by path, type and bytes."""

from __future__ import annotations

import atexit
import hashlib
import json
import os
import weakref
from pathlib import Path
from typing import Any

from .loader import StProgram


def retain_file(path: str) -> Path:
    """``HLI_COSIM_RETAIN``, else a file of the user's state folder."""
    own = os.environ.get("HLI_COSIM_RETAIN")
    if own:
        return Path(own)
    base = os.environ.get("XDG_STATE_HOME")
    folder = Path(base) if base else Path.home() / ".local" / "state"
    digest = hashlib.sha256(path.encode()).hexdigest()[:12]
    return folder / "hli-cosim" / f"{Path(path).stem}-{digest}.json"


class Retained:
    """Saves at the end and loads at the start; unknown or changed types are left out."""

    def __init__(self, path: str, program: StProgram) -> None:
        self._program = program
        self._rows: list[Any] = program.description["retained"]
        self._file = retain_file(path)
        self._started = False
        if self._rows:
            weak = weakref.ref(self)
            atexit.register(lambda: _save_alive(weak))

    def load(self) -> None:
        """Put the saved bytes back."""
        self._started = True
        if not self._rows or not self._file.exists():
            return
        try:
            saved = json.loads(self._file.read_text())
        except ValueError:
            return
        for path, at, size, _, kind in self._rows:
            row = saved.get(path)
            if row is None or row[0] != kind or len(row[1]) != 2 * size:
                continue
            data = bytes.fromhex(row[1])
            self._program.memory.bytes[at : at + size] = data

    def save(self) -> None:
        """Write the file beside its name, then rename."""
        if not self._rows or not self._started:
            return
        content = {
            path: [
                kind,
                bytes(self._program.memory.bytes[at : at + size]).hex(),
            ]
            for path, at, size, _, kind in self._rows
        }
        self._file.parent.mkdir(parents=True, exist_ok=True)
        part = self._file.with_suffix(f".{os.getpid()}.part")
        part.write_text(json.dumps(content))
        part.replace(self._file)


def _save_alive(weak: weakref.ref[Retained]) -> None:
    found = weak()
    if found is not None:
        found.save()
