"""Files that a program reads and writes."""

from __future__ import annotations

from pathlib import Path, PurePosixPath

from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.port import ChannelPort


class RunFiles:
    """Files beside the program and in the folder of the run.

    ``folder``: of the main program.
    """

    def __init__(self, port: ChannelPort, folder: Path) -> None:
        self._port, self._folder = port, folder
        self._written: set[str] = set()

    def text_of(self, name: str) -> str | None:
        """Text of a file, None if there is none.

        A file that the program has written comes first, then one beside the
        program, then one in the folder of the run.
        """
        if name in self._written:
            return self._port.read_file(name)
        path = Path(name.replace("\\", "/"))
        beside = path if path.is_absolute() else self._folder / path
        if beside.is_file():
            return beside.read_text(encoding="utf-8", errors="replace")
        if path.is_absolute() or ".." in path.parts:
            return None
        return self._port.read_file(name.replace("\\", "/"))

    def write(self, name: str, text: str) -> None:
        self._written.add(name)
        self._port.write_file(name, text)


def numbers_of(name: str, text: str, offset: int) -> list[float]:
    """One number a line."""
    try:
        return [float(line) for line in text.split()]
    except ValueError as error:
        raise fail(909107, f"LOAD_VAR {name}: {error}", offset) from None


def inside(name: str, offset: int) -> str:
    """A file name that stays in the folder of the run."""
    path = PurePosixPath(name.replace("\\", "/"))
    if (
        not name.strip()
        or path.is_absolute()
        or ".." in path.parts
        or ":" in name
        or "\0" in name
    ):
        raise CncError(907053, f"{name!r}: {ERRORS[907053]}").at(
            fail(907053, "", offset).place
        )
    return str(path)
