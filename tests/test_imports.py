"""Imports run one way: no circle between modules, and rooms in one order from top to bottom.

The order is the one of docs/explanation/architecture.md.
A rule sees names, too: no dialect below the waist, no capability by ``hasattr``.
``tests/open_edges.txt`` lists what is not open yet.
"""

from __future__ import annotations

import ast
import io
import re
import subprocess
import sys
import tokenize
from collections.abc import Iterator
from pathlib import Path

import pytest

from support.import_graph import (
    Edge,
    edges,
    in_circles,
    module_files,
    module_name,
    outer_names,
    rank,
    upward,
)
from support.open_edges import held
from support.paths import ROOT

pytestmark = pytest.mark.source

# top to bottom; the longest prefix names a module's room
ORDER = [
    "cnc_core.__main__",
    "cnc_core.cli",
    "cnc_core.pytest_plugin",
    "cnc_core.commands",
    "cnc_core.monitor",
    "cnc_core.bridges",
    "cnc_core.bridges.ads",
    "cnc_core.bridges.opcua",
    "cnc_core.bridges.symbols",
    "cnc_core.observing",
    "cnc_core.benchmarks",
    "cnc_core.sweep",
    "cnc_core.fmu",
    "cnc_core.federate",
    "cnc_core.optimize",
    "cnc_core.planning",
    "cnc_core",
    "cnc_core.cell",
    "cnc_core.process",
    "cnc_core.recording",
    "cnc_core.engine",
    "cnc_core.program",
    "cnc_core.config",
    "cnc_core.frontend.offline",
    "cnc_core.frontend",
    "cnc_core.frontend.isons",
    "cnc_core.frontend.isons.flow",
    "cnc_core.frontend.isons.operator",
    "cnc_core.frontend.isons.language",
    "cnc_core.frontend.isons.motion",
    "cnc_core.frontend.isons.devices",
    "cnc_core.frontend.isons.base",
    "cnc_core.frontend.isg",
    "cnc_core.frontend.isg.flow",
    "cnc_core.frontend.isg.commands",
    "cnc_core.frontend.isg.language",
    "cnc_core.frontend.isg.cycles",
    "cnc_core.frontend.isg.state",
    "cnc_core.frontend.iso",
    "cnc_core.frontend.osai",
    "cnc_core.frontend.base",
    "cnc_core.frontend.detect",
    "cnc_core.frontend.front_end",
    "cnc_core.frontend.port",
    "cnc_core.frontend.axes",
    "cnc_core.frontend.signals",
    "cnc_core.frontend.jobs",
    "cnc_core.frontend.operator",
    "cnc_core.frontend.machine",
    "cnc_core.frontend.isons.base.machine",
    "cnc_core.geometry.stages",
    "cnc_core.geometry.profiles",
    "cnc_core.geometry.filters",
    "cnc_core.geometry.stages.stage",
    "cnc_core.geometry.shapes",
    "cnc_core.geometry",
    "cnc_core.kinematics",
    "cnc_core.blocks",
    "cnc_core.files",
    "cnc_core.errors",
    "cnc_core.plain",
    "cnc_core.units",
    "plc_client",
    "plc_client.blocks",
    "plc_client.clock",
    "plc_client.stats",
    "hli",
]
DIALECTS = ("isg", "iso", "isons", "osai")
BELOW_THE_WAIST = tuple(
    f"cnc_core.{room}"
    for room in (
        "blocks",
        "kinematics",
        "geometry",
        "engine",
        "program",
        "process",
        "planning",
        "cell",
    )
)
# iso alone is a word of too many meanings
DIALECT_NAME = re.compile(r"(?<![a-z])(isg|isons|osai)(?![a-z])", re.I)
CAPABILITY = re.compile(r"type: ignore(?!\[)|type: ignore\[[^]]*attr-defined")


def told(found: list[Edge]) -> list[str]:
    """Edges without their lines, which move."""
    return [f"{edge.source} -> {edge.target}" for edge in found]


def files(package: str) -> list[Path]:
    found = sorted((ROOT / package).rglob("*.py"))
    assert found, package
    return found


def test_every_module_has_a_room() -> None:
    """The order names a room for every module, and no room that is gone."""
    names = list(module_files())
    assert len(names) > 250
    assert [name for name in names if rank(name, ORDER) is None] == []
    empty = [
        room
        for room in ORDER
        if not any(n == room or n.startswith(f"{room}.") for n in names)
    ]
    assert empty == []


def test_imports_run_down() -> None:
    """No module imports from a room above its own, not even for types."""
    held("import up", told(upward(edges(), ORDER)))


def test_modules_import_in_no_circle() -> None:
    """Imports inside functions count; those for types alone do not."""
    found = [edge for edge in edges() if not edge.typing]
    held("import circle", told(in_circles(found)))


def test_types_are_imported_in_no_circle() -> None:
    """The same with the imports that only type checkers read."""
    held("type circle", told(in_circles(edges())))


