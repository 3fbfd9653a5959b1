"""The public surface is the one of ``tests/golden/public``: names, commands,
JSON keys, keys of cell.toml.

``HLI_COSIM_GOLDEN=write`` writes the lists anew.
A name that leaves breaks users; a name that comes is a promise.
"""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from support import public_surface
from support.command_line import Outcome
from support.paths import GOLDEN

LISTS: dict[str, Callable[[], list[str]]] = {
    "python": public_surface.python_names,
    "pytest": public_surface.pytest_names,
    "commands": public_surface.commands,
    "cell": public_surface.cell_keys,
}


def same_as_golden(name: str, lines: list[str]) -> None:
    """Compare with the list of that name, or write it."""
    path = GOLDEN / "public" / f"{name}.txt"
    if os.environ.get("HLI_COSIM_GOLDEN") == "write":
        path.write_text("\n".join(lines) + "\n")
    known = path.read_text().splitlines()
    gone = [line for line in known if line not in lines]
    come = [line for line in lines if line not in known]
    assert (gone, come) == ([], [])


@pytest.mark.parametrize("name", LISTS)
def test_names_stay(name: str) -> None:
    """No public name, parameter, default, option or key has gone or come."""
    lines = LISTS[name]()
    assert len(lines) == len(set(lines))
    same_as_golden(name, lines)


@pytest.mark.ci
def test_json_keys_stay(tmp_path: Path, cli: Callable[..., Outcome]) -> None:
    """Every command prints the same keys with the same kinds of values."""
    same_as_golden("json", public_surface.json_keys(tmp_path, cli))
