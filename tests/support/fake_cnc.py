"""A CNC for tests of the HLI and of the PLC side: a table of elements, a log,
the sidecar protocol, no machine.

In a test it runs in a thread (``with FakeCnc(...) as cnc``) or cycle by cycle
(``cnc.cycle()``); as a program (``python fake_cnc.py NAME JSON``) it is a
process of its own.
"""

from __future__ import annotations

import json
import os
import sys
import threading
import uuid
from typing import Any

import numpy as np
from hli._sync import lib

import hli
from hli import layout
from hli.areas import Areas
from hli.handshake import ContourUnit, word_pointer
from hli.view import BLOCK_DTYPE


def unique_name(stem: str = "hli-test") -> str:
    """A segment name nobody else uses."""
    return f"{stem}-{os.getpid()}-{uuid.uuid4().hex[:8]}"


def elements(lengths: list[float]) -> np.ndarray[Any, Any]:
    """Linear elements of these lengths (0.1 um), one behind the other."""
    rows = np.zeros(len(lengths), BLOCK_DTYPE)
    rows["block_type"] = layout.HLI_CLAH_LINEAR
    rows["block_number"] = 10 * np.arange(1, len(lengths) + 1)
    rows["length"] = lengths
    rows["start_position"] = np.concatenate([[0.0], np.cumsum(lengths)[:-1]])
    return rows


class FakeCnc:
    """Moves ``speed`` along its path in each cycle, answers from its tables,
    ends its program at the path's end.
    """

    def __init__(
        self,
        path: np.ndarray[Any, Any] | None = None,
        log: np.ndarray[Any, Any] | None = None,
        *,
        name: str = "",
        speed: float = 1.0,
        ahead: float = 1e30,
        clock: int = layout.HLI_CLOCK_LOCKSTEP,
    ) -> None:
        self.name = name or unique_name()
        self.path = elements([]) if path is None else path
        self.log = elements([]) if log is None else log
        self.speed, self.ahead = speed, ahead
        self.distance = 0.0
        self.cycles = 0
        self.requests: list[tuple[float, float]] = []
        self.segment = hli.create(self.name, 1, 3, ready=False)
        self.areas = Areas(self.segment)
        self.ch = self.areas.gpCh[0]
        self.unit = ContourUnit(self.ch.contour_lookahead)
        self.side = self.areas.sidecar
        self._turn, self._plc_turn, self._seq = (
            word_pointer(self.areas.root, w)
            for w in ("cnc_turn", "plc_turn", "channel_seq")
        )
        self._stop = threading.Event()
        self._thread: threading.Thread | None = None
        self._identify(clock)
        self.segment.publish()

    def _identify(self, clock: int) -> None:
        cnc = self.side.cnc
        cnc.pid, cnc.start = os.getpid(), lib.hs_process_start(os.getpid())
        cnc.cycle_ns, cnc.clock, cnc.generation = 1_000_000, clock, 1
        cnc.phase = layout.HLI_PHASE_READY
        self.ch.head.init_done_r = True
        self.publish()

    # -- one cycle
    def cycle(self) -> None:
        """Move, publish, answer, count."""
        end = self.end()
        self.distance = min(self.distance + self.speed, end)
        self.publish()
        self.serve()
        self.cycles += 1
        cnc = self.side.cnc
        cnc.cell_time_ns = self.cycles * 1_000_000
        cnc.cycle = self.cycles
        lib.hs_word_post(self._turn, self.cycles & 0xFFFFFFFF)

    def end(self) -> float:
        """Length of the path."""
        return (
            float(self.path["start_position"][-1] + self.path["length"][-1])
            if len(self.path)
            else 0.0
        )

    def publish(self) -> None:
        """The channel's state, under the seqlock."""
        state, clah = self.ch.bahn_state, self.ch.contour_lookahead.state
        lib.hs_seq_begin(self._seq)
        state.dist_prog_start = self.distance
        state.program_end_r = self.distance >= self.end()
        if state.program_end_r:
            self.side.cnc.phase = layout.HLI_PHASE_ENDED
        clah.max_dist_prog_start = self.known()
        clah.count_logged_blocks = len(self.log)
        lib.hs_seq_end(self._seq)

    def known(self) -> float:
        """End of the last element that begins within ``ahead`` of the tool."""
        near = self.path[
            self.path["start_position"] < self.distance + self.ahead
        ]
        return (
            float(near["start_position"][-1] + near["length"][-1])
            if len(near)
            else 0.0
        )

    def serve(self) -> None:
        """Answer a request that is there."""
        request = self.unit.wait_request(0.0)
        if request is not None:
            self.requests.append(request)
            self.unit.answer(self.answer_to(*request))

    def answer_to(self, start: float, length: float) -> np.ndarray[Any, Any]:
        """The manual's rules for both modes, at most 128 elements."""
        if length == 0.0:
            return self.log[int(start) :][:128] if start >= 0 else self.log[:0]
        s, e = (
            self.path["start_position"],
            self.path["start_position"] + self.path["length"],
        )
        return self.path[
            (s < start + length) & (e > start) & (e <= self.known())
        ][:128]

    # -- running
    def run(self) -> None:
        """Lockstep: run as far as the PLC allows, until stopped."""
        while not self._stop.is_set():
            if (
                self.side.cnc.clock != layout.HLI_CLOCK_LOCKSTEP
                or lib.hs_word_wait(
                    self._plc_turn,
                    (self.cycles + 1) & 0xFFFFFFFF,
                    20_000,
                    20_000_000,
                )
                == lib.HS_OK
            ):
                self.cycle()
            if self.side.plc.finished:
                self.side.cnc.phase = layout.HLI_PHASE_SHUTDOWN
                return

    def __enter__(self) -> FakeCnc:
        self._thread = threading.Thread(target=self.run)
        self._thread.start()
        return self

    def __exit__(self, *_: object) -> None:
        self._stop.set()
        self.side.cnc.phase = layout.HLI_PHASE_SHUTDOWN
        if self._thread is not None:
            self._thread.join()
        self.remove()

    def remove(self) -> None:
        """Unmap and unlink."""
        self.segment.close()
        self.segment.unlink()


def main() -> None:
    """A process: NAME and the constructor's numbers as JSON; says "ready", runs
    until finished or killed.
    """
    arguments = json.loads(sys.argv[2])
    lengths, log = arguments.pop("lengths", []), arguments.pop("log", [])
    cnc = FakeCnc(
        elements(lengths), elements(log), name=sys.argv[1], **arguments
    )
    print("ready", flush=True)
    cnc.run()
    while cnc.side.plc.attached:
        threading.Event().wait(0.01)
    cnc.remove()


if __name__ == "__main__":
    main()
