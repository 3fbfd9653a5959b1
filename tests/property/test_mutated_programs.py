"""Mutated programs: right programs of every dialect with a few signs, words or
lines changed.

Whatever comes out, a check ends within bounded work, and every error has a
known number, a place in a file and a text.  ``HLI_COSIM_MUTATIONS`` is the
number of mutations of each dialect.
"""

from __future__ import annotations

import os
import random
import shutil
from pathlib import Path

import pytest

from support.mutated import (
    DIALECTS,
    LINES_MAX,
    ROWS_MAX,
    checked,
    mutated,
    right_programs,
    unclear,
)
from support.seeds import few

MUTATIONS = int(os.environ.get("HLI_COSIM_MUTATIONS", "150"))
CHUNKS = 10


@pytest.mark.ci_cases
@pytest.mark.parametrize("chunk", few(range(CHUNKS), CHUNKS // 2))
@pytest.mark.parametrize("dialect", DIALECTS)
def test_a_mutated_program_is_checked_to_an_end(
    dialect: str, chunk: int, tmp_path: Path
) -> None:
    """No traceback, no hang; every error has its number, place and text."""
    programs = right_programs(dialect)
    assert programs
    for seed in range(chunk, MUTATIONS, CHUNKS):
        rng = random.Random(f"{dialect} {seed}")
        source = rng.choice(programs)
        folder = tmp_path / str(seed)
        shutil.copytree(source.parent, folder)
        path = folder / source.name
        others = [
            one
            for one in sorted(folder.iterdir())
            if one.is_file()
            and one.name not in (source.name, "expected.blocks")
        ]
        target = rng.choice(others) if others and rng.random() < 0.25 else path
        target.write_text(mutated(rng, target.read_text()))
        errors, rows, lines = checked(path, dialect)
        where = f"seed {seed}, {source.parent.name}:\n{target.read_text()}"
        assert rows <= ROWS_MAX, where
        assert lines <= LINES_MAX, where
        for error in errors:
            assert not unclear(error), (
                f"{unclear(error)}: {error.code} {error.text!r} at "
                f"{error.place.file}:{error.place.line}; {where}"
            )
        shutil.rmtree(folder)
