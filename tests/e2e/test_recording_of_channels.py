"""Recordings of a cell with several channels: one file, nothing mixed up."""

from __future__ import annotations

import json
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from cnc_core import Cell, CncError, Recording, RunResult
from cnc_core.engine import Event
from cnc_core.engine.recorded import Recorded as Rings
from cnc_core.monitor.recorded import Recorded
from cnc_core.observing.plc import RefusedError
from cnc_core.recording.channels import ChannelsSource
from cnc_core.recording.compare import compare
from cnc_core.recording.parts import part_of_channel
from cnc_core.recording.schema import is_wall
from cnc_core.recording.source import ArrowSource
from hli.part_file import PartFile
from support.channels import Channels
from support.command_line import Outcome
from support.paths import ROOT

Cli = Callable[..., Outcome]
FUNCTIONS = """[channel.m_synch]
8 = "MOS"
9 = "MOS"
"""
CELL = f"""{FUNCTIONS}
[channels.mill.axes.X]
[channels.mill.axes.Y]
[channels.saw.axes.X]
v_max_mm_s = 50.0
"""
ALONE = {"mill": "[axes.X]\n[axes.Y]\n", "saw": "[axes.X]\nv_max_mm_s = 50.0\n"}
TEXTS = {
    "mill": 'F6000\nM8\nG1 X20 Y5\nG1 X0 Y0\n#MSG ["cut"]\nM30\n',
    "saw": "F1200\nG1 X9\nM9\nG1 X2\nG1 X7\nM30\n",
}
OF_THE_CELL = ("state", "stop_condition", "count")
PLC = """
from plc_client import ContourLookahead, task

@task(interval=0.004)
class Asks:
    def setup(self, hli):
        self.units = [ContourLookahead(hli.gpCh[i]) for i in range(2)]

    def cyclic(self):
        for i, unit in enumerate(self.units):
            unit(start_position=0.0, length=10_000.0 * (i + 1))
"""


def run(folder: Path, name: str, **options: object) -> RunResult:
    (folder / "cell.toml").write_text(CELL)
    (folder / "plc.py").write_text(PLC)
    files = []
    for channel, text in TEXTS.items():
        files.append(folder / f"{channel}.nc")
        files[-1].write_text(text)
    with Cell(folder / "cell.toml") as cell:
        plc = folder / "plc.py"
        kept = folder / name
        result = cell.run(files, plc=plc, record=kept, **options)
    return result.check()


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("channels")
    run(place, "run.parquet")
    return place


@pytest.fixture(scope="module")
def recording(folder: Path) -> Recording:
    return Recording(folder / "run.parquet")


def test_a_row_is_a_cycle_of_all_channels(recording: Recording) -> None:
    """Time once, columns by channel, no cycle missing."""
    assert recording.complete
    assert recording.channels == ("mill", "saw")
    cycles = recording.cycles
    assert np.array_equal(np.diff(cycles["cycle"]), np.ones(len(cycles) - 1))
    assert cycles.columns[:2] == ("cycle", "t")
    assert cycles["mill.X"].max() == pytest.approx(20.0)
    assert cycles["mill.Y"].max() == pytest.approx(5.0)
    assert cycles["saw.X"].max() == pytest.approx(9.0)
    assert "saw.Y" not in cycles.columns
    assert cycles.units["saw.X"] == "mm"


@pytest.mark.ci
def test_the_column_of_an_axis_follows_it(tmp_path: Path) -> None:
    """The table at home in one channel is turned by both; its column shows it
    all, without a jump, and there is none for the place of a guest.
    """
    folder = ROOT / "examples" / "shared_table"
    kept = tmp_path / "run.arrow"
    with Cell(folder / "cell.toml") as cell:
        cell.run([], plc=folder / "table.py", record=kept).check()
    cycles = Recording(kept).cycles
    assert [name for name in cycles.columns if "QFREE" in name] == []
    table = cycles["right.C"]
    assert table[-1] == pytest.approx(3 * 40.0 + 3 * 20.0)
    assert np.abs(np.diff(table)).max() <= 0.09 + 1e-9  # 90 degrees/s
    by_left = np.diff(table)[cycles["right.line"][1:] != 4]
    assert np.sum(by_left) == pytest.approx(60.0)
    run_alone = Recording(kept).channel("right")
    assert np.array_equal(run_alone.cycles["C"], table)


