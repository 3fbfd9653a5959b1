"""Every snippet of tests/golden/st gives the values its comments tell."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import pytest

from plc_client.st import build
from plc_client.st.machine.loader import StProgram
from plc_client.st.options import Options

GOLDEN = Path(__file__).parents[2] / "golden" / "st"
SNIPPETS = sorted(GOLDEN.glob("*.st"))
_LINE = re.compile(r"^//\s*([A-Za-z_][\w.\[\]]*)\s*=\s*(.+)$", re.M)
_SCANS = re.compile(r"^// scans (\d+)", re.M)
_OPTION = re.compile(r"^// option short-circuit", re.M)
SCAN_NS = 1_000_000


def value_of(program: StProgram, path: str) -> Any:
    """The variable at a path such as ``MAIN.a[2].x``."""
    name, *parts = re.findall(r"\w+|\[\d+\]", path)
    found: Any = program[name]
    for part in parts:
        index = part.startswith("[")
        found = found[int(part[1:-1])] if index else getattr(found, part)
    return found


def run(text: str, name: str, scans: int) -> StProgram:
    """The program after so many scans of 1 ms, the first one at 1 ms."""
    options = Options(short_circuit=bool(_OPTION.search(text)))
    program = StProgram(build({name: text}, options))
    program.start(0)
    for scan in range(1, scans + 1):
        for task in program.description["tasks"]:
            for entry in task["programs"]:
                program.run(program.entry(entry), scan * SCAN_NS)
    return program


@pytest.mark.sanitize
@pytest.mark.parametrize("path", SNIPPETS, ids=lambda p: p.stem)
def test_snippet_gives_the_values_it_tells(path: Path) -> None:
    """The comments ``// MAIN.x = 5`` hold after the number of scans told."""
    text = path.read_text()
    scans = _SCANS.search(text)
    program = run(text, path.name, int(scans[1]) if scans else 1)
    expected = _LINE.findall(text)
    assert expected, "the snippet tells no value"
    for name, written in expected:
        found, value = value_of(program, name), ast.literal_eval(written)
        if isinstance(value, float):
            assert found == pytest.approx(value, rel=1e-6), name
        else:
            assert found == value, name
