"""What a real-time GEO rehearses ahead of a cycle changes neither the motion
nor what the PLC sees at the cycles.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cnc_core._engine import lib

from cnc_core.engine import Event
from support.commanded import config, drive, program
from support.inside import FloatArray, Inside
from support.seeds import few


def _memory(cnc: Inside) -> bytes:
    """Channel and axes but for the program's name, which is another one in every run."""
    channel = bytearray(cnc.channel)
    name = type(cnc.state).prog_name_r
    begin = type(cnc.channel).bahn_state.offset + name.offset
    channel[begin : begin + name.size] = bytes(name.size)
    return bytes(channel) + b"".join(map(bytes, cnc.axes))


def _run(
    folder: Path, seed: int, options: str, rehearse: bool
) -> tuple[FloatArray, list[int]]:
    """Positions at the cycle; hashes of the channel and the axes as a PLC would
    find them after each cycle.
    """
    rng = np.random.default_rng(seed)
    seen: list[int] = []
    with Inside(folder, program(rng), config(rng, options)) as cnc:

        def cycles(n: int, _turn: int) -> Event:
            event = Event.DONE
            for _ in range(n):
                if rehearse:
                    lib.engine_rehearse(cnc.engine._handle)
                event = cnc.engine.run(1)
                seen.append(hash(_memory(cnc)))
                if event is not Event.DONE:
                    break
            return event

        pos, _ = drive(cnc, rng, cycles)
    return pos, seen


@pytest.mark.parametrize(
    ("seed", "options"), few([(0, ""), (1, "n"), (2, "f"), (3, "nc")], 1)
)
@pytest.mark.ci
def test_a_rehearsal_changes_nothing(
    tmp_path: Path, seed: int, options: str
) -> None:
    """Random commands with and without: the same motion, the same memory after every cycle."""
    plain, seen = _run(tmp_path, seed, options, rehearse=False)
    rehearsed, again = _run(tmp_path, seed, options, rehearse=True)
    np.testing.assert_array_equal(plain, rehearsed)
    assert seen == again
