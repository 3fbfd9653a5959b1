"""The process behind an FMU instance: it runs the cell.

``HANDLE FOLDER``: the socket, the folder of the FMU's resources.  It ends when
the importer has closed the socket, or is dead.
"""

from __future__ import annotations

import atexit
import json
import signal
import sys
import tempfile
import tomllib
from pathlib import Path
from typing import Any

from hli import segment
from hli.areas import Areas
from hli.errors import HliError
from hli.symbol import Symbol, SymbolError
from plc_client import AcknowledgeAll, AutoContinue, ContourQueue, task
from plc_client.blocks import FeedControl, StartProgram
from plc_client.runner import PlcRunner
from plc_client.task import PlcError

from ..cell.stepping import start_plc
from ..config import CellConfig
from ..config.reading import config_of, config_text
from ..errors import CncError
from .variables import (
    ELEMENTS_SHOWN,
    MODEL,
    Variable,
    inputs,
    outputs,
    parameters,
)
from .wire import END, ERROR, HLI, OK, SETUP, Request, Wire

TENTH_UM = 1e-4
START = 2  # the input's place
# of an element, in the order of variables.MEMBERS
FIELDS = (
    ("block_type", 1.0),
    ("start_position", TENTH_UM),
    ("length", TENTH_UM),
    ("programmed_radius", TENTH_UM),
    ("tangent_variation", 1.0),
)
PRIORITY = -1000  # ahead of the user's tasks


class Instance:
    """One cell, its inputs and its outputs."""

    def __init__(self, folder: Path, given: tuple[float, ...]) -> None:
        model = json.loads((folder / MODEL).read_text())
        base = base_cell(folder, model)
        count = len(parameters(base))
        cell = changed(base, parameters(base), given[:count])
        self._inputs = inputs(model["inputs"])
        self._outputs = outputs(cell, model["outputs"])
        self.values = list(given[count:])
        self._file = folder_of_slave() / "cell.json"
        self._file.write_text(config_text(cell))
        self.runner = self._started(folder, model)
        # as it is behind the step; the PLC sees it as its scan began
        self._segment = segment.observe(self.runner.hli.name)
        self._areas = Areas(self._segment)
        self._held = [
            (i, self.runner.symbol(variable.symbol))
            for i, variable in enumerate(self._inputs)
            if variable.symbol
        ]
        first = next(i for i, v in enumerate(self._outputs) if not v.symbol)
        last = first + 1 + ELEMENTS_SHOWN * len(FIELDS)
        self._readers = (
            self._reading(self._outputs[:first]),
            self._reading(self._outputs[last:]),
        )
        self._last = self._read()

    def _started(self, folder: Path, model: dict[str, Any]) -> PlcRunner:
        user = [folder / model["plc"]] if model["plc"] else [Acknowledging]
        autostart = bool(self.values[START])
        return start_plc(
            folder / model["program"],
            [commands_of(self, model["cycle_s"], autostart), *user],
            config=self._file,
            autostart=autostart,
        )

    def step(self, cycles: int) -> list[float]:
        """Outputs after so many cycles; behind the program's end they stay."""
        for i, symbol in self._held:
            symbol.value = type(symbol.value)(self.values[i])
        for _ in range(cycles):
            if self.runner.ended:
                break
            self.runner.step()
        self._last = self._read()
        return self._last

    def _read(self) -> list[float]:
        before, behind = self._readers
        return [
            *(float(symbol.value) * scale for symbol, scale in before),
            *self._elements(),
            *(float(symbol.value) * scale for symbol, scale in behind),
        ]

    def _reading(self, variables: list[Variable]) -> list[tuple[Symbol, float]]:
        return [(self._symbol(v.symbol), v.scale) for v in variables]

    def _symbol(self, path: str) -> Symbol:
        """Of the HLI, or else of the PLC."""
        try:
            return self._areas.symbol(path)
        except SymbolError:
            return self.runner.symbol(path)

    def _elements(self) -> list[float]:
        """The contour ahead, member by member, in the order of the outputs."""
        ahead = self.runner["Commands"].ahead.blocks
        blocks = ahead[:ELEMENTS_SHOWN]
        rest = [0.0] * (ELEMENTS_SHOWN - len(blocks))
        out = [float(len(ahead))]
        for field, scale in FIELDS:
            out += (blocks[field] * scale).tolist()
            out += rest
        return out

    def hli(self) -> bytes:
        """The memory of the channel, as it is."""
        return bytes(self._segment.root.channel[0])

    def close(self) -> None:
        self._readers = ([], [])
        self._segment.close()
        self.runner.close()
        self._file.unlink(missing_ok=True)


