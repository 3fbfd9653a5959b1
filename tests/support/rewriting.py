"""Each test file is rewritten by one worker, not by all of them.

pytest rewrites the assertions of a file before its first import, which takes
longer than all else of collecting, and keeps the result beside the file.
Workers of pytest-xdist begin at the same time, so each would do all the files.
Here each begins at another place of the list and leaves out what is done.
"""

from __future__ import annotations

import sys
from collections.abc import Iterable, Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import pytest
from _pytest.assertion import rewrite


def files_below(arguments: Iterable[str]) -> list[Path]:
    """Test files of pytest's arguments: folders, files, ``file::test``."""
    found: list[Path] = []
    for argument in arguments:
        path = Path(argument.partition("::")[0])
        found += path.rglob("test_*.py") if path.is_dir() else [path]
    return sorted({path.resolve() for path in found if path.is_file()})


def from_place_of(worker: int, count: int, files: list[Path]) -> Iterator[Path]:
    """All files, beginning with the share of this worker."""
    begin = worker * len(files) // max(count, 1)
    yield from files[begin:]
    yield from files[:begin]


def rewrite_file(path: Path, config: pytest.Config) -> bool:
    """Keep the rewritten file where pytest looks for it; whether that was new."""
    folder = rewrite.get_cache_dir(path)
    kept = folder / f"{path.stem}{rewrite.PYC_TAIL}"
    if kept.exists() and kept.stat().st_mtime >= path.stat().st_mtime:
        return False
    folder.mkdir(parents=True, exist_ok=True)
    state: Any = config.stash[rewrite.assertstate_key]
    stat, code = rewrite._rewrite_test(path, config)
    return rewrite._write_pyc(state, code, stat, kept)


def share_rewriting(config: pytest.Config) -> None:
    """In a worker: rewrite what nobody has rewritten yet."""
    given: dict[str, Any] | None = getattr(config, "workerinput", None)
    if given is None or sys.dont_write_bytecode:
        return
    worker = int(given["workerid"].removeprefix("gw"))
    files = files_below(config.args)
    # of a pytest that keeps them elsewhere: each worker does all, as ever
    with suppress(AttributeError, KeyError, OSError, SyntaxError, TypeError):
        for path in from_place_of(worker, given["workercount"], files):
            rewrite_file(path, config)
