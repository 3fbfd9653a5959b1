"""Control from the PLC: single block, M01, rapid override (hli_reference section 5.1)."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core import Cell

Write = Callable[..., Path]
PLC = """
from plc_client import task

@task(interval=0.001)
class Control:
    def setup(self, hli):
        self.hli, self.ch = hli, hli.gpCh[0]
        c = self.ch.bahn_mc_control
        for name, value in {commands}.items():
            unit = getattr(c, name)
            unit.command_w = value
            unit.enable_w = True
        c.continue_machining.enable_w = True
        self.stops, self.since = [], 0

    def cyclic(self):
        b, go = self.ch.bahn_state, self.ch.bahn_mc_control.continue_machining
        if b.wait_continue_r and not go.command_w:
            self.since += 1
            if self.since == 50:
                self.stops.append((b.dist_prog_start, b.stop_condition_r, b.active_feed_r))
                go.command_w = True
        elif not b.wait_continue_r:
            go.command_w, self.since = False, 0

    def result(self):
        return self.stops
"""


def stops_of(
    cell: Cell,
    program: Write,
    text: str,
    commands: dict[str, object],
    record: Path | None = None,
) -> list[list[float]]:
    plc = program(PLC.replace("{commands}", repr(commands)), "control.py")
    result = cell.run(program(text), plc, record=record)
    assert result.end == "completed", result.errors
    return list(result.plc["result"])


PROGRAM = "F6000 G1\nX10\nX20\nX20 Y10\nM1\nX30\nM0\nM30\n"


def test_single_block_stands_before_every_motion_block(
    cell: Cell, program: Write
) -> None:
    """The first block runs, each further one waits at its start for continue;
    M00 still waits, M01 does not.
    """
    stops = stops_of(cell, program, PROGRAM, {"single_block": True})
    assert [(d, c) for d, c, _ in stops] == [
        (100_000.0, 8),
        (200_000.0, 8),
        (300_000.0, 8),
        (400_000.0, 16),
    ]
    assert all(v == 0 for _, _, v in stops)


@pytest.mark.ci
def test_m01_stops_only_when_enabled(
    cell: Cell, program: Write, tmp_path: Path
) -> None:
    """Without m01_stop_enable M01 is passed without slowing down; with it the channel waits."""
    assert [
        (d, c)
        for d, c, _ in stops_of(
            cell, program, PROGRAM, {"m01_stop_enable": True}
        )
    ] == [
        (300_000.0, 32),
        (400_000.0, 16),
    ]
    record = tmp_path / "r.npz"
    assert (
        stops_of(cell, program, "F6000 G1\nX50\nM1\nX100\nM30\n", {}, record)
        == []
    )
    with np.load(record) as columns:
        assert columns["v"][
            (columns["s"] > 5) & (columns["s"] < 95)
        ].min() == pytest.approx(100.0)


@pytest.mark.ci
@pytest.mark.parametrize(
    ("mode", "speed"), [(0, 150.0), (1, 75.0), (2, 75.0), (3, 75.0)]
)
def test_rapid_override_by_p_chan_00181(
    program: Write, tmp_path: Path, mode: int, speed: float
) -> None:
    """Rapid follows the feed override, the smaller one, or the rapid override alone."""
    config = program(f"[channel]\nrapid_override_mode = {mode}\n", "cell.toml")
    record = tmp_path / "r.npz"
    commands = {
        "override": 500,
        "override_valid": True,
        "rapid_override": 250,
        "rapid_override_valid": True,
    }
    with Cell(config) as cell:
        stops_of(cell, program, "G0 X100\nM30\n", commands, record)
    with np.load(record) as columns:
        assert columns["v"].max() == pytest.approx(speed)
