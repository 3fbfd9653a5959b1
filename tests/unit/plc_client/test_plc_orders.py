"""Orders of other processes to a running PLC, variables that do not exist,
results that JSON cannot hold.
"""

from __future__ import annotations

import json
import os
import signal
import socket
import subprocess
import sys
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import hli
from hli import HliError, HliNotFound, orders
from hli.errors import HliAccessError
from hli.orders import Orders, send
from hli.symbol import SymbolError
from plc_client import connect, task
from plc_client.mock import line
from plc_client.online import Watch
from plc_client.runner import PlcRunner
from plc_client.scan import plain
from support.fake_cnc import unique_name
from support.processes import end, start_cnc, start_plc, wait_for_scans

OVERRIDE = "HLI_Global_Variables.gpCh[0]^.bahn_mc_control.override.command_w"


class Deep:
    """A block with a variable of its own and one that a method stores later."""

    def __init__(self) -> None:
        self.q = False

    def later(self) -> None:
        self.seen = 1


@task()
class Some:
    """Variables of all kinds."""

    constant = 5

    def setup(self, hli: Any) -> None:
        self.gain, self.table, self.fixed, self.values = (
            1.0,
            [1],
            (1, 2),
            np.zeros(3),
        )
        self.deep, self.hli, self.coming = Deep(), hli, None
        self.scans = 0

    def cyclic(self) -> None:
        self.scans += 1
        if self.scans > 1000:
            self._helper()

    def _helper(self) -> None:
        def inner() -> None:
            self.late = 2.0

        inner()


@pytest.fixture
def plc() -> Iterator[PlcRunner]:
    """A PLC that listens, on a mock."""
    with PlcRunner.on_mock(Some, [line(100)]) as runner:
        runner._scanner.orders.open(runner.hli.name)
        yield runner
        runner._scanner.orders.close()


def ordered(runner: PlcRunner, do: str, *symbols: Any) -> Any:
    """What another thread gets for its order while this one scans: the answer or the error."""
    got: list[Any] = []

    def client() -> None:
        try:
            got.append(
                send(runner.hli.name, {"do": do, "symbols": list(symbols)})
            )
        except (HliError, ValueError) as error:
            got.append(error)

    thread = threading.Thread(target=client)
    thread.start()
    while thread.is_alive():
        runner.step()
    return got[0]


def test_force_read_unforce_from_outside(plc: PlcRunner) -> None:
    """Forced from the next scan on, listed, let go; spellings of one symbol are one symbol."""
    answer = ordered(
        plc,
        "force",
        ["some.gain", 2.5],
        ["gpCh[0].bahn_mc_control.OVERRIDE.command_w", 500],
    )
    assert answer == {"forced": {"Some.gain": 2.5, OVERRIDE: 500}}
    plc.task.gain = 7.0
    plc.step()
    assert (plc.task.gain, plc.symbol(OVERRIDE).value) == (2.5, 500)
    assert ordered(
        plc, "read", "Some.gain", "Some.constant", "Some.coming", OVERRIDE
    )["values"] == {
        "Some.gain": 2.5,
        "Some.constant": 5,
        "Some.coming": None,
        OVERRIDE: 500,
    }
    assert ordered(
        plc, "unforce", "gpCh[0]^.bahn_mc_control.override.command_w"
    )["forced"] == {"Some.gain": 2.5}
    assert ordered(plc, "list")["forced"] == {"Some.gain": 2.5}
    assert ordered(plc, "unforce")["forced"] == {}
    plc.task.gain = 7.0
    plc.step(2)
    assert plc.task.gain == 7.0


@pytest.mark.parametrize(
    ("do", "symbols", "text"),
    [
        (
            "force",
            [["Some.scans", 3], ["Some.gain", "fast"]],
            r"Some.gain is a number, 1\.0 now",
        ),
        (
            "force",
            [["Some.gain", 3.0], ["Some.gian", 3.0]],
            "Some has no variable 'gian'; did you mean gain",
        ),
        (
            "force",
            [["Some.gain", 3.0], [OVERRIDE, 70_000]],
            r"override.command_w=70000: .*out of range 0\.\.65535",
        ),
        (
            "force",
            [["Some.gain", 3.0], ["gpCh[7]^.head.channel_nr", 1]],
            r"gpCh\[7\] is not configured",
        ),
        ("force", [["Some.gain"]], "unpack"),
        (
            "unforce",
            ["Some.scans"],
            "'Some.scans' is not forced; forced: nothing",
        ),
        ("read", ["gpCh[0]^.bahn_state"], "only single values"),
        ("read", ["Some.deep.p"], "Some.deep has no variable 'p'"),
        ("dance", [], "'dance' is unknown"),
    ],
)
def test_an_impossible_order_changes_nothing_and_is_told(
    plc: PlcRunner, do: str, symbols: list[Any], text: str
) -> None:
    """All symbols of an order or none; the PLC goes on."""
    answer = ordered(plc, do, *symbols)
    assert isinstance(answer, ValueError)
    with pytest.raises(ValueError, match=text):
        raise answer
    assert ordered(plc, "list")["forced"] == {}


