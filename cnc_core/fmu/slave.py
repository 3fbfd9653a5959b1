"""The process behind an FMU instance: it runs the cell.

``LINE PAGE FOLDER``: the socket, the memory, the folder of the FMU's resources.
It ends when the importer has closed the socket, or is dead.
"""

from __future__ import annotations

import ctypes
import signal
import sys
from pathlib import Path

import numpy as np

from hli.errors import HliError
from hli.symbol import SymbolError
from plc_client.task import PlcError

from ..errors import CncError
from .instance import Instance, variables_of
from .wire import END, ENDED, HLI, REFUSED, SETUP, Wire

OTHER_VERSION = (
    "the FMU was exported by another version of hli-cosim: export it again"
)
# what an importer can bring about: told to its logger
TOLD = (CncError, HliError, PlcError, OSError, OverflowError, ValueError)


def serve(wire: Wire, folder: Path) -> None:
    """Answer the importer until it is gone."""
    instance: Instance | None = None
    try:
        while (kind := wire.next()) != END:
            try:
                if kind == SETUP:
                    instance = _instance(wire, folder)
                elif instance is None:
                    wire.fail("the cell did not start", ENDED)
                elif kind == HLI:
                    memory = instance.hli()
                    ctypes.memmove(wire.page.hli, memory, len(memory))
                else:
                    instance.step(wire.page.cycles)
            except TOLD as error:
                refused = isinstance(error, (OverflowError, ValueError))
                how = REFUSED if refused and instance else ENDED
                wire.fail(_said(error, instance), how)
    finally:
        if instance is not None:
            instance.close()


def _instance(wire: Wire, folder: Path) -> Instance:
    if not wire.fits:
        raise CncError(902001, OTHER_VERSION)
    row = np.frombuffer(wire.page.values, np.float64)
    program = wire.page.program.decode()
    try:
        return Instance(folder, row, wire.values, program)
    except SymbolError as error:
        raise CncError(902001, str(error)) from None


def _said(error: Exception, instance: Instance | None) -> str:
    """The reason; where the CNC has ended with an error, its own."""
    if isinstance(error, PlcError) and instance is not None:
        try:
            instance.end()
        except CncError as reported:
            return str(reported)
    return str(error)


def main() -> None:
    line, memory, folder = sys.argv[1:4]
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the importer decides
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    _, variables = variables_of(Path(folder))
    serve(Wire(int(line), int(memory), len(variables)), Path(folder))


if __name__ == "__main__":
    main()
