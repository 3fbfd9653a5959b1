"""User variables: private to their program or macro, or GLOBAL; arrays; the
variable list.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from cnc_core.errors import ERRORS
from cnc_core.frontend.base.lexer import fail
from cnc_core.frontend.base.variables import ArrayRoom

VARIABLES_MAX = 2048
ELEMENTS_MAX = 1_000_000


class Array(list[float]):
    """Elements of an array; the room that it takes is known by it."""


@dataclass
class UserScope:
    """Variables of one program or macro; ``shared``: names that it has declared
    GLOBAL.
    """

    values: dict[str, float] = field(default_factory=dict)
    arrays: dict[str, list[float]] = field(default_factory=dict)
    declared: dict[str, tuple[int, int]] = field(default_factory=dict)
    shared: set[str] = field(default_factory=set)


class Store:
    """The variables that the running block sees.  ``warn``: number, text, offset."""

    def __init__(self, warn: Callable[[int, str, int], None]) -> None:
        self.warn = warn
        self.common = UserScope()
        self.scope = UserScope()
        self.list: list[float] = []
        self._room = ArrayRoom()
        # of a restart: a variable and the value it is to get
        self.watched: tuple[str, float] | None = None
        self.watch_hit = False

    def _home(self, name: str) -> UserScope:
        return self.common if name in self.scope.shared else self.scope

    # variables

    def read(self, name: str, offset: int) -> float:
        """A variable that was never written is 0, with a warning."""
        value = self._home(name).values.get(name)
        if value is not None:
            return value
        if name in self._home(name).arrays:
            raise fail(
                909103, f"${name} is an array, its index is missing", offset
            )
        self.warn(909102, f"${name}: {ERRORS[909102]}", offset)
        return 0.0

    def write(self, name: str, value: float, offset: int) -> None:
        scope = self._home(name)
        if name not in scope.values:
            if name in scope.arrays:
                raise fail(
                    909103, f"${name} is an array, its index is missing", offset
                )
            if len(scope.values) >= VARIABLES_MAX:
                raise fail(
                    909104, f"more than {VARIABLES_MAX} variables", offset
                )
        scope.values[name] = value
        if self.watched is not None and (name, value) == self.watched:
            self.watch_hit = True

    def share(self, name: str) -> None:
        """GLOBAL."""
        self.scope.shared.add(name)
        self.common.values.setdefault(name, 0.0)

    def declare(self, name: str) -> None:
        """MARKER: an ordinary variable."""
        self._home(name).values.setdefault(name, 0.0)

    # arrays

    def dimension(
        self,
        name: str,
        size: float,
        place: tuple[int, int],
        offset: int,
        *,
        looped: bool = False,
    ) -> None:
        """DIM: elements 0..size-1, all 0.

        ``place``: file and line; another DIM of the file for the same array is
        an error.  The same one may be repeated by a jump back.  In a LOOP
        (``looped``) it may not: each pass would lose what the one before stored.
        """
        if size != int(size) or not 1 <= size <= ELEMENTS_MAX:
            raise fail(
                900012,
                f"DIM ${name}: {size:g} is no whole number 1..{ELEMENTS_MAX}",
                offset,
            )
        scope = self._home(name)
        before = scope.declared.setdefault(name, place)
        if before[0] == place[0] and before != place:
            raise fail(
                907017,
                f"DIM ${name}: {ERRORS[907017]}, first in line {before[1]}",
                offset,
            )
        if before == place and looped and name in scope.arrays:
            text = (
                f"DIM ${name} comes again in a LOOP and would clear the array"
            )
            raise fail(
                907017, f"{text}: declare it in front of the LOOP", offset
            )
        scope.values.pop(name, None)
        scope.arrays.pop(name, None)  # its elements are free again
        array = Array([0.0] * int(size))
        self._room.take(array, len(array), f"DIM ${name}", offset)
        scope.arrays[name] = array

    def _place(
        self, name: str, index: float, offset: int
    ) -> tuple[list[float], int]:
        array = self._home(name).arrays.get(name)
        if array is None:
            raise fail(907010, f"array ${name} is not declared (DIM)", offset)
        if index != int(index):
            raise fail(
                909105, f"${name}: index {index:g}: {ERRORS[909105]}", offset
            )
        if not 0 <= index < len(array):
            raise fail(
                907014,
                f"${name}: index {int(index)} out of range 0..{len(array) - 1}",
                offset,
            )
        return array, int(index)

    def element(self, name: str, index: float, offset: int) -> float:
        array, place = self._place(name, index, offset)
        return array[place]

    def set_element(
        self, name: str, index: float, value: float, offset: int
    ) -> None:
        array, place = self._place(name, index, offset)
        array[place] = value

    # the list

    def list_place(self, index: float, offset: int) -> int:
        if index != int(index) or not 0 <= index < len(self.list):
            what = (
                f"out of range 0..{len(self.list) - 1}"
                if self.list
                else "the list is empty"
            )
            raise fail(
                909106, f"variable list: index {index:g}: {what}", offset
            )
        return int(index)

    def resize_list(self, size: float, offset: int) -> None:
        if size != int(size) or not 0 <= size <= ELEMENTS_MAX:
            raise fail(
                900012,
                f"DIM_VAR {size:g}: a whole number 0..{ELEMENTS_MAX} is expected",
                offset,
            )
        self.list = [0.0] * int(size)
