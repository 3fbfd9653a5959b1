"""Workers share the rewriting of the test files (support/rewriting.py)."""

from __future__ import annotations

import os
from pathlib import Path

import pytest
from _pytest.assertion import rewrite

from support.rewriting import files_below, from_place_of, rewrite_file


@pytest.mark.parametrize("count", [1, 2, 3, 7])
def test_each_worker_begins_with_its_share(count: int) -> None:
    """All files in each worker; the first ones are those of no other."""
    files = [Path(f"test_{i}.py") for i in range(20)]
    orders = [list(from_place_of(i, count, files)) for i in range(count)]
    assert all(sorted(order) == sorted(files) for order in orders)
    shares = [order[: len(files) // count] for order in orders]
    assert len({file for share in shares for file in share}) == sum(
        map(len, shares)
    )


def test_a_file_is_rewritten_once(
    tmp_path: Path, pytestconfig: pytest.Config
) -> None:
    """pytest takes what is kept; a file that was edited is rewritten anew."""
    path = tmp_path / "test_one.py"
    path.write_text("def test():\n    assert 1 + 1 == 2\n")
    (found,) = files_below([str(tmp_path), f"{path}::test"])
    assert rewrite_file(found, pytestconfig)
    assert not rewrite_file(found, pytestconfig)
    kept = rewrite.get_cache_dir(path) / f"test_one{rewrite.PYC_TAIL}"
    assert rewrite._read_pyc(path, kept) is not None
    later = kept.stat().st_mtime + 10.0
    os.utime(path, (later, later))
    assert rewrite_file(found, pytestconfig)
