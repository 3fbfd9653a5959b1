"""What a run says of itself in a script, and at Ctrl-C."""

from __future__ import annotations

import os
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from cnc_core import RunResult
from cnc_core.catalogue import explain
from cnc_core.cell import RunInterrupted
from cnc_core.commands.tables import print_run, say_figures, value_lines
from cnc_core.errors import CncError


def test_printed_result_is_one_line() -> None:
    """``print(cell.run(..))`` showed all fields with 16 digits each."""
    result = RunResult(end="completed", sim_time_s=1.6672, blocks=6)
    assert str(result) == "completed: 1.6672 s of cell time, 6 blocks"
    result.errors.append({"text": "the reason"})
    assert str(result).endswith("; the reason")


def test_interrupt_names_a_recording_without_rows() -> None:
    """Its file was there, and the line said that nothing was written."""
    found: Any = SimpleNamespace()
    empty = RunResult(recording=found)
    assert "written: a.npz" in str(RunInterrupted(empty, Path("a.npz")))
    assert "written: nothing" in str(RunInterrupted(RunResult(), Path("a.npz")))


@pytest.mark.parametrize(("name", "shown"), [("mill", True), ("", False)])
def test_a_name_that_was_given_is_printed(
    capsys: pytest.CaptureFixture[str], name: str, shown: bool
) -> None:
    """``run --name mill``; a name that the run made for itself is not."""
    own = name or f"hli-cosim-{os.getpid()}-0f"
    print_run(RunResult(cycles=1, blocks=1, name=own), "part.nc")
    assert (own in capsys.readouterr().out) is shown


def test_truth_has_no_unit() -> None:
    """``enable_w`` of an override was FALSE x 0.1 %."""
    path = "gpCh[0].bahn_mc_control.override.enable_w"
    assert list(value_lines({path: False})) == [f"{path} = FALSE"]


def test_a_part_of_a_number_finds_those_that_begin_so() -> None:
    """``explain 9050`` named numbers from elsewhere."""
    with pytest.raises(CncError, match=r"near it: 90500\d"):
        explain(9050)


def test_results_of_tasks_are_printed(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """What ``result()`` gives stood in --json alone."""
    run = RunResult(
        cycles=1, blocks=1, end="completed", plc={"result": {"a": 1 / 3}}
    )
    print_run(run, "part.nc")
    assert "result\n  a = 0.3333\n" in capsys.readouterr().out


def test_causes_of_time_have_a_unit(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """The row listed nine figures without a unit, most of them 0."""
    say_figures("part.nc", {"time_by_cause": {"feed": 0.5, "dwell": 0.0}})
    shown = capsys.readouterr().out
    assert "feed 0.5 s" in shown
    assert "dwell" not in shown
