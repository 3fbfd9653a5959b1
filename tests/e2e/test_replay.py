"""Replays: a PLC against a recorded CNC, and where it writes something else."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core import Cell, Recording
from cnc_core.recording.recorded_answers import Answers, RecordedContour
from cnc_core.recording.replay import Replay, _Run, programs_of, replay
from cnc_core.recording.targets import write_target
from hli import layout
from hli.view import BLOCK_DTYPE
from support.command_line import Outcome
from support.paths import ROOT
from support.seeds import few

EXAMPLES = ROOT / "examples"
Cli = Callable[..., Outcome]
OVERRIDE = EXAMPLES / "override_from_contour.py"
# PLC, NC program, cell
CASES = [
    ("override_from_contour.py", "part.nc", "cell.toml"),
    ("spark_erosion/with_lookahead.py", "part.nc", "cell.toml"),
    ("override_from_contour.st", "part.nc", "cell.toml"),
    ("read_marked_log.py", "part.nc", "cell.toml"),
    ("spark_erosion/without_lookahead.py", "part.nc", "cell.toml"),
    ("dispenser/with_lookahead.py", "part.nc", "cell.toml"),
    ("dispenser/without_lookahead.py", "part.nc", "cell.toml"),
    ("laser_power/with_lookahead.py", "part.nc", "cell.toml"),
    ("laser_power/without_lookahead.py", "part.nc", "cell.toml"),
    ("sharp_tangents/with_lookahead.py", "part.nc", "cell.toml"),
    ("sharp_tangents/without_lookahead.py", "part.nc", "cell.toml"),
    ("osai/watch_elements.py", "part.osai", "cell.toml"),
    ("where_in_t.py", "part.nc", "cell.toml"),
    ("where_in_t.st", "part.nc", "cell.toml"),
    ("read_marked_log.st", "part.nc", "cell.toml"),
    ("spark_erosion/with_lookahead.st", "part.nc", "cell.toml"),
    ("spark_erosion/without_lookahead.st", "part.nc", "cell.toml"),
    ("dispenser/with_lookahead.st", "part.nc", "cell.toml"),
    ("dispenser/without_lookahead.st", "part.nc", "cell.toml"),
    ("laser_power/with_lookahead.st", "part.nc", "cell.toml"),
    ("laser_power/without_lookahead.st", "part.nc", "cell.toml"),
    ("sharp_tangents/with_lookahead.st", "part.nc", "cell.toml"),
    ("sharp_tangents/without_lookahead.st", "part.nc", "cell.toml"),
    ("osai/watch_elements.st", "part.osai", "cell.toml"),
]
WATCHED = {
    "spark_erosion/with_lookahead.py": ("Generator.fine",),
    "dispenser/with_lookahead.py": ("Valve.open",),
}


def again(recording: Path, plc: Path | str) -> Replay:
    return replay(Recording(recording), programs_of(str(plc)))


def record(plc: Path | str, program: Path, target: Path, **run: Any) -> Path:
    config = run.pop("config", None)
    with Cell(config) as cell:
        result = cell.run(program, plc, record=target, **run)
    assert result.end == "completed", result.errors
    return target


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The first example's run."""
    target = tmp_path_factory.mktemp("recorded") / "r.parquet"
    config = EXAMPLES / "cell.toml"
    return record(OVERRIDE, EXAMPLES / "part.nc", target, config=config)


@pytest.mark.parametrize(("plc", "program", "cell"), few(CASES, 2))
@pytest.mark.ci_cases
def test_the_same_plc_writes_the_same(
    plc: str, program: str, cell: str, tmp_path: Path
) -> None:
    """Every example: each scan again, no difference; watched symbols too."""
    folder = (EXAMPLES / plc).parent
    target = record(
        EXAMPLES / plc,
        folder / program,
        tmp_path / "r.arrow",
        config=folder / cell,
        watch=WATCHED.get(plc, ()),
    )
    found = again(target, EXAMPLES / plc)
    assert found.equal, found.first
    assert found.warnings == []
    assert found.scans == len(Recording(target).plc)


def changed(tmp_path: Path, old: str, new: str) -> Path:
    text = OVERRIDE.read_text()
    assert old in text
    path = tmp_path / "new.py"
    path.write_text(text.replace(old, new))
    return path


