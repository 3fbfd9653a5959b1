"""Function blocks on the HLI: those in Structured Text behave as those in Python.

One suite runs both on a mock CNC each, with the same inputs in the same scans;
after every scan the outputs and the command units are the same.
"""

from __future__ import annotations

import inspect
from pathlib import Path
from typing import Any

import pytest

from cnc_core.pytest_plugin import PlcFactory
from plc_client import blocks
from plc_client.st.source import library
from support.st_twins import CASES
from support.st_twins.case import Case, text_of, trace, twin_of

Row = tuple[Any, ...]


@pytest.mark.parametrize("name", CASES)
@pytest.mark.ci_cases
def test_twins_do_the_same_in_every_scan(
    plc: PlcFactory, tmp_path: Path, name: str
) -> None:
    """Outputs and command units are the same after each scan."""
    case = CASES[name]
    path = tmp_path / "logic.st"
    path.write_text(text_of(case))
    made: dict[str, Any] = {"script": case.script, "autostart": case.started}
    made |= case.mock

    runner = plc(twin_of(case), **made)
    expected = trace(runner, case, runner.task.inputs.__setitem__, 0)
    runner = plc(path, **made)
    task = runner.task
    found = trace(runner, case, lambda k, v: setattr(task, f"i_{k}", v), 1)
    for scan, pair in enumerate(zip(found, expected, strict=True)):
        assert not _differences(case, *pair), f"scan {scan}"
    assert len(set(map(repr, expected))) > 1


def _differences(case: Case, found: Row, expected: Row) -> list[Any]:
    names = (*case.outputs, *case.units)
    rows = zip(names, found, expected, strict=True)
    return [row for row in rows if row[1] != _nearly(row[2])]


def _nearly(value: Any) -> Any:
    return (
        pytest.approx(value, rel=1e-12) if isinstance(value, float) else value
    )


def _called_each_scan() -> set[str]:
    """The blocks that a program can make and call."""
    found = [getattr(blocks, name) for name in blocks.__all__]
    return {
        cls.__name__ for cls in found if inspect.isclass(cls) and _is_block(cls)
    }


def _is_block(cls: type) -> bool:
    """Neither an Enum (its class can be called) nor a base alone."""
    return any("__call__" in vars(base) for base in cls.__mro__[:-1])


def test_every_block_has_its_twin_in_the_suite() -> None:
    """A block in Python alone, or one that no case runs, is an error."""
    wanted = _called_each_scan()
    assert len(wanted) > 30
    assert not {name for name in wanted if name.upper() not in library.names()}
    assert not wanted - {case.block for case in CASES.values()}
