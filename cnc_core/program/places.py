"""Places in program files, and the rows ahead of a wrong one."""

from __future__ import annotations

from pathlib import Path

from ..blocks import BlockBatch
from ..errors import CncError, Place
from ..files import open_regular
from ..geometry.stages.stage import RefusedRow


def source_place(path: Path, line: int) -> Place:
    """Place of a line of a program file, with its text."""
    text = ""
    try:
        with open_regular(path) as file:
            for number, raw in enumerate(file, 1):
                if number == line:
                    text = raw.decode("latin-1").rstrip("\r\n")
                    break
    except (CncError, OSError):
        pass
    return Place(str(path), line, 1, text)


def whole_blocks(refused: RefusedRow) -> BlockBatch:
    """The rows ahead of a refused one, without those of its own block."""
    rows, keep = refused.ahead.rows, len(refused.ahead.rows)
    name, wanted = (
        ("count", refused.count)
        if refused.count
        else ("line", refused.error.place.line)
    )
    while keep and rows[name][keep - 1] == wanted:
        keep -= 1
    return BlockBatch(rows[:keep], refused.ahead.pool)
