"""PlcRunner on the mock: stepping, tasks, watch, force, restart, statistics,
task watchdog, latched inputs.
"""

import math
import re
from typing import Any

import numpy as np
import pytest

from hli.symbol import SymbolError
from plc_client import ContourLookahead, task
from plc_client.mock import MockCnc, arc, line, log_off, log_on, log_param, m
from plc_client.online import Forces
from plc_client.runner import PlcRunner
from plc_client.task import PlcError

DISTANCE = "HLI_Global_Variables.gpCh[0]^.bahn_state.dist_prog_start"
OVERRIDE = "HLI_Global_Variables.gpCh[0]^.bahn_mc_control.override.command_w"


@task(interval=0.002, priority=5)
class Slow:
    """Counts and remembers the inputs it sees."""

    def setup(self, hli: Any) -> None:
        self.ch = hli.gpCh[0]
        self.n = 0
        self.gain = 1.0
        self.distance = self.out = 0.0
        self.table = [0, 0]

    def cyclic(self) -> None:
        self.n += 1
        self.distance = self.ch.bahn_state.dist_prog_start
        self.out = self.gain * self.distance
        self.table[1] = self.n


@task(interval=0.001, priority=1)
class Fast(Slow):
    """Runs before Slow where both are due."""


@task()
class Follow:
    """Collects both modes."""

    def setup(self, hli: Any) -> None:
        unit = hli.gpCh[0].contour_lookahead
        self.contour, self.log = ContourLookahead(unit), ContourLookahead(unit)
        self.seen: list[int] = []
        self.entries: list[int] = []

    def cyclic(self) -> None:
        self.seen += [
            int(b["block_number"]) for b in self.contour.follow(200_000.0)
        ]
        self.entries += [int(b["block_type"]) for b in self.log.read_log()]


@task(watchdog=0.3)
class Endless:
    """Never returns from its third scan."""

    def setup(self, hli: Any) -> None:
        self.n = 0

    def cyclic(self) -> None:
        self.n += 1
        while self.n >= 3:
            pass


def test_steps_to_cycle_time_distance_and_end() -> None:
    """Each stops before the scan whose inputs first fulfil it."""
    with PlcRunner.on_mock(Fast, [line(10)]) as plc:
        assert (plc.cycle, plc.task.n) == (0, 0)
        plc.step()
        assert (plc.cycle, plc.task.n) == (1, 1)
        plc.run_to_cycle(10)
        assert (plc.cycle, plc.task.n) == (10, 10)
        plc.run_to_time(0.02)
        assert plc.cycle == 20
        plc.run_to_distance(50_000.0)
        assert (plc.cycle, plc.distance) == (50, pytest.approx(50_000.0))
        plc.run_to_end()
        assert plc.ended
        with pytest.raises(PlcError, match=r"plc\.cycle < 0"):
            plc.run_until(lambda: plc.cycle < 0, limit_s=0.01)


def test_tasks_have_intervals_priorities_and_one_latched_input() -> None:
    """Slow every second cycle, both see the same distance in one scan;
    statistics name every task.
    """
    with PlcRunner.on_mock([Slow, Fast], [line(10)]) as plc:
        plc.run_to_cycle(21)
        assert (plc["Fast"].n, plc["Slow"].n) == (21, 11)
        assert (
            plc["Fast"].distance
            == plc["Slow"].distance
            == pytest.approx(20_000.0)
        )
        found = plc.statistics()
        assert list(found) == ["Fast", "Slow"]
        assert set(found["Fast"]) >= {
            "scans",
            "min_us",
            "mean_us",
            "max_us",
            "jitter_us",
            "overruns",
        }
        assert (
            found["Slow"]["scans"],
            found["Slow"]["overruns"],
            found["Slow"]["jitter_us"],
        ) == (11, 0, 0.0)