@task(interval=0.001)
class Acknowledging:
    """The PLC where none is given."""

    def setup(self, hli: Any) -> None:
        self._functions = AcknowledgeAll(hli)
        self._flow = AutoContinue(hli.gpCh[0])

    def cyclic(self) -> None:
        self._functions()
        self._flow()


def commands_of(instance: Instance, cycle_s: float, autostart: bool) -> type:
    """The task that gives the importer's inputs to the CNC."""

    @task(interval=cycle_s, priority=PRIORITY)
    class Commands:
        def setup(self, hli: Any) -> None:
            channel = hli.gpCh[0]
            self._feed = FeedControl(channel)
            self._start = StartProgram(channel)
            self.ahead = ContourQueue(channel)
            self._state = channel.bahn_state
            self._commanded = False

        def cyclic(self) -> None:
            override, hold, start = instance.values[:3]
            if override != 100.0 or hold or self._commanded:
                self._commanded = True  # until then the PLC has the units
                self._feed(min(max(override, 0.0), 200.0), bool(hold))
            if not autostart:
                self._start(bool(start))
            self.ahead(self._state.dist_prog_start, 1e9)

    return Commands


def base_cell(folder: Path, model: dict[str, Any]) -> CellConfig:
    """The cell as it was exported."""
    if not model["cell"]:
        return CellConfig()
    return config_of(tomllib.loads((folder / model["cell"]).read_text()))


def changed(
    cell: CellConfig, names: list[Variable], values: tuple[float, ...]
) -> CellConfig:
    """The cell with the importer's parameters; CncError names a wrong one."""
    table = json.loads(config_text(cell))
    members = {"v_max": "mm_s", "a_max": "mm_s2", "j_max": "mm_s3"}
    for variable, value in zip(names, values, strict=True):
        if value == variable.start:
            continue
        axis, _, short = variable.name.partition(".")
        if not short:
            table.setdefault("channel", {})["tolerance_mm"] = value
            continue
        axes = table.setdefault("axes", {name: {} for name in cell.axes})
        axes.setdefault(axis, {})[f"{short}_{members[short]}"] = value
    return config_of(table)


def folder_of_slave() -> Path:
    """A folder of this process alone, removed with it."""
    folder = tempfile.TemporaryDirectory(prefix="hli-cosim-fmu-")
    atexit.register(folder.cleanup)
    return Path(folder.name)


def serve(wire: Wire, folder: Path) -> None:
    """Answer the importer until it is gone."""
    instance: Instance | None = None
    try:
        while (request := wire.request()) is not None and request.kind != END:
            try:
                if request.kind == SETUP:
                    instance = Instance(folder, request.numbers)
                    wire.answer(OK, instance.step(0))
                elif request.kind == HLI and instance:
                    wire.answer(OK, (), instance.hli())
                else:
                    wire.answer(*_stepped(instance, request))
            except (CncError, HliError, PlcError, ValueError) as error:
                wire.answer(ERROR, (), _said(error, instance))
    finally:
        if instance:
            instance.close()


def _stepped(
    instance: Instance | None, request: Request
) -> tuple[int, list[float]]:
    assert instance is not None
    instance.values = list(request.numbers)
    return OK, instance.step(request.cycles)


def _said(error: Exception, instance: Instance | None) -> str:
    """The reason; where the CNC has ended with an error, its own."""
    if instance is None:
        return str(error)
    instance.runner.close()
    told = instance.runner.cnc_report.get("errors") or []
    texts = [f"{one['code']}: {one['text']}" for one in told]
    return "; ".join(texts) or str(error)


def main() -> None:
    handle, folder = sys.argv[1:3]
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the importer decides
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
    serve(Wire(int(handle)), Path(folder))


if __name__ == "__main__":
    main()
