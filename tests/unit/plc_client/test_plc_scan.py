"""The scan runtime in real processes, and its schedule on a pacer the test moves."""

import json
import os
import signal
import textwrap
import time
from pathlib import Path

import pytest

import hli
import plc_client.__main__ as plc_main
from hli import layout
from hli.errors import HliTimeout
from plc_client import connect, image, task
from plc_client.mock import MockCnc, line
from plc_client.scan import Ending, Program, Scanner
from plc_client.task import PlcError, load_tasks
from support.fake_cnc import FakeCnc, elements, unique_name
from support.processes import (
    end,
    run_plc,
    start_cnc,
    start_plc,
    wait_for_scans,
)

pytestmark = pytest.mark.usefixtures("leftovers")

COUNTING = """
    from plc_client import task

    @task(interval=0.002, priority=1)
    class Slow:
        def setup(self, hli):
            self.n = 0
        def cyclic(self):
            self.n += 1
        def result(self):
            return self.n

    @task(interval=0.001, priority=0)
    class Fast(Slow):
        pass
"""


FAILING = """\
    from plc_client import task

    @task()
    class T:
        def setup(self, hli):
            self.hli = hli
        def cyclic(self):
"""


def write(path: Path, text: str) -> str:
    """A user's PLC file."""
    path.write_text(textwrap.dedent(text))
    return str(path)


@pytest.mark.ci
def test_two_processes_in_lockstep_end_cleanly_with_a_report(
    tmp_path: Path,
) -> None:
    """Each task at its interval, at least 10 scans after the program's end,
    report written, exit 0.
    """
    name, report = unique_name(), tmp_path / "report.json"
    cnc = start_cnc(name, lengths=[50.0])
    status, text = run_plc(
        name,
        "--file",
        write(tmp_path / "p.py", COUNTING),
        "--once",
        "--report",
        str(report),
    )
    assert (status, text) == (0, "")
    cnc.communicate(timeout=60)
    content = json.loads(report.read_text())
    assert (content["error"], content["overruns"], content["requests"]) == (
        None,
        0,
        0,
    )
    fast, slow = content["tasks"]["Fast"], content["tasks"]["Slow"]
    assert fast["scans"] >= 50 + 10
    assert abs(fast["scans"] - 2 * slow["scans"]) <= 1
    assert content["scans"] == fast["scans"] + slow["scans"]
    assert content["result"] == {"Fast": fast["scans"], "Slow": slow["scans"]}
    assert fast["min_us"] <= fast["mean_us"] <= fast["max_us"]


@pytest.mark.parametrize(
    "clock", [layout.HLI_CLOCK_FREERUN, layout.HLI_CLOCK_REALTIME]
)
@pytest.mark.ci
def test_other_clocks_end_cleanly_too(tmp_path: Path, clock: int) -> None:
    """Freerun and realtime: the CNC does not wait for the PLC, overruns are counted, not fatal."""
    name, report = unique_name(), tmp_path / "report.json"
    cnc = start_cnc(name, lengths=[50.0], clock=clock)
    status, text = run_plc(
        name,
        "--file",
        write(tmp_path / "p.py", COUNTING),
        "--once",
        "--report",
        str(report),
    )
    assert (status, text) == (0, "")
    cnc.communicate(timeout=60)
    content = json.loads(report.read_text())
    tasks = content["tasks"].values()
    assert content["error"] is None
    assert content["overruns"] == sum(task["overruns"] for task in tasks)
    assert content["result"] == {
        name: task["scans"] for name, task in content["tasks"].items()
    }


