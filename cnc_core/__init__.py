"""The CNC: front ends, geometry, engine, co-simulation cell, command line."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .cell import Cell, RunResult
    from .cell.stepping import start_plc
    from .config import CellConfig
    from .errors import CncError
    from .recording.reading import Recording
else:
    _HOMES = {
        "Cell": "cell",
        "CellConfig": "config",
        "CncError": "errors",
        "Recording": "recording.reading",
        "RunResult": "cell",
        "start_plc": "cell.stepping",
    }

    def __getattr__(name):
        """Import the public names when they are asked for: processes that need
        less start faster.
        """
        if name in _HOMES:
            home = importlib.import_module(f".{_HOMES[name]}", __name__)
            return getattr(home, name)
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")

    def __dir__():
        hidden = {name for name in globals() if name.startswith("__")}
        return sorted({*__all__, *hidden})


__all__ = [
    "Cell",
    "CellConfig",
    "CncError",
    "Recording",
    "RunResult",
    "start_plc",
]
