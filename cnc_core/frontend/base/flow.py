"""Program flow over source files: program levels, calls, returns and jumps.

There is no index of lines. A place is a ``Mark``: the bytes and the lines in
front of it. A jump seeks it. Blocks that are executed again keep their prepared
form in a bounded table of their file. Places that were searched for are kept in
a bounded table too: branches of conditions, labels, subprograms.

A program that is read once from top to bottom fills neither table. Its length
does not matter.
"""

from __future__ import annotations

from collections.abc import Hashable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

from cnc_core.errors import CncError
from cnc_core.files import Folders
from cnc_core.frontend.base.source import Source

FILES_OPEN = 16  # subprogram files kept open for the next call
BLOCKS_KEPT = 20_000  # prepared blocks of one file
PLACES_KEPT = 20_000  # found places of one file
# levels in each other that have run before: what they call is a repetition
AGAIN_IN_EACH_OTHER = 2


class Mark(NamedTuple):
    """A place in front of a physical line: bytes and physical lines of the file
    before it.
    """

    position: int
    line: int


START = Mark(0, 0)


class ProgramFile:
    """One source file.  ``number``: its index in the program's file table.

    ``blocks``: prepared blocks by position.  ``places``: found places by
    whatever tells them apart.  ``folders``: where a called file may lie.
    """

    def __init__(
        self, path: Path, number: int, folders: Folders | None = None
    ) -> None:
        self.path, self.number = path, number
        self._folders = folders
        self.blocks: dict[int, Any] = {}
        self.places: dict[Hashable, Any] = {}
        self._source: Source | None = None

    @property
    def source(self) -> Source:
        if self._source is None:
            self._source = Source(self.path, folders=self._folders)
        return self._source

    @source.setter
    def source(self, source: Source) -> None:
        self._source = source

    def keep_block(self, position: int, block: Any) -> None:
        if len(self.blocks) >= BLOCKS_KEPT:
            self.blocks.clear()
        self.blocks[position] = block

    def keep_place(self, key: Hashable, place: Any) -> None:
        if len(self.places) >= PLACES_KEPT:
            self.places.clear()
        self.places[key] = place

    def close(self) -> None:
        if self._source is not None:
            self._source.close()
            self._source = None


@dataclass
class Level:
    """One program level: a main program or a subprogram that is being executed.

    ``start``: its beginning.  ``back``: the place where its caller goes on.
    ``nest``: open control statements, innermost last.
    ``user``: data of the dialect.
    ``repeats``: its blocks may come again.
    ``furthest``: the end of the last block that its run has reached.
    ``again``: the block that is executed was executed before, in this run of
    the level or in one of its callers.  ``called_again``: in one of its callers.
    ``entered_again``: how many of the level and its callers had run before.
    """

    file: ProgramFile
    start: Mark
    name: str = ""
    back: Mark = START
    nest: list[Any] = field(default_factory=list)
    repeats: bool = False
    furthest: int = 0
    again: bool = False
    called_again: bool = False
    entered_again: int = 0
    user: Any = None

    def reach(self, begin: int, end: int) -> None:
        """The block from ``begin`` to ``end`` is executed."""
        self.again = self.called_again or begin < self.furthest
        self.furthest = max(self.furthest, end)


class Flow:
    """The stack of program levels.

    A block asks for a jump, a call or a return while it is executed: ``jump``,
    ``skip``, ``call``, ``leave``.  ``apply`` makes it behind the block. One
    block asks for one of them at most.

    ``folders``: where called files may lie; a dialect adds those of the cell.
    ``levels_max``: levels, the main program included.
    ``too_deep``: error of one level more.
    """

    def __init__(self, path: Path, levels_max: int, too_deep: int) -> None:
        self.files: list[Path] = [path]
        self.folders = Folders(path.parent)
        self._known: dict[Path, ProgramFile] = {}
        self._levels_max, self._too_deep = levels_max, too_deep
        self.levels: list[Level] = [Level(self.file_of(path), START)]
        self.level = self.levels[0]
        self._entered: set[tuple[int, int]] = set()  # file and place of levels
        self._asked: tuple[str, Any] | None = None

    # files

    def file_of(self, path: Path) -> ProgramFile:
        """The file as it is known already, or a new entry of the file table."""
        known = self._known.get(path)
        if known is None:
            number = 0 if not self._known else len(self.files)
            if number:
                self.files.append(path)
            known = self._known[path] = ProgramFile(
                path, number, self.folders if number else None
            )
        return known

    @property
    def known_files(self) -> list[ProgramFile]:
        return list(self._known.values())

    @property
    def file(self) -> ProgramFile:
        return self.level.file

    @property
    def source(self) -> Source:
        return self.level.file.source

    def close(self) -> None:
        for file in self._known.values():
            file.close()

    # what a block may ask for

    @property
    def asked(self) -> bool:
        return self._asked is not None

    @property
    def ends(self) -> bool:
        """The block has asked to leave the level."""
        return self._asked is not None and self._asked[0] == "leave"

    def jump(self, mark: Mark) -> None:
        """Go on at ``mark``; the lines between are not read."""
        self.level.repeats = True
        self._ask("jump", mark)

    def skip(self, mark: Mark) -> None:
        """Go on at ``mark``, further down; the lines up to it count as read."""
        self._ask("skip", mark)

    def call(self, level: Level) -> None:
        """Execute a subprogram, then go on behind this block."""
        if len(self.levels) >= self._levels_max:
            raise CncError(
                self._too_deep,
                f"more than {self._levels_max - 1} subprograms in each other",
            )
        self._ask("call", level)

    def leave(self) -> None:
        """Back to the caller."""
        self._ask("leave", None)

    def _ask(self, what: str, value: Any) -> None:
        assert self._asked is None
        self._asked = (what, value)

    def forget(self) -> None:
        """The block that asked has failed."""
        self._asked = None

    # what the reader does behind the block

    def apply(self, here: Mark) -> tuple[Mark, int]:
        """Make the jump, call or return of the last block.

        ``here``: the place behind the block.
        Returns the place to go on at, in ``file``, and the number of lines that
        count as read on the way.
        """
        assert self._asked is not None
        (what, value), self._asked = self._asked, None
        if what == "call":
            return self._enter(value, here), 0
        if what == "leave":
            return self._return(), 0
        self.source.seek(value.position)
        return value, value.line - here.line if what == "skip" else 0

    def _enter(self, level: Level, here: Mark) -> Mark:
        level.back = here
        level.repeats = True
        self._enter_again(level)
        self.levels.append(level)
        self.level = level
        self.source.seek(level.start.position)
        return level.start

    def _enter_again(self, level: Level) -> None:
        """Calls of a file's text are as many as it has lines; calls from calls
        of what has run before grow beyond that, so they are repetitions.
        """
        name = level.file.number, level.start.position
        level.entered_again = self.level.entered_again + (name in self._entered)
        self._entered.add(name)
        deep = level.entered_again > AGAIN_IN_EACH_OTHER
        level.called_again = self.level.again or deep

    def _return(self) -> Mark:
        left = self.levels.pop()
        self.level = self.levels[-1]
        if (
            left.file not in [level.file for level in self.levels]
            and len(self._known) > FILES_OPEN
        ):
            left.file.close()
        self.source.seek(left.back.position)
        return left.back
