"""A page for every structure of the HLI, with values, bits and units."""

from __future__ import annotations

import importlib
import re
import sys

import pytest

from hli import layout
from hli.values import VALUES
from support.paths import ROOT

DOCS = ROOT / "docs"
sys.path.insert(0, str(DOCS))  # a folder of scripts, no package
GENERATE = importlib.import_module("generate")
UNITS = importlib.import_module("tables.units")
NO_VALUE = re.compile(
    r"HLI_(\w*MAXIDX|MAGIC|ABI_VERSION|AHEAD_VERSION|\w*_LAENGE)"
)


def test_every_structure_has_its_page_and_no_other_is_there() -> None:
    """The pages on disk are what the layout gives, byte for byte."""
    made = UNITS.pages()
    names = [f"{one.__name__.lower()}.md" for one in layout.structures()]
    assert sorted(made) == sorted(names)
    found = {p.name: p.read_text() for p in GENERATE.UNITS.glob("*")}
    assert found == made, "python docs/generate.py --write"


def test_every_constant_of_the_layout_is_told() -> None:
    """Kinds, modes, states, phases, flags; sizes and versions are no values."""
    told = set(re.findall(r"^    (HLI_\w+) \|", VALUES, re.M))
    known = {
        name
        for name, value in vars(layout).items()
        if name.startswith("HLI_")
        and isinstance(value, int)
        and not NO_VALUE.fullmatch(name)
    }
    assert told == known


@pytest.mark.parametrize(
    ("page", "line"),
    [
        ("hli_contour_lookahead_block", "| `2 HLI_CLAH_CIRCULAR` | arc"),
        ("hli_contour_lookahead_block", "| `< 0` | clockwise (G02) |"),
        ("hli_bahn_state", "| `bit 11` | inserted stop |"),
        ("hli_bahn_state", "| `dist_prog_start` | LREAL | 0 | 0.1 um | CNC |"),
        ("hli_bahn_state", "| CNC | no | 0 |"),
        ("hli_bahn_mc_control", "`gpCh[i].bahn_mc_control.override`: of the"),
        ("hli_bahn_mc_control", "| `command_w` | UINT | 0.1 % | PLC |"),
        ("mc_control_bool_unit", "`gpCh[i].bahn_mc_control.feedhold`"),
        ("hli_coord", "It stands at `gpCh[i].bahn_state.coord_r[j]`."),
    ],
)
def test_a_page_tells(page: str, line: str) -> None:
    """Values by name, signs, bits, who writes, what is not served, places."""
    assert line in UNITS.pages()[f"{page}.md"]
