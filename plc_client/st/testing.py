"""Tests written in ST: methods ``Test...``, or with a call of ``TEST``, of blocks
that extend ``FB_TestSuite``.
"""

from __future__ import annotations

import ctypes
from collections.abc import Iterator
from dataclasses import fields, is_dataclass
from pathlib import Path
from typing import Any, NamedTuple

from .build import Sources, build, check, sources_of
from .errors import StError
from .machine.loader import StProgram
from .options import Built
from .source.files import PROJECT, SUFFIXES
from .syntax import tree

SUITE = "FB_TESTSUITE"
SCAN_NS = 1_000_000
LONGEST_SCANS = 60_000
"""Scans of 1 ms that a test may take."""
_BEGINS = frozenset({"TEST", "TEST_ORDERED"})
_ENDS = frozenset({"TEST_FINISHED", "TEST_FINISHED_NAMED"})


class _Failure(ctypes.Structure):
    _fields_ = [
        ("line", ctypes.c_int32),
        ("pou", ctypes.c_char * 128),
        ("text", ctypes.c_char * 256),
    ]


class StTestFailedError(AssertionError):
    """Assertions of an ST test failed; the text has a line for each."""


class StTest(NamedTuple):
    """A test; ``lasts``: it runs in each scan until it calls ``TEST_FINISHED``."""

    block: str
    method: str
    line: int
    lasts: bool


def tests_of(path: Path) -> list[StTest]:
    """Every test in a file.  StError: it is wrong."""
    found = check(_sources(path))
    if found.log.errors:
        raise StError(found.log.errors)
    tests = []
    for cls in found.world.classes.values():
        names = [c.name.upper() for c in cls.ancestors()[1:]]
        if SUITE not in names or cls.abstract:
            continue
        for routine in cls.methods.values():
            if _is_test(routine):
                line = routine.pou.pos[0]
                lasts = not _ENDS.isdisjoint(_called(routine.pou))
                tests.append(StTest(cls.name, routine.name, line, lasts))
    return tests


def _is_test(routine: Any) -> bool:
    """A helper has inputs, or neither the name nor the call."""
    if routine.parameters:
        return False
    named = routine.name.upper().startswith("TEST")
    return named or not _BEGINS.isdisjoint(_called(routine.pou))


def _called(pou: Any) -> set[str]:
    """What a POU's statements call by a plain name, in capitals."""
    found, open_ = set(), list(pou.statements)
    while open_:
        node = open_.pop()
        if isinstance(node, (list, tuple)):
            open_ += node
        elif is_dataclass(node):
            base = getattr(node, "base", None)
            if isinstance(node, tree.Call) and isinstance(base, tree.Name):
                found.add(base.name.upper())
            open_ += [getattr(node, part.name) for part in fields(node)]
    return found


def _sources(path: Path) -> Sources:
    """The test file and the source files beside it that are no tests; a project is
    itself.
    """
    if path.suffix.lower() == PROJECT:
        return sources_of([path])
    kinds = {".st"} if path.suffix.lower() == ".st" else SUFFIXES
    beside = [
        p
        for p in sorted(path.parent.iterdir())
        if p.suffix.lower() in kinds and not p.name.lower().startswith("test_")
    ]
    return sources_of([path, *beside])


def _with_runner(sources: Sources, block: str, method: str) -> Built:
    """The program with a PROGRAM that calls one method of a fresh block."""
    text = (
        f"PROGRAM ST_TEST_RUNNER\nVAR suite : {block}; END_VAR\n"
        f"suite.{method}();\nEND_PROGRAM\n"
    )
    return build({**sources, "<test runner>.st": text})


def run_test(path: Path, block: str, method: str, lasts: bool = False) -> None:
    """One test.  StTestFailedError, StTrap: it failed."""
    program = StProgram(_with_runner(_sources(path), block, method))
    program.start()
    suite = program["ST_TEST_RUNNER"].suite
    for scan in range(LONGEST_SCANS if lasts else 1):
        program.run(program.entry("ST_TEST_RUNNER"), scan * SCAN_NS)
        if suite._finished:
            break
    failures = list(_failures(program))
    if lasts and not suite._finished:
        text = f"no TEST_FINISHED within {LONGEST_SCANS} scans"
        failures.append(f"{path}: {block}.{method}: {text}")
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
