"""Simulated inputs: steps by time, distance and M function, inputs that follow
a symbol, setting and forcing them.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from cnc_core.config import parse_config
from cnc_core.errors import ConfigError
from hli.symbol import SymbolError
from plc_client import Input, Step, TechnoServer, task
from plc_client.mock import line, m
from plc_client.runner import PlcRunner

DISTANCE = "gpCh[0]^.bahn_state.dist_prog_start"


@task(interval=0.001)
class Machine:
    """Remembers what it sees of its inputs; M50 opens and shuts the valve."""

    closed = Input(follows="valve", on_delay_s=0.1, off_delay_s=0.02)

    def setup(self, hli: Any) -> None:
        self.functions = TechnoServer(hli)
        self.m50 = self.functions.on("M", 50)
        self.valve = self.door = self.probe = False
        self.pressure = 0.0
        self.seen: list[tuple[bool, ...]] = []

    def cyclic(self) -> None:
        self.functions()
        self.m50()
        if self.m50.rising:
            self.valve = not self.valve
        self.seen.append((self.closed, self.door, self.probe))


def first(runner: PlcRunner, path: str, value: float) -> float:
    """Cell time at which a watched symbol first has a value."""
    trace = runner.trace()
    return float(trace["t"][trace[path] == value][0])


def test_a_contact_changes_with_the_time() -> None:
    """The task sees it in the first scan at or behind that time."""
    steps = [Step(value=True, time_s=0.02), Step(value=False, time_s=0.05)]
    with PlcRunner.on_mock(
        Machine, [line(20)], inputs={"Machine.door": Input(steps=steps)}
    ) as plc:
        plc.step(200)
        door = [row[1] for row in plc.task.seen]
    assert door == [20 <= scan < 50 for scan in range(200)]


@pytest.mark.parametrize("interval_mm", [3.0, 0.0, 10.0])
def test_a_contact_changes_with_the_distance(interval_mm: float) -> None:
    """The first scan whose distance has reached the place sees it."""
    table = {"steps": [{"value": True, "distance_mm": interval_mm}]}
    with PlcRunner.on_mock(
        Machine, [line(20)], inputs={"Machine.probe": table}
    ) as plc:
        plc.watch("Machine.probe", DISTANCE)
        plc.run_to_end()
        trace = plc.trace()
    reached = trace[DISTANCE] >= interval_mm * 1e4 - 1e-3
    assert (trace["Machine.probe"] == reached).all()


def test_every_occurrence_of_an_m_function_counts() -> None:
    """The same M function twice without a motion between changes it twice."""
    steps = [
        Step(value=True, m=50),
        Step(value=False, m=50, delay_s=0.003),
    ]
    with PlcRunner.on_mock(
        Machine,
        [line(1), m(50), m(50), line(1), m(51), line(1)],
        inputs={"Machine.door": Input(steps=steps)},
    ) as plc:
        plc.watch("Machine.door", "Machine.valve")
        plc.run_to_end()
        trace = plc.trace()
    door = trace["Machine.door"]
    assert first(plc, "Machine.door", 1.0) == first(plc, "Machine.valve", 1.0)
    # 3 ms each, the second begins a cycle behind the first or later
    assert 3 <= door.sum() <= 6
    assert door[-1] == 0.0


def test_an_actuator_needs_its_time_both_ways() -> None:
    """The contact closes 100 ms behind the valve and opens 20 ms behind it."""
    with PlcRunner.on_mock(
        Machine, [line(1), m(50), line(20), m(50), line(20)]
    ) as plc:
        plc.watch("Machine.valve", "Machine.closed")
        plc.run_to_end()
        trace = plc.trace()
    time, valve, closed = trace["t"], trace["Machine.valve"], []
    closed = trace["Machine.closed"]
    on, off = time[valve == 1.0][0], time[valve == 1.0][-1] + 0.001
    # the scan behind the one that switched sees the valve first
    assert time[closed == 1.0][0] == pytest.approx(on + 0.101)
    assert time[closed == 1.0][-1] + 0.001 == pytest.approx(off + 0.021)


def test_an_actuator_that_turns_back_stays_where_it_was() -> None:
    """A command shorter than the delay does not show."""
    with PlcRunner.on_mock(Machine, [line(100)]) as plc:
        plc.step(10)
        plc.task.valve = True
        plc.step(99)
        plc.task.valve = False
        plc.step(200)
        assert not any(row[0] for row in plc.task.seen)


def test_a_number_lags_and_a_contact_switches_at_a_limit() -> None:
    """63 % behind one time constant; the contact is TRUE above its limit."""
    inputs = {
        "Machine.pressure": {"start": 0.0, "follows": "valve", "lag_s": 0.05},
        "Machine.door": {"follows": "Machine.pressure", "above": 0.5},
    }
    with PlcRunner.on_mock(Machine, [line(100)], inputs=inputs) as plc:
        plc.step(5)
        plc.task.valve = True
        plc.step(51)
        assert plc.task.pressure == pytest.approx(0.632, abs=0.01)
        assert plc.task.door
        plc.task.valve = False
        plc.step(60)
        assert not plc.task.door


def test_a_contact_at_a_place_of_an_axis() -> None:
    """It follows a member of the HLI."""
    table = {"follows": DISTANCE, "below": 50_000.0, "inverted": True}
    with PlcRunner.on_mock(
        Machine, [line(20)], inputs={"Machine.probe": table}
    ) as plc:
        plc.run_to_distance(49_000)
        assert not plc.task.probe
        plc.run_to_distance(60_000)
        assert plc.task.probe


def test_a_test_sets_an_input_and_steps_go_on() -> None:
    """A set value stays until the next step; undescribed symbols too."""
    door = Input(steps=[Step(value=False, time_s=0.05)])
    with PlcRunner.on_mock(
        Machine, [line(20)], inputs={"Machine.door": door}
    ) as plc:
        plc.inputs["machine.door"] = True
        plc.inputs["Machine.probe"] = True
        plc.step(10)
        assert plc.task.seen[-1] == (False, True, True)
        assert plc.inputs["Machine.door"] is True
        plc.step(50)
        assert plc.task.seen[-1] == (False, False, True)
        with pytest.raises(SymbolError, match="force it"):
            plc.inputs["Machine.closed"] = True
        with pytest.raises(SymbolError, match="did you mean door"):
            plc.inputs["Machine.dor"] = True
        with pytest.raises(KeyError, match=r"no input Machine\.valve"):
            plc.inputs["Machine.valve"]


def test_a_force_wins() -> None:
    """The task sees the forced value; let go, it sees the input's again."""
    inputs = {"Machine.door": Input(True)}
    with PlcRunner.on_mock(Machine, [line(20)], inputs=inputs) as plc:
        plc.force("Machine.door", False)
        plc.step(5)
        assert not any(row[1] for row in plc.task.seen)
        plc.unforce("Machine.door")
        plc.step()
        assert plc.task.seen[-1][1]


