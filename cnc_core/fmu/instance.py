"""The cell of an FMU instance: its inputs and outputs are one row of numbers."""

from __future__ import annotations

import atexit
import ctypes
import json
import math
import shutil
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from hli._sync import ffi, lib

from hli import segment
from hli.areas import Areas
from hli.view import BLOCK_DTYPE
from plc_client import AcknowledgeAll, AutoContinue, task
from plc_client.blocks import FeedControl, StartProgram
from plc_client.runner import PlcRunner

from ..cell.scratch import scratch_folder
from ..cell.stepping import start_plc
from ..config import CellConfig, load_config
from ..config.reading import config_of, config_text
from ..errors import CncError
from .looking import Ahead, Functions
from .symbols import Held, resolved
from .variables import (
    ARRAY,
    EXTERNAL,
    FEED_HOLD,
    MEMBERS,
    MODEL,
    OVERRIDE,
    PROGRAM_END,
    START,
    TENTH_UM,
    Variable,
)

Row = npt.NDArray[np.float64]
PRIORITY = -1000  # ahead of the user's tasks
# members of an element, in the order of variables.MEMBERS
FIELDS = (
    ("block_type", 1.0),
    ("start_position", TENTH_UM),
    ("length", TENTH_UM),
    ("programmed_radius", TENTH_UM),
    ("tangent_variation", 1.0),
)
KINDS: dict[Any, int] = {
    ctypes.c_bool: lib.HS_U8,
    ctypes.c_int8: lib.HS_I8,
    ctypes.c_uint8: lib.HS_U8,
    ctypes.c_int16: lib.HS_I16,
    ctypes.c_uint16: lib.HS_U16,
    ctypes.c_int32: lib.HS_I32,
    ctypes.c_uint32: lib.HS_U32,
    ctypes.c_int64: lib.HS_I64,
    ctypes.c_uint64: lib.HS_U64,
    ctypes.c_float: lib.HS_F32,
    ctypes.c_double: lib.HS_F64,
}
NUMPY_KINDS = {"i4": lib.HS_I32, "u4": lib.HS_U32, "f8": lib.HS_F64}
WORDS = {"Real": float, "Integer": int, "Boolean": bool}
Item = tuple[int, int, int, float]  # place, address, kind, scale


def variables_of(folder: Path) -> tuple[dict[str, Any], list[Variable]]:
    """What the export wrote: the model, its variables."""
    model = json.loads((folder / MODEL).read_text())
    return model, [Variable(**words) for words in model["variables"]]


