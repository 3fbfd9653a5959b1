"""Files of strangers that are no programs: read, or refused by number with words.

``bench/fuzz.py`` runs the same targets for hours; here each takes the inputs that
begin its corpus, and some of them changed.
"""

from __future__ import annotations

import io
import random
import warnings
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from cnc_core.errors import CncError
from cnc_core.recording.reading import Recording
from cnc_core.recording.source import META
from support.fuzz_seeds import joined, parts_of
from support.fuzz_targets import TARGETS, Changing
from support.paths import EVERY

CHANGED = 20
READERS = ("cell", "answers", "orders", "mock", "recordings")


@pytest.mark.ci_cases
@pytest.mark.parametrize("name", READERS)
def test_a_reader_ends_with_an_answer_or_an_error(name: str) -> None:
    """No other exception, and a thread that listens goes on to listen."""
    target, rng = TARGETS[name], random.Random(name)
    seeds = list(target.seeds())
    assert seeds
    for data in seeds:
        target.run(data)
    for _ in range(CHANGED):
        target.run(Changing(seeds).changed(rng.choice(seeds), rng))


PROGRAMS = {"isg": 900, "iso": 90, "isons": 1000, "osai": 600, "cycles": 60}
"""Least numbers of programs that a corpus begins with."""


@pytest.mark.ci
@pytest.mark.parametrize("name", PROGRAMS)
def test_programs_of_goldens_and_tests_are_checked_to_an_end(name: str) -> None:
    """With the files, cell and answers beside them; errors have number, place, words."""
    seeds = list(TARGETS[name].seeds())
    assert len(seeds) >= PROGRAMS[name]
    for data in seeds[::EVERY]:
        TARGETS[name].run(data)


def test_an_input_holds_the_files_beside_a_program() -> None:
    """A setup and a cell are taken apart from the program as they were joined."""
    files = {"CONFIG1": "(PNT,AXI)\n", "cell.toml": "[axes.B]\nid = 3\n"}
    assert parts_of(joined("G61", files)) == ("G61\n", files)


@pytest.mark.parametrize(
    "meta",
    [
        "[1]",
        "{}",
        '{"types": [], "rows": {}}',
        '{"types": {"a": 1}, "rows": {}}',
        '{"types": {}, "rows": {"a": "x"}}',
        "[" * 3000,
    ],
)
def test_an_npz_of_other_content_is_no_recording(
    meta: str, tmp_path: Path
) -> None:
    """Its description is looked at before it is used."""
    path = tmp_path / "a.npz"
    np.savez(path, meta=np.array(meta))
    with pytest.raises(CncError):
        Recording(path)


def test_a_file_that_is_no_npz_is_closed(tmp_path: Path) -> None:
    """A .npy under the wrong name, and a zip of rubbish."""
    one = io.BytesIO()
    np.save(one, np.zeros(3))
    path = tmp_path / "a.npz"
    for data in (one.getvalue(), b"PK\x03\x04rubbish", b""):
        path.write_bytes(data)
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            with pytest.raises(CncError):
                Recording(path)


@pytest.mark.parametrize("kind", ["parquet", "arrow"])
@pytest.mark.parametrize(
    "meta",
    [
        "",
        "[1]",
        '{"complete": true}',
        '{"types": 1, "row_groups": 2}',
        '{"types": {}, "row_groups": [1]}',
    ],
)
def test_a_file_of_arrow_of_other_content_is_no_recording(
    kind: str, meta: str, tmp_path: Path
) -> None:
    """Its schema has the name of a description, and says something else."""
    table = pa.table({"a": [1, 2]}).replace_schema_metadata({META: meta})
    path = tmp_path / f"a.{kind}"
    if kind == "parquet":
        pq.write_table(table, path)
    else:
        with pa.ipc.new_stream(path, table.schema) as stream:
            stream.write_table(table)
    with pytest.raises(CncError):
        Recording(path)
