"""docs/cycles.md says what the registry says."""

import re
from pathlib import Path

import pytest

from cnc_core.frontend.isg.cycles.preview import CODES
from cnc_core.frontend.isg.cycles.registry import CYCLES

PAGE = (Path(__file__).parents[2] / "docs" / "cycles.md").read_text()


def section(name):
    """The page's part about one cycle."""
    return PAGE.split(f"\n## {name}\n")[1].split("\n## ")[0]


@pytest.mark.parametrize("cycle", CYCLES, ids=lambda c: c.name)
def test_every_parameter_stands_in_the_docs_as_it_is_declared(cycle):
    """Number, meaning, unit, range, default: row by row."""
    rows = [
        [cell.strip() for cell in line.split("|")[1:-1]]
        for line in section(cycle.name).splitlines()
        if "|" in line
    ]
    wanted = []
    for p in cycle.parameters:
        names = " ".join(f'"{name}"' for name in p.names)
        allowed = p.range_text + (f", or {names}" if names else "")
        value = "-" if p.default is None else f"{p.default:g}"
        default = "required" if p.required else p.default_text or value
        wanted.append(
            [str(p.number), p.text, p.unit or "-", allowed or "-", default]
        )
    assert rows[2:] == wanted


@pytest.mark.parametrize("cycle", CYCLES, ids=lambda c: c.name)
def test_every_output_stands_in_the_docs(cycle):
    """The V.CYC variables of a cycle."""
    found = re.search(r"Outputs, `V\.CYC\.`: (.*)", section(cycle.name))
    assert (found[1].split(", ") if found else []) == list(cycle.outputs)


def test_every_code_stands_in_the_docs():
    """The numbers that a call may be refused with."""
    assert {str(code) for code in CODES} <= set(re.findall(r"\d+", PAGE))
