"""Function blocks on the HLI: those in Structured Text behave as those in Python.

One suite runs both on a mock CNC each, with the same inputs in the same scans;
after every scan the outputs and the command units are the same.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import pytest

from cnc_core.pytest_plugin import PlcFactory
from plc_client import blocks, task
from plc_client.mock import cnc_error, line, stop
from plc_client.runner import PlcRunner

Inputs = dict[str, Any]


@dataclass
class Case:
    """A block, inputs from a scan on, and the outputs that are compared.

    ``named``: inputs whose name in Structured Text is another one.
    """

    block: str
    outputs: tuple[str, ...]
    inputs: dict[int, Inputs] = field(default_factory=dict)
    units: tuple[str, ...] = ()
    script: tuple[Any, ...] = (line(30),)
    scans: int = 60
    started: bool = True
    named: dict[str, str] = field(default_factory=dict)
    absent: tuple[int, ...] = ()


OUT = ("done", "busy", "error", "error_id")
MODE = (*OUT, "mode", "process_state")
CONTINUE = "bahn_mc_control.continue_machining."
EDGE = ("command_w", "enable_w")
PRESS = {0: {"execute": False}, 3: {"execute": True}, 40: {"execute": False}}
CASES = {
    "continue": Case(
        "ContinueMachining",
        (*OUT, "waiting"),
        {**PRESS, 45: {"execute": True}},
        tuple(CONTINUE + word for word in EDGE),
        (line(1), stop(), line(1), stop(), line(30)),
        90,
    ),
    "automatic": Case(
        "AutoContinue",
        ("count",),
        {},
        tuple(CONTINUE + word for word in EDGE),
        (line(1), stop(), line(1), stop(), line(30)),
        90,
    ),
    "delete distance": Case(
        "DeleteDistanceToGo",
        (*OUT, "active"),
        {**PRESS, 3: {"execute": True, "mask": 5}},
        (
            "bahn_mc_control.delete_distance_to_go.command_w",
            "bahn_mc_control.del_dist_to_go_end.command_w",
        ),
    ),
    "stop": Case(
        "InsertStop",
        (*OUT, "next_stop"),
        {**PRESS, 3: {"execute": True, "distance": 20_000.0, "mode": 1}},
        ("bahn_mc_control.insert_cmd.command_semaphor_rw",),
    ),
    "wrong stop": Case(
        "InsertStop", OUT, {**PRESS, 3: {"execute": True, "mode": 7}}
    ),
    "dead channel": Case("InsertStop", OUT, PRESS, absent=(2, 50)),
    "select": Case(
        "SelectProgram",
        MODE,
        {**PRESS, 3: {"execute": True, "program": "part.nc"}},
        started=False,
        named={"program": "program_name"},
    ),
    "start": Case(
        "StartProgram",
        MODE,
        PRESS,
        started=False,
        script=(line(2),),
        named={"program": "program_name"},
    ),
    "hold": Case("StopProgram", MODE, PRESS),
    "resume nothing": Case("ResumeProgram", MODE, PRESS),
    "abort": Case("AbortProgram", MODE, PRESS),
    "reset": Case("ResetChannel", MODE, PRESS),
    "mdi": Case(
        "RunMdi",
        MODE,
        {**PRESS, 3: {"execute": True, "text": "G01 X1"}},
        started=False,
        named={"text": "blocks"},
    ),
    "forbidden state": Case(
        "ModeControl",
        MODE,
        {**PRESS, 3: {"execute": True, "to_mode": 1, "to_state": 5}},
    ),
    "no mode": Case(
        "ModeControl", MODE, {**PRESS, 3: {"execute": True, "to_mode": 9}}
    ),
    "fault": Case(
        "ModeControl",
        MODE,
        {**PRESS, 3: {"execute": True, "to_mode": 2, "to_state": 5}},
        script=(line(0.4), cnc_error(7), line(30)),
    ),
}


def _kind(value: Any) -> str:
    if isinstance(value, bool):
        return "BOOL"
    if isinstance(value, str):
        return "STRING(299)"
    return "LREAL" if isinstance(value, float) else "INT"


def _text(case: Case) -> str:
    given = {k: v for inputs in case.inputs.values() for k, v in inputs.items()}
    declared = "".join(f"i_{k} : {_kind(v)}; " for k, v in given.items())
    first = {k: v for k, v in given.items() if isinstance(v, (int, float))}
    known = {"to_mode": 2, "to_state": 4, "mode": 1}
    for name in first.keys() & known.keys():
        declared = declared.replace(
            f"i_{name} : INT;", f"i_{name} : INT := {known[name]};"
        )
    passed = ", ".join(f"{case.named.get(k, k)} := i_{k}" for k in given)
    return (
        f"PROGRAM MAIN\nVAR fb : {case.block}; {declared}END_VAR\n"
        f"fb({passed});\nEND_PROGRAM\n"
    )


def _twin(block: Callable[..., Any]) -> type:
    @task()
    class Twin:
        inputs: Inputs

        def setup(self, hli: Any) -> None:
            self.inputs = {}
            self.fb = block(hli.gpCh[0])

        def cyclic(self) -> None:
            self.fb(**self.inputs)

    return Twin


def _value(holder: Any, path: str) -> Any:
    for part in path.split("."):
        holder = getattr(holder, part)
    return holder


def _trace(
    runner: PlcRunner, case: Case, put: Callable[[str, Any], None]
) -> list[tuple[Any, ...]]:
    """Outputs and units after each scan."""
    main = runner.task
    rows = []
    for scan in range(case.scans):
        for name, value in case.inputs.get(scan, {}).items():
            put(name, value)
        if scan in case.absent:
            present = scan != case.absent[0]
            runner.ch.head.plc_present_w = present
        runner.step()
        found = [_value(main.fb, name) for name in case.outputs]
        found += [_value(runner.ch, path) for path in case.units]
        rows.append(tuple(found))
    return rows


@pytest.mark.parametrize("name", CASES)
def test_twins_do_the_same_in_every_scan(
    plc: PlcFactory, tmp_path: Path, name: str
) -> None:
    """Outputs and command units are the same after each scan."""
    case = CASES[name]
    path = tmp_path / "logic.st"
    path.write_text(_text(case))

    made: dict[str, Any] = {"script": case.script, "autostart": case.started}

    runner = plc(_twin(getattr(blocks, case.block)), **made)
    expected = _trace(runner, case, runner.task.inputs.__setitem__)
    runner = plc(path, **made)
    task_ = runner.task
    found = _trace(runner, case, lambda k, v: setattr(task_, f"i_{k}", v))
    for scan, pair in enumerate(zip(found, expected, strict=True)):
        assert pair[0] == pair[1], f"scan {scan}"
    assert len(set(expected)) > 1
