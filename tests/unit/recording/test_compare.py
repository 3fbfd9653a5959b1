"""compare and inspect on recordings that are written here."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cnc_core.errors import CncError
from cnc_core.recording.compare import compare
from cnc_core.recording.golden import check_recording
from cnc_core.recording.inspect import Filter, state_at, statistics, summary
from cnc_core.recording.parts import Parts
from cnc_core.recording.reading import Recording
from cnc_core.recording.show import scene_of
from hli.part_file import PartFile
from plc_client.golden import GoldenMismatchError
from support.command_line import Outcome

Cli = Callable[..., Outcome]
TYPES = {
    "cycles": {
        "cycle": "uint64",
        "t": "double",
        "X": "double",
        "s": "double",
        "v": "double",
        "line": "uint32",
        "overruns": "uint32",
    },
    "functions": {"cycle": "uint64", "t": "double", "code": "int32"},
}
META = {
    "version": 1,
    "start": {"X": 0.0},
    "columns": {"cycles": {"X": "mm", "v": "mm/s"}},
}
ROWS = 300_000


def motion(rows: int, speed: float) -> dict[str, Any]:
    """A straight line at a constant speed, mm/s, one line of the program a mm."""
    cycle = np.arange(1, rows + 1, dtype=np.uint64)
    way = cycle * speed * 1e-3
    return {
        "cycle": cycle,
        "t": cycle * 1e-3,
        "X": way,
        "s": way,
        "v": np.full(rows, speed),
        "line": way.astype(np.uint32) + 1,
        "overruns": np.zeros(rows, np.uint32),
    }


def recorded(
    path: Path, cycles: dict[str, Any], code: int = 8, batch: int = 70_000
) -> Recording:
    """A finished recording of these cycles, with one function."""
    parts = Parts(path)
    types = TYPES | {
        "cycles": TYPES["cycles"]
        | {c: "double" for c in cycles if c not in TYPES["cycles"]}
    }
    file = PartFile(parts.cnc, types, json.dumps(META).encode())
    for first in range(0, len(cycles["cycle"]), batch):
        part = {k: v[first : first + batch] for k, v in cycles.items()}
        assert file.add({"cycles": part})
    row = {"cycle": [5], "t": [0.005], "code": [code]}
    assert file.add({"functions": row})
    file.close()
    parts.finish(end="completed")
    return Recording(path)


def test_equal_recordings_are_equal(tmp_path: Path) -> None:
    """Whatever the kinds of files, their batches and the wall clock."""
    cycles = motion(ROWS, 100.0)
    a = recorded(tmp_path / "a.parquet", cycles)
    late = cycles | {"overruns": cycles["overruns"] + 7}
    b = recorded(tmp_path / "b.arrow", late, batch=33_333)
    found = compare(a, b)
    assert found.equal
    assert found.as_json() == {"equal": True, "first": None, "counts": {}}


@pytest.mark.parametrize("row", [0, 131_071, 131_072, 299_999])
@pytest.mark.parametrize("column", ["v", "X", "line"])
def test_a_planted_difference_is_found(
    tmp_path: Path, row: int, column: str
) -> None:
    """One cycle, one column: row, column, both values and the line are told."""
    cycles = motion(ROWS, 100.0)
    a = recorded(tmp_path / "a.arrow", cycles)
    other = cycles[column].copy()
    other[row] += 1
    b = recorded(tmp_path / "b.arrow", cycles | {column: other})
    found = compare(a, b)
    assert found.counts == {"cycles": {column: 1}}
    assert found.first is not None
    first = found.first
    assert (first.table, first.row, first.column) == ("cycles", row, column)
    assert first.b - first.a == pytest.approx(1)
    assert first.line == cycles["line"][row]


def test_tolerances_are_by_column(tmp_path: Path) -> None:
    """A difference within the tolerance of its column is none."""
    cycles = motion(1000, 100.0)
    a = recorded(tmp_path / "a.arrow", cycles)
    near = cycles | {"X": cycles["X"] + 0.01, "v": cycles["v"] + 0.01}
    b = recorded(tmp_path / "b.arrow", near)
    assert compare(a, b, tolerance={"X": 0.02, "cycles.v": 0.02}).equal
    assert compare(a, b, tolerance={"X": 0.02}).counts == {
        "cycles": {"v": 1000}
    }
    with pytest.raises(Exception, match="no such column"):
        compare(a, b, tolerance={"Q": 1.0})


@pytest.mark.parametrize("given", [("q", "b", "m"), ("m", "q", "b")])
def test_a_column_that_only_one_has_is_told_in_its_order(
    tmp_path: Path, given: tuple[str, ...]
) -> None:
    """The first difference is the same whenever it is asked for."""
    cycles = motion(10, 100.0)
    a = recorded(tmp_path / "a.arrow", cycles)
    b = recorded(
        tmp_path / "b.arrow", cycles | dict.fromkeys(given, cycles["X"])
    )
    found = compare(a, b)
    assert list(found.counts["cycles"]) == list(given)
    assert found.first is not None
    assert (found.first.column, found.first.a) == (given[0], False)


def test_a_shorter_recording_differs(tmp_path: Path) -> None:
    """The rows that are missing are counted, the first of them is named."""
    a = recorded(tmp_path / "a.arrow", motion(1000, 100.0))
    b = recorded(tmp_path / "b.arrow", motion(990, 100.0))
    found = compare(a, b)
    assert found.counts == {"cycles": {"": 10}}
    assert found.first is not None
    assert (found.first.row, found.first.a, found.first.b) == (990, 1000, 990)


def test_runs_of_different_speed_are_compared_along_the_path(
    tmp_path: Path,
) -> None:
    """Half the speed: the same places, another speed everywhere."""
    a = recorded(tmp_path / "a.arrow", motion(1000, 100.0))
    b = recorded(tmp_path / "b.arrow", motion(2000, 50.0))
    assert not compare(a, b).equal
    assert set(compare(a, b, "distance").counts["cycles"]) == {"v"}
    assert compare(a, b, "distance", {"v": 50.0}).equal
    c = recorded(tmp_path / "c.arrow", motion(2000, 50.0), code=9)
    assert compare(a, c, "distance", {"v": 50.0}).counts == {
        "functions": {"code": 1}
    }


def around(rows: int) -> dict[str, Any]:
    """A line, a sharp corner, a quarter of an arc; so many cycles over 30 mm."""
    cycles = motion(rows, 30.0 / rows * 1e3)
    way = cycles["s"]
    angle = np.clip((way - 20.0) / 5.0, 0.0, None)
    x = np.where(way < 10.0, way, 20.0 - way)
    return cycles | {
        "X": np.where(way < 20.0, x, 5.0 * np.sin(angle)),
        "override": np.where(way < 17.0, 100.0, 60.0),
    }


def test_arcs_corners_and_steps_are_no_differences(tmp_path: Path) -> None:
    """Where the cycles of two runs lie apart; a micrometre beside the path is."""
    one, two = around(1000), around(777)
    a = recorded(tmp_path / "a.arrow", one)
    b = recorded(tmp_path / "b.arrow", two)
    assert set(compare(a, b, "distance").counts["cycles"]) == {"v"}
    two["X"][700] += 1e-3
    c = recorded(tmp_path / "c.arrow", two)
    found = compare(c, a, "distance", {"v": 50.0})
    assert found.counts == {"cycles": {"X": 1}}
    assert found.first is not None
    assert found.first.row == 700


def test_inspect_tells_tables_units_and_places(tmp_path: Path) -> None:
    """Rows and units; the state at a time, a cycle, a line and a distance."""
    recording = recorded(tmp_path / "a.parquet", motion(ROWS, 100.0))
    value = summary(recording)
    assert value["complete"]
    assert value["tables"]["cycles"]["rows"] == ROWS
    assert value["tables"]["cycles"]["columns"]["v"] == "mm/s"
    assert statistics(recording.cycles)[1]["cycle"]["max"] == ROWS
    for key, place, cycle in (
        ("time", 0.5, 500),
        ("cycle", 200_000, 200_000),
        ("line", 2, 10),
        ("distance", 25.0, 250),
    ):
        found = state_at(recording, key, place)
        assert found["cycles"] is not None
        assert found["cycles"]["cycle"] == cycle, key
        assert found["functions"] is not None
    early = state_at(recording, "cycle", 2)
    assert early["functions"] is None
    with pytest.raises(Exception, match="nothing is recorded there"):
        state_at(recording, "line", 1e9)


@pytest.mark.ci
def test_inspect_chooses_rows(cli: Cli, tmp_path: Path) -> None:
    """Filters choose rows of a table; their statistics are those of numpy."""
    recording = recorded(tmp_path / "a.parquet", motion(ROWS, 100.0))
    filters = [
        Filter.of(text, recording.cycles)
        for text in ("X>=500", "X < 2000", "line!=700")
    ]
    rows, found = statistics(recording.cycles, filters)
    x, line = recording.cycles["X"], recording.cycles["line"]
    kept = (x >= 500) & (x < 2000) & (line != 700)
    assert rows == kept.sum()
    assert found["X"]["min"] == x[kept].min()
    assert found["t"]["mean"] == pytest.approx(
        recording.cycles["t"][kept].mean()
    )
    shown = cli("inspect", "a.parquet", "--where", "line=700", "--rows", "3")
    assert "699" in shown.out
    assert max(map(len, shown.out.splitlines())) <= 80
    told = cli(
        "inspect", "a.parquet", "--where", "line=700", "--rows", "3", "--json"
    )
    assert told.json["chosen"] == (line == 700).sum()
    assert [row["line"] for row in told.json["rows"]] == [700] * 3
    for wrong in ("speed>3", "v>fast", "v"):
        with pytest.raises(Exception, match="--where"):
            Filter.of(wrong, recording.cycles)


def test_a_golden_recording_is_compared(tmp_path: Path) -> None:
    """Written once, equal to itself, and the first difference is told."""
    golden = tmp_path / "golden" / "a.parquet"
    a = recorded(tmp_path / "a.arrow", motion(1000, 100.0))
    with pytest.raises(GoldenMismatchError, match="golden-update"):
        check_recording(golden, a)
    check_recording(golden, a, update=True)
    check_recording(golden, a)
    check_recording(golden, tmp_path / "a.arrow")
    near = motion(1000, 100.0)
    near["v"] = near["v"] + 1e-6
    b = recorded(tmp_path / "b.arrow", near)
    with pytest.raises(GoldenMismatchError, match=r"row 0 .line 1.: v: 100.0"):
        check_recording(golden, b)
    check_recording(golden, b, tolerance=1e-5)
    check_recording(golden, b, tolerance={"v": 1e-5})


@pytest.mark.ci
def test_the_commands_tell_it_to_people_and_programs(
    cli: Cli, tmp_path: Path
) -> None:
    """Exit 0 and 1, JSON as the contract has it, tables of 80 columns."""
    recorded(tmp_path / "a.parquet", motion(100, 100.0))
    recorded(tmp_path / "b.parquet", motion(100, 50.0))
    same = cli("compare", "a.parquet", "a.parquet", "--json")
    assert (same.status, same.json["equal"]) == (0, True)
    other = cli("compare", "a.parquet", "b.parquet", "--json")
    assert other.status == 1
    assert other.json["first"]["column"] == "X"
    shown = cli("inspect", "a.parquet")
    assert shown.status == 0
    assert max(map(len, shown.out.splitlines())) <= 80
    at = cli("inspect", "a.parquet", "--at", "cycle=7", "--json")
    assert at.json["at"]["cycles"]["cycle"] == 7
    assert cli("inspect", "a.parquet", "--at", "seven").status == 1
    (tmp_path / "c.parquet").write_text("no recording")
    wrong = cli("inspect", "c.parquet")
    assert wrong.status == 1
    assert "no recording" in wrong.err


@pytest.mark.parametrize(
    ("name", "content", "text"),
    [
        ("a.arrow", b"\x7fELF and more", "no Arrow stream"),
        ("a.parquet", b"PAR1 and more", "no Parquet file, or one that was cut"),
        ("a.npz", b"hello", "no npz file"),
        ("a.npz", b"", "no npz file"),
        ("a.arrow", None, "a folder"),
    ],
)
def test_what_is_no_recording_is_told(
    tmp_path: Path, name: str, content: bytes | None, text: str
) -> None:
    """Other files and folders are refused by what they are not."""
    path = tmp_path / name
    if content is None:
        path.mkdir()
    else:
        path.write_bytes(content)
    with pytest.raises(CncError, match=f"no recording: {text}"):
        Recording(path)


@pytest.mark.parametrize("length", [0, 3, 100])
def test_a_file_that_was_cut_in_its_head(tmp_path: Path, length: int) -> None:
    """It is a recording without tables; nothing can be shown or looked up."""
    whole = recorded(tmp_path / "a.arrow", motion(10, 100.0))
    cut = tmp_path / "cut.arrow"
    cut.write_bytes(whole.path.read_bytes()[:length])
    found = Recording(cut)
    assert not found.complete
    assert found.tables == ()
    with pytest.raises(CncError, match="nothing is recorded there"):
        state_at(found, "time", 0.0)
    with pytest.raises(CncError, match="no cycles to draw"):
        scene_of([found])


@pytest.mark.parametrize(
    ("key", "place"), [("time", 99.0), ("distance", -1.0), ("cycle", 1e9)]
)
def test_no_state_where_nothing_was_recorded(
    tmp_path: Path, key: str, place: float
) -> None:
    """Behind the end and ahead of the start."""
    recording = recorded(tmp_path / "a.arrow", motion(10, 100.0))
    with pytest.raises(CncError, match="nothing is recorded there"):
        state_at(recording, key, place)
