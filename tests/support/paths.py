"""Folders of the repository that tests read."""

from __future__ import annotations

import os
from pathlib import Path

TESTS = Path(__file__).resolve().parents[1]
ROOT = TESTS.parent
DOCS = ROOT / "docs"
EXAMPLES = ROOT / "examples"
FIVE_AXIS = EXAMPLES / "five_axis"
EVERY = int(os.environ.get("HLI_COSIM_EVERY", "1"))
"""How many fewer cases and repetitions than usual."""
SHARE, SHARES = map(int, os.environ.get("HLI_COSIM_SHARE", "0/1").split("/"))
"""K/N: of the files with tests that CI alone runs each Nth, from the Kth on."""
GOLDEN = TESTS / "golden"
PLC_PROGRAMS = Path(__file__).with_name("plc")


def docs_page(name: str) -> Path:
    """The one page of the documentation that has a file name."""
    (page,) = DOCS.rglob(name)
    return page
