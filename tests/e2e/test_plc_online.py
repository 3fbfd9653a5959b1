"""PLC beside the real CNC: stepped from the test, in every clock, watched,
forced, restarted, golden; runaway tasks.
"""

from __future__ import annotations

import json
import signal
import textwrap
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import hli
from cnc_core import Cell, CncError
from plc_client import connect
from plc_client.golden import GoldenMismatchError, check, compare
from plc_client.mock import arc, line
from support.fake_cnc import unique_name
from support.plc.same_everywhere import SameEverywhere
from support.processes import end, start_cnc, start_plc

Write = Callable[..., Path]
PART = """N10 G01 X30 Y0 F6000
N20 G03 X40 Y10 I0 J10
N30 G01 Y40
N40 X0
M30
"""
DISTANCE = "HLI_Global_Variables.gpCh[0]^.bahn_state.dist_prog_start"


def wait_for(condition: Callable[[], bool], seconds: float = 30.0) -> None:
    """Until it is true; an error after a long time instead of a hang."""
    end_s = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end_s
        time.sleep(0.005)


def test_stepping_the_real_cnc_to_cycle_time_distance(
    plc: Any, program: Write
) -> None:
    """The test holds the clock: nothing moves between two steps."""
    runner = plc(SameEverywhere, program(PART))
    runner.run_to_cycle(20)
    assert runner.cycle == 20
    runner.run_to_time(0.1)
    assert runner.cycle == 100
    runner.run_to_distance(200_000.0)
    here = runner.distance
    assert 200_000.0 <= here < 201_000.0
    time.sleep(0.05)
    assert runner.distance == here
    runner.run_to_end()
    assert runner.task.result()["elements"] == [10, 20, 30, 40]


@pytest.mark.parametrize("clock", ["lockstep", "freerun", "realtime"])
@pytest.mark.ci_cases
def test_same_program_in_every_clock(program: Write, clock: str) -> None:
    """The PLC program of the unit test runs unchanged as a process and sees the same contour."""
    with Cell(clock=clock) as cell:
        result = cell.run(program(PART), SameEverywhere, clock=clock)
    assert result.end == "completed", result.errors
    found = result.plc["result"]
    if (
        clock == "freerun"
    ):  # nobody waits for the PLC there: it may come late, but sees nothing wrong
        assert set(found["elements"]) <= {10, 20, 30, 40}
    else:
        assert (found["elements"], found["arcs"], found["commanded"]) == (
            [10, 20, 30, 40],
            1,
            True,
        )
    assert result.plc["tasks"]["SameEverywhere"]["scans"] > 10


def test_same_program_on_the_mock(plc: Any) -> None:
    """And without any engine."""
    runner = plc(
        SameEverywhere,
        script=[line(30), arc(10, 1.5707963), line(30), line(40)],
    )
    runner.run_to_end()
    found = runner.task.result()
    assert (found["elements"], found["arcs"], found["commanded"]) == (
        [10, 20, 30, 40],
        1,
        True,
    )


@pytest.mark.ci
def test_watch_and_force_of_a_run(program: Write) -> None:
    """A forced task variable holds the override down; the watch list shows both sides."""
    watch = (
        DISTANCE,
        "SameEverywhere.percent",
        "gpCh[0]^.bahn_state.override_r",
    )
    with Cell() as cell:
        result = cell.run(
            program(PART),
            SameEverywhere,
            watch=watch,
            force={"SameEverywhere.slow": 25.0},
        )
    assert result.end == "completed", result.errors
    found = result.plc["watch"]
    assert set(found) == {"t", *watch}
    assert len(found["t"]) == result.plc["scans"]
    assert min(found["SameEverywhere.percent"]) == 25.0
    assert min(found["gpCh[0]^.bahn_state.override_r"]) == 250.0
    assert found[DISTANCE][-1] == pytest.approx(
        300_000 + 157_079.63 + 300_000 + 400_000, abs=1.0
    )


def test_wrong_symbol_ends_the_run_with_its_name(program: Write) -> None:
    """No traceback; the text names what there would be."""
    with Cell() as cell:
        result = cell.run(
            program(PART), SameEverywhere, watch=["SameEverywhere"]
        )
    assert result.end != "completed"
    assert "a variable of task SameEverywhere is needed" in json.dumps(
        result.errors
    )


