"""What a program is built with, and what comes out of it."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from .errors import Problem


@dataclass(frozen=True)
class Options:
    """What changes the meaning of a source."""

    short_circuit: bool = False
    defines: tuple[str, ...] = ()
    interval: float = 0.001
    tasks: tuple[str, ...] = ()


@dataclass
class Built:
    """A compiled program: the shared object and its description."""

    library: Path
    description: dict[str, Any]
    warnings: list[Problem] = field(default_factory=list)
    compiled: int = 0
