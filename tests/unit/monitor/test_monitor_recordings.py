"""Recordings on the monitor's page: the contour table, and several channels."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from cnc_core import Cell, Recording
from cnc_core.monitor.recorded import Recorded
from cnc_core.observing.plc import RefusedError
from cnc_core.observing.sight import MM

CELL = """
[channels.mill.axes.X]
[channels.mill.axes.Y]
[channels.saw.axes.Y]
"""
PROGRAMS = {
    "mill": (
        "N10 G1 X20 F6000\nN20 G3 X30 Y10 I0 J10\nN30 G1 Y40\n"
        "N35 #DISTANCE PROG START CLEAR\nN40 X0\nN50 Y0\nM30\n"
    ),
    "saw": "N5 G1 Y30 F3000\nN15 Y0\nN25 Y12\nM30\n",
}
PLC = """
import json
from plc_client import ContourLookahead, task

@task(interval=0.004)
class Asks:
    def setup(self, hli):
        self.channels = [hli.gpCh[i] for i in range(2)]
        self.units = [ContourLookahead(ch) for ch in self.channels]
        self.file = open({file!r}, "w", buffering=1)

    def cyclic(self):
        for i, unit in enumerate(self.units):
            begin = self.channels[i].bahn_state.dist_prog_start
            unit(start_position=begin, length=250_000.0)
            if unit.done:
                names = ["block_type", "block_number", "start_position", "length"]
                rows = [[float(b[n]) for n in names] for b in unit.blocks]
                self.file.write(json.dumps([i, rows]) + "\\n")
"""
TYPES = {1: "linear", 2: "circular"}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recorded run of two channels, and what its PLC got for answers."""
    place = tmp_path_factory.mktemp("recorded")
    (place / "cell.toml").write_text(CELL)
    (place / "asks.py").write_text(PLC.format(file=str(place / "answers")))
    files = []
    for name, text in PROGRAMS.items():
        files.append(place / f"{name}.nc")
        files[-1].write_text(text)
    with Cell(place / "cell.toml") as cell:
        kept = place / "run.arrow"
        cell.run(files, plc=place / "asks.py", record=kept).check()
    return place


def answers(folder: Path, channel: int) -> list[list[list[float]]]:
    """What the PLC got, one answer behind the other."""
    lines = (folder / "answers").read_text().splitlines()
    told = [json.loads(line) for line in lines]
    return [rows for index, rows in told if index == channel]


def as_rows(elements: list[dict[str, Any]]) -> list[list[Any]]:
    return [[e["type"], e["n"], e["start"], e["length"]] for e in elements]


@pytest.mark.parametrize(("index", "name"), [(0, "mill"), (1, "saw")])
def test_the_contour_of_a_recording_is_what_the_plc_got(
    folder: Path, index: int, name: str
) -> None:
    """Each answer of the run, at the time of its request, by channel."""
    served = Recorded([folder / "run.arrow"])
    requests = Recording(folder / "run.arrow").channel(name).requests
    got = answers(folder, index)
    times = requests["t"].tolist()
    assert len(times) - 1 <= len(got) <= len(times)
    assert max(map(len, got)) > 1
    for time_s, rows in zip(times, got, strict=False):
        contour = served.contour("run.arrow", name, time_s)
        wanted = [
            [
                TYPES[int(kind)],
                n,
                pytest.approx(start * MM),
                pytest.approx(length * MM),
            ]
            for kind, n, start, length in rows
        ]
        assert as_rows(contour["elements"]) == wanted
        assert "problem" not in contour
        assert contour["length"] == pytest.approx(25.0)


def test_a_recording_has_its_channels(folder: Path) -> None:
    """One name in the list; the first channel unless another one is named."""
    served = Recorded([folder / "run.arrow"])
    assert served.names() == ["run.arrow"]
    page = served.shown("run.arrow")
    assert (page["channels"], page["channel"]) == (["mill", "saw"], "mill")
    assert page["axes"] == ["X", "Y"]
    other = served.shown("run.arrow", "saw")
    assert (page["program"], other["program"]) == ("mill.nc", "saw.nc")
    assert other["axes"] == ["Y"]
    assert other["lines"][0].startswith("N5")
    assert served.shown("run.arrow saw") == other
    for name, channel in (("run.arrow", "lathe"), ("none", ""), ("", "saw")):
        with pytest.raises(RefusedError):
            served.shown(name, channel)
        with pytest.raises(RefusedError):
            served.contour(name, channel, 0.1)


def test_ahead_of_the_first_request_there_is_none(folder: Path) -> None:
    """Nothing was asked yet."""
    served = Recorded([folder / "run.arrow"])
    found = served.contour("run.arrow", "mill", -1.0)
    assert found == {"elements": []}


@pytest.mark.ci
def test_what_a_recording_lacks_is_told(tmp_path: Path) -> None:
    """Without the table of requests, and behind a request of the marked log."""
    part = tmp_path / "part.nc"
    part.write_text(
        "#CONTOUR LOOKAHEAD LOG ON [PARAM=1]\nG1 X5 F6000\nX9\nM30\n"
    )
    plc = tmp_path / "log.py"
    plc.write_text(
        PLC.format(file=str(tmp_path / "answers"))
        .replace("range(2)", "range(1)")
        .replace("begin, length=250_000.0", "0.0, length=0.0")
    )
    with Cell() as cell:
        cell.run(part, plc=plc, record=tmp_path / "log.arrow").check()
        cell.run(part, record=tmp_path / "v.arrow", record_only=("v",)).check()
    served = Recorded([tmp_path / "log.arrow", tmp_path / "v.arrow"])
    found = served.contour("log.arrow", "", 100.0)
    assert (found["mode"], found["elements"]) == (1, [])
    assert "marked log" in found["problem"]
    assert "no table requests" in served.contour("v.arrow", "", 1.0)["problem"]
