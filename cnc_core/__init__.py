"""The CNC: front ends, geometry, engine, co-simulation cell, command line."""

from typing import Any

__all__ = ["Cell", "CncError", "Recording", "RunResult", "start_plc"]


def __getattr__(name: str) -> Any:
    """Import the public names when they are asked for: processes that need less
    start faster.
    """
    if name in ("Cell", "RunResult"):
        from . import cell  # noqa: PLC0415

        return getattr(cell, name)
    if name == "Recording":
        from .recording.reading import Recording  # noqa: PLC0415

        return Recording
    if name == "CncError":
        from .errors import CncError  # noqa: PLC0415

        return CncError
    if name == "start_plc":
        from .cell.stepping import start_plc  # noqa: PLC0415

        return start_plc
    raise AttributeError(f"module 'cnc_core' has no attribute {name!r}")
