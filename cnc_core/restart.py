"""Where a program is to be taken up again, and the port while that place is searched for."""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Any

from .errors import CncError
from .frontend.machine import External
from .port import ChannelPort, ExternalValue

MARKER = re.compile(r"\$?(\w+)\s*=\s*([-+]?[\d.]+(?:[eE][-+]?\d+)?)")


@dataclass(frozen=True)
class Restart:
    """In front of ``line`` of the main file when it is reached for the ``passes``-th time, or behind the block that
    gives the variable ``marker`` its ``value``."""

    line: int = 0
    passes: int = 1
    marker: str = ""
    value: float = 0.0

    @classmethod
    def of(cls, line: int | None, passes: int, marker: str | None) -> Restart | None:
        """From the options of a command; None if none of them is given."""
        if line is not None and marker is not None:
            raise CncError(902001, "restart: a line or a marker, not both")
        if line is not None:
            if line < 1 or passes < 1:
                raise CncError(902001, "restart: line and pass count from 1")
            return cls(line, passes)
        if marker is None:
            return None
        found = MARKER.fullmatch(marker.strip())
        if not found:
            raise CncError(902001, f"restart: NAME=VALUE is expected, not {marker!r}")
        return cls(marker=found[1].upper(), value=float(found[2]))

    def __str__(self) -> str:
        return f"line {self.line}, pass {self.passes}" if self.line else f"${self.marker} = {self.value:g}"


class SearchingPort:
    """A port whose machine does not move while ``searching``: waits are true at once, outputs wait for the end.

    Everything else is the port's own.
    """

    def __init__(self, port: ChannelPort) -> None:
        self._port, self.searching = port, True
        self._written: dict[tuple[External, int], ExternalValue] = {}

    def __getattr__(self, name: str) -> Any:
        return getattr(self._port, name)

    @property
    def answers(self) -> bool:
        return not self.searching and self._port.answers

    def read_external(self, variable: External, element: int) -> ExternalValue:
        if (variable, element) in self._written:
            return self._written[variable, element]
        return self._port.read_external(variable, element)

    def write_external(self, variable: External, element: int, value: ExternalValue) -> None:
        if self.searching:
            self._written[variable, element] = value
        else:
            self._port.write_external(variable, element, value)

    def found(self) -> None:
        """The place has been found: what the program has written until there is put out."""
        self.searching = False
        written, self._written = self._written, {}
        for (variable, element), value in written.items():
            self._port.write_external(variable, element, value)
