"""The immediate look-ahead service in lockstep: in step with the scans."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from support.command_line import Outcome

Cli = Callable[..., Outcome]
Write = Callable[..., Path]
PLC = '''
from plc_client import task

@task(interval=0.001)
class Asks:
    """Sets the request by hand in every scan; notes when it is answered."""

    def setup(self, hli):
        self.unit = hli.gpCh[0].contour_lookahead
        self.scan_number, self.asked, self.found = 0, None, []

    def cyclic(self):
        self.scan_number += 1
        unit = self.unit
        if self.asked is not None and not unit.semaphor_rw:
            block = unit.response.block[0]
            self.found.append(
                [
                    self.scan_number - self.asked,
                    int(block.block_number),
                    float(block.start_position),
                    float(unit.state.max_dist_prog_start),
                ]
            )
            self.asked = None
        if self.asked is None:
            unit.request.start_position = self.scan_number * 1000.0
            unit.request.length = 5000.0
            unit.semaphor_rw = True
            self.asked = self.scan_number

    def result(self):
        return self.found
'''
PROGRAM = """G1 F6000
N10 X3
N20 G2 X9 I3 J0
#HSC ON [BSPLINE PATH_DEV 0.05]
N30 G1 X12 Y3
N40 X15
N50 Y9
#HSC OFF
N60 X0
"""


@pytest.mark.parametrize("service", ["immediate", "cyclic"])
@pytest.mark.ci
def test_every_answer_is_there_in_the_next_scan(
    cli: Cli, program: Write, service: str
) -> None:
    """isg_contour_lookahead 5.2: a request of one scan is answered ahead of the
    next one, and two runs are the same bit for bit.
    """
    plc, part = program(PLC, "plc.py"), program(PROGRAM)
    runs = [
        cli(
            "run",
            part,
            "--plc",
            plc,
            "--clock",
            "lockstep",
            "--service",
            service,
            "--json",
        ).json["plc"]["result"]
        for _ in range(2)
    ]
    assert {waited for waited, *_ in runs[0]} == {1}
    assert {number for _, number, *_ in runs[0]} >= {10, 20, 30, 40, 50, 60}
    assert runs[0] == runs[1]
