"""Program levels: subroutines, macros, imported files, and the way back to the
last tool.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING

from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.flow import START, Level, Mark
from cnc_core.frontend.base.lexer import fail

from ..base.store import UserScope
from ..motion.selections import check_tool

if TYPE_CHECKING:
    from ..front_end import IsonsFrontEnd

MAIN, SUBROUTINE, MACRO, IMPORTED = "program", "GOSUB", "macro", "IMPORT"


@dataclass
class LevelData:
    """What the dialect keeps with a program level.

    ``arguments``: of an HM call, taken from the end.
    """

    kind: str
    scope: UserScope
    arguments: list[float] = field(default_factory=list)
    degrees: bool = False


def call(
    reader: IsonsFrontEnd,
    kind: str,
    path: Path | None,
    mark: Mark,
    data: LevelData,
    offset: int,
) -> None:
    file = reader.flow.file if path is None else reader.flow.file_of(path)
    try:
        reader.flow.call(Level(file, mark, kind, user=data))
    except CncError as error:
        error.place.column = error.place.column or offset
        raise


def call_subroutine(reader: IsonsFrontEnd, name: str, offset: int) -> None:
    """GOSUB."""
    mark = reader.control.target(name, offset)
    call(
        reader,
        SUBROUTINE,
        None,
        mark,
        LevelData(SUBROUTINE, reader.store.scope),
        offset,
    )


def return_from_subroutine(reader: IsonsFrontEnd, offset: int) -> None:
    if reader._data.kind != SUBROUTINE:
        raise fail(909123, "RETURN without GOSUB", offset)
    reader.flow.leave()


def resume_tool(reader: IsonsFrontEnd, number: float, offset: int) -> None:
    """RESUME_T: back to the block of the last T, which then takes another tool;
    out of macros too.
    """
    if (
        reader.tool_place is None
        or len(reader.flow.levels) < reader.tool_place[0]
    ):
        raise fail(909172, ERRORS[909172], offset)
    check_tool(reader.executor, number, offset)
    levels, mark, nest = reader.tool_place
    del reader.flow.levels[levels:]
    reader.flow.level = reader.flow.levels[-1]
    reader.flow.level.nest[:] = copy.deepcopy(nest)
    reader.executor.tool_instead = int(number)
    reader._closing, reader._failed = False, None
    reader.flow.jump(mark)


def call_import(reader: IsonsFrontEnd, name: str, offset: int) -> None:
    path = reader.macros.imported(name, reader.flow.file.path, offset)
    reader.port.message(f"StartImport {name}")
    call(
        reader,
        IMPORTED,
        path,
        START,
        LevelData(IMPORTED, reader.store.scope),
        offset,
    )


def end_import(reader: IsonsFrontEnd, offset: int) -> None:
    if reader._data.kind != IMPORTED:
        raise fail(909123, "END_IMPORT outside an imported file", offset)
    reader.flow.leave()


def call_macro(
    reader: IsonsFrontEnd,
    kind: str,
    number: int,
    arguments: list[float],
    offset: int,
) -> None:
    path = reader.macros.find(kind, number)
    if path is None:
        raise fail(
            909124,
            f"macro {kind}{number} not found beside the program or in the macro folder",
            offset,
        )
    call(
        reader,
        MACRO,
        path,
        START,
        LevelData(MACRO, UserScope(), arguments),
        offset,
    )


def macro_arguments(reader: IsonsFrontEnd, offset: int) -> list[float]:
    """Arguments of the innermost macro that have not been taken."""
    for level in reversed(reader.flow.levels):
        if level.user.kind == MACRO:
            arguments: list[float] = level.user.arguments
            return arguments
    raise fail(909121, "GET outside an HM macro", offset)