def test_dialects_do_not_know_each_other() -> None:
    """A dialect's front end imports what all share, and its own rooms."""
    rooms = {f"cnc_core.frontend.{dialect}" for dialect in DIALECTS}

    def room(name: str) -> str:
        return ".".join(name.split(".")[:3])

    found = [
        edge
        for edge in edges()
        if room(edge.source) in rooms
        and room(edge.target) in rooms - {room(edge.source)}
    ]
    assert told(found) == []


# ------------------------------------------------------------------- names
def _named(tree: ast.AST) -> Iterator[str]:
    """Names and short words of a program's text, not its documentation."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Name):
            yield node.id
        elif isinstance(node, ast.Attribute):
            yield node.attr
        elif isinstance(node, ast.arg):
            yield node.arg
        elif isinstance(node, ast.FunctionDef | ast.ClassDef):
            yield node.name
        elif isinstance(node, ast.ImportFrom):
            yield from [node.module or "", *(a.name for a in node.names)]
        elif isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value if len(node.value) < 30 else ""


def test_no_dialect_is_named_below_the_waist() -> None:
    """Rows have no dialect: neither a name nor a word there tells one."""
    found = []
    for name, path in module_files().items():
        if name.startswith(BELOW_THE_WAIST):
            words = _named(ast.parse(path.read_text()))
            found += [
                f"{name} -> {word.strip()}"
                for word in words
                if DIALECT_NAME.search(word)
            ]
    held("dialect", found)


def _capabilities(path: Path) -> Iterator[str]:
    """Members that a file looks for by their name in text."""
    for node in ast.walk(ast.parse(path.read_text())):
        if (
            isinstance(node, ast.Call)
            and isinstance(node.func, ast.Name)
            and node.func.id in ("hasattr", "getattr")
            and isinstance(node.args[1], ast.Constant)
        ):
            yield f"{node.func.id} {node.args[1].value}"
    for token in tokenize.generate_tokens(
        io.StringIO(path.read_text()).readline
    ):
        if token.type == tokenize.COMMENT and CAPABILITY.search(token.string):
            yield token.string.lstrip("# ")


def test_capabilities_are_declared() -> None:
    """What an object can do is told by a protocol, not found by a member's name."""
    found = [
        f"{module_name(path)} -> {found}"
        for path in files("cnc_core")
        for found in _capabilities(path)
    ]
    held("capability", found)


# ---------------------------------------------------------------- packages
@pytest.mark.parametrize("path", files("hli"), ids=module_name)
def test_hli_imports_neither_neighbour(path: Path) -> None:
    """hli knows neither the CNC nor the PLC."""
    names = outer_names(path)
    assert not {n for n in names if n.startswith(("cnc_core", "plc_client"))}


@pytest.mark.parametrize("path", files("plc_client"), ids=module_name)
def test_plc_client_never_imports_the_cnc(path: Path) -> None:
    """The PLC side is usable without the CNC's code."""
    assert not {n for n in outer_names(path) if n.startswith("cnc_core")}


@pytest.mark.parametrize("path", files("cnc_core/frontend"), ids=module_name)
def test_front_ends_stand_above_the_waist(path: Path) -> None:
    """A front end sees rows, errors, units, the port and shapes, no stages, engine or memory."""
    forbidden = (
        "cnc_core.geometry",
        "cnc_core.kinematics",
        "cnc_core.engine",
        "cnc_core.process",
        "hli",
        "plc_client",
    )
    found = {n for n in outer_names(path) if n.startswith(forbidden)}
    shapes = "cnc_core.geometry.shapes"
    assert not {n for n in found if not n.startswith(shapes)}


@pytest.mark.parametrize(
    "path",
    files("cnc_core/geometry") + files("cnc_core/kinematics"),
    ids=module_name,
)
def test_stages_know_neither_shared_memory_nor_processes(path: Path) -> None:
    """Stages turn rows into rows; no engine, no HLI, no front end stands below them."""
    forbidden = (
        "cnc_core.engine",
        "cnc_core.process",
        "hli",
        "plc_client",
        *(f"cnc_core.frontend.{dialect}" for dialect in DIALECTS),
    )
    assert not {n for n in outer_names(path) if n.startswith(forbidden)}


def test_the_layout_imports_ctypes_alone() -> None:
    """The build runs hli/layout.py before anything is installed."""
    assert outer_names(ROOT / "hli" / "layout.py") <= {
        "__future__.annotations",
        "ctypes",
        "ctypes.Structure",
        "typing.Any",
    }


def test_the_plc_process_does_not_load_the_planner() -> None:
    """Importing all of plc_client leaves cnc_core (and so its library) unloaded."""
    code = (
        "import plc_client, plc_client.__main__, sys;"
        "sys.exit(any(m.startswith('cnc_core') for m in sys.modules))"
    )
    done = subprocess.run([sys.executable, "-P", "-c", code], check=False)
    assert done.returncode == 0
