"""Which program file a cell executes, and with which configuration."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

from ..config import load_config, setups_of
from ..errors import CncError

PROC = Path("/proc")


@dataclass(frozen=True)
class Source:
    """A program and the configuration it is read with; None: the built-in one.

    ``channel``: whose program it is.
    """

    program: Path
    config: Path | None = None
    dialect: str | None = None
    channel: int = 0


def source_of(pid: int, name: str, channel: int = 0) -> Source | None:
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
            return _from_options(word, name, channel)
    config = _behind(words, "--config") or _behind(words, "--cell")
    given = [folder / word for word in words if Path(word).name == name]
    cell = folder / config if config else None
    program = _found(name, given, cell, channel)
    if program is None:
        return None
    return Source(program, cell, _behind(words, "--dialect"), channel)


def _found(
    name: str, given: list[Path], cell: Path | None, channel: int
) -> Path | None:
    """The file of a program: one of those given, or that of the channel's table
    in the cell file, or one beside the cell file.
    """
    if not name:
        return None
    places = [*given]
    if cell is not None:
        places += [_of_table(cell, channel), cell.parent / name]
    return next((p for p in places if p.name == name and p.is_file()), None)


def _of_table(cell: Path, channel: int) -> Path:
    """The program that the cell file names for a channel."""
    try:
        setups = setups_of(load_config(cell))
        return cell.parent / setups[channel].program
    except (CncError, OSError, ValueError, IndexError):
        return cell


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


def _from_options(text: str, name: str, channel: int = 0) -> Source | None:
    """From the options that a launcher gives its CNC process."""
    try:
        options = json.loads(text)
        files = [options["file"], *options.get("more", ())]
        given = [Path(file) for file in files if file is not None]
        config = options.get("config")
        dialect = options.get("run", {}).get("dialect")
    except (ValueError, KeyError, TypeError, AttributeError):
        return None
    cell = Path(config) if config else None
    named = [path for path in given if path.name == name]
    program = _found(name, named, cell, channel)
    return Source(program, cell, dialect, channel) if program else None
