"""Program levels: subroutines, macros, imported files, and the way back to the
last tool.
"""

from __future__ import annotations

import copy
from dataclasses import dataclass, field
from pathlib import Path

from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.flow import START, Level, Mark
from cnc_core.frontend.base.lexer import fail

from ..base.store import UserScope
from ..motion.selections import check_tool
from .program import Program

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


def data_of(program: Program) -> LevelData:
    """Of the innermost level."""
    data: LevelData = program.flow.level.user
    return data


def dimension(program: Program, name: str, size: float, offset: int) -> None:
    """DIM, which may be in a LOOP: here or where subroutines were called from."""
    scope = program.store.scope
    looped = any(
        level.nest for level in program.flow.levels if level.user.scope is scope
    )
    place = (program.flow.file.number, program.modal.line)
    program.store.dimension(name, size, place, offset, looped=looped)


def call(
    program: Program,
    kind: str,
    path: Path | None,
    mark: Mark,
    data: LevelData,
    offset: int,
) -> None:
    file = program.flow.file if path is None else program.flow.file_of(path)
    try:
        program.flow.call(Level(file, mark, kind, user=data))
    except CncError as error:
        error.place.column = error.place.column or offset
        raise


def call_subroutine(program: Program, name: str, offset: int) -> None:
    """GOSUB."""
    mark = program.control.target(name)
    if mark is None:
        return
    call(
        program,
        SUBROUTINE,
        None,
        mark,
        LevelData(SUBROUTINE, program.store.scope),
        offset,
    )


def return_from_subroutine(program: Program, offset: int) -> None:
    if data_of(program).kind != SUBROUTINE:
        raise fail(909123, "RETURN without GOSUB", offset)
    program.flow.leave()


def resume_tool(program: Program, number: float, offset: int) -> None:
    """RESUME_T: back to the block of the last T, which then takes another tool;
    out of macros too.
    """
    if (
        program.tool_place is None
        or len(program.flow.levels) < program.tool_place[0]
    ):
        raise fail(909172, ERRORS[909172], offset)
    check_tool(program.channel, number, offset)
    levels, mark, nest = program.tool_place
    del program.flow.levels[levels:]
    program.flow.level = program.flow.levels[-1]
    program.flow.level.nest[:] = copy.deepcopy(nest)
    program.channel.tool_instead = int(number)
    program.revive()
    program.flow.jump(mark)


def call_import(program: Program, name: str, offset: int) -> None:
    path = program.macros.imported(name, program.flow.file.path, offset)
    program.port.message(f"StartImport {name}")
    call(
        program,
        IMPORTED,
        path,
        START,
        LevelData(IMPORTED, program.store.scope),
        offset,
    )


def end_import(program: Program, offset: int) -> None:
    if data_of(program).kind != IMPORTED:
        raise fail(909123, "END_IMPORT outside an imported file", offset)
    program.flow.leave()


def call_macro(
    program: Program,
    kind: str,
    number: int,
    arguments: list[float],
    offset: int,
) -> None:
    path = program.macros.find(kind, number)
    if path is None:
        raise fail(
            909124,
            f"macro {kind}{number} not found beside the program or in the macro folder",
            offset,
        )
    call(
        program,
        MACRO,
        path,
        START,
        LevelData(MACRO, UserScope(), arguments),
        offset,
    )


def macro_arguments(program: Program, offset: int) -> list[float]:
    """Arguments of the innermost macro that have not been taken."""
    for level in reversed(program.flow.levels):
        if level.user.kind == MACRO:
            arguments: list[float] = level.user.arguments
            return arguments
    raise fail(909121, "GET outside an HM macro", offset)
