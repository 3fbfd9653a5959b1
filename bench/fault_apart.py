"""A run of the fault matrix whose PLC is a process of its own that dies and comes again.

``cnc`` and ``plc`` are started apart, as from two terminals.  The CNC's count of the
functions is its recording; the PLC's is a file that it writes before it acknowledges.
"""

from __future__ import annotations

import os
import random
import secrets
import signal
import subprocess
import time
from pathlib import Path

from cnc_core.recording.reading import Recording
from fault_run import (
    FUNCTIONS,
    MOMENT_S,
    RECORDING,
    SHM,
    Fault,
    Setting,
    alive,
    check_cycles,
    hli_cosim,
    looked_at,
    moment_of,
    seen_soon,
    wait,
    write_files,
)

DEATHS = 3


class Apart:
    """The CNC, and the PLC of the moment."""

    def __init__(self, folder: Path, clock: str) -> None:
        self._folder = folder
        self.name = f"fault-{os.getpid()}-{secrets.token_hex(4)}"
        (program,) = write_files(folder, Setting())
        for old in folder.glob("part*.parquet"):
            old.unlink()
        words = (program, "--clock", clock, "--record", RECORDING)
        self.cnc = self._started("cnc", *words, "--config", "cell.toml")
        self.plc = self.come()

    def _started(self, verb: str, *words: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            hli_cosim(verb, *words, "--name", self.name),
            cwd=self._folder,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        )

    def come(self) -> subprocess.Popen[bytes]:
        """The next PLC."""
        self.plc = self._started("plc", "plc.py")
        return self.plc

    def shows(self, moment: str) -> bool:
        """Whether the segment shows it."""
        seg = looked_at(SHM / self.name)
        return seg is not None and moment_of(seg, moment)

    def end(self) -> None:
        """Ask both to end."""
        for process in (self.cnc, self.plc):
            process.send_signal(signal.SIGTERM)

    def kill(self) -> None:
        """What is left where a promise was broken."""
        for process in (self.cnc, self.plc):
            if alive(process.pid):
                process.kill()
            process.wait()
        (SHM / self.name).unlink(missing_ok=True)


def one_apart(
    fault: Fault, folder: Path, rng: random.Random, limit_s: float
) -> tuple[bool, float]:
    """(injected, seconds to the end): kill -9 of the PLC at the moment, three times,
    and another one each time, mostly at once.
    """
    run, moment_s = Apart(folder, fault.clock), max(MOMENT_S, limit_s)
    try:
        hits = sum(_dies(run, fault, rng, moment_s) for _ in range(DEATHS))
        wait(lambda: run.shows("end"), moment_s)
        run.end()
        seconds = wait(lambda: run.cnc.poll() is not None, limit_s)
        wait(lambda: run.plc.poll() is not None, limit_s)
        assert not (SHM / run.name).exists(), "segment left"
        _check(folder)
    finally:
        run.kill()
    return hits > 0, seconds


def _dies(
    run: Apart, fault: Fault, rng: random.Random, moment_s: float
) -> bool:
    """False: the program ended before the moment came."""
    until = time.monotonic() + moment_s

    def due() -> bool:
        """The moment has come for this PLC too: it has attached."""
        return run.shows("attached") and run.shows(fault.when)

    while not seen_soon(due):
        assert time.monotonic() < until, f"no {fault.when}"
        if run.shows("end"):
            return False
    time.sleep(rng.uniform(0.0, 0.02))
    run.plc.kill()
    run.plc.wait()
    time.sleep(rng.choice((0.0, 0.0, 0.3)))
    run.come()
    return True


def _check(folder: Path) -> None:
    """Each function that the CNC calls seen has been with a PLC; for the first time
    once at most, and in order.  What no PLC was there for is in neither count.
    """
    found = Recording(folder / RECORDING)
    check_cycles(found)
    rows = found.functions
    put_out = [int(value) for value in rows["value"]]
    assert put_out == list(range(1, FUNCTIONS + 1)), f"put out {put_out}"
    was_seen = zip(put_out, rows["seen"], strict=True)
    counted = {value for value, seen in was_seen if seen}
    lines = (folder / "seen").read_text().splitlines()
    words = [line.split() for line in lines if line != "setup"]
    first = [int(value) for word, _, value in words if word == "first"]
    here = list(dict.fromkeys(int(value) for *_, value in words))
    told = f"CNC {sorted(counted)}, PLC {words}"
    assert first == sorted(set(first)), told
    assert here == sorted(here), told
    assert counted == set(here), told