@pytest.mark.ci
def test_another_value_is_told(recorded: Path, tmp_path: Path) -> None:
    """61 % where 60 % was written: the scan, its line, member and both values."""
    found = again(recorded, changed(tmp_path, "60.0 if", "61.0 if"))
    assert found.first is not None
    member = "gpCh[0].bahn_mc_control.override.command_w"
    assert found.first.member == member
    assert (found.first.old, found.first.new) == (600, 610)
    recording = Recording(recorded)
    cycle = int(np.searchsorted(recording.cycles["cycle"], found.first.cycle))
    assert found.first.line == recording.cycles["line"][cycle] > 0
    assert found.counts.keys() == {member}
    exchange = recording.exchange
    writes = exchange["by_plc"] & (exchange["scan"] == found.first.scan)
    assert writes.any(), "the old one wrote in this scan"


@pytest.mark.parametrize("holder", few(["gpVEGlobal", "gpVECh[0]"], 1))
@pytest.mark.ci
def test_an_external_variable_is_told_from_its_first_scan(
    recorded: Path, tmp_path: Path, holder: str
) -> None:
    """They are compared as soon as somebody uses one: in this very scan."""
    write = f"self.hli.{holder}.value[3] = 7"
    text = OVERRIDE.read_text()
    text = text.replace(
        "self.ch = hli.gpCh[0]",
        "self.ch = hli.gpCh[0]; self.hli = hli; self.n = 0",
    )
    text = text.replace(
        "        self.clah(\n",
        "        self.n += 1\n        if self.n == 700:\n"
        f"            {write}\n        self.clah(\n",
    )
    plc = tmp_path / "new.py"
    plc.write_text(text)
    found = again(recorded, plc)
    assert found.first is not None
    assert found.first.scan == 700
    assert found.first.member.startswith(f"{holder}.value[3")
    assert found.counts == {found.first.member: found.scans - 699}
    # and the other way round: what only the recorded PLC wrote is told
    old = record(
        plc,
        EXAMPLES / "part.nc",
        tmp_path / "r.arrow",
        config=EXAMPLES / "cell.toml",
    )
    assert again(old, plc).equal
    missed = again(old, OVERRIDE)
    assert missed.first is not None
    assert (missed.first.scan, missed.counts) == (700, found.counts)


def test_another_request_is_answered_from_the_elements(
    recorded: Path, tmp_path: Path
) -> None:
    """Looks 10 mm instead of 5 mm ahead: it sees the arcs sooner, and asks again
    and again as it would beside the CNC.
    """
    found = again(recorded, changed(tmp_path, "50_000.0", "100_000.0"))
    assert found.first is not None
    assert found.first.member.endswith("contour_lookahead.request.length")
    sooner = found.counts["gpCh[0].bahn_mc_control.override.command_w"]
    assert 50 < sooner < found.scans // 2
    assert "gpCh[0].contour_lookahead.semaphor_rw" not in found.counts


def test_answers_from_elements_are_the_engines_own(recorded: Path) -> None:
    """Each answer of the run is what the recorded elements give for its request."""
    recording = Recording(recorded)
    contour = RecordedContour(recording)
    exchange = recording.exchange
    memory = np.zeros(1 << 17, np.uint64)
    begin = (
        layout.HLI_SEGMENT.channel.offset
        + layout.HLI_CHANNEL.contour_lookahead.offset
    )
    unit = layout.HLI_CONTOUR_LOOKAHEAD.from_buffer(memory, begin)
    ahead = layout.HLI_AHEAD.from_buffer(
        memory, layout.HLI_SEGMENT.ahead.offset
    )
    asked, seen = None, 0
    rows = zip(
        exchange["scan"], exchange["by_plc"], exchange["word"],
        exchange["value"], strict=True,
    )  # fmt: skip
    held: tuple[int, bool] = (0, False)
    for scan, by_plc, word, value in rows:
        if (scan, by_plc) != held:
            if asked and not unit.semaphor_rw and not held[1]:
                got = np.frombuffer(unit.response.block, BLOCK_DTYPE)
                got = got[: int(np.argmax(got["block_type"] == 0))]
                told = contour.answer(
                    *asked, ahead.state.epoch, unit.state.max_dist_prog_start
                )
                for name in ("block_number", "start_position", "length"):
                    assert (got[name] == told[name]).all(), (scan, name)
                seen += 1
                asked = None
            if held[1] and unit.semaphor_rw:
                asked = (unit.request.start_position, unit.request.length)
            held = (scan, by_plc)
        memory[word] = value
    assert seen > 1000


PLC = """from plc_client import task
@task()
class A:
    def setup(self, hli):
        self.n = self.k = self.door = self.q = 0
    def cyclic(self):
        self.n += 1 + self.k + self.door
"""


