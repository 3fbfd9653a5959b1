"""RETAIN and PERSISTENT variables in a file, by path, type and bytes."""

from __future__ import annotations

import atexit
import contextlib
import hashlib
import json
import os
import sys
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
        if not self._rows:
            return
        saved = self._saved()
        for path, at, size, _, kind in self._rows:
            row = saved.get(path)
            if row is None or row[0] != kind or len(row[1]) != size:
                continue
            self._program.memory.bytes[at : at + size] = row[1]

    def _saved(self) -> dict[str, tuple[str, bytes]]:
        """Type and bytes by path. A file that cannot be read is kept aside."""
        try:
            content = json.loads(self._file.read_text())
            return {
                str(path): (str(kind), bytes.fromhex(data))
                for path, (kind, data) in content.items()
            }
        except FileNotFoundError:
            return {}
        except OSError as error:
            self._tell(f"not read: {error.strerror}")
            return {}
        except (ValueError, TypeError, AttributeError):
            aside = self._file.with_suffix(".unreadable")
            with contextlib.suppress(OSError):
                self._file.replace(aside)
            self._tell(f"no retained values in it; it is now {aside.name}")
            return {}

    def _tell(self, text: str) -> None:
        text = f"warning: RETAIN variables: {self._file}: {text}"
        print(text, file=sys.stderr, flush=True)

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
        part = self._file.with_suffix(f".{os.getpid()}.part")
        try:
            self._file.parent.mkdir(parents=True, exist_ok=True)
            part.write_text(json.dumps(content))
            part.replace(self._file)
        except OSError as error:
            self._tell(f"not written, the values are lost: {error.strerror}")


def _save_alive(weak: weakref.ref[Retained]) -> None:
    found = weak()
    if found is not None:
        found.save()
