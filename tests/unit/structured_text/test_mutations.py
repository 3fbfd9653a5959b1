"""Seeded mutations of right sources: each is right or an error with its place."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from plc_client.st.build import build, check
from plc_client.st.machine.loader import StProgram, StTrap
from support.seeds import few

GOLDEN = Path(__file__).parents[2] / "golden" / "st"
SMALL = 6000
"""Characters of a source that is mutated: each mutation is compiled."""
TEXTS = [
    text
    for path in sorted(GOLDEN.glob("*.st"))
    if len(text := path.read_text()) < SMALL
]
TOKENS = re.compile(r"\s+|[A-Za-z_]\w*|\d+|'[^'\n]*'|.", re.S)
WORDS = [
    "IF",
    "THEN",
    "END_IF",
    "FOR",
    ":=",
    ";",
    "(",
    ")",
    "[",
    "]",
    "^",
    ".",
    "..",
    "END_VAR",
    "VAR",
    "'x'",
    "16#",
    "T#1s",
    "1e999",
    "99999999999999999999",
    "-1",
    "0",
    "ARRAY",
    "OF",
    "POINTER",
    "TO",
    "REF=",
    "THIS^",
    "SUPER^",
    "$",
    '"',
    "'",
    "(*",
    "//",
    "{",
    "}",
    "%IX0.0",
    "AT",
    "STRING(0)",
    "REAL",
    "BOOL",
    "x",
    "ADR(",
    "SIZEOF(",
    "END_PROGRAM",
    "PROGRAM",
    "MAIN",
    "METHOD",
    "END_METHOD",
    "{IF",
    "FB_init",
    "EXTENDS",
    "IMPLEMENTS",
    "é",
    "\x00",
]
LOOP_S = 0.05
SCANS = 3


def mutated(seed: int) -> str:
    """A right source with one to three wrong places."""
    rng = random.Random(seed)
    tokens = TOKENS.findall(rng.choice(TEXTS))
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        at, what = rng.randrange(len(tokens)), rng.randrange(7)
        if what == 0:
            del tokens[at]
        elif what == 1:
            tokens.insert(at, f"{rng.choice(WORDS)} ")
        elif what == 2:
            tokens[at] = rng.choice(WORDS)
        elif what == 3:
            other = rng.randrange(len(tokens))
            tokens[at], tokens[other] = tokens[other], tokens[at]
        elif what == 4:
            tokens.insert(at, rng.choice(tokens))
        elif what == 5:
            tokens = tokens[: at + 1]
        else:
            tokens[at:at] = tokens[at : at + rng.randrange(1, 20)]
        tokens = tokens or [" "]
    return "".join(tokens)


def run(text: str) -> None:
    """What is right compiles; it runs, or its trap stops it."""
    program = StProgram(build({"m.st": text}))
    program.allow(LOOP_S)
    try:
        program.start(0)
        for scan in range(1, SCANS + 1):
            for task in program.description["tasks"]:
                for name in task["programs"]:
                    program.run(program.entry(name), scan * 1_000_000)
    except StTrap:
        return


@pytest.mark.parametrize("seed", few(range(500), 6))
def test_mutation_is_right_or_an_error_with_its_place(seed: int) -> None:
    """No crash and no hang; places lie in the text, C is never wrong."""
    text = mutated(seed)
    found = check({"m.st": text})
    lines = text.count("\n") + 2
    for error in found.log.errors:
        assert error.text
        assert error.file == "m.st"
        assert 1 <= error.line <= lines
        assert error.column >= 1
    if not found.log.errors:
        run(text)
