"""Whatever the PLC commands: the samples stay within the limits, and the path
goes on when it is let go.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from support.commanded import config, drive, program
from support.inside import Inside
from support.limits import legal
from support.seeds import few

pytestmark = pytest.mark.sanitize("engine")

CASES = [
    (seed, options)
    for options in ("", "c", "f", "n", "nc", "nf")
    for seed in range(6)
]
# the path is fed anew where it stands; a hold over an inserted stop, twice; a
# step over a stretch that was cut anew
CASES += [
    (9, ""),
    (56, ""),
    (13, "c"),
    (5, "nc"),
    (24, "n"),
    (36, "nc"),
    (9, "n"),
]


@pytest.mark.ci_cases
@pytest.mark.parametrize(("seed", "options"), few(sorted(CASES), 6))
def test_random_commands_leave_no_limit(
    tmp_path: Path, seed: int, options: str
) -> None:
    """Feed hold, override, backward motion, single block, inserted stops,
    deleted distance, loops: at any cycle.
    """
    rng = np.random.default_rng(seed)
    text = program(rng)
    with Inside(tmp_path, text, config(rng, options)) as cnc:
        pos, way = drive(cnc, rng, lambda n, _: cnc.engine.run(n))
        legal(pos, cnc.cell)
        assert way > 1e-3
        assert cnc.engine.state.infeasible == 0
