"""System variables as the formulas see them."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Protocol

from ..devices.positioners import Positioners

SYSTEM_NAME = re.compile(r"_(PARM_|[A-Z])([0-9]+)")


class SystemVariables(Protocol):
    """Readers and writers of the system variables, by family and index.

    ``degrees``: angles of the functions are in degrees, else in radians.
    """

    degrees: bool

    @property
    def positioners(self) -> Positioners: ...

    def drains(self, family: str) -> bool:
        """Its values are known when everything before has been executed."""
        ...

    def lives(self, family: str) -> bool:
        """Its values change while the machine runs."""
        ...

    def moves(self, family: str) -> bool:
        """Its values go with the motion."""
        ...

    def reader(
        self, family: str, index: int, offset: int
    ) -> Callable[[], float]:
        """Reads one variable; CncError if there is no such index."""
        ...

    def writer(
        self, family: str, index: int, offset: int
    ) -> Callable[[float], None]:
        """Writes one variable; CncError if it is read only."""
        ...