@pytest.mark.parametrize(
    "force",
    ["gpCh[0]^.bahn_mc_control.override.command_w=70000", "Nothing.table[9]=3"],
)
def test_a_force_that_does_not_fit_ends_the_run_with_its_name(
    program: Write, cli: Callable[..., Any], force: str
) -> None:
    """Exit 1 with symbol, value and reason on one line."""
    plc = "class Nothing:\n    def setup(self, hli): self.table = []\n    def cyclic(self): pass\n"
    path = program("from plc_client import task\n@task()\n" + plc, "nothing.py")
    done = cli("run", program(PART), "--plc", path, "--force", force)
    assert done.status == 1
    assert f"force {force}: " in done.err
    assert "Traceback" not in done.err


def test_golden_run_is_compared_with_tolerance(plc: Any, golden: Any) -> None:
    """The kept run fits; a small change is seen with its place, and passes
    within a larger tolerance.
    """
    runner = plc(
        SameEverywhere,
        script=[line(30), arc(10, 1.5707963), line(30), line(40)],
    )
    runner.watch("SameEverywhere.percent", DISTANCE)
    runner.run_to_cycle(400)
    columns = {name: values[::20] for name, values in runner.trace().items()}
    golden(columns, "same_everywhere", tolerance=1e-3)
    columns[DISTANCE] = columns[DISTANCE] + (columns["t"] > 0.25) * 5.0
    with pytest.raises(GoldenMismatchError, match=r"row 13 \(t = 0.26 s\)"):
        compare(golden.path("same_everywhere"), columns, tolerance=1.0)
    compare(
        golden.path("same_everywhere"),
        columns,
        tolerance={DISTANCE: 10.0, "t": 1e-6},
    )


@pytest.mark.ci
def test_two_runs_beside_the_real_cnc_are_bit_identical(
    plc: Any, program: Write, tmp_path: Path
) -> None:
    """What a golden run relies on."""
    traces = []
    for _ in range(2):
        runner = plc(SameEverywhere, program(PART))
        runner.watch("SameEverywhere.percent", DISTANCE)
        runner.run_to_cycle(300)
        traces.append(runner.trace())
        runner.close()
    check(tmp_path / "first.csv", traces[0], update=True)
    for name in traces[0]:
        assert (traces[0][name] == traces[1][name]).all(), name
    compare(tmp_path / "first.csv", traces[1], tolerance=1e-4)


@pytest.mark.ci
def test_runaway_task_ends_the_run_with_an_error(program: Write) -> None:
    """Lockstep does not hang: the error names task and line."""
    path = program(
        textwrap.dedent("""
        from plc_client import task

        @task(watchdog=0.5)
        class Endless:
            def cyclic(self):
                while True:
                    pass
        """),
        "endless.py",
    )
    with Cell() as cell:
        result = cell.run(program(PART), path)
    assert result.end == "error"
    assert (
        "task watchdog: cyclic() of Endless did not return within 0.5 s"
        in result.errors[0]["text"]
    )
    assert result.errors[0]["line"] in (7, 8)


@pytest.mark.ci
@pytest.mark.usefixtures("leftovers")
def test_signal_restarts_the_plc_beside_a_cnc_that_runs_on(
    tmp_path: Path,
) -> None:
    """SIGUSR1: the file is read anew, setup() runs, the CNC's cycles go on."""
    code = """
        from plc_client import task
        @task()
        class T:
            version = {version}
            def setup(self, hli):
                hli.gpVECh[0][1] = self.version
                hli.gpVECh[0][0] += 1
            def cyclic(self): pass
            def finished(self): return False
        """
    name, file, report = (
        unique_name(),
        tmp_path / "p.py",
        tmp_path / "report.json",
    )
    file.write_text(textwrap.dedent(code.format(version=1)))
    cnc = start_cnc(name, lengths=[1e9])
    process = start_plc(name, "--file", str(file), "--report", str(report))
    with connect(name, role="reader", wait_s=10.0) as reader:
        wait_for(lambda: reader.plc.scans >= 5)
        cycle, identity = reader.cycle, reader.plc.generation
        file.write_text(textwrap.dedent(code.format(version=2)))
        process.send_signal(signal.SIGUSR1)
        wait_for(lambda: reader.gpVECh[0][0] >= 2)
        assert (reader.gpVECh[0][1], reader.plc.generation) == (2, identity)
        assert reader.cycle >= cycle
    process.send_signal(signal.SIGTERM)
    process.communicate(timeout=60)
    assert json.loads(report.read_text())["tasks"]["T"]["restarts"] == 1
    end(cnc)
    hli.sweep()


