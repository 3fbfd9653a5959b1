"""The fixture ``plc`` beside the real CNC records as a run of both processes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core import Cell, Recording
from cnc_core.errors import CncError
from cnc_core.pytest_plugin import PlcFactory
from cnc_core.recording.replay import programs_of, replay
from plc_client.mock import line

Write = Callable[..., Path]
PLC = """from plc_client import FeedControl, task


@task(interval=0.004)
class Slow:
    def setup(self, hli):
        self.feed = FeedControl(hli.gpCh[0])
        self.scans = 0

    def cyclic(self):
        self.scans += 1
        self.feed(override=50.0 if self.scans > 20 else 100.0)
"""


@pytest.fixture
def slow(tmp_path: Path) -> Path:
    file = tmp_path / "slow.py"
    file.write_text(PLC)
    return file


@pytest.mark.ci
def test_it_records_what_a_run_records(
    plc: PlcFactory, program: Write, slow: Path, tmp_path: Path
) -> None:
    """The same cycles and scans; a replay of the same PLC has no difference."""
    part = program("G1 X4 F3000\nM30\n")
    stepped, ran = tmp_path / "stepped.parquet", tmp_path / "ran.parquet"
    runner = plc(slow, part, record=stepped, watch="Slow.scans")
    runner.run_to_end()
    runner.close()
    recording = Recording(stepped)
    scans = recording.plc["Slow.scans"]
    assert np.array_equal(scans, np.arange(len(scans)) + 1.0)
    assert replay(recording, programs_of(str(slow))).equal
    with Cell() as cell:
        cell.run(part, slow, record=ran, watch="Slow.scans").check()
    both = [Recording(path).cycles["v"] for path in (stepped, ran)]
    count = min(map(len, both))
    assert count > 100
    assert np.array_equal(both[0][:count], both[1][:count])


def test_it_keeps_less(
    plc: PlcFactory, program: Write, slow: Path, tmp_path: Path
) -> None:
    """``record_only``; closing twice is closing once."""
    target = tmp_path / "run.arrow"
    runner = plc(slow, program("X1\nM30\n"), record=target, record_only="v")
    runner.step(20)
    runner.close()
    report = runner.cnc_report
    runner.close()
    assert runner.cnc_report is report
    assert Recording(target).tables == ("cycles",)
    assert Recording(target).cycles.columns == ("cycle", "t", "v")
    assert not target.with_name("run.arrow.parts").exists()


def test_what_cannot_be_recorded_is_refused(
    plc: PlcFactory, program: Write, slow: Path, tmp_path: Path
) -> None:
    """The mock, and unknown columns."""
    with pytest.raises(ValueError, match="the mock CNC has nothing to record"):
        plc(slow, script=[line(1)], record=tmp_path / "run.arrow")
    part = program("X1\nM30\n")
    with pytest.raises(CncError, match="did you mean override"):
        plc(slow, part, record=tmp_path / "a.arrow", record_only="overide")


def test_a_folder_that_cannot_be_made_is_told_at_the_end(
    plc: PlcFactory, program: Write, slow: Path
) -> None:
    """The run goes on; close() says that nothing is recorded."""
    target = program("", "file") / "a.arrow"
    runner = plc(slow, program("X1\nM30\n"), record=target)
    runner.step(20)
    with pytest.raises(CncError, match="nothing is recorded"):
        runner.close()
