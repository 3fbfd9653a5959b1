"""Front ends: program text to canonical rows, one package per dialect."""

from __future__ import annotations

from pathlib import Path
from typing import Protocol

from cnc_core.errors import CncError, Place
from cnc_core.frontend.detect import detect as detect
from cnc_core.frontend.machine import ProgramMachine

from ..blocks import BlockBatch
from .port import ChannelPort, Wait

DIALECTS = ("isg", "iso", "isons", "osai")


class FrontEnd(Protocol):
    """What the channel sees of every front end."""

    errors: list[CncError]
    warnings: list[CncError]
    files: list[Path]

    @property
    def block_count(self) -> int:
        """Physical lines read so far."""
        ...

    def read(self, rows: int) -> BlockBatch | Wait | None:
        """Up to ``rows`` rows, a reason to wait, or None at the program's end."""
        ...

    def close(self) -> None: ...


def create(
    dialect: str,
    path: Path,
    machine: ProgramMachine,
    port: ChannelPort,
    collect: bool = False,
    *,
    lenient: bool = False,
) -> FrontEnd:
    """The front end of ``dialect`` for one program; ``lenient`` as the dialect
    understands it.

    Only its own package is imported: the others would be most of what a process
    needs to start.
    """
    if dialect == "isg":
        from cnc_core.frontend.isg import IsgFrontEnd  # noqa: PLC0415

        return IsgFrontEnd(
            path, machine, port, collect=collect, lenient=lenient
        )
    if dialect == "iso":
        from cnc_core.frontend.iso import IsoFrontEnd  # noqa: PLC0415

        return IsoFrontEnd(path, machine, port, collect=collect)
    if dialect == "isons":
        from cnc_core.frontend.isons.front_end import IsonsFrontEnd  # noqa: PLC0415

        return IsonsFrontEnd(path, machine, port, collect=collect)
    if dialect == "osai":
        from cnc_core.frontend.osai import OsaiFrontEnd  # noqa: PLC0415

        return OsaiFrontEnd(
            path, machine, port, collect=collect, lenient=lenient
        )
    known = "" if dialect in DIALECTS else f" (known: {', '.join(DIALECTS)})"
    raise CncError(
        901003,
        f"dialect {dialect} is not available yet{known}",
        Place(file=str(path)),
    )