def test_whoever_connects_cannot_disturb(
    plc: PlcRunner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nonsense, silence and foreign users get no answer; the next order does."""
    monkeypatch.setattr(orders, "_LINE_S", 0.05)
    for rubbish in (b"", b"\n", b"no json\n", b"[1]\n", b'{"do": 3}'):
        with socket.socket(socket.AF_UNIX, socket.SOCK_STREAM) as connection:
            (place,) = orders.listening_on(plc.hli.name)
            connection.connect("\0" + place)
            connection.sendall(rubbish)
        plc.step()
    assert ordered(plc, "list") == {"forced": {}}
    there = orders.prefix(plc.hli.name)
    with monkeypatch.context() as patched:
        patched.setattr(os, "getuid", lambda: 12345)
        patched.setattr(orders, "prefix", lambda *_: there)
        with pytest.raises(HliAccessError, match="another user"):
            send(plc.hli.name, {"do": "list"})


OTHER_USER = """
import socket, sys
sockets = []
for number in range(3):
    sockets.append(socket.socket(socket.AF_UNIX, socket.SOCK_STREAM))
    sockets[-1].bind("\\0" + sys.argv[1] + f"{number:020}-x")
    sockets[-1].listen(0)
print("bound", flush=True)
sys.stdin.read()
"""


@pytest.mark.skipif(os.getuid() != 0, reason="only root can be two users")
def test_another_user_cannot_take_the_plcs_name() -> None:
    """Sockets that he binds first neither stop the PLC nor get its orders."""
    name = unique_name()
    with subprocess.Popen(
        ["/usr/bin/env", "python3", "-c", OTHER_USER, orders.prefix(name)],
        user=65534,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        cwd="/",
    ) as other:
        assert other.stdout is not None
        assert other.stdout.readline() == b"bound\n"
        with pytest.raises(HliAccessError, match="another user"):
            send(name, {"do": "list"})
        taken = Orders()
        taken.open(name)
        obeying = threading.Thread(target=_obey_one, args=(taken,))
        obeying.start()
        assert send(name, {"do": "list"}) == {"mine": 1}
        obeying.join()
        taken.close()
        other.communicate()


def _obey_one(taken: Orders) -> None:
    while not taken.waiting:
        threading.Event().wait(0.001)
    taken.serve(lambda _order: {"mine": 1})


def test_a_plc_that_does_not_scan_takes_no_order(
    plc: PlcRunner, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The order is told to have failed, and is not obeyed when scans go on."""
    monkeypatch.setattr(orders, "ANSWER_S", 0.05)
    with pytest.raises(ValueError, match=r"no scan for 0\.05 s"):
        send(plc.hli.name, {"do": "force", "symbols": [["Some.gain", 9.0]]})
    plc.step(3)
    assert plc.task.gain == 1.0


def test_nobody_there_and_the_name_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """One PLC per name; when it is gone the name is free."""
    monkeypatch.setattr(orders, "_BIND_PAUSE_S", 0.0)
    name = unique_name()
    with pytest.raises(HliNotFound, match="no PLC process listens"):
        send(name, {"do": "list"})
    first, second = Orders(), Orders()
    first.open(name)
    with pytest.raises(HliError, match="cannot be taken"):
        second.open(name)
    first.close()
    monkeypatch.undo()  # the thread that listened may not have left its accept() yet
    second.open(name)
    second.close()


def test_a_name_is_taken_although_its_process_has_no_time(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Who wants the name asks several times; none is accepted meanwhile."""
    monkeypatch.setattr(orders, "_BIND_PAUSE_S", 0.0)
    monkeypatch.setattr(Orders, "_listen", lambda *_: None)
    name = unique_name()
    first, second = Orders(), Orders()
    first.open(name)
    try:
        for _ in range(2):
            with pytest.raises(HliError, match="cannot be taken"):
                second.open(name)
    finally:
        first.close()


@pytest.mark.usefixtures("leftovers")
@pytest.mark.ci
def test_another_terminal_forces_a_task_that_keeps_it_over_cnc_and_plc_restarts(
    tmp_path: Path, cli: Callable[..., Any]
) -> None:
    """The commands force, read and unforce against a PLC process; the force
    outlives SIGUSR1 and the CNC.
    """
    name, file = unique_name(), tmp_path / "p.py"
    file.write_text(
        "from plc_client import task\n@task()\nclass T:\n"
        "    def setup(self, hli): self.gain, self.seen = 1.0, 0.0\n"
        "    def cyclic(self): self.seen = self.gain\n    def finished(self): return False\n"
    )
    cnc = start_cnc(name, lengths=[1e9])
    process = start_plc(name, "--file", str(file))
    with connect(name, role="reader", wait_s=10.0) as reader:
        wait_for_scans(reader, 5, process)
    assert cli("force", "T.gain=2.5", "--name", name, "--json").json == {
        "forced": {"T.gain": 2.5}
    }
    process.send_signal(signal.SIGUSR1)
    assert cli("read", "T.seen", "--name", name).out == "T.seen = 2.5\n"
    end(cnc)
    cnc = start_cnc(name, lengths=[1e9])
    with connect(name, role="reader", wait_s=10.0) as reader:
        wait_for_scans(reader, 5, process)
    assert send(name, {"do": "read", "symbols": ["T.seen"]})["values"] == {
        "T.seen": 2.5
    }
    wrong = cli("force", "T.gian=3", "--name", name)
    assert (wrong.status, "did you mean gain?" in wrong.err) == (1, True)
    assert cli("unforce", "--all", "--name", name).out == "nothing is forced\n"
    assert cli("unforce", "--name", name).status == 2
    end(process)
    gone = cli("force", "--name", name)
    assert (gone.status, "no PLC process listens" in gone.err) == (1, True)
    end(cnc)
    hli.sweep()


# ---------------------------------------------------------------- variables that do not exist
@pytest.mark.parametrize(
    ("path", "text"),
    [
        ("Some.gian", "Some has no variable 'gian'; did you mean gain"),
        ("Some.deep.w", "Some.deep has no variable 'w'"),
        ("Some.fixed[2]", r"Some.fixed\[2\]: the index runs 0..1"),
        ("Some.values[3]", r"Some.values\[3\]: the index runs 0..2"),
        ("Some.gain[0]", "Some.gain is no array"),
        ("Some.hli.gpCh[0].bahn_state.dist_prog_strat", "dist_prog_start"),
    ],
)
def test_a_variable_that_cannot_be_is_refused(
    plc: PlcRunner, path: str, text: str
) -> None:
    """Watching and forcing name what is wrong; nothing is created."""
    with pytest.raises(SymbolError, match=text):
        plc.watch(path)
    with pytest.raises(SymbolError, match=text):
        plc.force(path, 1)
    assert not hasattr(plc.task, "gian")


@pytest.mark.parametrize(
    "path",
    [
        "Some.late",
        "Some.coming",
        "Some.deep.seen",
        "Some.table[4]",
        "Some.constant",
    ],
)
def test_a_variable_that_may_still_come_is_watched(
    plc: PlcRunner, path: str
) -> None:
    """What a method stores later, what is None now, what a list may grow to."""
    plc.watch(path)
    plc.step(2)
    assert len(plc.trace()[path]) == 2


def test_names_are_checked_after_setup(plc: PlcRunner) -> None:
    """As the command line does it: named before the task has any variable."""
    watch = Watch()
    watch.add("Some.gian", plc.symbol("Some.gian"))
    with pytest.raises(SymbolError, match="did you mean gain"):
        watch.rebind(plc._scanner.symbols)
    watch = Watch()
    watch.add("Some.deep", plc.symbol("Some.deep"))
    with pytest.raises(SymbolError, match="single numbers"):
        watch.rebind(plc._scanner.symbols)


# ---------------------------------------------------------------- results
def test_results_of_numpy_are_plain() -> None:
    """Numbers and arrays of numpy, tuples; what is not finite is None."""
    value = {
        "a": np.arange(3),
        2: (np.float64(0.5), np.bool_(True)),
        "n": [float("nan"), float("-inf")],
        "s": "x",
    }
    assert (
        json.dumps(plain(value))
        == '{"a": [0, 1, 2], "2": [0.5, true], "n": [null, null], "s": "x"}'
    )


@pytest.mark.parametrize(
    ("value", "text"),
    [
        ({1, 2}, "result is a set"),
        ({"a": [0, sys]}, r"result\['a'\]\[1\] is a module"),
        ({(1, 2): 3}, r"result has the key \(1, 2\)"),
        (np.array([object()]), r"result\[0\] is a object"),
    ],
)
def test_results_that_json_cannot_hold_name_the_place(
    value: Any, text: str
) -> None:
    """A TypeError with the way to the value."""
    with pytest.raises(TypeError, match=text):
        plain(value)


@pytest.mark.ci
@pytest.mark.usefixtures("leftovers")
def test_a_result_without_json_names_its_task(tmp_path: Path) -> None:
    """Exit 1; the statistics of all tasks are in the report."""
    name, file, report = (
        unique_name(),
        tmp_path / "p.py",
        tmp_path / "report.json",
    )
    file.write_text(
        "from plc_client import task\n"
        "@task()\nclass Good:\n    def cyclic(self): pass\n    def result(self): return 1\n"
        "@task()\nclass Bad:\n    def cyclic(self): pass\n    def result(self): return {'x': {3}}\n"
    )
    cnc = start_cnc(name, lengths=[1e4])
    process = start_plc(
        name, "--file", str(file), "--report", str(report), "--once"
    )
    assert (
        "result() of task Bad gives no JSON value: result['x'] is a set"
        in process.communicate(timeout=60)[1]
    )
    assert process.returncode == 1
    found = json.loads(report.read_text())
    assert (
        "task Bad" in found["error"],
        found["result"],
        set(found["tasks"]),
    ) == (True, None, {"Good", "Bad"})
    end(cnc)
    hli.sweep()
