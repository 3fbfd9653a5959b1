"""Golden programs: ``tests/golden/<dialect>_<case>/program.*`` gives exactly
``expected.blocks``.

One JSON object a line: rows as ``Block.as_json``, waits in their place, for ISG
warnings and messages, then the errors. The machine has X Y Z and a rotary axis
A, tool 1 (radius 5, length 20 mm), M3 M5 M8, G54 and G55, V.E.GO and V.E.A.B.
``HLI_COSIM_GOLDEN=write`` writes the expectations anew.
"""

import json
import os

import numpy as np
import pytest

from cnc_core.blocks import blocks
from cnc_core.errors import Place
from cnc_core.frontend import create
from cnc_core.frontend.machine import External, ProgramMachine, Tool
from cnc_core.frontend.offline import read_all
from cnc_core.frontend.port import OfflinePort, Wait
from cnc_core.geometry.profiles.limits import AxisDynamics
from cnc_core.geometry.stages.profiles import Profiles
from support.paths import GOLDEN

CASES = sorted(p.parent.name for p in GOLDEN.glob("*/program.*"))
MACHINE = ProgramMachine(
    axes=("X", "Y", "Z", "A"),
    rotary=(False, False, False, True),
    main=(0, 1, 2),
    start=np.zeros(4),
    tools={1: Tool(5.0, 20.0)},
    m_functions={3: "MOS", 5: "MOS", 8: "MVS_SVS"},
    externals={
        "GO": External("GO", "UNS32", 1),
        "A.B": External("A.B", "REAL64", 2, 3),
    },
    zero_offsets={1: {"X": 100.0, "Y": 10.0}, 2: {"X": -50.0, "Z": 5.0}},
    g_programs={80: "g80.nc"},
    velocity=np.full(4, 300.0),
    limits=(np.full(4, -1000.0), np.full(4, 1000.0)),
)


def lines_of(path):
    port = OfflinePort(MACHINE.start)
    front_end = create(
        path.parent.name.partition("_")[0], path, MACHINE, port, collect=True
    )
    start = MACHINE.start.copy()
    limits, dynamics = (
        MACHINE.limits,
        AxisDynamics(MACHINE.velocity, np.full(4, 3000.0), np.full(4, 50000.0)),
    )
    place = lambda file, line: Place(line=line)  # noqa: E731
    profiles = Profiles(
        MACHINE.main, place, {}, limits, dynamics, 0.001, described=True
    )
    for item in read_all(front_end, rows=3):
        if isinstance(item, Wait):
            yield {"wait": item.value}
        else:
            if item.profile is not None:
                item = profiles.push(item)  # noqa: PLW2901
            yield from (
                block.as_json()
                for block in blocks(item, start, MACHINE.axes, MACHINE.main)
            )
    if path.parent.name.startswith("isg_"):
        yield from (
            {"warning": w.code, "line": w.place.line}
            for w in front_end.warnings
        )
        yield from (
            {"message": text}
            for text in port.messages
            if not text.startswith(str(path.parent))
        )
    for error in front_end.errors:
        yield {
            name: value
            for name, value in error.as_json().items()
            if name != "file"
        }


def nearly(value):
    """The value with every number compared to 1e-9."""
    if isinstance(value, dict):
        return {name: nearly(v) for name, v in value.items()}
    if isinstance(value, list):
        return [nearly(v) for v in value]
    return (
        pytest.approx(value, rel=1e-12, abs=1e-9)
        if isinstance(value, float)
        else value
    )


@pytest.mark.parametrize("case", CASES)
def test_program_gives_expected_blocks(case):
    """Rows, waits and errors of the program are those written beside it."""
    expected = GOLDEN / case / "expected.blocks"
    found = list(lines_of(next((GOLDEN / case).glob("program.*"))))
    if os.environ.get("HLI_COSIM_GOLDEN") == "write":
        expected.write_text("".join(json.dumps(line) + "\n" for line in found))
    wanted = [json.loads(line) for line in expected.read_text().splitlines()]
    assert [line.get("type") for line in found] == [
        line.get("type") for line in wanted
    ]
    for line, want in zip(found, wanted, strict=True):
        assert line == nearly(want)
