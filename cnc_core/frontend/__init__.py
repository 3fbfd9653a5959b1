"""Front ends: program text to canonical rows, one package per dialect."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

from cnc_core.errors import CncError, Place
from cnc_core.frontend.detect import detect as detect
from cnc_core.frontend.machine import ProgramMachine

from .front_end import FrontEnd as FrontEnd
from .front_end import Restartable as Restartable
from .port import ChannelPort

DIALECTS = ("isg", "iso", "isons", "osai")


def create(
    dialect: str,
    path: Path,
    machine: ProgramMachine,
    port: ChannelPort,
    collect: bool = False,
    *,
    lenient: bool = False,
) -> FrontEnd:
    """The front end of ``dialect`` for one program.

    ``lenient``: as the dialect understands it.  ``collect``: errors are
    collected, not raised.
    """
    make = _MAKERS.get(dialect)
    if make is None:
        known = ", ".join(DIALECTS)
        text = f"dialect {dialect} is not available yet (known: {known})"
        raise CncError(901003, text, Place(file=str(path)))
    return make(path, machine, port, collect, lenient)


# A process needs one dialect.  Each function imports its own package only,
# because the others would take most of the time that a process needs to start.


def _isg(
    path: Path,
    machine: ProgramMachine,
    port: ChannelPort,
    collect: bool,
    lenient: bool,
) -> FrontEnd:
    from cnc_core.frontend.isg import IsgFrontEnd  # noqa: PLC0415

    return IsgFrontEnd(path, machine, port, collect=collect, lenient=lenient)


def _iso(
    path: Path,
    machine: ProgramMachine,
    port: ChannelPort,
    collect: bool,
    _lenient: bool,
) -> FrontEnd:
    from cnc_core.frontend.iso import IsoFrontEnd  # noqa: PLC0415

    return IsoFrontEnd(path, machine, port, collect=collect)


def _isons(
    path: Path,
    machine: ProgramMachine,
    port: ChannelPort,
    collect: bool,
    _lenient: bool,
) -> FrontEnd:
    from cnc_core.frontend.isons.front_end import IsonsFrontEnd  # noqa: PLC0415

    return IsonsFrontEnd(path, machine, port, collect=collect)


def _osai(
    path: Path,
    machine: ProgramMachine,
    port: ChannelPort,
    collect: bool,
    lenient: bool,
) -> FrontEnd:
    from cnc_core.frontend.osai import OsaiFrontEnd  # noqa: PLC0415

    return OsaiFrontEnd(path, machine, port, collect=collect, lenient=lenient)


Maker = Callable[[Path, ProgramMachine, ChannelPort, bool, bool], FrontEnd]
_MAKERS: dict[str, Maker] = {
    "isg": _isg,
    "iso": _iso,
    "isons": _isons,
    "osai": _osai,
}
