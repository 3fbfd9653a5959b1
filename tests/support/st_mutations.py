"""Right sources of Structured Text with seeded wrong places."""

from __future__ import annotations

import random
import re
from pathlib import Path

GOLDEN = Path(__file__).parents[1] / "golden" / "st"
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
