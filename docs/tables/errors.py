"""The error numbers, and the parts of the program that report them."""

from __future__ import annotations

import ast
import functools
import re
from pathlib import Path

from cnc_core.catalogue import catalogue

from .texts import table

ROOT = Path(__file__).resolve().parents[2]


PLACES = {
    "cnc_core/frontend/isg/": "ISG program",
    "cnc_core/frontend/iso/": "iso program",
    "cnc_core/frontend/isons/": "IsoNs program",
    "cnc_core/frontend/osai/": "HSM program",
    "cnc_core/frontend/": "program",
    "cnc_core/config/": "cell file",
    "cnc_core/geometry/": "path",
    "cnc_core/optimize/": "Path Optimizer",
    "cnc_core/kinematics/": "kinematics",
    "cnc_core/engine/": "engine",
    "cnc_core/process/": "CNC process",
    "cnc_core/cell/": "run",
    "cnc_core/": "command line",
    "plc_client/st/": "Structured Text",
    "plc_client/": "PLC",
    "hli/": "HLI",
    "c_ext/rows/": "program",
    "c_ext/stages/": "path",
    "c_ext/jerk/": "planner",
    "c_ext/": "engine",
}


def numbers_in(path: Path) -> set[int]:
    """Error numbers that a source file mentions."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        nodes = ast.walk(ast.parse(text))
        found = {n.value for n in nodes if isinstance(n, ast.Constant)}
        return {n for n in found if isinstance(n, int) and n in catalogue()}
    return {
        int(word) for word in re.findall(r"\b(\d{4,6})u?\b", text)
    } & catalogue().keys()


@functools.cache
def found_by() -> dict[int, set[str]]:
    """Number -> parts of the program that report it."""
    out: dict[int, set[str]] = {number: set() for number in catalogue()}
    for package in ("cnc_core", "plc_client", "hli", "c_ext"):
        for path in sorted((ROOT / package).rglob("*.*")):
            name = path.relative_to(ROOT).as_posix()
            skipped = path.name in ("_engine.c", "_sync.c", "reference.py")
            if path.suffix not in (".py", ".c", ".h") or skipped:
                continue
            if name == "cnc_core/errors.py":  # the table of them all
                continue
            place = next(
                p for room, p in PLACES.items() if name.startswith(room)
            )
            for number in numbers_in(path):
                out[number].add(place)
    return out


def error_table(which: str) -> str:
    """Rows of the numbers in ``LOW-HIGH``."""
    low, high = map(int, which.split("-"))
    places = found_by()
    rows = [
        [
            str(number),
            *(
                said.replace("|", "\\|")
                for said in (one.text, one.cause, one.cure)
            ),
            place_text(places[number]),
        ]
        for number, one in sorted(catalogue().items())
        if low <= number <= high
    ]
    return table(("Number", "Text", "Why", "What helps", "Found in"), rows)


def place_text(places: set[str]) -> str:
    dialects = {p for p in places if p.endswith(" program")}
    if len(dialects) > 1 or "program" in places:
        places = places - dialects | {"program"}
    return ", ".join(sorted(places)) or "reserved"