def test_the_machine_goes_on_when_the_plc_restarts() -> None:
    """A restarted PLC finds the clamp as it stands."""
    inputs = {"Machine.door": Input(steps=[Step(value=True, time_s=0.005)])}
    with PlcRunner.on_mock(Machine, [line(20)], inputs=inputs) as plc:
        plc.step(10)
        plc.restart()
        plc.step()
        assert plc.task.seen == [(False, True, False)]


@pytest.mark.parametrize(
    ("path", "table", "text"),
    [
        ("Machine.dor", {}, "input Machine.dor: .* did you mean door"),
        ("Machine.door", {"follows": "vlve"}, "did you mean valve"),
        (DISTANCE, {}, "name a variable of a task"),
        ("Nobody.x", {}, "input Nobody.x: "),
        ("Machine.door", {"folows": "valve"}, "unknown key 'folows'"),
        ("Machine.door", {"steps": [{"value": True}]}, "one of time_s"),
        ("Machine.door", {"steps": [{"time_s": 1.0}]}, "value is needed"),
        ("Machine.door", {"on_delay_s": 0.1}, "on_delay_s does not fit"),
        (
            "Machine.door",
            {"follows": "valve", "steps": [{"value": 1, "m": 5}]},
            "not both",
        ),
        ("Machine.door", {"follows": "valve", "lag_s": 1.0}, "lag_s does not"),
        ("Machine.door", {"start": "yes"}, "a BOOL or a number"),
        ("Machine.door", {"follows": "seen"}, "no single value"),
    ],
)
def test_mistakes_are_named(path: str, table: Any, text: str) -> None:
    """The input and what is wrong with it."""
    with (
        pytest.raises((SymbolError, ValueError), match=text),
        PlcRunner.on_mock(
            Machine,
            [line(1)],
            inputs={"Machine.probe": True, path: table}
            if False
            else {path: table},
        ) as plc,
    ):
        plc.step()


def test_an_input_of_a_class_has_its_first_value_at_once() -> None:
    """Also without any runtime."""
    machine = Machine()
    assert machine.closed is False
    machine.closed = True
    assert Machine().closed is False


def test_tables_of_a_cell_file() -> None:
    """Names with dots may be nested tables; wrong keys are named."""
    cell = parse_config(
        "[inputs.Clamp.closed]\nfollows = 'valve'\non_delay_s = 0.1\n"
        "[inputs.'Clamp.door']\nstart = true\n"
        "steps = [{value = false, time_s = 0.5}]\n"
        "[inputs.GVL.pressure]\nstart = 2.5\n"
    )
    assert list(cell.simulated_inputs) == [
        "Clamp.closed",
        "Clamp.door",
        "GVL.pressure",
    ]
    assert cell.simulated_inputs["Clamp.door"]["start"] is True
    with pytest.raises(ConfigError, match=r"folows.*did you mean 'follows'"):
        parse_config("[inputs.Clamp.closed]\nfolows = 'valve'\n")
    with pytest.raises(ConfigError, match="one of time_s, distance_mm, m"):
        parse_config("[inputs.C.x]\nsteps = [{value = true}]\n")


@pytest.mark.ci
def test_variables_of_structured_text(tmp_path: Path) -> None:
    """A located variable is an input like any other."""
    source = tmp_path / "Logic.st"
    source.write_text(
        "VAR_GLOBAL\n  bDoor AT %I* : BOOL;\n  bValve AT %QX0.0 : BOOL;\n"
        "END_VAR\n"
        "PROGRAM Main\nVAR bSeen : BOOL; bClosed AT %IX1.0 : BOOL; END_VAR\n"
        "bSeen := bDoor;\nbValve := TRUE;\nEND_PROGRAM\n"
    )
    inputs = {
        "Logic.bDoor": {"steps": [{"value": True, "time_s": 0.01}]},
        "Main.bClosed": {"follows": "Logic.bValve", "on_delay_s": 0.005},
    }
    with PlcRunner.on_mock(source, [line(10)], inputs=inputs) as plc:
        plc.step(5)
        assert not plc["Main"].bClosed
        plc.step(3)
        assert plc["Main"].bClosed
        assert not plc["Main"].bSeen
        plc.step(5)
        assert plc["Main"].bSeen
