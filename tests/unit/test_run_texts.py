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
from cnc_core.cell.judgement import judge
from cnc_core.commands.tables import print_run, say_figures, value_lines
from cnc_core.engine.causes import hints
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


def failed(error: str, status: int) -> RunResult:
    """The result of a run whose PLC has ended so."""
    result = RunResult(end="aborted", plc={"error": error} if error else {})
    process = SimpleNamespace(poll=lambda: status)
    plc: Any = SimpleNamespace(process=process, said=lambda: "")
    job: Any = SimpleNamespace(out_of_time=False, stalled=False, plc=plc)
    judge(result, job, {"end": "aborted"})
    return result


@pytest.mark.parametrize(
    ("error", "place"),
    [
        ("a.st:3:8: 952001: type FeedHodl is unknown", ("a.st", 3, 8)),
        ("/x/a.py:7: ValueError: no", ("/x/a.py", 7, 1)),
    ],
)
def test_an_error_of_the_plc_has_its_place(
    error: str, place: tuple[str, int, int]
) -> None:
    """A column of Structured Text was taken for the line."""
    (found,) = failed(error, 1).errors
    assert (found["file"], found["line"], found["column"]) == place


@pytest.mark.parametrize(
    ("status", "how"),
    [(3, "exit status 3"), (-9, "by SIGKILL"), (-11, "by SIGSEGV")],
)
def test_a_dead_process_tells_how_it_died(status: int, how: str) -> None:
    """By which signal, or with which status."""
    (found,) = failed("", status).errors
    assert found["text"].endswith(f"the PLC process died {how}") or (
        found["text"].endswith(f"the PLC process died with {how}")
    )


def test_the_end_of_the_wall_time_has_a_place() -> None:
    """Behind a CNC that does not look at its time, too."""
    wait = {"file": "p.nc", "line": 2, "n": 20, "what": "M5", "since_s": 3.0}
    result = RunResult(waiting=[wait | {"who": "the PLC"}])
    job: Any = SimpleNamespace(out_of_time=True)
    judge(result, job, {})
    (found,) = result.errors
    assert (found["file"], found["line"]) == ("p.nc", 2)
    assert "N20: waits for M5 for 3.0 s; the PLC" in found["text"]


def test_short_runs_get_no_hint() -> None:
    """An empty program was told of a PLC that acknowledges late."""
    assert hints({"wait": 0.012}) == []
    assert len(hints({"wait": 1.2})) == 1


def test_a_task_keeps_to_80_columns(
    capsys: pytest.CaptureFixture[str],
) -> None:
    """With overruns its line had 85."""
    task = {"scans": 1670, "interval_s": 0.001, "mean_us": 22.88}
    task |= {"max_us": 3730.0, "overruns": 511}
    plc = {"tasks": {"acknowledge": task}}
    print_run(RunResult(cycles=1, blocks=1, plc=plc), "a.nc")
    out = capsys.readouterr().out
    assert "511 overruns" in " ".join(out.split())
    assert max(map(len, out.splitlines())) <= 80