@pytest.mark.ci
@pytest.mark.usefixtures("leftovers")
def test_a_broken_file_is_refused_at_a_restart_and_a_new_text_counts(
    tmp_path: Path,
) -> None:
    """The old tasks run on; then interval, a new task and a task that is gone
    are taken from the text.
    """
    code = """
        from plc_client import task
        @task(interval={interval})
        class {one}:
            def cyclic(self): pass
            def finished(self): return False
        @task
        class Stays:
            def setup(self, hli): self.shared = hli.gpVECh[0]
            def cyclic(self): self.shared[0] = {version}
        """
    name, file, report = (
        unique_name(),
        tmp_path / "p.py",
        tmp_path / "report.json",
    )
    file.write_text(
        textwrap.dedent(code.format(one="First", interval=0.001, version=1))
    )
    cnc = start_cnc(name, lengths=[1e9])
    process = start_plc(name, "--file", str(file), "--report", str(report))
    with connect(name, role="reader", wait_s=10.0) as reader:
        wait_for(lambda: reader.gpVECh[0][0] == 1)
        file.write_text("class Broken(:\n")
        process.send_signal(signal.SIGUSR1)
        time.sleep(0.2)
        scans = reader.plc.scans
        wait_for(lambda: reader.plc.scans > scans + 5)
        file.write_text(
            textwrap.dedent(
                code.format(one="Second", interval=0.002, version=2)
            )
        )
        process.send_signal(signal.SIGUSR1)
        wait_for(lambda: reader.gpVECh[0][0] == 2)
        scans = reader.plc.scans
        wait_for(lambda: reader.plc.scans > scans + 5)
    process.send_signal(signal.SIGTERM)
    said = process.communicate(timeout=60)[1]
    assert "restart refused, the old program runs on" in said
    assert "p.py:1: SyntaxError" in said
    tasks = json.loads(report.read_text())["tasks"]
    assert set(tasks) == {"First", "Stays", "Second"}
    assert (
        tasks["Second"]["interval_s"],
        tasks["Stays"]["restarts"],
        tasks["First"]["restarts"],
    ) == (0.002, 1, 0)
    end(cnc)
    hli.sweep()


def test_run_without_any_plc(program: Write) -> None:
    """No second process: same path, functions count as acknowledged."""
    path = program(PART)
    with Cell() as cell:
        alone, beside = cell.run(path, "none"), cell.run(path)
    assert (alone.end, alone.plc) == ("completed", {})
    assert abs(alone.cycles - beside.cycles) <= 30  # the scans behind the end


@pytest.mark.ci
def test_stop_that_nobody_continues_ends_a_run_without_plc(
    program: Write,
) -> None:
    """Not a hang but an error with its number and the line of the stop."""
    with Cell() as cell:
        result = cell.run(
            program("N10 G01 X1 F6000\nM0\nN20 X2\nM30\n"), "none"
        )
    assert result.end == "error"
    (error,) = result.errors
    assert (error["code"], error["line"]) == (905024, 2)


@pytest.mark.parametrize(
    ("wrong", "text"),
    [
        ({"clock": "slow"}, "clock 'slow': lockstep, freerun, realtime"),
        (
            {"force": {"SameEverywhere.slow": [1]}},
            r"force SameEverywhere.slow=\[1\]: a number",
        ),
        ({"plc": 5}, "PLC 5: a file, a class of a file"),
        ({"plc": int}, "start_plc runs any class in this process"),
    ],
)
def test_wrong_arguments_of_a_run_are_refused_before_anything_starts(
    program: Write, wrong: dict[str, Any], text: str
) -> None:
    """By name."""
    with Cell() as cell, pytest.raises(CncError, match=text):
        cell.run(program(PART), **{"plc": SameEverywhere, **wrong})


@pytest.mark.ci
def test_one_symbol_is_a_watch_list_and_a_misspelt_one_ends_the_run(
    program: Write,
) -> None:
    """With the nearest name, before the program begins; results of a task
    without setup() are not asked for.
    """
    with Cell() as cell:
        result = cell.run(
            program(PART), SameEverywhere, watch="SameEverywhere.percnt"
        )
        assert (
            "SameEverywhere has no variable 'percnt'; did you mean percent?"
            in json.dumps(result.errors)
        )
        assert (result.end, result.cycles) == ("error", 0)
        result = cell.run(
            program(PART), SameEverywhere, watch="SameEverywhere.percent"
        )
    assert set(result.plc["watch"]) == {"t", "SameEverywhere.percent"}
