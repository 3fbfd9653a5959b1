"""Every folder of C code has tests that CI runs under the sanitizers, chosen by
``pytest.mark.sanitize``.
"""

from __future__ import annotations

import ast
from pathlib import Path

import pytest

from support.paths import ROOT, TESTS

pytestmark = pytest.mark.source

GENERATED = {"_engine.c", "_sync.c"}


def marked_rooms(path: Path) -> set[str]:
    """Folders of c_ext that a test file names in its ``sanitize`` marks."""
    rooms: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Attribute)
            and node.func.attr == "sanitize"
        ):
            rooms |= {ast.literal_eval(room) for room in node.args}
    return rooms


def sources() -> list[str]:
    """C files below c_ext without their suffix."""
    base = ROOT / "c_ext"
    return sorted(
        path.relative_to(base).with_suffix("").as_posix()
        for path in base.rglob("*.c")
        if path.name not in GENERATED
    )


def test_every_c_file_lies_in_a_room_that_sanitized_tests_drive() -> None:
    """A file whose folder no marked test names is told; so is a mark for a folder that is gone."""
    rooms = {
        room for path in TESTS.rglob("test_*.py") for room in marked_rooms(path)
    }
    found = sources()
    assert len(found) > 60
    driven = {
        name: [r for r in rooms if name == r or name.startswith(f"{r}/")]
        for name in found
    }
    assert [name for name, by in driven.items() if not by] == []
    assert rooms - {room for by in driven.values() for room in by} == set()


def test_the_build_takes_every_c_file() -> None:
    """``build_ffi.py`` looks below all folders for its sources and its headers."""
    text = (ROOT / "c_ext" / "build_ffi.py").read_text()
    assert 'HERE.rglob("*.c")' in text
    assert 'HERE.rglob("*.h")' in text


def test_ci_runs_them_by_their_mark() -> None:
    """The sanitizers' steps name no test file, which a move could drop."""
    text = (ROOT / ".ci" / "run").read_text()
    steps = text[
        text.index('step "sanitizers') : text.index('step "the README')
    ]
    assert '-m "sanitize and not long and not ci" $(git grep' in steps
    assert "-m sanitize_threads $(git grep" in steps
    assert "tests/" not in steps