@pytest.mark.parametrize("name", ["mill", "saw"])
def test_a_channel_reads_as_it_would_alone(
    recording: Recording, tmp_path: Path, name: str
) -> None:
    """Its motion is that of the same program in a cell with one channel."""
    one = recording.channel(name)
    assert one.channels == ()
    (tmp_path / "cell.toml").write_text(ALONE[name] + FUNCTIONS)
    (tmp_path / "part.nc").write_text(TEXTS[name])
    target = tmp_path / "alone.arrow"
    with Cell(tmp_path / "cell.toml") as cell:
        cell.run(tmp_path / "part.nc", plc="none", record=target).check()
    alone = Recording(target)
    n = int(np.argmax(alone.cycles["s"] == alone.cycles["s"].max()))
    for column in alone.cycles.columns:
        if column not in OF_THE_CELL and not is_wall("cycles", column):
            found = one.cycles[column][: n + 1]
            assert np.array_equal(found, alone.cycles[column][: n + 1]), column
    for column in ("start", "length", "n", "line"):
        if column in alone.elements.columns:
            assert np.array_equal(one.elements[column], alone.elements[column])
    assert one.meta["axes"].keys() == alone.meta["axes"].keys()
    assert one.meta["program"]["text"] == TEXTS[name]


def test_rows_tell_whose_they_are(recording: Recording) -> None:
    """Functions, requests and events of one channel do not show in the other."""
    table = recording.functions
    assert list(zip(table["channel"], table["code"], strict=True)) == [
        ("mill", 8),
        ("saw", 9),
    ]
    for name, length in (("mill", 10_000.0), ("saw", 20_000.0)):
        asked = recording.channel(name).requests["length"]
        assert len(asked) > 10
        assert set(asked) == {length}
    events = recording.events
    said = [
        (channel, text)
        for channel, kind, text in zip(
            events["channel"], events["kind"], events["text"], strict=True
        )
        if kind == "message"
    ]
    assert said == [("mill", "cut")]


@pytest.mark.ci
@pytest.mark.parametrize("kind", [".arrow", ".npz"])
def test_equal_runs_give_equal_files_of_every_kind(
    folder: Path, recording: Recording, kind: str
) -> None:
    """And the comparison finds a run in which one channel is otherwise."""
    run(folder, f"again{kind}")
    again = Recording(folder / f"again{kind}")
    assert compare(recording, again).equal
    assert compare(recording.channel("saw"), again.channel("saw")).equal
    assert not compare(recording.channel("saw"), again.channel("mill")).equal


@pytest.mark.ci
def test_chosen_columns_hold_for_every_channel(tmp_path: Path) -> None:
    """An axis that a channel has not is not meant for it; a name that none has
    is refused.
    """
    run(tmp_path, "run.csv")
    heads = (tmp_path / "run.csv").read_text().splitlines()[0]
    assert heads == (
        "t,mill.X,mill.Y,saw.X,mill.s,mill.v,mill.block,saw.s,saw.v,saw.block"
    )
    run(tmp_path, "few.arrow", record_only=["v", "Y"])
    columns = Recording(tmp_path / "few.arrow").cycles.columns
    assert columns == ("cycle", "t", "mill.Y", "mill.v", "saw.v")
    with pytest.raises(CncError, match="no such column"):
        run(tmp_path, "none.arrow", record_only=["Q"])
    with pytest.raises(CncError, match="one channel"):
        run(tmp_path, "none.mcap")


@pytest.mark.ci
def test_commands_know_the_channel(folder: Path, cli: Cli) -> None:
    """``inspect``, ``compare`` and ``show`` take one; what needs a path asks."""
    file = str(folder / "run.parquet")
    told = cli(
        "inspect", file, "--channel", "saw", "--at", "cycle=400", "--json"
    )
    row = json.loads(told.out)["at"]["cycles"]
    cycles = Recording(file).cycles
    at = int(np.searchsorted(cycles["cycle"], 400))
    assert row["X"] == cycles["saw.X"][at]
    asked = cli("inspect", file, "--at", "cycle=400")
    assert asked.status
    assert "--channel, one of mill, saw" in asked.err
    assert "no channel" in cli("inspect", file, "--channel", "lathe").err
    asked = cli("compare", file, file, "--by", "line")
    assert "--channel, one of mill, saw" in asked.err
    cli("compare", file, file, "--by", "line", "--channel", "saw")
    page = folder / "page.html"
    cli("show", file, "-o", str(page))
    assert "run.parquet saw" in page.read_text()


