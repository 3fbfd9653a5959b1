"""Mutated sources: the compiler tells errors with their places and never crashes."""

from __future__ import annotations

import random
import re
from pathlib import Path

import pytest

from plc_client.st.build import check
from support.seeds import few

GOLDEN = Path(__file__).parents[1] / "golden" / "st"
SOURCES = sorted(GOLDEN.glob("*.st"))
MUTATIONS = 500
ROUNDS = 10
_TOKEN = re.compile(r"\w+|'[^']*'|\s+|:=|=>|\.\.|[^\w\s]")
_WORDS = [
    "END_IF",
    "THEN",
    "IF",
    "FOR",
    ";",
    "(",
    ")",
    "[",
    "]",
    ":=",
    "=>",
    "^",
    ".",
    "..",
    ",",
    ":",
    "VAR",
    "END_VAR",
    "TYPE",
    "0",
    "16#G",
    "nowhere",
    "TRUE",
    "'text'",
    "REAL",
    "STRING",
    "ARRAY",
    "POINTER",
    "THIS",
    "SUPER^",
    "EXTENDS",
    "NOT",
    "-",
]


def mutated(text: str, seed: int) -> str:
    """The text with one token left out, doubled, swapped or replaced."""
    rng = random.Random(seed)
    tokens = _TOKEN.findall(text)
    solid = [k for k, t in enumerate(tokens) if t.strip()]
    k, other = rng.choice(solid), rng.choice(solid)
    kind = rng.randrange(5)
    if kind == 0:
        tokens[k] = ""
    elif kind == 1:
        tokens[k] += " " + tokens[k]
    elif kind == 2:
        tokens[k], tokens[other] = tokens[other], tokens[k]
    elif kind == 3:
        tokens[k] = rng.choice(_WORDS)
    else:
        tokens[k] += " " + rng.choice(_WORDS)
    return "".join(tokens)


@pytest.mark.parametrize(
    "start", few(range(0, MUTATIONS, MUTATIONS // ROUNDS), 2)
)
@pytest.mark.ci
def test_every_error_of_a_mutated_source_has_a_place(start: int) -> None:
    """Each of 500 seeded mutations is checked without an exception."""
    for seed in range(start, start + MUTATIONS // ROUNDS):
        path = SOURCES[seed % len(SOURCES)]
        text = mutated(path.read_text(), seed)
        found = check({path.name: text})
        for problem in found.log.errors:
            assert problem.line >= 1, (seed, str(problem))
            assert problem.file == path.name, (seed, str(problem))
            assert problem.text, seed
