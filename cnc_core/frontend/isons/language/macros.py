"""M and HM macros: files beside the program or in the cell's macro folder;
events that call them.
"""

from __future__ import annotations

from pathlib import Path

from cnc_core.errors import CncError
from cnc_core.files import Folders
from cnc_core.frontend.base.guess import guess
from cnc_core.frontend.base.lexer import fail

from ..base.machine import EVENTS, IsonsCell

CONVERTER = "nsimportfile.dll"  # may turn imported files into programs
SUFFIXES = (".isons", ".nc", ".iso", ".txt", "")


class Macros:
    """Finds macro files; ``events``: M number by event, -1 none; OPT changes it
    for the program that runs.  ``folders``: where the program may read.
    """

    def __init__(self, program: Path, cell: IsonsCell) -> None:
        here = program.parent
        folder = Path(cell.macro_folder)
        self._folders = list(
            dict.fromkeys(
                [here, folder if folder.is_absolute() else here / folder]
            )
        )
        self._suffixes = tuple(dict.fromkeys([program.suffix, *SUFFIXES]))
        self._app = (
            Path(cell.app_path)
            if Path(cell.app_path).is_absolute()
            else here / cell.app_path
        )
        self.folders = Folders(here, [*self._folders[1:], self._app])
        self._known: dict[str, Path | None] = {}
        self.events = dict(cell.events)

    def find(self, kind: str, number: int) -> Path | None:
        """File of macro M10 or HM10, None if there is none."""
        name = f"{kind}{number}"
        if name not in self._known:
            self._known[name] = self._search(name)
        return self._known[name]

    def _search(self, name: str) -> Path | None:
        for folder in self._folders:
            for stem in (name, name.lower()):
                for suffix in self._suffixes:
                    path = folder / (stem + suffix)
                    if self.folders.has(path):
                        return path
        return None

    def set_event(self, name: str, number: float, offset: int) -> None:
        """OPT."""
        if name not in EVENTS:
            raise fail(
                909120,
                f"OPT {name}: not one of {', '.join(EVENTS)}"
                f"{guess(name, EVENTS)}",
                offset,
            )
        if number != int(number) or not -1 <= number <= 65535:
            raise fail(
                900012,
                f"OPT {name} {number:g}: -1 or an M number is expected",
                offset,
            )
        self.events[name] = int(number)

    def event(self, name: str) -> int | None:
        """M number of the event's macro, None if there is none."""
        number = self.events.get(name, -1)
        return None if number < 0 else number

    def imported(self, name: str, caller: Path, offset: int) -> Path:
        """File of an IMPORT: beside the program, or beside the file that
        imports; ``$APPPATH`` is the cell's folder.
        """
        text = name.replace("\\", "/")
        if text.upper().startswith("$APPPATH"):
            folders = [self._app]
            text = text[len("$APPPATH") :].lstrip("/")
        else:
            folders = [*self._folders[:1], caller.parent]
        self._no_converter(name, offset)
        try:
            for folder in folders:
                path = self.folders.place(text, folder)
                if self.folders.has(path):
                    return path
        except CncError as error:
            raise fail(error.code, f"IMPORT: {error.text}", offset) from None
        raise fail(
            901001, f"IMPORT: file not found: {folders[0] / text}", offset
        )

    def _no_converter(self, name: str, offset: int) -> None:
        """What would read imported files in place of this front end cannot be
        called.
        """
        for folder in (self._folders[0], self._app):
            found = [
                path
                for path in (folder.iterdir() if folder.is_dir() else ())
                if path.name.lower() == CONVERTER
            ]
            if found:
                raise fail(
                    900003,
                    f"IMPORT {name}: {found[0]} would read the file, it cannot be called",
                    offset,
                )
