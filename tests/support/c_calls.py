"""Who includes and calls whom in c_ext: edges between C files, from their text."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

from support.import_graph import Edge
from support.paths import ROOT

C_EXT = ROOT / "c_ext"
GENERATED = {"_engine.c", "_sync.c", "hli_layout.h"}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.M)
NOISE = re.compile(
    r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"|\'(?:\\.|[^\'\\\n])*\'', re.S
)
DIRECTIVE = re.compile(r"^[ \t]*#(?:[^\n]*\\\n)*[^\n]*", re.M)
CALL = re.compile(r"(?<![\w.])(?<!->)([A-Za-z_]\w*)\s*\(")
ADDRESS = re.compile(r"(?:&|\.\w+\s*=\s*)([A-Za-z_]\w*)\s*[,;)}\n]")
DEFINITION = re.compile(
    r"^(?P<head>[A-Za-z_][\w \t*\n]*?[ *\n])(?P<name>[A-Za-z_]\w*)"
    r"\((?P<arguments>[^;{}]*)\)\s*\{",
    re.M,
)


@cache
def sources() -> dict[str, Path]:
    """Every C file and header, by its path below c_ext."""
    found = sorted(
        path
        for path in C_EXT.rglob("*.[ch]")
        if path.name not in GENERATED and "build" not in path.parts
    )
    return {path.relative_to(C_EXT).as_posix(): path for path in found}


def node(name: str) -> str:
    """The node of a file: its path below c_ext without suffix."""
    return name.rpartition(".")[0]


def blanked(text: str) -> str:
    """The text without comments and strings, its lines kept."""
    return NOISE.sub(lambda m: "\n" * m.group().count("\n"), text)


def code_of(text: str) -> str:
    """The text without comments, strings and directives, its lines kept."""
    blank = blanked(text)
    return DIRECTIVE.sub(lambda m: "\n" * m.group().count("\n"), blank)


@cache
def _definitions(name: str) -> dict[str, bool]:
    """Functions that a file defines: whether other files can call them."""
    text = code_of(sources()[name].read_text())
    return {
        match["name"]: "static" not in match["head"].split()
        for match in DEFINITION.finditer(text)
    }


@cache
def defined() -> dict[str, str]:
    """Functions that other files can call, with the file that defines them."""
    return {
        function: name
        for name in sources()
        for function, public in _definitions(name).items()
        if public
    }


def _included(name: str, text: str) -> Iterator[tuple[str, int]]:
    for match in INCLUDE.finditer(text):
        target = match[1]
        beside = (Path(name).parent / target).as_posix()
        known = next((t for t in (target, beside) if t in sources()), None)
        if known:
            yield known, text[: match.start()].count("\n") + 1


def _called(name: str) -> Iterator[tuple[str, int]]:
    """Files whose functions a file calls or takes the address of."""
    functions, own = defined(), _definitions(name)
    text = code_of(sources()[name].read_text())
    for number, line in enumerate(text.splitlines(keepends=True), 1):
        for word in [*CALL.findall(line), *ADDRESS.findall(line)]:
            if word in functions and word not in own:
                yield functions[word], number


@cache
def includes() -> list[Edge]:
    """Includes between files, with their suffixes."""
    found = set()
    for name, path in sources().items():
        for target, line in _included(name, path.read_text()):
            found.add(Edge(name, target, line, False))
    return sorted(found, key=str)


@cache
def calls() -> list[Edge]:
    """Calls of functions (and uses of their addresses) that another file defines."""
    found = set()
    for name, path in sources().items():
        if path.suffix == ".h":
            continue  # declarations; inline functions come with the include
        for target, line in _called(name):
            if node(target) != node(name):
                found.add(Edge(node(name), node(target), line, False))
    return sorted(found, key=str)


def folder(name: str) -> str:
    """The folder of a node."""
    return name.rpartition("/")[0]


def between_folders(found: list[Edge]) -> list[Edge]:
    """The edges that leave a folder, as edges of folders."""
    return [
        Edge(folder(e.source), folder(e.target), e.line, False)
        for e in found
        if folder(e.source) != folder(e.target)
    ]