def test_inputs_are_latched_while_the_cnc_runs_on() -> None:
    """A state that changes inside a scan is seen by the next one (what freerun and realtime do)."""
    cnc = MockCnc([line(10)])
    with PlcRunner.on_mock(Fast, cnc) as plc:
        plc.step(5)
        plc._scanner._latch()
        before = plc.ch.bahn_state.dist_prog_start
        cnc.run_to(cnc.cycles + 5)
        assert plc.ch.bahn_state.dist_prog_start == before
        assert plc.distance > before
        plc._scanner._latch()
        assert plc.ch.bahn_state.dist_prog_start == plc.distance


def test_watch_records_hli_and_task_variables() -> None:
    """One row per scan; a path added later begins with NaN."""
    with PlcRunner.on_mock(Fast, [line(10)]) as plc:
        plc.watch(DISTANCE, "Fast.out", "fast.table[1]")
        plc.step(10)
        plc.watch("Fast.gain")
        plc.step(10)
        trace = plc.trace()
    assert trace["t"] == pytest.approx(np.arange(20) * 0.001)
    assert (trace[DISTANCE] == trace["Fast.out"]).all()
    assert list(trace["fast.table[1]"]) == list(range(1, 21))
    assert np.isnan(trace["Fast.gain"][:10]).all()
    assert (trace["Fast.gain"][10:] == 1.0).all()


def test_force_holds_inputs_outputs_and_variables() -> None:
    """A forced input is what the tasks see, a forced output what the CNC sees; unforce lets go."""
    with PlcRunner.on_mock(Fast, [line(100)]) as plc:
        for unit in ("override", "override_valid"):
            plc.symbol(f"gpCh[0]^.bahn_mc_control.{unit}.enable_w").value = True
        plc.symbol(
            "gpCh[0]^.bahn_mc_control.override_valid.command_w"
        ).value = True
        plc.force(OVERRIDE, 500)
        plc.force(DISTANCE, 123.0)
        plc.force("Fast.gain", 2.0)
        plc.step(20)
        assert (plc.task.distance, plc.task.out) == (123.0, 246.0)
        assert plc.cnc is not None
        assert plc.cnc.speed_mm_s == 50.0
        plc.unforce(DISTANCE)
        plc.step(2)
        assert plc.task.distance == pytest.approx(plc.distance, abs=2000.0)
        plc.unforce()
        plc.task.gain = 3.0
        plc.step()
        assert plc.task.gain == 3.0
        with pytest.raises(OverflowError):
            plc.force(OVERRIDE, 70_000)
        with pytest.raises(SymbolError, match="tasks: Fast"):
            plc.force("Nobody.x", 1)
        with pytest.raises(
            SymbolError, match=r"'fast\.gain' is not forced; forced: nothing"
        ):
            plc.unforce("fast.gain")


class Forced:
    """A task with a list, a number and nothing else."""

    def setup(self, _hli: Any) -> None:
        self.table, self.gain = [1, 2], 1.0

    def cyclic(self) -> None:
        """Nothing to do."""


@pytest.mark.parametrize("path", ["Forced.table[9]", "Forced.gain.deep"])
def test_a_variable_that_takes_no_force_is_named(path: str) -> None:
    """A force that cannot be written is an error with symbol and value, not a
    trace of the runtime.
    """
    with PlcRunner.on_mock(Forced, [line(10)]) as plc:
        forces = Forces()
        forces._forced[path] = (
            plc.symbol(path),
            3,
        )  # as the command line does, before setup() has made the variables
        with pytest.raises(SymbolError, match=f"force {re.escape(path)}=3: "):
            forces.apply()


@pytest.mark.parametrize(
    ("path", "members"),
    [
        ("gpCh[0]^", "head, "),
        ("gpCh[0]^.bahn_mc_control.override", "enable_w, "),
        ("gpAx[0]^.lr_state", ""),
    ],
)
def test_a_structure_is_no_watch(path: str, members: str) -> None:
    """The watch list holds numbers; a structure is refused with its members."""
    with (
        PlcRunner.on_mock(Forced, [line(10)]) as plc,
        pytest.raises(SymbolError, match=f"name a member: .*{members}"),
    ):
        plc.watch(path)


