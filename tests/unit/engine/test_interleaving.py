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
