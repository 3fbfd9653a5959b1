"""SysMillRectangularPocket against the published list: defaults, ranges, errors."""

import re
from collections.abc import Mapping
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest

from cnc_core.errors import CncError
from cnc_core.frontend import create
from cnc_core.frontend.isg.cycles.registry import CYCLES
from cnc_core.frontend.machine import ProgramMachine, Tool
from cnc_core.frontend.offline import read_all
from cnc_core.frontend.port import OfflinePort

NAME = "SysMillRectangularPocket"
RADIUS = 5.0
FEED = 480.0
REQUIRED = {1: 0, 2: 20, 3: 2, 4: 5, 5: 2.5, 6: 4, 72: 40, 73: 24}
INVALID, CONFLICT, UNKNOWN, WITHOUT_EFFECT = 13320, 907101, 907110, 907042


def call(values: Mapping[int, object], name: str = NAME) -> str:
    words = " ".join(f"@P{n}={v}" for n, v in values.items())
    return f"L CYCLE [NAME={name}.ecy {words}]"


class Read(NamedTuple):
    """What one call became."""

    rows: np.ndarray
    errors: list[CncError]
    warnings: list[int]


def read(folder: Path, line: str) -> Read:
    """One call, from X7 Y-3 Z30, with tool radius, feed and speed in force."""
    used = ProgramMachine(
        ("X", "Y", "Z"),
        (False,) * 3,
        (0, 1, 2),
        np.array([7.0, -3.0, 30.0]),
        tools={1: Tool(RADIUS)},
    )
    path = folder / "main.nc"
    path.write_text(f"D1 F{FEED:g} S1000\n{line}\nM30\n")
    reader = create("isg", path, used, OfflinePort(used.start), collect=True)
    rows = [
        item.rows.copy() for item in read_all(reader) if hasattr(item, "rows")
    ]
    reader.close()
    warnings = [w.code for w in reader.warnings]
    return Read(np.concatenate(rows), list(reader.errors), warnings)


def path_of(found: Read) -> list[tuple[float, ...]]:
    """Everything of the rows that moves, and their speeds and feeds."""
    members = ("end", "center", "feed", "angle", "radius")
    return [
        (
            float(row["type"]),
            *tuple(x for m in members for x in np.atleast_1d(row[m]).tolist()),
        )
        for row in found.rows
    ]


DEFAULTS = {
    7: 0.5,
    8: 2.5,
    13: 5,
    15: 0,
    16: 0,
    20: FEED,
    21: FEED,
    22: FEED,
    23: FEED,
    30: 0,
    31: 3,
    32: 2,
    34: 2,
    42: 0,
    65: 0,
    170: 4,
    171: FEED,
}


@pytest.mark.parametrize("allowances", [{}, {15: 0.5, 16: 0.25}])
def test_a_default_that_is_programmed_changes_nothing(
    tmp_path: Path, allowances: dict[int, float]
) -> None:
    """Each published default gives the same rows as no word; P40, P41 are the place."""
    base: dict[int, object] = {**REQUIRED, **allowances}
    plain = path_of(read(tmp_path, call(base)))
    for words in [{n: v} for n, v in DEFAULTS.items()] + [{40: 7, 41: -3}]:
        if not words.keys() & allowances.keys():
            found = read(tmp_path, call(base | words))
            assert not found.errors
            assert set(found.warnings) <= {13164}, words
            assert path_of(found) == plain, words


@pytest.mark.parametrize(
    ("given", "other"),
    [
        ({20: 700}, {20: 700, 21: 700, 22: 700, 23: 700, 171: 700}),
        ({20: 700, 22: 300}, {20: 700, 21: 700, 22: 300, 23: 300}),
        ({20: 700, 21: 200}, {20: 700, 21: 200, 22: 700, 23: 700, 171: 200}),
        ({72: 64}, {72: 64, 13: 8}),
        ({6: 3}, {6: 3, 170: 3}),
    ],
)
def test_defaults_follow_other_parameters(
    tmp_path: Path, given: dict[int, object], other: dict[int, object]
) -> None:
    """P21 = P20, P22 = P20, P23 = P22, P13 = P72 / 8, P170 = P6, P171 = P21."""
    base: dict[int, object] = {**REQUIRED, 15: 0.5, 16: 0.25}
    short, long = (
        read(tmp_path, call(base | given)),
        read(tmp_path, call(base | other)),
    )
    assert not short.errors
    assert not long.errors
    assert long.warnings == []
    assert path_of(short) == path_of(long)


