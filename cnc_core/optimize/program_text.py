"""The lines of a program of points: subprograms, profiles, points."""

from __future__ import annotations

import re
from pathlib import Path

BEGIN = re.compile(r"^\s*(?:N\d+\s*)?G61\b")
END = re.compile(r"^\s*(?:N\d+\s*)?G60\b")
SETUP_LINE = re.compile(r"^\s*(?:N\d+\s*)?\(\s*HSM\s*,")
CALL = re.compile(r"^\s*(?:N\d+\s*)?\(\s*CLS\s*,\s*([^)]*?)\s*\)\s*(?:;.*)?$")
POINT = re.compile(
    r"^\s*(?:N\d+\s*)?(?:G0?[01](?!\d)\s*|G9[01]\s*)*[A-Zijkmnopqd]\s*[+-]?[\d.EL]"
)
OTHER_WORD = re.compile(r"[STM]\s*\d")
CALLS_MAX = 20
SUFFIXES = ("", ".osai", ".hsm", ".nc", ".txt")


def expanded(
    path: Path, folder: Path | None = None, depth: int = 0
) -> list[str]:
    """The lines of a program with those of its subprograms (CLS) in their
    place; missing ones are the reader's.
    """
    folder = folder or path.parent
    out: list[str] = []
    for line in path.read_text(encoding="utf-8", errors="replace").splitlines():
        called = CALL.match(line)
        names = (
            [folder / (called[1] + suffix) for suffix in SUFFIXES]
            if called
            else []
        )
        found = next((p for p in names if p.is_file()), None)
        if found is None or depth >= CALLS_MAX:
            out.append(line)
        else:
            out += expanded(found, folder, depth + 1)
    return out


def middle(lines: list[str]) -> tuple[int | None, int]:
    """First line of points, and the first line behind the last one."""
    found = [
        i
        for i, line in enumerate(lines)
        if POINT.match(line.partition(";")[0])
        and not OTHER_WORD.search(line.partition(";")[0])
        and not line.lstrip().startswith("F")
    ]
    return (found[0], found[-1] + 1) if found else (None, 0)