class Instance:
    """One cell.

    ``folder``: the FMU's resources.  ``row``: its values, ``given`` a cffi
    pointer to them.  ``program``: a path, or empty for that of the export.
    """

    def __init__(
        self, folder: Path, row: Row, given: Any, program: str = ""
    ) -> None:
        model, variables = variables_of(folder)
        self._row, self._given = row, given
        self._variables = variables
        self._places = {v.name: i for i, v in enumerate(variables)}
        chosen = changed(base_cell(folder, model), variables, row)
        self._file = folder_of_slave() / "cell.json"
        self._file.write_text(config_text(chosen))
        model |= {"program": program or model["program"]}
        self.runner = self._started(folder, model)
        hli = self.runner.hli
        # as it is behind the step; the PLC sees it as its scan began
        self._segment = segment.observe(hli.name)
        self._areas = Areas(self._segment)
        self._functions, self._ahead = Functions(hli), Ahead(hli)
        self._path = self._areas.gpCh[0].bahn_state._c
        self._ended = False
        self._bind(chosen)
        self.show()

    def _started(self, folder: Path, model: dict[str, Any]) -> PlcRunner:
        user = [folder / model["plc"]] if model["plc"] else [Acknowledging]
        autostart = bool(self._row[self._places[START]])
        commands = commands_of(self._row, self._places, model["cycle_s"])
        return start_plc(
            folder / model["program"],
            [commands, *user],
            config=self._file,
            autostart=autostart,
        )

    def _bind(self, cell: CellConfig) -> None:
        """What is written in front of a step, and read behind it."""
        self._held: list[tuple[int, Held, Any]] = []
        self._shared: list[tuple[int, Held, Any]] = []
        self._told: list[tuple[int, Held, float]] = []
        items: list[Item] = []
        for place, variable in enumerate(self._variables):
            if not variable.symbol:
                continue
            areas = self._areas
            if variable.causality == "input":
                areas = self.runner.hli  # that can be written
            held = resolved(variable.symbol, areas, self.runner, cell)
            if variable.causality == "output":
                self._shown(place, held, variable.scale, items)
            elif variable.symbol.startswith(EXTERNAL):
                self._shared.append((place, held, WORDS[variable.kind]))
            else:
                self._held.append((place, held, WORDS[variable.kind]))
        items += self._elements()
        self._items = ffi.new("hs_item[]", len(items))
        for to, (place, address, kind, scale) in zip(
            self._items, items, strict=True
        ):
            to.place, to.kind, to.scale = place, kind, scale
            setattr(to, "from", ffi.cast("void *", address))
        self._before = self._row.copy()

    def _shown(
        self, place: int, held: Held, scale: float, items: list[Item]
    ) -> None:
        memory = held.memory
        if memory is None:
            self._told.append((place, held, scale))
        else:
            items.append((place, memory[0], KINDS[memory[1]], scale))

    def _elements(self) -> Iterator[Item]:
        rows = self._ahead.rows
        assert BLOCK_DTYPE.fields is not None
        for (name, _), (field, scale) in zip(MEMBERS, FIELDS, strict=True):
            kind, offset = BLOCK_DTYPE.fields[field][:2]
            for i in range(ARRAY):
                place = self._places[f"ahead{i}.{name}"]
                address = rows.ctypes.data + i * rows.itemsize + offset
                yield place, address, NUMPY_KINDS[kind.str[1:]], scale

    def step(self, cycles: int) -> None:
        """So many cycles; behind the program's end the outputs stay."""
        if self._ended:
            return
        runner, functions = self.runner, self._functions
        self._take_inputs()
        for left in range(cycles, 0, -1):
            if runner.ended:
                break
            functions.before_scan()
            runner.scan()
            functions.behind_scan()
            if left == 1:
                self._ahead.ask(self._path.dist_prog_start)
            runner.advance()
        self._ahead.take()
        self.show()
        if runner.ended:
            self._row[self._places[PROGRAM_END]] = 1.0
            self.end()

    def end(self) -> None:
        """Ends the CNC, what it showed stays; CncError with what it reports."""
        self._ended = True
        self.runner.close()
        told = self.runner.cnc_report.get("errors") or []
        if told:
            texts = [f"{place_of(one)}{one['text']}" for one in told]
            raise CncError(int(told[0]["code"]), "; ".join(texts))

    def _take_inputs(self) -> None:
        row, before = self._row, self._before
        speed = row[self._places[OVERRIDE]]
        if not math.isfinite(speed):
            raise ValueError(f"{OVERRIDE} {speed}: 0 to 200 is allowed")
        for place, held, kind in self._held:
            held.value = kind(row[place])
        for place, held, kind in self._shared:
            if row[place] != before[place]:
                held.value = kind(row[place])
                before[place] = row[place]

    def show(self) -> None:
        """The outputs as they are."""
        row, places = self._row, self._places
        lib.hs_gather(self._items, len(self._items), self._given)
        for place, held, scale in self._told:
            row[place] = float(held.value or 0.0) * scale
        functions = self._functions
        count = places["m_functions"]
        if row[count] != functions.count:
            first = places["m0"]
            row[first : first + ARRAY] = functions.last
            row[count] = functions.count
        row[places["elements"]] = self._ahead.count

    def hli(self) -> bytes:
        """The memory of the channel, as it is."""
        return bytes(self._segment.root.channel[0])

    def close(self) -> None:
        """Ends the cell."""
        self._items = ffi.new("hs_item[]", 0)
        self._held, self._shared, self._told = [], [], []
        self._path = None
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


def place_of(error: dict[str, Any]) -> str:
    """File and line of an error of the CNC's report, in front of its text."""
    if not error.get("file"):
        return ""
    line = f":{error['line']}" if error.get("line") else ""
    return f"{error['file']}{line}: "


def commands_of(row: Row, places: dict[str, int], cycle_s: float) -> type:
    """The task that gives the importer's inputs to the CNC."""
    override, hold, start = (
        places[name] for name in (OVERRIDE, FEED_HOLD, START)
    )
    autostart = bool(row[start])

    @task(interval=cycle_s, priority=PRIORITY)
    class Commands:
        def setup(self, hli: Any) -> None:
            channel = hli.gpCh[0]
            self._feed = FeedControl(channel)
            self._start = StartProgram(channel)
            self._commanded = False

        def cyclic(self) -> None:
            speed, holds = float(row[override]), bool(row[hold])
            if speed != 100.0 or holds or self._commanded:
                self._commanded = True  # until then the PLC has the units
                self._feed(min(max(speed, 0.0), 200.0), holds)
            if not autostart:
                self._start(bool(row[start]))

    return Commands


def base_cell(folder: Path, model: dict[str, Any]) -> CellConfig:
    """The cell as it was exported."""
    return load_config(folder / model["cell"] if model["cell"] else None)


def changed(
    cell: CellConfig, variables: Sequence[Variable], row: Row
) -> CellConfig:
    """The cell with the importer's parameters; CncError names a wrong one."""
    table = json.loads(config_text(cell))
    members = {"v_max": "mm_s", "a_max": "mm_s2", "j_max": "mm_s3"}
    for variable, number in zip(variables, row, strict=True):
        if variable.causality != "parameter" or variable.kind == "String":
            continue
        value = float(number)
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
    folder = scratch_folder()
    atexit.register(shutil.rmtree, folder, ignore_errors=True)
    return folder
