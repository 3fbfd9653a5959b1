"""A PLC that writes anything anywhere, at full rate, beside a running CNC:
trajectory, limits and memory stay.
"""

from __future__ import annotations

import ctypes
import resource
import threading
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.engine import Event
from hli import layout
from support.every_byte import bytes_of
from support.inside import Inside
from support.limits import legal

pytestmark = pytest.mark.sanitize("engine")

HARMLESS = (
    Event.DONE,
    Event.PROGRAM_END,
    Event.WATCHDOG,
    Event.RECORD_FULL,
    Event.RETRACED,
)
PROGRAM = """N10 #CONTOUR LOOKAHEAD LOG ON [PARAM=1]
N20 G01 X30 Y0 F6000
N30 X30 Y40
N40 G03 X10 Y60 I-20 J0
N50 G02 X0 Y70 I0 J10
N60 #CONTOUR LOOKAHEAD LOG OFF [PARAM=2]
""" + "".join(
    f"N{100 + k} G01 X{k % 7} Y{(k * k) % 11} F8000\n" for k in range(60)
)
SPECIAL = np.array(
    [
        np.nan,
        np.inf,
        -np.inf,
        0.0,
        -0.0,
        -1.0,
        1e308,
        -1e308,
        5e-324,
        1e9,
        4294967296.0,
        -0.5,
        127.9,
    ]
)


class Hostile:
    """A thread that writes random bytes and special numbers until it is told to stop."""

    def __init__(
        self, cnc: Inside, keep_out: tuple[str, ...], seed: int
    ) -> None:
        self._memory = np.frombuffer(
            (ctypes.c_ubyte * layout_size()).from_address(cnc.segment.base),
            np.uint8,
        )
        self._where = bytes_of(keep_out)
        clah = (
            layout.HLI_SEGMENT.channel.offset
            + layout.HLI_CHANNEL.contour_lookahead.offset
        )
        self._request, self._semaphore = (
            self._memory[clah : clah + 16].view(np.float64),
            self._memory[clah + 16 :],
        )
        self._rng = np.random.default_rng(seed)
        self._stop = threading.Event()
        self._thread = threading.Thread(target=self._run)
        self._rounds = 0
        self.writes = 0

    def _run(self) -> None:
        while not self._stop.is_set():
            self._memory[self._where] = self._rng.integers(
                0, 256, len(self._where), np.uint8
            )
            for _ in range(10):
                self._request[:] = self._rng.choice(SPECIAL, 2)
                self._semaphore[0] = self._rng.integers(0, 3)
            self.writes += len(self._where) + 30
            self._rounds += 1

    def wait_for_a_round(self) -> None:
        """The thread has its turn, however busy the machine is."""
        seen = self._rounds
        while self._rounds == seen and self._thread.is_alive():
            time.sleep(0.0)

    def __enter__(self) -> Hostile:
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self._thread.join()


def layout_size() -> int:
    return ctypes.sizeof(layout.HLI_SEGMENT)


def run_beside(
    cnc: Inside, cycles: int, hostile: Hostile | None = None
) -> None:
    """Cycles; what a PLC may cause is taken and left."""
    end = int(cnc.engine.state.cycle) + cycles
    while (left := end - int(cnc.engine.state.cycle)) > 0:
        event = cnc.engine.run(min(left, 50))
        if event is Event.MODE_COMMAND:
            cnc.engine.take_mode_command()
        elif event is Event.PLC_ERROR:
            cnc.engine.take_plc_error()
        else:
            assert event in HARMLESS or cnc.prepare(event), event
        cnc._take()
        if hostile:
            hostile.wait_for_a_round()


def undisturbed(folder: Path) -> Any:
    """Positions of the same program beside a PLC that does nothing."""
    with Inside(folder, PROGRAM) as cnc:
        run_beside(cnc, 20_000)
        assert cnc.state.program_end_r
        return cnc.pos


@pytest.mark.parametrize(
    "service", [layout.HLI_SERVICE_CYCLIC, layout.HLI_SERVICE_IMMEDIATE]
)
def test_without_an_enabled_command_the_path_is_the_same(
    tmp_path: Path, service: int
) -> None:
    """Random bytes in all members but enables and presence: no sample differs,
    requests are answered or counted.
    """
    expected = undisturbed(tmp_path)
    with Inside(tmp_path, PROGRAM, service=service) as cnc:
        if service == layout.HLI_SERVICE_IMMEDIATE:
            cnc.engine.serve_start()
        with Hostile(cnc, (".enable_w", ".plc_present_w"), 7) as hostile:
            run_beside(cnc, 20_000, hostile)
        assert hostile.writes > 100_000
        assert np.array_equal(cnc.pos, expected)
        state = cnc.engine.state
        assert state.requests_mode1 + state.requests_mode2 > 0
        assert state.requests_bad > 0
        cnc.engine.serve_stop()


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", range(3))
def test_with_every_command_the_limits_hold(tmp_path: Path, seed: int) -> None:
    """Random bytes everywhere, enables and presence too: velocity and
    acceleration stay legal, memory does not grow.
    """
    with Inside(tmp_path, PROGRAM) as cnc:
        run_beside(cnc, 200)
        before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        with Hostile(cnc, (), seed) as hostile:
            run_beside(cnc, 20_000, hostile)
        assert np.isfinite(cnc.pos).all()
        legal(cnc.pos, cnc.cell)
        assert cnc.engine.state.fault == 0
        if (
            "libasan" not in Path("/proc/self/maps").read_text()
        ):  # it keeps what is freed for a while
            assert (
                resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
                < before + 40_000
            )


def test_the_cnc_shows_its_state_again(tmp_path: Path) -> None:
    """What a PLC wrote into the CNC's members is gone with the next cycle: the
    CNC does not read its own state.
    """
    with Inside(tmp_path, "N10 G01 X30 F1000\n") as cnc:
        cnc.level(cnc.bahn.feedhold, False)
        run_beside(cnc, 100)
        cnc.bahn.feedhold.state_r = True
        cnc.channel.used_units_std_sync_r = 77
        cnc.state.stop_condition_r = 0xFFFFFFFF
        run_beside(cnc, 1)
        assert not cnc.bahn.feedhold.state_r
        assert cnc.channel.used_units_std_sync_r == 0
        assert cnc.state.stop_condition_r == 0
