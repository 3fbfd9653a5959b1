"""The import rules of docs/architecture.md: front end -> blocks -> geometry -> kinematics -> engine -> hli -> plc."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
DIALECTS = ("isg", "iso", "isons", "osai")
# functions of numbers alone: no rows, no stages
PURE_GEOMETRY = tuple(f"cnc_core.geometry.{name}" for name in ("fits", "pocket", "rotation"))


def imported(path: Path) -> set[str]:
    """Absolute names of all modules a file imports."""
    package = ".".join(path.relative_to(ROOT).with_suffix("").parts[:-1])
    names: set[str] = set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            names |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            base = package.split(".")[: len(package.split(".")) - node.level + 1] if node.level else []
            module = ".".join([*base, *([node.module] if node.module else [])])
            names |= {module} | {f"{module}.{alias.name}" for alias in node.names}
    return names


def files(package: str) -> list[Path]:
    return sorted((ROOT / package).rglob("*.py"))


@pytest.mark.parametrize("path", files("hli"), ids=str)
def test_hli_imports_neither_neighbour(path: Path) -> None:
    """hli knows neither the CNC nor the PLC."""
    assert not {n for n in imported(path) if n.startswith(("cnc_core", "plc_client"))}


@pytest.mark.parametrize("path", files("plc_client"), ids=str)
def test_plc_client_never_imports_the_cnc(path: Path) -> None:
    """The PLC side is usable without the CNC's code."""
    assert not {n for n in imported(path) if n.startswith("cnc_core")}


@pytest.mark.parametrize("path", files("cnc_core/frontend"), ids=str)
def test_front_ends_stand_above_the_waist(path: Path) -> None:
    """A front end sees rows, errors, units, the port and pure geometry, never stages, engine or shared memory."""
    forbidden = ("cnc_core.geometry", "cnc_core.kinematics", "cnc_core.engine", "cnc_core.process.preparation", "hli", "plc_client")
    found = {n for n in imported(path) if n.startswith(forbidden)}
    assert not {n for n in found if not n.startswith(PURE_GEOMETRY)}


@pytest.mark.parametrize("path", files("cnc_core/geometry") + files("cnc_core/kinematics"), ids=str)
def test_nothing_below_the_waist_knows_a_dialect(path: Path) -> None:
    """Stages import no front end, and no engine either."""
    forbidden = (
        "cnc_core.engine",
        "cnc_core.process.preparation",
        "hli",
        "plc_client",
        *(f"cnc_core.frontend.{d}" for d in DIALECTS),
    )
    assert not {n for n in imported(path) if n.startswith(forbidden)}


def test_the_layout_imports_ctypes_alone() -> None:
    """The build runs hli/layout.py before anything is installed."""
    assert imported(ROOT / "hli" / "layout.py") <= {
        "__future__", "__future__.annotations", "ctypes", "ctypes.Structure", "typing", "typing.Any",
    }  # fmt: skip


def test_the_plc_process_does_not_load_the_planner() -> None:
    """Importing all of plc_client leaves cnc_core (and so its library) unloaded."""
    code = "import plc_client, plc_client.__main__, sys; sys.exit(any(m.startswith('cnc_core') for m in sys.modules))"
    assert subprocess.run([sys.executable, "-P", "-c", code], check=False).returncode == 0
