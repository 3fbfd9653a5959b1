"""Planner and GEO switched at every possible place: what the threads share
holds whenever either of them gets no time.

Needs the C code built with HLI_COSIM_INTERLEAVE=1, as ``.ci/run`` does; a run
is the same every time.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from cnc_core._engine import ffi, lib

from cnc_core.engine import Event
from hli import layout
from support import threaded
from support.commanded import config, drive, program
from support.inside import Inside
from support.limits import legal

pytestmark = [
    pytest.mark.sanitize("engine"),
    pytest.mark.skipif(
        lib.engine_interleaved(ffi.NULL, 0, 0, 0, 0) < 0,
        reason="built without HLI_COSIM_INTERLEAVE=1",
    ),
]


OPTIONS = ("", "n", "nc", "c", "f", "nf")
CASES = [
    (seed, options, geo_first, False)
    for seed in range(2)
    for options in OPTIONS
    for geo_first in (False, True)
]
# committed motion that is taken back after GEO has begun it; a loop that ends
# behind an inserted stop
CASES += [(2, "", False, False), (4, "", False, False), (14, "n", False, False)]
# a step over a stretch that is cut anew, from which an inserted stop has left
# the feed; turning back beside the path
CASES += [
    (314, "n", False, False),
    (471, "n", False, True),
    (64, "n", False, False),
    (51, "nc", True, True),
]
CASES += [
    (seed, options, seed % 2 > 0, True) for seed, options in enumerate(OPTIONS)
]
# the planner commits and then asks for it back while GEO reads what is
# committed; turning back 1e-13 mm behind the start of an arc
CASES += [
    (21162, "", True, False),
    (21198, "", True, False),
    (20531, "nf", True, True),
]


@pytest.mark.parametrize(("seed", "options", "geo_first", "rehearse"), CASES)
def test_threads_switched_anywhere(
    tmp_path: Path, seed: int, options: str, geo_first: bool, rehearse: bool
) -> None:
    """Random commands, random switches between the threads and bursts of cycles
    without the planner: all is legal.
    """
    rng = np.random.default_rng(seed)
    text = program(rng)
    with Inside(tmp_path, text, config(rng, options)) as cnc:
        handle = cnc.engine._handle

        def cycles(n: int, turn: int) -> Event:
            return Event(
                lib.engine_interleaved(
                    handle, n, seed * 100_003 + turn, geo_first, rehearse
                )
            )

        pos, way = drive(cnc, rng, cycles)
        legal(pos, cnc.cell)
        assert way > 1e-3


def curve_in_chords() -> str:
    """1200 chords of a curve, F6000."""
    lines, x, y = ["G01 G90 F6000"], 0.0, 0.0
    for k in range(1200):
        heading = 0.8 * np.sin(0.05 * k)
        x, y = x + 0.4 * np.cos(heading), y + 0.4 * np.sin(heading)
        lines.append(f"X{x:.4f} Y{y:.4f}")
    return "\n".join(lines) + "\n"


def interleaved(cnc: Inside, until: int, seed: int, geo_first: bool) -> None:
    """Switched cycles up to that one."""
    while (cycle := int(cnc.engine.state.cycle)) < until:
        event = lib.engine_interleaved(
            cnc.engine._handle,
            until - cycle,
            seed * 100_003 + cycle,
            geo_first,
            False,
        )
        assert cnc.prepare(Event(event)) or Event(event) is Event.DONE


# bursts of 40 cycles of 4 ms without the planner are within that
SETTLED_S = 0.6
TURNS = 3  # the planner notes that the tail has ended, plans, commits


@pytest.mark.parametrize("cycle_s", [0.001, 0.004])
@pytest.mark.parametrize("geo_first", [False, True])
@pytest.mark.parametrize("seed", range(4))
def test_the_speed_follows_the_override_and_holds(
    tmp_path: Path, seed: int, geo_first: bool, cycle_s: float
) -> None:
    """A stored tail that GEO takes while the planner answers a change lasts
    seconds at a low override: it is left all the same. And where the path has
    come to rest it goes on with the next turns of the planner.
    """
    rng = np.random.default_rng(seed)
    cell = f"cycle_s = {cycle_s}\n[channel]\ntolerance_mm = 0.02\n"
    with Inside(tmp_path, curve_in_chords(), cell) as cnc:
        asked = np.empty(0)
        settled = np.empty(0, bool)
        cnc.level(cnc.bahn.override_valid, True)
        lib.engine_interleaved_stood()
        for _ in range(20):
            hold = bool(rng.random() < 0.2)
            override = float(rng.choice([0.02, 0.05, 0.1, 0.5]))
            cnc.level(cnc.bahn.feedhold, hold)
            cnc.level(cnc.bahn.override, round(1000 * override))
            n = round(rng.uniform(0.7, 1.0) / cycle_s)
            interleaved(cnc, len(asked) + n, seed, geo_first)
            n = int(cnc.engine.state.cycle) - len(asked)
            speed = 0.0 if hold else 100.0 * override
            asked = np.append(asked, np.full(n, speed))
            settled = np.append(settled, np.arange(n) * cycle_s > SETTLED_S)
        cnc._take()
        speeds = np.diff(np.concatenate(cnc.paths), prepend=0.0) / cycle_s
        assert (speeds <= 1.005 * asked + 1e-6)[settled].all()
        assert lib.engine_interleaved_stood() <= TURNS
        legal(cnc.pos, cnc.cell)


@pytest.mark.parametrize("seed", [525, 862, 936])
def test_drive_of_the_threads_switched_anywhere(
    tmp_path: Path, seed: int
) -> None:
    """What ``test_threads`` commands beside threads, with random switches: feed
    holds just behind a stand among it.
    """
    rng = np.random.default_rng(seed)
    with Inside(
        tmp_path,
        threaded.PROGRAM,
        threaded.CONFIG % threaded.FUNCTIONS,
        service=layout.HLI_SERVICE_IMMEDIATE,
    ) as cnc:
        handle = cnc.engine._handle

        def cycles(n: int, part: int) -> Event:
            return Event(
                lib.engine_interleaved(
                    handle,
                    n,
                    seed * 100_003 + part,
                    seed // 4 % 2,
                    seed // 8 % 2,
                )
            )

        threaded.drive_in_turns(cnc, rng, cycles)
        assert not cnc.engine.state.fault
        legal(cnc.pos, cnc.cell)