@pytest.mark.ci
@pytest.mark.parametrize(
    ("body", "line", "text"),
    [
        ("        1 / 0\n", 8, "ZeroDivisionError: division by zero"),
        (
            "        self.hli.gpCh[0].bahn_mc_control.overide\n",
            8,
            "did you mean override?",
        ),
        ("        raise SystemExit(3)\n", 8, "SystemExit: 3"),
    ],
)
def test_error_in_user_code_is_told_with_its_place(
    tmp_path: Path, body: str, line: int, text: str
) -> None:
    """FILE:LINE, the user's frames only, exit 1, report with the error."""
    name, report = unique_name(), tmp_path / "report.json"
    (tmp_path / "bad.py").write_text(textwrap.dedent(FAILING) + body)
    cnc = start_cnc(name, lengths=[50.0])
    status, error = run_plc(
        name,
        "--file",
        str(tmp_path / "bad.py"),
        "--once",
        "--report",
        str(report),
    )
    end(cnc)
    assert status == 1
    assert error.startswith(f"{tmp_path / 'bad.py'}:{line}: ")
    assert text in error
    assert "scan.py" not in error
    assert "Traceback" not in error
    assert text in json.loads(report.read_text())["error"]


@pytest.mark.parametrize(
    ("code", "message"),
    [
        ("import nothing_of_this_name\n", "p.py:1: ModuleNotFoundError"),
        ("def f(:\n", "p.py:1: SyntaxError"),
        ("x = 1\n", "no task found"),
        (
            "from plc_client import task\n@task()\nclass A: pass\n",
            "p.py:2: TypeError: task A has no method cyclic",
        ),
        (
            "from plc_client import task\n@task(interval=0)\nclass A: pass\n",
            "interval",
        ),
    ],
)
def test_wrong_files_are_told_with_their_place(
    tmp_path: Path, code: str, message: str
) -> None:
    """Errors at import and missing tasks are PlcErrors."""
    (tmp_path / "p.py").write_text(code)
    with pytest.raises(PlcError) as caught:
        load_tasks(str(tmp_path / "p.py"))
    assert message in str(caught.value)


def test_one_class_can_be_named(tmp_path: Path) -> None:
    """Decorated or not; a wrong name is told."""
    path = write(
        tmp_path / "p.py",
        COUNTING + "\n    class Plain:\n        def cyclic(self): pass\n",
    )
    assert [c.__name__ for c in load_tasks(path)] == ["Slow", "Fast"]
    assert [c.__name__ for c in load_tasks(path, "Plain")] == ["Plain"]
    with pytest.raises(PlcError, match="Missing"):
        load_tasks(path, "Missing")
    with pytest.raises(PlcError, match="not found"):
        load_tasks(str(tmp_path / "none.py"))


@pytest.mark.ci
def test_plc_ends_with_an_error_when_the_cnc_dies(tmp_path: Path) -> None:
    """--once: the death of the CNC is no clean end; the report is written all the same."""
    name, report = unique_name(), tmp_path / "report.json"
    cnc = start_cnc(name, lengths=[1e9])
    plc = start_plc(
        name, "--builtin", "acknowledge", "--once", "--report", str(report)
    )
    with connect(name, role="reader") as reader:
        wait_for_scans(reader, 20, plc)
        end(cnc)
        _, text = plc.communicate(timeout=60)
    assert plc.returncode == 1
    assert "died" in text
    assert json.loads(report.read_text())["scans"] >= 20
    hli.sweep()  # or another run's sweep was faster
    assert not Path("/dev/shm", name).exists()


@pytest.mark.ci
def test_plc_attaches_again_to_the_next_cnc(tmp_path: Path) -> None:
    """Without --once: setup() runs again for the CNC that comes next; SIGTERM ends it cleanly."""
    code = """
        from plc_client import task
        @task()
        class T:
            setups = 0
            def setup(self, hli):
                self.setups += 1
            def cyclic(self):
                pass
            def finished(self):
                return False
            def result(self):
                return self.setups
    """
    name, report = unique_name(), tmp_path / "report.json"
    plc = start_plc(
        name, "--file", write(tmp_path / "p.py", code), "--report", str(report)
    )
    for _ in range(2):
        cnc = start_cnc(name, lengths=[1e9])
        with connect(name, role="reader") as reader:
            wait_for_scans(reader, 5, plc)
        end(cnc)
    plc.send_signal(signal.SIGTERM)
    plc.communicate(timeout=60)
    assert plc.returncode == 0
    assert json.loads(report.read_text())["result"] == 2
    hli.sweep()