def test_plc_restarts_beside_a_cnc_that_runs_on() -> None:
    """New instances, setup() again, the CNC's cycle and distance stay."""
    with PlcRunner.on_mock(Fast, [line(100)]) as plc:
        plc.step(100)
        old, distance, cycle = plc.task, plc.distance, plc.cycle
        plc.restart()
        assert plc.task is not old
        assert (plc.task.n, plc.distance, plc.cycle) == (0, distance, cycle)
        plc.step(10)
        assert (plc.task.n, plc.cycle) == (10, cycle + 10)
        assert plc.statistics()["Fast"]["restarts"] == 1


def test_runaway_task_is_an_error_with_its_line() -> None:
    """The task watchdog ends an endless loop; the text says which task, where and how long."""
    with PlcRunner.on_mock(Endless, [line(10)]) as plc:
        with pytest.raises(
            PlcError, match=r"cyclic\(\) of Endless did not return within 0.3 s"
        ) as caught:
            plc.step(10)
        assert "test_plc_runner.py:" in str(caught.value)
        assert plc.task.n == 3


def test_both_look_ahead_modes_run_against_the_mock_unchanged() -> None:
    """Every element and every log entry once, markers included, in order."""
    script = [
        line(30),
        log_on(1),
        arc(20, math.pi / 2),
        log_param(5.5),
        line(10),
        log_off(2),
        m(50, waits=False),
    ]
    with PlcRunner.on_mock(Follow, script) as plc:
        plc.step(50)
        assert plc.task.seen == [10, 30, 50]
        assert plc.task.entries == [3, 2, 4, 1, 5]
        assert plc.cnc is not None
        assert {length == 0.0 for _, length in plc.cnc.requests} == {
            True,
            False,
        }


def test_mock_knows_no_more_than_its_window() -> None:
    """max_dist_prog_start: the active motion and `ahead` more."""
    with MockCnc([line(1) for _ in range(100)], ahead=10) as cnc:
        assert cnc.known() == 11 * 10_000.0


@pytest.mark.parametrize(
    ("tasks", "text"),
    [
        (int, "task int has no method cyclic"),
        ([], "no task given"),
        (Fast(), "the class itself is needed"),
        ("nowhere.py", "nowhere.py: file not found"),
    ],
)
def test_what_is_no_task_is_refused(tasks: Any, text: str) -> None:
    """When the runner is made, by name."""
    with pytest.raises(PlcError, match=text):
        PlcRunner.on_mock(tasks, [line(10)])


def test_wrong_steps_names_and_scripts_are_told() -> None:
    """Negative scans, a task that is not there, a script of numbers."""
    with PlcRunner.on_mock(Fast, [line(10)]) as plc:
        with pytest.raises(ValueError, match="step of -1 scans"):
            plc.step(-1)
        with pytest.raises(KeyError, match="no task Slow; tasks: Fast"):
            _ = plc["Slow"]
    with pytest.raises(TypeError, match=r"script\[1\] = 30: a step is needed"):
        MockCnc([line(10), 30])  # type: ignore[list-item]


def test_a_task_needs_no_brackets() -> None:
    """``@task`` is ``@task()``."""

    @task
    class Plain:
        def cyclic(self) -> None:
            """Nothing to do."""

    with PlcRunner.on_mock(Plain) as plc:
        plc.step(3)
        assert (
            plc.statistics()["test_a_task_needs_no_brackets.<locals>.Plain"][
                "interval_s"
            ]
            == 0.001
        )


def test_an_interval_that_is_no_multiple_of_the_cycle_is_told() -> None:
    """It runs at the next whole number of cycles, and says so."""

    @task(interval=0.0025)
    class Odd:
        def cyclic(self) -> None:
            """Nothing to do."""

    with PlcRunner.on_mock([Odd, Fast], [line(1)], cycle_s=0.002) as plc:
        texts = [text.split(": ", 1)[1] for text in plc.warnings]
        intervals = {t["interval_s"] for t in plc.statistics().values()}
    end = "ms is no multiple of the cell's cycle of 2 ms; it runs every 2 ms"
    assert texts == [f"2.5 {end}", f"1 {end}"]
    assert intervals == {0.002}
    with PlcRunner.on_mock([Slow, Fast], [line(1)]) as plc:
        assert plc.warnings == []
