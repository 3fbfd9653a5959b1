"""From a path to units: by suffix, from a folder or a project."""

from __future__ import annotations

import codecs
import re
from collections.abc import Iterable
from pathlib import Path

from ...task import is_st
from ..errors import FILE, Log, Origin, Problem, StopHere
from .exports import SUFFIX as EXPORT
from .exports import refuse_foreign, without_lists
from .text import clean
from .units import Unit, split

__all__ = ["files_of", "is_st", "units_of"]
SUFFIXES = (".st", ".exp", ".tcpou", ".tcdut", ".tcgvl", ".tcio", ".xml")
"""Files that hold Structured Text."""
PROJECT = ".plcproj"
_NAMES = re.compile(
    r"\b(?:TYPE|FUNCTION|FUNCTION_BLOCK|PROGRAM|INTERFACE)\s+"
    r"(?:(?:PUBLIC|INTERNAL|ABSTRACT|FINAL)\s+)*([A-Za-z_]\w*)",
    re.I,
)


def files_of(path: Path, log: Log) -> list[Path]:
    """The source files behind a path, in a fixed order."""
    if path.is_dir():
        found = [p for p in path.rglob("*") if p.suffix.lower() in SUFFIXES]
        projects = sorted(path.rglob(f"*{PROJECT}"))
        if len(projects) == 1:
            return files_of(projects[0], log)
        return sorted(p for p in found if p.is_file())
    if path.suffix.lower() == PROJECT:
        return _project(path, log)
    return [path]


def _project(path: Path, log: Log) -> list[Path]:
    """The files a .plcproj compiles, and itself for the libraries it names."""
    from .twincat import project_files  # noqa: PLC0415

    return [*project_files(path, log), path]


def read(
    path: Path, log: Log, defines: Iterable[str], declared: frozenset[str]
) -> list[Unit]:
    """The units of one file."""
    text = text_of(path, log)
    if text is None:
        return []
    return units_of(str(path), text, log, defines, declared)


def units_of(
    name: str,
    text: str,
    log: Log,
    defines: Iterable[str] = (),
    declared: frozenset[str] = frozenset(),
) -> list[Unit]:
    """The units of a text; ``name`` is its file."""
    suffix = Path(name).suffix.lower()
    if suffix == PROJECT:
        return []
    if suffix in (".tcpou", ".tcdut", ".tcgvl", ".tcio"):
        from .twincat import twincat_units  # noqa: PLC0415

        return twincat_units(name, text, log, defines, declared)
    if suffix == ".xml":
        from .plcopen import plcopen_units  # noqa: PLC0415

        return plcopen_units(name, text, log, defines, declared)
    return plain_units(name, text, log, defines, declared)


def plain_units(
    name: str,
    text: str,
    log: Log,
    defines: Iterable[str],
    declared: frozenset[str],
) -> list[Unit]:
    """The units of a .st text."""
    origin = Origin(name, tuple(text.split("\n")))
    try:
        cleaned = clean(text, defines, declared)
    except StopHere as stop:
        log.error(origin, stop)
        return []
    if name.lower().endswith(EXPORT):
        cleaned = without_lists(cleaned)
    found = refuse_foreign(split(cleaned, origin, log), log)
    stem = re.sub(r"\W", "_", Path(name).stem)
    for unit in found:
        unit.namespace = stem
    return found


def text_of(path: Path, log: Log) -> str | None:
    """The text of a file: UTF-8, UTF-16, else Windows-1252."""
    try:
        data = path.read_bytes()
    except OSError as error:
        text = f"cannot be read: {error.strerror}"
        log.errors.append(Problem(FILE, text, str(path)))
        return None
    return _decoded(data).replace("\r\n", "\n").replace("\r", "\n")


def _decoded(data: bytes) -> str:
    if data.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        return data.decode("utf-16", errors="replace")
    if data[1:2] == b"\0" != data[:1]:
        return data.decode("utf-16-le", errors="replace")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        return data.decode("cp1252", errors="replace")


def declared_names(texts: Iterable[str]) -> frozenset[str]:
    """Names of types and POUs for ``{IF defined (type: X)}``, in capitals."""
    return frozenset(m.upper() for text in texts for m in declared(text))


def declared(text: str) -> list[str]:
    """Names of types and POUs as a text writes them."""
    return _NAMES.findall(text)