@pytest.mark.ci
def test_the_same_plc_replays_without_a_difference(
    folder: Path, cli: Cli
) -> None:
    """A PLC that asks the second channel otherwise gets answers of that one."""
    file, plc = str(folder / "run.parquet"), folder / "plc.py"
    assert "equal" in cli("replay", file, "--plc", str(plc)).out
    other = folder / "other.py"
    asks = PLC.replace("(i + 1))", "(i + 1) + 5_000.0 * i)")
    other.write_text(
        asks
        + "            if i and unit.done and len(unit.blocks):\n"
        + "                assert unit.blocks['length'][0] == 90_000.0\n"
    )
    found = cli("replay", file, "--plc", str(other), "--json").json
    assert list(found["counts"]) == ["gpCh[1].contour_lookahead.request.length"]


def part(path: Path, name: str, cycles: list[int]) -> ArrowSource:
    """The part of a channel, of which some cycles are lost."""
    units = {"cycle": "", "t": "s", "v": "mm/s"}
    meta = {
        "channel": {"index": 0, "name": name, "numbers": []},
        "columns": {"cycles": units},
        "axes": {},
        "start": {},
        "program": {},
    }
    types = {"cycle": "uint64", "t": "double", "v": "double"}
    file = PartFile(path, {"cycles": types}, json.dumps(meta).encode())
    for first in range(0, len(cycles), 3):
        rows = np.array(cycles[first : first + 3], np.uint64)
        file.add({"cycles": {"cycle": rows, "t": rows * 1.0, "v": rows * 2.0}})
    file.close()
    return ArrowSource(path)


def test_what_a_channel_has_lost_shifts_no_other(tmp_path: Path) -> None:
    """Rows stand side by side by their cycle, wherever batches end."""
    lists = ([1, 2, 3, 5, 6, 7, 8], [2, 3, 4, 5, 7, 8, 9, 10], [*range(1, 12)])
    first = tmp_path / "cnc.arrow"
    source = ChannelsSource(
        [
            part(part_of_channel(first, i), f"c{i}", cycles)
            for i, cycles in enumerate(lists)
        ]
    )
    found = [
        row
        for chunk in source.chunks("cycles", ["c2.v", "cycle", "c0.v"])
        for row in chunk.to_pylist()
    ]
    assert [row["cycle"] for row in found] == [2, 3, 5, 7, 8]
    assert all(
        row["c2.v"] == row["c0.v"] == 2.0 * row["cycle"] for row in found
    )
    assert source.rows("cycles") == 5


def test_a_channel_whose_program_changes_stands_in_the_recording(
    tmp_path: Path,
) -> None:
    """In real time the others drive on; no cycle of it is missing."""
    texts = ["G1 X2000 F6000\nM30\n"] * 2
    cell = "[channels.a.axes.X]\n[channels.b.axes.X]\n"
    with Channels(
        tmp_path,
        texts,
        cell,
        clock="realtime",
        samples=tmp_path / "cnc.arrow",
    ) as cnc:
        first, second = (channel.engine for channel in cnc.channels)
        for engine in (first, second):
            engine.start()

        def drive(cycles: int) -> None:
            until = cnc.cycle + cycles
            while cnc.cycle < until:
                event, who = cnc.group.wait(0.01)
                if event is not Event.DONE:
                    cnc.channels[who].handle(event)

        drive(20)
        second.stop()
        behind = cnc.cycle + 5
        while cnc.cycle < behind:
            time.sleep(0.001)
        second.start()
        drive(5)
        second.stop()
        first.stop()
        for channel in cnc.channels:
            channel.recorder.close()
        assert not any(engine.lost(Rings.SAMPLES) for engine in (first, second))
    cycles = ArrowSource(tmp_path / "cnc-1.arrow")
    numbers = np.concatenate(
        [
            chunk.column("cycle").to_numpy()
            for chunk in cycles.chunks("cycles", ["cycle"])
        ]
    )
    assert np.array_equal(np.diff(numbers), np.ones(len(numbers) - 1))


def test_the_monitors_page_shows_each_channel(folder: Path) -> None:
    """And shows its columns, rows and program alone."""
    served = Recorded([folder / "run.parquet"])
    assert served.names() == ["run.parquet"]
    page = served.shown("run.parquet", "saw")
    assert served.shown("run.parquet saw") == page
    assert (page["channels"], page["channel"]) == (["mill", "saw"], "saw")
    assert page["name"] == "run.parquet"
    assert page["axes"] == ["X"]
    assert max(page["columns"]["X"]) == pytest.approx(9.0)
    assert [row["code"] for row in page["functions"]] == [9]
    assert page["lines"] == TEXTS["saw"].splitlines()
    with pytest.raises(RefusedError, match="no channel"):
        served.shown("run.parquet lathe")
