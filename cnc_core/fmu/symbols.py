"""Symbols that an FMU shows: of the HLI, of the PLC, and V.E of the program."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from hli.areas import Areas
from hli.symbol import SymbolError
from plc_client.runner import PlcRunner

from ..cell.stepping import start_plc
from ..config import CellConfig
from ..engine.external import TYPES
from ..errors import CncError
from .variables import EXTERNAL, Variable, externals

WIDE = (ctypes.c_uint32, ctypes.c_int64, ctypes.c_uint64)  # beyond Integer


class Held(Protocol):
    """What has a value, and maybe a place in the memory (``Symbol.memory``)."""

    value: Any

    @property
    def memory(self) -> tuple[int, Any] | None: ...


class ExternalSymbol:
    """A number V.E in the memory that CNC and PLC share."""

    def __init__(self, areas: Areas, place: int, kind: Any, scope: str) -> None:
        area: Any = areas.gpVEGlobal
        if scope == "channel":
            area = areas.gpVECh[0]
        self._area = area  # keeps the memory
        self.memory = area._address + place, kind
        self._number = kind.from_address(self.memory[0])
        self._whole = kind is not ctypes.c_double

    @property
    def value(self) -> Any:
        """The number now."""
        return self._number.value

    @value.setter
    def value(self, value: Any) -> None:
        self._number.value = int(value) if self._whole else float(value)


def resolved(
    name: str, areas: Areas, runner: PlcRunner, cell: CellConfig
) -> Held:
    """V.E of the cell, or of the HLI, or else of the PLC; SymbolError."""
    if name.upper().startswith(EXTERNAL):
        return _external(name, areas, cell)
    try:
        return areas.symbol(name)
    except SymbolError:
        return runner.symbol(name)


def _external(name: str, areas: Areas, cell: CellConfig) -> ExternalSymbol:
    short, bracket, index = name[len(EXTERNAL) :].partition("[")
    found = cell.externals.get(short)
    if name not in {variable.name for variable in externals(cell)}:
        there = ", ".join(v.name for v in externals(cell)[:20]) or "none"
        raise SymbolError(
            f"symbol {name!r}: no such number; there are: {there}"
        )
    assert found is not None
    element = int(index.rstrip("]")) if bracket else 0
    kind = TYPES[found.type]
    return ExternalSymbol(areas, found.place(element), kind, found.scope)


def chosen(
    names: Sequence[str],
    causality: str,
    runner: PlcRunner,
    cell: CellConfig,
) -> list[Variable]:
    """Variables of symbols, of the kind that they have; CncError: there is no
    such symbol, or it is no number.
    """
    out = []
    for name in names:
        try:
            held = resolved(name, runner.hli, runner, cell)
        except SymbolError as error:
            raise CncError(902001, f"FMU: {error}") from None
        value = held.value
        start = float(value) if causality == "input" and value else 0.0
        kind = _kind(name, held)
        out.append(
            Variable(
                name,
                kind,
                causality,
                start=start,
                about="a symbol",
                symbol=name,
            )
        )
    return out


def _kind(name: str, held: Held) -> str:
    value = held.value
    if held.memory is not None and held.memory[1] in WIDE:
        return "Real"
    if isinstance(value, (bool, np.bool_)):
        return "Boolean"
    if isinstance(value, (int, np.integer)):
        return "Integer"
    if isinstance(value, (float, np.floating)):
        return "Real"
    what = "not set behind setup()" if value is None else type(value).__name__
    raise CncError(902001, f"FMU: symbol {name!r} is no number: {what}")


def chosen_of(
    files: tuple[Path, Path | None, Sequence[Any]],
    cell: CellConfig,
    wanted: tuple[Sequence[str], Sequence[str]],
) -> tuple[list[Variable], list[Variable]]:
    """The chosen inputs and outputs, from the cell as it stands at its start.

    ``files``: program, cell file, tasks of the PLC.
    """
    if not any(wanted):
        return [], []
    program, config, tasks = files
    with start_plc(program, tasks, config=config) as runner:
        return (
            chosen(wanted[0], "input", runner, cell),
            chosen(wanted[1], "output", runner, cell),
        )
