"""Includes and calls of c_ext run one way: no circle between files or folders,
folders in one order.

Calls are found by name: a function that another file defines, called or taken
by its address. The order is the one of docs/explanation/architecture.md;
``tests/open_edges.txt`` lists what is not open yet.
"""

from __future__ import annotations

import re

import pytest

from support.c_calls import (
    between_folders,
    calls,
    defined,
    folder,
    includes,
    sources,
)
from support.import_graph import Edge, in_circles
from support.open_edges import held

pytestmark = pytest.mark.source

# top to bottom; a folder calls and includes what stands below it
ORDER = [
    "engine",
    "engine/geo",
    "engine/lookahead",
    "engine/plan",
    "engine/accel",
    "engine/jerk_adapter",
    "engine/run",
    "engine/store",
    "engine/commit",
    "engine/path",
    "engine/state",
    "jerk",
    "jerk/stop",
    "jerk/window",
    "jerk/solver",
    "jerk/rows",
    "jerk/path",
    "jerk/state",
    "stages/contouring",
    "stages/smoothing",
    "stages/compensation",
    "stages",
    "curve",
    "rows",
    "maths",
    "hli",
]


def told(found: list[Edge]) -> list[str]:
    """Edges without their lines, which move."""
    return [f"{edge.source} -> {edge.target}" for edge in found]


def upward(found: list[Edge]) -> list[Edge]:
    """Edges that lead to a folder above their own."""
    return [
        edge
        for edge in found
        if ORDER.index(folder(edge.source)) > ORDER.index(folder(edge.target))
    ]


def test_the_sources_are_found() -> None:
    """The test sees the code: its files, its functions, its folders."""
    assert len(sources()) > 100
    assert len(defined()) > 400
    assert len(calls()) > 300
    assert {folder(name) for name in sources()} == set(ORDER)


def test_calls_run_down() -> None:
    """No function calls one in a folder above its own."""
    held("c call up", told(upward(calls())))


def test_includes_run_down() -> None:
    """No file includes a header of a folder above its own."""
    held("c include up", told(upward(includes())))


def test_files_call_in_no_circle() -> None:
    """Files that call each other in a circle are one file, or one call too many."""
    held("c call circle", told(in_circles(calls())))


def test_files_include_in_no_circle() -> None:
    """A header stands on its own, or on headers that do not need it."""
    held("c include circle", told(in_circles(includes())))


def test_folders_use_each_other_in_no_circle() -> None:
    """Calls and includes together, folder by folder."""
    both = between_folders([*calls(), *includes()])
    held("c folder circle", told(in_circles(both)))


# a definition that is not inlined, and a vector that it takes by value
NOT_INLINED = re.compile(r"^static (?!inline)[^;{}]*?\)\s*\{", re.M | re.S)
BY_VALUE = re.compile(r"\bvec \w+\s*[,)]")


def test_functions_that_are_not_inlined_take_vectors_by_address() -> None:
    """Behind a function that takes a vector GCC 12 leaves the upper halves of
    AVX2's registers in use: what is built for any processor then takes three
    times as long.
    """
    wrong = [
        f"{name}: {head[0].split('(')[0]}"
        for name, path in sources().items()
        if name.endswith(".h")  # what both builds include
        for head in NOT_INLINED.finditer(path.read_text())
        if BY_VALUE.search(head[0])
    ]
    assert not wrong