@pytest.mark.ci
def test_interrupt_ends_with_130_and_gives_the_place_back(
    tmp_path: Path,
) -> None:
    """Ctrl-C: no traceback, detached, the CNC runs on."""
    name = unique_name()
    cnc = start_cnc(name, lengths=[1e9])
    plc = start_plc(name, "--builtin", "acknowledge", "--once")
    with connect(name, role="reader") as reader:
        wait_for_scans(reader, 5, plc)
        plc.send_signal(signal.SIGINT)
        _, text = plc.communicate(timeout=60)
        assert (plc.returncode, text) == (130, "")
        assert reader.plc.attached == 0
    with connect(name) as next_plc:
        next_plc.step(2)
    end(cnc)
    hli.sweep()


@pytest.mark.ci
def test_plc_ends_with_its_parent() -> None:
    """--parent: a launcher that is gone already ends the PLC at once."""
    assert (
        run_plc(unique_name(), "--builtin", "acknowledge", "--parent", "1")[0]
        == 1
    )


@pytest.mark.parametrize("launched", [True, False])
def test_a_launched_plc_waits_as_long_as_its_launcher_lives(
    monkeypatch: pytest.MonkeyPatch, launched: bool
) -> None:
    """On a busy machine a CNC may take long to start; the launcher ends the PLC
    of a CNC that has failed.  Without a launcher --once has a limit.
    """
    tries = iter([hli.HliNotFound("not yet")] * 20 + [None])

    def connect_late(_name: str, present: bool) -> str:
        assert not present
        if (problem := next(tries)) is not None:
            raise problem
        return "attached"

    monkeypatch.setattr(plc_main, "connect", connect_late)
    monkeypatch.setattr(plc_main, "_FIRST_ATTACH_S", 0.0)
    words = ["--name", "n", "--builtin", "acknowledge", "--once"]
    words += ["--parent", str(os.getppid())] if launched else []
    process = plc_main.Process(plc_main._arguments(words))
    if launched:
        assert process._attach() == "attached"
    else:
        with pytest.raises(hli.HliNotFound):
            process._attach()


class ManualPacer:
    """Ticks of 1 ms; waiting takes as many ticks as the test says."""

    def __init__(self, jumps: list[int]) -> None:
        self.tick, self.jumps = 0, jumps

    def ticks(self, interval_s: float) -> int:
        return round(interval_s * 1000)

    def now(self) -> int:
        return self.tick

    def wait(self, due: int) -> bool:
        self.tick = max(
            due, self.tick + (self.jumps.pop(0) if self.jumps else 1)
        )
        return True


def test_schedule_order_and_overruns() -> None:
    """Due tasks run in priority order; intervals missed entirely are counted and not caught up."""
    order: list[str] = []

    class Base:
        def __init__(self) -> None:
            self.scanner: Scanner | None = None

        def cyclic(self) -> None:
            order.append(type(self).__name__)
            if len(order) >= 9 and self.scanner is not None:
                self.scanner.stop()

    low = task(interval=0.001, priority=5)(type("Low", (Base,), {}))
    high = task(interval=0.002, priority=1)(type("High", (Base,), {}))
    cnc = FakeCnc(elements([1e9]))
    with connect(cnc.name) as plc:
        programs = [Program.of(low), Program.of(high)]
        scanner = Scanner(plc, programs, ManualPacer([1, 1, 1, 5, 1]))
        for program in programs:
            program.instance.scanner = scanner
        assert scanner.run() is Ending.STOPPED
    cnc.remove()
    # ticks 0, 1, 2, 3, 8 (4 to 7 missed), 9
    assert order == [
        "High",
        "Low",
        "Low",
        "High",
        "Low",
        "Low",
        "High",
        "Low",
        "Low",
    ]
    assert [p.overruns for p in programs] == [4, 2]


