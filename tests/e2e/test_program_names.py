"""Names of programs that are no text."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest


@pytest.mark.parametrize("command", ["run", "cnc"])
def test_a_name_that_is_no_text_is_refused(
    cli: Callable[..., Any], tmp_path: Path, command: str
) -> None:
    """Before anything starts or is written, with the name in escapes."""
    path = tmp_path / os.fsdecode(b"p\xff.nc")
    path.write_text("N10 G1 X1 F600\nM30\n")
    record = tmp_path / "r.parquet"
    done = cli(command, path, "--record", record)
    assert done.status == 1
    assert "901002" in done.err
    assert "not UTF-8" in done.err
    assert sorted(tmp_path.iterdir()) == [path]
