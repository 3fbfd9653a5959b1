"""Seeded mutations of right sources: each is right or an error with its place."""

from __future__ import annotations

import pytest

from plc_client.st.build import build, check
from plc_client.st.machine.loader import StProgram, StTrap
from support.seeds import few
from support.st_mutations import mutated

LOOP_S = 0.05
SCANS = 3


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
