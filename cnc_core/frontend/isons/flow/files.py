"""Files that a program reads and writes."""

from __future__ import annotations

from cnc_core import files
from cnc_core.errors import CncError
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.port import ChannelPort


class RunFiles:
    """Files beside the program and in the folder of the run.

    ``folders``: where the program may read.
    """

    def __init__(self, port: ChannelPort, folders: files.Folders) -> None:
        self._port, self._folders = port, folders
        self._written: set[str] = set()

    def text_of(self, name: str, offset: int) -> str | None:
        """Text of a file, None if there is none.

        A file that the program has written comes first, then one beside the
        program, then one in the folder of the run.
        """
        inner = inside(name, offset)
        try:
            if inner not in self._written:
                beside = self._folders.place(inner, self._folders.own)
                if self._folders.has(beside):
                    return self._folders.read_text(beside)
            return self._port.read_file(inner)
        except CncError as error:
            raise fail(error.code, error.text, offset) from None

    def write(self, name: str, text: str) -> None:
        self._written.add(name)
        self._port.write_file(name, text)


def numbers_of(name: str, text: str, offset: int) -> list[float]:
    """One number a line; the error tells the place, not the text."""
    numbers = list[float]()
    for line in text.split():
        try:
            numbers.append(float(line))
        except ValueError:
            raise fail(
                909107,
                f"LOAD_VAR {name}: value {len(numbers) + 1} is no number",
                offset,
            ) from None
    return numbers


def inside(name: str, offset: int) -> str:
    """A file name that stays in the folder of the run."""
    try:
        return str(files.inside(name))
    except CncError as error:
        raise fail(error.code, error.text, offset) from None
