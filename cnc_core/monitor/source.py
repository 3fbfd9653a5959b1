"""Which program file a cell executes, and with which configuration."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

PROC = Path("/proc")


@dataclass(frozen=True)
class Source:
    """A program and the configuration it is read with; None: the built-in one."""

    program: Path
    config: Path | None = None
    dialect: str | None = None


def source_of(pid: int, name: str) -> Source | None:
    """What the command line of a CNC says of the program of this name.

    None: it says nothing, or the file is not there (any more).
    """
    try:
        words = _words(pid)
        folder = (PROC / str(pid) / "cwd").resolve()
    except OSError:
        return None
    for word in words:
        if word.startswith("{"):
            return _from_options(word, name)
    program = next((w for w in words if Path(w).name == name), None)
    if not name or program is None or not (folder / program).is_file():
        return None
    config = _behind(words, "--config") or _behind(words, "--cell")
    return Source(
        folder / program,
        folder / config if config else None,
        _behind(words, "--dialect"),
    )


def _words(pid: int) -> list[str]:
    raw = (PROC / str(pid) / "cmdline").read_bytes()
    return [word.decode(errors="replace") for word in raw.split(b"\0") if word]


def _behind(words: list[str], option: str) -> str | None:
    """The value of an option, ``--option value`` or ``--option=value``."""
    for i, word in enumerate(words):
        if word == option and i + 1 < len(words):
            return words[i + 1]
        if word.startswith(f"{option}="):
            return word.partition("=")[2]
    return None


def _from_options(text: str, name: str) -> Source | None:
    """From the options that a launcher gives its CNC process."""
    try:
        options = json.loads(text)
        program = Path(options["file"])
        config = options.get("config")
        dialect = options.get("run", {}).get("dialect")
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
    if program.name != name or not program.is_file():
        return None
    return Source(program, Path(config) if config else None, dialect)
