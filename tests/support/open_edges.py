"""Edges that a rule forbids and that are not open yet: a list that may only become shorter.

``HLI_COSIM_OPEN_EDGES=FILE`` lets the rules write what they find to another file.
"""

from __future__ import annotations

import os
from pathlib import Path

from support.paths import TESTS

LIST = TESTS / "open_edges.txt"


def open_edges(kind: str) -> set[str]:
    """Edges of a kind: lines ``kind: SOURCE -> TARGET`` of the list."""
    if not LIST.exists():
        return set()
    lines = LIST.read_text().splitlines()
    return {
        line.partition(": ")[2]
        for line in lines
        if line.startswith(f"{kind}: ")
    }


def held(kind: str, found: list[str]) -> None:
    """What a rule found is exactly what the list knows."""
    if to := os.environ.get("HLI_COSIM_OPEN_EDGES"):
        with Path(to).open("a") as out:
            out.writelines(f"{kind}: {each}\n" for each in sorted(set(found)))
    known = open_edges(kind)
    new = sorted(set(found) - known)
    gone = sorted(known - set(found))
    assert new == [], f"{kind}, forbidden:\n" + "\n".join(new)
    assert gone == [], f"delete from {LIST.name}:\n" + "\n".join(gone)
