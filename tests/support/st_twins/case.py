"""One case of the suite that runs a function block and its twin in Structured Text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from plc_client import blocks, task
from plc_client.mock import line
from plc_client.runner import PlcRunner

Inputs = dict[str, Any]


def on_channel(hli: Any, block: Any) -> Any:
    """The block on the first channel."""
    return block(hli.gpCh[0])


def call(fb: Any, inputs: Inputs) -> None:
    """The inputs are the arguments."""
    fb(**inputs)


@dataclass
class Case:
    """A block, inputs from a scan on, and the outputs that are compared.

    ``outputs``: ``name``, or ``python:structured_text`` where they differ.
    ``named``: inputs whose name in Structured Text is another one.
    ``kinds``: their types in Structured Text.  ``st``: statements instead of
    the plain call; ``declared``: more variables; ``around``: a block around
    the twin, which is ``st_block``.
    """

    block: str
    outputs: tuple[str, ...]
    inputs: dict[int, Inputs] = field(default_factory=dict)
    units: tuple[str, ...] = ()
    script: tuple[Any, ...] = (line(30),)
    scans: int = 60
    started: bool = True
    named: dict[str, str] = field(default_factory=dict)
    kinds: dict[str, str] = field(default_factory=dict)
    absent: tuple[int, ...] = ()
    make: Callable[[Any, Any], Any] = on_channel
    run: Callable[[Any, Inputs], None] = call
    st: str = ""
    declared: str = ""
    st_block: str = ""
    around: str = ""
    mock: Inputs = field(default_factory=dict)
    before: Callable[[PlcRunner, int], None] | None = None


def _kind(value: Any) -> str:
    if isinstance(value, bool):
        return "BOOL"
    if isinstance(value, str):
        return "STRING(299)"
    return "LREAL" if isinstance(value, float) else "DINT"


_FIRST = {"to_mode": 2, "to_state": 4, "mode": 1}
"""What the twin in Python has as its default."""


def text_of(case: Case) -> str:
    """The program that calls the twin."""
    given = {k: v for inputs in case.inputs.values() for k, v in inputs.items()}
    declared = ""
    for name, value in given.items():
        kind = case.kinds.get(name, "INT" if name in _FIRST else _kind(value))
        first = f" := {_FIRST[name]}" if name in _FIRST else ""
        declared += f"i_{name} : {kind}{first}; "
    passed = ", ".join(f"{case.named.get(k, k)} := i_{k}" for k in given)
    return case.around + (
        f"PROGRAM MAIN\nVAR fb : {case.st_block or case.block}; "
        f"{case.declared}{declared}END_VAR\n"
        f"{case.st or f'fb({passed});'}\nEND_PROGRAM\n"
    )


def twin_of(case: Case) -> type:
    """The task that calls the block in Python."""

    @task()
    class Twin:
        inputs: Inputs

        def setup(self, hli: Any) -> None:
            self.inputs = {}
            self.fb = case.make(hli, getattr(blocks, case.block))

        def cyclic(self) -> None:
            case.run(self.fb, self.inputs)

    return Twin


def _value(holder: Any, path: str) -> Any:
    for part in path.split("."):
        holder = getattr(holder, part)
    if isinstance(holder, Enum) and not isinstance(holder, int):
        return list(type(holder)).index(holder)
    if isinstance(holder, (bool, np.bool_)):
        return bool(holder)
    if isinstance(holder, float):
        return max(min(holder, 1.0e308), -1.0e308)
    return holder


def _unit(runner: PlcRunner, path: str) -> Any:
    """A member of the channel, or of the first axis: ``axis:lr_mc_control...``."""
    if path.startswith("axis:"):
        return _value(runner.hli.gpAx[0], path[5:])
    return _value(runner.ch, path)


def trace(
    runner: PlcRunner, case: Case, put: Callable[[str, Any], None], side: int
) -> list[tuple[Any, ...]]:
    """Outputs and units after each scan; ``side`` 0: Python, 1: the twin."""
    main = runner.task
    rows = []
    for scan in range(case.scans):
        for name, value in case.inputs.get(scan, {}).items():
            put(name, value)
        if scan in case.absent:
            present = scan != case.absent[0]
            runner.ch.head.plc_present_w = present
        if case.before is not None:
            case.before(runner, scan)
        runner.step()
        names = [
            name.split(":")[side * name.count(":")] for name in case.outputs
        ]
        found = [_value(main.fb, name) for name in names]
        found += [_unit(runner, path) for path in case.units]
        rows.append(tuple(found))
    return rows
