"""Inputs that a fuzzer has found, once each defect was mended: each ends with
clear errors, behind a bounded number of blocks.
"""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from cnc_core.config import CellConfig, load_config
from cnc_core.errors import ERRORS, CncError
from cnc_core.frontend.base.reader import (
    ALIKE_MAX,
    REPEATS_BEHIND_ERROR,
)
from cnc_core.program import Program

CORPUS = Path(__file__).with_name("corpus")
DIALECTS = ("isg", "isons", "iso")


def of_kinds(*kinds: str) -> list[str]:
    return sorted(p.name for p in CORPUS.iterdir() if p.suffix[1:] in kinds)


@pytest.mark.ci_cases
@pytest.mark.parametrize("name", of_kinds(*DIALECTS))
def test_a_program_is_checked_to_an_end(name: str, tmp_path: Path) -> None:
    """Numbers and places; behind an error a loop is not followed for long, and
    a line that comes again does not fill the list.
    """
    path = Path(shutil.copy(CORPUS / name, tmp_path / "part.nc"))
    program = Program(path, CellConfig(), Path(name).suffix[1:], collect=True)
    for _ in program.batches():
        pass
    assert program.errors
    assert program.reader.block_count <= 2 * REPEATS_BEHIND_ERROR
    for error in program.errors:
        assert error.code in ERRORS
        assert error.place.line > 0
    alike = [(error.code, error.place.line) for error in program.errors]
    assert max(map(alike.count, alike)) <= ALIKE_MAX


@pytest.mark.parametrize("name", of_kinds("toml"))
def test_a_cell_file_is_refused(name: str) -> None:
    """By number and with the key that is wrong."""
    with pytest.raises(CncError) as refused:
        load_config(CORPUS / name)
    assert refused.value.code in ERRORS
    assert str(refused.value)


def test_a_point_list_is_refused(tmp_path: Path) -> None:
    """By number and line."""
    path = Path(shutil.copy(CORPUS / "point_list.osai", tmp_path / "part.nc"))
    with pytest.raises(CncError) as refused:
        Program(path, CellConfig(), "osai", collect=True)
    assert refused.value.code in ERRORS
    assert refused.value.place.line > 0
