"""A Parquet recording whose account was changed by a stranger: it is read as far as
it holds, or refused as no recording; no other error comes out.
"""

from __future__ import annotations

import copy
import json
import random
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pyarrow.parquet as pq
import pytest

from cnc_core.cell import Cell
from cnc_core.errors import CncError
from cnc_core.monitor.recorded import shown
from cnc_core.recording.compare import compare
from cnc_core.recording.inspect import (
    first_rows,
    parse_at,
    state_at,
    statistics,
    summary,
)
from cnc_core.recording.reading import Recording
from cnc_core.recording.replay import programs_of, replay
from cnc_core.recording.show import scene_of
from hli.part_file import META

LIES: list[Any] = [
    None, 0, -1, 1e300, "", "x", [], {}, [1], {"a": 1}, True, 10**12,
    float("nan"), "string", "double", "uint64",
]  # fmt: skip
MISSING = object()


@pytest.fixture(scope="module")
def good(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A recording of a short run."""
    folder = tmp_path_factory.mktemp("good")
    program = folder / "part.nc"
    program.write_text("N10 G01 X2 F9000\nN20 M03 S500\nN30 G01 Y2\nN40 M30\n")
    target = folder / "good.parquet"
    Cell().run(program, "builtin:acknowledge", record=target).check()
    return target


def account_of(path: Path) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(
        pq.ParquetFile(path).schema_arrow.metadata[META]
    )
    return found


def with_account(good: Path, account: Any, target: Path) -> Path:
    file = pq.ParquetFile(good)
    schema = file.schema_arrow.with_metadata({META: json.dumps(account)})
    with pq.ParquetWriter(target, schema) as writer:
        for group in range(file.num_row_groups):
            rows = file.read_row_group(group)
            writer.write_table(rows.replace_schema_metadata(schema.metadata))
    return target


def places(value: Any, at: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    if at:
        yield at
    if isinstance(value, dict):
        for key in value:
            yield from places(value[key], (*at, key))
    elif isinstance(value, list):
        for index in range(len(value)):
            yield from places(value[index], (*at, index))


def lied(account: Any, at: tuple[Any, ...], lie: Any) -> Any:
    changed = copy.deepcopy(account)
    inner = changed
    for key in at[:-1]:
        inner = inner[key]
    if lie is MISSING:
        del inner[at[-1]]
    else:
        inner[at[-1]] = lie
    return changed


def read_all(path: Path, other: Path) -> None:
    """What each command asks of a recording."""
    recording = Recording(path)
    summary(recording)
    for name in recording.tables:
        table = recording.table(name)
        statistics(table)
        first_rows(table, (), 3)
    for place in ("time=0.02", "cycle=5", "distance=1"):
        state_at(recording, *parse_at(place))
    shown(recording)
    scene_of([recording])
    compare(Recording(other), recording)


@pytest.mark.ci_cases
@pytest.mark.parametrize("seed", range(8))
def test_no_lie_gives_another_error(
    good: Path, tmp_path: Path, seed: int
) -> None:
    """Any value of the account may be missing or of any other kind."""
    rng = random.Random(seed)
    account = account_of(good)
    at = [*places(account)]
    telling = [one for one in at if one[0] not in ("columns", "types")]
    refused = 0
    for _ in range(30):
        chosen = rng.choice(telling if rng.random() < 0.6 else at)
        lie = rng.choice([*LIES, MISSING, MISSING])
        path = with_account(
            good, lied(account, chosen, lie), tmp_path / "lie.parquet"
        )
        try:
            read_all(path, good)
        except CncError:
            refused += 1
    assert 0 < refused < 30


@pytest.mark.parametrize(
    ("at", "lie"),
    [
        (("plc", "inputs"), "x"),
        (("plc", "inputs"), {"MAIN.a": 3}),
        (("plc", "force"), ["x"]),
        (("memory", "layout"), 0),
        (("memory", "cycle_ns"), "1"),
        (("row_groups", 4, 1), 10**12),
        (("row_groups", 3), ["plc", 1]),
        (("memory", "cycle_ns"), 1 << 32),
        (("types", "cycles", "t"), "string"),
    ],
)
def test_what_a_replay_needs_is_looked_at(
    good: Path, tmp_path: Path, at: tuple[Any, ...], lie: Any
) -> None:
    """Inputs, forces, memory and rows of the scans: 901002 names the file."""
    path = with_account(
        good, lied(account_of(good), at, lie), tmp_path / "lie.parquet"
    )
    with pytest.raises(CncError, match=r"901002.*lie\.parquet"):
        replay(Recording(path), programs_of("builtin:acknowledge", None, ()))
