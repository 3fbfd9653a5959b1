"""Tests written in ST: methods ``Test...`` of blocks that extend ``FB_TestSuite``."""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from .build import Sources, build, check, sources_of
from .errors import StError
from .machine.loader import StProgram
from .options import Built

SUITE = "FB_TESTSUITE"


class _Failure(ctypes.Structure):
    _fields_ = [
        ("line", ctypes.c_int32),
        ("pou", ctypes.c_char * 128),
        ("text", ctypes.c_char * 256),
    ]


class StTestFailedError(AssertionError):
    """Assertions of an ST test failed; the text has a line for each."""


def tests_of(path: Path) -> list[tuple[str, str, int]]:
    """(block, method, line) of every test in a file.  StError: it is wrong."""
    found = check(_sources(path))
    if found.log.errors:
        raise StError(found.log.errors)
    tests = []
    for cls in found.world.classes.values():
        names = [c.name.upper() for c in cls.ancestors()[1:]]
        if SUITE not in names or cls.abstract:
            continue
        for routine in cls.methods.values():
            if routine.name.upper().startswith("TEST"):
                line = routine.pou.pos[0]
                tests.append((cls.name, routine.name, line))
    return tests


def _sources(path: Path) -> Sources:
    """The test file and the ST files beside it that are no tests."""
    beside = [
        p
        for p in sorted(path.parent.iterdir())
        if p.suffix.lower() == path.suffix.lower()
        and not p.name.lower().startswith("test_")
    ]
    return sources_of([path, *beside])


def _with_runner(sources: Sources, block: str, method: str) -> Built:
    """The program with a PROGRAM that calls one method of a fresh block."""
    text = (
        f"PROGRAM ST_TEST_RUNNER\nVAR suite : {block}; END_VAR\n"
        f"suite.{method}();\nEND_PROGRAM\n"
    )
    return build({**sources, "<test runner>.st": text})


def run_test(path: Path, block: str, method: str) -> None:
    """One test.  StTestFailedError, StTrap: it failed."""
    program = StProgram(_with_runner(_sources(path), block, method))
    program.start()
    program.run(program.entry("ST_TEST_RUNNER"), 0)
    failures = list(_failures(program))
    if failures:
        raise StTestFailedError("\n".join(failures))


def _failures(program: StProgram) -> Iterator[str]:
    library: Any = program.library
    count = ctypes.c_int32.in_dll(library, "st_failure_count").value
    rows = (_Failure * 20).in_dll(library, "st_failures")
    for row in rows[: min(count, 20)]:
        label = row.pou.decode()
        file, first = program.description["places"].get(label, ["", 0])
        text = row.text.decode("cp1252", errors="replace")
        yield f"{file}:{first + row.line}: {label}: {text}"