def test_watched_symbols_are_compared(tmp_path: Path) -> None:
    """What the PLC keeps to itself differs as well, if it was watched; a symbol
    that the new PLC has not is told.  Simulated inputs and forces come again.
    """
    nc = tmp_path / "part.nc"
    nc.write_text("G1 X2 F6000\nM30\n")
    plc = tmp_path / "old.py"
    plc.write_text(PLC)
    target = record(
        plc,
        nc,
        tmp_path / "r.npz",
        watch=("A.n", "A.q"),
        force={"A.k": 3},
        inputs={"A.door": {"steps": [{"time_s": 0.01, "value": 1}]}},
    )
    assert again(target, plc).equal
    new = tmp_path / "new.py"
    new.write_text(PLC.replace("self.q", "self.x").replace("+= 1", "+= 2"))
    found = again(target, new)
    assert found.first is not None
    assert (found.first.scan, found.first.member) == (1, "A.n")
    assert (found.first.old, found.first.new) == (4.0, 5.0)
    assert any("A.q" in text for text in found.warnings)


@pytest.mark.ci
def test_the_command_tells_it_to_people_and_programs(
    cli: Cli, recorded: Path, tmp_path: Path
) -> None:
    """Exit 0 and 1, the JSON object, and what cannot be replayed."""
    same = cli("replay", recorded, "--plc", OVERRIDE, "--json")
    assert same.status == 0, same.err
    assert same.json["equal"]
    assert same.json["scans"] > 1000
    assert same.json["realtime_factor"] > 0
    other = cli("replay", recorded, "--plc", "builtin:acknowledge")
    assert other.status == 1
    assert "first difference: scan 1, t = 0 s" in other.out
    empty = tmp_path / "empty.py"
    empty.write_text("x = 1\n")
    wrong = cli("replay", recorded, "--plc", empty, "--json")
    assert wrong.status == 1
    assert json.loads(wrong.out)["errors"][0]["code"] == 905003


def test_a_cut_recording_is_replayed_as_far_as_it_goes(
    recorded: Path, tmp_path: Path
) -> None:
    """Cut anywhere: the scans that are whole, without a difference that is none."""
    whole = tmp_path / "whole.arrow"
    write_target(Recording(recorded).source, whole)
    data = whole.read_bytes()
    cut = tmp_path / "cut.arrow"
    cut.write_bytes(data[: len(data) - 200])
    found = again(cut, OVERRIDE)
    assert found.equal
    assert any("not complete" in text for text in found.warnings)
    cut.write_bytes(data[:300_000])
    with pytest.raises(Exception, match="no scans of a PLC"):
        again(cut, OVERRIDE)


def test_a_recording_without_scans_is_refused(tmp_path: Path) -> None:
    """Recorded with no PLC, or without the table: nothing to compare with."""
    nc = tmp_path / "part.nc"
    nc.write_text("G1 X2 F6000\nM30\n")
    alone = record("none", nc, tmp_path / "a.arrow")
    with pytest.raises(Exception, match="no scans of a PLC"):
        again(alone, OVERRIDE)


@pytest.mark.ci_cases
@pytest.mark.parametrize("other", ["100.0, 50.0", "100.0 - distance, 60.0"])
def test_scans_in_c_find_what_scans_in_python_find(
    recorded: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    other: str,
) -> None:
    """A compiled PLC that differs now and then: the same first difference, the
    same counts.
    """
    text = (EXAMPLES / "override_from_contour.st").read_text()
    distance = "LREAL_TO_REAL(gpCh[0]^.bahn_state.dist_prog_start / 1.0E5)"
    changed = other.replace("distance", distance)
    plc = tmp_path / "other.st"
    plc.write_text(text.replace("100.0, 60.0", changed))
    in_c = again(recorded, plc).as_json()
    monkeypatch.setattr(_Run, "_in_c", lambda *_: False)
    in_python = again(recorded, plc).as_json()
    for found in (in_c, in_python):
        del found["realtime_factor"]
    assert in_c == in_python
    assert in_c["scans"] > sum(in_c["counts"].values()) > 100


def test_scans_begun_in_c_find_what_single_scans_find(
    recorded: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A Python PLC that differs now and then, with a watched symbol: the same
    first difference and counts where each scan is begun and ended by Python.
    """
    plc = changed(tmp_path, "60.0 if", "61.0 if")
    together = again(recorded, plc).as_json()
    monkeypatch.setattr(Answers, "concern", lambda *_: True)
    alone = again(recorded, plc).as_json()
    for found in (together, alone):
        del found["realtime_factor"]
    assert together == alone
    assert together["scans"] > sum(together["counts"].values()) > 100