def test_reservoir_is_bounded_and_exact_in_count_and_extremes() -> None:
    """A million values, a small sample."""
    from plc_client.stats import Reservoir  # noqa: PLC0415

    reservoir = Reservoir(size=100)
    for value in range(10_000):
        reservoir.add(value)
    found = reservoir.quantiles()
    assert (found["n"], found["max"], len(reservoir._kept)) == (
        10_000,
        9_999,
        100,
    )
    assert 2_000 < found["p50"] < 8_000
    assert Reservoir().quantiles() == {
        "p50": 0,
        "p99": 0,
        "p999": 0,
        "max": 0,
        "n": 0,
    }


def test_reservoir_keeps_every_value_equally_often() -> None:
    """Each tenth of the values in turn, over 300 seeds, within five standard deviations."""
    from plc_client.stats import Reservoir  # noqa: PLC0415

    hits = [0] * 10
    for seed in range(300):
        reservoir = Reservoir(size=20)
        reservoir._random.seed(seed)
        for value in range(500):
            reservoir.add(value)
        for value in reservoir._kept:
            hits[value // 50] += 1
    assert all(abs(n - 600) < 5 * (600 * 0.9) ** 0.5 for n in hits)


@pytest.mark.ci
def test_second_interrupt_ends_a_scan_that_never_returns(
    tmp_path: Path,
) -> None:
    """The first one waits for the end of the scan, the second one does not; the
    report is written.
    """
    code = """
        from plc_client import task
        @task()
        class T:
            def cyclic(self):
                while True:
                    pass
    """
    name, report = unique_name(), tmp_path / "report.json"
    cnc = start_cnc(name, lengths=[1e9])
    plc = start_plc(
        name,
        "--file",
        write(tmp_path / "p.py", code),
        "--once",
        "--report",
        str(report),
    )
    with connect(name, role="reader") as reader:
        while not reader.gpCh[0].head.plc_present_w:
            pass
    for _ in range(2):
        plc.send_signal(signal.SIGINT)
        time.sleep(0.2)  # two signals that are pending together would be one
    assert (plc.communicate()[1], plc.returncode) == ("", 130)
    assert report.exists()
    end(cnc)
    hli.sweep()


@pytest.mark.parametrize("lives", [False, True])
def test_a_cnc_that_died_in_the_middle_of_a_write_is_gone(
    monkeypatch: pytest.MonkeyPatch, lives: bool
) -> None:
    """The PLC process attaches to the next one; if it lives, that is an error."""
    monkeypatch.setattr(image, "_LIMIT_S", 0.0)

    @task(interval=0.001)
    class Interrupted:
        def cyclic(self) -> None:
            cnc.areas.sidecar.channel_seq.word |= 1
            if not lives:
                plc.cnc.generation += 1

    with MockCnc([line(10)]) as cnc, connect(cnc.name) as plc:
        pacer = ManualPacer([1, 1])
        scanner = Scanner(plc, [Program.of(Interrupted)], pacer)
        if lives:
            with pytest.raises(HliTimeout, match="no undisturbed copy"):
                scanner.run()
        else:
            assert scanner.run() is Ending.CNC_GONE


def test_the_image_waits_for_a_cnc_that_lost_its_core(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """More disturbed copies in a row than are tried at once are no error yet; a
    CNC that never comes back is one.
    """
    with MockCnc([line(10)]) as cnc, connect(cnc.name) as pair:
        inputs, seq, pauses = (
            image.InputImage(pair),
            cnc.areas.sidecar.channel_seq,
            [],
        )

        def pause(_seconds: float) -> None:
            pauses.append(seq.word)
            seq.word += len(pauses) == 3  # the writer goes on: even again

        monkeypatch.setattr(image.time, "sleep", pause)
        seq.word += 1  # odd: the CNC is in the middle of a write
        cnc.ch.bahn_state.dist_prog_start = 1234.0
        inputs.latch()
        assert (len(pauses), pair.gpCh[0].bahn_state.dist_prog_start) == (
            3,
            1234.0,
        )
        monkeypatch.setattr(image, "_LIMIT_S", 0.0)
        seq.word += 1
        with pytest.raises(HliTimeout, match="no undisturbed copy"):
            inputs.latch()
        inputs.close()
