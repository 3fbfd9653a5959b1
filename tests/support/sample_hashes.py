"""Hashes of what fifty programs drive: the same bits on every interpreter and compiler.

Each is planned and interpolated offline, and all positions, ways and speeds of its
cycles go into the hash.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import math
from pathlib import Path

import numpy as np

from cnc_core.config import parse_config
from cnc_core.errors import CncError
from cnc_core.planning import plan_program
from cnc_core.program import Program
from support.mutated import CELL, right_programs
from support.paths import GOLDEN

STORED = GOLDEN / "sample_hashes.json"
PROGRAMS = 50
DIALECTS = ("osai", "isons", "iso", "isg")
"""The last has programs enough for what is left."""
CYCLES = range(50, 6000)
"""A shorter program shows nothing, a longer one no more."""


def digest(path: Path) -> str:
    """Sixteen digits for all samples of a program, "" without enough of them.

    CncError: it does not fit this cell.
    """
    dialect = path.parent.name.split("_", 1)[0]
    program = Program(path, parse_config(CELL), dialect)
    samples = plan_program(program, keep_samples=True).samples or {}
    if len(samples["t"]) not in CYCLES:
        return ""
    found = hashlib.sha256()
    for name in ("pos", "s", "v"):
        found.update(np.ascontiguousarray(samples[name]).tobytes())
    return found.hexdigest()[:16]


def library() -> str:
    """Sixteen digits for the last bits of what is left to the C library.

    Its cube root, hypotenuse and ``log1p`` do not ask for the processor, but another
    library may have others.
    """
    found = hashlib.sha256()
    values = np.random.default_rng(1).uniform(0.0, 1.0, 4000)
    for value in map(float, values):
        own = [math.cbrt(value), math.hypot(value, 0.9), math.log1p(value)]
        found.update(np.array(own).tobytes())
    return found.hexdigest()[:16]


def choose() -> dict[str, str]:
    """The first programs that move long enough, by their folder's name."""
    found: dict[str, str] = {}
    for dialect in DIALECTS:
        for path in right_programs(dialect):
            if len(found) == PROGRAMS:
                return found
            with contextlib.suppress(CncError):
                if said := digest(path):
                    found[path.parent.name] = said
    return found


def write() -> None:
    """Store what the programs drive here."""
    content = {"library": library(), "programs": choose()}
    STORED.write_text(json.dumps(content, indent=1, sort_keys=True) + "\n")


def stored() -> dict[str, str]:
    """The hashes that were written."""
    found: dict[str, str] = json.loads(STORED.read_text())["programs"]
    return found


def stored_library() -> str:
    """``library()`` of where they were written."""
    return str(json.loads(STORED.read_text())["library"])


def now() -> dict[str, str]:
    """The same programs as they are driven here."""
    return {
        name: digest(next(GOLDEN.glob(f"{name}/program.*")))
        for name in stored()
    }
