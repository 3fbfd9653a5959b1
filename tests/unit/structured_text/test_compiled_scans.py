"""Scans in C do what scans in Python do."""

from __future__ import annotations

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from hli._sync import lib

from hli import layout
from hli.handshake import word_pointer
from plc_client import connect
from plc_client.mock import MockCnc, line
from plc_client.online import SymbolTable, Watch
from plc_client.scan import Ending, Program, Scanner
from plc_client.st.machine.tasks import load_st
from plc_client.st.options import Options
from plc_client.task import PlcError

pytestmark = pytest.mark.sanitize("hli")

TASKS = Options(tasks=("Fast:1:0=MAIN", "Slow:3:1=SLOW"))
LOGIC = """VAR_GLOBAL seen : LREAL; END_VAR
PROGRAM MAIN
VAR n : UDINT; t : TON; on : UDINT; END_VAR
n := n + 1;
seen := gpCh[0]^.bahn_state.dist_prog_start;
t(IN := n > 5, PT := T#20ms);
IF t.Q THEN on := on + 1; END_IF
END_PROGRAM
PROGRAM SLOW
VAR n : UDINT; a : ARRAY [0..9] OF INT; i : INT; last : LREAL; END_VAR
n := n + 1;
last := seen;
{trap}
END_PROGRAM
"""


@contextmanager
def running(cnc: MockCnc) -> Iterator[None]:
    """The CNC runs its cycles in a thread, in lockstep, until its end."""
    done = threading.Event()

    def cycles() -> None:
        turn = word_pointer(cnc.areas.root, "plc_turn")
        while not done.is_set():
            wanted = (cnc.cycles + 1) & 0xFFFFFFFF
            waited = lib.hs_word_wait(turn, wanted, 20_000, 20_000_000)
            # ahead of the cycle that the PLC scans next: behind it the PLC
            # might scan once more, or not
            if cnc.areas.sidecar.plc.finished:
                cnc.areas.sidecar.cnc.phase = layout.HLI_PHASE_SHUTDOWN
            if waited == lib.HS_OK:
                cnc.cycle()

    thread = threading.Thread(target=cycles)
    thread.start()
    try:
        yield
    finally:
        done.set()
        thread.join()


def run(path: Path, watched: str = "") -> Scanner:
    """The scanner behind a whole run; a watched symbol keeps it in Python."""
    with MockCnc([line(10)]) as cnc, running(cnc):
        hli = connect(cnc.name, present=False)
        programs = [Program.of(cls) for cls in load_st(path, TASKS)]
        scanner = Scanner(hli, programs, watch=Watch())
        if watched:
            table = SymbolTable(hli, programs)
            scanner.watch.add(watched, table[watched])
        try:
            assert scanner.run() is Ending.SHUTDOWN
        finally:
            hli.close()
    return scanner


@pytest.fixture
def logic(tmp_path: Path) -> Path:
    """A program without a trap."""
    path = tmp_path / "logic.st"
    path.write_text(LOGIC.replace("{trap}", ""))
    return path


def test_scans_in_c_do_what_scans_in_python_do(logic: Path) -> None:
    """Counts, timers, inputs, statistics and the segment's counter are the same."""
    results = []
    for watched in ("", "MAIN.n"):
        scanner = run(logic, watched)
        main, slow = (p.instance for p in scanner.programs)
        fast, behind = scanner.programs
        results.append(
            (
                main.n,
                main.on,
                slow.n,
                slow.last,
                (fast.times.n, behind.times.n),
                (fast.overruns, behind.overruns, fast.jitter_ns),
                (fast.due, behind.due),
            )
        )
        assert fast.times.min <= fast.times.total / fast.times.n
    assert results[0] == results[1]
    assert results[0][0] > 3 * results[0][2] - 3 > 60
    assert results[0][4][0] == results[0][0]


def test_trap_in_c_ends_the_run_with_its_place(logic: Path) -> None:
    """The error names the line; the task before had its scan."""
    trap = "IF n > 20 THEN i := 10; a[i] := 1; END_IF"
    logic.write_text(LOGIC.replace("{trap}", trap))
    with pytest.raises(
        PlcError,
        match=r"logic\.st:13: StTrap: SLOW: index 10 is outside of 0\.\.9",
    ):
        run(logic)


def test_halted_task_leaves_the_others_running(
    logic: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With ``halt`` the task stands where it was, the other one goes on."""
    monkeypatch.setenv("HLI_COSIM_ON_TRAP", "halt")
    trap = "IF n > 20 THEN i := 10; a[i] := 1; END_IF"
    logic.write_text(LOGIC.replace("{trap}", trap))
    scanner = run(logic)
    main, slow = (p.instance for p in scanner.programs)
    assert slow.n == 21
    assert main.n > 100