RIGHT: list[dict[int, object]] = [
    {3: 17.999},
    {5: 2.5, 15: 2.5},
    {6: 10},
    {8: 7},
    {16: 7},
    {30: 1},
    {30: '"UpCutMilling"'},
    {31: 1},
    {31: '"finishing"', 16: 1},
    {32: 1},
    {34: 1},
    {42: 360},
    {42: -360},
    {65: 5},
    {65: 12},
    {72: 15, 73: 15},
    {135: 1},
    {170: 10},
    {171: 1},
]


@pytest.mark.parametrize("words", RIGHT, ids=str)
def test_the_ends_of_the_ranges_are_allowed(
    tmp_path: Path, words: dict[int, object]
) -> None:
    """Values at the edge of the published range mill a pocket."""
    found = read(tmp_path, call({**REQUIRED, **words}))
    assert not found.errors
    assert len(found.rows) > 10
    told = bool(words.keys() & {135, 170, 171})
    assert (WITHOUT_EFFECT in found.warnings) == told


WRONG: list[tuple[int, int, dict[int, object]]] = [
    *[
        (INVALID, n, {n: value})
        for n, values in {
            3: [0, -1],
            4: [0, -1],
            5: [0, -1],
            6: [0, -1, 10.001],
            7: [0, -1],
            8: [0, -1],
            13: [0, -1],
            15: [-0.001],
            16: [-0.001],
            20: [0, -1],
            21: [0, -1],
            22: [0, -1],
            23: [0, -1],
            25: [0, -1],
            30: [-1, 2, 0.5, '"Climb"'],
            31: [0, 4, 1.5, '"Rough"'],
            32: [0, 3, '"Helical"'],
            34: [0, 3],
            42: [-360.001, 360.001],
            65: [-1],
            72: [0, -1],
            73: [0, -1],
            170: [0, -1],
            171: [0, -1],
        }.items()
        for value in values
    ],
    (CONFLICT, 2, {3: 20}),
    (CONFLICT, 2, {2: -1}),
    (CONFLICT, 15, {15: 2.501}),
    (CONFLICT, 15, {4: 2, 15: 2}),
    (CONFLICT, 8, {8: 7.001}),
    (CONFLICT, 16, {16: 7.001}),
    (CONFLICT, 72, {72: 9.99}),
    (CONFLICT, 73, {73: 9.99}),
    (CONFLICT, 65, {65: 4.999}),
    (CONFLICT, 65, {65: 12.001}),
    (CONFLICT, 40, {40: 1}),
    (CONFLICT, 41, {41: 1}),
    *[(UNKNOWN, n, {n: 1}) for n in (9, 14, 43, 70, 134, 169, 200)],
]


@pytest.mark.parametrize(("code", "number", "words"), WRONG, ids=str)
def test_what_is_outside_is_an_error_at_its_place(
    tmp_path: Path, code: int, number: int, words: dict[int, object]
) -> None:
    """Nothing moves, and the error stands at the parameter and names it."""
    line = call({**REQUIRED, **words})
    found = read(tmp_path, line)
    assert not (found.rows["type"] <= 3).any()
    told = [
        e for e in found.errors if f"@P{number}" in re.split("[ ,]", str(e))
    ]
    assert [e.code for e in told] == [code], found.errors
    assert told[0].place is not None
    assert told[0].place.column == line.index(f"@P{number}=") + 1


@pytest.mark.parametrize("number", REQUIRED)
def test_what_is_required_is_missed(tmp_path: Path, number: int) -> None:
    """Each required parameter that misses is told by its number."""
    values = {n: v for n, v in REQUIRED.items() if n != number}
    found = read(tmp_path, call(values))
    assert not (found.rows["type"] <= 3).any()
    assert [e.code for e in found.errors] == [INVALID]
    assert f"@P{number} " in str(found.errors[0])


@pytest.mark.parametrize("name", [c.name for c in CYCLES])
def test_a_parameter_that_a_cycle_does_not_have_is_an_error(
    tmp_path: Path, name: str
) -> None:
    """In every built-in cycle, and nothing of it is executed."""
    found = read(tmp_path, call({199: 1}, name))
    assert UNKNOWN in [e.code for e in found.errors]
    assert not (found.rows["type"] <= 3).any()
