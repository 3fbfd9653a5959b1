"""Who imports whom: the graph of the project's Python modules, from their text."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from support.paths import ROOT

PACKAGES = ("cnc_core", "hli", "plc_client")
COMPILED = ("cnc_core._engine", "hli._sync")


@dataclass(frozen=True)
class Edge:
    """One import: ``typing`` where only type checkers read it."""

    source: str
    target: str
    line: int
    typing: bool

    def __str__(self) -> str:
        mark = " (for types)" if self.typing else ""
        return f"{self.source}:{self.line} -> {self.target}{mark}"


def module_name(path: Path) -> str:
    """Dotted name of a file; a package has the name of its folder."""
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


@cache
def module_files() -> dict[str, Path]:
    """Every module of the project with its file."""
    found = [
        path for package in PACKAGES for path in (ROOT / package).rglob("*.py")
    ]
    return {module_name(path): path for path in sorted(found)}


def imports(
    tree: ast.AST, typing: bool = False
) -> Iterator[tuple[ast.Import | ast.ImportFrom, bool]]:
    """Import statements at any depth, each with whether it is for types only."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.Import | ast.ImportFrom):
            yield node, typing
        elif isinstance(node, ast.If):
            checks = "TYPE_CHECKING" in ast.unparse(node.test)
            body = ast.Module(node.body, [])
            rest = ast.Module(node.orelse, [])
            yield from imports(body, typing or checks)
            yield from imports(rest, typing)
        else:
            yield from imports(node, typing)


def _base(name: str, path: Path, node: ast.ImportFrom) -> str:
    """The absolute module that a ``from`` names."""
    if not node.level:
        return node.module or ""
    package = name.split(".")
    if path.name != "__init__.py":
        package = package[:-1]
    package = package[: len(package) - node.level + 1]
    return ".".join([*package, *([node.module] if node.module else [])])


def _targets(
    name: str, path: Path, node: ast.Import | ast.ImportFrom
) -> list[str]:
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    base = _base(name, path, node)
    return [f"{base}.{alias.name}" for alias in node.names]


@cache
def outer_names(path: Path) -> set[str]:
    """Absolute names of everything that a file imports."""
    name = module_name(path)
    return {
        target
        for node, _ in imports(ast.parse(path.read_text()))
        for target in _targets(name, path, node)
    }


@cache
def edges() -> list[Edge]:
    """Imports between modules of the project; a name of a module counts as that module."""
    files = module_files()
    found = set()
    for name, path in files.items():
        for node, typing in imports(ast.parse(path.read_text())):
            for target in _targets(name, path, node):
                known = "" if target.startswith(COMPILED) else target
                while known and known not in files:
                    known = known.rpartition(".")[0]
                if known and known != name:
                    found.add(Edge(name, known, node.lineno, typing))
    return sorted(found, key=str)


def circles(graph: dict[str, set[str]]) -> list[list[str]]:
    """Groups of nodes that reach each other, each sorted (Tarjan)."""
    order: dict[str, int] = {}
    low: dict[str, int] = {}
    stack: list[str] = []
    found: list[list[str]] = []

    def visit(node: str) -> None:
        order[node] = low[node] = len(order)
        stack.append(node)
        for other in sorted(graph.get(node, ())):
            if other not in order:
                visit(other)
                low[node] = min(low[node], low[other])
            elif other in stack:
                low[node] = min(low[node], order[other])
        if low[node] == order[node]:
            group = stack[stack.index(node) :]
            del stack[len(stack) - len(group) :]
            if len(group) > 1:
                found.append(sorted(group))

    for node in sorted(graph):
        if node not in order:
            visit(node)
    return found


def graph_of(found: list[Edge]) -> dict[str, set[str]]:
    """Modules with what they import."""
    graph: dict[str, set[str]] = {}
    for edge in found:
        graph.setdefault(edge.source, set()).add(edge.target)
    return graph


def rank(name: str, order: list[str]) -> int | None:
    """Place of a name in an order of rooms: that of its longest prefix."""
    found = [r for r in order if name == r or name.startswith(f"{r}.")]
    return order.index(max(found, key=len)) if found else None


def in_circles(found: list[Edge]) -> list[Edge]:
    """The imports between modules that reach each other."""
    groups = circles(graph_of(found))
    home = {name: k for k, group in enumerate(groups) for name in group}
    return [
        edge
        for edge in found
        if home.get(edge.source, -1) == home.get(edge.target, -2)
    ]


def upward(found: list[Edge], order: list[str]) -> list[Edge]:
    """Imports that lead to a room above their own."""
    up = []
    for edge in found:
        here, there = rank(edge.source, order), rank(edge.target, order)
        if here is not None and there is not None and here > there:
            up.append(edge)
    return up
